//! Factor of safety by strength reduction: the largest divisor of the strengths of joints with which blocks rest.
//!
//! Every trial starts from the same state, with strengths divided by one factor, and relaxes: it is stable
//! when it comes to rest. Two trials at once divide what is left of the bracket in three, in the logarithm.

use std::sync::atomic::Ordering;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::error::RunError;
use crate::model::stage::SafetySearch;
use crate::run::Simulation;
use crate::run::relax::Relaxed;
use crate::run::saved::Saved;
use crate::state::watch::Verdict;
use ddem_mechanics::math::simd::Simd;

/// Strengths fall by no more than this factor at once: what many pairs that fail together set free makes others
/// fail that would hold.
const PART: f64 = 1.05;

/// One trial.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SafetyTrial {
    /// Divisor of the strengths.
    pub factor: f64,
    /// Verdict on it; an undecided one counts as unstable.
    pub verdict: Verdict,
    /// Steps that it took.
    pub steps: u64,
}

/// Factor of safety of a state.
#[derive(Debug)]
pub struct Safety {
    /// Geometric mean of the bracket; `None` where one of its ends is missing.
    pub factor: Option<f64>,
    /// The largest factor that is stable and the smallest one that is not, if any; none where the trial of the least
    /// factor was undecided.
    pub bracket: [Option<f64>; 2],
    /// All trials, in the order of their factors.
    pub trials: Vec<SafetyTrial>,
    /// The unstable trial of the smallest factor, as it ended.
    pub failing: Option<Box<Simulation>>,
}

/// True where the trial of a factor was undecided.
#[must_use]
pub fn undecided(trials: &[SafetyTrial], factor: Option<f64>) -> bool {
    trials.iter().any(|trial| Some(trial.factor) == factor && trial.verdict == Verdict::Undecided)
}

impl Simulation {
    /// Factor of safety of the present state, which should be an equilibrium: it stays as it is. Two trials run at
    /// once, on threads of the pool of rayon that calls, each with a copy of the model; `tell` hears of each trial
    /// on its thread.
    ///
    /// # Errors
    ///
    /// [`RunError::Values`] of a search that cannot be, as of a bracket that is none or joints that do not exist, or
    /// where nothing can fail; [told to stop](Self::stop_when); [`RunError::Diverged`], of the present state, too.
    pub fn factor_of_safety(
        &self,
        search: &SafetySearch,
        tell: &(dyn Fn(&SafetyTrial) + Sync),
    ) -> Result<Safety, RunError> {
        let joints = &self.model.properties.joints;
        let broken_joints = |name: &str| {
            let joint = joints.iter().find(|joint| joint.name == name)?;
            Some(joint.law.is_some())
        };
        let faults = search.check(&broken_joints);
        if !faults.is_empty() {
            return Err(RunError::Values { faults });
        }
        if let Some(fault) = self.model.without_strength("") {
            return Err(RunError::Values { faults: vec![fault] });
        }
        let mut found =
            Safety { factor: None, bracket: [None; 2], trials: Vec::new(), failing: None };
        self.try_both(search, search.bracket, &mut found, tell)?;
        while let [Some(stable), Some(unstable)] = found.bracket {
            if unstable - stable <= search.resolution {
                break;
            }
            let ratio = unstable / stable;
            let thirds = [1.0, 2.0].map(|third| stable * libm::pow(ratio, third / 3.0));
            // No number is between them that is fine enough.
            if !(stable < thirds[0] && thirds[1] < unstable) {
                break;
            }
            self.try_both(search, thirds, &mut found, tell)?;
        }
        if let [Some(stable), Some(unstable)] = found.bracket {
            found.factor = Some((stable * unstable).sqrt());
        }
        found.trials.sort_by(|a, b| a.factor.total_cmp(&b.factor));
        if found.bracket[0].is_none() && undecided(&found.trials, found.bracket[1]) {
            // Nothing is known of any factor.
            found.bracket[1] = None;
        }
        Ok(found)
    }

    /// Tries two factors at once.
    fn try_both(
        &self,
        search: &SafetySearch,
        factors: [f64; 2],
        found: &mut Safety,
        tell: &(dyn Fn(&SafetyTrial) + Sync),
    ) -> Result<(), RunError> {
        let saved = self.save();
        let tried = factors.into_par_iter().map(|factor| {
            let tried = self.trial(search, &saved, factor);
            tried.inspect(|(trial, _)| tell(trial))
        });
        for tried in tried.collect::<Vec<_>>() {
            let (trial, mut simulation) = tried?;
            let [stable, unstable] = &mut found.bracket;
            if trial.verdict != Verdict::AtRest {
                if unstable.is_none_or(|known| trial.factor < known) {
                    *unstable = Some(trial.factor);
                    simulation.failing = true;
                    found.failing = Some(Box::new(simulation));
                }
            } else if stable.is_none_or(|known| trial.factor > known) {
                *stable = Some(trial.factor);
            }
            found.trials.push(trial);
        }
        // What holds with less strength than fails with more is on the limit: the failure counts.
        if let [Some(stable), Some(unstable)] = found.bracket
            && stable >= unstable
        {
            let below = found
                .trials
                .iter()
                .filter(|trial| trial.verdict == Verdict::AtRest && trial.factor < unstable);
            found.bracket[0] = below.map(|trial| trial.factor).reduce(f64::max);
        }
        Ok(())
    }

    /// A copy of this simulation in a state that it has been in, with the laws and histories that a program has set.
    ///
    /// # Errors
    ///
    /// The state is of another model, or not finite.
    pub fn back_to(&self, saved: &Saved) -> Result<Self, RunError> {
        let model = self.model.anew().map_err(|fault| RunError::Values { faults: vec![fault] })?;
        let simd = Simd::of(self.scratch.level);
        // Of a run, only a state that is not finite is none to begin from.
        let mut copy = Self::restore(model, simd, saved).map_err(|_| self.diverged())?;
        copy.stop_when(self.stop.clone());
        copy.model.laws.clone_from(&self.model.laws);
        Ok(copy)
    }

    /// Relaxes a copy with strengths divided by a factor, in parts.
    fn trial(
        &self,
        search: &SafetySearch,
        saved: &Saved,
        factor: f64,
    ) -> Result<(SafetyTrial, Self), RunError> {
        let mut trial = self.back_to(saved)?;
        trial.finish_relaxation();
        trial.far = search.limit;
        let joints = self.model.properties.joints.iter().enumerate();
        let divided = joints.filter(|(_, joint)| search.divides(&joint.name));
        let numbers: Vec<usize> = divided.map(|(number, _)| number).collect();
        let laws = trial.model.laws.clone();
        let parts = (libm::log(factor) / libm::log(PART)).ceil().max(1.0);
        let (mut steps, mut part) = (0, 1.0);
        let verdict = loop {
            let divisor = if part < parts { libm::pow(factor, part / parts) } else { factor };
            trial.model.laws.clone_from(&laws);
            trial.reduce_strengths(&numbers, search.joints.is_none(), divisor);
            trial.start_relaxation(1)?;
            let verdict = trial.come_to_rest(search, &mut steps)?;
            if verdict != Verdict::AtRest || part >= parts {
                break verdict;
            }
            part += 1.0;
        };
        Ok((SafetyTrial { factor, verdict, steps }, trial))
    }

    /// Relaxes until there is a verdict, and counts the steps.
    fn come_to_rest(
        &mut self,
        search: &SafetySearch,
        steps: &mut u64,
    ) -> Result<Verdict, RunError> {
        loop {
            match self.relax_step(search.tolerance) {
                Ok(Relaxed::Done) => return Ok(Verdict::AtRest),
                Err(RunError::Collapsed { .. } | RunError::TooDeep { .. }) => {
                    return Ok(Verdict::Fails);
                }
                // Nothing but rounding is out of balance.
                Err(RunError::OutOfReach { .. }) => return Ok(Verdict::AtRest),
                Err(error) => return Err(error),
                Ok(_) if *steps >= search.max_steps => return Ok(Verdict::Undecided),
                Ok(_) => *steps += 1,
            }
            if steps.is_multiple_of(64) && self.stop.load(Ordering::Relaxed) {
                return Err(RunError::Stopped);
            }
        }
    }
}

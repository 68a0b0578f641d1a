//! Factor of safety by strength reduction: the largest divisor of the joint strengths at which the
//! blocks come to rest.
//!
//! Every trial starts from the same state, with the strengths divided by one factor, and relaxes.
//! It is stable if it comes to rest. Two trials at once divide the remaining bracket in three equal
//! ratios.

use std::ops::ControlFlow;
use std::sync::atomic::Ordering;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::error::RunError;
use crate::model::stage::SafetySearch;
use crate::run::Simulation;
use crate::run::relax::Relaxed;
use crate::run::saved::Saved;
use crate::state::profile::Profile;
use crate::state::watch::Verdict;
use ddem_mechanics::math::simd::Simd;

/// Unbalanced force ratio of rounding above which a trial is undecided, as a fraction of the
/// resolution: blocks that slide under so small a force would count as at rest.
const ROUNDED: f64 = 0.1;

/// Largest factor by which strengths are reduced at once. Many pairs that fail together release
/// energy, which makes others fail that would hold.
const PART: f64 = 1.05;

/// Trial of one factor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SafetyTrial {
    /// Divisor of the strengths.
    pub factor: f64,
    /// Verdict of the trial; an undecided one counts as unstable.
    pub verdict: Verdict,
    /// Number of steps of the trial.
    pub steps: u64,
}

/// Progress of a trial that runs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrialProgress {
    /// Number of the trial, from 1, in the order in which the search tries factors.
    pub trial: u64,
    /// Divisor of the strengths at its end; they are reduced in parts.
    pub factor: f64,
    /// Steps so far.
    pub step: u64,
    /// Unbalanced force ratio, if any force is applied.
    pub unbalanced: Option<f64>,
}

/// News of a search, on the thread of a trial.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub enum SearchNews<'a> {
    /// A trial has taken a step.
    Step(&'a TrialProgress),
    /// A trial is done.
    Trial(&'a SafetyTrial),
}

/// Callback for the news of a search; it stops the search by a break.
pub type TellSearch<'a> = dyn Fn(SearchNews<'_>) -> ControlFlow<()> + Sync + 'a;

/// Factor of safety of a state.
#[derive(Debug)]
pub struct Safety {
    /// Geometric mean of the bracket; `None` where one of its ends is missing.
    pub factor: Option<f64>,
    /// Largest stable factor and smallest unstable factor, if any; both are `None` if the trial of
    /// the least factor was undecided.
    pub bracket: [Option<f64>; 2],
    /// All trials, in the order of their factors.
    pub trials: Vec<SafetyTrial>,
    /// Unstable trial of the smallest factor, in its final state.
    pub failing: Option<Box<Simulation>>,
    /// Wall times of all trials. Two trials run at once, so that the sum may exceed the wall time
    /// of the search.
    pub profile: Profile,
}

/// True if the trial of a factor was undecided.
#[must_use]
pub fn undecided(trials: &[SafetyTrial], factor: Option<f64>) -> bool {
    trials.iter().any(|trial| Some(trial.factor) == factor && trial.verdict == Verdict::Undecided)
}

impl Simulation {
    /// Factor of safety of the present state, which should be an equilibrium. The state does not
    /// change. Two trials run at once on the calling pool of rayon, each with a copy of the model.
    /// `tell` receives each trial on its thread.
    ///
    /// # Errors
    ///
    /// [`RunError::Values`] if the search is invalid, for example its bracket or unknown joints, or
    /// if nothing can fail; [stopped](Self::stop_when); [`RunError::Diverged`], also of the present
    /// state.
    pub fn factor_of_safety(
        &self,
        search: &SafetySearch,
        tell: &(dyn Fn(&SafetyTrial) + Sync),
    ) -> Result<Safety, RunError> {
        self.continue_search(search, &[], &|news| {
            if let SearchNews::Trial(trial) = news {
                tell(trial);
            }
            ControlFlow::Continue(())
        })
    }

    /// [`factor_of_safety`](Self::factor_of_safety) that begins with the `known` trials of an
    /// earlier search of the same state, which was stopped. They are not repeated, and the result
    /// has the same bits. Only the unstable trial of the smallest factor runs again if it is among
    /// them, because its final state is part of the result. `tell` receives the news of each trial
    /// on its thread.
    ///
    /// # Errors
    ///
    /// Those of [`factor_of_safety`](Self::factor_of_safety); [`RunError::Stopped`] also if `tell`
    /// breaks.
    pub fn continue_search(
        &self,
        search: &SafetySearch,
        known: &[SafetyTrial],
        tell: &TellSearch<'_>,
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
        let trials = Trials { start: self, saved: self.save(), search, known, tell };
        let mut found = trials.bisect()?;
        trials.finish(&mut found)?;
        found.trials.sort_by(|a, b| a.factor.total_cmp(&b.factor));
        if found.bracket[0].is_none() && undecided(&found.trials, found.bracket[1]) {
            // No factor has a known verdict.
            found.bracket[1] = None;
        }
        Ok(found)
    }

    /// Copy of this simulation in a former state, with the laws and histories that a program has
    /// set.
    ///
    /// # Errors
    ///
    /// The state belongs to another model, or is not finite.
    pub fn back_to(&self, saved: &Saved) -> Result<Self, RunError> {
        let model =
            self.model.rebuilt().map_err(|fault| RunError::Values { faults: vec![fault] })?;
        let simd = Simd::of(self.scratch.level);
        // Among the states of a run, only one that is not finite cannot be restored.
        let mut copy = Self::restore(model, simd, saved).map_err(|_| self.diverged())?;
        copy.stop_when(self.stop.clone());
        copy.set_clock(self.scratch.profiler.clock);
        copy.model.laws.clone_from(&self.model.laws);
        Ok(copy)
    }
}

/// Trials of a search.
struct Trials<'a> {
    start: &'a Simulation,
    /// State of `start`.
    saved: Saved,
    search: &'a SafetySearch,
    /// Trials of an earlier search of this state.
    known: &'a [SafetyTrial],
    tell: &'a TellSearch<'a>,
}

impl Trials<'_> {
    /// Tries pairs of factors until the bracket is as narrow as the resolution.
    fn bisect(&self) -> Result<Safety, RunError> {
        let mut found = Safety {
            factor: None,
            bracket: [None; 2],
            trials: Vec::new(),
            failing: None,
            profile: Profile::default(),
        };
        self.try_both(self.search.bracket, &mut found)?;
        while let [Some(stable), Some(unstable)] = found.bracket {
            if unstable - stable <= self.search.resolution {
                break;
            }
            let ratio = unstable / stable;
            let thirds = [1.0, 2.0].map(|third| stable * libm::pow(ratio, third / 3.0));
            // The bracket is too narrow for two numbers between its ends.
            if !(stable < thirds[0] && thirds[1] < unstable) {
                break;
            }
            self.try_both(thirds, &mut found)?;
        }
        if let [Some(stable), Some(unstable)] = found.bracket {
            found.factor = Some((stable * unstable).sqrt());
        }
        Ok(found)
    }

    /// Runs the trials of two factors at once, unless they are known.
    fn try_both(&self, factors: [f64; 2], found: &mut Safety) -> Result<(), RunError> {
        let before = found.trials.len() as u64;
        let tried = factors.into_par_iter().zip([1, 2]).map(|(factor, number)| {
            if let Some(known) = self.known.iter().find(|known| known.factor == factor) {
                return Ok((*known, None));
            }
            let (trial, simulation) = self.run(factor, before + number)?;
            match (self.tell)(SearchNews::Trial(&trial)) {
                ControlFlow::Continue(()) => Ok((trial, Some(simulation))),
                ControlFlow::Break(()) => Err(RunError::Stopped),
            }
        });
        for tried in tried.collect::<Vec<_>>() {
            let (trial, mut simulation) = tried?;
            if let Some(simulation) = &mut simulation {
                found.profile.add(&simulation.take_profile(), 1.0);
            }
            let [stable, unstable] = &mut found.bracket;
            if trial.verdict != Verdict::AtRest {
                if unstable.is_none_or(|known| trial.factor < known) {
                    *unstable = Some(trial.factor);
                    found.failing = simulation.map(Box::new);
                }
            } else if stable.is_none_or(|known| trial.factor > known) {
                *stable = Some(trial.factor);
            }
            found.trials.push(trial);
        }
        // A larger factor that is stable, above one that fails, is at the limit: the failure
        // counts.
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

    /// Gives the unstable trial of the smallest factor in its final state, which a known trial has
    /// not.
    fn finish(&self, found: &mut Safety) -> Result<(), RunError> {
        let Some(unstable) = found.bracket[1] else { return Ok(()) };
        if found.failing.is_none() {
            let place = found.trials.iter().position(|trial| trial.factor == unstable);
            let (_, simulation) = self.run(unstable, place.map_or(0, |place| place as u64 + 1))?;
            found.failing = Some(Box::new(simulation));
        }
        if let Some(failing) = &mut found.failing {
            failing.failing = true;
        }
        Ok(())
    }

    /// Relaxes a copy with the strengths divided by a factor, reduced in parts.
    fn run(&self, factor: f64, trial: u64) -> Result<(SafetyTrial, Simulation), RunError> {
        let search = self.search;
        let mut simulation = self.start.back_to(&self.saved)?;
        simulation.finish_relaxation();
        simulation.far = search.limit;
        let joints = self.start.model.properties.joints.iter().enumerate();
        let divided = joints.filter(|(_, joint)| search.divides(&joint.name));
        let numbers: Vec<usize> = divided.map(|(number, _)| number).collect();
        let laws = simulation.model.laws.clone();
        let parts = (libm::log(factor) / libm::log(PART)).ceil().max(1.0);
        let mut progress = TrialProgress { trial, factor, step: 0, unbalanced: None };
        let mut part = 1.0;
        let verdict = loop {
            let divisor = if part < parts { libm::pow(factor, part / parts) } else { factor };
            simulation.model.laws.clone_from(&laws);
            simulation.reduce_strengths(&numbers, search.joints.is_none(), divisor);
            simulation.start_relaxation(1)?;
            let verdict = self.come_to_rest(&mut simulation, &mut progress)?;
            if verdict != Verdict::AtRest || part >= parts {
                break verdict;
            }
            part += 1.0;
        };
        Ok((SafetyTrial { factor, verdict, steps: progress.step }, simulation))
    }

    /// Relaxes until there is a verdict, and counts the steps.
    fn come_to_rest(
        &self,
        simulation: &mut Simulation,
        progress: &mut TrialProgress,
    ) -> Result<Verdict, RunError> {
        let search = self.search;
        loop {
            match simulation.relax_step(search.tolerance) {
                Ok(Relaxed::Done) => return Ok(Verdict::AtRest),
                Err(RunError::NoEquilibrium { .. } | RunError::DeepPenetration { .. }) => {
                    return Ok(Verdict::Fails);
                }
                // Only rounding is out of balance.
                Err(RunError::UnreachableTolerance { ratio, .. }) => {
                    let is_small = ratio <= ROUNDED * search.resolution;
                    return Ok(if is_small { Verdict::AtRest } else { Verdict::Undecided });
                }
                Err(error) => return Err(error),
                Ok(_) if progress.step >= search.max_steps => return Ok(Verdict::Undecided),
                Ok(_) => progress.step += 1,
            }
            let ratio = simulation.unbalanced();
            progress.unbalanced = ratio.is_finite().then_some(ratio);
            let told = (self.tell)(SearchNews::Step(progress));
            if told.is_break() || simulation.stop.load(Ordering::Relaxed) {
                return Err(RunError::Stopped);
            }
        }
    }
}

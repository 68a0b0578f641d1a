//! Factor of safety by strength reduction: the largest divisor of the joint strengths at which the
//! blocks come to rest.
//!
//! A trial divides the strengths by one factor and relaxes. It is stable if it comes to rest. Factors
//! rise in rungs of 5 % until one is not stable, each from the equilibrium of the one before. Two
//! trials at once then divide the remaining bracket in three equal ratios, from the last equilibrium.

mod rungs;
mod trials;

use std::ops::ControlFlow;

use serde::{Deserialize, Serialize};

use crate::error::RunError;
use crate::model::stage::SafetySearch;
use crate::run::Simulation;
use crate::run::saved::Saved;
use crate::state::profile::Profile;
use crate::state::watch::Verdict;
use ddem_mechanics::math::simd::Simd;
pub use rungs::most_trials;
use trials::Trials;

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
    /// Divisor of the strengths at its end.
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
    /// Wall times of all trials. Two trials may run at once, so that the sum may exceed the wall time
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
    /// change. Two trials at most run at once on the calling pool of rayon, each with a copy of the model.
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
    /// earlier search of the same state, which was stopped. The result has the same bits. Of the known
    /// trials the stable rungs run again, from which others begin, and the unstable one of the smallest
    /// factor, whose final state is part of the result. `tell` receives the news of each trial on its
    /// thread; of those that run again it receives the steps only.
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
            let joint = joints.iter().find(|joint| joint.name == name && !joint.is_whole_rock())?;
            Some(joint.law.is_some())
        };
        let faults = search.check(&broken_joints);
        if !faults.is_empty() {
            return Err(RunError::Values { faults });
        }
        if let Some(fault) = self.model.without_strength("") {
            return Err(RunError::Values { faults: vec![fault] });
        }
        let divided = joints.iter().enumerate().filter(|(_, joint)| search.divides(&joint.name));
        let divided = divided.map(|(number, _)| number).collect();
        let trials = Trials { start: self, search, divided, known, tell };
        let mut found = trials.find()?;
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

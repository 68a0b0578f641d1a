//! Loads that are in force and do not act, and what has come to its end.

use super::{Conditions, LoadPattern, SupportGroup, TimedCharge};
use crate::model::history::TimeFunction;

impl Conditions {
    /// Loads in force in a stage whose history is 0 when the stage is the first to see them.
    pub fn resting(&self, stage: usize) -> Vec<usize> {
        let rests = |load: &LoadPattern| {
            if load.fading.is_some() {
                return false;
            }
            let first = load.in_force.from.unwrap_or(0) == stage;
            let zero =
                matches!(&load.history, TimeFunction::Given(history) if history.factor(0.0) == 0.0);
            load.in_force.has(stage) && first && zero
        };
        (0..self.loaded.len()).filter(|&load| rests(&self.loaded[load])).collect()
    }

    /// Loads in force at a time whose history is 0 then.
    pub(crate) fn idle(
        &self,
        stage: usize,
        time: f64,
        starts: &[f64],
        n_loads: usize,
    ) -> Vec<usize> {
        let factors = self.factors(stage, time, starts).unwrap_or_default();
        let varies = |load: &LoadPattern| !matches!(load.history, TimeFunction::Constant);
        let idle = |&index: &usize| {
            let load = &self.loaded[index];
            load.in_force.has(stage) && varies(load) && factors.get(index) == Some(&0.0)
        };
        (0..n_loads).filter(idle).collect()
    }

    /// True if a load, charge or driven support in force may change after a time.
    pub(crate) fn change_after(&self, stage: usize, time: f64, starts: &[f64]) -> bool {
        let load = |load: &LoadPattern| load.acts(stage) && load.changes_after(time, starts);
        let charge = |charged: &TimedCharge| {
            let since = charged.in_force.since(time, starts) - charged.delay;
            charged.in_force.has(stage) && (since < 0.0 || charged.history.changes_after(since))
        };
        let fix = |fix: &SupportGroup| {
            let since = fix.in_force.since(time, starts);
            let moves = fix.history.factor(since).is_ok_and(|factor| factor != 0.0);
            let driven = fix.in_force.has(stage)
                && fix.velocity.is_some_and(|velocity| velocity != [0.0; 3]);
            driven && (moves || fix.history.changes_after(since))
        };
        self.loaded.iter().any(load)
            || self.charged.iter().any(charge)
            || self.fixed.iter().any(fix)
    }
}

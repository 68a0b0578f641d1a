//! Loads in force that do not act, and changes that are still to come.

use super::{Conditions, LoadPattern, SupportGroup, TimedCharge};
use crate::model::history::TimeFunction;

impl Conditions {
    /// Loads that come into force in a stage and whose given history starts at 0.
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

    /// Loads in force whose history is 0 at a time.
    pub(crate) fn loads_at_zero(
        &self,
        stage: usize,
        time: f64,
        starts: &[f64],
        n_loads: usize,
    ) -> Vec<usize> {
        let factors = self.factors(stage, time, starts).unwrap_or_default();
        let varies = |load: &LoadPattern| !matches!(load.history, TimeFunction::Constant);
        let loads_at_zero = |&index: &usize| {
            let load = &self.loaded[index];
            load.in_force.has(stage) && varies(load) && factors.get(index) == Some(&0.0)
        };
        (0..n_loads).filter(loads_at_zero).collect()
    }

    /// True if a load or a charge in force may change after a time, or if a driven support moves
    /// then or may move later.
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

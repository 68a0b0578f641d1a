//! Loads that are in force and do not act.

use super::{Conditions, Loaded};
use crate::history::Course;

impl Conditions {
    /// Loads in force in a stage whose history is 0 when the stage is the first to see them.
    pub(crate) fn resting(&self, stage: usize) -> Vec<usize> {
        let rests = |load: &Loaded| {
            if load.fading.is_some() {
                return false;
            }
            let first = load.period.from.unwrap_or(0) == stage;
            let zero =
                matches!(&load.history, Course::Given(history) if history.factor(0.0) == 0.0);
            load.period.has(stage) && first && zero
        };
        (0..self.loaded.len()).filter(|&load| rests(&self.loaded[load])).collect()
    }

    /// Loads in force at a time whose history is 0 then.
    pub(crate) fn idle(
        &self,
        (stage, time): (usize, f64),
        starts: &[f64],
        deck_loads: usize,
    ) -> Vec<usize> {
        let factors = self.factors(stage, time, starts).unwrap_or_default();
        let varies = |load: &Loaded| !matches!(load.history, Course::Constant);
        let idle = |&index: &usize| {
            let load = &self.loaded[index];
            load.period.has(stage) && varies(load) && factors.get(index) == Some(&0.0)
        };
        (0..deck_loads).filter(idle).collect()
    }
}

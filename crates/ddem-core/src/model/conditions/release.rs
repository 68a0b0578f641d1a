//! Forces of removed blocks as fading loads.

use serde::{Deserialize, Serialize};

use super::{AppliedForces, Conditions, Factor, LoadPattern};
use ddem_mesh::Vec3;

/// Forces of removed blocks that fade.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct FadingForces {
    /// Start time of the fading `[s]`.
    pub(crate) start_time: f64,
    /// Forces by node `[N]`.
    pub(crate) forces: AppliedForces,
}

/// Fading of the forces of removed blocks.
#[derive(Clone, Debug)]
pub struct ForceFading {
    /// Stage at whose start the fading begins.
    pub(crate) from: usize,
    /// True if the forces fade with time; otherwise they vanish at once.
    pub(crate) fades: bool,
    /// Relax stages of the run; each of them removes the forces regardless of the time.
    pub(super) relaxing: Vec<usize>,
    /// Start time of the fading `[s]`. It is stored because its stage may be entered again.
    pub(super) start_time: f64,
}

impl ForceFading {
    /// Fading that begins with the stage `from`. Without `fades` the forces vanish at once. The
    /// stages `relaxing` remove them.
    #[must_use]
    pub fn new(from: usize, fades: bool, relaxing: Vec<usize>) -> Self {
        Self { from, fades, relaxing, start_time: 0.0 }
    }
}

impl LoadPattern {
    pub(super) fn acts(&self, stage: usize) -> bool {
        // Relax stages remove fading forces regardless of the time.
        let removes = |fading: &ForceFading, relax: &usize| (fading.from..=stage).contains(relax);
        match &self.fading {
            Some(fading) => !fading.relaxing.iter().any(|relax| removes(fading, relax)),
            None => self.in_force.has(stage),
        }
    }

    pub(super) fn factor(&self, time: f64, starts: &[f64]) -> Factor {
        match &self.fading {
            Some(fading) => Factor::of(&self.history, time - fading.start_time),
            None => self.in_force.factor(&self.history, time, starts),
        }
    }

    /// True if its forces may change after a time.
    pub(super) fn changes_after(&self, time: f64, starts: &[f64]) -> bool {
        let since = match &self.fading {
            Some(fading) => time - fading.start_time,
            None => self.in_force.since(time, starts),
        };
        self.history.changes_after(since)
    }

    /// Sets the forces and the start time of their fading.
    pub(crate) fn release(&mut self, released: &FadingForces) {
        let FadingForces { start_time, forces } = released;
        self.forces = forces.iter().map(|(&node, &f)| (node, Vec3::from(f))).collect();
        if let Some(fading) = &mut self.fading {
            fading.start_time = *start_time;
        }
    }
}

impl Conditions {
    /// Initial load factors of the first relaxation of a model with an in-situ stress, which
    /// carries all loads at once. Only the forces of removed blocks start from their factors `now`.
    pub(crate) fn at_once(&self, to: &[f64], now: &[f64]) -> Vec<f64> {
        let mut from = to.to_vec();
        let loads = self.loaded.iter().zip(from.iter_mut().zip(now));
        loads.filter(|(load, _)| load.fading.is_some()).for_each(|(_, (from, now))| *from = *now);
        from
    }
}

//! The forces of blocks that are taken out, as loads that fade.

use serde::{Deserialize, Serialize};

use super::{AppliedForces, Conditions, Factor, LoadPattern};
use ddem_mesh::Vec3;

/// Forces of removed blocks that fade.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct FadingForces {
    /// Start time of the fading `[s]`.
    pub(crate) began: f64,
    /// By node `[N]`.
    pub(crate) forces: AppliedForces,
}

/// Fading of the forces of removed blocks.
#[derive(Clone, Debug)]
pub struct ForceFading {
    /// The stage at whose start they begin to.
    pub(crate) from: usize,
    /// True if the forces fade with time; otherwise they vanish at once.
    pub(crate) fades: bool,
    /// Relax stages, which take them back whatever the time.
    pub(super) relaxing: Vec<usize>,
    /// Start time of the fading `[s]`; the stage that starts it may begin anew.
    pub(super) began: f64,
}

impl ForceFading {
    /// Forces that begin to fade as a stage begins, or go at once; a relaxation takes them back.
    #[must_use]
    pub fn new(from: usize, fades: bool, relaxing: Vec<usize>) -> Self {
        Self { from, fades, relaxing, began: 0.0 }
    }
}

impl LoadPattern {
    pub(super) fn acts(&self, stage: usize) -> bool {
        // Relax stages take back what fades, whatever the time.
        let taken = |fading: &ForceFading, relax: &usize| (fading.from..=stage).contains(relax);
        match &self.fading {
            Some(fading) => !fading.relaxing.iter().any(|relax| taken(fading, relax)),
            None => self.in_force.has(stage),
        }
    }

    pub(super) fn factor(&self, time: f64, starts: &[f64]) -> Factor {
        match &self.fading {
            Some(fading) => Factor::of(&self.history, time - fading.began),
            None => self.in_force.factor(&self.history, time, starts),
        }
    }

    /// True if its forces may change after a time.
    pub(super) fn changes_after(&self, time: f64, starts: &[f64]) -> bool {
        let since = match &self.fading {
            Some(fading) => time - fading.began,
            None => self.in_force.since(time, starts),
        };
        self.history.changes_after(since)
    }

    /// Sets the forces, and how far they are.
    pub(crate) fn release(&mut self, released: &FadingForces) {
        let FadingForces { began, forces } = released;
        self.forces = forces.iter().map(|(&node, &f)| (node, Vec3::from(f))).collect();
        if let Some(fading) = &mut self.fading {
            fading.began = *began;
        }
    }
}

impl Conditions {
    /// Factors from which loads go to those of the first relaxation where there is a stress at the start,
    /// which bears all of them at once: only what removed blocks exerted goes from where it is `now`.
    pub(crate) fn at_once(&self, to: &[f64], now: &[f64]) -> Vec<f64> {
        let mut from = to.to_vec();
        let loads = self.loaded.iter().zip(from.iter_mut().zip(now));
        loads.filter(|(load, _)| load.fading.is_some()).for_each(|(_, (from, now))| *from = *now);
        from
    }
}

//! Progress of the work from a deck to a model, which takes minutes if cuts make many cells.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// Work on a model before its first step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum BuildPhase {
    /// Checks of the deck and shapes of its regions.
    #[default]
    Check,
    /// A cut of regions.
    Cut {
        /// Number of the cut, from 0.
        number: usize,
        /// Number of cuts.
        cuts: usize,
    },
    /// Blocks with their elements.
    Blocks,
    /// Joints between the blocks.
    Joints,
    /// Model of the whole, with its contacts.
    Model,
    /// Warnings, time step and estimates.
    Report,
}

/// Progress that other threads read while a model is built.
#[derive(Debug, Default)]
pub struct BuildProgress {
    phase: Mutex<BuildPhase>,
    cells: Arc<AtomicUsize>,
}

impl BuildProgress {
    /// Begins a phase.
    pub fn enter(&self, phase: BuildPhase) {
        *self.phase.lock().unwrap_or_else(PoisonError::into_inner) = phase;
    }

    /// The present phase.
    #[must_use]
    pub fn phase(&self) -> BuildPhase {
        *self.phase.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Cells that the cuts of regions have made so far.
    #[must_use]
    pub fn cells(&self) -> usize {
        self.cells.load(Ordering::Relaxed)
    }

    /// Counter of the cells, for the cuts.
    pub(super) fn counter(&self) -> Arc<AtomicUsize> {
        self.cells.clone()
    }
}

//! Progress of the work from a deck to a model, which takes minutes if cuts make many cells.

use std::sync::atomic::{AtomicU8, AtomicUsize, Ordering};
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

/// Building of a model goes on.
const BUILDING: u8 = 0;
/// The model was built before anybody abandoned it.
const BUILT: u8 = 1;
/// Nobody waits for the model.
const ABANDONED: u8 = 2;

/// Progress that other threads read while a model is built. They may abandon the model.
#[derive(Debug, Default)]
pub struct BuildProgress {
    phase: Mutex<BuildPhase>,
    cells: Arc<AtomicUsize>,
    end: AtomicU8,
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

    /// Ends the building: files may be written from now on. Returns false if the model has been
    /// abandoned.
    #[must_use]
    pub fn finish(&self) -> bool {
        self.ended_by(BUILT)
    }

    /// Abandons the model. Returns true if it has not been finished: nothing will be written.
    #[must_use]
    pub fn abandon(&self) -> bool {
        self.ended_by(ABANDONED)
    }

    /// Ends the building in one way. Returns false if it has ended in the other.
    fn ended_by(&self, end: u8) -> bool {
        let before = self.end.compare_exchange(BUILDING, end, Ordering::Relaxed, Ordering::Relaxed);
        before.map_or_else(|before| before == end, |_| true)
    }

    /// Counter of the cells, for the cuts.
    pub(super) fn counter(&self) -> Arc<AtomicUsize> {
        self.cells.clone()
    }
}

//! Progress of a running stage.

use std::time::{Duration, Instant};

use ddem_deck::StageKind;

use super::super::Progress;
use super::{MovedBy, Running};

/// Wall-clock time between two searches for the fastest block, which read all nodes.
const SEARCH: Duration = Duration::from_secs(1);

impl Running<'_> {
    /// Finds the fastest block of a dynamic stage, if it was not found lately, and at the end.
    pub(super) fn find_fastest(&mut self, now: Instant) {
        let ended = self.counters.ended;
        let (fastest, found) = &mut self.counters.fastest;
        let is_old = ended || found.is_none_or(|found| now - found >= SEARCH);
        if self.stage.kind == StageKind::Dynamic && is_old {
            (*fastest, *found) = (self.moved.simulation.fastest_block(), Some(now));
        }
    }

    pub(super) fn progress(&self) -> Progress {
        let MovedBy { simulation, cursor, .. } = &*self.moved;
        let relax = self.relax();
        let step = cursor.step.unwrap_or(0);
        let left = if relax { None } else { simulation.steps_left() };
        let steps = left.map_or(cursor.steps, |left| step + left);
        let here = step - self.counters.steps_before;
        let seconds = self.seconds();
        let rate = if seconds > 0.0 { here as f64 / seconds } else { 0.0 };
        let left = (steps.saturating_sub(step)) as f64 / rate;
        Progress {
            stage: self.stage.name.clone(),
            // A stage of a program is the only one that is known.
            stage_index: (cursor.stage.min(self.counters.stages - 1), self.counters.stages),
            relax,
            step,
            steps,
            time: simulation.time(),
            unbalanced: simulation.unbalanced(),
            tolerance: self.tolerance(),
            failed_pairs: simulation.failed_pairs().iter().sum(),
            contacts: simulation.touching_blocks() as u64,
            fastest: self.counters.fastest.0.clone(),
            updates_per_second: rate * simulation.model().n_nodes() as f64,
            seconds_left: (!relax && left.is_finite()).then_some(left),
            search: None,
        }
    }
}

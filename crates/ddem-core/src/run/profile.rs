//! Profile of a simulation by phase.

use super::Simulation;
use crate::state::profile::{Clock, Profile};

impl Simulation {
    /// Measures the wall time of each phase from now on with a clock of the program, or no longer
    /// with `None`. The results keep their bits. By default nothing is measured.
    pub fn set_clock(&mut self, clock: Option<Clock>) {
        self.scratch.uncounted().set_clock(clock);
    }

    /// Wall times since the last call, or since [`set_clock`](Self::set_clock); 0 without a clock.
    pub fn take_profile(&mut self) -> Profile {
        std::mem::take(&mut self.scratch.uncounted().profiler.profile)
    }
}

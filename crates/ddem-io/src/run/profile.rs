//! Measurement of the wall times of a stage by phase.

use std::sync::OnceLock;
use std::time::{Duration, Instant};

use ddem_core::{Profile, Simulation};

use crate::summary::StageProfile;

/// Times of the present stage. It measures nothing unless the run is profiled.
#[derive(Debug, Default)]
pub(super) struct StageTimer {
    profiled: bool,
    /// Start of the stage or, in the first stage, of the run.
    start: Option<Instant>,
    profile: StageProfile,
}

/// Clock for the core `[s]`.
fn seconds() -> f64 {
    static START: OnceLock<Instant> = OnceLock::new();
    START.get_or_init(Instant::now).elapsed().as_secs_f64()
}

impl StageTimer {
    /// Timer of a run that began at `start`; it gives the simulation a clock.
    pub(super) fn profiled(start: Instant, simulation: &mut Simulation) -> Self {
        simulation.set_clock(Some(seconds));
        Self { profiled: true, start: Some(start), ..Self::default() }
    }

    /// Begins a stage, unless it is the first one, which began with the run.
    pub(super) fn enter(&mut self) {
        if self.profiled {
            self.start.get_or_insert_with(Instant::now);
        }
    }

    /// Books the time since the stage began as start-up, for a simulation that is about to step.
    pub(super) fn started(&mut self, simulation: &mut Simulation) {
        if let (true, Some(start)) = (self.profiled, self.start) {
            simulation.take_profile();
            let start_up = start.elapsed().as_secs_f64();
            let steps = Profile { start_up, ..Profile::default() };
            self.profile = StageProfile { steps, ..StageProfile::default() };
        }
    }

    /// Books the steps up to now, before results are computed.
    pub(super) fn stepped(&mut self, simulation: &mut Simulation) {
        if self.profiled {
            self.profile.steps.add(&simulation.take_profile(), 1.0);
        }
    }

    /// Books time for results, in which the simulation has measured its state.
    pub(super) fn recorded(&mut self, time: Duration, simulation: &mut Simulation) {
        if self.profiled {
            simulation.take_profile();
            self.profile.output += time.as_secs_f64();
        }
    }

    /// Replaces the times of the steps by those of trials that ran at once. They are scaled to the
    /// wall time of the trials.
    pub(super) fn tried(&mut self, trials: &Profile, wall: Duration) {
        let sum = trials.total();
        if self.profiled && sum > 0.0 {
            self.profile.steps.add(trials, (wall.as_secs_f64() / sum).min(1.0));
        }
    }

    /// Ends the stage; `None` if the run is not profiled.
    pub(super) fn finish(&mut self) -> Option<StageProfile> {
        let start = self.start.take().filter(|_| self.profiled)?;
        let mut profile = std::mem::take(&mut self.profile);
        profile.other = (start.elapsed().as_secs_f64() - profile.total()).max(0.0);
        Some(profile)
    }
}

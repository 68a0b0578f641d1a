//! Simulation with everything that moves along with it.

use ddem_core::{RunError, Simulation};
use ddem_deck::{BuiltDeck, Stage, StageKind};

use super::RunFailure;
use super::profile::StageTimer;
use super::record::Recorder;
use super::report::limit;
use super::resume::Cursor;
use super::stage::failed;

/// Simulation that a stage moves, with its deck, its recorder and its cursor.
#[derive(Debug)]
pub(super) struct MovedBy {
    pub(super) site: BuiltDeck,
    pub(super) simulation: Simulation,
    pub(super) recorder: Recorder,
    pub(super) cursor: Cursor,
    pub(super) timer: StageTimer,
}

impl MovedBy {
    pub(super) fn begin(&mut self, stage: &Stage) -> Result<(), RunError> {
        let Self { site, simulation, cursor, .. } = self;
        cursor.steps = match stage.kind {
            StageKind::Relax | StageKind::Safety => {
                let increments =
                    stage.increments.unwrap_or_else(|| simulation.default_increments());
                simulation.start_relaxation(increments)?;
                stage.max_steps()
            }
            StageKind::Dynamic => {
                let (damping, step) = (stage.damping, stage.time_step);
                simulation.start(
                    damping.unwrap_or_default(),
                    step.unwrap_or_default(),
                    stage.duration,
                )?
            }
        };
        cursor.limit = match stage.kind {
            StageKind::Dynamic => limit(simulation, site.deck()),
            StageKind::Relax | StageKind::Safety => None,
        };
        cursor.step = Some(0);
        cursor.begun = simulation.time();
        let energy = simulation.energy();
        (cursor.friction, cursor.imbalance) = (energy.friction, energy.imbalance());
        cursor.time_step = simulation.time_step();
        Ok(())
    }

    /// Takes one step of motion. Returns true at the end of the stage.
    pub(super) fn step(&mut self, stage: &Stage) -> Result<bool, RunFailure> {
        self.simulation.step().map_err(failed(stage))?;
        let step = self.cursor.step.unwrap_or(0) + 1;
        self.cursor.step = Some(step);
        Ok(self.simulation.steps_left() == Some(0))
    }

    /// Completed steps of the stage; in motion, in steps of the initial length, which become
    /// shorter when joints fail.
    pub(super) fn nominal(&self, relax: bool) -> u64 {
        if relax {
            return self.cursor.step.unwrap_or(0);
        }
        let done = (self.simulation.time() - self.cursor.begun) / self.cursor.time_step;
        (done + 1e-6) as u64
    }
}

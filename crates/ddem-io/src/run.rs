//! Run of a deck from start to end: stages, results and checkpoints.

mod cell_step;
mod drive;
mod failure;
mod files;
mod given_steps;
mod mesh;
mod moved;
mod open_stage;
mod plan;
mod probe;
mod profile;
mod record;
mod report;
mod resume;
mod safety;
mod session;
mod stage;
#[cfg(test)]
mod tests;
mod tracker;
mod warnings;

pub use cell_step::CellStep;
pub use drive::run;
pub use failure::RunFailure;
pub use open_stage::{OpenStage, StageStatus};
pub use plan::Plan;
pub use report::{Report, inspect, inspect_with_progress};
pub use session::{Session, model_name};
pub use tracker::Tracker;

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use ddem_core::{FastestBlock, Simd, TrialProgress};
use ddem_deck::BuildProgress;
use ddem_deck::lint::Diagnostic;

use crate::folder::Earlier;
use crate::summary::{StageSummary, TimeStepLimit};

/// Options of a run.
#[derive(Clone, Debug)]
pub struct Options {
    /// Folder of the results.
    pub out: PathBuf,
    /// Number of threads; default one for each processor. Results do not depend on it.
    pub threads: Option<usize>,
    /// Treatment of earlier results in `out`.
    pub earlier: Earlier,
    /// Wall time between checkpoints within a stage; `None` for that of the deck.
    pub checkpoint_every: Option<Duration>,
    /// Instruction set of the kernels. Results do not depend on it.
    pub simd: Simd,
    /// True to measure the wall time of each phase of the steps. Results do not depend on it.
    pub profile: bool,
}

impl Options {
    /// Default options, with the results in `out`.
    pub fn new(out: impl Into<PathBuf>) -> Self {
        Self {
            out: out.into(),
            threads: None,
            earlier: Earlier::Keep,
            checkpoint_every: None,
            simd: Simd::default(),
            profile: false,
        }
    }
}

/// Progress of a run. Times are wall times in seconds unless simulated.
#[derive(Clone, Debug, PartialEq)]
pub struct Progress {
    /// Name of the stage.
    pub stage: String,
    /// Number of the stage, from 0, and number of stages.
    pub stage_index: (usize, usize),
    /// True in relaxation and in a search for the factor of safety, false in motion.
    pub relax: bool,
    /// Steps of this stage so far; in a search those of all trials.
    pub step: u64,
    /// Steps that the stage will take; in relaxation the largest number.
    pub steps: u64,
    /// Simulated time `[s]`.
    pub time: f64,
    /// Unbalanced force ratio; in a search the largest of the trials that run.
    pub unbalanced: f64,
    /// Unbalanced ratio at which relaxation, or a trial, ends.
    pub tolerance: f64,
    /// Failed pairs.
    pub failed_pairs: u64,
    /// Pairs of blocks that press on each other without a joint.
    pub contacts: u64,
    /// The fastest block of a dynamic stage, found once a second.
    pub fastest: Option<FastestBlock>,
    /// Node updates per second in this stage.
    pub updates_per_second: f64,
    /// Wall time left in the stage `[s]`, if it can be estimated.
    pub seconds_left: Option<f64>,
    /// Trials of a search for the factor of safety.
    pub search: Option<SearchProgress>,
}

/// Progress of a search for the factor of safety.
#[derive(Clone, Debug, PartialEq)]
pub struct SearchProgress {
    /// Number of trials that are done.
    pub done: u64,
    /// Largest number of trials.
    pub most: u64,
    /// Trials that run, in their order.
    pub running: Vec<TrialProgress>,
}

/// Event of a run.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum Event<'a> {
    /// Nothing was saved in this folder yet, so that a run that was to resume starts from the beginning.
    NothingSaved(&'a std::path::Path),
    /// The last checkpoint is damaged, for this reason; the run continues from the one before it.
    DamagedCheckpoint(&'a str),
    /// Earlier results were moved to this folder.
    Kept(&'a std::path::Path),
    /// The model is built; the run begins or continues.
    Built(&'a Report),
    /// Warning about something that is allowed but may be unintended.
    Warning(&'a Diagnostic),
    /// Part of the model that limits the time step of the dynamic stage that begins.
    StepLimit {
        /// Name of the stage.
        stage: &'a str,
        /// Step and limit.
        limit: &'a TimeStepLimit,
    },
    /// A stage begins.
    StageStarted(&'a Progress),
    /// Progress, about ten times a second and at the end of each stage.
    Progress(&'a Progress),
    /// A stage is done.
    StageDone(&'a StageSummary),
    /// Probes have been sampled: one number for each column of each probe, `None` for probes that
    /// were not due.
    Sample {
        /// Steps since the start of the run.
        step: u64,
        /// Simulated time `[s]`.
        time: f64,
        /// The numbers.
        values: &'a [Option<f64>],
    },
    /// A factor of safety has been tried.
    Trial {
        /// Name of the stage.
        stage: &'a str,
        /// The factor and the outcome of its trial.
        trial: &'a ddem_core::SafetyTrial,
    },
    /// A checkpoint has been written.
    Checkpoint(&'a std::path::Path),
}

/// Observer of a run, which may stop it.
pub trait Observer: Send {
    /// Handles an event.
    fn event(&mut self, event: Event<'_>);

    /// True if the run must stop after a checkpoint; called at every step.
    fn wants_to_stop(&mut self) -> bool {
        false
    }

    /// Flag that ends long work before the first step when it becomes true; called at the start.
    fn stop_flag(&self) -> Arc<AtomicBool> {
        Arc::default()
    }

    /// Progress of the work before the first event, which threads of the observer may read; called at the start. They may
    /// abandon it before anything is written: the run then fails with [`RunFailure::Stopped`].
    fn build_progress(&self) -> Arc<BuildProgress> {
        Arc::default()
    }
}

/// Outcome of a run.
#[derive(Debug)]
pub enum Outcome {
    /// All stages are done; the session at its end.
    Done(Box<Session>),
    /// Stopped on request; the checkpoint from which to resume.
    Interrupted(PathBuf),
}

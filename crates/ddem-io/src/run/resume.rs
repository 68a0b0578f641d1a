//! Checkpoints of a run: the simulation, and the progress of stages and files.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use ddem_core::{ErrorCode, Model, SafetyTrial, Saved, Simd, Simulation};
use ddem_deck::BuiltDeck;
use ddem_deck::lint::Diagnostic;
use serde::{Deserialize, Serialize};

use super::RunFailure;
use super::files::Position;
use crate::OutputError;
use crate::checkpoint::{self, Checkpoint};
use crate::summary::{StageSummary, TimeStepLimit};

/// Position of a run between two steps.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Cursor {
    /// Number of the running or next stage.
    pub(super) stage: usize,
    /// Completed steps of that stage; `None` before it begins.
    pub(super) step: Option<u64>,
    /// Steps of that stage, as planned at its start.
    pub(super) steps: u64,
    /// Time at which it began, and its first time step `[s]`.
    pub(super) begun: f64,
    pub(super) time_step: f64,
    /// Part of the model that limits that step.
    pub(super) limit: Option<TimeStepLimit>,
    /// Friction loss when it began `[J]`.
    pub(super) friction: f64,
    /// Energy imbalance at its start, relative to the largest energy.
    pub(super) imbalance: f64,
    /// Wall time that it has taken `[s]`.
    pub(super) seconds: f64,
    /// Trials of a search for the factor of safety that are done.
    pub(super) trials: Vec<SafetyTrial>,
    /// State at the start of a stage whose failure leads back to it.
    pub(super) start: Option<Saved>,
    /// Summaries of completed stages.
    #[serde(with = "as_json")]
    pub(super) done: Vec<StageSummary>,
    /// Diagnostics so far.
    pub(super) warnings: Vec<Diagnostic>,
}

/// Data that a run needs besides its simulation to continue; `C` is borrowed when they are saved.
#[derive(Serialize, Deserialize)]
pub(super) struct SavedProgress<C = Cursor, P = Position> {
    pub(super) cursor: C,
    pub(super) position: P,
    /// Laws and histories that a program computes.
    computed: Vec<String>,
    /// Contents of the files that the deck names, by their paths.
    pub(super) files: BTreeMap<String, Vec<f64>>,
}

/// JSON encoding of summaries, whose fields may be missing. The encoding of the other data requires
/// all fields.
mod as_json {
    use serde::de::Error as _;
    use serde::ser::Error as _;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use crate::summary::StageSummary;

    pub(super) fn serialize<S: Serializer>(
        done: &[StageSummary],
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        serde_json::to_string(done).map_err(S::Error::custom)?.serialize(serializer)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Vec<StageSummary>, D::Error> {
        serde_json::from_str(&String::deserialize(deserializer)?).map_err(D::Error::custom)
    }
}

pub(super) fn save(
    path: &Path,
    text: &str,
    (site, simulation): (&BuiltDeck, &Simulation),
    cursor: &Cursor,
    position: &Position,
) -> Result<(), OutputError> {
    let progress = SavedProgress {
        cursor,
        position,
        computed: simulation.model().computed().to_vec(),
        files: ddem_deck::file_contents(site.deck()),
    };
    let run = postcard::to_stdvec(&progress);
    let run = run.map_err(|e| OutputError::mismatch(path, e.to_string()))?;
    checkpoint::stream(path, text, &run, simulation.saved_size(), |out| simulation.save_to(out))
}

/// A checkpoint, before the model is built from its deck.
pub(super) struct Resumed {
    path: PathBuf,
    /// Text of the deck that was run.
    pub(super) deck: String,
    pub(super) progress: SavedProgress,
    state: Saved,
}

/// Reads a checkpoint.
pub(super) fn load(path: &Path) -> Result<Resumed, RunFailure> {
    let Checkpoint { deck, run, state } = Checkpoint::load(path)?;
    let progress = postcard::from_bytes(&run);
    let progress = progress.map_err(|e| {
        let message = format!("it is damaged ({e}): use another one, or run from the start");
        refused(path, message, ErrorCode::InvalidFile)
    })?;
    Ok(Resumed { path: path.to_owned(), deck, progress, state: state.into() })
}

/// Failure of a checkpoint that belongs to another deck, model or version.
pub(super) fn wrong(path: &Path, message: impl Into<String>) -> RunFailure {
    refused(path, message, ErrorCode::CheckpointMismatch)
}

/// Failure of a checkpoint that cannot be read.
pub(super) fn unreadable(path: &Path, error: &OutputError) -> RunFailure {
    let message = match error {
        OutputError::Unusable { message, .. } => message.clone(),
        error => error.code().strip(&error.to_string()).to_owned(),
    };
    refused(path, message, error.code())
}

fn refused(path: &Path, message: impl Into<String>, code: ErrorCode) -> RunFailure {
    RunFailure::Checkpoint { path: path.to_owned(), message: message.into(), code }
}

impl Resumed {
    pub(super) fn simulation(&self, model: Model, simd: Simd) -> Result<Simulation, RunFailure> {
        let computed = &self.progress.computed;
        if computed != model.computed() {
            let computed = computed.join("`, `");
            let message = format!(
                "the program that saved it computed `{computed}`, which a deck cannot do: resume it in that \
                 program, with the model that computes it"
            );
            return Err(wrong(&self.path, message));
        }
        let restored = Simulation::restore(model, simd, &self.state);
        restored.map_err(|error| {
            refused(&self.path, error.code().strip(&error.to_string()), error.code())
        })
    }
}

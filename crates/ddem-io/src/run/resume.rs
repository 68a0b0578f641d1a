//! Checkpoints of a run: the simulation, and how far stages and files had got.

use std::collections::BTreeMap;

use std::path::{Path, PathBuf};

use ddem_core::{Model, Saved, Simd, Simulation};

use super::RunFailure;
use super::files::Position;
use super::stage::Moved;
use crate::checkpoint::{self, Checkpoint};
use crate::summary::StageSummary;

/// Where a run is between two steps.
#[derive(Clone, Debug, Default)]
pub(super) struct Cursor {
    /// Stage that is running, or next.
    pub(super) stage: usize,
    /// Steps of that stage that are done; `None` before it begins.
    pub(super) step: Option<u64>,
    /// Steps that it takes, as they are when it begins.
    pub(super) steps: u64,
    /// Time at which it begins, and its first time step `[s]`.
    pub(super) begun: f64,
    pub(super) time_step: f64,
    /// What friction had taken when it began `[J]`.
    pub(super) friction: f64,
    /// Energy that was out of balance then, against the largest.
    pub(super) imbalance: f64,
    /// Wall time that it has taken `[s]`.
    pub(super) seconds: f64,
    /// Stages that are done.
    pub(super) done: Vec<StageSummary>,
}

pub(super) fn save(
    path: &Path,
    text: &str,
    moved: &Moved,
    cursor: &Cursor,
    position: Position,
) -> Result<(), crate::OutputError> {
    let Moved { site, simulation, .. } = moved;
    let saved = simulation.save();
    let Cursor { seconds, begun, time_step, friction, imbalance, .. } = *cursor;
    let run = [seconds, begun, time_step, position.last_frame, friction, imbalance];
    let mut arrays: Vec<(&str, &[f64])> =
        saved.arrays.iter().map(|(name, v)| (name.as_str(), v.as_slice())).collect();
    arrays.push(("run", &run));
    let contents = ddem_deck::file_contents(site.deck());
    let paths: Vec<&str> = contents.iter().map(|(path, _)| path.as_str()).collect();
    let paths = serde_json::to_string(&paths).unwrap_or_default();
    // Paths are no names of arrays.
    let names: Vec<String> = (0..contents.len()).map(file_name).collect();
    arrays.extend(names.iter().zip(&contents).map(|(name, (_, v))| (name.as_str(), v.as_slice())));
    let mut counters: Vec<(&str, u64)> =
        saved.counters.iter().map(|(name, &n)| (name.as_str(), n)).collect();
    counters.extend([
        ("run_stage", cursor.stage as u64),
        ("run_begun", u64::from(cursor.step.is_some())),
        ("run_step", cursor.step.unwrap_or(0)),
        ("run_steps", cursor.steps),
        ("frames", position.frames),
        ("probe_rows", position.probe_rows),
        ("energy_rows", position.energy_rows),
        ("fragment_rows", position.fragment_rows),
    ]);
    let done = serde_json::to_string(&cursor.done).unwrap_or_default();
    let computed = simulation.model().computed().join(", ");
    let texts =
        [("stages", done.as_str()), ("computed", computed.as_str()), ("files", paths.as_str())];
    checkpoint::save(path, text, &arrays, &counters, &texts)
}

/// Name of the array with what was in a file that the deck names.
fn file_name(index: usize) -> String {
    format!("file {index}")
}

/// What a checkpoint holds, before the model is built from its deck.
pub(super) struct Resumed {
    path: PathBuf,
    checkpoint: Checkpoint,
    pub(super) cursor: Cursor,
    pub(super) position: Position,
}

/// Reads a checkpoint.
pub(super) fn load(path: &Path) -> Result<Resumed, RunFailure> {
    let checkpoint = Checkpoint::load(path)?;
    let read = || {
        let count = |name: &str| checkpoint.counters.get(name).copied();
        let &[seconds, begun, time_step, last_frame, friction, imbalance] =
            checkpoint.arrays.get("run")?.as_slice()
        else {
            return None;
        };
        let cursor = Cursor {
            stage: usize::try_from(count("run_stage")?).ok()?,
            step: if count("run_begun")? == 1 { count("run_step") } else { None },
            steps: count("run_steps")?,
            begun,
            time_step,
            friction,
            imbalance,
            seconds,
            done: serde_json::from_str(checkpoint.texts.get("stages")?).ok()?,
        };
        let position = Position {
            frames: count("frames")?,
            probe_rows: count("probe_rows")?,
            energy_rows: count("energy_rows")?,
            fragment_rows: count("fragment_rows")?,
            last_frame,
        };
        Some((cursor, position))
    };
    let (cursor, position) = read().ok_or_else(|| wrong(path, "it is not complete"))?;
    Ok(Resumed { path: path.to_owned(), checkpoint, cursor, position })
}

pub(super) fn wrong(path: &Path, message: impl Into<String>) -> RunFailure {
    RunFailure::Checkpoint { path: path.to_owned(), message: message.into() }
}

impl Resumed {
    /// Text of the deck that was run.
    pub(super) fn deck_text(&self) -> &str {
        &self.checkpoint.deck
    }

    /// Contents of the files that the deck names, by their paths.
    pub(super) fn files(&self) -> BTreeMap<String, Vec<f64>> {
        let paths = self.checkpoint.texts.get("files").map_or("[]", String::as_str);
        let paths: Vec<String> = serde_json::from_str(paths).unwrap_or_default();
        let content = |(index, path): (usize, String)| {
            Some((path, self.checkpoint.arrays.get(&file_name(index))?.clone()))
        };
        paths.into_iter().enumerate().filter_map(content).collect()
    }

    pub(super) fn simulation(&self, model: Model, simd: Simd) -> Result<Simulation, RunFailure> {
        let computed = self.checkpoint.texts.get("computed").map_or("", String::as_str);
        if computed != model.computed().join(", ") {
            let by = "as the program that saved it had set it; a deck cannot hold that";
            return Err(wrong(&self.path, format!("the model must have `{computed}` {by}")));
        }
        let saved = Saved {
            arrays: BTreeMap::clone(&self.checkpoint.arrays),
            counters: BTreeMap::clone(&self.checkpoint.counters),
        };
        Simulation::restore(model, simd, &saved)
            .ok_or_else(|| wrong(&self.path, "its numbers are not those of this model"))
    }
}

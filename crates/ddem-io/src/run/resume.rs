//! Checkpoints of a run: the simulation, and how far stages and files had got.

use std::collections::BTreeMap;

use ddem_core::{Model, Saved, Simd, Simulation};

use super::RunFailure;
use super::record::Position;
use crate::checkpoint::{self, Checkpoint};
use crate::folder::Folder;
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
    /// Wall time that it has taken `[s]`.
    pub(super) seconds: f64,
    /// Stages that are done.
    pub(super) done: Vec<StageSummary>,
}

pub(super) fn save(
    folder: &Folder,
    deck_text: &str,
    simulation: &Simulation,
    cursor: &Cursor,
    position: Position,
) -> Result<(), crate::OutputError> {
    let saved = simulation.save();
    let run = [cursor.seconds, cursor.begun, cursor.time_step, position.last_frame];
    let mut arrays: Vec<(&str, &[f64])> =
        saved.arrays.iter().map(|(name, v)| (name.as_str(), v.as_slice())).collect();
    arrays.push(("run", &run));
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
    ]);
    let done = serde_json::to_string(&cursor.done).unwrap_or_default();
    checkpoint::save(folder.checkpoint(), deck_text, &arrays, &counters, &[("stages", &done)])
}

/// What a checkpoint holds, before the model is built from its deck.
pub(super) struct Resumed {
    checkpoint: Checkpoint,
    pub(super) cursor: Cursor,
    pub(super) position: Position,
}

pub(super) fn load(folder: &Folder, deck_text: &str) -> Result<Resumed, RunFailure> {
    let path = folder.checkpoint();
    let checkpoint = Checkpoint::load(&path).map_err(|error| RunFailure::Checkpoint {
        path: path.clone(),
        message: error.to_string(),
    })?;
    let wrong =
        |message: &str| RunFailure::Checkpoint { path: path.clone(), message: message.to_owned() };
    if checkpoint.deck != deck_text {
        return Err(wrong("it was written by another version of the deck"));
    }
    let read = || {
        let count = |name: &str| checkpoint.counters.get(name).copied();
        let &[seconds, begun, time_step, last_frame] = checkpoint.arrays.get("run")?.as_slice()
        else {
            return None;
        };
        let cursor = Cursor {
            stage: usize::try_from(count("run_stage")?).ok()?,
            step: if count("run_begun")? == 1 { count("run_step") } else { None },
            steps: count("run_steps")?,
            begun,
            time_step,
            seconds,
            done: serde_json::from_str(checkpoint.texts.get("stages")?).ok()?,
        };
        let position = Position {
            frames: count("frames")?,
            probe_rows: count("probe_rows")?,
            energy_rows: count("energy_rows")?,
            last_frame,
        };
        Some((cursor, position))
    };
    let (cursor, position) = read().ok_or_else(|| wrong("it is not complete"))?;
    Ok(Resumed { checkpoint, cursor, position })
}

impl Resumed {
    pub(super) fn simulation(
        &self,
        model: Model,
        simd: Simd,
        folder: &Folder,
    ) -> Result<Simulation, RunFailure> {
        let saved = Saved {
            arrays: BTreeMap::clone(&self.checkpoint.arrays),
            counters: BTreeMap::clone(&self.checkpoint.counters),
        };
        Simulation::restore(model, simd, &saved).ok_or_else(|| RunFailure::Checkpoint {
            path: folder.checkpoint(),
            message: "its numbers are not those of this model".to_owned(),
        })
    }
}

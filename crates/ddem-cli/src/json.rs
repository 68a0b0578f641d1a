//! Events of a run as lines of JSON on standard output.

use std::io::{self, Write};
use std::time::{Duration, Instant};

use ddem_core::ErrorCode;
use ddem_deck::{BuildPhase, BuildProgress, Deck};
use ddem_io::run::{Event, Outcome, RunFailure, Tracker};
use ddem_io::serde_json::{Value, json};

use crate::status::line;

/// Wall time between two lines on the progress of a stage.
const EVERY: Duration = Duration::from_secs(1);

/// Writer of lines of JSON.
#[derive(Debug)]
pub(crate) struct JsonLines {
    tracker: Tracker,
    written: Instant,
}

impl JsonLines {
    /// Writer about the run of a deck.
    pub(crate) fn new(deck: &Deck) -> Self {
        Self { tracker: Tracker::new(deck), written: Instant::now() }
    }

    /// Writes the lines of an event.
    pub(crate) fn event(&mut self, event: &Event<'_>) {
        self.tracker.event(event);
        match event {
            Event::Built(report) => put(
                "model",
                &json!({
                    "blocks": report.blocks,
                    "nodes": report.nodes,
                    "pairs": report.pairs,
                    "breakable_pairs": report.breakable_pairs,
                }),
            ),
            Event::Warning(warning) => put("warning", warning),
            Event::StepLimit { stage, limit } => {
                put("step_limit", &json!({ "stage": stage, "limit": limit }));
            }
            Event::StageStarted(_) => self.progress("stage"),
            Event::Progress(_) if self.written.elapsed() >= EVERY => self.progress("progress"),
            Event::Trial { stage, trial } => put(
                "trial",
                &json!({
                    "stage": stage,
                    "factor": trial.factor,
                    "verdict": trial.verdict,
                    "steps": trial.steps,
                }),
            ),
            Event::Checkpoint(path) => put("checkpoint", &json!({ "file": path })),
            Event::StageDone(stage) => put("stage_done", stage),
            Event::Kept(folder) => put("kept", &json!({ "folder": folder })),
            _ => {}
        }
    }

    fn progress(&mut self, event: &str) {
        self.written = Instant::now();
        put(event, &self.tracker.report());
    }
}

/// Writes the line at the end of a run.
pub(crate) fn end(outcome: &Result<Outcome, RunFailure>) {
    let facts = |state: &str, code: Option<ErrorCode>, message: Option<String>| -> Value {
        json!({ "state": state, "code": code.map(|code| code.to_string()), "message": message })
    };
    let facts = match outcome {
        Ok(Outcome::Done(_)) => facts("done", None, None),
        Ok(Outcome::Interrupted(_)) | Err(RunFailure::Stopped) => facts("interrupted", None, None),
        Err(failure) => facts("failed", Some(failure.code()), Some(failure.to_string())),
    };
    put("end", &facts);
}

/// Writes how far the building of a model is.
pub(crate) fn building(progress: &BuildProgress) {
    let (phase, cut) = match progress.phase() {
        BuildPhase::Cut { number, cuts } => ("cut", Some([number, cuts])),
        BuildPhase::Blocks => ("blocks", None),
        BuildPhase::Joints => ("joints", None),
        BuildPhase::Model => ("model", None),
        BuildPhase::Report => ("report", None),
        _ => ("check", None),
    };
    put(
        "building",
        &json!({
            "phase": phase,
            "cut": cut.map(|[number, _]| number),
            "cuts": cut.map(|[_, cuts]| cuts),
            "cells": progress.cells(),
        }),
    );
}

/// Writes a line at once. Errors are ignored, because nobody reads a closed stream.
fn put(event: &str, facts: &impl serde::Serialize) {
    let mut stdout = io::stdout().lock();
    let _ = stdout.write_all(line(event, facts).as_bytes()).and_then(|()| stdout.flush());
}

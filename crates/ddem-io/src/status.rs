//! `status.json`: how far a run is, for other programs to read while it runs.
//!
//! The run replaces the file about once a second and at its end. Nothing reads it to compute: results do not depend on
//! it. The last frame and the last checkpoint are taken from their own files, and the lock of the folder tells whether
//! the run is still there.

use std::fs;
use std::path::Path;
use std::time::Duration;

use ddem_core::{FastestBlock, TrialProgress};
use ddem_deck::{Stage, StageKind};
use serde::{Deserialize, Serialize};

use crate::folder::{CHECKPOINT, FRAMES, STATUS, in_use};
use crate::output_error::OutputError;
use crate::replace::temporary;

/// State of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum StatusKind {
    /// The run goes on.
    #[default]
    Running,
    /// All stages are done.
    Done,
    /// Stopped on request, after a checkpoint.
    Interrupted,
    /// The run ended with an error.
    Failed,
    /// The run ended without a word, by a kill or a power failure.
    Killed,
}

/// Progress of the present stage. A value is `None` where there is no such number. Times are wall times unless
/// simulated.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StageReport {
    /// Name of the stage.
    pub stage: String,
    /// Number of the stage, from 1.
    pub number: usize,
    /// Number of stages.
    pub stages: usize,
    /// Kind of the stage in the deck.
    pub kind: String,
    /// Part of the stage that is done, from 0 to 1; in a relaxation digits of the unbalanced ratio, in a search trials.
    pub progress: Option<f64>,
    /// Steps of the stage so far; in a search those of all trials.
    pub step: u64,
    /// Steps that a dynamic stage will take.
    pub steps: Option<u64>,
    /// Complete trials of a search for the factor of safety.
    pub trials: Option<u64>,
    /// Largest number of trials of the search.
    pub most_trials: Option<u64>,
    /// Trials of the search that run.
    #[serde(default)]
    pub running: Vec<TrialProgress>,
    /// Simulated time `[s]`.
    pub time: f64,
    /// Unbalanced force ratio.
    pub unbalanced: Option<f64>,
    /// Unbalanced ratio at which a relaxation ends.
    pub tolerance: Option<f64>,
    /// Failed pairs.
    pub failed_pairs: u64,
    /// Pairs of blocks that press on each other without a joint.
    pub contacts: u64,
    /// The fastest block of a dynamic stage.
    pub fastest: Option<FastestBlock>,
    /// Node updates per second in this stage.
    pub node_updates_per_second: Option<f64>,
    /// Time since the stage began or was resumed `[s]`.
    pub wall_seconds: f64,
    /// Time left in the stage `[s]`.
    pub seconds_left: Option<f64>,
}

/// Contents of `status.json`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RunStatus {
    /// State of the run.
    pub state: StatusKind,
    /// Message of the error of a run that failed.
    pub message: Option<String>,
    /// Title of the deck.
    pub title: String,
    /// Progress of the present stage, or of the last one.
    #[serde(flatten)]
    pub report: StageReport,
}

/// Frame in the files of results.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LastFrame {
    /// Number of the frame, from 0.
    pub number: u64,
    /// Name of its stage.
    pub stage: String,
    /// Steps since the start of the run.
    pub step: u64,
    /// Simulated time `[s]`.
    pub time: f64,
}

/// Status of a run with the last of its files.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FolderStatus {
    /// Status that the run wrote.
    #[serde(flatten)]
    pub status: RunStatus,
    /// Time since the run wrote it `[s]`.
    pub age_seconds: Option<f64>,
    /// Last complete frame.
    pub last_frame: Option<LastFrame>,
    /// Time since the last checkpoint `[s]`; `None` if there is no checkpoint.
    pub checkpoint_age_seconds: Option<f64>,
}

impl StageReport {
    /// Report at the start of one of the stages of a deck, by its number from 0.
    #[must_use]
    pub fn beginning(all: &[Stage], index: usize) -> Self {
        let stages = all.len();
        let Some(stage) = all.get(index) else { return Self { stages, ..Self::default() } };
        let kind = match stage.kind {
            StageKind::Relax => "relax",
            StageKind::Dynamic => "dynamic",
            StageKind::Safety => "safety",
        };
        let (stage, kind) = (stage.name.clone(), kind.to_owned());
        Self { stage, number: index + 1, stages, kind, ..Self::default() }
    }
}

impl RunStatus {
    /// Replaces the file. It need not survive a power failure, so nothing waits for the disk.
    pub(crate) fn write(&self, path: &Path) -> std::io::Result<()> {
        let mut text = serde_json::to_vec(self)?;
        text.push(b'\n');
        let part = temporary(path);
        fs::write(&part, text)?;
        fs::rename(&part, path)
    }
}

impl FolderStatus {
    /// Status of the run in a folder; `None` if no run of a deck has begun a stage there.
    ///
    /// # Errors
    ///
    /// A file of the folder cannot be read or has other contents.
    pub fn read(path: &Path) -> Result<Option<Self>, OutputError> {
        let file = path.join(STATUS);
        let text = match fs::read(&file) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            text => text.map_err(|e| OutputError::io(&file, "reading", e))?,
        };
        let mut status: RunStatus = serde_json::from_slice(&text).map_err(|e| {
            OutputError::unusable(
                &file,
                format!("not the status of a run ({e}): run the deck again"),
            )
        })?;
        // A run that is killed leaves its last word; its lock is gone.
        if status.state == StatusKind::Running && !in_use(path) {
            status.state = StatusKind::Killed;
        }
        Ok(Some(Self {
            status,
            age_seconds: age(&file),
            last_frame: last_frame(&path.join(FRAMES))?,
            checkpoint_age_seconds: age(&path.join(CHECKPOINT)),
        }))
    }
}

/// Time since a file was written `[s]`.
fn age(file: &Path) -> Option<f64> {
    let modified = fs::metadata(file).and_then(|about| about.modified()).ok()?;
    // The clock of a file server may be ahead.
    Some(modified.elapsed().unwrap_or(Duration::ZERO).as_secs_f64())
}

/// Last complete row of the table of frames.
fn last_frame(path: &Path) -> Result<Option<LastFrame>, OutputError> {
    if !path.exists() {
        return Ok(None);
    }
    let text = fs::read_to_string(path).map_err(|e| OutputError::io(path, "reading", e))?;
    // A row without the end of its line is still being written.
    let complete = text.rfind('\n').map_or("", |end| &text[..=end]);
    let mut last = None;
    let mut reader = csv::Reader::from_reader(complete.as_bytes());
    for (number, row) in reader.deserialize::<(String, u64, f64, f64)>().enumerate() {
        let row = row.map_err(|e| OutputError::csv(path, "reading", e))?;
        let (stage, step, time, _) = row;
        last = Some(LastFrame { number: number as u64, stage, step, time });
    }
    Ok(last)
}

//! Runs decks into temporary folders and reads the results as another program would.

#![allow(dead_code, reason = "each test binary uses the part it needs")]
#![allow(unreachable_pub, reason = "a module of several test binaries")]

mod table;
mod vtk;

pub use table::ResultTable;
pub use vtk::Frames;

use std::path::{Path, PathBuf};

use ddem_core::{Simd, Simulation};
use ddem_deck::Deck;
use ddem_io::folder::Earlier;
use ddem_io::run::{Event, Observer, Options, Outcome};
use ddem_io::summary::Summary;
use tempfile::TempDir;

/// A path below the root of the repository.
pub fn root(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// Text of a deck in `examples/verification`.
pub fn example(name: &str) -> String {
    let path = root(&format!("examples/verification/{name}.toml"));
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The text with one value replaced; the old value must occur.
pub fn edited(text: &str, old: &str, new: &str) -> String {
    assert!(text.contains(old), "the deck has no {old:?}");
    text.replace(old, new)
}

/// A deck from its text.
pub fn deck(text: &str) -> Deck {
    ddem_deck::parse(text, "test.toml").unwrap_or_else(|error| panic!("{error}")).0
}

/// A simulation of a deck from its text.
pub fn simulation(text: &str) -> Simulation {
    Simulation::new(deck(text).build().unwrap_or_else(|error| panic!("{error}")))
}

/// Stops a run after this number of queries.
pub struct StopAfter(pub u64);

impl Observer for StopAfter {
    fn event(&mut self, _: Event<'_>) {}

    fn wants_to_stop(&mut self) -> bool {
        let stop = self.0 == 0;
        self.0 = self.0.saturating_sub(1);
        stop
    }
}

/// Options of a run in a test.
#[derive(Clone, Copy, Debug)]
pub struct How {
    pub threads: usize,
    pub simd: Simd,
    /// True to resume from the checkpoint in the folder.
    pub resume: bool,
    /// Number of queries after which the run is interrupted.
    pub stop_after: Option<u64>,
    /// True to measure the wall time of each phase.
    pub profile: bool,
}

impl Default for How {
    fn default() -> Self {
        Self { threads: 1, simd: Simd::default(), resume: false, stop_after: None, profile: false }
    }
}

/// Runs a deck into a folder; returns true if it ran to its end.
pub fn run_into(text: &str, folder: &Path, how: How) -> bool {
    let (deck, source) =
        ddem_deck::parse(text, "test.toml").unwrap_or_else(|error| panic!("{error}"));
    let mut options = Options::new(folder);
    options.threads = Some(how.threads);
    options.simd = how.simd;
    options.profile = how.profile;
    options.earlier = if how.resume { Earlier::Resume } else { Earlier::Overwrite };
    let mut observer = StopAfter(how.stop_after.unwrap_or(u64::MAX));
    match ddem_io::run::run(&deck, &source, &options, &mut observer) {
        Ok(outcome) => matches!(outcome, Outcome::Done(_)),
        Err(error) => panic!("{error}"),
    }
}

/// The results of a run.
pub struct Run {
    folder: TempDir,
    pub probes: ResultTable,
    pub energy: ResultTable,
    pub summary: Summary,
}

/// Runs a deck to its end.
pub fn run(text: &str) -> Run {
    let folder = tempfile::tempdir().expect("a temporary folder");
    assert!(run_into(text, folder.path(), How::default()));
    Run {
        probes: ResultTable::read(&folder.path().join("probes.csv")),
        energy: ResultTable::read(&folder.path().join("energy.csv")),
        summary: Summary::read(folder.path().join("summary.json")).expect("a summary"),
        folder,
    }
}

impl Run {
    /// Path of a result file.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Steps of the first stage.
    pub fn steps(&self) -> u64 {
        self.summary.stages[0].steps
    }

    /// Last value of a probe.
    pub fn last(&self, column: &str) -> f64 {
        *self.probes.column(column).last().expect("a sample")
    }
}

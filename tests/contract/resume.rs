//! A run that was interrupted and resumed equals the run that was not.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use ddem_deck::BuildProgress;
use ddem_io::folder::Earlier;
use ddem_io::run::{Event, Observer, Options, Outcome, RunFailure, run};

use super::decks::mixed;
use super::joint_failure::torn;
use super::shared::{Frames, How, run_into};

const FIELDS: [(&str, &str, &str); 21] = [
    ("blocks.vtkhdf", "PointData", "displacement"),
    ("blocks.vtkhdf", "PointData", "velocity"),
    ("blocks.vtkhdf", "CellData", "stress"),
    ("blocks.vtkhdf", "CellData", "fragment"),
    ("joints.vtkhdf", "PointData", "displacement"),
    ("joints.vtkhdf", "PointData", "traction"),
    ("joints.vtkhdf", "PointData", "slip"),
    ("joints.vtkhdf", "PointData", "failure_time"),
    ("joints.vtkhdf", "PointData", "state"),
    ("joints.vtkhdf", "PointData", "open"),
    ("joints.vtkhdf", "PointData", "opening"),
    ("joints.vtkhdf", "PointData", "damage"),
    ("joints.vtkhdf", "PointData", "released"),
    ("contacts.vtkhdf", "PointData", "force"),
    ("contacts.vtkhdf", "PointData", "traction"),
    ("contacts.vtkhdf", "PointData", "normal"),
    ("contacts.vtkhdf", "PointData", "area"),
    ("contacts.vtkhdf", "PointData", "gap"),
    ("contacts.vtkhdf", "PointData", "slip"),
    ("contacts.vtkhdf", "PointData", "sliding"),
    ("contacts.vtkhdf", "PointData", "blocks"),
];

/// Fields of decks with peaks.
const PEAKS: [(&str, &str, &str); 3] = [
    ("blocks.vtkhdf", "PointData", "peak_velocity"),
    ("blocks.vtkhdf", "CellData", "peak_tension"),
    ("blocks.vtkhdf", "CellData", "peak_compression"),
];

/// Everything in the result files, as bits.
pub(crate) fn everything(folder: &Path) -> Vec<(String, Vec<u64>)> {
    let mut all = Vec::new();
    for name in ["probes.csv", "energy.csv", "fragments.csv", "frames.csv"] {
        let text = std::fs::read(folder.join(name)).expect("a table");
        all.push((name.to_owned(), text.into_iter().map(u64::from).collect()));
    }
    let bits = |values: Vec<f64>| values.into_iter().map(f64::to_bits).collect();
    let summary = std::fs::read_to_string(folder.join("summary.json")).expect("a summary");
    let peaks: &[_] = if summary.contains("peaks = true") { &PEAKS } else { &[] };
    for &(file, group, field) in FIELDS.iter().chain(peaks) {
        // Without contacts there is no such file.
        if file == "contacts.vtkhdf" && !folder.join(file).exists() {
            continue;
        }
        let frames = Frames::open(folder.join(file));
        all.push((format!("{file} times"), bits(frames.times())));
        all.push((format!("{file} {field}"), bits(frames.all(group, field))));
    }
    all
}

fn steps(folder: &Path) -> Vec<u64> {
    let summary = ddem_io::summary::Summary::read(folder.join("summary.json"));
    summary.expect("a summary").stages.iter().map(|stage| stage.steps).collect()
}

pub(crate) fn interrupted(text: &str, stops: &[u64]) -> (Vec<(String, Vec<u64>)>, Vec<u64>) {
    let folder = tempfile::tempdir().expect("a folder");
    let mut how = How::default();
    for &stop in stops {
        how.stop_after = Some(stop);
        assert!(!run_into(text, folder.path(), how), "the run ended before step {stop}");
        how.resume = true;
    }
    how.stop_after = None;
    assert!(run_into(text, folder.path(), how));
    (everything(folder.path()), steps(folder.path()))
}

#[test]
fn interrupted_runs_resume_with_same_bits() {
    let (expected, steps) = interrupted(&mixed(), &[]);
    let [relax, shake] = [steps[0], steps[1]];
    println!("steps of the stages: {steps:?}");
    // The observer is asked at every step, and once more after each load increment.
    let between = relax + 3;
    let stops: [&[u64]; 9] = [
        &[0],
        &[1],
        &[relax / 3 + 1],
        &[relax / 2, relax / 4],
        &[between],
        &[between + 1],
        &[between + shake / 2, 5, 0, 1],
        &[between + shake],
        &[between + shake - 1, 1, 1],
    ];
    for stops in stops {
        let (found, steps_found) = interrupted(&mixed(), stops);
        assert_eq!(steps_found, steps, "stopped after {stops:?}");
        for ((what, expected), (_, found)) in expected.iter().zip(&found) {
            assert!(expected == found, "{what} differs after stops at {stops:?}");
        }
    }
}

#[test]
fn run_interrupted_during_failure_resumes() {
    let text = torn(1.0).replace("divisions = 4", "divisions = 2");
    let (expected, steps) = interrupted(&text, &[]);
    let [relax, pull] = [steps[0], steps[1]];
    println!("steps of the stages: {steps:?}");
    let stops: [&[u64]; 5] = [
        &[relax / 2],
        &[relax + 1],
        &[relax + pull / 4, pull / 4],
        &[relax + pull / 2, 1, 0, 1],
        &[relax + pull - 2],
    ];
    for stops in stops {
        let (found, steps_found) = interrupted(&text, stops);
        assert_eq!(steps_found, steps, "stopped after {stops:?}");
        for ((what, expected), (_, found)) in expected.iter().zip(&found) {
            assert!(expected == found, "{what} differs after stops at {stops:?}");
        }
    }
}

/// Copies the results when the first stage is done: these files remain if the machine fails in the
/// second.
struct CopyAfterFirst {
    from: PathBuf,
    to: PathBuf,
    done: bool,
}

impl Observer for CopyAfterFirst {
    fn event(&mut self, event: Event<'_>) {
        if matches!(event, Event::Checkpoint(_)) && !self.done {
            self.done = true;
            for file in std::fs::read_dir(&self.from).expect("results") {
                let file = file.expect("a file");
                std::fs::copy(file.path(), self.to.join(file.file_name())).expect("a copy");
            }
        }
    }
}

#[test]
fn killed_run_resumes_from_end_of_previous_stage() {
    let [whole, cut] = [(); 2].map(|()| tempfile::tempdir().expect("a folder"));
    // Dynamic stages in sequence, with different damping.
    let motion = "kind = 'dynamic'\nduration = 2e-4\ndamping = { ratio = 0.05 }";
    let text = mixed()
        .replace("kind = 'relax'", motion)
        .lines()
        .filter(|line| {
            !["tolerance", "max_steps", "increments"].iter().any(|k| line.starts_with(k))
        })
        .collect::<Vec<_>>()
        .join("\n");
    let (deck, source) = ddem_deck::parse(&text, "cut.toml").expect("a deck");
    let mut copy = CopyAfterFirst { from: whole.path().into(), to: cut.path().into(), done: false };
    run(&deck, &source, &Options::new(whole.path()), &mut copy).expect("an end");
    let options = Options { earlier: Earlier::Resume, ..Options::new(cut.path()) };
    run(&deck, &source, &options, &mut copy).expect("an end");
    for ((what, expected), (_, found)) in
        everything(whole.path()).iter().zip(&everything(cut.path()))
    {
        assert!(expected == found, "{what} differs");
    }
}

/// Raises its flag at an event. Long operations before a step check it; steps check it only with
/// `at_steps`.
struct StopAt {
    flag: Arc<AtomicBool>,
    when: fn(&Event<'_>) -> bool,
    at_steps: bool,
}

impl Observer for StopAt {
    fn event(&mut self, event: Event<'_>) {
        if (self.when)(&event) {
            self.flag.store(true, Ordering::Relaxed);
        }
    }

    fn stop_flag(&self) -> Arc<AtomicBool> {
        self.flag.clone()
    }

    fn wants_to_stop(&mut self) -> bool {
        self.at_steps && self.flag.load(Ordering::Relaxed)
    }
}

/// Runs a deck until its flag is raised, then to its end.
fn stopped(text: &str, when: fn(&Event<'_>) -> bool, at_steps: bool) -> Vec<(String, Vec<u64>)> {
    let folder = tempfile::tempdir().expect("a folder");
    let (deck, source) = ddem_deck::parse(text, "test.toml").expect("a deck");
    let mut observer = StopAt { flag: Arc::default(), when, at_steps };
    let outcome = run(&deck, &source, &Options::new(folder.path()), &mut observer);
    assert!(matches!(outcome, Ok(Outcome::Interrupted(_))));
    assert!(run_into(text, folder.path(), How { resume: true, ..How::default() }));
    everything(folder.path())
}

#[test]
fn run_stopped_before_first_step_resumes() {
    // A second relaxation computes its masses; a dynamic stage already has its critical step.
    for (text, kind) in [(mixed(), "dynamic"), (settling_twice(), "relax")] {
        let (expected, _) = interrupted(&text, &[]);
        let found = stopped(&text, |event| matches!(event, Event::StageDone(_)), kind == "dynamic");
        for ((what, expected), (_, found)) in expected.iter().zip(&found) {
            assert!(expected == found, "{what} differs, before a {kind} stage");
        }
    }
}

/// Two relaxations, one after the other.
fn settling_twice() -> String {
    let again = "[[stage]]\nname = 'again'\nkind = 'relax'\ntolerance = 1e-7\n";
    let text = mixed();
    let at = text.find("[[stage]]\nname = 'shake'").expect("a stage");
    let (before, after) = text.split_at(at);
    format!("{before}{again}{after}")
}

#[test]
fn run_stopped_at_first_failure_resumes() {
    let text = torn(1.0).replace("divisions = 4", "divisions = 2");
    let (expected, _) = interrupted(&text, &[]);
    // After the start of the pull, the long operation is the critical step of broken joints.
    let pull = |event: &Event<'_>| matches!(event, Event::StageStarted(p) if !p.relax);
    let found = stopped(&text, pull, false);
    for ((what, expected), (_, found)) in expected.iter().zip(&found) {
        assert!(expected == found, "{what} differs");
    }
}

#[test]
fn run_stopped_before_output_leaves_no_folder() {
    let folder = tempfile::tempdir().expect("a folder");
    let (deck, source) = ddem_deck::parse(&mixed(), "test.toml").expect("a deck");
    let mut observer =
        StopAt { flag: Arc::new(AtomicBool::new(true)), when: |_| false, at_steps: true };
    let out = folder.path().join("out");
    let outcome = run(&deck, &source, &Options::new(&out), &mut observer);
    assert!(matches!(outcome, Err(RunFailure::Stopped)));
    assert!(!out.exists());
}

/// Observer that has abandoned the model before it is built.
struct Abandoning(Arc<BuildProgress>);

impl Observer for Abandoning {
    fn event(&mut self, _: Event<'_>) {}

    fn build_progress(&self) -> Arc<BuildProgress> {
        self.0.clone()
    }
}

#[test]
fn abandoned_model_leaves_no_folder() {
    let folder = tempfile::tempdir().expect("a folder");
    let (deck, source) = ddem_deck::parse(&mixed(), "test.toml").expect("a deck");
    let out = folder.path().join("out");
    let mut observer = Abandoning(Arc::default());
    assert!(observer.0.abandon());
    let outcome = run(&deck, &source, &Options::new(&out), &mut observer);
    assert!(matches!(outcome, Err(RunFailure::Stopped)));
    assert!(!out.exists());
    // Once files are written, a run can only be stopped.
    let mut observer = Abandoning(Arc::default());
    assert!(run(&deck, &source, &Options::new(&out), &mut observer).is_ok());
    assert!(!observer.0.abandon());
}

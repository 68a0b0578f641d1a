//! A session is a run driven by a program: the same bits, the same files.

use std::path::Path;

use ddem_core::Simd;
use ddem_deck::Deck;
use ddem_deck::{Stage, StageKind};
use ddem_io::run::{Event, Observer, Session, StageStatus};
use ddem_io::status::{FolderStatus, StatusKind};

use super::decks::mixed;
use super::shared::{Frames, How, run_into};

/// Stores the samples of the probes.
#[derive(Default)]
struct SampleRecorder(Vec<(u64, f64, Vec<Option<f64>>)>);

impl Observer for SampleRecorder {
    fn event(&mut self, event: Event<'_>) {
        if let Event::Sample { step, time, values } = event {
            self.0.push((step, time, values.to_vec()));
        }
    }
}

fn deck(text: &str) -> Deck {
    ddem_deck::parse(text, "session.toml").unwrap_or_else(|error| panic!("{error}")).0
}

fn session(deck: &Deck) -> Session {
    Session::new(deck, Simd::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// Runs a session through the stages of its deck.
fn all_stages(session: &mut Session, folder: Option<&Path>) -> SampleRecorder {
    let mut samples = SampleRecorder::default();
    for stage in session.site().deck().stage.clone() {
        let done = session.stage(&stage, folder, &mut samples);
        assert!(done.unwrap_or_else(|error| panic!("{error}")));
    }
    samples
}

fn last(folder: &Path, file: &str, field: (&str, &str)) -> Vec<u64> {
    let frames = Frames::open(folder.join(file));
    frames.all(field.0, field.1).into_iter().map(f64::to_bits).collect()
}

#[test]
fn session_stages_equal_deck_stages_bit_for_bit() {
    let [run, own] = [(); 2].map(|()| tempfile::tempdir().expect("a folder"));
    assert!(run_into(&mixed(), run.path(), How::default()));
    let deck = deck(&mixed());
    let mut recorded = session(&deck);
    let samples = all_stages(&mut recorded, Some(own.path()));
    for (file, field) in [
        ("blocks.vtkhdf", ("PointData", "displacement")),
        ("blocks.vtkhdf", ("PointData", "velocity")),
        ("blocks.vtkhdf", ("CellData", "stress")),
        ("joints.vtkhdf", ("PointData", "traction")),
    ] {
        assert_eq!(last(run.path(), file, field), last(own.path(), file, field), "{field:?}");
    }
    for file in ["probes.csv", "energy.csv", "frames.csv"] {
        let read = |folder: &Path| std::fs::read(folder.join(file)).expect("a table");
        assert!(read(run.path()) == read(own.path()), "{file}");
    }
    // Reported samples equal the rows of the table, with or without files.
    let mut silent = session(&deck);
    assert_eq!(all_stages(&mut silent, None).0.len(), samples.0.len());
    let table = std::fs::read_to_string(own.path().join("probes.csv")).expect("a table");
    // A stage may begin with the last row of the stage before.
    let times = table.lines().skip(1).map(|row| row.split(',').skip(1).take(2).collect());
    let mut times: Vec<Vec<&str>> = times.collect();
    times.dedup();
    assert_eq!(times.len(), samples.0.len());
    assert_eq!(silent.simulation().displacements(), recorded.simulation().displacements());
    // A loaded session continues from its saved state.
    let path = own.path().join("saved.h5");
    recorded.save(&path).expect("a file");
    let loaded = Session::load(&path, Simd::default(), Some(&deck), |_| Ok(()));
    let mut loaded = loaded.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(loaded.simulation().save(), recorded.simulation().save());
    // Compared as text, since some numbers are NaN.
    let stages = |session: &mut Session| format!("{:?}", session.summary().stages);
    assert_eq!(stages(&mut loaded), stages(&mut recorded));
}

/// Reads the status of a folder when a stage begins, and may stop it.
struct StatusReader<'a> {
    folder: &'a Path,
    at_start: Option<FolderStatus>,
    stops: bool,
}

impl StatusReader<'_> {
    fn read(&self) -> Option<FolderStatus> {
        FolderStatus::read(self.folder).expect("a status")
    }
}

impl Observer for StatusReader<'_> {
    fn event(&mut self, event: Event<'_>) {
        if let Event::StageStarted(_) = event {
            self.at_start = self.read();
        }
    }

    fn wants_to_stop(&mut self) -> bool {
        self.stops
    }
}

#[test]
fn stages_of_programs_have_a_status() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out");
    let mut session = session(&deck(&mixed()));
    let title = session.site().deck().title.clone();
    let mut reader = StatusReader { folder: &out, at_start: None, stops: false };
    let relax = Stage { kind: StageKind::Relax, ..Stage::default() };
    assert!(session.stage(&relax, Some(&out), &mut reader).expect("a stage"));
    let begun = reader.at_start.take().expect("a status").status;
    assert_eq!((begun.state, begun.title.as_str()), (StatusKind::Running, title.as_str()));
    assert_eq!((begun.report.stage.as_str(), begun.report.number), ("relax 1", 1));
    let done = reader.read().expect("a status");
    assert_eq!((done.status.state, done.status.report.progress), (StatusKind::Done, Some(1.0)));
    assert_eq!(done.last_frame.map(|frame| frame.stage), Some("relax 1".to_owned()));
    // The second stage is stopped before its first step, and the third one runs.
    let step = session.simulation_mut().safe_step().expect("a step");
    let shake = Stage { kind: StageKind::Dynamic, duration: Some(10.0 * step), ..Stage::default() };
    reader.stops = true;
    assert!(!session.stage(&shake, Some(&out), &mut reader).expect("a stage"));
    assert_eq!(reader.read().map(|found| found.status.state), Some(StatusKind::Interrupted));
    reader.stops = false;
    assert!(session.stage(&shake, Some(&out), &mut reader).expect("a stage"));
    let done = reader.read().expect("a status").status;
    assert_eq!((done.state, done.report.kind.as_str()), (StatusKind::Done, "dynamic"));
    assert_eq!((done.report.stage.as_str(), done.report.number), ("run 2", 2));
    assert_eq!(Some(done.report.step), done.report.steps);
    // A failure leaves its message.
    let short = Stage { tolerance: Some(1e-12), max_steps: Some(1), ..relax };
    let error = session.stage(&short, Some(&out), &mut reader).expect_err("too few steps");
    let failed = reader.read().expect("a status").status;
    assert_eq!((failed.state, failed.message), (StatusKind::Failed, Some(error.to_string())));
}

#[test]
fn folder_belongs_to_one_model() {
    let folder = tempfile::tempdir().expect("a folder");
    let untitled = |density: f64| {
        let mut deck = deck(&mixed());
        deck.title.clear();
        deck.materials.get_mut("rock").expect("rock").density = density;
        deck.stage.truncate(1);
        deck.fix.retain(|fix| fix.from.is_none());
        deck.fix.iter_mut().for_each(|fix| fix.until = None);
        deck.load.retain(|load| load.from.is_none());
        deck
    };
    let out = folder.path().join("run");
    all_stages(&mut session(&untitled(2400.0)), Some(&out));
    let before = std::fs::read(out.join("summary.json")).expect("results");
    // Results of another run, of the same model or not, are moved out of the way.
    all_stages(&mut session(&untitled(2500.0)), Some(&out));
    all_stages(&mut session(&untitled(2400.0)), Some(&out));
    let kept = |number: u32| folder.path().join(format!("run.{number}"));
    assert_eq!(std::fs::read(kept(1).join("summary.json")).expect("results"), before);
    assert!(kept(2).join("summary.json").exists() && !kept(3).exists());
}

#[test]
fn resume_needs_the_computed_histories_again() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("saved.h5");
    let deck = deck(&mixed());
    let computed =
        |model: &mut ddem_core::Model| model.set_load_history(0, std::sync::Arc::new(|_| Ok(1.0)));
    let session = Session::with(&deck, Simd::default(), computed).expect("a session");
    session.save(&path).expect("a file");
    let without = Session::load(&path, Simd::default(), None, |_| Ok(()));
    let error = without.err().map(|error| error.to_string()).unwrap_or_default();
    assert!(error.contains("load[0].history"), "{error}");
    assert!(Session::load(&path, Simd::default(), None, computed).is_ok());
}

#[test]
fn callbacks_change_no_bit_and_may_end_a_stage() {
    let deck = deck(&mixed());
    let (mut plain, mut paused) = (session(&deck), session(&deck));
    let all = all_stages(&mut plain, None);
    let mut samples = SampleRecorder::default();
    for stage in paused.site().deck().stage.clone() {
        let every = stage.duration.map(|duration| duration / 7.0);
        let mut begun =
            paused.begin(&stage, None, every, &mut samples).expect("a stage").expect("begun");
        let mut looks = 0;
        while paused.advance(&mut begun, &mut samples).expect("steps") == StageStatus::Paused {
            looks += 1;
            // Evaluations change nothing.
            let simulation = paused.simulation_mut();
            let _ = (simulation.energy(), simulation.contacts(), simulation.forces());
        }
        paused.end(begun, true, &mut samples).expect("an end");
        // The seventh pause is the end itself, or one step beside it.
        assert!(every.map_or(looks == 0, |_| (6..=7).contains(&looks)), "{looks}");
    }
    assert_eq!(paused.simulation().save(), plain.simulation().save());
    let bits = |samples: &SampleRecorder| format!("{:?}", samples.0);
    assert_eq!(bits(&samples), bits(&all));
    // A stage ended at a pause lasts until there, and other stages can follow it.
    let mut short = session(&deck);
    let stages = short.site().deck().stage.clone();
    let stage = stages.iter().find(|stage| stage.duration.is_some()).expect("one that moves");
    let duration = stage.duration.expect("a duration");
    let mut begun = short
        .begin(stage, None, Some(duration / 4.0), &mut samples)
        .expect("a stage")
        .expect("begun");
    assert_eq!(short.advance(&mut begun, &mut samples).expect("steps"), StageStatus::Paused);
    let before = short.simulation().time();
    short.end(begun, true, &mut samples).expect("an end");
    assert_eq!(short.simulation().time(), before);
    assert!((before / duration - 0.25).abs() < 0.05);
    assert_eq!(short.summary().stages.len(), 1);
    assert!(short.stage(stage, None, &mut samples).expect("another"));
}

#[test]
fn session_has_no_safety_stage() {
    let mut session = session(&deck(&mixed()));
    let stage = Stage { name: "safety".into(), kind: StageKind::Safety, ..Stage::default() };
    let error =
        session.stage(&stage, None, &mut SampleRecorder::default()).expect_err("no stage for it");
    assert!(error.to_string().contains("`Simulation::factor_of_safety`"), "{error}");
}

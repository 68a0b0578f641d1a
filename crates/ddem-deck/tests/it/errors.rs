//! Error messages that reading a deck cannot find: about its geometry and about a run.

use std::io;

use ddem_core::{ErrorCode, FastestBlock, Fault, ModelError, MovingBlock, RunError};
use ddem_deck::*;
use ddem_io::OutputError;
use ddem_io::folder::FolderError;
use ddem_io::run::RunFailure;

use crate::lint::text;

const BESIDE: &str = "
    [[blocks]]
    name = 'beside'
    origin = [3, 0, 0]
    size = [1, 1, 1]
    material = 'rock'
    joint = 'seam'
    ";
const RELAX: &str = "[[stage]]\nname = 'weight'\nkind = 'relax'\n";
const BASE: &str = "[[fix]]\n        where = { z = 0.0 }\n        axes = 'xyz'";

/// Hexahedron whose top coincides with its base.
const FLAT: &str = "
    [[blocks]]
    name = 'flat'
    material = 'rock'
    mesh = { nodes = [[9, 0, 0], [10, 0, 0], [10, 1, 0], [9, 1, 0]], hexes = [[0, 1, 2, 3, 0, 1, 2, 3]], blocks = [0] }
    ";

/// Cavity that is split finer than the blocks around it.
const CAVITY: &str = "
    [[refine]]
    factor = 2
    where = { x = [1, 2], y = [1, 2], z = [1, 2] }
    [[remove]]
    where = { x = [1, 2], y = [1, 2], z = [1, 2] }
    [[charge]]
    where = { sphere = { centre = [1.5, 1.5, 1.5], radius = 0.7 } }
    mass = 500
    explosive = 'tnt'
    ";

/// Decks with wrong geometry.
fn wrong() -> Vec<String> {
    let deck = |more: &str| text(&[], more);
    vec![
        deck("[[load]]\nwhere = { x = 1.3 }\npressure = 1e6\n"),
        deck("[[fix]]\nwhere = { z = 9.0 }\naxes = 'z'\n"),
        deck("[[remove]]\nwhere = { x = [8, 9] }\n"),
        deck(&BESIDE.replace("[3, 0, 0]", "[2.5, 0, 0]")),
        deck("[[remove]]\nwhere = { set = 'rock' }\n"),
        deck(&format!("{BESIDE}[[refine]]\nfactor = 2\nwhere = {{ set = 'beside' }}\n"))
            .replace("joint = 'seam'\n    [[refine]]", "[[refine]]"),
        text(&[("friction = 35", "friction = 35\nthickness = 2")], ""),
        text(&[(BASE, "")], RELAX),
        deck("[[boundary]]\nwhere = { z = 0.0 }\nkind = 'viscous'\n"),
        deck(FLAT),
        deck(CAVITY),
    ]
}

#[test]
fn build_error_messages() {
    let mut messages = Vec::new();
    for text in wrong() {
        let (deck, _) = parse(&text, "deck.toml").unwrap_or_else(|error| panic!("{error}"));
        assert!(check(&deck).is_empty(), "{:?}\n{text}", check(&deck));
        let Err(error) = BuiltDeck::new(&deck) else { panic!("no error\n{text}") };
        messages.extend(error.faults.iter().map(ToString::to_string));
    }
    insta::assert_snapshot!(messages.join("\n"));
}

/// Errors of a run; `every_message_is_in_a_snapshot` requires each variant here.
fn run_errors() -> Vec<RunError> {
    let rock = || "rock".to_owned();
    let moving = |block: usize| MovingBlock {
        set: rock(),
        block,
        distance: 0.3,
        direction: [0.6, 0.0, -0.8],
    };
    let no_equilibrium = |moving: Vec<MovingBlock>, failed: u64| RunError::NoEquilibrium {
        blocks: [4, 5],
        distance: 0.3,
        moving,
        ratio: 0.01,
        failed,
    };
    let not_converged = |ratio: f64, failed: u64| RunError::NotConverged {
        ratio,
        tolerance: 1e-6,
        max_steps: 1000,
        failed,
        fastest: Some(FastestBlock { block: 4, set: rock(), speed: 1e-5 }),
    };
    let computed = || "1/0".to_owned();
    vec![
        RunError::UnstableTimeStep { time_step: 2e-4, critical: 1e-4 },
        RunError::TooShort { time_step: 1e-14, critical: 1e-4 },
        RunError::NoCriticalStep,
        RunError::NoRelaxationMass { block: 2, node: 17 },
        RunError::TooManyLaws { laws: 70_000 },
        RunError::Values { faults: vec![Fault::new(ErrorCode::OutOfRange, "time", "no number")] },
        RunError::Stopped,
        RunError::HistoryFailed { entry: "load[0]".to_owned(), time: 0.5, message: computed() },
        RunError::EarlierStage { stage: 0, present: 2 },
        RunError::Diverged { step: 10, time: 1e-3, block: 2, node: 17 },
        too_fast(None),
        too_fast(Some(1)),
        penetration(Some((1, 3)), false),
        penetration(None, false),
        penetration(None, true),
        no_equilibrium(Vec::new(), 0),
        no_equilibrium(vec![moving(4)], 12),
        no_equilibrium((1..6).map(moving).collect(), 12),
        not_converged(1e-3, 0),
        not_converged(1e-3, 2),
        not_converged(2.0, 2),
        unreachable_tolerance(Some(1e-6)),
        unreachable_tolerance(Some(0.0)),
        unreachable_tolerance(None),
        with_ratio(unreachable_tolerance(Some(0.0)), 0.1),
    ]
}

fn too_fast(driven: Option<usize>) -> RunError {
    RunError::BlockTooFast {
        block: 2,
        set: "rock".to_owned(),
        step: 10,
        time: 1e-3,
        distance: 0.3,
        edge: 1.0,
        driven,
    }
}

fn penetration(driven: Option<(usize, usize)>, relaxes: bool) -> RunError {
    RunError::DeepPenetration {
        blocks: [2, 3],
        sets: Box::new(["rock".to_owned(), "beside".to_owned()]),
        step: 10,
        time: 1e-3,
        depth: 0.3,
        edge: 1.0,
        driven,
        relaxes,
    }
}

fn unreachable_tolerance(thickness: Option<f64>) -> RunError {
    RunError::UnreachableTolerance {
        ratio: 1e-10,
        tolerance: 1e-12,
        block: 3,
        force: 1e-4,
        joint: thickness.map(|thickness| ("seam".to_owned(), thickness)),
    }
}

/// Same error with another unbalanced ratio.
fn with_ratio(mut error: RunError, to: f64) -> RunError {
    if let RunError::UnreachableTolerance { ratio, .. } = &mut error {
        *ratio = to;
    }
    error
}

#[test]
fn run_error_messages() {
    let errors = run_errors();
    for error in &errors {
        let (text, code) = (error.to_string(), error.code());
        assert!(text.ends_with(&format!(" [{code}]")), "{text}");
        assert_eq!(text.matches(&format!("[{code}]")).count(), 1, "{text}");
    }
    let messages: Vec<String> = errors.iter().map(ToString::to_string).collect();
    insta::assert_snapshot!(messages.join("\n"));
}

/// Failures of runs without a stage; `every_message_is_in_a_snapshot` requires each variant here.
fn run_failures() -> Vec<RunFailure> {
    let folder = || "out".into();
    let path = || "out/energy.csv".into();
    let refused = || io::Error::from(io::ErrorKind::PermissionDenied);
    let operation = "writing";
    let folders = [
        FolderError::OtherDeck {
            folder: folder(),
            deck: "slope.toml".to_owned(),
            title: "A slope".to_owned(),
        },
        FolderError::OtherDeck {
            folder: folder(),
            deck: "slope.toml".to_owned(),
            title: String::new(),
        },
        FolderError::ForeignFile { folder: folder(), file: "energy.csv".to_owned() },
        FolderError::NotAFolder { folder: folder() },
        FolderError::InUse { folder: folder() },
        FolderError::NothingToResume { folder: folder() },
        FolderError::DeckChanged { folder: folder() },
        FolderError::NotWritable {
            source: OutputError::Io { path: path(), operation, error: refused() },
        },
    ];
    let files = [
        OutputError::DiskFull { path: path(), operation, source: refused().into() },
        OutputError::Busy { path: path(), operation, source: refused().into() },
        OutputError::Io { path: path(), operation, error: refused() },
        OutputError::Io { path: path(), operation: "reopening", error: refused() },
        OutputError::Io {
            path: path(),
            operation,
            error: io::Error::other("File too large (os error 27)"),
        },
        OutputError::Gone { path: path(), operation, source: refused().into() },
        OutputError::Format { path: path(), operation, error: "no table".into() },
        OutputError::Unusable { path: path(), message: "no frames".to_owned() },
        OutputError::Mismatch { path: path(), message: "2 rows".to_owned() },
    ];
    let mut failures = vec![
        DeckError::Unwritable { message: "a whole number of 2^63".to_owned() }.into(),
        ModelError::from(Fault::new(ErrorCode::EmptyModel, "stage", "no stage")).into(),
        RunFailure::Recorded { folder: folder() },
        RunFailure::Memory { needed: 48 << 30, available: 24 << 30, blocks: 1000, nodes: 1 << 28 },
        RunFailure::Threads { threads: 4, error: "no more".into() },
        RunFailure::Stopped,
        RunFailure::Stage { stage: "go".to_owned(), error: RunError::NoCriticalStep },
        RunFailure::Checkpoint {
            path: folder(),
            message: "another model".to_owned(),
            code: ErrorCode::CheckpointMismatch,
        },
        RunFailure::Internal { message: "index out of bounds".to_owned() },
    ];
    failures.extend(folders.map(RunFailure::from));
    failures.extend(files.map(RunFailure::from));
    failures
}

#[test]
fn run_failure_messages() {
    let failures = run_failures();
    for failure in &failures {
        let (text, code) = (failure.to_string(), failure.code());
        assert!(text.ends_with(&format!(" [{code}]")), "{text}");
        assert_eq!(text.matches(&format!("[{code}]")).count(), 1, "{text}");
    }
    let messages: Vec<String> = failures.iter().map(ToString::to_string).collect();
    insta::assert_snapshot!(messages.join("\n"));
}

/// A program that writes a wrong deck makes the same mistake in each of very many entries. All are found, and a hundred
/// are listed.
#[test]
fn very_many_mistakes_are_listed_in_part() {
    let entry = "[[load]]\nwhere = { z = 0.0 }\nforce = [1, 2]\n";
    let error = parse(&entry.repeat(20_000), "loads.toml").err().unwrap();
    let text = error.to_string();
    let report = error.report(false);
    assert_eq!(error.findings().len(), 20_000);
    let last = error.findings().last().unwrap();
    assert_eq!((last.line, last.column), (60_000, 9));
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 102);
    assert_eq!(lines[0], "the deck `loads.toml` has 20000 mistakes");
    assert_eq!(lines[101], "… and 19900 more");
    assert!(report.ends_with("\n… and 19980 more\n"), "{report}");
}

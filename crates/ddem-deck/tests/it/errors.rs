//! Error messages that reading a deck cannot find: about its geometry and about a run.

use ddem_core::{MovingBlock, RunError};
use ddem_deck::*;
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

#[test]
fn run_error_messages() {
    let moving = MovingBlock {
        set: "rock".to_owned(),
        block: 4,
        distance: 0.3,
        direction: [0.6, 0.0, -0.8],
    };
    let errors = [
        RunError::UnstableTimeStep { time_step: 2e-4, critical: 1e-4 },
        RunError::TooShort { time_step: 1e-14, critical: 1e-4 },
        RunError::NoCriticalStep,
        RunError::NoRelaxationMass { block: 2, node: 17 },
        RunError::TooManyLaws { laws: 70_000 },
        RunError::Stopped,
        RunError::HistoryFailed {
            entry: "load[0]".to_owned(),
            time: 0.5,
            message: "1/0".to_owned(),
        },
        RunError::EarlierStage { stage: 0, present: 2 },
        RunError::Diverged { step: 10, time: 1e-3, block: 2, node: 17 },
        RunError::BlockTooFast {
            block: 2,
            set: "rock".to_owned(),
            step: 10,
            time: 1e-3,
            distance: 0.3,
            edge: 1.0,
            driven: None,
        },
        RunError::DeepPenetration {
            blocks: [2, 3],
            sets: Box::new(["rock".to_owned(), "beside".to_owned()]),
            step: 10,
            time: 1e-3,
            depth: 0.3,
            edge: 1.0,
            driven: Some((1, 3)),
            relaxes: false,
        },
        RunError::NoEquilibrium {
            blocks: [4, 5],
            distance: 0.3,
            moving: vec![moving],
            ratio: 0.01,
            failed: 12,
        },
        RunError::NotConverged {
            ratio: 1e-3,
            tolerance: 1e-6,
            max_steps: 1000,
            failed: 2,
            fastest: Some((4, "rock".to_owned(), 1e-5)),
        },
        RunError::UnreachableTolerance {
            ratio: 1e-10,
            tolerance: 1e-12,
            block: 3,
            force: 1e-4,
            joint: Some(("seam".to_owned(), 1e-6)),
            far: None,
        },
    ];
    let messages: Vec<String> = errors.iter().map(ToString::to_string).collect();
    insta::assert_snapshot!(messages.join("\n"));
}

#[test]
fn run_failure_messages() {
    let folder = || "out".into();
    let failures: [RunFailure; 15] = [
        DeckError::Unwritable { message: "a whole number of 2^63".to_owned() }.into(),
        FolderError::OtherDeck {
            folder: folder(),
            deck: "slope.toml".to_owned(),
            title: "A slope".to_owned(),
        }
        .into(),
        FolderError::ForeignFile { folder: folder(), file: "energy.csv".to_owned() }.into(),
        FolderError::NotAFolder { folder: folder() }.into(),
        FolderError::InUse { folder: folder() }.into(),
        FolderError::NothingToResume { folder: folder() }.into(),
        FolderError::DeckChanged { folder: folder() }.into(),
        RunFailure::Recorded { folder: folder() },
        RunFailure::Memory { needed: 48 << 30, available: 24 << 30, blocks: 1000, nodes: 1 << 28 },
        RunFailure::Threads { threads: 4, error: "no more".into() },
        RunFailure::Stopped,
        ddem_io::OutputError::Unusable { path: folder(), message: "no frames".to_owned() }.into(),
        ddem_io::OutputError::Io {
            path: folder(),
            operation: "writing",
            error: std::io::ErrorKind::PermissionDenied.into(),
        }
        .into(),
        RunFailure::Checkpoint { path: folder(), message: "another model".to_owned() },
        RunFailure::Internal { message: "index out of bounds".to_owned() },
    ];
    let messages: Vec<String> = failures.iter().map(ToString::to_string).collect();
    insta::assert_snapshot!(messages.join("\n"));
}

//! Features that other Rust programs rely on: complete errors that `?` passes on, types of
//! dependencies without a dependency of their own, and the code in README.md.

use std::error::Error;
use std::fs;
use std::path::Path;

use ddem::deck::{BlockSet, Material};
use ddem::deck::{DeckError, Finding};
use ddem::deck::{from_table, json_schema, parse};
use ddem::io::OutputError;
use ddem::io::folder::FolderError;
use ddem::io::run::RunFailure;
use ddem::law::Traction;
use ddem::{Deck, Fault, ModelError, RunError, Simulation};

fn passes_on<E: Error + Send + Sync + 'static>() {}

#[test]
fn errors_pass_through_question_mark() {
    passes_on::<Fault>();
    passes_on::<ModelError>();
    passes_on::<RunError>();
    passes_on::<Finding>();
    passes_on::<DeckError>();
    passes_on::<RunFailure>();
    passes_on::<FolderError>();
    passes_on::<OutputError>();
}

/// Fails with one error, on each of two ways to a model.
fn fails(text: Option<&str>) -> Result<Simulation, Box<dyn Error>> {
    let deck = match text {
        Some(text) => {
            let (deck, source) = parse(text, "block.toml")?;
            source.check(&deck)?;
            deck
        }
        None => {
            let mut deck = Deck::default();
            let rock = Material { density: 2400.0, young: 18e9, poisson: 0.75 };
            deck.materials.insert("rock".into(), rock);
            let size = Some([1.0; 3]);
            deck.blocks.push(BlockSet { size, material: "rock".into(), ..BlockSet::default() });
            deck
        }
    };
    Ok(Simulation::new(deck.build()?))
}

/// The `Debug` text says it too, because a `main` that returns an error prints it.
#[test]
fn errors_name_cause_place_and_remedy() {
    let unknown = "[materials.rock]\ndensity = 2400\nyoung = 18e9\npossion = 0.25\n";
    for (text, wanted) in [
        (None, &["materials.rock.poisson", "0.75", "0.5"][..]),
        (Some(unknown), &["block.toml:4:1", "unknown key `possion`", "did you mean `poisson`?"]),
        (
            Some("[materials.rock]\nyoung = 20GPa\n"),
            &["block.toml:2:", "not a number", "write 2e10"],
        ),
    ] {
        let error = fails(text).map(|_| ()).expect_err("a mistake");
        let message = error.to_string();
        assert!(wanted.iter().all(|part| message.contains(part)), "{message}");
        assert_eq!(format!("{error:?}"), message);
    }
}

/// Errors state the fact alone, because the remedy differs between command line, Python and Rust. A
/// chain of errors repeats nothing.
#[test]
fn file_errors_state_fact_once() {
    let folder = || "results".into();
    let path = || "results/energy.csv".into();
    let operation = "writing";
    let refused = || std::io::Error::other("the quota is spent");
    let diverged = RunError::Diverged { step: 3, time: 0.1, block: 1, node: 2 };
    let all: Vec<(Box<dyn Error>, &str)> = vec![
        (
            Box::new(FolderError::OtherDeck {
                folder: folder(),
                deck: "a.toml".into(),
                title: "a".into(),
            }),
            "results holds the results of another deck, a.toml \"a\"",
        ),
        (
            Box::new(FolderError::NothingToResume { folder: folder() }),
            "results holds no checkpoint to resume",
        ),
        (
            Box::new(FolderError::NotWritable {
                source: OutputError::Io { path: path(), operation, error: refused() },
            }),
            "writing results/energy.csv failed: the quota is spent",
        ),
        (
            Box::new(OutputError::DiskFull { path: path(), operation, source: refused().into() }),
            "no space left on the disk while writing results/energy.csv",
        ),
        (
            Box::new(RunFailure::Stage { stage: "shake".into(), error: diverged }),
            "stage `shake`: diverged",
        ),
    ];
    for (error, wanted) in all {
        let message = error.to_string();
        assert!(message.starts_with(wanted) && !message.contains("--"), "{message}");
        let below = error.source().map(ToString::to_string);
        assert!(below.is_none_or(|below| !message.contains(&below)), "{message}");
    }
}

#[test]
fn dependency_types_are_reexported() -> Result<(), Box<dyn Error>> {
    let shear = ddem::nalgebra::Vector2::new(3e3, 4e3);
    assert_eq!(Traction { normal: -1e4, shear }.shear.norm(), 5e3);
    let table: ddem::deck::toml::Table = "title = 'a deck'".parse()?;
    assert_eq!(from_table(&table)?.title, "a deck");
    let schema: ddem::io::serde_json::Value = json_schema();
    assert!(schema["properties"]["title"].is_object());
    Ok(())
}

/// The Rust code in README.md is part of the examples, which are compiled.
#[test]
fn readme_code_is_in_the_examples() -> Result<(), Box<dyn Error>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let readme = fs::read_to_string(root.join("README.md"))?;
    let mut examples = String::new();
    for entry in fs::read_dir(root.join("examples"))? {
        let path = entry?.path();
        if path.extension().is_some_and(|extension| extension == "rs") {
            examples += &fs::read_to_string(path)?;
        }
    }
    let blocks: Vec<&str> =
        readme.split("```rust\n").skip(1).filter_map(|rest| rest.split("```").next()).collect();
    assert!(blocks.len() >= 2, "no code in Rust");
    for block in blocks {
        assert!(examples.contains(block), "in no file of examples:\n{block}");
    }
    Ok(())
}

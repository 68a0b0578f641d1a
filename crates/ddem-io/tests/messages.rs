//! Snapshots of the messages about files that a run or a session cannot continue, and about stages of a
//! session.

use std::fs;
use std::path::Path;

use ddem_core::Simd;
use ddem_deck::{Deck, Stage, StageKind};
use ddem_io::checkpoint::{self, Checkpoint};
use ddem_io::folder::Earlier;
use ddem_io::run::{Event, Observer, Options, RunFailure, Session, run};
use ddem_io::tables::Table;

/// Warnings of stages.
#[derive(Default)]
struct Warned(Vec<String>);

impl Observer for Warned {
    fn event(&mut self, event: Event<'_>) {
        if let Event::Warning(warning) = event {
            self.0.push(warning.to_string());
        }
    }
}

const COLUMN: &str = "
title = 'column'
[model]
gravity = [0, 0, -10]
[materials.rock]
density = 2400
young = 18e9
poisson = 0.25
[[blocks]]
size = [1, 1, 1]
divisions = 1
material = 'rock'
[[fix]]
where = { z = 0.0 }
axes = 'xyz'
[[load]]
where = { z = 1.0 }
pressure = 1e5
[[stage]]
name = 'weight'
kind = 'relax'
[[stage]]
name = 'shake'
kind = 'dynamic'
duration = 1e-5
";

/// Block beside the column that a topography removes.
const PIT: &str = "
[[blocks]]
name = 'beside'
origin = [5, 0, 0]
size = [1, 1, 1]
divisions = 1
material = 'rock'
[[remove]]
where = { set = 'beside', above = { topography = 'pit.csv' } }
";

/// Level ground as a topography.
fn ground(height: f64) -> String {
    let corners = [[-1, -1], [7, -1], [-1, 7], [7, 7]];
    corners.map(|[x, y]| format!("{x},{y},{height}\n")).concat()
}

/// Errors as a user sees them, without the path of a temporary folder.
fn message<T, E: ToString>(folder: &Path, done: Result<T, E>) -> String {
    let error = done.err().unwrap_or_else(|| panic!("no error")).to_string();
    error.replace(&format!("{}/", folder.display()), "")
}

#[test]
fn tables() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("energy.csv");
    let mut table = Table::create(&path, &["kinetic"]).unwrap();
    let mut found = vec![message(folder.path(), table.row("go", 0, 0.0, &[1.0, 2.0]))];
    table.row("go", 0, 0.0, &[1.0]).unwrap();
    drop(table);
    found.push(message(folder.path(), Table::reopen(&path, 2)));
    fs::write(&path, "a,b\n1,2\n").unwrap();
    found.push(message(folder.path(), Table::reopen(&path, 0)));
    insta::assert_snapshot!(found.join("\n"));
}

/// Bytes of a checkpoint in which one array is replaced by the given one.
fn replaced(path: &Path, name: &str, add: impl FnOnce(&hdf5::File)) {
    checkpoint::save(path, "deck", &[1], &[2; 100]).unwrap();
    let file = hdf5::File::open_rw(path).unwrap();
    file.unlink(name).unwrap();
    add(&file);
    file.close().unwrap();
    seal(path);
}

/// Adds the seal that ends a checkpoint.
fn seal(path: &Path) {
    let mut bytes = fs::read(path).unwrap();
    let checksum = crc32fast::hash(&bytes);
    bytes.extend(b"ddem crc-32:");
    bytes.extend(checksum.to_le_bytes());
    fs::write(path, bytes).unwrap();
}

#[test]
fn checkpoints() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("checkpoint.h5");
    let load = |path: &Path| message(folder.path(), Checkpoint::load(path));
    let mut found = vec![load(&path)];
    fs::create_dir(folder.path().join("results")).unwrap();
    found.push(load(&folder.path().join("results")));
    hdf5::File::create(&path).unwrap().create_group("arrays").unwrap();
    found.push(load(&path));
    checkpoint::save(&path, "deck", &[1], &[2; 100]).unwrap();
    let whole = fs::read(&path).unwrap();
    let file = hdf5::File::open_rw(&path).unwrap();
    file.attr("version").unwrap().write_scalar(&6_u64).unwrap();
    file.close().unwrap();
    found.push(load(&path));
    fs::write(&path, &whole).unwrap();
    let file = hdf5::File::open_rw(&path).unwrap();
    file.delete_attr("version").unwrap();
    file.close().unwrap();
    found.push(load(&path));
    replaced(&path, "run", |file| {
        file.new_dataset::<f64>().shape(3).create("run").unwrap();
    });
    found.push(load(&path));
    replaced(&path, "state", |file| {
        file.new_dataset::<u8>().shape(1 << 20).chunk(1 << 10).create("state").unwrap();
    });
    found.push(load(&path));
    fs::write(&path, &whole[..100]).unwrap();
    found.push(load(&path));
    fs::write(&path, &whole[..whole.len() - 16]).unwrap();
    found.push(load(&path));
    let mut flipped = whole.clone();
    flipped[whole.len() / 2] ^= 1;
    fs::write(&path, &flipped).unwrap();
    found.push(load(&path));
    // The size of a whole file depends on the version that it names.
    insta::with_settings!({filters => vec![(r"stored_eof = \d+", "stored_eof = [size]")]}, {
        insta::assert_snapshot!(found.join("\n"));
    });
}

/// Runs the deck in a folder into `out` beside it.
fn run_in(folder: &Path, earlier: Earlier) -> Result<(), RunFailure> {
    let (deck, source) = ddem_deck::read(&folder.join("deck.toml"))?;
    let mut options = Options::new(folder.join("out"));
    options.threads = Some(1);
    options.earlier = earlier;
    run(&deck, &source, &options, &mut Warned::default()).map(|_| ())
}

#[test]
fn runs_that_cannot_be_resumed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::write(path.join("deck.toml"), COLUMN.to_owned() + PIT).unwrap();
    fs::write(path.join("pit.csv"), ground(0.2)).unwrap();
    let first = run_in(path, Earlier::Keep);
    first.unwrap_or_else(|error| panic!("{error}"));
    let saved = path.join("out/checkpoint.h5");
    let Checkpoint { deck, run, state } = Checkpoint::load(&saved).unwrap();
    // The run would continue from the checkpoint before a damaged one.
    let _ = fs::remove_file(path.join("out/checkpoint-previous.h5"));
    let resume = |deck: &str, run: &[u8], state: &[u8]| {
        checkpoint::save(&saved, deck, run, state).unwrap();
        message(path, run_in(path, Earlier::Resume))
    };
    // A program saved its session, without files of results, in the folder of the run.
    let alone = path.join("alone.h5");
    let (of_folder, _) = ddem_deck::read(&path.join("deck.toml")).unwrap();
    session(&of_folder).save(&alone).unwrap();
    let alone = Checkpoint::load(&alone).unwrap();
    let mut found = vec![
        resume("title = 'another deck'", &run, &state),
        resume(&deck, &run[..9], &state),
        resume(&deck, &run, &state[..99]),
        resume(&deck, &alone.run, &alone.state),
    ];
    fs::write(&saved, "text").unwrap();
    found.push(message(path, run_in(path, Earlier::Resume)));
    checkpoint::save(&saved, &deck, &run, &state).unwrap();
    fs::write(path.join("pit.csv"), ground(0.3)).unwrap();
    found.push(message(path, run_in(path, Earlier::Resume)));
    insta::assert_snapshot!(found.join("\n"));
}

fn column() -> Deck {
    ddem_deck::parse_alone(COLUMN, "column.toml").unwrap().0
}

fn session(deck: &Deck) -> Session {
    Session::new(deck, Simd::default()).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn sessions_that_cannot_be_loaded() {
    let folder = tempfile::tempdir().unwrap();
    let saved = folder.path().join("saved.h5");
    let half =
        |model: &mut ddem_core::Model| model.set_load_history(0, std::sync::Arc::new(|_| Ok(0.5)));
    let load = |deck: Option<&Deck>| {
        message(folder.path(), Session::load(&saved, Simd::default(), deck, |_| Ok(())))
    };
    let computed = Session::with(&column(), Simd::default(), half);
    computed.unwrap_or_else(|error| panic!("{error}")).save(&saved).unwrap();
    let mut found = vec![load(None)];
    session(&column()).save(&saved).unwrap();
    let mut other = column();
    other.title = "pillar".into();
    found.push(load(Some(&other)));
    // A checkpoint without the contents of a file that its deck names.
    let Checkpoint { run, state, .. } = Checkpoint::load(&saved).unwrap();
    checkpoint::save(&saved, &(COLUMN.to_owned() + PIT), &run, &state).unwrap();
    found.push(load(None));
    insta::assert_snapshot!(found.join("\n"));
}

#[test]
fn stages_of_sessions() {
    let mut session = session(&column());
    let mut listener = Warned::default();
    let safety = Stage { name: "fs".into(), kind: StageKind::Safety, ..Stage::default() };
    let mut found = Vec::new();
    let refused = session.stage(&safety, None, &mut listener);
    found.push(refused.err().unwrap().to_string());
    let relax = |name: &str| Stage { name: name.into(), ..Stage::default() };
    session.stage(&relax("shaken"), None, &mut listener).unwrap();
    found.append(&mut listener.0);
    session.enter(1, "stage").unwrap();
    found.push(session.enter(0, "stage").unwrap_err().to_string());
    insta::assert_snapshot!(found.join("\n"));
}

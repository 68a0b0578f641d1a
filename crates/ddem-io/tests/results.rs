//! Writing, reading and continuing tables, summary, checkpoint and the folder around them.

use std::fs;
use std::path::Path;

use ddem_io::OutputError;
use ddem_io::checkpoint::{self, Checkpoint};
use ddem_io::folder::{Earlier, FolderError, prepare};
use ddem_io::summary::{ChargeSummary, FailedPairs, StageSummary, Summary, peak_memory_bytes};
use ddem_io::tables::Table;
use ddem_io::version::{REVISION, VERSION};
use ddem_io::vtkhdf::Writer;
use hdf5::File;
use hdf5::types::FixedAscii;
use tempfile::tempdir;

#[test]
fn probes_have_full_precision_and_empty_cells() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("probes.csv");
    let mut table = Table::create(&path, &["top.x", "a,\"b\".z"]).unwrap();
    table.row("fall, \"free\"", 3, 0.1 + 0.2, &[Some(1e-300), None]).unwrap();
    table.row("rest", u64::MAX, 1.0, &[Some(f64::NAN), Some(-0.0)]).unwrap();
    assert_eq!(table.rows_written(), 2);
    assert!(matches!(table.row("rest", 0, 0.0, &[None]), Err(OutputError::Mismatch { .. })));
    table.flush().unwrap();
    let text = fs::read_to_string(&path).unwrap();
    assert_eq!(
        text,
        "stage,step,time,top.x,\"a,\"\"b\"\".z\"\n\
         \"fall, \"\"free\"\"\",3,0.30000000000000004,1e-300,\n\
         rest,18446744073709551615,1.0,NaN,-0.0\n"
    );
}

#[test]
fn tables_continue_after_last_valid_row() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("energy.csv");
    let mut table = Table::create(&path, &["kinetic"]).unwrap();
    for step in 0..5 {
        table.row("two\nlines, \"quoted\"", step, 0.5, &[step as f64]).unwrap();
    }
    table.sync().unwrap();
    drop(table);
    let whole = fs::read_to_string(&path).unwrap();
    // A run that was killed in the middle of a row.
    fs::write(&path, &whole[..whole.len() - 3]).unwrap();
    let error = Table::reopen(&path, 9).unwrap_err().to_string();
    assert!(error.contains("energy.csv") && error.contains("5 rows"), "{error}");
    let mut table = Table::reopen(&path, 3).unwrap();
    assert_eq!((table.rows_written(), table.columns()), (3, &["kinetic".to_owned()][..]));
    for step in 3..5 {
        table.row("two\nlines, \"quoted\"", step, 0.5, &[step as f64]).unwrap();
    }
    drop(table);
    assert_eq!(fs::read_to_string(&path).unwrap(), whole);
    Table::reopen(&path, 0).unwrap();
    assert_eq!(fs::read_to_string(&path).unwrap(), "stage,step,time,kinetic\n");
    fs::write(&path, "a,b\n1,2\n").unwrap();
    assert!(matches!(Table::reopen(&path, 0), Err(OutputError::Unusable { .. })));
}

/// `/dev/full` is a disk without space.
#[cfg(target_os = "linux")]
#[test]
fn full_disk_is_named() {
    let error = Table::create("/dev/full", &["kinetic"]).unwrap_err();
    assert!(matches!(error, OutputError::DiskFull { .. }), "{error}");
    assert!(error.to_string().starts_with("no space left on the disk while writing /dev/full"));
}

#[test]
fn summary_has_the_documented_keys() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("summary.json");
    let stage = StageSummary { name: "gravity".into(), steps: 7, ..StageSummary::default() };
    let failed_pairs = FailedPairs { shear: 1, tension: 2 };
    let summary = Summary {
        title: "beam".into(),
        failed_pairs,
        stages: vec![stage],
        charges: vec![ChargeSummary::default()],
        ..Summary::default()
    };
    summary.write(&path).unwrap();
    assert_eq!(Summary::read(&path).unwrap(), summary);
    let json: serde_json::Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    let keys = |value: &serde_json::Value| {
        let mut keys: Vec<String> = value.as_object().unwrap().keys().cloned().collect();
        keys.sort_unstable();
        keys
    };
    let top = keys(&json);
    let mut documented = [
        "version",
        "revision",
        "title",
        "blocks",
        "nodes",
        "elements",
        "pairs",
        "failed_pairs",
        "contacts",
        "fragments",
        "interfaces",
        "charges",
        "selections",
        "added_inertia",
        "worst_element",
        "peak_memory_bytes",
        "stages",
        "warnings",
        "deck",
    ];
    documented.sort_unstable();
    assert_eq!(top, documented);
    let charge = keys(&json["charges"][0]);
    let mut documented =
        ["walls", "joints", "area", "volume", "mass", "filling", "density", "pressure"];
    documented.sort_unstable();
    assert_eq!(charge, documented);
    let stage = keys(&json["stages"][0]);
    let mut documented = [
        "name",
        "kind",
        "verdict",
        "moving",
        "steps",
        "time_step",
        "limit",
        "wall_seconds",
        "node_updates_per_second",
        "state",
        "unbalanced",
        "imbalance",
    ];
    documented.sort_unstable();
    assert_eq!(stage, documented);
    let unknown = StageSummary { unbalanced: f64::NAN, ..StageSummary::default() };
    Summary { stages: vec![unknown], ..summary }.write(&path).unwrap();
    assert!(Summary::read(&path).unwrap().stages[0].unbalanced.is_nan());
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    fs::write(&path, "{").unwrap();
    assert!(matches!(Summary::read(&path), Err(OutputError::Unusable { .. })));
}

#[cfg(any(target_os = "linux", target_os = "macos"))]
#[test]
fn peak_memory_includes_freed_memory() {
    drop(std::hint::black_box(vec![1_u8; 64 << 20]));
    assert!((64 << 20..1 << 40).contains(&peak_memory_bytes()));
}

#[test]
fn checkpoints_keep_every_bit() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("checkpoint.h5");
    checkpoint::save(&path, "", &[], &[]).unwrap();
    assert_eq!(Checkpoint::load(&path).unwrap(), Checkpoint::default());
    // This replaces the earlier checkpoint and has more than one chunk.
    let state: Vec<u8> =
        (0..3_000_000_u32).map(|i| (i.wrapping_mul(0x9E37_79B9) >> 24) as u8).collect();
    let deck = "title = 'Stütze \0'\n";
    checkpoint::save(&path, deck, &[0, 255, 7], &state).unwrap();
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    let loaded = Checkpoint::load(&path).unwrap();
    assert!(loaded == Checkpoint { deck: deck.into(), run: vec![0, 255, 7], state });
}

#[test]
fn failed_save_keeps_old_checkpoint() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("checkpoint.h5");
    checkpoint::save(&path, "old", &[], &[]).unwrap();
    // The temporary name is taken by a folder.
    fs::create_dir(folder.path().join("checkpoint.h5.part")).unwrap();
    let error = checkpoint::save(&path, "new", &[], &[]).unwrap_err().to_string();
    assert!(error.contains("checkpoint.h5"), "{error}");
    assert_eq!(Checkpoint::load(&path).unwrap().deck, "old");
}

#[test]
fn damaged_and_foreign_checkpoints_are_errors() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("checkpoint.h5");
    let unusable = |what: &str| {
        let error = Checkpoint::load(&path).unwrap_err();
        assert!(matches!(error, OutputError::Unusable { .. }), "{what}: {error}");
        let text = error.to_string();
        assert!(text.contains("checkpoint.h5"), "{what}: {text}");
        text
    };
    assert!(matches!(Checkpoint::load(&path), Err(OutputError::Io { .. })));
    let state: Vec<u8> = (0..40_000_u32).map(|i| (i % 251) as u8).collect();
    checkpoint::save(&path, "deck", &[1], &state).unwrap();
    let whole = fs::read(&path).unwrap();
    for part in [0, 4, 100, 1000, whole.len() / 2, whole.len() - 1] {
        fs::write(&path, &whole[..part]).unwrap();
        unusable(&format!("{part} bytes"));
    }
    // One bit of the saved state is flipped.
    let at = whole.windows(9).position(|part| part == &state[1000..1009]).unwrap();
    let mut flipped = whole.clone();
    flipped[at] ^= 4;
    fs::write(&path, &flipped).unwrap();
    assert!(unusable("a bit").contains("damaged"));
    fs::write(&path, "stage,step,time\n").unwrap();
    unusable("text");
    hdf5::File::create(&path).unwrap().create_group("arrays").unwrap();
    assert!(unusable("other program").contains("not a checkpoint of ddem"));
    for (version, other) in [(6_u64, "an earlier version"), (99, "a later version")] {
        fs::write(&path, &whole).unwrap();
        let file = hdf5::File::open_rw(&path).unwrap();
        file.attr("version").unwrap().write_scalar(&version).unwrap();
        file.close().unwrap();
        let error = Checkpoint::load(&path).unwrap_err();
        assert!(matches!(error, OutputError::Version { .. }), "{error}");
        let message = error.to_string();
        assert!(
            message.contains(&format!("format {version}, written by {other} of ddem")),
            "{message}"
        );
        assert!(message.contains("run from the start"), "{message}");
    }
}

/// Names and contents of all files, to check that nothing was touched.
fn contents(folder: &Path) -> Vec<(std::ffi::OsString, Vec<u8>)> {
    let entries = fs::read_dir(folder).unwrap().map(Result::unwrap);
    let mut all: Vec<_> =
        entries.map(|e| (e.file_name(), fs::read(e.path()).unwrap_or_default())).collect();
    all.sort();
    all
}

#[test]
fn same_deck_reuses_its_folder() {
    let root = tempdir().unwrap();
    let out = root.path().join("results/beam");
    let folder = prepare(&out, "beam.toml", "Beam", "a = 1", Earlier::Overwrite).unwrap();
    let files = [
        folder.blocks(),
        folder.joints(),
        folder.contacts(),
        folder.probes(),
        folder.energy(),
        folder.summary(),
        folder.checkpoint(),
        out.join("notes.txt"),
        out.join("checkpoint.h5.part"),
    ];
    files.iter().for_each(|file| fs::write(file, "x").unwrap());
    // The folder is in use while the first run lasts.
    let error = prepare(&out, "beam.toml", "Beam", "a = 1", Earlier::Overwrite).unwrap_err();
    assert!(matches!(error, FolderError::InUse { .. }), "{error}");
    drop(folder);
    let before = contents(&out);
    let error = prepare(&out, "beam.toml", "Beam", "a = 2", Earlier::Resume).unwrap_err();
    assert!(matches!(error, FolderError::DeckChanged { .. }), "{error}");
    prepare(&out, "beam.toml", "Beam", "a = 1", Earlier::Resume).unwrap();
    assert_eq!(contents(&out), before);
    prepare(&out, "beam.toml", "Beam", "a = 2", Earlier::Overwrite).unwrap();
    let names: Vec<_> = contents(&out).into_iter().map(|(name, _)| name).collect();
    assert_eq!(names, ["ddem.json", "notes.txt"]);
    let error = prepare(&out, "beam.toml", "Beam", "a = 2", Earlier::Reopen).unwrap_err();
    assert!(matches!(error, FolderError::NothingToResume { .. }), "{error}");
}

/// A run that was killed before its first checkpoint may leave any of its files, and an empty marker.
#[test]
fn run_without_checkpoint_begins_anew() {
    let root = tempdir().unwrap();
    let out = root.path().join("beam");
    let begin = |text: &str| prepare(&out, "beam.toml", "Beam", text, Earlier::Resume);
    let folder = begin("a = 1").unwrap();
    fs::write(folder.probes(), "half a ta").unwrap();
    fs::write(out.join("blocks.vtkhdf.part"), "half a file").unwrap();
    drop(folder);
    let error = begin("a = 2").unwrap_err();
    assert!(matches!(error, FolderError::DeckChanged { .. }), "{error}");
    drop(begin("a = 1").unwrap());
    let before = contents(&out);
    let names: Vec<_> = before.iter().map(|(name, _)| name).collect();
    assert_eq!(names, ["ddem.json"]);
    fs::write(out.join("ddem.json"), "").unwrap();
    drop(begin("a = 1").unwrap());
    assert_eq!(contents(&out), before);
    // With either checkpoint nothing is removed.
    for name in ["checkpoint.h5", "checkpoint-previous.h5"] {
        fs::write(out.join("probes.csv"), "a table").unwrap();
        fs::write(out.join(name), "a checkpoint").unwrap();
        drop(begin("a = 1").unwrap());
        assert_eq!(contents(&out).len(), 3);
        fs::remove_file(out.join(name)).unwrap();
    }
}

#[test]
fn foreign_folders_are_not_changed() {
    let root = tempdir().unwrap();
    let out = root.path().join("out");
    drop(prepare(&out, "beam.toml", "Beam", "a = 1", Earlier::Overwrite).unwrap());
    fs::write(out.join("probes.csv"), "precious").unwrap();
    let before = contents(&out);
    for (name, title) in [("arch.toml", "Beam"), ("beam.toml", "Arch")] {
        for earlier in [Earlier::Overwrite, Earlier::Resume] {
            let error = prepare(&out, name, title, "a = 1", earlier).unwrap_err();
            assert!(matches!(error, FolderError::OtherDeck { .. }), "{error}");
            assert!(error.to_string().contains("beam.toml \"Beam\""), "{error}");
        }
    }
    assert_eq!(contents(&out), before);
    for content in ["", "{}", "[1]"] {
        fs::write(out.join("ddem.json"), content).unwrap();
        let error = prepare(&out, "beam.toml", "Beam", "a = 1", Earlier::Overwrite).unwrap_err();
        assert!(matches!(error, FolderError::ForeignFile { .. }), "{error}");
    }
    fs::remove_file(out.join("ddem.json")).unwrap();
    let error =
        prepare(&out, "beam.toml", "Beam", "a = 1", Earlier::Overwrite).unwrap_err().to_string();
    assert!(error.contains("probes.csv"), "{error}");
    assert_eq!(contents(&out).len(), 1);
}

/// Files of others stay as they are: beside the results, or the folder is refused.
#[test]
fn files_of_others_are_never_replaced() {
    let root = tempdir().unwrap();
    let out = root.path().join("documents");
    fs::create_dir(&out).unwrap();
    for name in ["letter.txt", "plot.png", "deck.toml"] {
        fs::write(out.join(name), "precious").unwrap();
    }
    for name in ["blocks.vtkhdf", "summary.json.part", "checkpoint-previous.h5"] {
        fs::write(out.join(name), "precious").unwrap();
        let before = contents(&out);
        for earlier in [Earlier::Keep, Earlier::Overwrite, Earlier::Resume, Earlier::Reopen] {
            let error = prepare(&out, "beam.toml", "Beam", "a = 1", earlier).unwrap_err();
            assert!(error.to_string().contains(name), "{error}");
        }
        assert_eq!(contents(&out), before);
        fs::remove_file(out.join(name)).unwrap();
    }
    for earlier in [Earlier::Keep, Earlier::Keep, Earlier::Overwrite, Earlier::Resume] {
        let folder = prepare(&out, "beam.toml", "Beam", "a = 1", earlier).unwrap();
        fs::write(folder.summary(), "{}").unwrap();
        for name in ["letter.txt", "plot.png", "deck.toml"] {
            assert_eq!(fs::read_to_string(out.join(name)).unwrap(), "precious", "{name}");
        }
    }
}

#[test]
fn new_run_keeps_earlier_results() {
    let root = tempdir().unwrap();
    let out = root.path().join("beam");
    for (number, title) in ["Beam", "Beam", "Arch"].into_iter().enumerate() {
        let folder = prepare(&out, "beam.toml", title, "a = 1", Earlier::Keep).unwrap();
        let kept = (number > 0).then(|| root.path().join(format!("beam.{number}")));
        assert_eq!(folder.kept(), kept.as_deref());
        fs::write(folder.summary(), number.to_string()).unwrap();
        fs::write(out.join("notes.txt"), "stay").unwrap();
    }
    for number in [0, 1] {
        let kept = root.path().join(format!("beam.{}", number + 1));
        assert_eq!(fs::read_to_string(kept.join("summary.json")).unwrap(), number.to_string());
        // The folder belongs to the deck, and only a checkpoint is missing.
        let error = prepare(&kept, "beam.toml", "Beam", "a = 1", Earlier::Reopen).unwrap_err();
        assert!(matches!(error, FolderError::NothingToResume { .. }), "{error}");
    }
    assert_eq!(fs::read_to_string(out.join("summary.json")).unwrap(), "2");
    assert!(out.join("notes.txt").exists());
    // Without results there is nothing to keep.
    fs::remove_file(out.join("summary.json")).unwrap();
    let folder = prepare(&out, "beam.toml", "Beam", "a = 1", Earlier::Keep).unwrap();
    assert_eq!(folder.kept(), None);
}

/// Results behind a link are kept beside their real folder, and the reported path leads there.
#[test]
#[cfg(unix)]
fn results_behind_a_link_are_kept_beside_them() {
    let root = tempdir().unwrap();
    let root = root.path().canonicalize().unwrap();
    for name in ["here", "disk/beam"] {
        fs::create_dir_all(root.join(name)).unwrap();
    }
    let link = root.join("here/latest");
    std::os::unix::fs::symlink(root.join("disk/beam"), &link).unwrap();
    for kept in [None, Some(root.join("disk/beam.1"))] {
        let folder = prepare(&link, "beam.toml", "Beam", "a = 1", Earlier::Keep).unwrap();
        assert_eq!(folder.kept(), kept.as_deref());
        fs::write(folder.summary(), "{}").unwrap();
    }
    assert!(root.join("disk/beam.1/summary.json").exists());
}

#[test]
fn paths_that_cannot_be_folders_are_refused() {
    let root = tempdir().unwrap();
    let file = root.path().join("file");
    fs::write(&file, "x").unwrap();
    let error = prepare(&file, "beam.toml", "Beam", "", Earlier::Keep).unwrap_err();
    assert!(matches!(error, FolderError::NotAFolder { .. }), "{error}");
    let error = prepare(&file.join("below"), "beam.toml", "Beam", "", Earlier::Keep).unwrap_err();
    assert!(matches!(error, FolderError::NotWritable { .. }), "{error}");
    let error =
        prepare(&root.path().join("new"), "beam.toml", "Beam", "", Earlier::Reopen).unwrap_err();
    assert!(matches!(error, FolderError::NothingToResume { .. }), "{error}");
    assert_eq!(contents(root.path()).len(), 1);
}

/// Each HDF5 file names the program that wrote it.
#[test]
fn files_have_the_version_of_the_program() {
    let folder = tempdir().unwrap();
    let paths = ["checkpoint.h5", "blocks.vtkhdf"].map(|name| folder.path().join(name));
    checkpoint::save(&paths[0], "deck", b"run", b"state").unwrap();
    Writer::create_cloud(&paths[1], &[]).unwrap();
    for path in paths {
        let file = File::open(&path).unwrap();
        let word = |name: &str| file.attr(name)?.read_scalar::<FixedAscii<32>>();
        let word = |name: &str| word(name).ok().map(|word| word.to_string());
        assert_eq!(word("ddem_version").as_deref(), Some(VERSION));
        assert_eq!(word("ddem_revision").as_deref(), REVISION);
    }
}

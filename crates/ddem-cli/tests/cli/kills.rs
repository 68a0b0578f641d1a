//! Tests of runs that end by a signal at any moment.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use hdf5::{File, Group};

use super::harness::*;

/// Runs with three kills each, in the usual tests and in those of `check.sh full`.
const RUNS: u64 = 4;
const MANY_RUNS: u64 = 200;

pub(crate) const FILES: [&str; 3] = ["blocks.vtkhdf", "joints.vtkhdf", "contacts.vtkhdf"];
const TABLES: [&str; 4] = ["probes.csv", "energy.csv", "fragments.csv", "frames.csv"];

/// Column in contact with many frames, so that a kill often meets a file that is being written.
pub(crate) fn column(stages: &[&str]) -> Desk {
    let desk = Desk::with(stages);
    let text = String::from_utf8(desk.read("column.toml")).unwrap();
    // Only blocks whose joints can fail have a file of contacts.
    let strength = "material = 'rock'\ncohesion = 1e9\nfriction = 30\ntension = 1e9\n[[blocks]]";
    let text = text
        .replace("contact = false", "")
        .replace("material = 'rock'\n[[blocks]]", strength)
        .replace("frames = 5", "frames = 300");
    desk.write("column.toml", &text);
    desk
}

/// All numbers below a group as bits, by the names of their arrays.
fn numbers(group: &Group, all: &mut Vec<(String, Vec<u64>)>) {
    for dataset in group.datasets().unwrap() {
        let values = dataset.read_raw::<f64>().unwrap();
        all.push((dataset.name(), values.into_iter().map(f64::to_bits).collect()));
    }
    group.groups().unwrap().iter().for_each(|group| numbers(group, all));
}

/// Contents of the file of a result.
pub(crate) fn opened(file: &Path) -> Vec<(String, Vec<u64>)> {
    let open = File::open(file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    let mut all = Vec::new();
    numbers(&open.as_group().unwrap(), &mut all);
    all
}

/// Checks that each file in a folder is complete enough to open.
pub(crate) fn check(folder: &Path) {
    for name in ["checkpoint.h5", "checkpoint-previous.h5"] {
        let file = folder.join(name);
        if file.exists() {
            opened(&file);
        }
    }
    for name in FILES {
        let file = folder.join(name);
        if file.exists() {
            frames(&file);
        }
    }
}

/// Reads the frames that a file counts as complete. Parts of a later one may follow.
fn frames(file: &Path) {
    let open = File::open(file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    let root = open.group("VTKHDF").unwrap();
    let frames = root.attr("Steps/NSteps").or_else(|_| root.group("Steps")?.attr("NSteps"));
    let frames = frames.and_then(|count| count.read_scalar::<i64>()).unwrap() as usize;
    // Without a frame nothing below is complete yet.
    if frames == 0 {
        return;
    }
    let times =
        root.dataset("Steps/Values").and_then(|times| times.read_slice_1d::<f64, _>(..frames));
    let times = times.unwrap();
    assert!(
        times.iter().zip(times.iter().skip(1)).all(|(before, after)| before < after),
        "{times}"
    );
    let points = root
        .dataset("NumberOfPoints")
        .and_then(|points| points.read_slice_1d::<i64, _>(..1))
        .unwrap();
    if let (Some(&points), Ok(field)) = (points.first(), root.dataset("PointData/displacement")) {
        let rows = frames * points as usize;
        let values = field.read_slice_2d::<f64, _>((..rows, ..));
        let values =
            values.unwrap_or_else(|e| panic!("{} with {frames} frames: {e}", file.display()));
        assert!(values.iter().all(|value| value.is_finite()));
    }
}

/// Starts the command, waits, and kills it. Returns true if it had ended before.
fn killed(desk: &Desk, arguments: &str, after: Duration) -> bool {
    let mut child = desk.command(arguments).stderr(Stdio::piped()).spawn().unwrap();
    std::thread::sleep(after);
    let ended = child.try_wait().unwrap();
    child.kill().unwrap();
    let output = child.wait_with_output().unwrap();
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(ended.is_none_or(|status| status.success()), "{message}");
    ended.is_some()
}

/// Kills by the system itself, which no program can notice. The moments cover the run from the start of the program
/// to its end, and leave time for the kills that follow; in every fourth run those of the first kill lie in the first
/// milliseconds, when files are created.
fn killed_runs_resume(runs: u64) {
    let desk = column(&[PRESS, &SHAKE.replace("0.01", "0.1")]);
    let start = Instant::now();
    let whole = desk.run("column.toml --out whole --threads 1");
    assert_eq!(whole.status, Some(0), "{}", whole.stderr);
    let length = start.elapsed();
    let line = "column.toml --out cut --threads 1 --quiet --resume --checkpoint-every 0.05";
    let (mut random, mut kills) = (1_u64, 0);
    for run in 0..runs {
        let mut left = length;
        for kill in 0..3 {
            random = random
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            let part = (random >> 40) as f64 / (1_u64 << 24) as f64;
            let first = run % 4 == 0 && kill == 0;
            let span = if first { Duration::from_millis(60) } else { left / (3 - kill) };
            let after = span.mul_f64(part);
            left -= after;
            let ended = killed(&desk, line, after);
            check(&desk.path("cut"));
            kills += u64::from(!ended);
        }
        compare(&desk, line);
        std::fs::remove_dir_all(desk.path("cut")).unwrap();
    }
    println!(
        "{runs} runs of {length:?}, {kills} kills before the end of one: all with the same bits"
    );
}

#[test]
fn killed_runs_resume_with_same_bits() {
    killed_runs_resume(RUNS);
}

#[test]
#[ignore = "takes minutes"]
fn many_killed_runs_resume_with_same_bits() {
    killed_runs_resume(MANY_RUNS);
}

/// Completes the run and compares all its results with those of the run that was never killed.
pub(crate) fn compare(desk: &Desk, line: &str) {
    let outcome = desk.run(line);
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    for name in TABLES {
        let read = |out: &str| desk.read(&format!("{out}/{name}"));
        assert!(read("whole") == read("cut"), "{name}");
    }
    for name in FILES {
        if !desk.path("whole").join(name).exists() {
            assert!(!desk.path("cut").join(name).exists(), "{name}");
            continue;
        }
        let read = |out: &str| opened(&desk.path(out).join(name));
        for (expected, found) in read("whole").iter().zip(&read("cut")) {
            assert!(expected == found, "{name}: {}", expected.0);
        }
        assert_eq!(read("whole").len(), read("cut").len(), "{name}");
    }
}

/// Without anything saved, and with a folder that does not exist, a run that is to resume starts.
#[test]
fn run_without_checkpoint_starts_with_a_word() {
    let desk = Desk::with(&[SHAKE]);
    let outcome = desk.run("column.toml --out new --resume");
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    let word = "nothing was saved in new yet: the run starts from the beginning";
    assert_eq!(outcome.stderr.lines().next(), Some(word));
    assert!(desk.path("new/summary.json").exists());
}

/// Flips one byte of each checkpoint in turn.
#[test]
fn damaged_checkpoint_gives_way_to_the_one_before() {
    let desk = column(&[PRESS, SHAKE]);
    assert_eq!(desk.run("column.toml --out whole").status, Some(0));
    assert_eq!(desk.run("column.toml --out cut").status, Some(0));
    let damage = |name: &str| {
        let mut bytes = desk.read(name);
        let at = bytes.len() - bytes.len() / 8;
        bytes[at] ^= 0x10;
        std::fs::write(desk.path(name), bytes).unwrap();
    };
    damage("cut/checkpoint.h5");
    let outcome = desk.run("column.toml --out cut --resume");
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    let lines: Vec<&str> = outcome.stderr.lines().take(2).collect();
    insta::with_settings!({filters => vec![(r"\(.*\)", "([cause])")]}, {
        insta::assert_snapshot!(lines.join("\n"));
    });
    compare(&desk, "column.toml --out cut --resume");
    // After the end both checkpoints describe it; with both damaged no run continues.
    damage("cut/checkpoint.h5");
    damage("cut/checkpoint-previous.h5");
    let outcome = desk.run("column.toml --out cut --resume");
    assert_eq!(outcome.status, Some(2), "{}", outcome.stderr);
    assert!(outcome.stderr.contains("the checkpoint is damaged"), "{}", outcome.stderr);
}

#[test]
#[cfg(unix)]
fn signal_to_end_saves_like_an_interrupt() {
    let desk = Desk::with(&[LONG_SHAKE]);
    let mut child = desk.command("column.toml --quiet --out a").spawn().unwrap();
    while !desk.path("a/energy.csv").exists() {
        assert!(child.try_wait().unwrap().is_none());
        std::thread::sleep(Duration::from_millis(10));
    }
    // `timeout` signals the program and its group. Equal signals might arrive as one.
    let both = format!("kill -TERM {0}; kill -INT {0}", child.id());
    let kill = Command::new("sh").args(["-c", &both]).status();
    assert!(kill.unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(desk.path("a/checkpoint.h5").exists());
}

/// With an interval of 0 a checkpoint follows each of the 20 steps, the last of which ends the stage; the option of the
/// command line takes precedence.
#[test]
fn deck_sets_the_time_between_checkpoints() {
    let steps = "
[output]
checkpoint_every = 0
[[stage]]
name = 'shake'
kind = 'dynamic'
duration = 2e-5
time_step = 1e-6
frames = 1
";
    let desk = Desk::with(&[steps]);
    for (option, checkpoints) in
        [("", 20), (" --checkpoint-every 1e9", 1), (" --checkpoint-every 0", 20)]
    {
        let outcome = desk.run(&format!("column.toml --out a --overwrite --quiet --json{option}"));
        assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
        let events =
            outcome.stdout.lines().filter(|line| line.contains("\"event\":\"checkpoint\""));
        assert_eq!(events.count(), checkpoints, "{option}");
    }
}

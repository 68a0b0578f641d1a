//! The command as a user runs it.

use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use tempfile::TempDir;

/// A column of three blocks; what follows is its stages.
const COLUMN: &str = "
title = 'column'
[model]
contact = false
[materials.rock]
density = 2400
young = 18e9
poisson = 0.25
[joints.seam]
thickness = 0.01
material = 'rock'
[[blocks]]
size = [1, 1, 3]
count = [1, 1, 3]
divisions = 2
material = 'rock'
joint = 'seam'
[[fix]]
where = { z = 0.0 }
axes = 'xyz'
[[load]]
where = { z = 3.0 }
traction = [1e5, 0.0, -1e6]
[[probe]]
name = 'top'
at = [0.5, 0.5, 3.0]
quantity = 'displacement'
every = 1e-4
every_steps = 10
";

const PRESS: &str = "
[[stage]]
name = 'press'
kind = 'relax'
tolerance = 1e-6
";

const SHAKE: &str = "
[[stage]]
name = 'shake'
kind = 'dynamic'
duration = 0.01
frames = 5
damping = { ratio = 0.05 }
";

/// Long enough to be interrupted.
const LONG_SHAKE: &str = "
[[stage]]
name = 'shake'
kind = 'dynamic'
duration = 4.0
frames = 5
damping = { ratio = 0.05 }
";

/// Long, and never in equilibrium.
const LONG_PRESS: &str = "
[[stage]]
name = 'press'
kind = 'relax'
tolerance = 1e-30
max_steps = 150000
";

const RESULTS: [&str; 6] =
    ["blocks.vtkhdf", "joints.vtkhdf", "probes.csv", "energy.csv", "summary.json", "checkpoint.h5"];

/// A folder to work in.
struct Desk {
    folder: TempDir,
}

/// How a command went.
#[derive(Debug)]
struct Went {
    status: Option<i32>,
    stdout: String,
    stderr: String,
}

impl Desk {
    fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    /// With the column in `column.toml`.
    fn with(stages: &[&str]) -> Self {
        let desk = Self::new();
        desk.write("column.toml", &(COLUMN.to_owned() + &stages.concat()));
        desk
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn write(&self, name: &str, text: &str) {
        fs::write(self.path(name), text).unwrap();
    }

    fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap()
    }

    /// Names of all that is in the folder.
    fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(self.folder.path()).unwrap();
        let mut names: Vec<_> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    fn command(&self, arguments: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_ddem"));
        command.current_dir(self.folder.path()).args(arguments.split_whitespace());
        command
    }

    fn run(&self, arguments: &str) -> Went {
        let output = self.command(arguments).output().unwrap();
        let text = |bytes| String::from_utf8(bytes).unwrap();
        Went {
            status: output.status.code(),
            stdout: text(output.stdout),
            stderr: text(output.stderr),
        }
    }

    /// Interrupts a run a little after its stage has begun.
    #[cfg(unix)]
    fn interrupt(&self, arguments: &str, stage: &str) -> Went {
        let mut child = self.command(arguments).stderr(Stdio::piped()).spawn().unwrap();
        let mut lines = BufReader::new(child.stderr.take().unwrap());
        let mut stderr = String::new();
        while !stderr.lines().any(|line| line.starts_with(stage)) {
            assert_ne!(lines.read_line(&mut stderr).unwrap(), 0, "{stderr}");
        }
        std::thread::sleep(std::time::Duration::from_millis(150));
        let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
        assert!(kill.unwrap().success());
        lines.read_to_string(&mut stderr).unwrap();
        Went { status: child.wait().unwrap().code(), stdout: String::new(), stderr }
    }
}

/// The command line is refused, and why.
fn refused(arguments: &str) -> String {
    let desk = Desk::with(&[SHAKE]);
    let went = desk.run(arguments);
    assert_eq!((went.status, went.stdout.as_str()), (Some(2), ""), "{}", went.stderr);
    assert_eq!(desk.names(), ["column.toml"]);
    went.stderr
}

#[test]
fn help_goes_to_standard_output() {
    let went = Desk::new().run("--help");
    assert_eq!((went.status, went.stderr.as_str()), (Some(0), ""));
    insta::assert_snapshot!(went.stdout, @r"
    Three-dimensional deformable block discrete element method for jointed rock

    Usage: ddem [OPTIONS] <DECK>
           ddem <COMMAND>

    Commands:
      schema  Print the JSON Schema of decks, for editors (a deck of this name is `./schema`)

    Arguments:
      <DECK>  Deck to run, a TOML file

    Options:
          --out <DIR>    Folder of the results [default: results/<name of the deck>]
          --threads <N>  Threads, which do not change the results [default: one for each processor]
          --quiet        Print nothing but errors
          --check        Build the model, say what running it would take, and stop
          --resume       Go on from the checkpoint in the folder of the results
      -h, --help         Print help
      -V, --version      Print version

    Example: ddem deck.toml --out results/first --threads 4
    ");
}

#[test]
fn without_arguments_it_shows_the_help() {
    let stderr = refused("");
    assert!(stderr.contains("Usage: ddem [OPTIONS] <DECK>"), "{stderr}");
    assert!(refused("--quiet").contains("<DECK>"));
}

#[test]
fn version() {
    let went = Desk::new().run("--version");
    assert_eq!(went.status, Some(0));
    assert_eq!(went.stdout, concat!("ddem ", env!("CARGO_PKG_VERSION"), "\n"));
}

#[test]
fn the_schema_is_json() {
    let went = Desk::new().run("schema");
    assert_eq!((went.status, went.stderr.as_str()), (Some(0), ""));
    let schema: serde_json::Value = serde_json::from_str(&went.stdout).unwrap();
    assert!(schema["properties"]["materials"].is_object());
}

#[test]
fn a_deck_may_be_called_schema() {
    let desk = Desk::new();
    desk.write("schema", &(COLUMN.to_owned() + SHAKE));
    let went = desk.run("./schema --quiet");
    assert_eq!(went.status, Some(0), "{}", went.stderr);
    assert!(desk.path("results/schema/summary.json").exists());
}

#[test]
fn a_reader_that_has_seen_enough_is_no_error() {
    let desk = Desk::new();
    let mut command = desk.command("schema");
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!((output.status.code(), output.stderr), (Some(0), vec![]));
}

#[test]
#[cfg(target_os = "linux")]
fn output_that_cannot_be_written_is_said() {
    let full = fs::File::options().write(true).open("/dev/full").unwrap();
    let desk = Desk::new();
    let output = desk.command("schema").stdout(full).output().unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr.starts_with("error: cannot write to standard output"), "{stderr}");
}

#[test]
fn a_missing_deck_with_the_name_of_one_near() {
    insta::assert_snapshot!(refused("colum.toml --out new"), @r"
      × cannot read the deck `colum.toml`
      ╰─▶ No such file or directory (os error 2)
      help: a deck is a TOML file
      did you mean `column.toml`?
    ");
    assert!(!refused("elsewhere/column.toml").contains("did you mean"));
    assert!(refused(".").contains("cannot read the deck `.`"));
}

#[test]
fn wrong_options() {
    for threads in ["0", "x", "-1", "1.5", "1000000"] {
        let stderr = refused(&format!("column.toml --threads={threads}"));
        assert!(stderr.contains("expected a whole number from 1 to 1024"), "{stderr}");
    }
    let stderr = refused("column.toml --simd mmx");
    assert!(stderr.contains("this machine has `baseline`"), "{stderr}");
    assert!(refused("column.toml --out").contains("--out <DIR>"));
    assert!(refused("column.toml --thread 2").contains("a similar argument exists: '--threads'"));
    assert!(refused("column.toml other.toml").contains("other.toml"));
}

#[test]
fn a_misspelt_key_is_shown_and_nothing_is_written() {
    let desk = Desk::new();
    desk.write("column.toml", &(COLUMN.replace("young", "yuong") + SHAKE));
    for arguments in ["column.toml", "column.toml --check", "column.toml --quiet --out new"] {
        let went = desk.run(arguments);
        assert_eq!((went.status, went.stdout.as_str()), (Some(2), ""));
        assert_eq!(desk.names(), ["column.toml"]);
        insta::allow_duplicates! { insta::assert_snapshot!(went.stderr, @r"
        the deck `column.toml` has a mistake in line 7

          × unknown key `yuong`
           ╭─[column.toml:7:1]
         6 │ density = 2400
         7 │ yuong = 18e9
           · ──┬──
           ·   ╰── materials.rock.yuong
         8 │ poisson = 0.25
           ╰────
          help: did you mean `young`? keys here: `density`, `young`, `poisson`
        "); }
    }
}

#[test]
fn a_time_step_that_is_too_long_is_refused_before_anything_is_written() {
    let long = format!("{SHAKE}time_step = 1e-3\n");
    let desk = Desk::with(&[PRESS, &long]);
    for arguments in ["column.toml", "column.toml --check"] {
        let went = desk.run(arguments);
        assert_eq!((went.status, went.stdout.as_str()), (Some(2), ""));
        assert!(went.stderr.contains("critical"), "{}", went.stderr);
        assert_eq!(desk.names(), ["column.toml"]);
    }
}

#[test]
fn check_reports_and_writes_nothing() {
    let desk = Desk::with(&[PRESS, SHAKE]);
    let went = desk.run("column.toml --check");
    assert_eq!((went.status, went.stderr.as_str()), (Some(0), ""));
    for line in ["column", "blocks         3", "nodes          81", "joints         2"] {
        assert!(went.stdout.lines().any(|other| other == line), "{}", went.stdout);
    }
    for part in ["pairs          18", "critical step  ", "memory  ", "stage shake: "] {
        assert!(went.stdout.contains(part), "{}", went.stdout);
    }
    assert_eq!(desk.names(), ["column.toml"]);
}

#[test]
fn a_run_from_start_to_end() {
    let desk = Desk::with(&[PRESS, SHAKE]);
    let went = desk.run("column.toml");
    assert_eq!((went.status, went.stdout.as_str()), (Some(0), ""), "{}", went.stderr);
    for name in RESULTS {
        assert!(desk.path("results/column").join(name).exists(), "{name}");
    }
    let summary: serde_json::Value =
        serde_json::from_slice(&desk.read("results/column/summary.json")).unwrap();
    assert_eq!(summary["title"], "column");
    assert_eq!(summary["stages"][0]["name"], "press");
    assert_eq!(summary["stages"][1]["name"], "shake");
    let lines: Vec<&str> = went.stderr.lines().collect();
    assert_eq!(lines[0], "model: 3 blocks, 81 nodes, 18 pairs");
    let starts = ["press (1/2): relaxation", "press: done", "shake (2/2): ", "shake: done"];
    for (line, start) in lines[1..].iter().zip(starts) {
        assert!(line.starts_with(start), "{}", went.stderr);
    }
    assert_eq!(
        lines[5..],
        [format!(
            "results are in {}: open blocks.vtkhdf there in ParaView",
            Path::new("results").join("column").display()
        )]
    );
}

#[test]
fn quiet_is_silent() {
    let desk = Desk::with(&[PRESS, SHAKE]);
    for arguments in ["column.toml --quiet --out a", "column.toml --quiet --check"] {
        let went = desk.run(arguments);
        assert_eq!((went.status, went.stdout, went.stderr), {
            (Some(0), String::new(), String::new())
        });
    }
    assert!(desk.path("a/summary.json").exists());
}

#[test]
fn results_depend_neither_on_threads_nor_on_the_instruction_set() {
    let desk = Desk::with(&[PRESS, SHAKE]);
    let run = |arguments: &str| {
        let went = desk.run(&format!("column.toml --out a {arguments}"));
        assert_eq!(went.status, Some(0), "{}", went.stderr);
        ["a/probes.csv", "a/energy.csv", "a/blocks.vtkhdf", "a/joints.vtkhdf"]
            .map(|name| desk.read(name))
    };
    let expected = run("--threads 1");
    assert!(expected == run("--threads 2"), "2 threads");
    for (name, _) in ddem_core::Simd::available() {
        assert!(expected == run(&format!("--simd {name}")), "{name}");
    }
}

#[test]
fn a_folder_that_cannot_be_written_is_refused() {
    let desk = Desk::with(&[SHAKE]);
    desk.write("file", "mine");
    for out in ["file", "file/below"] {
        let went = desk.run(&format!("column.toml --out {out}"));
        assert_eq!((went.status, went.stdout.as_str()), (Some(2), ""));
        assert!(went.stderr.contains("give another --out"), "{}", went.stderr);
        assert!(!went.stderr.contains("panicked"), "{}", went.stderr);
    }
    assert_eq!(desk.names(), ["column.toml", "file"]);
    assert_eq!(desk.read("file"), b"mine");
}

#[test]
fn the_results_of_another_deck_are_left_alone() {
    let desk = Desk::with(&[SHAKE]);
    assert_eq!(desk.run("column.toml --out a").status, Some(0));
    let read = || RESULTS.map(|name| desk.read(&format!("a/{name}")));
    let before = read();
    desk.write("other.toml", &(COLUMN.to_owned() + PRESS));
    let went = desk.run("other.toml --out a");
    assert_eq!(went.status, Some(2));
    assert!(went.stderr.contains("holds the results of another deck"), "{}", went.stderr);
    assert!(before == read());
}

#[test]
fn a_relaxation_without_end_fails_and_keeps_its_results() {
    let stage = PRESS.replace("1e-6", "1e-12\nmax_steps = 20");
    let desk = Desk::with(&[&stage]);
    let went = desk.run("column.toml --out a");
    assert_eq!(went.status, Some(1), "{}", went.stderr);
    let end: Vec<&str> = went.stderr.lines().rev().take(2).collect();
    assert_eq!(end[1], "the results up to here are in a");
    assert!(end[0].starts_with("error: stage `press`: not in equilibrium after 20 steps"));
    assert!(desk.read("a/probes.csv").iter().filter(|byte| **byte == b'\n').count() > 1);
}

#[test]
fn there_is_nothing_to_resume_at_first() {
    let stderr = refused("column.toml --resume");
    assert!(stderr.contains("holds no checkpoint to resume"), "{stderr}");
}

#[test]
#[cfg(unix)]
fn an_interrupted_run_goes_on_as_if_nothing_had_happened() {
    for (stages, interrupted, status) in
        [([PRESS, LONG_SHAKE], "shake (2/2)", 0), ([LONG_PRESS, SHAKE], "press (1/2)", 1)]
    {
        let desk = Desk::with(&stages);
        assert_eq!(desk.run("column.toml --out whole").status, Some(status));

        let went = desk.interrupt("column.toml --out parts", interrupted);
        assert_eq!(went.status, Some(130), "{}", went.stderr);
        assert!(went.stderr.contains("stopping at the next step"), "{}", went.stderr);
        let last = went.stderr.lines().last();
        let checkpoint = Path::new("parts").join("checkpoint.h5");
        let hint = "to go on: ddem column.toml --out=parts --resume";
        assert_eq!(last, Some(&*format!("saved in {}, {hint}", checkpoint.display())));
        assert!(desk.path("parts/checkpoint.h5").exists());

        // Once more, and with another number of threads.
        let went = desk.interrupt("column.toml --out=parts --resume --threads 1", interrupted);
        assert_eq!(went.status, Some(130), "{}", went.stderr);
        assert!(went.stderr.contains(", from step "), "{}", went.stderr);
        let went = desk.run("column.toml --out=parts --resume");
        assert_eq!(went.status, Some(status), "{}", went.stderr);
        for name in ["probes.csv", "energy.csv"] {
            let read = |out: &str| desk.read(&format!("{out}/{name}"));
            assert!(read("whole") == read("parts"), "{interrupted}: {name}");
        }
    }
}

#[test]
#[cfg(unix)]
fn a_quiet_run_is_interrupted_in_silence() {
    let desk = Desk::with(&[LONG_SHAKE]);
    let mut child = desk.command("column.toml --quiet --out a").stderr(Stdio::piped()).spawn();
    let child = child.as_mut().unwrap();
    while !desk.path("a/energy.csv").exists() {
        assert!(child.try_wait().unwrap().is_none());
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(kill.unwrap().success());
    let mut stderr = String::new();
    child.stderr.take().unwrap().read_to_string(&mut stderr).unwrap();
    assert_eq!((child.wait().unwrap().code(), stderr.as_str()), (Some(130), ""));
    assert!(desk.path("a/checkpoint.h5").exists());
}

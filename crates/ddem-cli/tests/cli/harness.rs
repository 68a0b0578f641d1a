//! Helpers of the tests: decks, folders and running the command.

use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::path::PathBuf;
use std::process::{Command, Stdio};

use tempfile::TempDir;

/// Deck of a column of three blocks; its stages are appended.
pub(crate) const COLUMN: &str = "
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

pub(crate) const PRESS: &str = "
[[stage]]
name = 'press'
kind = 'relax'
tolerance = 1e-6
";

pub(crate) const SHAKE: &str = "
[[stage]]
name = 'shake'
kind = 'dynamic'
duration = 0.01
frames = 5
damping = { ratio = 0.05 }
";

/// Stage that is long enough to be interrupted.
pub(crate) const LONG_SHAKE: &str = "
[[stage]]
name = 'shake'
kind = 'dynamic'
duration = 4.0
frames = 5
damping = { ratio = 0.05 }
";

/// Long relaxation that never reaches equilibrium.
pub(crate) const LONG_PRESS: &str = "
[[stage]]
name = 'press'
kind = 'relax'
tolerance = 1e-30
max_steps = 150000
";

pub(crate) const RESULTS: [&str; 8] = [
    "blocks.vtkhdf",
    "joints.vtkhdf",
    "probes.csv",
    "energy.csv",
    "fragments.csv",
    "frames.csv",
    "summary.json",
    "checkpoint.h5",
];

/// Working folder of a test.
pub(crate) struct Desk {
    folder: TempDir,
}

/// Exit status and output of a command.
#[derive(Debug)]
pub(crate) struct RunOutput {
    pub(crate) status: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Desk {
    pub(crate) fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    /// Working folder with the column in `column.toml`.
    pub(crate) fn with(stages: &[&str]) -> Self {
        let desk = Self::new();
        desk.write("column.toml", &(COLUMN.to_owned() + &stages.concat()));
        desk
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(crate) fn write(&self, name: &str, text: &str) {
        fs::write(self.path(name), text).unwrap();
    }

    pub(crate) fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap()
    }

    /// Names of all entries of the folder, sorted.
    pub(crate) fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(self.folder.path()).unwrap();
        let mut names: Vec<_> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    pub(crate) fn command(&self, arguments: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_ddem"));
        command.current_dir(self.folder.path()).args(arguments.split_whitespace());
        command
    }

    pub(crate) fn run(&self, arguments: &str) -> RunOutput {
        let output = self.command(arguments).output().unwrap();
        let text = |bytes| String::from_utf8(bytes).unwrap();
        RunOutput {
            status: output.status.code(),
            stdout: text(output.stdout),
            stderr: text(output.stderr),
        }
    }

    /// Runs the command and interrupts it shortly after its stage has begun.
    #[cfg(unix)]
    pub(crate) fn interrupt(&self, arguments: &str, stage: &str) -> RunOutput {
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
        RunOutput { status: child.wait().unwrap().code(), stdout: String::new(), stderr }
    }
}

/// Error message of a command line that must be refused.
pub(crate) fn refused(arguments: &str) -> String {
    let desk = Desk::with(&[SHAKE]);
    let outcome = desk.run(arguments);
    assert_eq!((outcome.status, outcome.stdout.as_str()), (Some(2), ""), "{}", outcome.stderr);
    assert_eq!(desk.names(), ["column.toml"]);
    outcome.stderr
}

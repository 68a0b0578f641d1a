//! Pictures of results, which the Python module draws.

use std::env;
use std::ffi::OsString;
use std::io;
use std::path::PathBuf;
use std::process::{Command, Stdio};

use ddem_core::ErrorCode;

use crate::args::Plot;

/// Environment variable that names the Python to use.
const NAMED: &str = "DDEM_PYTHON";

/// Python code that succeeds if Python finds the module and the libraries it draws with. The module
/// is recognised by `ddem.__main__`, since any folder `ddem` here would count as a module `ddem`.
const PROBE: &str = "import importlib.util as u, sys
names = 'pyvista', 'matplotlib', 'ddem.__main__'
sys.exit(not all(u.find_spec(name) for name in names))";

/// Reason why no picture was drawn.
#[derive(Debug, thiserror::Error)]
pub(crate) enum NoPicture {
    /// No Python has the module and PyVista.
    #[error(
        "pictures need Python with the module ddem and PyVista: looked for them with {searched}\n  \
         install them by `{python} -m pip install '.[plot]'` in the folder of the sources of ddem"
    )]
    NoPython {
        /// Programs that were tried.
        searched: String,
        /// Python for which to install the packages.
        python: String,
    },
    /// Python cannot be started.
    #[error("cannot start {}: {source}", python.display())]
    NotStarted {
        /// The program.
        python: PathBuf,
        /// Cause.
        source: io::Error,
    },
    /// The drawing program ended with this exit status, after a message of its own.
    #[error("exit status {0}")]
    Refused(u8),
}

impl NoPicture {
    /// Code of the error; `None` if the drawing program has printed it.
    pub(crate) fn code(&self) -> Option<ErrorCode> {
        match self {
            Self::NoPython { .. } | Self::NotStarted { .. } => Some(ErrorCode::MissingProgram),
            Self::Refused(_) => None,
        }
    }

    /// Exit status of the command.
    pub(crate) fn exit_status(&self) -> u8 {
        match self {
            Self::Refused(status) => *status,
            _ => 2,
        }
    }
}

/// Draws a picture and prints its path.
pub(crate) fn plot(args: &Plot) -> Result<(), NoPicture> {
    let python = python()?;
    let mut command = Command::new(&python);
    let status = command.args(["-m", "ddem", "plot"]).args(args.arguments()).status();
    let status = status.map_err(|source| NoPicture::NotStarted { python, source })?;
    if status.success() {
        return Ok(());
    }
    let code = status.code().and_then(|code| u8::try_from(code).ok());
    Err(NoPicture::Refused(code.unwrap_or(1)))
}

/// First Python that can draw.
fn python() -> Result<PathBuf, NoPicture> {
    let candidates = candidates();
    let found = candidates.iter().find(|python| draws(python));
    found.cloned().ok_or_else(|| {
        let shown: Vec<String> =
            candidates.iter().map(|python| format!("`{}`", python.display())).collect();
        let there = candidates.iter().find(|python| starts(python));
        let python = there.map_or("python3".into(), |python| python.display().to_string());
        NoPicture::NoPython { searched: shown.join(", "), python }
    })
}

/// Commands that may start Python, in order.
fn candidates() -> Vec<PathBuf> {
    let given = |name: &str| env::var_os(name).filter(|value: &OsString| !value.is_empty());
    if let Some(named) = given(NAMED) {
        return vec![named.into()];
    }
    let inside = if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" };
    let environment = given("VIRTUAL_ENV").map(|folder| PathBuf::from(folder).join(inside));
    environment.into_iter().chain(["python3", "python"].map(PathBuf::from)).collect()
}

/// True if a Python has the module, PyVista and Matplotlib.
fn draws(python: &PathBuf) -> bool {
    runs(Command::new(python).args(["-c", PROBE]))
}

/// True if a Python starts.
fn starts(python: &PathBuf) -> bool {
    runs(Command::new(python).arg("--version"))
}

fn runs(command: &mut Command) -> bool {
    let quiet = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    quiet.status().is_ok_and(|status| status.success())
}

//! Errors of the core, as Python's exceptions.

use std::io;
use std::path::Path;

use ddem_core::{ErrorCode, Fault, ModelError, MovingBlock, RunError};
use ddem_deck::DeckError;
use ddem_io::OutputError;
use ddem_io::folder::FolderError;
use ddem_io::run::RunFailure;
use pyo3::exceptions::{PyException, PyFileExistsError, PyMemoryError, PyOSError, PyRuntimeError};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyType;

use crate::notation;

/// Number of the system's error for a file that does not exist.
const ENOENT: i32 = 2;

/// Exception of a class of `ddem._errors`, with its arguments.
macro_rules! raise {
    ($py:expr, $class:literal, $arguments:expr) => {{
        static CLASS: PyOnceLock<Py<PyType>> = PyOnceLock::new();
        match CLASS.import($py, "ddem._errors", $class).and_then(|class| class.call1($arguments)) {
            Ok(error) => PyErr::from_value(error),
            Err(error) => error,
        }
    }};
}

pub(crate) fn busy(py: Python<'_>, what: &str) -> PyErr {
    let by = "another thread is using it, or a function that a call of it calls";
    let code = ErrorCode::Busy;
    coded(
        py,
        raise!(py, "Busy", (format!("{what} is busy: {by}; let that call end first [{code}]"),)),
        code,
    )
}

/// Exception for a fault in the program itself.
pub(crate) fn internal(py: Python<'_>, panic: &(dyn std::any::Any + Send)) -> PyErr {
    let text = panic.downcast_ref::<&str>().copied();
    let text = text.or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    let message = text.unwrap_or("unknown").to_owned();
    failure(py, &RunFailure::Internal { message })
}

/// An exception of ddem with its code.
fn coded(py: Python<'_>, error: PyErr, code: ErrorCode) -> PyErr {
    // Every exception accepts an attribute.
    let _ = error.value(py).setattr("code", code.name());
    error
}

/// Exception for one fault of an argument or a key.
pub(crate) fn model_error(py: Python<'_>, place: &str, message: &str, help: Option<&str>) -> PyErr {
    let fault = Fault::new(ErrorCode::InvalidArgument, place, message);
    let fault = help.into_iter().fold(fault, Fault::help);
    faults(py, &[fault], &|_| None)
}

/// True for KeyboardInterrupt, SystemExit and others that `except Exception` does not catch.
pub(crate) fn is_interruption(py: Python<'_>, error: &PyErr) -> bool {
    !error.is_instance_of::<PyException>(py)
}

/// Exception for an argument whose conversion raised `cause`. An interruption or a lack of memory
/// is not a fault of the argument and is returned unchanged.
pub(crate) fn refuse(py: Python<'_>, place: &str, message: &str, cause: PyErr) -> PyErr {
    if is_interruption(py, &cause) || cause.is_instance_of::<PyMemoryError>(py) {
        return cause;
    }
    let refused = model_error(py, place, message, None);
    refused.set_cause(py, Some(cause));
    refused
}

/// Exception for faults of a model; `line` gives the script line of an entry.
pub(crate) fn faults(
    py: Python<'_>,
    faults: &[Fault],
    line: &dyn Fn(&str) -> Option<String>,
) -> PyErr {
    let mut lines = Vec::new();
    let mut list = Vec::new();
    for fault in faults {
        let place = notation::place(&fault.place);
        let mut text = line(&fault.place).map_or(String::new(), |line| format!("{line}: "));
        if !place.is_empty() {
            text += &format!("{place}: ");
        }
        let (message, help) =
            (notation::text(&fault.message), fault.help.as_deref().map(notation::text));
        text += &message;
        if let Some(help) = &help {
            text += &format!(" ({help})");
        }
        text += &format!(" [{}]", fault.code);
        lines.push(text);
        list.push((place, message, help, fault.code.name()));
    }
    raise!(py, "ModelError", (lines.join("\n"), list))
}

/// Exception for a failed step. `stage` comes before the message.
pub(crate) fn run_error(py: Python<'_>, error: &RunError, stage: &str) -> PyErr {
    let code = error.code();
    let message = notation::text(&format!("{stage}{error}"));
    let text = error.to_string();
    let text = code.strip(&text);
    let raised = match *error {
        RunError::NotConverged { ratio, .. } | RunError::UnreachableTolerance { ratio, .. } => {
            raise!(py, "NotConverged", (message, ratio))
        }
        RunError::NoEquilibrium { blocks: [a, b], distance, ref moving, ratio, .. } => {
            let moving =
                moving.iter().map(|MovingBlock { set, block, distance, direction: [x, y, z] }| {
                    (set.clone(), *block, *distance, (*x, *y, *z))
                });
            let moving: Vec<_> = moving.collect();
            raise!(py, "Collapsed", (message, ratio, (a, b), distance, moving))
        }
        RunError::Diverged { step, time, block, node } => {
            raise!(py, "Diverged", (message, step, time, block, node))
        }
        RunError::HistoryFailed { ref entry, .. } => {
            let place = format!("{entry}.history");
            faults(py, &[Fault::new(code, place, format!("{stage}{text}"))], &|_| None)
        }
        RunError::Values { faults: ref wrong } => faults(py, wrong, &|_| None),
        RunError::EarlierStage { .. } => faults(py, &[Fault::new(code, "stage", text)], &|_| None),
        RunError::UnstableTimeStep { .. } | RunError::TooShort { .. } => {
            faults(py, &[Fault::new(code, "time_step", text)], &|_| None)
        }
        _ => raise!(py, "Error", (message,)),
    };
    coded(py, raised, code)
}

/// Exception for faults of arguments, whose places in a deck begin with `prefix`.
pub(crate) fn arguments(py: Python<'_>, mut error: ModelError, prefix: &str) -> PyErr {
    for fault in &mut error.faults {
        let place = fault.place.strip_prefix(prefix).unwrap_or(&fault.place);
        let place = place.trim_start_matches('.');
        fault.place = place.strip_prefix("where.").unwrap_or(place).to_owned();
        if fault.place == "where" && fault.message.ends_with("is missing") {
            *fault = Fault::new(ErrorCode::MissingKey, "", "no selection is given")
                .help(format!("give one of {}", notation::where_keys()));
        }
        fault.help = fault.help.take().map(|help| notation::list(&help));
    }
    model(py, &error)
}

pub(crate) fn model(py: Python<'_>, error: &ModelError) -> PyErr {
    faults(py, &error.faults, &|_| None)
}

pub(crate) fn deck(py: Python<'_>, error: &DeckError) -> PyErr {
    match error {
        DeckError::Unreadable { path, source } => {
            os_error(source, path, error.code().strip(&error.to_string()), error.code())
        }
        DeckError::Wrong { findings, .. } => {
            let python = |f: &ddem_deck::Finding| {
                let Fault { code, place, message, help, .. } = f.fault.clone();
                (place, message, help, code.name())
            };
            let list: Vec<_> = findings.iter().map(python).collect();
            coded(py, raise!(py, "ModelError", (error.report(false), list)), error.code())
        }
        _ => model_error(py, "", error.code().strip(&error.to_string()), None),
    }
}

/// Exception for a run that did not start or did not reach its end.
pub(crate) fn failure(py: Python<'_>, failure: &RunFailure) -> PyErr {
    let message = failure.to_string();
    match failure {
        RunFailure::Deck(error) => deck(py, error),
        RunFailure::Model(error) => model(py, error),
        RunFailure::Folder(error) => folder(error, false),
        RunFailure::Memory { .. } => PyMemoryError::new_err(message),
        RunFailure::Stage { stage, error } => run_error(py, error, &format!("stage `{stage}`: ")),
        RunFailure::Output(error) => output(error),
        RunFailure::Recorded { .. } => PyFileExistsError::new_err(message),
        RunFailure::Checkpoint { .. } => PyOSError::new_err(message),
        RunFailure::Internal { .. } => coded(py, raise!(py, "Error", (message,)), failure.code()),
        _ => PyRuntimeError::new_err(message),
    }
}

/// Exception for a folder of results, of a deck or of a `recording` of single runs.
pub(crate) fn folder(error: &FolderError, recording: bool) -> PyErr {
    let advice = match error {
        FolderError::InUse { .. } => ": wait until it has finished or give another folder",
        FolderError::NotWritable { .. } => "",
        _ if recording => ": record in another folder",
        FolderError::OtherDeck { .. } => {
            ": give another folder, or run without resume=True and overwrite=True to keep them"
        }
        FolderError::ForeignFile { .. } => ": give another folder or delete the file",
        FolderError::NotAFolder { .. } => ": give another folder",
        FolderError::DeckChanged { .. } => ": restore it, or run without resume=True to start over",
        _ => "",
    };
    let (text, code) = (error.to_string(), error.code());
    let message = format!("{}{advice} [{code}]", code.strip(&text));
    match error {
        FolderError::NotWritable { source } => output(source),
        FolderError::OtherDeck { .. }
        | FolderError::ForeignFile { .. }
        | FolderError::NotAFolder { .. } => PyFileExistsError::new_err(message),
        _ => PyOSError::new_err(message),
    }
}

pub(crate) fn output(error: &OutputError) -> PyErr {
    let full = matches!(error, OutputError::DiskFull { .. });
    let advice = if full { ": free some space or give another folder" } else { "" };
    let (text, code) = (error.to_string(), error.code());
    let message = format!("{}{advice}", code.strip(&text));
    match error {
        OutputError::Io { path, error, .. } => os_error(error, path, &message, code),
        OutputError::Gone { path, .. } => {
            os_error(&io::Error::from_raw_os_error(ENOENT), path, &message, code)
        }
        _ => PyOSError::new_err(format!("{message} [{code}]")),
    }
}

/// Exception of Python for an error of the system: with the system's error number if there is one,
/// otherwise with `message` and the class of the error's kind.
pub(crate) fn os_error(source: &io::Error, path: &Path, message: &str, code: ErrorCode) -> PyErr {
    match source.raw_os_error() {
        Some(number) => {
            let text = source.to_string();
            let mut text = text.split(" (os error").next().unwrap_or_default().to_owned();
            let missing = source.kind() == io::ErrorKind::NotFound && !path.exists();
            if let Some(near) = ddem_deck::near(path, |_| true).filter(|_| missing) {
                text += &format!("; did you mean '{}'?", near.display());
            }
            PyOSError::new_err((number, format!("{text} [{code}]"), path.display().to_string()))
        }
        None => io::Error::new(source.kind(), format!("{message} [{code}]")).into(),
    }
}

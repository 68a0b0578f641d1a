//! `relax` and `run`: stages by the driver of decks, with callbacks.

use std::path::PathBuf;
use std::sync::{MutexGuard, TryLockError};
use std::time::Duration;

use ddem_core::{ErrorCode, Fault};
use ddem_deck::lint::{Code, Diagnostic};
use ddem_deck::{Stage, StageKind, names, stage_keys};
use ddem_io::run::{OpenStage, RunFailure, Session, StageStatus};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::callbacks::Callbacks;
use crate::drive::{PyObserver, close, progress_bar, read_stage};
use crate::errors;
use crate::simulation::{Inner, PySimulation};
use crate::worker::{Worker, warn};

/// Waiting time while another thread uses the simulation.
const WAIT: Duration = Duration::from_millis(1);

#[pymethods]
impl PySimulation {
    /// Relaxes to static equilibrium, under the supports and loads in force. Time stands still.
    ///
    #[doc = include_str!("keys/Relax.txt")]
    /// record : path, optional
    ///     Folder of the results, with the files that a deck gives. All that one simulation writes
    ///     to one folder is one run; earlier results are moved to ``NAME.1``, ``NAME.2``, ...
    /// name : str, optional
    ///     Name of the stage. The name of a stage of the model brings its supports and loads into
    ///     force, unless they are in force.
    /// quiet : bool, optional
    ///     No progress bar.
    ///
    /// Returns
    /// -------
    /// int
    ///     Steps taken.
    ///
    /// Raises
    /// ------
    /// NotConverged
    ///     No equilibrium was reached, unless `on_failure` is "continue"; `ratio` is the last
    ///     ratio. :class:`Collapsed` if blocks move apart without end.
    /// Diverged
    ///     Forces are no longer finite.
    /// ModelError
    ///     An argument is wrong.
    /// OSError
    ///     A file cannot be written; FileExistsError if another simulation has recorded in the
    ///     folder since this one did.
    /// KeyboardInterrupt
    ///     The state is consistent, and another call continues from it.
    #[pyo3(signature = (*, record=None, name=None, quiet=false, **keys))]
    fn relax(
        slf: &Bound<'_, Self>,
        record: Option<PathBuf>,
        name: Option<String>,
        quiet: bool,
        keys: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<u64> {
        known(slf.py(), keys, &|| arguments(slf, "relax", StageKind::Relax))?;
        let mut stage = read_stage(slf.py(), "relax", None, keys)?;
        stage.name = name.unwrap_or_default();
        StageCall { stage, record, callbacks: None }.run_to_end(slf, quiet)
    }

    /// Moves in time, under the supports and loads in force.
    ///
    /// Blocks that slide to rest do not fail. A run without `until_rest` lasts for its `duration` and
    /// never raises an exception because of its blocks: `summary["stages"][-1]["verdict"]` has the
    /// verdict.
    ///
    #[doc = include_str!("keys/Run.txt")]
    /// record : path, optional
    ///     Folder of the results, with the files that a deck gives. All that one simulation writes
    ///     to one folder is one run; earlier results are moved to ``NAME.1``, ``NAME.2``, ...
    /// name : str, optional
    ///     Name of the stage. The name of a stage of the model brings its supports and loads into
    ///     force, unless they are in force.
    /// until : callable, optional
    ///     Function that receives the simulation at each interval `every`. If it returns true, the
    ///     run ends as at the end of its duration.
    /// callback : callable, optional
    ///     Function that receives the simulation as often, before `until`, and at the end of the
    ///     run.
    /// every : float, optional
    ///     Simulated time between two calls of these functions [s], rounded to whole steps; default
    ///     a hundredth of the duration. The functions may read everything, apply forces and save.
    ///     Calls that move the simulation are refused with :class:`Busy`. Reading changes no bit.
    /// quiet : bool, optional
    ///     No progress bar.
    ///
    /// Returns
    /// -------
    /// int
    ///     Steps taken.
    ///
    /// Raises
    /// ------
    /// Collapsed
    ///     Blocks fail in a run with `until_rest`, unless `on_failure` is "continue".
    /// Diverged
    ///     Forces are no longer finite.
    /// ModelError
    ///     An argument is wrong, or the time step exceeds the critical one.
    /// OSError
    ///     A file cannot be written; FileExistsError if another simulation has recorded in the
    ///     folder since this one did.
    /// KeyboardInterrupt
    ///     The state is consistent, and another call continues from it. The same holds for every
    ///     exception that `until` or `callback` raises.
    ///
    /// Warns
    /// -----
    /// UserWarning
    ///     Without `name`, if supports, loads, charges or boundaries wait for stages of the model;
    ///     once for each stage.
    #[pyo3(signature = (
        duration, *, until=None, every=None, callback=None, record=None, name=None, quiet=false, **keys
    ))]
    #[expect(clippy::too_many_arguments, reason = "they are those of Python")]
    fn run(
        slf: &Bound<'_, Self>,
        duration: &Bound<'_, PyAny>,
        until: Option<Bound<'_, PyAny>>,
        every: Option<Bound<'_, PyAny>>,
        callback: Option<Bound<'_, PyAny>>,
        record: Option<PathBuf>,
        name: Option<String>,
        quiet: bool,
        keys: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<u64> {
        known(slf.py(), keys, &|| arguments(slf, "run", StageKind::Dynamic))?;
        let mut stage = read_stage(slf.py(), "dynamic", Some(duration), keys)?;
        let callbacks = Callbacks::new(slf.py(), [until, callback], every, stage.duration)?;
        if name.is_none() {
            slf.get().warn_of_waiting(slf.py())?;
        }
        stage.name = name.unwrap_or_default();
        StageCall { stage, record, callbacks }.run_to_end(slf, quiet)
    }
}

impl PySimulation {
    /// Warns once for each stage of the model for which supports or loads wait.
    fn warn_of_waiting(&self, py: Python<'_>) -> PyResult<()> {
        let mut inner = self.lock_to_move(py)?;
        let Inner { session, awaited, .. } = &mut **inner;
        let waiting = waiting(session);
        let waiting: Vec<String> =
            waiting.into_iter().filter(|name| awaited.insert(name.clone())).collect();
        let Some(first) = waiting.first() else { return Ok(()) };
        let help = format!("run(..., name=\"{first}\") or enter(\"{first}\") begins it");
        let warning = wait_for("supports or loads", &waiting, "do not act in this run", help);
        let reported = session.warn(&warning);
        drop(inner);
        if reported { warn(py, &warning) } else { Ok(()) }
    }

    /// Locks the simulation again, once no other thread uses it; such uses are short.
    fn relock(&self, py: Python<'_>) -> MutexGuard<'_, Box<Inner>> {
        loop {
            match self.try_lock() {
                Ok(inner) => return inner,
                Err(TryLockError::Poisoned(poisoned)) => return poisoned.into_inner(),
                Err(TryLockError::WouldBlock) => py.detach(|| std::thread::sleep(WAIT)),
            }
        }
    }
}

/// Warning about parts of a model that wait for stages, and about the effect of that, with advice.
pub(crate) fn wait_for(what: &str, stages: &[String], effect: &str, help: String) -> Diagnostic {
    let names: Vec<String> = stages.iter().map(|name| format!("`{name}`")).collect();
    let word = if names.len() == 1 { "stage" } else { "stages" };
    let message = format!("{what} wait for the {word} {} and {effect}", names.join(", "));
    Diagnostic::warning(Code::WaitingStages, "stage", message, help)
}

/// Names of later stages for which supports, loads, charges or boundaries wait.
pub(crate) fn waiting(session: &Session) -> Vec<String> {
    let deck = session.site().deck();
    let from = (deck.fix.iter().map(|entry| &entry.from))
        .chain(deck.load.iter().map(|entry| &entry.from))
        .chain(deck.charge.iter().map(|entry| &entry.from))
        .chain(deck.boundary.iter().map(|entry| &entry.from));
    later(session, &from.flatten().collect::<Vec<_>>())
}

/// Names of stages that have not begun, among the given names.
pub(crate) fn later(session: &Session, names: &[&String]) -> Vec<String> {
    let stages = &session.site().deck().stage;
    let stages = stages.iter().skip(session.simulation().stage() + 1).map(|stage| &stage.name);
    stages.filter(|name| names.contains(name)).cloned().collect()
}

/// Refuses the first keyword that no stage has; `own` lists the arguments of the method. Keys of
/// other kinds of stages are refused with the stage.
pub(crate) fn known(
    py: Python<'_>,
    keys: Option<&Bound<'_, PyDict>>,
    own: &dyn Fn() -> PyResult<Vec<String>>,
) -> PyResult<()> {
    let of_stages = ddem_deck::keys("Stage");
    for key in keys.into_iter().flat_map(|keys| keys.keys()) {
        let key: String = key.extract()?;
        // A function as a history has a message of its own.
        if !of_stages.contains(&key.as_str()) && key != "history" {
            let own = own()?;
            let own = own.iter().map(String::as_str);
            let near = names::nearest(&key, own.clone());
            let near = near.map(|near| format!("did you mean `{near}`? ")).unwrap_or_default();
            let help = format!("{near}arguments here: {}", names::list(own));
            let message = format!("unknown key `{key}`");
            let fault = Fault::new(ErrorCode::UnknownKey, &key, message).help(help);
            return Err(errors::faults(py, &[fault], &|_| None));
        }
    }
    Ok(())
}

/// Arguments of a method that moves a simulation: those of its signature, and the keys of a stage
/// of its kind.
fn arguments(
    simulation: &Bound<'_, PySimulation>,
    method: &str,
    kind: StageKind,
) -> PyResult<Vec<String>> {
    let signature = simulation.getattr(method)?.getattr("__text_signature__")?;
    let signature: String = signature.extract()?;
    let names = signature.split(['(', ',', ')']).filter_map(|one| one.split('=').next());
    let names =
        names.map(str::trim).filter(|name| !name.is_empty() && !name.starts_with(['$', '*']));
    let mut all: Vec<&str> = names.collect();
    let keys: Vec<&str> = stage_keys(kind).into_iter().filter(|key| !all.contains(key)).collect();
    all.extend(keys);
    Ok(all.into_iter().map(str::to_owned).collect())
}

/// A stage to run, with its folder and its callbacks.
struct StageCall<'py> {
    stage: Stage,
    record: Option<PathBuf>,
    callbacks: Option<Callbacks<'py>>,
}

impl<'py> StageCall<'py> {
    /// Moves the simulation and returns the number of steps.
    fn run_to_end(&self, simulation: &Bound<'py, PySimulation>, quiet: bool) -> PyResult<u64> {
        let py = simulation.py();
        if self.record.as_ref().is_some_and(|folder| folder.as_os_str().is_empty()) {
            return Err(PyValueError::new_err("record: the path of a folder is empty"));
        }
        let bar = progress_bar(py, quiet)?;
        let before = {
            let mut inner = simulation.get().lock_to_move(py)?;
            inner.running = true;
            inner.session.simulation().steps()
        };
        let mut open = None;
        let status = self.advance(simulation, &mut open, bar.as_ref());
        let ended = self.end(simulation, open, &status, bar.as_ref());
        let last = match (&status, &ended, &self.callbacks) {
            (Ok(StageStatus::Done), Ok(()), Some(callbacks)) => callbacks.call_last(simulation),
            _ => Ok(()),
        };
        let mut inner = simulation.get().relock(py);
        inner.running = false;
        let steps = inner.session.simulation().steps() - before;
        drop(inner);
        let closed = close(py, bar);
        status?;
        ended?;
        last?;
        closed?;
        Ok(steps)
    }

    /// Advances from callback to callback, to the end or until `until` ends the stage.
    fn advance(
        &self,
        simulation: &Bound<'py, PySimulation>,
        open: &mut Option<OpenStage>,
        bar: Option<&Py<PyAny>>,
    ) -> PyResult<StageStatus> {
        let (py, this) = (simulation.py(), simulation.get());
        let every = self.callbacks.as_ref().map(|callbacks| callbacks.every);
        let Self { stage, record, .. } = self;
        part(py, this, bar, |session, observer| {
            *open = session.begin(stage, record.as_deref(), every, observer)?;
            Ok(())
        })?;
        let Some(open) = open else { return Ok(StageStatus::Stopped) };
        loop {
            let status = part(py, this, bar, |session, observer| session.advance(open, observer))?;
            match (status, &self.callbacks) {
                (StageStatus::Paused, Some(callbacks)) => {
                    if callbacks.call(simulation)? {
                        return Ok(StageStatus::Paused);
                    }
                }
                (status, _) => return Ok(status),
            }
        }
    }

    fn end(
        &self,
        simulation: &Bound<'py, PySimulation>,
        open: Option<OpenStage>,
        status: &PyResult<StageStatus>,
        bar: Option<&Py<PyAny>>,
    ) -> PyResult<()> {
        let Some(open) = open else { return Ok(()) };
        let done = matches!(status, Ok(StageStatus::Done | StageStatus::Paused));
        part(simulation.py(), simulation.get(), bar, |session, observer| {
            session.end(open, done, observer)
        })
    }
}

/// Performs a part of a run without holding the interpreter.
fn part<T: Send>(
    py: Python<'_>,
    simulation: &PySimulation,
    bar: Option<&Py<PyAny>>,
    work: impl FnOnce(&mut Session, &mut PyObserver<'_>) -> Result<T, RunFailure> + Send,
) -> PyResult<T> {
    let work = |inner: &mut Inner, worker: &Worker| {
        let Inner { session, samples, .. } = inner;
        work(session, &mut PyObserver { worker, samples })
    };
    let error = |failure| match failure {
        RunFailure::Model(error) => errors::arguments(py, error, "stage[0]"),
        RunFailure::Stage { error, .. } => errors::run_error(py, &error, ""),
        RunFailure::Folder(error) => errors::folder(&error, true),
        failure => errors::failure(py, &failure),
    };
    simulation.work(py, &mut simulation.relock(py), bar, work, error)
}

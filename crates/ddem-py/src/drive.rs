//! Construction and motion of simulations by the driver of decks, without the interpreter's lock.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use ddem_core::{Fault, ModelError};
use ddem_deck::{BuildProgress, Deck, DeckError, Source, Stage};
use ddem_io::run::{Event, Options, Outcome, Progress, RunFailure, Session};
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use toml::Value;

use crate::errors::{self, model_error};
use crate::functions::{Called, Functions};
use crate::matter::no_matter;
use crate::samples::Samples;
use crate::simulation::PySimulation;
use crate::values::{alone, table};
use crate::worker::{Pool, Worker, build_on_worker_thread, first, outcome, warn};

/// Observer that passes events to the worker and the samples.
pub(crate) struct PyObserver<'a> {
    pub(crate) worker: &'a Worker,
    pub(crate) samples: &'a mut Samples,
}

impl ddem_io::run::Observer for PyObserver<'_> {
    fn event(&mut self, event: Event<'_>) {
        match event {
            Event::Progress(progress) => self.worker.progress(progress.clone()),
            Event::Warning(warning) => self.worker.warn(warning.clone()),
            Event::Sample { step, time, values } => self.samples.push(step, time, values),
            _ => {}
        }
    }

    fn stop_flag(&self) -> Arc<AtomicBool> {
        self.worker.stop_flag()
    }

    fn build_progress(&self) -> Arc<BuildProgress> {
        self.worker.build_progress()
    }

    fn wants_to_stop(&mut self) -> bool {
        self.worker.stops()
    }
}

/// Change of a model after it was built from its deck.
pub(crate) type Change = Box<dyn FnOnce(&mut ddem_core::Model) -> Result<(), Fault> + Send>;

/// Simulation from the session that `make` returns, with Python functions as histories.
pub(crate) fn assembled(
    py: Python<'_>,
    pool: Pool,
    functions: Functions,
    located: &dyn Fn(&ModelError) -> PyErr,
    make: impl FnOnce(Change) -> Result<Session, RunFailure> + Send + 'static,
) -> PyResult<PySimulation> {
    let called = Called::new(functions);
    let histories = called.clone();
    let change: Change = Box::new(move |model| histories.set_on(model));
    let (made, stopped) = build_on_worker_thread(py, &pool, None, move |_| make(change))?;
    let session = outcome(made, stopped, |failure| match &failure {
        RunFailure::Model(error) => located(error),
        failure => errors::failure(py, failure),
    })?;
    for warning in session.warnings() {
        warn(py, warning)?;
    }
    Ok(PySimulation::new(session, Samples::default(), pool, called))
}

/// Moves a deck through its stages; see [`run_deck`](crate::run_deck).
pub(crate) fn driven(
    py: Python<'_>,
    (deck, source): (Deck, Source),
    (options, pool): (Options, Pool),
    located: &dyn Fn(&DeckError) -> PyErr,
    quiet: bool,
) -> PyResult<PySimulation> {
    let bar = progress_bar(py, quiet)?;
    let ran = build_on_worker_thread(py, &pool, bar.as_ref(), move |worker| {
        let mut samples = Samples::default();
        let mut observer = PyObserver { worker, samples: &mut samples };
        let outcome = ddem_io::run::run(&deck, &source, &options, &mut observer);
        outcome.map(|outcome| (outcome, samples))
    });
    let closed = close(py, bar);
    let (ended, stopped) = ran?;
    let stopped = first(py, stopped, closed.err());
    // The message of an interrupted run names its checkpoint.
    let (ended, samples) = match (ended, &stopped) {
        (Ok((Outcome::Interrupted(checkpoint), _)), Some(error))
            if error.is_instance_of::<PyKeyboardInterrupt>(py) =>
        {
            let path = checkpoint.display();
            let message = format!("saved in {path}; run_deck(..., resume=True) continues");
            return Err(PyKeyboardInterrupt::new_err(message));
        }
        (ended, _) => outcome(ended, stopped, |failure| match &failure {
            RunFailure::Deck(error) => located(error),
            failure => errors::failure(py, failure),
        })?,
    };
    match ended {
        Outcome::Done(session) => Ok(PySimulation::new(*session, samples, pool, Called::default())),
        // A run is interrupted only after an exception was raised.
        Outcome::Interrupted(_) => Err(PyKeyboardInterrupt::new_err(())),
    }
}

/// Takes plain steps until all are done or the worker stops them.
pub(crate) fn steps(
    simulation: &mut ddem_core::Simulation,
    n: u64,
    worker: &Worker,
) -> Result<(), ddem_core::RunError> {
    let clock = std::time::Instant::now();
    let mut reported = clock;
    for step in 1..=n {
        if worker.stops() {
            break;
        }
        simulation.step()?;
        let now = std::time::Instant::now();
        if now.duration_since(reported).as_millis() < 100 {
            continue;
        }
        reported = now;
        let rate = step as f64 / now.duration_since(clock).as_secs_f64();
        worker.progress(Progress {
            stage: "step".to_owned(),
            stage_index: (0, 1),
            relax: false,
            step,
            steps: n,
            time: simulation.time(),
            unbalanced: simulation.unbalanced(),
            tolerance: 0.0,
            failed_pairs: simulation.failed_pairs().iter().sum(),
            contacts: simulation.touching_blocks() as u64,
            fastest: None,
            updates_per_second: rate * simulation.model().n_nodes() as f64,
            seconds_left: None,
            search: None,
        });
    }
    Ok(())
}

/// Progress bar of a call; `None` if `quiet`.
pub(crate) fn progress_bar(py: Python<'_>, quiet: bool) -> PyResult<Option<Py<PyAny>>> {
    if quiet {
        return Ok(None);
    }
    Ok(Some(py.import("ddem._progress")?.call_method0("ProgressBar")?.unbind()))
}

/// Closes the progress bar of a call.
pub(crate) fn close(py: Python<'_>, bar: Option<Py<PyAny>>) -> PyResult<()> {
    bar.map_or(Ok(()), |bar| bar.call_method0(py, "close").map(|_| ()))
}

/// Stage that the arguments describe.
pub(crate) fn read_stage(
    py: Python<'_>,
    kind: &str,
    duration: Option<&Bound<'_, PyAny>>,
    keys: Option<&Bound<'_, PyDict>>,
) -> PyResult<Stage> {
    let (mut entry, _) = table("stage", keys, &mut no_matter)?;
    for (key, own) in [("name", "stage"), ("kind", kind)] {
        if entry.insert(key.to_owned(), Value::String(own.to_owned())).is_some() {
            let message = "is not an argument: the method sets it";
            return Err(model_error(py, key, message, None));
        }
    }
    if let Some(duration) = duration {
        let seconds = crate::values::value(duration, "duration", &mut no_matter)?;
        entry.insert("duration".to_owned(), seconds);
    }
    let deck = alone(py, "stage", entry)?;
    Ok(deck.stage.into_iter().next().unwrap_or_default())
}

//! Long work on other threads, without holding the interpreter, while Python continues.
//!
//! Only this module calls the core. The calling thread waits without holding the interpreter and
//! checks regularly for Ctrl-C and progress.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use ddem_core::ErrorCode;
use ddem_deck::BuildProgress;
use ddem_deck::lint::Diagnostic;
use ddem_io::run::Progress;
use pyo3::exceptions::{PyRuntimeError, PyUserWarning};
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::arrays::integer;
use crate::errors::{internal, is_interruption, model_error};
use crate::notation;

/// Time between two checks for Ctrl-C and progress.
const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// Largest number of threads that a call may request.
const MOST_THREADS: usize = 1024;

/// State of work on another thread, as seen from Python.
#[derive(Default)]
pub(crate) struct Worker {
    stop: Arc<AtomicBool>,
    /// Building of a model, which Ctrl-C abandons; `None` for work that only stops.
    building: Option<Arc<BuildProgress>>,
    progress: Mutex<Option<Progress>>,
    warnings: Mutex<Vec<Diagnostic>>,
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Worker {
    /// True if the work must stop.
    pub(crate) fn stops(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    pub(crate) fn stop_flag(&self) -> Arc<AtomicBool> {
        self.stop.clone()
    }

    pub(crate) fn build_progress(&self) -> Arc<BuildProgress> {
        self.building.clone().unwrap_or_default()
    }

    pub(crate) fn progress(&self, progress: Progress) {
        *locked(&self.progress) = Some(progress);
    }

    pub(crate) fn warn(&self, warning: Diagnostic) {
        locked(&self.warnings).push(warning);
    }

    /// Passes new warnings and the progress to Python.
    fn tell(&self, py: Python<'_>, bar: Option<&Py<PyAny>>) -> PyResult<()> {
        let warnings = std::mem::take(&mut *locked(&self.warnings));
        warnings.iter().try_for_each(|warning| warn(py, warning))?;
        let progress = locked(&self.progress).take();
        let (Some(bar), Some(p)) = (bar, progress) else { return Ok(()) };
        let steps = (!p.relax).then_some(p.steps);
        let counts = (p.failed_pairs, p.contacts);
        let arguments =
            (p.stage, p.step, steps, p.time, p.unbalanced, counts, p.updates_per_second);
        bar.call_method1(py, "update", arguments)?;
        Ok(())
    }
}

pub(crate) fn warn(py: Python<'_>, warning: &Diagnostic) -> PyResult<()> {
    let text = notation::warning(warning).replace('\0', " ");
    let text = std::ffi::CString::new(text).unwrap_or_default();
    PyErr::warn(py, &py.get_type::<PyUserWarning>(), &text, 1)
}

/// Threads of one simulation. Simulations do not share them, because a waiting one would take over
/// work of another.
pub(crate) struct Pool {
    threads: usize,
    /// Threads, with the process in which they were made.
    made: Mutex<Option<(u32, Arc<ThreadPool>)>>,
}

impl Pool {
    pub(crate) fn new(threads: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        let Some(threads) = threads else { return Ok(Self::of(0)) };
        let number = integer(threads, "threads")?;
        match usize::try_from(number).ok().filter(|n| (1..=MOST_THREADS).contains(n)) {
            Some(number) => Ok(Self::of(number)),
            None => {
                let message = format!("must be from 1 to {MOST_THREADS}, found {number}");
                Err(model_error(threads.py(), "threads", &message, None))
            }
        }
    }

    /// Pool with a number of threads; 0 means one for each processor.
    pub(crate) fn of(threads: usize) -> Self {
        Self { threads, made: Mutex::new(None) }
    }

    /// Requested number of threads.
    pub(crate) fn threads(&self) -> Option<usize> {
        (self.threads > 0).then_some(self.threads)
    }

    fn get(&self) -> PyResult<Arc<ThreadPool>> {
        let mut made = locked(&self.made);
        let process = std::process::id();
        if let Some((_, pool)) = made.as_ref().filter(|(here, _)| *here == process) {
            return Ok(pool.clone());
        }
        let pool = ThreadPoolBuilder::new().num_threads(self.threads).build();
        let pool = Arc::new(pool.map_err(|error| {
            let code = ErrorCode::Threads;
            PyRuntimeError::new_err(format!("cannot start the threads: {error} [{code}]"))
        })?);
        forget(made.replace((process, pool.clone())));
        Ok(pool)
    }
}

impl Drop for Pool {
    fn drop(&mut self) {
        let made = locked(&self.made).take();
        if made.as_ref().is_some_and(|(process, _)| *process != std::process::id()) {
            forget(made);
        }
    }
}

/// Leaks the threads of a process from which this one was forked. They do not exist here, so
/// nothing would answer a request to end.
fn forget(pool: Option<(u32, Arc<ThreadPool>)>) {
    std::mem::forget(pool);
}

/// Result of the work or its panic.
type Ending<T> = Result<T, Box<dyn Any + Send>>;

/// First exception; an interruption takes precedence.
pub(crate) fn first(py: Python<'_>, raised: Option<PyErr>, later: Option<PyErr>) -> Option<PyErr> {
    match (raised, later) {
        (Some(first), Some(later))
            if is_interruption(py, &later) && !is_interruption(py, &first) =>
        {
            Some(later)
        }
        (Some(first), _) => Some(first),
        (None, later) => later,
    }
}

/// Runs work on the threads of a pool.
///
/// Returns the result of the work, and the exception that made it stop.
pub(crate) fn on_worker_thread<T: Send>(
    py: Python<'_>,
    pool: &Pool,
    bar: Option<&Py<PyAny>>,
    work: impl FnOnce(&Worker) -> T + Send,
) -> PyResult<(T, Option<PyErr>)> {
    let pool = pool.get()?;
    let worker = Worker::default();
    let (send, receive) = sync_channel(1);
    let (done, raised) = py.detach(|| {
        let worker = &worker;
        pool.in_place_scope(move |scope| {
            scope.spawn(move |_| {
                let done = catch_unwind(AssertUnwindSafe(|| work(worker)));
                let _ = send.send(done);
            });
            wait(worker, receive, bar)
        })
    });
    ended(py, &worker, bar, done, raised)
}

/// Runs work that builds a model, like [`on_worker_thread`]. An exception ends the call at once, and the
/// work ends later by itself, unless the model has been built.
pub(crate) fn build_on_worker_thread<T: Send + 'static>(
    py: Python<'_>,
    pool: &Pool,
    bar: Option<&Py<PyAny>>,
    work: impl FnOnce(&Worker) -> T + Send + 'static,
) -> PyResult<(T, Option<PyErr>)> {
    let worker = Arc::new(Worker { building: Some(Arc::default()), ..Worker::default() });
    let (send, receive) = sync_channel(1);
    let builder = worker.clone();
    pool.get()?.spawn(move || {
        let done = catch_unwind(AssertUnwindSafe(|| work(&builder)));
        let _ = send.send(done);
    });
    let watched = &*worker;
    let (done, raised) = py.detach(move || wait(watched, receive, bar));
    ended(py, &worker, bar, done, raised)
}

/// Waits for work. Returns its ending, and the exception that Ctrl-C or the progress bar raised
/// meanwhile, which abandons the building of a model.
fn wait<T>(
    worker: &Worker,
    receive: Receiver<Ending<T>>,
    bar: Option<&Py<PyAny>>,
) -> (Ending<T>, Option<PyErr>) {
    let mut raised = None;
    loop {
        match receive.recv_timeout(POLL_INTERVAL) {
            Ok(done) => return (done, raised),
            Err(RecvTimeoutError::Timeout) if raised.is_none() => {
                let poll = |py: Python<'_>| {
                    py.check_signals()?;
                    worker.tell(py, bar)
                };
                let Err(error) = Python::attach(poll) else { continue };
                raised = Some(error);
                worker.stop.store(true, Ordering::Relaxed);
                if worker.building.as_ref().is_some_and(|building| building.abandon()) {
                    return (Err(Box::new("abandoned")), raised);
                }
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => {
                return (Err(Box::new("the work was lost")), raised);
            }
        }
    }
}

/// Result of work, and the exception that made it stop, also at its end.
fn ended<T>(
    py: Python<'_>,
    worker: &Worker,
    bar: Option<&Py<PyAny>>,
    done: Ending<T>,
    mut raised: Option<PyErr>,
) -> PyResult<(T, Option<PyErr>)> {
    // A Ctrl-C at the end of the work is handled here and not by later code.
    let signal = py.check_signals();
    let drawn = worker.tell(py, bar);
    raised = first(py, raised, signal.err());
    raised = first(py, raised, drawn.err());
    match done {
        Ok(done) => Ok((done, raised)),
        Err(panic) => Err(raised.unwrap_or_else(|| internal(py, &*panic))),
    }
}

/// Result of the work; an exception raised meanwhile comes first, so that Ctrl-C is never lost.
pub(crate) fn outcome<T, E>(
    done: Result<T, E>,
    raised: Option<PyErr>,
    error: impl FnOnce(E) -> PyErr,
) -> PyResult<T> {
    raised.map_or(Ok(()), Err)?;
    done.map_err(error)
}

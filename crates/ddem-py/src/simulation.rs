//! Simulation for Python.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, TryLockError, TryLockResult};

use ddem_core::{ModelError, RunError};
use ddem_io::run::Session;
use pyo3::exceptions::PyTypeError;
use pyo3::gc::{PyTraverseError, PyVisit};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays;
use crate::drive::{close, progress_bar, read_stage, steps};
use crate::errors::{self, is_interruption};
use crate::fields;
use crate::functions::Called;
use crate::run::known;
use crate::samples::Samples;
use crate::worker::{Pool, Worker, first, on_worker_thread, outcome};

/// A model in motion: its state, and the calls that change it.
///
/// Made by :meth:`Model.build`, :func:`load` and :func:`run_deck`. Arrays are copies of the present
/// state; changing them does not change the simulation. Other Python threads continue while a call
/// runs, but using the simulation from one of them raises :class:`Busy`.
#[pyclass(name = "Simulation", frozen, module = "ddem")]
pub(crate) struct PySimulation {
    /// Boxed, because the memory of Python objects is not aligned for vectors.
    inner: Mutex<Box<Inner>>,
    pub(crate) pool: Pool,
    pub(crate) called: Called,
}

// Python's memory is aligned to 16 bytes.
const _: () = assert!(align_of::<PySimulation>() <= 16);

/// Data of a simulation, which its lock protects.
pub(crate) struct Inner {
    pub(crate) session: Session,
    pub(crate) samples: Samples,
    /// True during a run, also while its functions read the simulation.
    pub(crate) running: bool,
    /// Stages for which it was reported that loads or supports wait.
    pub(crate) awaited: BTreeSet<String>,
    /// Number of steps at the last exception that a function of the model raised.
    raised_at: Option<u64>,
}

#[pymethods]
impl PySimulation {
    /// Takes plain time steps, for coupling and control loops. Probes record nothing.
    ///
    /// The damping and length of the steps are those of :meth:`start`, or of the last :meth:`run`.
    /// Without either they are undamped, with the time step "auto". After :meth:`relax` their
    /// length is chosen again.
    ///
    /// Parameters
    /// ----------
    /// n : int, optional
    ///     Number of steps.
    /// quiet : bool, optional
    ///     No progress bar.
    ///
    /// Raises
    /// ------
    /// Diverged
    ///     Forces are no longer finite.
    /// ValueError
    ///     `n` is not a whole number, or is negative.
    /// KeyboardInterrupt
    ///     Fewer steps were taken, see :attr:`steps`; another call continues.
    #[pyo3(signature = (n=None, *, quiet=false), text_signature = "($self, n=1, *, quiet=False)")]
    fn step(&self, py: Python<'_>, n: Option<&Bound<'_, PyAny>>, quiet: bool) -> PyResult<()> {
        let n = n.map_or(Ok(1), |n| arrays::integer(n, "n"))?;
        let bar = if n > 1 { progress_bar(py, quiet)? } else { None };
        let mut inner = self.lock_to_move(py)?;
        let stepped = self.moved_by(py, &mut inner, bar.as_ref(), |simulation, worker| {
            steps(simulation, n, worker)
        });
        let closed = close(py, bar);
        stepped.and(closed)
    }

    /// Sets the damping and the length of the steps that follow.
    ///
    #[doc = include_str!("keys/Start.txt")]
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     An argument is wrong, or the time step exceeds the critical one.
    #[pyo3(signature = (**keys))]
    fn start(&self, py: Python<'_>, keys: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        known(py, keys, &|| Ok(["damping", "time_step"].map(str::to_owned).into()))?;
        drop(self.lock_to_move(py)?);
        let mut stage = read_stage(py, "dynamic", None, keys)?;
        // Only the check needs a duration; there is none.
        stage.duration = Some(1.0);
        let faults = stage.check();
        if !faults.is_empty() {
            return Err(errors::arguments(py, ModelError { faults }, "stage[0]"));
        }
        self.moved(py, move |simulation| {
            let damping = stage.damping.unwrap_or_default();
            simulation.start(damping, stage.time_step.unwrap_or_default(), None).map(|_| ())
        })
    }

    /// Begins a stage of the model. Supports and loads follow their `from_` and `until`, and blocks
    /// that are removed by then disappear. Nothing moves.
    ///
    /// Joints and materials become those of the stage. A `release` that has begun continues until a
    /// relax stage. Stages are entered forwards only; to go back, :func:`load` a saved state. The
    /// time step stays, unless it is automatic and too long for the remaining blocks.
    ///
    /// Parameters
    /// ----------
    /// stage : str
    ///     Name of the stage.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     The model has no such stage, or it comes before the present one (:class:`ModelError`).
    fn enter(&self, py: Python<'_>, stage: &str) -> PyResult<()> {
        let mut inner = self.lock_to_move(py)?;
        let stages = &inner.session.site().deck().stage;
        let names: Vec<&str> = stages.iter().map(|stage| stage.name.as_str()).collect();
        let Some(index) = names.iter().position(|name| *name == stage) else {
            return Err(fields::unknown(py, "stage", stage, &names));
        };
        let enter = |inner: &mut Inner, _: &Worker| inner.session.enter(index, "stage");
        self.work(py, &mut inner, None, enter, |fault| errors::model(py, &fault.into()))
    }

    /// Applies forces to nodes from now on, besides the loads of the model: for coupling with
    /// another program, at every step if necessary.
    ///
    /// The force on a node replaces the one that an earlier call applied to it; forces of one call
    /// on the same node add up. A force of 0 removes it.
    ///
    /// Parameters
    /// ----------
    /// nodes : int, array of int or mask, shape (n,)
    ///     Numbers of nodes.
    /// force : array, shape (3,) or (n, 3)
    ///     Force on each node [N].
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     A node does not exist, a shape is wrong, or a number is not finite.
    fn apply_force(
        &self,
        py: Python<'_>,
        nodes: &Bound<'_, PyAny>,
        force: &Bound<'_, PyAny>,
    ) -> PyResult<()> {
        let nodes = arrays::nodes(nodes, "nodes", self.n_nodes(py)?)?;
        let mut forces = arrays::vectors(force, "force", &[&[3], &[nodes.len(), 3]])?;
        if forces.len() != nodes.len() {
            let one = forces.first().copied().unwrap_or_default();
            forces = vec![one; nodes.len()];
        }
        self.moved(py, move |simulation| {
            simulation.apply_force(&nodes, &forces);
            Ok(())
        })
    }

    /// Writes everything that is needed to continue bit for bit; :func:`load` reads it.
    ///
    /// Parameters
    /// ----------
    /// path : path
    ///     File to write (HDF5). An existing file is replaced once the new one is complete.
    ///
    /// Raises
    /// ------
    /// OSError
    ///     The file cannot be written.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let mut inner = self.lock(py)?;
        let save = |inner: &mut Inner, _: &Worker| inner.session.save(&path);
        self.work(py, &mut inner, None, save, |failure| errors::failure(py, &failure))
    }

    fn __traverse__(&self, visit: PyVisit<'_>) -> Result<(), PyTraverseError> {
        self.called.traverse(&visit)
    }

    fn __clear__(&self) {
        self.called.clear();
    }

    /// Refusal of `copy` and `pickle`.
    fn __reduce__(&self) -> PyResult<()> {
        Err(PyTypeError::new_err(
            "a Simulation cannot be copied or pickled: write it with save(path), and each ddem.load(path) makes a copy",
        ))
    }

    fn __getattr__(slf: &Bound<'_, Self>, name: &str) -> PyResult<Py<PyAny>> {
        Err(fields::no_attribute(slf.as_any(), name))
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        // Debuggers and logs may call this at any time.
        let Ok(inner) = self.lock(py) else { return Ok("<Simulation, busy>".to_owned()) };
        let simulation = inner.session.simulation();
        let model = simulation.model();
        let format = py.import("builtins")?.getattr("format")?;
        let time: String = format.call1((simulation.time(), ".6g"))?.extract()?;
        Ok(format!(
            "<Simulation \"{}\": {} blocks, {} nodes, {} steps, {time} s>",
            inner.session.site().deck().title,
            model.n_whole_blocks(),
            model.n_nodes(),
            simulation.steps(),
        ))
    }

    /// Table for notebooks; nothing while another thread works, so that they show the text.
    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("ddem._html")?.call_method1("of_simulation", (slf,))
    }
}

impl PySimulation {
    pub(crate) fn new(session: Session, samples: Samples, pool: Pool, called: Called) -> Self {
        let inner =
            Inner { session, samples, running: false, awaited: BTreeSet::new(), raised_at: None };
        Self { inner: Mutex::new(Box::new(inner)), pool, called }
    }

    pub(crate) fn try_lock(&self) -> TryLockResult<MutexGuard<'_, Box<Inner>>> {
        self.inner.try_lock()
    }

    pub(crate) fn lock(&self, py: Python<'_>) -> PyResult<MutexGuard<'_, Box<Inner>>> {
        match self.try_lock() {
            Ok(inner) => Ok(inner),
            // The fault in the program was reported when it happened.
            Err(TryLockError::Poisoned(poisoned)) => Ok(poisoned.into_inner()),
            Err(TryLockError::WouldBlock) => Err(errors::busy(py, "the simulation")),
        }
    }

    /// Lock for moving the simulation, which functions called by a run must not do.
    pub(crate) fn lock_to_move(&self, py: Python<'_>) -> PyResult<MutexGuard<'_, Box<Inner>>> {
        let inner = self.lock(py)?;
        if inner.running {
            return Err(errors::busy(py, "the simulation"));
        }
        Ok(inner)
    }

    /// Result of a short call on the simulation.
    pub(crate) fn moved(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut ddem_core::Simulation) -> Result<(), RunError> + Send,
    ) -> PyResult<()> {
        self.moved_by(py, &mut *self.lock(py)?, None, |simulation, _| work(simulation))
    }

    fn moved_by(
        &self,
        py: Python<'_>,
        inner: &mut Inner,
        bar: Option<&Py<PyAny>>,
        work: impl FnOnce(&mut ddem_core::Simulation, &Worker) -> Result<(), RunError> + Send,
    ) -> PyResult<()> {
        let work = |inner: &mut Inner, worker: &Worker| {
            let simulation = inner.session.simulation_mut();
            simulation.stop_when(worker.stop_flag());
            work(simulation, worker)
        };
        self.work(py, inner, bar, work, |error| errors::run_error(py, &error, ""))
    }

    /// Works on the simulation with its threads. The exception of a function of the model ends the
    /// call. Calls that need its value only to measure raise it once in a step.
    pub(crate) fn work<T: Send, E: Send>(
        &self,
        py: Python<'_>,
        inner: &mut Inner,
        bar: Option<&Py<PyAny>>,
        work: impl FnOnce(&mut Inner, &Worker) -> Result<T, E> + Send,
        error: impl FnOnce(E) -> PyErr,
    ) -> PyResult<T> {
        let (done, stopped) = on_worker_thread(py, &self.pool, bar, |worker| work(inner, worker))?;
        let raised = self.called.take_raised();
        let steps = inner.session.simulation().steps();
        let again = raised.is_some() && inner.raised_at.replace(steps) == Some(steps);
        let raised = raised.filter(|raised| !again || done.is_err() || is_interruption(py, raised));
        outcome(done, first(py, stopped, raised), error)
    }
}

//! A model in motion.

use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, TryLockError};

use ddem_core::deck::{Stage, Where};
use ddem_core::{Energy, Fault, Model as CoreModel, ModelError, RunError};
use ddem_io::run::{Event, RunFailure, Session};
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use toml::{Table, Value};

use crate::arrays;
use crate::away::{Watch, away, warn};
use crate::errors::{self, model_error};
use crate::functions::{Functions, Raised};
use crate::look;
use crate::values::{Matter, table, to_python};

/// A model in motion: its state, and what is done to it.
///
/// Made by :meth:`Model.build`, :func:`load` and :func:`run_deck`. Arrays are copies, as the state
/// is now; changing them changes nothing. While a call runs other Python threads go on, but using
/// the simulation from one of them raises :class:`Busy`.
#[pyclass(frozen, module = "ddem")]
pub(crate) struct Simulation {
    inner: Mutex<Inner>,
    threads: Option<usize>,
    raised: Raised,
}

/// What is moved.
pub(crate) struct Inner {
    pub(crate) session: Session,
    pub(crate) samples: Vec<Sample>,
}

/// What probes have seen at one time.
pub(crate) struct Sample {
    pub(crate) step: u64,
    pub(crate) time: f64,
    pub(crate) values: Vec<Option<f64>>,
}

/// Passes on what happens.
struct Observer<'a> {
    watch: &'a Watch,
    samples: &'a mut Vec<Sample>,
}

impl ddem_io::run::Observer for Observer<'_> {
    fn event(&mut self, event: Event<'_>) {
        match event {
            Event::Progress(progress) => self.watch.progress(progress.clone()),
            Event::Warning(warning) => self.watch.warn(warning.to_owned()),
            Event::Sample { step, time, values } => {
                self.samples.push(Sample { step, time, values: values.to_vec() });
            }
            _ => {}
        }
    }

    fn wants_to_stop(&mut self) -> bool {
        self.watch.stops()
    }
}

/// What changes a model after it was built from its deck.
pub(crate) type Change = Box<dyn FnOnce(&mut CoreModel) -> Result<(), Fault> + Send>;

/// A simulation from what `make` makes, with Python functions as histories.
pub(crate) fn assembled(
    py: Python<'_>,
    threads: Option<usize>,
    functions: Functions,
    located: &dyn Fn(&ModelError) -> PyErr,
    make: impl FnOnce(Change) -> Result<Session, RunFailure> + Send,
) -> PyResult<Simulation> {
    let raised = Raised::default();
    let kept = raised.clone();
    let change: Change = Box::new(move |model| functions.set(model, &kept));
    let (made, stopped) = away(py, threads, None, move |_| make(change))?;
    let session = made.map_err(|failure| match &failure {
        RunFailure::Model(error) => located(error),
        failure => errors::failure(py, failure),
    })?;
    stopped.map_or(Ok(()), Err)?;
    for warning in session.simulation().model().warnings() {
        warn(py, &warning)?;
    }
    Ok(Simulation::new(session, Vec::new(), threads, raised))
}

/// Moves a deck through its stages; see [`run_deck`](crate::run_deck).
pub(crate) fn driven(
    py: Python<'_>,
    (deck, source): (&ddem_core::Deck, &ddem_io::Source),
    options: &ddem_io::run::Options,
    quiet: bool,
) -> PyResult<Simulation> {
    let bar = progress_bar(py, quiet)?;
    let (ended, stopped) = away(py, options.threads, bar.as_ref(), |watch| {
        let mut samples = Vec::new();
        let mut observer = Observer { watch, samples: &mut samples };
        let outcome = ddem_io::run::run(deck, source, options, &mut observer);
        outcome.map(|outcome| (outcome, samples))
    })?;
    let (outcome, samples) = ended.map_err(|failure| errors::failure(py, &failure))?;
    match outcome {
        ddem_io::run::Outcome::Done(session) => {
            stopped.map_or(Ok(()), Err)?;
            Ok(Simulation::new(*session, samples, options.threads, Raised::default()))
        }
        ddem_io::run::Outcome::Interrupted(checkpoint) => Err(match stopped {
            Some(error) if !error.is_instance_of::<PyKeyboardInterrupt>(py) => error,
            _ => PyKeyboardInterrupt::new_err(format!(
                "saved in {}; run_deck(..., resume=True) goes on",
                checkpoint.display()
            )),
        }),
    }
}

/// The progress bar of a call; none when it is to be quiet.
fn progress_bar(py: Python<'_>, quiet: bool) -> PyResult<Option<Py<PyAny>>> {
    if quiet {
        return Ok(None);
    }
    Ok(Some(py.import("ddem._progress")?.call_method0("Bar")?.unbind()))
}

#[pymethods]
impl Simulation {
    /// Relaxes to static equilibrium, under the supports and loads in force. Time stands still.
    ///
    /// Parameters
    /// ----------
    /// tolerance : float, optional
    ///     Unbalanced force ratio at which it is done; 1e-6 without it.
    /// max_steps : int, optional
    ///     After which it fails; 200 000 without it.
    /// increments : int, optional
    ///     Equal parts in which loads reach their value; 1 without it.
    /// record : path, optional
    ///     Folder of the results, with the files that a deck gives. What one simulation writes to
    ///     one folder is one run.
    /// name : str, optional
    ///     Of the stage in these files.
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
    ///     With `ratio`, what was reached; :class:`Collapsed` when blocks part without end.
    /// Diverged
    ///     Forces are not finite any more.
    /// ModelError
    ///     An argument is wrong.
    /// OSError
    ///     A file cannot be written.
    /// KeyboardInterrupt
    ///     The state is consistent, and another call goes on from it.
    #[pyo3(signature = (*, record=None, name=None, quiet=false, **keys))]
    fn relax(
        &self,
        py: Python<'_>,
        record: Option<PathBuf>,
        name: Option<String>,
        quiet: bool,
        keys: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<u64> {
        self.stage(py, ("relax", None), (record, name, quiet), keys)
    }

    /// Moves in time, under the supports and loads in force.
    ///
    /// Parameters
    /// ----------
    /// duration : float
    ///     Simulated time [s].
    /// damping : float, dict or "none", optional
    ///     The ratio of (10), or as in a deck ``{"mass": alpha}``, ``{"local": 0.8}``; none without
    ///     it.
    /// time_step : float, optional
    ///     [s]; without it a part of the critical one that fills the duration.
    /// record : path, optional
    ///     Folder of the results, with the files that a deck gives. What one simulation writes to
    ///     one folder is one run.
    /// fields_every : float, optional
    ///     Time between frames [s]; or
    /// frames : int, optional
    ///     Frames in all; 20 without either.
    /// name : str, optional
    ///     Of the stage in these files.
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
    /// Diverged
    ///     Forces are not finite any more.
    /// ModelError
    ///     An argument is wrong, or the time step above the critical one.
    /// OSError
    ///     A file cannot be written.
    /// KeyboardInterrupt
    ///     The state is consistent, and another call goes on from it.
    #[pyo3(signature = (duration, *, record=None, name=None, quiet=false, **keys))]
    fn run(
        &self,
        py: Python<'_>,
        duration: &Bound<'_, PyAny>,
        record: Option<PathBuf>,
        name: Option<String>,
        quiet: bool,
        keys: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<u64> {
        self.stage(py, ("dynamic", Some(duration)), (record, name, quiet), keys)
    }

    /// Plain steps of time, for coupling and control loops. Their damping and length are those of
    /// :meth:`start`, or of the last :meth:`run`.
    ///
    /// Parameters
    /// ----------
    /// n : int, optional
    ///     How many.
    /// quiet : bool, optional
    ///     No progress bar.
    ///
    /// Raises
    /// ------
    /// Diverged
    ///     Forces are not finite any more.
    /// ValueError
    ///     `n` is no whole number, or negative.
    /// KeyboardInterrupt
    ///     Fewer steps were taken, see :attr:`steps`; another call goes on.
    #[pyo3(signature = (n=None, *, quiet=false))]
    fn step(&self, py: Python<'_>, n: Option<&Bound<'_, PyAny>>, quiet: bool) -> PyResult<()> {
        let n = n.map_or(Ok(1), |n| look::whole(n, "n"))?;
        let mut inner = self.lock(py)?;
        let bar = if n > 1 { progress_bar(py, quiet)? } else { None };
        let simulation = inner.session.simulation_mut();
        let (done, stopped) =
            away(py, self.threads, bar.as_ref(), |watch| look::steps(simulation, n, watch))?;
        self.ended(py, done, stopped)
    }

    /// Sets the damping and the length of the steps that follow.
    ///
    /// Parameters
    /// ----------
    /// damping : float, dict or "none", optional
    ///     As in :meth:`run`; none without it.
    /// time_step : float, optional
    ///     [s]; 0.9 of the critical one without it, 0.8 once joints have failed.
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     An argument is wrong, or the time step above the critical one.
    #[pyo3(signature = (**keys))]
    fn start(&self, py: Python<'_>, keys: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        let mut stage = read_stage(py, "dynamic", None, keys)?;
        // Only to be checked: there is none.
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

    /// Begins a stage of the model: the supports and loads with `from_` and `until` follow. Nothing
    /// moves.
    ///
    /// Parameters
    /// ----------
    /// stage : str
    ///     Its name.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     The model has no such stage.
    fn enter(&self, py: Python<'_>, stage: &str) -> PyResult<()> {
        let mut inner = self.lock(py)?;
        let simulation = inner.session.simulation_mut();
        let names: Vec<&str> =
            simulation.model().deck().stage.iter().map(|stage| stage.name.as_str()).collect();
        let Some(index) = names.iter().position(|name| *name == stage) else {
            return Err(look::unknown(py, "stage", stage, &names));
        };
        self.ended(py, Ok(()), away(py, self.threads, None, |_| simulation.enter(index))?.1)
    }

    /// Applies forces to nodes from now on, besides the loads of the model: for coupling with
    /// another program, at every step if need be.
    ///
    /// The force on a node replaces what an earlier call applied to it; those of one call on the
    /// same node add up. A force of 0 takes it away.
    ///
    /// Parameters
    /// ----------
    /// nodes : int, array of int or mask, shape (n,)
    ///     Numbers of nodes.
    /// force : array, shape (3,) or (n, 3)
    ///     On each of them [N].
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     A node that does not exist, a wrong shape, a number that is not finite.
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

    /// Writes everything that is needed to go on, bit for bit; :func:`load` reads it.
    ///
    /// Parameters
    /// ----------
    /// path : path
    ///     The file (HDF5). What is there is replaced when the new one is complete.
    ///
    /// Raises
    /// ------
    /// OSError
    ///     The file cannot be written.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let mut inner = self.lock(py)?;
        let session = &mut inner.session;
        let (saved, stopped) = away(py, self.threads, None, |_| session.save(&path))?;
        saved.map_err(|failure| errors::failure(py, &failure))?;
        stopped.map_or(Ok(()), Err)
    }

    /// A field by its name: "displacement", "velocity", "stress", "traction" and all others of the
    /// result files, or "force".
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     Of the field.
    /// nodes : array of int or mask, optional
    ///     Only these nodes, of a field at nodes.
    /// out : array of float64, optional
    ///     Takes the numbers, for loops that make no new array.
    ///
    /// Returns
    /// -------
    /// array of float64
    ///     `out`, or a new one.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     No such field; a wrong node; a wrong `out`.
    #[pyo3(signature = (name, *, nodes=None, out=None))]
    fn field<'py>(
        &self,
        py: Python<'py>,
        name: &str,
        nodes: Option<&Bound<'py, PyAny>>,
        out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let field = look::field(py, name)?;
        let n_nodes = self.n_nodes(py)?;
        let nodes = nodes.map(|nodes| arrays::nodes(nodes, "nodes", n_nodes)).transpose()?;
        let components = field.components;
        if nodes.is_some() && !field.at_nodes {
            let message = format!("`{name}` is not a field at nodes");
            return Err(model_error(py, "nodes", &message, None));
        }
        let values = self.looked(py, move |inner| {
            let all = (field.fill)(inner.session.simulation_mut());
            let Some(nodes) = nodes else { return all };
            let row = |node: u32| components * node as usize..components * (node as usize + 1);
            nodes.into_iter().flat_map(|node| all[row(node)].to_vec()).collect()
        })?;
        let Some(out) = out else { return arrays::components(py, values, components) };
        let n = values.len() / components;
        let shape = if components == 1 { vec![n] } else { vec![n, components] };
        arrays::fill(out, &values, &shape)?;
        Ok(out.clone())
    }

    /// Displacements [m], shape (n_nodes, 3). May be set: an initial state, in which nothing has
    /// failed that has not failed before.
    #[getter]
    fn displacement<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.field(py, "displacement", None, None)
    }

    #[setter]
    fn set_displacement(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> PyResult<()> {
        let value = arrays::vectors(value, "displacement", &[&[self.n_nodes(py)?, 3]])?;
        self.moved(py, move |simulation| {
            simulation.set_displacements(&value);
            Ok(())
        })
    }

    /// Velocities at the present time [m/s], shape (n_nodes, 3). May be set.
    #[getter]
    fn velocity<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.field(py, "velocity", None, None)
    }

    #[setter]
    fn set_velocity(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> PyResult<()> {
        let value = arrays::vectors(value, "velocity", &[&[self.n_nodes(py)?, 3]])?;
        self.moved(py, move |simulation| {
            simulation.set_velocities(&value);
            Ok(())
        })
    }

    /// What accelerates each node [N], shape (n_nodes, 3): loads and support forces less the
    /// internal ones; zero in equilibrium.
    #[getter]
    fn force<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.field(py, "force", None, None)
    }

    /// Stress at the centre of each element [Pa], shape (n_elements, 6): xx yy zz xy yz zx, tension
    /// positive.
    #[getter]
    fn stress<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.field(py, "stress", None, None)
    }

    /// Reference positions of the nodes [m], shape (n_nodes, 3).
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::rows(py, self.looked(py, |inner| look::points(&inner.session))?)
    }

    /// Lumped masses of the nodes [kg], shape (n_nodes,).
    #[getter]
    fn mass<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::components(py, self.looked(py, |inner| look::masses(&inner.session))?, 1)
    }

    /// The block of each node, shape (n_nodes,).
    #[getter]
    fn node_block<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        look::integers(py, self.looked(py, |inner| look::node_blocks(&inner.session))?)
    }

    /// The nodes of each element, in VTK's order, shape (n_elements, 8).
    #[getter]
    fn elements<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::rows(py, self.looked(py, |inner| look::elements(&inner.session))?)
    }

    /// The block of each element, shape (n_elements,).
    #[getter]
    fn element_block<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        look::integers(py, self.looked(py, |inner| look::element_blocks(&inner.session))?)
    }

    /// The pairs of facing nodes, a structured array of shape (n_pairs,): `point` (between the
    /// nodes of the pair, reference position) [m], `nodes`, `joint` (its number, in sorted order of
    /// the names) and the fields of joints: `displacement` [m], `traction` [Pa], `slip` [m],
    /// `opening` [m], `state` (0 bonded, 1 failed in shear, 2 failed in tension), `open`,
    /// `failure_time` [s] (NaN while bonded), `damage`.
    #[getter]
    fn pairs<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let pairs = self.looked(py, |inner| look::pairs(&mut inner.session))?;
        look::pair_array(py, pairs)
    }

    /// The pairs around each joint element, shape (n_quads, 4).
    #[getter]
    fn quads<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::rows(py, self.looked(py, |inner| look::quads(&inner.session))?)
    }

    /// Nodes that are selected, in order.
    ///
    /// Parameters
    /// ----------
    /// x, y, z : float or (float, float), optional
    ///     A plane or a range [m].
    /// sphere : dict, optional
    ///     ``{"centre": ..., "radius": ...}``.
    /// set : str, optional
    ///     Name of a set of blocks.
    ///
    /// Returns
    /// -------
    /// array of int
    ///     Empty if there is none.
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     A key that does not exist or a value of the wrong type.
    #[pyo3(signature = (**keys))]
    fn nodes<'py>(
        &self,
        py: Python<'py>,
        keys: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let region = read_where(py, keys)?;
        let found = self.looked(py, move |inner| {
            let nodes = inner.session.simulation().model().nodes_in(&region);
            nodes.into_iter().map(i64::from).collect()
        })?;
        look::integers(py, found)
    }

    /// The node nearest to a reference position; on a tie the lower number.
    ///
    /// Parameters
    /// ----------
    /// at : (float, float, float)
    ///     [m].
    ///
    /// Returns
    /// -------
    /// int
    fn nearest_node(&self, py: Python<'_>, at: &Bound<'_, PyAny>) -> PyResult<usize> {
        let at = arrays::vectors(at, "at", &[&[3]])?;
        let at = at.first().copied().unwrap_or_default();
        self.looked(py, move |inner| inner.session.simulation().model().nearest_node(at))
    }

    /// Sum of the support forces on some nodes, as they act on the model.
    ///
    /// Parameters
    /// ----------
    /// nodes : array of int or mask
    ///     Their numbers.
    ///
    /// Returns
    /// -------
    /// array of float64, shape (3,)
    ///     [N].
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     A node that does not exist.
    fn reaction<'py>(
        &self,
        py: Python<'py>,
        nodes: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let mut nodes = arrays::nodes(nodes, "nodes", self.n_nodes(py)?)?;
        nodes.sort_unstable();
        let sum = self.looked(py, move |inner| inner.session.simulation_mut().reaction(&nodes))?;
        arrays::components(py, sum.to_vec(), 1)
    }

    /// What the probes have recorded so far: for each a structured array with `time` [s], `step` and
    /// the components, `x`, `y`, `z` or `xx`, `yy`, `zz`, `xy`, `yz`, `zx`.
    #[getter]
    fn probes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let inner = self.lock(py)?;
        look::probes(py, &inner)
    }

    /// Title of the model.
    #[getter]
    fn title(&self, py: Python<'_>) -> PyResult<String> {
        Ok(self.lock(py)?.session.simulation().model().deck().title.clone())
    }

    /// Number of nodes.
    #[getter]
    fn n_nodes(&self, py: Python<'_>) -> PyResult<usize> {
        Ok(self.lock(py)?.session.simulation().model().n_nodes())
    }

    /// Number of blocks.
    #[getter]
    fn n_blocks(&self, py: Python<'_>) -> PyResult<usize> {
        Ok(self.lock(py)?.session.simulation().model().n_blocks())
    }

    /// Number of elements of the blocks.
    #[getter]
    fn n_elements(&self, py: Python<'_>) -> PyResult<usize> {
        Ok(self.lock(py)?.session.simulation().model().n_elements())
    }

    /// Number of pairs of facing nodes.
    #[getter]
    fn n_pairs(&self, py: Python<'_>) -> PyResult<usize> {
        Ok(self.lock(py)?.session.simulation().model().n_pairs())
    }

    /// Simulated time [s].
    #[getter]
    fn time(&self, py: Python<'_>) -> PyResult<f64> {
        Ok(self.lock(py)?.session.simulation().time())
    }

    /// Steps since the start, those of relaxation included.
    #[getter]
    fn steps(&self, py: Python<'_>) -> PyResult<u64> {
        Ok(self.lock(py)?.session.simulation().steps())
    }

    /// Time step in use [s]; 0 before the first one and after a relaxation.
    #[getter]
    fn time_step(&self, py: Python<'_>) -> PyResult<f64> {
        Ok(self.lock(py)?.session.simulation().time_step())
    }

    /// Critical time step 2/ω_max [s]; once joints have failed, that of the broken model if it is
    /// smaller.
    #[getter]
    fn critical_step(&self, py: Python<'_>) -> PyResult<f64> {
        self.looked(py, |inner| inner.session.simulation_mut().critical_step())
    }

    /// Unbalanced force ratio at the last step.
    #[getter]
    fn unbalanced(&self, py: Python<'_>) -> PyResult<f64> {
        Ok(self.lock(py)?.session.simulation().unbalanced())
    }

    /// Energies of the whole model [J], by name, with their balance.
    #[getter]
    fn energy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let energy = self.looked(py, |inner| inner.session.simulation_mut().energy())?;
        let named = PyDict::new(py);
        for (name, value) in Energy::NAMES.iter().zip(energy.values()) {
            named.set_item(name, value)?;
        }
        Ok(named)
    }

    /// What was run and how it went so far: the contents of `summary.json`.
    #[getter]
    fn summary<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.lock(py)?.session.summary())
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let inner = self.lock(py)?;
        let simulation = inner.session.simulation();
        let model = simulation.model();
        Ok(format!(
            "<Simulation \"{}\": {} blocks, {} nodes, {} steps, {:.6e} s>",
            model.deck().title,
            model.n_blocks(),
            model.n_nodes(),
            simulation.steps(),
            simulation.time()
        ))
    }
}

impl Simulation {
    fn new(session: Session, samples: Vec<Sample>, threads: Option<usize>, raised: Raised) -> Self {
        Self { inner: Mutex::new(Inner { session, samples }), threads, raised }
    }

    fn lock(&self, py: Python<'_>) -> PyResult<MutexGuard<'_, Inner>> {
        match self.inner.try_lock() {
            Ok(inner) => Ok(inner),
            // A fault in the program was told when it happened.
            Err(TryLockError::Poisoned(poisoned)) => Ok(poisoned.into_inner()),
            Err(TryLockError::WouldBlock) => Err(errors::busy(py)),
        }
    }

    /// One stage, through the driver that decks have.
    fn stage(
        &self,
        py: Python<'_>,
        (kind, duration): (&str, Option<&Bound<'_, PyAny>>),
        (record, name, quiet): (Option<PathBuf>, Option<String>, bool),
        keys: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<u64> {
        let mut stage = read_stage(py, kind, duration, keys)?;
        let bar = progress_bar(py, quiet)?;
        let mut inner = self.lock(py)?;
        let Inner { session, samples } = &mut *inner;
        let number = session.summary().stages.len() + 1;
        let verb = if kind == "relax" { "relax" } else { "run" };
        stage.name = name.unwrap_or_else(|| format!("{verb} {number}"));
        let before = session.simulation().steps();
        let (done, stopped) = away(py, self.threads, bar.as_ref(), |watch| {
            session.stage(&stage, record.as_deref(), &mut Observer { watch, samples })
        })?;
        let steps = inner.session.simulation().steps() - before;
        drop(inner);
        if let Some(error) = self.raised.take().filter(|_| done.is_err()) {
            return Err(error);
        }
        done.map_err(|failure| match failure {
            RunFailure::Model(error) => errors::arguments(py, error, "stage[0]"),
            RunFailure::Stage { source, .. } => errors::run_error(py, &source, ""),
            failure => errors::failure(py, &failure),
        })?;
        stopped.map_or(Ok(steps), Err)
    }

    /// What a short call on the simulation gave.
    fn moved(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut ddem_core::Simulation) -> Result<(), RunError> + Send,
    ) -> PyResult<()> {
        let mut inner = self.lock(py)?;
        let simulation = inner.session.simulation_mut();
        let (done, stopped) = away(py, self.threads, None, |_| work(simulation))?;
        self.ended(py, done, stopped)
    }

    fn ended(
        &self,
        py: Python<'_>,
        done: Result<(), RunError>,
        stopped: Option<PyErr>,
    ) -> PyResult<()> {
        if let Some(error) = self.raised.take().filter(|_| done.is_err()) {
            return Err(error);
        }
        done.map_err(|error| errors::run_error(py, &error, ""))?;
        stopped.map_or(Ok(()), Err)
    }

    /// What is seen of the simulation.
    fn looked<T: Send>(
        &self,
        py: Python<'_>,
        see: impl FnOnce(&mut Inner) -> T + Send,
    ) -> PyResult<T> {
        let mut inner = self.lock(py)?;
        let inner = &mut *inner;
        let (seen, stopped) = away(py, self.threads, None, |_| see(inner))?;
        if let Some(error) = self.raised.take() {
            return Err(error);
        }
        stopped.map_or(Ok(seen), Err)
    }
}

fn no_matter(_: &Matter<'_>) -> PyResult<String> {
    Ok(String::new())
}

/// The stage that arguments describe.
fn read_stage(
    py: Python<'_>,
    kind: &str,
    duration: Option<&Bound<'_, PyAny>>,
    keys: Option<&Bound<'_, PyDict>>,
) -> PyResult<Stage> {
    let (mut entry, _) = table("stage", keys, &mut no_matter)?;
    for (key, own) in [("name", "stage"), ("kind", kind)] {
        if entry.insert(key.to_owned(), Value::String(own.to_owned())).is_some() {
            return Err(model_error(py, key, "is not an argument", None));
        }
    }
    if let Some(duration) = duration {
        let seconds = crate::values::value(duration, "duration", &mut no_matter)?;
        entry.insert("duration".to_owned(), seconds);
    }
    let entries = Value::Array(vec![Value::Table(entry)]);
    let deck = ddem_io::deck::from_table(&Table::from_iter([("stage".to_owned(), entries)]))
        .map_err(|error| errors::arguments(py, error, "stage[0]"))?;
    Ok(deck.stage.into_iter().next().unwrap_or_default())
}

/// The region that arguments describe.
fn read_where(py: Python<'_>, keys: Option<&Bound<'_, PyDict>>) -> PyResult<Where> {
    let (mut entry, _) = table("remove", keys, &mut no_matter)?;
    entry.entry("where").or_insert_with(|| Value::Table(Table::new()));
    let entries = Value::Array(vec![Value::Table(entry)]);
    let deck = ddem_io::deck::from_table(&Table::from_iter([("remove".to_owned(), entries)]))
        .map_err(|error| errors::arguments(py, error, "remove[0]"))?;
    Ok(deck.remove.into_iter().next().unwrap_or_default().region)
}

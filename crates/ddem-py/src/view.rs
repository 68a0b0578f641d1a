//! Attributes and methods that read a simulation.

use std::ops::Range;

use ddem_core::{Energy, FieldLocation, ModelError};
use ddem_deck::{Deck, Where};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use toml::{Table, Value};

use crate::errors::model_error;
use crate::matter::no_matter;
use crate::simulation::{Inner, PySimulation};
use crate::values::{selector_alone, table, to_python};
use crate::worker::on_worker_thread;
use crate::{arrays, errors, fields};

/// Number of rows of a field that are computed at once for a given array.
const PIECE: usize = 65_536;

#[pymethods]
impl PySimulation {
    /// A field by its name: "displacement", "velocity", "stress", "traction" and all others of the
    /// result files, or "force".
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     Name of the field.
    /// nodes : array of int or mask, optional
    ///     Only these nodes, of a field at nodes.
    /// out : array of float64, optional
    ///     Array for the numbers, for loops that make no new array.
    ///
    /// Returns
    /// -------
    /// array of float64
    ///     `out`, or a new one.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     There is no such field, or `nodes` or `out` is wrong.
    #[pyo3(signature = (name, *, nodes=None, out=None))]
    pub(crate) fn field<'py>(
        &self,
        py: Python<'py>,
        name: &str,
        nodes: Option<&Bound<'py, PyAny>>,
        out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let known = fields::fields(&self.lock(py)?.session);
        let field = fields::field(py, name, &known)?;
        let n_nodes = self.n_nodes(py)?;
        let nodes = nodes.map(|nodes| arrays::nodes(nodes, "nodes", n_nodes)).transpose()?;
        if nodes.is_some() && field.on != FieldLocation::Node {
            let message = format!("`{name}` is not a field at nodes: leave `nodes` out");
            return Err(model_error(py, "nodes", &message, None));
        }
        let mut inner = self.lock(py)?;
        // The measurement uses the threads of the simulation.
        self.read_from(py, &mut inner, |inner| {
            inner.session.simulation_mut().snapshot();
        })?;
        let snapshot = inner.session.simulation_mut().snapshot();
        let (n, components) =
            (nodes.as_ref().map_or(snapshot.len(field.on), Vec::len), field.components);
        let fill = |rows: Range<usize>, numbers: &mut Vec<f64>| {
            numbers.resize(rows.len() * components, 0.0);
            let ((), stopped) = on_worker_thread(py, &self.pool, None, |_| match &nodes {
                None => snapshot.fill(&field, rows, numbers),
                Some(nodes) => {
                    for (&node, numbers) in
                        nodes[rows].iter().zip(numbers.chunks_exact_mut(components))
                    {
                        let node = node as usize;
                        snapshot.fill(&field, node..node + 1, numbers);
                    }
                }
            })?;
            stopped.map_or(Ok(()), Err)
        };
        let mut numbers = Vec::new();
        let Some(out) = out else {
            fill(0..n, &mut numbers)?;
            return arrays::components(py, numbers, components);
        };
        // Pieces avoid a second array of the same size.
        let shape = if components == 1 { vec![n] } else { vec![n, components] };
        for first in (0..n.max(1)).step_by(PIECE) {
            let rows = first..n.min(first + PIECE);
            fill(rows.clone(), &mut numbers)?;
            arrays::fill(out, &numbers, &shape, rows)?;
        }
        Ok(out.clone())
    }

    /// Displacements [m], shape (n_nodes, 3). They may be set, as an initial state in which nothing
    /// has failed that has not failed before. Removed blocks stay where they were.
    #[getter]
    fn displacement<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.field(py, "displacement", None, None)
    }

    #[setter]
    fn set_displacement(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> PyResult<()> {
        drop(self.lock_to_move(py)?);
        let value = arrays::vectors(value, "displacement", &[&[self.n_nodes(py)?, 3]])?;
        self.moved(py, move |simulation| {
            simulation.set_displacements(&value);
            Ok(())
        })
    }

    /// Velocities at the present time [m/s], with the forces that act now, shape (n_nodes, 3). They
    /// may be set; removed blocks stay at rest.
    #[getter]
    fn velocity<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.field(py, "velocity", None, None)
    }

    #[setter]
    fn set_velocity(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> PyResult<()> {
        drop(self.lock_to_move(py)?);
        let value = arrays::vectors(value, "velocity", &[&[self.n_nodes(py)?, 3]])?;
        self.moved(py, move |simulation| {
            simulation.set_velocities(&value);
            Ok(())
        })
    }

    /// Unbalanced force on each node [N], shape (n_nodes, 3): loads and support forces less the internal
    /// ones; zero in equilibrium.
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

    /// The pairs of facing nodes, a structured array of shape (n_pairs,): `point` (between the
    /// nodes of the pair, reference position) [m], `normal` (at the start, from the first node's
    /// block to the other's), `nodes`, `joint` (its number, in sorted order of the names) and the
    /// fields of joints: `displacement` [m], `traction` [Pa], `slip` [m], `opening` [m], `state` (0
    /// bonded, 1 failed in shear, 2 failed in tension), `open`, `released` (a contact has replaced
    /// the joint), `failure_time` [s] (NaN while bonded), `damage`.
    #[getter]
    fn pairs<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let pairs = self.read(py, |inner| fields::pairs(&mut inner.session))?;
        fields::pair_array(py, pairs)
    }

    /// The contacts between blocks that press on each other now, a structured array of shape
    /// (n_contacts,) with one row for each pair of points: `point` (where the force acts) [m],
    /// `force` (on the first of the two blocks, the other gets its opposite) [N], `traction` (force
    /// by area; along the normal it is negative, pressure) [Pa], `normal` (from the first block to
    /// the second), `area` [m²], `gap` (distance of the faces, negative where they overlap) [m],
    /// `slip` (sliding distance since they met, or since the contact replaced their joint) [m],
    /// `sliding` (friction is at its limit), `blocks` (their numbers). It is empty if no blocks are
    /// in contact.
    #[getter]
    fn contacts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let contacts = self.read(py, |inner| inner.session.simulation_mut().contacts())?;
        fields::contact_array(py, &contacts)
    }

    /// Momentum of the whole model now, the sum of m v [kg m/s], shape (3,).
    #[getter]
    fn momentum<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let momentum = self.read(py, |inner| inner.session.simulation_mut().momentum())?;
        arrays::components(py, momentum.to_vec(), 1)
    }

    /// Moment of the momentum about the origin now, the sum of x × m v and of the spins of rigid
    /// blocks [kg m²/s], shape (3,).
    #[getter]
    fn angular_momentum<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let momentum = self.read(py, |inner| inner.session.simulation_mut().angular_momentum())?;
        arrays::components(py, momentum.to_vec(), 1)
    }

    /// Nodes that are selected, in order.
    ///
    #[doc = include_str!("keys/Where.txt")]
    /// Returns
    /// -------
    /// array of int
    ///     Node numbers; empty if there are none.
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     A key does not exist, a value has the wrong type, or a topography does not cover the
    ///     selection.
    #[pyo3(signature = (**keys))]
    fn nodes<'py>(
        &self,
        py: Python<'py>,
        keys: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let selector = {
            let inner = self.lock(py)?;
            read_where(py, keys, inner.session.site().deck())?
        };
        let found = self.read(py, move |inner| {
            let model = inner.session.simulation().model();
            let nodes = selector.nodes(model).map_err(ModelError::from)?;
            Ok(nodes.into_iter().map(i64::from).collect())
        })?;
        let found = found.map_err(|error| errors::arguments(py, error, "where"))?;
        fields::integers(py, found)
    }

    /// The node nearest to a reference position; on a tie the lower number.
    ///
    /// Parameters
    /// ----------
    /// at : (float, float, float)
    ///     Position [m].
    ///
    /// Returns
    /// -------
    /// int
    fn nearest_node(&self, py: Python<'_>, at: &Bound<'_, PyAny>) -> PyResult<usize> {
        let at = arrays::vectors(at, "at", &[&[3]])?;
        let at = at.first().copied().unwrap_or_default();
        self.read(py, move |inner| inner.session.simulation().model().nearest_node(at))
    }

    /// Sum of the support forces on some nodes, as they act on the model.
    ///
    /// Parameters
    /// ----------
    /// nodes : array of int or mask
    ///     Node numbers.
    ///
    /// Returns
    /// -------
    /// array of float64, shape (3,)
    ///     Force [N].
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
        let nodes = arrays::nodes(nodes, "nodes", self.n_nodes(py)?)?;
        let sum = self.read(py, move |inner| inner.session.simulation_mut().reaction(&nodes))?;
        arrays::components(py, sum.to_vec(), 1)
    }

    /// Records of the probes so far: for each a structured array with `time` [s], `step` and the
    /// components: `x`, `y`, `z`; `xx`, `yy`, `zz`, `xy`, `yz`, `zx`; for a single number the name
    /// of the quantity.
    #[getter]
    fn probes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let inner = self.lock(py)?;
        fields::probes(py, &inner)
    }

    /// Title of the model.
    #[getter]
    fn title(&self, py: Python<'_>) -> PyResult<String> {
        Ok(self.lock(py)?.session.site().deck().title.clone())
    }

    /// Number of nodes.
    #[getter]
    pub(crate) fn n_nodes(&self, py: Python<'_>) -> PyResult<usize> {
        Ok(self.lock(py)?.session.simulation().model().n_nodes())
    }

    /// Number of blocks. Cells of regions that are joined are one.
    #[getter]
    fn n_blocks(&self, py: Python<'_>) -> PyResult<usize> {
        Ok(self.lock(py)?.session.simulation().model().n_whole_blocks())
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
        let mut found = f64::NAN;
        self.moved(py, |simulation| {
            found = simulation.critical_step()?;
            Ok(())
        })?;
        Ok(found)
    }

    /// Unbalanced force ratio at the last step.
    #[getter]
    fn unbalanced(&self, py: Python<'_>) -> PyResult<f64> {
        Ok(self.lock(py)?.session.simulation().unbalanced())
    }

    /// Energies of the whole model [J], by name, with their balance: the columns of ``energy.csv``.
    /// During a run `kinetic` is ½ v⁻·m v⁺ of the half steps before and after; it may be negative
    /// if blocks vibrate. At the end of a run velocities are those of the present time.
    #[getter]
    fn energy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let energy = self.read(py, |inner| inner.session.simulation_mut().energy())?;
        let named = PyDict::new(py);
        for (name, value) in Energy::NAMES.iter().zip(energy.values()) {
            named.set_item(name, value)?;
        }
        Ok(named)
    }

    /// Summary of the run so far: the contents of `summary.json`.
    #[getter]
    fn summary<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let summary = self.read(py, |inner| inner.session.summary())?;
        to_python(py, &summary)
    }
}

impl PySimulation {
    /// Reads from the simulation.
    pub(crate) fn read<T: Send>(
        &self,
        py: Python<'_>,
        access: impl FnOnce(&mut Inner) -> T + Send,
    ) -> PyResult<T> {
        self.read_from(py, &mut *self.lock(py)?, access)
    }

    fn read_from<T: Send>(
        &self,
        py: Python<'_>,
        inner: &mut Inner,
        access: impl FnOnce(&mut Inner) -> T + Send,
    ) -> PyResult<T> {
        self.work(py, inner, None, |inner, _| Ok(access(inner)), |error: PyErr| error)
    }
}

/// `where` that the arguments describe.
fn read_where(py: Python<'_>, keys: Option<&Bound<'_, PyDict>>, deck: &Deck) -> PyResult<Where> {
    let (mut entry, _) = table("remove", keys, &mut no_matter)?;
    let mut selector = match entry.remove("where") {
        Some(Value::Table(selector)) => selector,
        Some(other) => Table::from_iter([("where".to_owned(), other)]),
        None => Table::new(),
    };
    // Other keys of the section become unknown keys of `where`.
    selector.extend(entry);
    let deck = selector_alone(py, selector, deck)?;
    Ok(deck.remove.into_iter().next().unwrap_or_default().r#where)
}

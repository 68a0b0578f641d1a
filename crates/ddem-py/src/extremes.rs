//! Peak values and fragments of a run.

use pyo3::prelude::*;

use crate::fields;
use crate::simulation::PySimulation;

#[pymethods]
impl PySimulation {
    /// Largest speed of each node since the start of the run [m/s], shape (n_nodes,): the peak particle
    /// velocity. Only of a model with ``peaks=True``.
    #[getter]
    fn peak_velocity<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.field(py, "peak_velocity", None, None)
    }

    /// Largest principal tension at the centre of each element since the start of the run [Pa], 0 or
    /// more, shape (n_elements,). Only of a model with ``peaks=True``.
    #[getter]
    fn peak_tension<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.field(py, "peak_tension", None, None)
    }

    /// Largest principal compression at the centre of each element since the start of the run [Pa], 0
    /// or more, shape (n_elements,). Only of a model with ``peaks=True``.
    #[getter]
    fn peak_compression<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.field(py, "peak_compression", None, None)
    }

    /// The present fragments, each a group of blocks that unbroken joints hold together, as a
    /// structured array of shape (n_fragments,). It is sorted by decreasing volume, equal volumes
    /// by the lowest block. Its fields are `blocks` (number), `volume` (of the blocks at the start)
    /// [m³], `mass` (with half of that of the joints around each block) [kg], `size` (edge of a
    /// cube of that volume) [m], `passing` (part of all mass in fragments that are no larger),
    /// `centroid` (now) [m], `velocity` [m/s].
    #[getter]
    fn fragments<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let fragments = self.read(py, |inner| inner.session.simulation_mut().fragments())?;
        fields::fragment_array(py, &fragments)
    }

    /// The number of the fragment of each block, a row of :attr:`fragments`, shape (largest number
    /// of a block + 1,). If an excavation leaves two parts of a block of joined cells, it is the
    /// larger fragment; the field "fragment" has both. Removed blocks have the number after the last.
    #[getter]
    fn block_fragment<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let numbers = self.read(py, |inner| fields::block_fragments(&mut inner.session))?;
        fields::integers(py, numbers)
    }
}

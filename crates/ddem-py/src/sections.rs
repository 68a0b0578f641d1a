//! Methods of a model that write entries of its deck, one for each section.

use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::model::PyModel;

#[pymethods]
impl PyModel {
    /// Adds a lattice of blocks, divided by joint planes, or blocks of a mesh.
    ///
    #[doc = include_str!("keys/BlockSet.txt")]
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     A key that does not exist or a value of the wrong type.
    #[pyo3(signature = (**keys))]
    fn add_blocks(&self, py: Python<'_>, keys: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        self.add(py, "blocks", None, keys)
    }

    /// Adds a part of the rock, which cuts divide into blocks.
    ///
    #[doc = include_str!("keys/RockRegion.txt")]
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     A key that does not exist or a value of the wrong type.
    #[pyo3(signature = (**keys))]
    fn add_region(&self, py: Python<'_>, keys: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        self.add(py, "region", None, keys)
    }

    /// Cuts the regions. Cuts act in the order of the calls. :meth:`cells` has the blocks.
    ///
    #[doc = include_str!("keys/RockCut.txt")]
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     A key that does not exist or a value of the wrong type.
    #[pyo3(signature = (**keys))]
    fn cut(&self, py: Python<'_>, keys: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        self.add(py, "cut", None, keys)
    }

    /// Leaves joints of regions out: the cells on their sides are one block there.
    ///
    #[doc = include_str!("keys/Join.txt")]
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     A key that does not exist or a value of the wrong type.
    #[pyo3(signature = (**keys))]
    fn join(&self, py: Python<'_>, keys: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        self.add(py, "join", None, keys)
    }

    /// Sets the properties of contacts between blocks. A later call replaces an earlier one.
    ///
    #[doc = include_str!("keys/ContactTable.txt")]
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     A key that does not exist or a value of the wrong type.
    #[pyo3(signature = (**keys))]
    fn contact(&self, py: Python<'_>, keys: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        self.set(py, "contact", keys)
    }

    /// Silences warnings by their codes. A later call replaces an earlier one.
    ///
    #[doc = include_str!("keys/LintTable.txt")]
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     A key that does not exist or a value of the wrong type.
    #[pyo3(signature = (**keys))]
    fn lint(&self, py: Python<'_>, keys: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        self.set(py, "lint", keys)
    }

    /// Sets how :func:`run_deck` writes results. A later call replaces an earlier one.
    ///
    #[doc = include_str!("keys/OutputTable.txt")]
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     A key that does not exist or a value of the wrong type.
    #[pyo3(signature = (**keys))]
    fn output(&self, py: Python<'_>, keys: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        self.set(py, "output", keys)
    }

    /// Assigns another joint or material to a part of the model; later calls take precedence.
    ///
    #[doc = include_str!("keys/Assign.txt")]
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     A key that does not exist or a value of the wrong type.
    #[pyo3(signature = (**keys))]
    fn assign(&self, py: Python<'_>, keys: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        self.add(py, "assign", None, keys)
    }

    /// Removes blocks, from a stage on if `from_` names one.
    ///
    #[doc = include_str!("keys/Remove.txt")]
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     A key that does not exist or a value of the wrong type.
    #[pyo3(signature = (**keys))]
    fn remove(&self, py: Python<'_>, keys: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        self.add(py, "remove", None, keys)
    }

    /// Splits blocks along each edge. Later calls may split the parts again. Joints between split
    /// and other blocks are nonconforming and consist of springs.
    ///
    #[doc = include_str!("keys/Refine.txt")]
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     A key that does not exist or a value of the wrong type.
    #[pyo3(signature = (**keys))]
    fn refine(&self, py: Python<'_>, keys: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        self.add(py, "refine", None, keys)
    }

    /// Supports nodes, at rest or driven.
    ///
    #[doc = include_str!("keys/Fix.txt")]
    ///
    /// A function as `history` receives the time [s] since the entry came into force (a charge:
    /// since it detonated). It is called at every step, and must depend on the time only.
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     A key that does not exist or a value of the wrong type.
    #[pyo3(signature = (axes, **keys))]
    fn fix(
        &self,
        py: Python<'_>,
        axes: &Bound<'_, PyAny>,
        keys: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<()> {
        self.add(py, "fix", Some(("axes", axes)), keys)
    }

    /// Loads a part of the model, by one of `traction`, `pressure`, `line` and `force`.
    ///
    #[doc = include_str!("keys/Load.txt")]
    ///
    /// A function as `history` receives the time [s] since the entry came into force (a charge:
    /// since it detonated). It is called at every step, and must depend on the time only.
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     A key that does not exist or a value of the wrong type.
    #[pyo3(signature = (**keys))]
    fn load(&self, py: Python<'_>, keys: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        self.add(py, "load", None, keys)
    }

    /// Adds a charge: gas that pushes the walls of a cavity apart, or the sides of joints.
    ///
    #[doc = include_str!("keys/Charge.txt")]
    ///
    /// A function as `history` receives the time [s] since the entry came into force (a charge:
    /// since it detonated). It is called at every step, and must depend on the time only.
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     A key that does not exist or a value of the wrong type.
    #[pyo3(signature = (**keys))]
    fn charge(&self, py: Python<'_>, keys: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        self.add(py, "charge", None, keys)
    }

    /// Adds a boundary that absorbs waves, as rock behind it would.
    ///
    /// It carries no load at rest. If a support ends where a boundary is, its reaction stays as a constant force.
    ///
    #[doc = include_str!("keys/Boundary.txt")]
    ///
    /// A function as `history` receives the time [s] since the entry came into force (a charge:
    /// since it detonated). It is called at every step, and must depend on the time only.
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     A key that does not exist or a value of the wrong type.
    #[pyo3(signature = (kind, **keys))]
    fn boundary(
        &self,
        py: Python<'_>,
        kind: &Bound<'_, PyAny>,
        keys: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<()> {
        self.add(py, "boundary", Some(("kind", kind)), keys)
    }

    /// Sets the initial motion and stress.
    ///
    #[doc = include_str!("keys/Initial.txt")]
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     A key that does not exist or a value of the wrong type.
    #[pyo3(signature = (**keys))]
    fn initial(&self, py: Python<'_>, keys: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        self.add(py, "initial", None, keys)
    }

    /// Adds a stage, which :func:`run_deck` and the command line run in order.
    ///
    /// :meth:`Simulation.relax` and :meth:`Simulation.run` run stages, too, and :meth:`Simulation.enter` brings the supports
    /// and loads of a stage into force.
    ///
    #[doc = include_str!("keys/Stage.txt")]
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     A key that does not exist or a value of the wrong type.
    #[pyo3(signature = (name, **keys))]
    fn stage(
        &self,
        py: Python<'_>,
        name: &Bound<'_, PyAny>,
        keys: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<()> {
        self.add(py, "stage", Some(("name", name)), keys)
    }

    /// Records a quantity during a run. Peaks need ``Model(peaks=True)``.
    ///
    #[doc = include_str!("keys/Probe.txt")]
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     A key that does not exist or a value of the wrong type.
    #[pyo3(signature = (name, **keys))]
    fn probe(
        &self,
        py: Python<'_>,
        name: &Bound<'_, PyAny>,
        keys: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<()> {
        self.add(py, "probe", Some(("name", name)), keys)
    }
}

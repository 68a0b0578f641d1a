//! Mesh of a simulation: its arrays, and a PyVista grid.

use ddem_core::FieldLocation;
use numpy::PyArray1;
use pyo3::prelude::*;

use crate::simulation::PySimulation;
use crate::{arrays, fields};

#[pymethods]
impl PySimulation {
    /// The present state as a PyVista grid for filters and pictures; it is a copy.
    /// Its fields have the names of the result files.
    ///
    /// Parameters
    /// ----------
    /// part : {"blocks", "joints", "contacts"}, optional
    ///     Hexahedra of the blocks, quadrilaterals of the joints, or a point for each contact.
    ///
    /// Returns
    /// -------
    /// pyvista.UnstructuredGrid
    ///     The grid is at the reference positions, contacts are at their present positions;
    ///     ``mesh.warp_by_vector("displacement")`` gives the moved grid. Removed blocks are left
    ///     out: `node` and `element`, or `pair` and `quad`, are the rows of the simulation's own
    ///     arrays.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     No such part.
    /// ImportError
    ///     PyVista is not installed.
    #[pyo3(signature = (part = "blocks"))]
    fn mesh<'py>(slf: &Bound<'py, Self>, part: &str) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("ddem._mesh")?.call_method1("mesh_of", (slf, part))
    }

    /// Reference positions of the nodes [m], shape (n_nodes, 3).
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::rows(py, self.read(py, |inner| fields::points(&inner.session))?)
    }

    /// Lumped masses of the nodes [kg], shape (n_nodes,).
    #[getter]
    fn mass<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::components(py, self.read(py, |inner| fields::masses(&inner.session))?, 1)
    }

    /// The block of each node, shape (n_nodes,).
    #[getter]
    fn node_block<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        fields::integers(py, self.read(py, |inner| fields::node_blocks(&inner.session))?)
    }

    /// The nodes of each element, in VTK's order, shape (n_elements, 8).
    #[getter]
    fn elements<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::rows(py, self.read(py, |inner| fields::elements(&inner.session))?)
    }

    /// The block of each element, shape (n_elements,).
    #[getter]
    fn element_block<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        fields::integers(py, self.read(py, |inner| fields::element_blocks(&inner.session))?)
    }

    /// The pairs around each joint element, shape (n_quads, 4).
    #[getter]
    fn quads<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::rows(py, self.read(py, |inner| fields::quads(&inner.session))?)
    }

    /// The material of each element, shape (n_elements,): numbers in sorted order of the names.
    #[getter]
    fn element_material<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        fields::integers(py, self.read(py, |inner| fields::element_materials(&inner.session))?)
    }

    /// True for elements that are rigid blocks, which have no stress, shape (n_elements,).
    #[getter]
    fn element_rigid<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let rigid = self.read(py, |inner| fields::element_rigid(&inner.session))?;
        Ok(PyArray1::from_vec(py, rigid).into_any())
    }

    /// Names of the fields at nodes, and of elements.
    #[getter]
    fn _fields(&self, py: Python<'_>) -> PyResult<[Vec<&'static str>; 2]> {
        let fields = fields::fields(&self.lock(py)?.session);
        Ok([FieldLocation::Node, FieldLocation::Element].map(|on| {
            fields.iter().filter(|field| field.on == on).map(|field| field.name).collect()
        }))
    }
}

//! The methods of a model that write entries of its deck, one for each section.

use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::model::PyModel;

#[pymethods]
impl PyModel {
    /// Adds a lattice of blocks divided by joint planes.
    ///
    /// Parameters
    /// ----------
    /// material : Material or str
    ///     What the blocks are of; a name is that of a material the model has already.
    /// size : (float, float, float), optional
    ///     Length of the three edges of the whole set [m].
    /// count : (int, int, int), optional
    ///     Blocks along the three edges; one without it.
    /// edges : dict, optional
    ///     Uneven cuts [m], as in ``{"x": [0, 1, 2.5]}``, for which `size` and `count` are not
    ///     needed.
    /// divisions : int, optional
    ///     Elements along each edge of a deformable block; 4 without it.
    /// joint : Joint, str or dict, optional
    ///     Between the blocks; a dict gives one for each normal, ``{"x": a, "z": b}``.
    /// name : str, optional
    ///     For ``set="name"`` in other calls.
    /// origin : (float, float, float), optional
    ///     The corner from which edges are measured [m].
    /// axes : three vectors, optional
    ///     Directions of the three edges; oblique ones give parallelepipeds.
    /// dip, dip_direction : float, optional
    ///     Instead of `axes`, of the joints that cut the third edge [degrees], clockwise from north, y.
    /// planes : dict, optional
    ///     Instead of `axes`, of all three sets of joints:
    ///     ``{"x": {"dip": ..., "dip_direction": ...}, "y": ..., "z": ...}``.
    /// mesh : dict, optional
    ///     Blocks as hexahedra of another program, instead of a lattice: ``nodes`` of shape (n, 3) [m], ``hexes`` of
    ///     shape (m, 8) in VTK's order, ``blocks`` of shape (m,), the block of each hexahedron, and ``joints``, a list
    ///     of ``{"faces": ((a, b, c, d), (e, f, g, h)), "joint": ...}``. Each block is a parallelepiped, divided evenly.
    /// body : {"deformable", "rigid"}, optional
    ///     What the blocks are; rigid ones have eight nodes, six degrees of freedom and no stress.
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     A key that does not exist or a value of the wrong type.
    #[pyo3(signature = (**keys))]
    fn add_blocks(&self, py: Python<'_>, keys: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        self.add(py, "blocks", None, keys)
    }

    /// Says what blocks do where they meet and no joint is between them. What is left out follows
    /// from the two faces that meet; what an earlier call has said is forgotten.
    ///
    /// Parameters
    /// ----------
    /// normal_stiffness, shear_stiffness : float, optional
    ///     Of all contacts [Pa/m]; those of the two faces in series without them.
    /// friction : float, optional
    ///     [degrees]; without it the smaller angle that failure leaves to the joints of the two
    ///     faces, 30 where neither has a joint that can fail.
    /// damping : float, optional
    ///     Of contacts and failed pairs, and of the deformation of the blocks around them, as a
    ///     fraction of critical, from 0 to 1; 0.2 without it, or 0 in a model with charges.
    /// restitution : float, optional
    ///     Instead of `damping`: the part of the speed with which two blocks rebound, from 0 to 1.
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     A key that does not exist or a value of the wrong type.
    #[pyo3(signature = (**keys))]
    fn contact(&self, py: Python<'_>, keys: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        self.set(py, "contact", keys)
    }

    /// Silences diagnostics by their codes; a later call replaces an earlier one.
    ///
    /// Parameters
    /// ----------
    /// allow : list of str
    ///     Codes, as in "far-probe": the last word of each warning, in brackets.
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     A code that does not exist.
    #[pyo3(signature = (**keys))]
    fn lint(&self, py: Python<'_>, keys: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        self.set(py, "lint", keys)
    }

    /// Gives a part of the model another joint or material; later calls win.
    ///
    /// Parameters
    /// ----------
    /// joint : Joint or str, optional
    ///     For the joints whose face centre lies inside.
    /// material : Material or str, optional
    ///     For the blocks whose centroid lies inside.
    /// x, y, z, sphere, cylinder, plane, above, below, inside, side, set : optional
    ///     Where.
    /// dip, dip_direction, within : float, optional
    ///     Joints of this orientation, within an angle [degrees]; 2 without it.
    /// from_, until : str, optional
    ///     Stages from whose start, and up to whose start, it is in force; always without them.
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     A key that does not exist or a value of the wrong type.
    #[pyo3(signature = (**keys))]
    fn assign(&self, py: Python<'_>, keys: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        self.add(py, "assign", None, keys)
    }

    /// Takes out the blocks whose centroid lies inside.
    ///
    /// Parameters
    /// ----------
    /// x, y, z, sphere, cylinder, plane, above, below, inside, side, set : optional
    ///     Where.
    /// from_ : str, optional
    ///     Stage at whose start they go, an excavation; without it they were never there.
    /// release : float, optional
    ///     Time in which the forces that they exerted on the rest go to zero linearly [s], in a relax
    ///     stage in its `increments`; at once without it.
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     A key that does not exist or a value of the wrong type.
    #[pyo3(signature = (**keys))]
    fn remove(&self, py: Python<'_>, keys: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        self.add(py, "remove", None, keys)
    }

    /// Splits the blocks whose centroid lies inside into smaller ones. Later calls may split these
    /// again. Where they meet other blocks their joints are springs between faces that do not match.
    ///
    /// Parameters
    /// ----------
    /// factor : int
    ///     Parts along each edge, at least 2.
    /// x, y, z, sphere, cylinder, plane, above, below, inside, side, set : optional
    ///     Where.
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     A key that does not exist or a value of the wrong type.
    #[pyo3(signature = (**keys))]
    fn refine(&self, py: Python<'_>, keys: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        self.add(py, "refine", None, keys)
    }

    /// Holds nodes, or drives them.
    ///
    /// Parameters
    /// ----------
    /// axes : str
    ///     Which of "xyz".
    /// velocity : (float, float, float), optional
    ///     Of the named axes [m/s]; at rest without it.
    /// displacement : (float, float, float), optional
    ///     Of the named axes [m], instead of `velocity`: they go there by the increments of the
    ///     relaxation with which the support comes into force.
    /// history : callable, dict or rows, optional
    ///     Factor on the velocity in time [s]: a function of the time since the support came into
    ///     force, ``{"ramp": seconds}``, or rows of time and factor.
    /// x, y, z, sphere, cylinder, plane, above, below, inside, side, set : optional
    ///     Where; every node without any.
    /// from_, until : str, optional
    ///     Stages from whose start, and up to whose start, it is in force.
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
    /// Parameters
    /// ----------
    /// traction : (float, float, float), optional
    ///     On the outer faces selected [Pa].
    /// pressure : float, optional
    ///     On the outer faces selected, inward positive [Pa].
    /// line : (float, float, float), optional
    ///     Along the selected line [N/m].
    /// force : (float, float, float), optional
    ///     In all, shared by the selected nodes [N].
    /// history : callable, dict or rows, optional
    ///     Factor in time [s]: a function of the time since the load came into force,
    ///     ``{"ramp": seconds}``, or rows of time and factor. A function is called at every step,
    ///     and must depend on the time alone.
    /// x, y, z, sphere, cylinder, plane, above, below, inside, side, set : optional
    ///     Where.
    /// from_, until : str, optional
    ///     Stages from whose start, and up to whose start, it is in force.
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     A key that does not exist or a value of the wrong type.
    #[pyo3(signature = (**keys))]
    fn load(&self, py: Python<'_>, keys: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        self.add(py, "load", None, keys)
    }

    /// Adds a charge: gas that pushes the walls of a cavity apart, or the sides of joints. One of `mass`, with
    /// `explosive`, and `pressure`.
    ///
    /// Parameters
    /// ----------
    /// mass : float, optional
    ///     Of the explosive [kg].
    /// explosive : str or dict, optional
    ///     "tnt", "anfo", "emulsion", or ``{"density": ..., "detonation_velocity": ..., "gamma": ...}``.
    /// pressure : float, optional
    ///     Its peak [Pa].
    /// gamma : float, optional
    ///     Adiabatic index of the gas where `pressure` is given.
    /// history : "gas", callable, dict or rows, optional
    ///     Adiabatic expansion, or a factor on the pressure in time [s] as for :meth:`load`; "gas" with `mass`,
    ///     constant with `pressure`. A function is one of the time since it went off.
    /// delay : float, optional
    ///     When it goes off, from the start of the stage `from_`, or of the run [s].
    /// x, y, z, sphere, cylinder, plane, above, below, inside, side, set : optional
    ///     Walls of cavities by the centres of their faces; where there is none, joints.
    /// from_, until : str, optional
    ///     Stages from whose start, and up to whose start, it is in force.
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     A key that does not exist or a value of the wrong type.
    #[pyo3(signature = (**keys))]
    fn charge(&self, py: Python<'_>, keys: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        self.add(py, "charge", None, keys)
    }

    /// Adds a boundary behind which the rock goes on, so that waves leave.
    ///
    /// It holds nothing at rest; what a support bore that ends where a boundary is goes on as
    /// constant forces.
    ///
    /// Parameters
    /// ----------
    /// kind : {"viscous", "free-field"}
    ///     Dashpots of Lysmer and Kuhlemeyer, or upright sides of a model that is shaken from below.
    /// velocity : (float, float, float), optional
    ///     Of a wave that comes in through viscous faces [m/s]; a free surface moves twice as fast.
    /// history : callable, dict or rows, optional
    ///     Factor on the velocity in time [s], as for :meth:`fix`.
    /// x, y, z, sphere, cylinder, plane, above, below, inside, side, set : optional
    ///     Which outer faces; all of them without any.
    /// from_, until : str, optional
    ///     Stages from whose start, and up to whose start, it is in force.
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

    /// Sets the motion and the stress at the start.
    ///
    /// Parameters
    /// ----------
    /// velocity : (float, float, float), optional
    ///     [m/s].
    /// spin : (float, float, float), optional
    ///     Angular velocity about `centre` [rad/s], added to `velocity`.
    /// centre : (float, float, float), optional
    ///     [m]; the origin without it.
    /// stress : array of 6, optional
    ///     Stress at the origin in deformable blocks and their joints [Pa]: xx, yy, zz, xy, yz, zx,
    ///     tension positive.
    /// gradient : dict, optional
    ///     Change of the stress along axes, ``{"z": (xx, yy, zz, xy, yz, zx)}`` [Pa/m].
    /// x, y, z, sphere, cylinder, plane, above, below, inside, side, set : optional
    ///     Where; every node without any.
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     A key that does not exist or a value of the wrong type.
    #[pyo3(signature = (**keys))]
    fn initial(&self, py: Python<'_>, keys: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        self.add(py, "initial", None, keys)
    }

    /// Adds a stage of the deck, which :func:`run_deck` and the command line run in order. A
    /// simulation moves by :meth:`Simulation.relax` and :meth:`Simulation.run` as well, and
    /// :meth:`Simulation.enter` brings the supports and loads of a stage into force.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     For `from_` and `until`.
    /// kind : {"relax", "dynamic", "safety"}
    ///     Static, in time, or a search for the factor of safety; its keys are those of
    ///     :meth:`Simulation.relax`, :meth:`Simulation.run` and :func:`factor_of_safety`.
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

    /// Records something as a run goes.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     Column in `probes.csv`, and key of :attr:`Simulation.probes`.
    /// at : (float, float, float), optional
    ///     The node nearest to this reference position [m].
    /// quantity : {"displacement", "velocity", "stress", "reaction", "fragment", "peak_velocity", "peak_tension", "peak_compression"}, optional
    ///     Displacement without it. Peaks need ``Model(peaks=True)``.
    /// every : float, optional
    ///     Time between samples [s]; a thousandth of a run without it.
    /// every_steps : int, optional
    ///     Steps between samples in a relaxation; 100 without it.
    /// x, y, z, sphere, cylinder, plane, above, below, inside, side, set : optional
    ///     Instead of `at`: the sum of reactions, the mean of anything else.
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

"""Pictures: positions, meaning of colours, and picture files."""

import numpy as np
import pytest
from ddem import _layers, _scene
from ddem._plot import plot

pv = pytest.importorskip("pyvista")
pytest.importorskip("plotly")


# --- positions ---


def test_blocks_are_drawn_at_displaced_positions(drawn, simulation):
    mesh = drawn(scale=100.0)["blocks"]
    moved = simulation.points + 100.0 * simulation.displacement
    assert np.allclose(mesh.points, moved[mesh["node"]], rtol=0, atol=1e-6)
    assert np.isclose(mesh.bounds[5], moved[:, 2].max(), atol=1e-6)
    assert mesh.bounds[5] > 1.19


def test_only_faces_inside_blocks_are_omitted(drawn):
    mesh = drawn()["blocks"]
    assert mesh.n_cells == 4 * 6 * 2 * 2
    assert np.isclose(drawn(scale=0.0)["blocks"].area, 4 * 6.0)


def test_edges_are_those_of_blocks_or_elements(drawn):
    assert drawn(edges="blocks")["edges"].n_cells == 4 * 12 * 2
    # 3 lines of 2 edges in 2 directions on 6 faces; lines on the twelve edges belong to two faces.
    assert drawn(edges="elements")["edges"].n_cells == 4 * (6 * 12 - 12 * 2)
    assert "edges" not in drawn(edges="none")


def test_face_normals_point_outward(simulation):
    faces, owners = _scene.skin(simulation.elements)
    at = simulation.points[faces]
    normal = np.cross(at[:, 2] - at[:, 0], at[:, 3] - at[:, 1])
    inside = simulation.points[simulation.elements[owners]].mean(axis=1)
    assert (((at.mean(axis=1) - inside) * normal).sum(axis=1) > 0).all()


@pytest.mark.parametrize(
    ("most", "scale"),
    [(0.002, 100.0), (0.003, 50.0), (1e-9, 2e8), (0.15, 1.0), (0.2, 1.0), (7.0, 1.0), (0.0, 1.0)],
)
def test_automatic_scale_is_a_round_factor(most, scale):
    points = np.array([[0.0, 0.0, 0.0], [4.0, 1.0, 1.0]])
    assert _scene.automatic_scale(points, np.array([[0.0, 0.0, -most], [0.0, 0.0, 0.0]])) == scale


# --- meaning of colours ---


def test_adjacent_fragments_have_different_colours():
    import ddem

    rock = ddem.Material(density=2400, young=18e9, poisson=0.25)
    stiff = {"normal_stiffness": 1e10, "shear_stiffness": 1e10}
    holds, fails = ddem.Joint(**stiff), ddem.Joint(**stiff, friction=30)
    model = ddem.Model(contact=False)
    n = 6
    model.add_blocks(
        size=(n, n, n), count=(n, n, n), divisions=2, material=rock, joint=fails, name="rock"
    )
    model.assign(joint=holds, x=(0, n), y=(0, n), z=(0.1, 1.9))
    model.fix("xyz", z=0.0)
    simulation = model.build()
    fragment = simulation.block_fragment
    assert len(simulation.fragments) == 1 + 4 * n * n
    plotter = plot(simulation, "fragment", show=False)
    mesh = plotter.actors["blocks"].mapper.dataset
    colour = np.full(n**3, -1.0)
    block = simulation.element_block[mesh["element"]]
    colour[block] = mesh.cell_data["colour of the fragment"]
    assert not plotter.scalar_bars
    plotter.close()
    outside = colour >= 0
    assert ((colour == 0) == (fragment == 0))[outside].all()
    # Blocks inside have no visible face, so the colours of all blocks are requested.
    frame = _scene.scene_of(simulation, -1, False)
    number = simulation.block_fragment[simulation.element_block]
    all_colours = _scene.apart(frame, number, 11)
    assert np.array_equal(all_colours[fragment][outside], colour[outside])
    cube = all_colours[fragment].reshape(n, n, n)
    which = fragment.reshape(n, n, n)
    for axis in range(3):
        apart = np.diff(which, axis=axis) != 0
        assert apart.any() and (np.diff(cube, axis=axis)[apart] != 0).all()
    # Every colour is used.
    assert set(np.unique(cube)) == set(range(12))
    # With a colour map the fragment number is the value.
    plotter = plot(simulation, "fragment", cmap="viridis", show=False)
    mesh = plotter.actors["blocks"].mapper.dataset
    assert np.array_equal(mesh.cell_data["fragment"], number[mesh["element"]])
    plotter.close()


@pytest.mark.parametrize("name", ["displacement", "velocity", "force"])
def test_nodal_values_equal_the_field_exactly(drawn, simulation, name):
    unit = {"displacement": "m", "velocity": "m/s", "force": "N"}[name]
    mesh = drawn(name, component="z")["blocks"]
    exact = getattr(simulation, name)[mesh["node"], 2]
    assert np.array_equal(mesh.point_data[f"{name} z ({unit})"], exact)


def test_stresses_equal_the_elements_exactly(drawn, simulation):
    mesh = drawn("stress", component="yz")["blocks"]
    assert np.array_equal(mesh.cell_data["stress yz (Pa)"], simulation.stress[mesh["element"], 4])


def test_user_arrays_colour_nodes_and_elements(drawn, simulation):
    nodal = np.arange(len(simulation.points))
    mesh = drawn(nodal, label="age (years)")["blocks"]
    assert np.array_equal(mesh.point_data["age (years)"], nodal[mesh["node"]])
    mesh = drawn(simulation.element_block == 2)["blocks"]
    assert mesh.cell_data["values"].sum() == 6 * 2 * 2


def test_stress_measures_are_exact():
    # Pure shear: von Mises √3 τ, principal stresses ±τ.
    shear = np.array([[0.0, 0.0, 0.0, 5.0, 0.0, 0.0]])
    uniaxial = np.array([[0.0, 0.0, -7.0, 0.0, 0.0, 0.0]])
    both = np.concatenate([shear, uniaxial])
    assert np.allclose(_scene.measure(both, "von_mises")[0], [5.0 * np.sqrt(3.0), 7.0])
    for part, exact in (("s1", [5.0, 0.0]), ("s2", [0.0, 0.0]), ("s3", [-5.0, -7.0])):
        assert np.allclose(_scene.measure(both, part)[0], exact, atol=1e-12)
    # Principal values 3, 1, -2, rotated about an axis in general position.
    turned, _ = np.linalg.qr([[1.0, 2.0, 3.0], [0.0, 1.0, 4.0], [5.0, 6.0, 0.0]])
    full = turned @ np.diag([3.0, 1.0, -2.0]) @ turned.T
    stress = full[[0, 1, 2, 0, 1, 2], [0, 1, 2, 1, 2, 0]][None]
    for part, exact in (("s1", 3.0), ("s2", 1.0), ("s3", -2.0), ("von_mises", np.sqrt(19.0))):
        assert np.allclose(_scene.measure(stress, part)[0], exact)


def test_signed_values_have_bar_symmetric_about_zero(simulation):
    frame = _scene.scene_of(simulation, -1, False)
    bar = _layers.blocks(frame, "stress", "xx", None, (None, None), 1.0, "none", 1.0)[0].bar
    assert bar.cmap.name == "RdBu_r"
    assert bar.clim[0] == -bar.clim[1]
    bar = _layers.blocks(frame, "mass", None, None, (None, (0.0, 3.0)), 1.0, "none", 1.0)[0].bar
    assert (bar.cmap.name, bar.clim) == ("viridis", (0.0, 3.0))


# --- joints ---


def test_each_joint_state_has_its_layer(drawn, simulation):
    meshes = drawn(joints="state", scale=10.0)
    for joint, name in enumerate(("bonded", "failed in shear", "failed in tension")):
        mesh = meshes[name]
        assert mesh.n_cells == 4 * 4
        assert np.isclose(mesh.area, 1.0)
        z = 10.0 * 0.002 * np.sin(joint + 1.0)
        assert np.allclose(mesh.bounds, [joint + 1, joint + 1, 0, 1, z, 1 + z], atol=1e-6)
    assert meshes["blocks"].array_names == ["node", "element"]


def test_joint_face_shows_state_of_each_pair(drawn, simulation):
    simulation.pairs["state"] = 0
    simulation.pairs["state"][4] = 1  # the middle of the face at x = 1
    mesh = drawn(joints="state", scale=0.0)["failed in shear"]
    assert np.allclose(mesh.bounds, [1, 1, 0.25, 0.75, 0.25, 0.75])


def test_joint_fields_show_failed_pairs(drawn, simulation):
    mesh = drawn(joints="failure_time")["joints"]
    assert np.allclose(np.unique(mesh.cell_data["failure time (s)"]), [0.1, 0.2])
    mesh = drawn(joints="slip", joint_component="y")["joints"]
    assert np.allclose(np.unique(mesh.cell_data["slip y (m)"]), [0.01, 0.02])
    mesh = drawn(joints="traction", joint_component="x")["joints"]
    values = simulation.pairs["traction"][simulation.quads.reshape(-1), 0]
    assert np.array_equal(mesh.cell_data["traction x (Pa)"], values)


def test_model_without_failure_is_drawn(drawn, simulation):
    simulation.pairs["state"] = 0
    simulation.pairs["failure_time"] = np.nan
    meshes = drawn(joints="failure_time")
    assert "joints" not in meshes
    assert meshes["bonded"].n_cells == 3 * 4 * 4


def test_blocks_and_joints_are_both_coloured(drawn):
    meshes = drawn("stress", component="s1", joints="slip")
    assert "stress s1 (Pa)" in meshes["blocks"].cell_data
    assert "slip magnitude (m)" in meshes["joints"].cell_data


# --- files ---


def colours(path):
    """Number of colours of an image, without the greys of smoothed letters."""
    image = pv.read(path).active_scalars[:, :3].astype(int)
    return len(np.unique(image[np.ptp(image, axis=1) > 24], axis=0))


def test_screenshot_is_not_blank(simulation, tmp_path):
    plot(simulation, screenshot=tmp_path / "u.png", window_size=(600, 450))
    image = pv.read(tmp_path / "u.png")
    assert image.dimensions[:2] == (600, 450)
    assert colours(tmp_path / "u.png") > 100


def test_screenshot_has_colours_of_joint_states(simulation, tmp_path):
    file = tmp_path / "joints.png"
    plot(simulation, joints="state", opacity=0.0, edges="none", screenshot=file)
    image = pv.read(file).active_scalars[:, :3].astype(int)
    counts = [(image[:, strong] - image[:, weak] > 60).sum() for strong, weak in ((0, 2), (2, 0))]
    assert min(counts) > 2000  # red and blue


def test_translucent_blocks_are_visible(simulation, tmp_path):
    file = tmp_path / "clear.png"
    plot(simulation, joints="state", edges="none", opacity=0.5, screenshot=file)
    image = pv.read(file).active_scalars[:, :3].astype(int)
    assert (image.sum(axis=1) < 720).mean() > 0.1


def test_writing_files_leaves_no_plotter(simulation, tmp_path):
    before = len(pv.plotting._ALL_PLOTTERS)
    plot(simulation, screenshot=tmp_path / "a.png", html=tmp_path / "a.html")
    with pytest.raises(ValueError):
        plot(simulation, screenshot=tmp_path / "a.nothing")
    assert len(pv.plotting._ALL_PLOTTERS) == before

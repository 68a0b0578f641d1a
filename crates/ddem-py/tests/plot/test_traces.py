"""Traces of joints on the outer faces, and moving blocks."""

import ddem
import numpy as np
import pytest
from ddem._plot import plot
from sample_models import ROCK, refused

pv = pytest.importorskip("pyvista")
pytest.importorskip("plotly")

STIFF = {"normal_stiffness": 1e10, "shear_stiffness": 1e10}


def quarter(thickness=0.0, body="deformable", divisions=3):
    """Four blocks of a metre in two rows, so that joints cross in the middle."""
    joint = ddem.Joint(thickness=thickness, **STIFF)
    model = ddem.Model(contact=False)
    keys = {"divisions": divisions, "material": ROCK, "joint": joint, "body": body}
    model.add_blocks(size=(2, 2, 1), count=(2, 2, 1), **keys)
    model.fix("xyz", z=0.0)
    return model.build(threads=1)


def lines(mesh):
    """Lengths and midpoints of the lines of a mesh."""
    ends = mesh.points[mesh.lines.reshape(-1, 3)[:, 1:]]
    return np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1), ends.mean(axis=1)


def test_legends_count_existing_pairs(tmp_path):
    """A cavity at a corner of eight blocks removes three of their twelve joints, with four pairs
    each.
    """
    model = ddem.Model(contact=False)
    joint = ddem.Joint(**STIFF)
    model.add_blocks(size=(2, 2, 2), count=(2, 2, 2), divisions=1, material=ROCK, joint=joint)
    model.fix("xyz", z=0.0)
    model.remove(x=(1, 2), y=(0, 1), z=(1, 2), from_="dig")
    for name in ("weight", "dig"):
        model.stage(name, kind="relax")
    ddem.run_deck(model, out=tmp_path / "dug", quiet=True)
    for joints in ("traces", "state"):
        plotter = plot(tmp_path / "dug", joints=joints, show=False)
        words = [actor.input for actor in plotter.actors.values() if isinstance(actor, pv.Text)]
        plotter.close()
        assert [word for word in words if "bonded" in word] == ["bonded (36)"]


@pytest.mark.parametrize("thickness", [0.0, 0.02])
@pytest.mark.parametrize(("body", "divisions"), [("deformable", 2), ("deformable", 4), ("rigid", 1)])
def test_traces_are_where_joints_meet_outer_faces(drawn, thickness, body, divisions):
    """Four joints of a square metre: three outer edges each, drawn on both sides, none at the
    crossing.
    """
    meshes = drawn(of=quarter(thickness, body, divisions), joints="traces", scale=1.0)
    lengths, middles = lines(meshes["bonded, traces"])
    assert lengths.sum() == pytest.approx(4 * 3 * 2, rel=2 * thickness)
    at = np.abs(middles - 1.0)
    half = 0.5 * thickness + 1e-6
    # The traces lie on the top, the bottom or the four sides, and in one of the two joint planes.
    outside = (at[:, :2] > 1.0 - half).any(axis=1) | (np.abs(middles[:, 2] - 0.5) > 0.5 - half)
    assert outside.all() and (at[:, :2].min(axis=1) <= half).all()


def test_traces_have_states_of_their_pairs(drawn, simulation):
    simulation.pairs["state"][4] = 1  # the middle of the face at x = 1, which is inside
    simulation.pairs["state"][0] = 1  # a corner
    meshes = drawn(joints="traces", scale=0.0)
    lengths, middles = lines(meshes["failed in shear, traces"])
    here = np.abs(middles[:, 0] - 1.0) < 0.1
    # Half an element edge in each direction, on both blocks.
    assert lengths[here].sum() == pytest.approx(4 * 0.25)
    assert lengths[~here].sum() == pytest.approx(2 * 4.0)
    # The blocks stay opaque and keep their field.
    assert meshes["blocks"].array_names[0] == "displacement magnitude (m)"


def test_open_joints_have_their_own_colour(drawn, simulation):
    simulation.pairs["open"][simulation.pairs["state"] == 2] = 1
    for joints in ("traces", "state"):
        meshes = drawn(joints=joints)
        assert "failed in tension, traces" not in meshes
        assert lines(meshes["open or released, traces"])[0].sum() == pytest.approx(8.0, rel=1e-3)
    assert meshes["open or released"].area == pytest.approx(1.0, rel=1e-3)


def test_separated_joints_have_no_trace(drawn, simulation):
    simulation.displacement[simulation.points[:, 0] > 2.9999] += (0.0, 0.0, 0.3)
    simulation.displacement[simulation.node_block == 2] -= (0.0, 0.0, 0.3)
    meshes = drawn(joints="traces", scale=1.0)
    assert not (set(meshes) & {"failed in tension, traces", "failed in shear, traces"})
    assert "bonded, traces" in meshes


def width(file, thickness):
    """Width in pixels of the trace of a joint seen edge-on."""
    simulation = quarter(thickness)
    plot(simulation, "block", joints="traces", view="xz", scale=1.0, cmap="autumn", screenshot=file)
    image = pv.read(file)
    picture = np.asarray(image.active_scalars)[:, :3].reshape(*image.dimensions[1::-1], 3)
    row = picture[picture.shape[0] // 2].astype(int)
    inside = np.flatnonzero((row < 250).any(axis=1))
    dark = (row[inside[0] + 30 : inside[-1] - 30] < 150).all(axis=1)
    return int(dark.sum())


def test_trace_width_is_independent_of_joint_thickness(tmp_path):
    thin, thick = (width(tmp_path / "side.png", thickness) for thickness in (0.0, 0.002))
    assert 3 <= thin <= 5 and 3 <= thick <= 6


def test_nonconforming_joint_shows_its_outline(drawn):
    model = ddem.Model(contact=False)
    joint = ddem.Joint(thickness=0.0, **STIFF)
    for name, n, z in (("below", 1, 0.0), ("above", 2, 1.0)):
        keys = {"divisions": 2, "material": ROCK, "joint": joint, "name": name}
        model.add_blocks(origin=(0, 0, z), size=(2, 2, 1), count=(n, n, 1), **keys)
    model.fix("xyz", z=0.0)
    meshes = drawn(of=model.build(threads=1), joints="traces", scale=1.0)
    _, middles = lines(meshes["bonded, traces"])
    level = middles[np.abs(middles[:, 2] - 1.0) < 1e-6]
    assert (np.abs(level[:, :2] - 1.0).max(axis=1) > 0.99).any()


def test_traces_without_joints_are_refused(simulation):
    simulation.pairs, simulation.quads = simulation.pairs[:0], simulation.quads[:0]
    assert "no joints" in refused(lambda: plot(simulation, joints="traces", show=False))


def test_moving_blocks_are_outlined(tmp_path):
    """The upper two of four blocks slide together, so no line is drawn between them."""
    model = ddem.Model(gravity=(0, 0, -9.81))
    keys = {"divisions": 2, "material": ROCK, "joint": ddem.Joint(**STIFF)}
    model.add_blocks(name="bed", size=(2, 1, 1), count=(2, 1, 1), **keys)
    model.add_blocks(name="top", origin=(0, 0, 1), size=(2, 1, 1), count=(2, 1, 1), **keys)
    model.fix("xyz", z=0.0)
    model.load(traction=(1e5, 0, 0), z=2.0)
    model.contact(friction=5)
    slip = ddem.Joint(friction=5, **STIFF)
    model.assign(joint=slip, z=1.0)
    model.stage("push", kind="relax")
    with pytest.raises(ddem.NotConverged):
        ddem.run_deck(model, out=tmp_path, quiet=True)
    plotter = plot(tmp_path, moving=True, joints="traces", scale=1.0, show=False)
    mesh = plotter.actors["moving"].mapper.dataset
    lengths, _ = lines(mesh)
    texts = [actor.input for actor in plotter.actors.values() if hasattr(actor, "input")]
    plotter.close()
    assert "moving: 2 blocks" in texts
    # All edges of a box of 2 × 1 × 1.
    assert lengths.sum() == pytest.approx(4 * (2 + 1 + 1), rel=1e-3)


def test_moving_blocks_are_outlined_in_last_frame_of_failed_stage(tmp_path):
    slippery = ddem.Joint(normal_stiffness=1e10, shear_stiffness=1e10, friction=10)
    model = ddem.Model(gravity=(4.905, 0, -8.4957))
    model.add_blocks(
        size=(1, 1, 2), count=(1, 1, 2), divisions=1, material=ROCK, joint=slippery, body="rigid"
    )
    model.fix("xyz", z=0.0)
    with pytest.raises(ddem.Collapsed):
        model.build().relax(record=tmp_path / "slides", quiet=True)
    results = ddem.Results(tmp_path / "slides")
    assert len(results) > 1
    for frame, outlined in ((0, False), (-1, True)):
        plotter = plot(results, moving=True, frame=frame, show=False)
        assert ("moving" in plotter.actors) == outlined
        plotter.close()


def test_missing_contacts_are_refused():
    model = ddem.Model(contact=True)
    model.add_blocks(size=(1, 1, 1), divisions=1, material=ROCK)
    with pytest.raises(ValueError, match="contacts: nothing to draw"):
        plot(model.build(), contacts=True, show=False)

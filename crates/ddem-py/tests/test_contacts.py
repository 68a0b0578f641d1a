"""Rigid blocks and contacts: a block that falls on another, slides and comes to rest."""

from __future__ import annotations

import warnings
from pathlib import Path

import ddem
import h5py
import numpy as np
import pytest
from sample_models import ROCK

SOFT = ddem.Material(density=2400, young=1e8, poisson=0.25)


def fallen(**contact: float) -> ddem.Model:
    """A rigid cube on a fixed floor, with a deformable block above it."""
    model = ddem.Model(gravity=(0, 0, -9.81))
    model.contact(**contact)
    model.add_blocks(
        name="floor", origin=(-2, -2, -0.5), size=(5, 5, 0.5), material=SOFT, body="rigid"
    )
    model.add_blocks(name="rigid", size=(1, 1, 1), material=SOFT, body="rigid")
    model.add_blocks(
        name="soft", origin=(0.2, 0.1, 1.02), size=(0.8, 0.8, 0.8), material=SOFT, divisions=2
    )
    model.fix("xyz", set="floor")
    return model


def test_falling_blocks_come_to_rest() -> None:
    simulation = fallen(friction=30, restitution=0.1).build()
    simulation.run(0.8, damping={"local": 0.5}, quiet=True)
    u = simulation.displacement
    nodes = len(u)
    assert u.shape == simulation.velocity.shape == (8 + 8 + 27, 3)
    assert np.isfinite(u).all() and np.isfinite(simulation.stress).all()
    # The block falls by the gap, and penetrates no more than the springs require.
    assert np.allclose(u[nodes - 27 :, 2], -0.02, atol=2e-3)
    assert np.abs(u[:8]).max() == 0.0
    assert np.abs(simulation.velocity).max() < 0.05
    # The floor carries both blocks and itself.
    weight = 2400 * 9.81 * (1 + 0.8**3 + 5 * 5 * 0.5)
    assert simulation.reaction(simulation.nodes(set="floor"))[2] == pytest.approx(weight, rel=1e-3)
    assert simulation.energy["friction"] >= 0
    assert simulation.energy["damping"] > 0


def test_contacts_are_saved_and_resumed(tmp_path: Path) -> None:
    whole = fallen().build()
    whole.run(0.1, damping="none", quiet=True)
    whole.save(tmp_path / "state.h5")
    again = ddem.load(tmp_path / "state.h5")
    for simulation in (whole, again):
        simulation.run(0.1, damping="none", quiet=True)
    for name in ("displacement", "velocity", "stress"):
        assert np.array_equal(getattr(whole, name), getattr(again, name)), name


def test_too_stiff_contacts_warn() -> None:
    with pytest.warns(UserWarning, match=r"normal_stiffness.*limits the time step.*\[stiff-contact\]"):
        fallen(normal_stiffness=1e18).build()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        fallen().build()


def test_contact_forces_carry_weight(tmp_path: Path) -> None:
    simulation = fallen(friction=30).build()
    simulation.run(1.5, damping={"local": 0.8}, record=tmp_path, frames=3, quiet=True)
    contacts = simulation.contacts
    assert contacts.dtype.names == (
        *("point", "force", "traction", "normal", "area", "gap", "slip", "sliding", "blocks"),
    )
    for blocks, weight in (((0, 1), 1 + 0.8**3), ((1, 2), 0.8**3)):
        here = contacts[(contacts["blocks"] == blocks).all(axis=1)]
        # Force on the lower block, which is the first of the two.
        force = here["force"].sum(axis=0)
        assert np.allclose(force, (0, 0, -2400 * 9.81 * weight), atol=1e-2 * 2400 * 9.81)
        assert (here["gap"] < 0).all() and not here["sliding"].any()
        assert np.allclose(here["traction"] * here["area"][:, None], here["force"])
        assert ((here["traction"] * here["normal"]).sum(axis=1) < 0).all()
        assert here["area"].sum() == pytest.approx(1.0 if blocks == (0, 1) else 0.64, rel=0.05)
    counts = simulation.summary["contacts"]
    assert (counts["block_pairs"], counts["points"]) == (2, len(contacts))
    assert counts["deepest"] == pytest.approx(-contacts["gap"].min(), rel=1e-9)
    with h5py.File(tmp_path / "contacts.vtkhdf") as file:
        root = file["VTKHDF"]
        number, first = root["NumberOfPoints"][-1], root["Steps/PointOffsets"][-1]
        last = slice(first, first + number)
        assert len(root["NumberOfPoints"]) == 4 and number == len(contacts)
        assert np.array_equal(root["Points"][last], contacts["point"])
        for name in contacts.dtype.names[1:]:
            assert np.array_equal(root["PointData"][name][last], contacts[name]), name
    contacts["force"] = 0.0
    assert simulation.contacts["force"].any()


def test_contacts_off_has_no_contacts(tmp_path: Path) -> None:
    model = ddem.Model(contact=False)
    model.add_blocks(size=(1, 1, 1), material=SOFT, body="rigid")
    simulation = model.build()
    simulation.run(1e-3, record=tmp_path, quiet=True)
    assert simulation.contacts.shape == (0,)
    assert simulation.summary["contacts"] == dict.fromkeys(
        ("block_pairs", "sliding", "open", "points", "deepest"), 0
    )
    assert not (tmp_path / "contacts.vtkhdf").exists()


def test_momentum_of_rigid_and_deformable_block_is_exact() -> None:
    model = ddem.Model()
    model.add_blocks(name="rigid", size=(1, 2, 3), material=SOFT, body="rigid")
    model.add_blocks(name="soft", origin=(5, 0, 0), size=(1, 1, 1), material=SOFT, divisions=2)
    model.initial(set="rigid", velocity=(1, 0, 0), spin=(0, 0, 2), centre=(0.5, 1, 1.5))
    model.initial(set="soft", velocity=(0, 3, 0))
    simulation = model.build()
    for _ in range(2):
        # m v; for the rigid block x × m v and I ω, for the other x × m v.
        assert simulation.momentum == pytest.approx(2400 * np.array([6.0, 3.0, 0.0]), rel=1e-12)
        spin = 14400 / 12 * (1 + 4) * 2
        moment = np.array([0, 1.5 * 14400, -1.0 * 14400 + spin])
        moment += 7200 * np.cross((5.5, 0.5, 0.5), (0, 1, 0))
        assert simulation.angular_momentum == pytest.approx(moment, rel=1e-12)
        simulation.step(50)


def test_contact_forces_are_drawn(tmp_path: Path) -> None:
    pytest.importorskip("pyvista")
    simulation = fallen(friction=30).build()
    simulation.run(0.3, damping={"local": 0.5}, record=tmp_path, quiet=True)
    meshes = []
    for source in (simulation, tmp_path):
        plotter = ddem.plot(source, contacts=True, show=False)
        meshes.append(plotter.actors["contacts"].mapper.dataset)
        plotter.close()
    contacts = simulation.contacts
    drawn = np.unique(meshes[0]["contact force (N)"])
    pairs = np.unique(contacts["blocks"], axis=0)
    sums = [
        np.linalg.norm(contacts["force"][(contacts["blocks"] == pair).all(axis=1)].sum(axis=0))
        for pair in pairs
    ]
    assert np.allclose(drawn, np.sort(sums))
    assert np.allclose(meshes[0].points, meshes[1].points)
    with pytest.raises(ValueError, match="scale"):
        ddem.plot(simulation, contacts=True, scale=10, show=False)
    (tmp_path / "contacts.vtkhdf").unlink()
    with pytest.raises(ValueError, match="contacts"):
        ddem.plot(tmp_path, contacts=True, show=False)


@pytest.mark.parametrize("friction", [20.0, 40.0])
@pytest.mark.parametrize("body", ["deformable", "rigid"])
def test_sliding_block_stops_at_exact_distance(friction: float, body: str) -> None:
    model = ddem.Model(gravity=(0, 0, -9.81))
    model.add_blocks(
        origin=(-1, -0.5, -0.5), size=(8, 2, 0.5), divisions=1, material=ROCK, name="base", body=body
    )
    model.add_blocks(size=(1, 1, 1), divisions=2, material=ROCK, name="block", body=body)
    model.contact(friction=friction)
    model.fix("xyz", set="base")
    model.initial(velocity=(3, 0, 0), set="block")
    simulation = model.build(threads=1)
    simulation.run(5.0, until_rest=True, quiet=True)
    assert simulation.time < 2.0
    assert simulation.summary["stages"][-1]["verdict"] == "at rest"
    slid = simulation.displacement[simulation.nodes(set="block"), 0].mean()
    assert slid == pytest.approx(9 / (2 * 9.81 * np.tan(np.radians(friction))), rel=0.01)


def test_accelerating_block_raises_collapsed() -> None:
    model = ddem.Model(gravity=(6.0, 0, -7.76))
    model.add_blocks(
        origin=(-1, -0.5, -0.5), size=(8, 2, 0.5), divisions=1, material=ROCK, name="base"
    )
    model.add_blocks(size=(1, 1, 1), divisions=2, material=ROCK, name="block")
    model.contact(friction=20.0)
    model.fix("xyz", set="base")
    with pytest.raises(ddem.Collapsed):
        model.build(threads=1).run(1.0, until_rest=True, quiet=True)
    assert model.build(threads=1).run(1.0, until_rest=True, on_failure="continue", quiet=True) > 0
    # Without `until_rest` the run ends at its duration, whether blocks are at rest or not.
    simulation = model.build(threads=1)
    simulation.run(0.2, quiet=True)
    assert simulation.summary["stages"][-1]["verdict"] == "fails"

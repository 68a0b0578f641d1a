"""Arrays, counts and selections of simulations."""

from __future__ import annotations

from typing import Any

import ddem
import numpy as np
import pytest
from sample_models import ROCK, WEIGHT, breaking, column, cube, same


@pytest.fixture
def simulation() -> ddem.Simulation:
    return column().build()


def test_arrays_have_documented_shapes_and_types(simulation: ddem.Simulation) -> None:
    n = (simulation.n_nodes, simulation.n_elements, simulation.n_pairs, simulation.n_blocks)
    assert n == (54, 16, 9, 2)
    arrays = {
        "displacement": ((54, 3), "f8"),
        "velocity": ((54, 3), "f8"),
        "force": ((54, 3), "f8"),
        "points": ((54, 3), "f8"),
        "mass": ((54,), "f8"),
        "stress": ((16, 6), "f8"),
        "node_block": ((54,), "i8"),
        "elements": ((16, 8), "i8"),
        "element_block": ((16,), "i8"),
        "quads": ((4, 4), "i8"),
    }
    for name, (shape, dtype) in arrays.items():
        array = getattr(simulation, name)
        assert (array.shape, array.dtype) == (shape, np.dtype(dtype)), name
        assert array.flags.c_contiguous and array.flags.writeable, name


def test_arrays_are_copies(simulation: ddem.Simulation) -> None:
    simulation.step(3)
    names = "displacement velocity force stress points mass node_block elements element_block quads"
    for name in names.split():
        before = getattr(simulation, name)
        changed = getattr(simulation, name)
        changed[...] = 77
        assert same(getattr(simulation, name), before), name
    pairs = simulation.pairs
    pairs["traction"] = 77
    assert not (simulation.pairs["traction"] == 77).any()
    kept = simulation.displacement
    at = kept.copy()
    simulation.step(5)
    assert same(kept, at), "what was seen before does not move"
    assert not same(simulation.displacement, at)
    simulation.energy["kinetic"] = 5.0
    assert simulation.energy["kinetic"] != 5.0


def test_arrays_describe_the_mesh(simulation: ddem.Simulation) -> None:
    points, elements = simulation.points, simulation.elements
    assert points.min(axis=0).tolist() == [0.0, 0.0, 0.0]
    assert points.max(axis=0).tolist() == [1.0, 1.0, 2.0]
    assert set(simulation.node_block) == {0, 1}
    assert (simulation.node_block == (np.arange(54) >= 27)).all()
    assert (simulation.node_block[elements] == simulation.element_block[:, None]).all()
    # VTK's order: along x, then around, the second face above the first.
    corners = points[elements]
    x, y, z = (corners[:, k] - corners[:, 0] for k in (1, 3, 4))
    assert (np.einsum("ij,ij->i", np.cross(x, y), z) > 0).all()
    assert np.allclose(corners[:, 2] - corners[:, 0], x + y)
    assert np.isclose(simulation.mass.sum() * 9.81, WEIGHT, rtol=1e-2)
    pairs = simulation.pairs
    assert (simulation.node_block[pairs["nodes"]] == [0, 1]).all()
    assert np.allclose(points[pairs["nodes"]].mean(axis=1), pairs["point"])
    assert np.allclose(pairs["point"][:, 2], 1.0)
    quads = pairs["point"][simulation.quads]
    assert np.allclose(quads.mean(axis=1)[:, 2], 1.0)
    assert len(np.unique(np.round(quads.mean(axis=1), 6), axis=0)) == 4


def test_pairs_have_documented_type(simulation: ddem.Simulation) -> None:
    dtype = simulation.pairs.dtype
    expected: list[Any] = [
        ("point", "f8", (3,)),
        ("normal", "f8", (3,)),
        ("nodes", "i8", (2,)),
        ("joint", "i8"),
        ("displacement", "f8", (3,)),
        ("traction", "f8", (3,)),
        ("slip", "f8", (3,)),
        ("opening", "f8"),
        ("state", "u1"),
        ("open", "?"),
        ("released", "?"),
        ("failure_time", "f8"),
        ("damage", "f8"),
    ]
    assert dtype == np.dtype(expected)
    bonded = simulation.pairs
    assert (bonded["state"] == 0).all() and not bonded["open"].any()
    assert np.isnan(bonded["failure_time"]).all()


def test_pairs_report_tensile_failure() -> None:
    simulation = breaking().build()
    simulation.run(4e-3, damping={"local": 0.3}, quiet=True)
    pairs = simulation.pairs
    assert (pairs["state"] == 2).all() and pairs["open"].all()
    assert ((pairs["failure_time"] > 0) & (pairs["failure_time"] < simulation.time)).all()
    assert (pairs["opening"] > 0).all() and (pairs["damage"] == 1).all()
    assert simulation.summary["failed_pairs"] == {"shear": 0, "tension": 9}


def test_model_without_joints_has_no_pairs() -> None:
    simulation = cube().build()
    assert simulation.n_pairs == 0
    assert simulation.pairs.shape == (0,)
    assert simulation.quads.shape == (0, 4)
    assert simulation.field("traction").shape == (0, 3)


def test_fields_equal_attributes(simulation: ddem.Simulation) -> None:
    simulation.step(4)
    for name in ("displacement", "velocity", "force", "stress"):
        assert same(simulation.field(name), getattr(simulation, name))
    pairs = simulation.pairs
    for name in ("traction", "slip", "opening", "damage", "failure_time"):
        assert same(simulation.field(name), pairs[name].copy())
    nodes = simulation.nodes(z=2.0)
    part = simulation.field("displacement", nodes=nodes)
    assert same(part, simulation.displacement[nodes])
    mask = np.zeros(54, bool)
    mask[nodes] = True
    assert same(simulation.field("displacement", nodes=mask), part)
    assert same(simulation.field("velocity", nodes=[5, 3, 5]), simulation.velocity[[5, 3, 5]])
    assert simulation.field("velocity", nodes=[]).shape == (0, 3)


def test_out_array_receives_the_field(simulation: ddem.Simulation) -> None:
    simulation.step(4)
    out = np.full((54, 3), np.nan)
    assert simulation.field("displacement", out=out) is out
    assert same(out, simulation.displacement)
    wide = np.zeros((54, 6))
    strided = wide[:, ::2]
    assert simulation.field("velocity", out=strided) is strided
    assert same(strided.copy(), simulation.velocity)
    assert (wide[:, 1::2] == 0).all()
    fortran = np.zeros((54, 3), order="F")
    assert same(np.ascontiguousarray(simulation.field("force", out=fortran)), simulation.force)
    some = np.zeros((2, 3))
    simulation.field("velocity", nodes=[5, 3], out=some)
    assert same(some, simulation.velocity[[5, 3]])
    flat = np.zeros(9)
    assert simulation.field("opening", out=flat) is flat
    before = np.full((54, 3), 7.0)
    with pytest.raises(ValueError, match="^name: "):
        simulation.field("displacment", out=before)
    assert (before == 7.0).all()


def test_large_field_is_written_in_pieces() -> None:
    model = ddem.Model(gravity=(0, 0, -9.81), contact=False)
    spring = ddem.Joint(normal_stiffness=1e9, shear_stiffness=1e9)
    model.add_blocks(
        size=(30, 30, 10), count=(30, 30, 10), body="rigid", material=ROCK, joint=spring
    )
    model.fix("xyz", z=0.0)
    simulation = model.build()
    simulation.step(3)
    assert simulation.n_nodes > 65_536
    wide = np.zeros((simulation.n_nodes, 6))
    strided = wide[:, ::2]
    simulation.field("displacement", out=strided)
    assert same(strided.copy(), simulation.displacement)
    out = np.full((simulation.n_nodes, 3), np.nan)
    assert same(simulation.field("velocity", out=out), simulation.velocity)
    with pytest.raises(ValueError, match="^out: "):
        simulation.field("velocity", out=out[1:])


def test_probes_record_fields() -> None:
    model = column(peaks=True)
    model.add_blocks(
        size=(1, 1, 1), origin=(3, 0, 0), material=ROCK, divisions=1, name="alone", joint=None
    )
    model.fix("xyz", z=0.0, set="alone")
    for name in ("fragment", "peak_velocity", "peak_tension", "peak_compression"):
        model.probe(name, quantity=name, at=(4, 1, 1) if name == "fragment" else (1, 1, 2))
    simulation = model.build()
    simulation.run(1e-4)
    probes = simulation.probes
    assert probes["fragment"]["fragment"].tolist()[-1] == simulation.block_fragment[2]
    node = simulation.nearest_node((1, 1, 2))
    assert probes["peak_velocity"]["peak_velocity"][-1] == simulation.peak_velocity[node] > 0
    for name in ("peak_tension", "peak_compression"):
        assert probes[name][name][-1] == getattr(simulation, name)[15]
    without = column()
    without.probe("peak", quantity="peak_velocity", at=(1, 1, 2))
    with pytest.raises(ddem.ModelError, match="there is no `peak_velocity`"):
        without.build()


def test_nodes_are_selected_by_region(simulation: ddem.Simulation) -> None:
    points = simulation.points
    assert simulation.nodes().tolist() == list(range(54))
    assert simulation.nodes(z=2.0).tolist() == np.flatnonzero(points[:, 2] == 2).tolist()
    inside = (points[:, 0] <= 0.5) & (points[:, 2] >= 1.5)
    assert simulation.nodes(x=(0, 0.5), z=(1.5, 9)).tolist() == np.flatnonzero(inside).tolist()
    # A plane in a joint gap selects the nodes on both sides.
    assert len(simulation.nodes(z=1.0)) == 18
    assert len(simulation.nodes(set="all")) == 54
    found = simulation.nodes(sphere={"centre": (0, 0, 0), "radius": 0.6})
    assert found.tolist() == np.flatnonzero(np.linalg.norm(points, axis=1) <= 0.6).tolist()
    none = simulation.nodes(z=77.0)
    assert (none.shape, none.dtype) == ((0,), np.dtype("i8"))
    at = simulation.nearest_node((1, 1, 2))
    assert points[at].tolist() == [1.0, 1.0, 2.0]
    assert isinstance(at, int)


def test_reaction_equals_weight(simulation: ddem.Simulation) -> None:
    assert simulation.relax(tolerance=1e-9, quiet=True) > 0
    foot = simulation.nodes(z=0.0)
    weight = simulation.mass.sum() * 9.81
    assert np.allclose(simulation.reaction(foot), [0, 0, weight], atol=1e-4)
    mask = np.isin(np.arange(54), foot)
    assert same(simulation.reaction(mask), simulation.reaction(foot))
    assert same(simulation.reaction(foot[::-1]), simulation.reaction(foot))
    assert same(simulation.reaction([]), np.zeros(3))
    assert np.abs(simulation.force).max() < 1e-3 * weight
    # The lower block carries the upper one: the mean stress at the base is near weight per area.
    zz = simulation.stress[simulation.element_block == 0, 2].mean()
    assert np.isclose(zz, -0.75 * weight, rtol=0.1)
    assert simulation.unbalanced < 1e-9
    assert simulation.time == 0.0


def test_repr_shows_counts_and_time() -> None:
    simulation = column(title="tower").build()
    simulation.start(time_step=1e-6)
    simulation.step(2)
    assert repr(simulation) == '<Simulation "tower": 2 blocks, 54 nodes, 2 steps, 2e-06 s>'
    assert (simulation.title, simulation.steps, simulation.time_step) == ("tower", 2, 1e-6)
    assert simulation.time == pytest.approx(2e-6, rel=1e-12)
    assert 0 < simulation.time_step < simulation.critical_step < 1e-3

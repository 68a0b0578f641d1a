"""Simulations: what is seen of them and done to them, with the bits of the command line."""

from __future__ import annotations

import csv
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import ddem
import h5py
import numpy as np
import pytest
from small import (
    WEIGHT,
    assert_same_results,
    breaking,
    column,
    command_line,
    cube,
    run_command,
    same,
    same_state,
)

COMPONENTS = ("xx", "yy", "zz", "xy", "yz", "zx")


@pytest.fixture
def simulation() -> ddem.Simulation:
    return column().build()


# --- what is seen ---


def test_shapes_and_types(simulation: ddem.Simulation) -> None:
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
        assert array.flags.owndata or array.base is not None


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


def test_what_the_arrays_mean(simulation: ddem.Simulation) -> None:
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


def test_pairs_type(simulation: ddem.Simulation) -> None:
    dtype = simulation.pairs.dtype
    expected: list[Any] = [
        ("point", "f8", (3,)),
        ("nodes", "i8", (2,)),
        ("joint", "i8"),
        ("displacement", "f8", (3,)),
        ("traction", "f8", (3,)),
        ("slip", "f8", (3,)),
        ("opening", "f8"),
        ("state", "u1"),
        ("open", "?"),
        ("failure_time", "f8"),
        ("damage", "f8"),
    ]
    assert dtype == np.dtype(expected)
    bonded = simulation.pairs
    assert (bonded["state"] == 0).all() and not bonded["open"].any()
    assert np.isnan(bonded["failure_time"]).all()


def test_pairs_fail_in_tension() -> None:
    simulation = breaking().build()
    simulation.run(4e-3, damping={"local": 0.3}, quiet=True)
    pairs = simulation.pairs
    assert (pairs["state"] == 2).all() and pairs["open"].all()
    assert ((pairs["failure_time"] > 0) & (pairs["failure_time"] < simulation.time)).all()
    assert (pairs["opening"] > 0).all() and (pairs["damage"] == 1).all()
    assert simulation.summary["failed_pairs"] == {"shear": 0, "tension": 9}


def test_without_joints_there_are_no_pairs() -> None:
    simulation = cube().build()
    assert simulation.n_pairs == 0
    assert simulation.pairs.shape == (0,)
    assert simulation.quads.shape == (0, 4)
    assert simulation.field("traction").shape == (0, 3)


def test_fields_by_name(simulation: ddem.Simulation) -> None:
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


def test_out_takes_the_numbers(simulation: ddem.Simulation) -> None:
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


def test_nodes_are_selected(simulation: ddem.Simulation) -> None:
    points = simulation.points
    assert simulation.nodes().tolist() == list(range(54))
    assert simulation.nodes(z=2.0).tolist() == np.flatnonzero(points[:, 2] == 2).tolist()
    inside = (points[:, 0] <= 0.5) & (points[:, 2] >= 1.5)
    assert simulation.nodes(x=(0, 0.5), z=(1.5, 9)).tolist() == np.flatnonzero(inside).tolist()
    # A plane in a joint gap: the nodes on both sides.
    assert len(simulation.nodes(z=1.0)) == 18
    assert len(simulation.nodes(set="all")) == 54
    found = simulation.nodes(sphere={"centre": (0, 0, 0), "radius": 0.6})
    assert found.tolist() == np.flatnonzero(np.linalg.norm(points, axis=1) <= 0.6).tolist()
    none = simulation.nodes(z=77.0)
    assert (none.shape, none.dtype) == ((0,), np.dtype("i8"))
    at = simulation.nearest_node((1, 1, 2))
    assert points[at].tolist() == [1.0, 1.0, 2.0]
    assert isinstance(at, int)


def test_the_reaction_is_the_weight(simulation: ddem.Simulation) -> None:
    assert simulation.relax(tolerance=1e-9, quiet=True) > 0
    foot = simulation.nodes(z=0.0)
    weight = simulation.mass.sum() * 9.81
    assert np.allclose(simulation.reaction(foot), [0, 0, weight], atol=1e-4)
    mask = np.isin(np.arange(54), foot)
    assert same(simulation.reaction(mask), simulation.reaction(foot))
    assert same(simulation.reaction(foot[::-1]), simulation.reaction(foot))
    assert same(simulation.reaction([]), np.zeros(3))
    assert np.abs(simulation.force).max() < 1e-3 * weight
    # The lower block bears the upper one: mean stress at the foot near the weight per area.
    zz = simulation.stress[simulation.element_block == 0, 2].mean()
    assert np.isclose(zz, -0.75 * weight, rtol=0.1)
    assert simulation.unbalanced < 1e-9
    assert simulation.time == 0.0


def test_repr_and_counts() -> None:
    simulation = column(title="tower").build()
    simulation.start(time_step=1e-6)
    simulation.step(2)
    assert repr(simulation) == '<Simulation "tower": 2 blocks, 54 nodes, 2 steps, 2e-06 s>'
    assert (simulation.title, simulation.steps, simulation.time_step) == ("tower", 2, 1e-6)
    assert simulation.time == pytest.approx(2e-6, rel=1e-12)
    assert 0 < simulation.time_step < simulation.critical_step < 1e-3


# --- what is done ---


def test_states_may_be_set() -> None:
    simulation = cube().build()
    displacement = np.zeros((27, 3))
    displacement[:, 0] = 1e-4 * simulation.points[:, 0]
    simulation.displacement = displacement
    assert same(simulation.displacement, displacement)
    # Uniaxial strain: λ + 2G and λ.
    young, nu = 18e9, 0.25
    lame = young * nu / ((1 + nu) * (1 - 2 * nu))
    shear = young / (2 * (1 + nu))
    assert np.allclose(simulation.stress[:, 0], (lame + 2 * shear) * 1e-4, rtol=1e-3)
    assert np.allclose(simulation.stress[:, 1], lame * 1e-4, rtol=1e-3)
    velocity = np.zeros((27, 3))
    velocity[:, 1] = 2.0
    simulation.velocity = velocity.astype("f4")
    assert same(simulation.velocity, velocity)
    energy = simulation.energy
    assert energy["kinetic"] == pytest.approx(0.5 * 2400 * 4.0, rel=1e-12)
    simulation.displacement = np.zeros((27, 3)).tolist()
    simulation.run(1e-3, quiet=True)
    assert np.allclose(simulation.displacement[:, 1], 2e-3, rtol=1e-9)
    fortran = np.asfortranarray(displacement)
    simulation.displacement = fortran
    assert same(simulation.displacement, displacement)
    simulation.displacement = displacement[::-1]
    assert same(simulation.displacement, displacement[::-1].copy())


def test_energy_balances_with_forces_that_do_work() -> None:
    simulation = column().build()
    top = simulation.nodes(z=2.0)
    simulation.relax(quiet=True)
    scale = 0.0
    for turn in range(20):
        push = 1e4 * np.sin(turn)
        simulation.apply_force(top, (push, 0, push / 2))
        simulation.step(10)
        energy = simulation.energy
        scale = max(scale, energy["strain_bodies"] + energy["kinetic"])
    assert energy["external_work"] > 0.1 * scale > 0
    assert abs(energy["balance"]) < 1e-6 * scale
    names = "kinetic strain_bodies strain_joints friction fracture damping external_work balance"
    assert list(energy) == names.split()


def test_a_force_accelerates() -> None:
    simulation = cube().build()
    force = simulation.mass[:, None] * [3.0, 0.0, -1.0]
    simulation.apply_force(np.arange(27), force)
    assert np.allclose(simulation.force, force)
    simulation.run(1e-3, quiet=True)
    assert np.allclose(simulation.velocity, [3e-3, 0, -1e-3])
    energy = simulation.energy
    assert energy["external_work"] == pytest.approx(0.5 * 2400 * 10e-6, rel=1e-9)
    assert abs(energy["balance"]) < 1e-9 * energy["external_work"]


def test_forces_replace_add_up_and_go() -> None:
    simulation = cube().build()

    def at(node: int) -> list[float]:
        return simulation.force[node].tolist()

    simulation.apply_force([0, 1], (1, 2, 3))
    assert (at(0), at(1), at(2)) == ([1, 2, 3], [1, 2, 3], [0, 0, 0])
    simulation.apply_force([1], [[10, 0, 0]])
    assert (at(0), at(1)) == ([1, 2, 3], [10, 0, 0]), "replaced, the other stays"
    simulation.apply_force([2, 2, 2], [[1, 0, 0], [0, 1, 0], [0, 1, 5]])
    assert at(2) == [1, 2, 5], "those of one call add up"
    simulation.apply_force(0, (0, 0, 0))
    assert (at(0), at(1)) == ([0, 0, 0], [10, 0, 0])
    mask = np.zeros(27, bool)
    mask[[1, 2]] = True
    simulation.apply_force(mask, np.zeros((2, 3)))
    assert not simulation.force.any()
    simulation.apply_force([], np.zeros((0, 3)))
    simulation.apply_force([], (1, 1, 1))
    assert not simulation.force.any()


def test_forces_act_besides_the_loads() -> None:
    model = cube()
    model.load(force=(0, 0, 27.0), z=(0, 1))
    simulation = model.build()
    before = simulation.force
    simulation.apply_force([3], (1, 0, 0))
    assert np.allclose(simulation.force - before, np.eye(27)[3][:, None] * [1, 0, 0])


def test_forces_survive_a_file(tmp_path: Path) -> None:
    simulation = cube().build()
    simulation.apply_force([0, 5], (1e3, 0, 0))
    simulation.step(3)
    simulation.save(tmp_path / "state.h5")
    again = ddem.load(tmp_path / "state.h5")
    assert same_state(simulation, again)
    for one in (simulation, again):
        one.step(7)
        one.apply_force(5, (0, 0, 0))
        one.step(7)
    assert same_state(simulation, again)
    assert simulation.force[0, 0] != 0


# --- the same by other ways ---


def test_steps_in_chunks_are_steps() -> None:
    whole, single, numpys = (breaking().build() for _ in range(3))
    whole.step(600)
    for n in (1, 99, 100, 250, 0, 150):
        single.step(n)
    for _ in range(6):
        numpys.step(np.int32(100))
    assert whole.steps == single.steps == 600
    assert same_state(whole, single)
    assert same_state(whole, numpys)
    assert whole.pairs["state"].any(), "something has failed on the way"


def test_one_step_is_the_default() -> None:
    simulation = cube().build()
    simulation.step()
    assert simulation.steps == 1


def test_a_run_is_its_steps() -> None:
    model = column()
    model.load(force=(1e5, 0, 0), z=2.0)
    step, damping = 1e-5, {"mass": 30.0}
    run, steps, chunks = (model.build() for _ in range(3))
    assert run.run(200 * step, time_step=step, damping=damping, quiet=True) == 200
    steps.start(time_step=step, damping=damping)
    steps.step(200)
    chunks.start(time_step=step, damping=damping)
    for _ in range(20):
        chunks.step(10)
    assert run.steps == steps.steps == 200
    assert same(run.displacement, steps.displacement)
    assert same(run.velocity, steps.velocity)
    # A run ends with velocities of the present time, plain steps half a step before it.
    assert run.energy == pytest.approx(steps.energy, rel=1e-12, abs=1e-12)
    assert same_state(steps, chunks)


def test_steps_after_a_run_go_on_with_its_step() -> None:
    simulation = column().build()
    simulation.run(1e-4, time_step=1e-5, damping=0.1, quiet=True)
    simulation.step(10)
    assert (simulation.steps, simulation.time_step) == (20, 1e-5)
    assert simulation.time == pytest.approx(2e-4, rel=1e-12)


def test_damping_takes_energy() -> None:
    def left(**keys: Any) -> float:
        simulation = column().build()
        simulation.run(0.005, quiet=True, **keys)
        assert abs(simulation.energy["balance"]) < 1e-6 * WEIGHT
        return simulation.energy["damping"]

    assert left() == left(damping="none") == left(damping=0) == 0.0
    assert left(damping=0.05) > 0 and left(damping={"local": 0.3}) > 0
    assert left(damping=0.05) == left(damping={"ratio": 0.05})


def test_any_number_of_threads() -> None:
    one, two = (breaking().build(threads=n) for n in (1, 2))
    for simulation in (one, two):
        simulation.relax(quiet=True)
        simulation.run(2e-3, quiet=True)
    assert same_state(one, two)


def test_relax_says_how_many_steps() -> None:
    simulation = column().build()
    steps = simulation.relax(quiet=True)
    assert steps == simulation.steps > 1
    again = simulation.relax(increments=3, tolerance=1e-3, quiet=True)
    assert simulation.steps == steps + again


def test_a_stage_brings_its_loads() -> None:
    model = column(gravity=(0, 0, 0))
    model.load(force=(100, 0, 0), z=2.0, from_="push", until="rest")
    for name in ("settle", "push", "rest"):
        model.stage(name, kind="dynamic", duration=1e-4)
    simulation = model.build()
    assert not simulation.force.any()
    simulation.enter("push")
    assert simulation.force.sum(axis=0) == pytest.approx([100, 0, 0])
    assert simulation.steps == 0 and not simulation.displacement.any()
    simulation.enter("rest")
    assert not simulation.force.any()


# --- functions as histories ---


def table(time: float) -> float:
    """The linear ramp that the core computes, in its own order of operations."""
    return time / 1e-3 if time < 1e-3 else 1.0


@pytest.mark.parametrize("kind", ["load", "fix"])
def test_a_function_is_the_same_history(kind: str) -> None:
    def simulate(history: Any) -> ddem.Simulation:
        model = column()
        if kind == "load":
            model.load(traction=(1e5, 0, 0), z=2.0, history=history)
        else:
            model.fix("x", velocity=(0.1, 0, 0), z=2.0, history=history)
        simulation = model.build()
        simulation.run(2e-3, quiet=True)
        return simulation

    function = simulate(table)
    assert same_state(function, simulate({"ramp": 1e-3}))
    assert np.abs(function.displacement[:, 0]).max() > 1e-7
    constant = simulate(lambda time: 1.0)
    assert same_state(constant, simulate(None))
    assert not same_state(constant, function)
    assert same_state(simulate(lambda time: np.float64(1)), constant)
    assert same_state(simulate(lambda time: 1), constant)
    assert same_state(simulate(lambda time: True), constant)


def test_a_function_is_asked_at_times_of_the_run() -> None:
    times: list[float] = []

    def history(time: float) -> float:
        times.append(time)
        return 1.0

    model = cube()
    model.load(force=(1, 0, 0), z=1.0, history=history)
    simulation = model.build()
    simulation.start(time_step=1e-6)
    simulation.step(10)
    assert all(isinstance(time, float) for time in times)
    asked = sorted(set(times))
    assert asked[0] == 0.0
    assert np.allclose(asked, np.arange(len(asked)) * 1e-6, rtol=1e-9, atol=0)
    assert len(asked) in (10, 11)


def test_time_of_a_function_counts_from_its_stage() -> None:
    times: list[float] = []

    def history(time: float) -> float:
        times.append(time)
        return 1.0

    model = cube()
    model.load(force=(1, 0, 0), z=1.0, history=history, from_="push")
    model.stage("wait", kind="dynamic", duration=1)
    model.stage("push", kind="dynamic", duration=1)
    simulation = model.build()
    simulation.run(1e-4, quiet=True)
    assert simulation.time == pytest.approx(1e-4)
    times.clear()
    simulation.enter("push")
    simulation.run(1e-4, time_step=1e-5, quiet=True)
    assert min(times) == 0.0
    assert max(times) == pytest.approx(1e-4, rel=0.11)


class Wrong(Exception):
    """What a history raises."""


@pytest.mark.parametrize("how", ["run", "step", "relax"])
def test_what_a_function_raises_comes_out(how: str) -> None:
    broken = [False]

    def history(time: float) -> float:
        if broken[0] and simulation_time[0] <= time:
            raise Wrong("no value here")
        return 1.0

    simulation_time = [0.0]
    model = column()
    model.load(force=(1e4, 0, 0), z=2.0, history=history)
    simulation, reference = model.build(), model.build()
    calls: dict[str, Any] = {
        "run": lambda s: s.run(1e-3, time_step=1e-5, quiet=True),
        "step": lambda s: s.step(100),
        "relax": lambda s: s.relax(quiet=True),
    }
    broken[0] = True
    with pytest.raises(Wrong, match="^no value here$"):
        calls[how](simulation)
    broken[0] = False
    assert np.isfinite(simulation.displacement).all()
    assert np.isfinite(simulation.energy["balance"])
    calls[how](simulation)
    calls[how](reference)
    assert same(simulation.displacement, reference.displacement)


def test_a_function_that_raises_on_the_way_leaves_a_state() -> None:
    limit = [5e-4]

    def history(time: float) -> float:
        if time > limit[0]:
            raise Wrong
        return 1.0

    model = column()
    model.load(force=(1e4, 0, 0), z=2.0, history=history)
    simulation, reference = model.build(), model.build()
    simulation.start(time_step=1e-5)
    with pytest.raises(Wrong):
        simulation.step(1000)
    assert 0.0 < simulation.time < 6e-4
    done = simulation.steps
    assert 49 <= done <= 52
    limit[0] = np.inf
    simulation.step(100 - done)
    reference.start(time_step=1e-5)
    reference.step(100)
    assert same_state(simulation, reference)


@pytest.mark.parametrize("value", [None, "a", float("nan"), float("inf"), 1j, [1.0], np.zeros(2)])
def test_a_function_must_give_numbers(value: Any) -> None:
    model = column()
    given: list[Any] = [1.0]
    model.load(force=(1e4, 0, 0), z=2.0, history=lambda time: given[0])
    simulation = model.build()
    given[0] = value
    with pytest.raises((TypeError, ddem.Error)):
        simulation.step(2)
    given[0] = 1.0
    assert np.isfinite(simulation.force).all()
    simulation.step(2)


def test_a_function_may_use_another_simulation() -> None:
    # One thread for both: the one that computes is the one that asks.
    script = """
import ddem
from small import cube
other = cube().build(threads=1)
def history(time):
    other.step(1)
    return 1.0
model = cube()
model.load(force=(1, 0, 0), z=1.0, history=history)
simulation = model.build(threads=1)
simulation.step(5)
assert other.steps >= 5
"""
    run_python(script)


def test_a_function_cannot_use_its_own_simulation() -> None:
    model = cube()
    seen: list[BaseException] = []

    def history(time: float) -> float:
        for simulation in made:
            try:
                simulation.time
            except ddem.Busy as error:
                seen.append(error)
        return 1.0

    made: list[ddem.Simulation] = []
    model.load(force=(1, 0, 0), z=1.0, history=history)
    made.append(model.build())
    made[0].step(3)
    assert len(seen) >= 3


def run_python(script: str, timeout: float = 15) -> str:
    """Another interpreter, which may hang or crash."""
    here = str(Path(__file__).parent)
    path = os.pathsep.join([here, *sys.path])
    done = subprocess.run(
        [sys.executable, "-c", script],
        capture_output=True,
        text=True,
        timeout=timeout,
        env={**os.environ, "PYTHONPATH": path},
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


# --- files ---


def test_saved_and_loaded(tmp_path: Path) -> None:
    simulation = breaking().build()
    simulation.relax(quiet=True)
    simulation.run(5e-4, damping=0.02, quiet=True)
    simulation.step(7)
    path = tmp_path / "state.h5"
    simulation.save(path)
    simulation.save(str(path))
    again = ddem.load(path, threads=1)
    assert same_state(simulation, again)
    assert again.title == simulation.title
    assert again.summary["stages"] == simulation.summary["stages"]
    for one in (simulation, again):
        one.step(50)
        one.run(1e-3, damping={"local": 0.1}, quiet=True)
    assert same_state(simulation, again)
    assert simulation.pairs["state"].any()


def test_a_function_is_given_again(tmp_path: Path) -> None:
    model = column()
    model.load(force=(1e4, 0, 0), z=2.0, history=table)
    simulation = model.build()
    simulation.step(20)
    simulation.save(tmp_path / "state.h5")
    with pytest.raises(OSError, match="history"):
        ddem.load(tmp_path / "state.h5")
    with pytest.raises(OSError, match="another model"):
        ddem.load(tmp_path / "state.h5", model=cube())
    again = ddem.load(tmp_path / "state.h5", model=model)
    simulation.step(200)
    again.step(200)
    assert same_state(simulation, again)


def staged(title: str = "staged") -> ddem.Model:
    """A column that settles and is pushed."""
    model = column(title=title)
    model.load(traction=(1e5, 0, 0), z=2.0, history={"ramp": 1e-3}, from_="push")
    model.probe("foot", quantity="reaction", z=0.0)
    model.probe("stress", quantity="stress", at=(0, 0, 0), every=1e-4)
    model.stage("settle", kind="relax", tolerance=1e-5)
    model.stage("push", kind="dynamic", duration=2e-3, damping=0.02, frames=5)
    return model


def test_a_deck_gives_the_bits_of_the_command_line(tmp_path: Path) -> None:
    deck = tmp_path / "staged.toml"
    staged().to_deck(deck)
    run_command(deck, tmp_path / "command")
    simulation = ddem.run_deck(deck, out=tmp_path / "python", quiet=True)
    assert_same_results(tmp_path / "command", tmp_path / "python")
    # What comes back is at the end of the last stage; so is the checkpoint.
    assert simulation.time == pytest.approx(2e-3)
    assert same_state(simulation, ddem.load(tmp_path / "command" / "checkpoint.h5"))
    with h5py.File(tmp_path / "python" / "blocks.vtkhdf") as file:
        last = np.asarray(file["VTKHDF/PointData/displacement"])[-54:]
    assert np.allclose(last, simulation.displacement, rtol=1e-5, atol=1e-12)
    summary = json.loads((tmp_path / "python" / "summary.json").read_text())
    assert summary["stages"] == simulation.summary["stages"]


def test_joints_that_fail_give_the_bits_of_the_command_line(tmp_path: Path) -> None:
    model = breaking()
    model.stage("pull", kind="dynamic", duration=3e-3, frames=4)
    model.to_deck(tmp_path / "pull.toml")
    run_command(tmp_path / "pull.toml", tmp_path / "command", "--threads", "1")
    simulation = ddem.run_deck(model, out=tmp_path / "python", threads=2, quiet=True)
    assert_same_results(tmp_path / "command", tmp_path / "python")
    assert simulation.pairs["state"].any()


@pytest.mark.parametrize("form", ["path", "dictionary", "model"])
def test_decks_in_any_form(tmp_path: Path, form: str) -> None:
    model = staged()
    model.to_deck(tmp_path / "deck.toml")
    forms = {"path": tmp_path / "deck.toml", "dictionary": model.deck, "model": model}
    reference = model.build()
    reference.enter("settle")
    reference.relax(tolerance=1e-5, quiet=True)
    reference.enter("push")
    reference.run(2e-3, damping=0.02, quiet=True)
    simulation = ddem.run_deck(forms[form], out=tmp_path / "out", quiet=True)
    assert same_state(simulation, reference)


def test_calls_give_the_bits_of_the_command_line(tmp_path: Path) -> None:
    model = staged()
    model.to_deck(tmp_path / "staged.toml")
    run_command(tmp_path / "staged.toml", tmp_path / "command")
    simulation = model.build()
    out = tmp_path / "python"
    simulation.enter("settle")
    simulation.relax(tolerance=1e-5, record=out, name="settle", quiet=True)
    simulation.enter("push")
    simulation.run(2e-3, damping=0.02, frames=5, record=out, name="push", quiet=True)
    assert_same_results(tmp_path / "command", out)
    assert same_state(simulation, ddem.load(tmp_path / "command" / "checkpoint.h5"))


def test_the_results_go_where_the_deck_says(tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.chdir(tmp_path)
    staged().to_deck("tower.toml")
    ddem.run_deck("tower.toml", quiet=True)
    assert (tmp_path / "results" / "tower" / "summary.json").is_file()
    assert command_line()


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_calls_append_to_their_folder(tmp_path: Path) -> None:
    simulation = column(title="appended").build()
    out = tmp_path / "out"
    frames = []
    for turn in range(3):
        simulation.run(2e-4, frames=2, record=out, name=f"turn {turn}", quiet=True)
        with h5py.File(out / "blocks.vtkhdf") as file:
            frames.append(len(file["VTKHDF/Steps/Values"]))
            times = np.asarray(file["VTKHDF/Steps/Values"])
    assert frames == [3, 5, 7]
    assert (np.diff(times) > 0).all()
    assert times[-1] == pytest.approx(6e-4)
    energy = rows(out / "energy.csv")
    assert {row["stage"] for row in energy} == {"turn 0", "turn 1", "turn 2"}
    steps = [int(row["step"]) for row in energy]
    assert steps == sorted(steps) and steps[-1] == simulation.steps
    names = [stage["name"] for stage in json.loads((out / "summary.json").read_text())["stages"]]
    assert names == ["turn 0", "turn 1", "turn 2"]
    # The checkpoint in the folder is a saved simulation.
    assert same_state(ddem.load(out / "checkpoint.h5"), simulation)


def test_folders_take_turns(tmp_path: Path) -> None:
    simulation = column().build()
    frames: dict[str, list[float]] = {"a": [], "b": []}
    for name in ("a", "b", "a", "b"):
        simulation.run(1e-4, frames=1, record=tmp_path / name, quiet=True)
        with h5py.File(tmp_path / name / "blocks.vtkhdf") as file:
            times = np.asarray(file["VTKHDF/Steps/Values"]).tolist()
        assert times[: len(frames[name])] == frames[name], "what was there stays"
        assert len(times) > len(frames[name])
        frames[name] = times
    assert frames["a"][0] == 0.0
    assert (frames["a"][-1], frames["b"][-1]) == pytest.approx((3e-4, 4e-4))


def test_a_file_that_is_gone_stops_nothing(tmp_path: Path) -> None:
    simulation = column().build()
    out = tmp_path / "out"
    simulation.run(1e-4, record=out, quiet=True)
    steps = simulation.steps
    (out / "blocks.vtkhdf").unlink()
    with pytest.raises(FileNotFoundError):
        simulation.run(1e-4, record=out, quiet=True)
    assert simulation.steps == steps
    simulation.run(1e-4, record=tmp_path / "other", quiet=True)


def test_the_results_of_a_deck_stay(tmp_path: Path) -> None:
    simulation = ddem.run_deck(staged(), out=tmp_path / "out", quiet=True)
    before = {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()}
    with pytest.raises(FileExistsError):
        simulation.run(1e-4, record=tmp_path / "out", quiet=True)
    assert {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()} == before
    simulation.run(1e-4, record=tmp_path / "more", quiet=True)


def test_what_is_not_recorded_leaves_no_file(tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.chdir(tmp_path)
    simulation = column().build()
    simulation.relax(quiet=True)
    simulation.run(1e-4, quiet=True)
    simulation.step(3)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("title", ["", "tower"])
def test_the_results_of_another_model_stay(tmp_path: Path, title: str) -> None:
    out = tmp_path / "out"
    column(title=title).build().run(1e-4, record=out, quiet=True)
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    other = cube(title="cube" if title else "").build()
    with pytest.raises(FileExistsError, match="results of another"):
        other.run(1e-4, record=out, quiet=True)
    assert {path.name: path.read_bytes() for path in out.iterdir()} == before
    assert other.steps == 0


def test_names_of_stages_and_probes_are_text(tmp_path: Path) -> None:
    model = cube()
    model.probe('a,"b"', at=(0, 0, 0))
    simulation = model.build()
    simulation.run(1e-4, record=tmp_path / "out", name='one, "two"', quiet=True)
    found = rows(tmp_path / "out" / "probes.csv")
    assert set(found[0]) == {"stage", "step", "time", *(f'a,"b".{c}' for c in "xyz")}
    assert {row["stage"] for row in found} == {'one, "two"'}
    assert list(simulation.probes) == ['a,"b"']


def test_probes() -> None:
    model = staged()
    simulation = model.build()
    names = {name: history.dtype.names for name, history in simulation.probes.items()}
    assert names == {
        "top": ("time", "step", "x", "y", "z"),
        "foot": ("time", "step", "x", "y", "z"),
        "stress": ("time", "step", *COMPONENTS),
    }
    simulation.enter("push")
    simulation.run(1e-3, time_step=1e-5, quiet=True)
    top, stress = simulation.probes["top"], simulation.probes["stress"]
    assert (top.dtype["time"], top.dtype["step"]) == (np.dtype("f8"), np.dtype("i8"))
    assert top["step"].tolist() == list(range(101))
    assert np.allclose(top["time"], top["step"] * 1e-5)
    assert stress["step"].tolist() == list(range(0, 101, 10))
    node = simulation.nearest_node((1, 1, 2))
    assert [top[c][-1] for c in "xyz"] == simulation.displacement[node].tolist()
    foot = simulation.probes["foot"]
    assert [foot[c][-1] for c in "xyz"] == simulation.reaction(simulation.nodes(z=0.0)).tolist()
    seen = simulation.probes["top"]
    seen["x"] = 7
    assert not (simulation.probes["top"]["x"] == 7).any()
    simulation.run(1e-3, time_step=1e-5, quiet=True)
    assert simulation.probes["top"]["step"].tolist() == list(range(201))


def test_probes_are_those_of_the_file(tmp_path: Path) -> None:
    simulation = ddem.run_deck(staged(), out=tmp_path / "out", quiet=True)
    found = rows(tmp_path / "out" / "probes.csv")
    for name, history in simulation.probes.items():
        components = history.dtype.names[2:]
        written = [row for row in found if row[f"{name}.{components[0]}"]]
        assert len(written) == len(history) > 2
        assert [int(row["step"]) for row in written] == history["step"].tolist()
        for component in components:
            column_ = [float(row[f"{name}.{component}"]) for row in written]
            assert same(np.array(column_), history[component].copy())


def test_summary(tmp_path: Path) -> None:
    simulation = column(title="tower").build()
    assert simulation.summary["stages"] == []
    steps = simulation.relax(record=tmp_path / "out", quiet=True)
    more = simulation.run(1e-4, record=tmp_path / "out", name="go", quiet=True)
    summary = simulation.summary
    assert (summary["title"], summary["version"]) == ("tower", ddem.__version__)
    sizes = ("blocks", "nodes", "elements", "pairs")
    assert [summary[name] for name in sizes] == [2, 54, 16, 9]
    stages = summary["stages"]
    assert [stage["kind"] for stage in stages] == ["relax", "dynamic"]
    assert [stage["steps"] for stage in stages] == [steps, more]
    assert stages[1]["name"] == "go"
    assert summary["deck"] == column(title="tower").to_deck()
    written = json.loads((tmp_path / "out" / "summary.json").read_text())
    written.pop("peak_memory_bytes"), summary.pop("peak_memory_bytes")
    assert written == summary


def test_h5py_in_the_same_process(tmp_path: Path) -> None:
    # Both have an HDF5 of their own, and may take turns with one file.
    script = f"""
import sys, pathlib
first = sys.argv[1:] == []
folder = pathlib.Path({str(tmp_path)!r})
import h5py
import numpy as np
with h5py.File(folder / "mine.h5", "w") as file: file["a"] = np.arange(5.0)
import ddem
from small import cube, same
simulation = cube().build()
simulation.run(1e-4, record=folder / "out", quiet=True)
simulation.save(folder / "state.h5")
with h5py.File(folder / "out" / "blocks.vtkhdf", "r") as results:
    assert len(results["VTKHDF/Points"]) >= 27
    simulation.step(3)
    ddem.load(folder / "state.h5")
with h5py.File(folder / "mine.h5", "r") as mine:
    simulation.run(1e-4, record=folder / "out", quiet=True)
    assert mine["a"][3] == 3.0
"""
    run_python(script)


def test_a_reader_of_the_results_is_not_in_the_way_for_ever(tmp_path: Path) -> None:
    simulation = column().build()
    out = tmp_path / "out"
    simulation.run(1e-4, record=out, quiet=True)
    with h5py.File(out / "blocks.vtkhdf", "r"):
        try:
            simulation.run(1e-4, record=out, quiet=True)
        except OSError:
            pass
    simulation.run(1e-4, record=out, quiet=True)
    assert same_state(ddem.load(out / "checkpoint.h5"), simulation)

"""Simulations: setting states and forces; steps, runs and stages."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from sample_models import WEIGHT, column, cube, same

# --- states and forces ---


def test_set_displacement_gives_exact_stress() -> None:
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


def test_energy_balances_with_applied_forces() -> None:
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
    names = "kinetic strain_bodies strain_joints friction fracture contact damping external_work balance"
    assert list(energy) == names.split()


def test_applied_force_accelerates_exactly() -> None:
    simulation = cube().build()
    force = simulation.mass[:, None] * [3.0, 0.0, -1.0]
    simulation.apply_force(np.arange(27), force)
    assert np.allclose(simulation.force, force)
    simulation.run(1e-3, quiet=True)
    assert np.allclose(simulation.velocity, [3e-3, 0, -1e-3])
    energy = simulation.energy
    # Central differences use half of the product of the velocities half a step before and after.
    part = 1 - 1 / (2 * simulation.steps) ** 2
    assert energy["external_work"] == pytest.approx(0.5 * 2400 * 10e-6 * part, rel=1e-9)
    assert abs(energy["balance"]) < 1e-9 * energy["external_work"]


def test_applied_forces_are_replaced_added_and_removed() -> None:
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


def test_applied_forces_add_to_loads() -> None:
    model = cube()
    model.load(force=(0, 0, 27.0), z=(0, 1))
    simulation = model.build()
    before = simulation.force
    simulation.apply_force([3], (1, 0, 0))
    assert np.allclose(simulation.force - before, np.eye(27)[3][:, None] * [1, 0, 0])


# --- steps, runs and stages ---


def test_default_is_one_step() -> None:
    simulation = cube().build()
    simulation.step()
    assert simulation.steps == 1


def test_steps_after_a_run_keep_its_time_step() -> None:
    simulation = column().build()
    simulation.run(1e-4, time_step=1e-5, damping=0.1, quiet=True)
    simulation.step(10)
    assert (simulation.steps, simulation.time_step) == (20, 1e-5)
    assert simulation.time == pytest.approx(2e-4, rel=1e-12)


def test_damping_dissipates_energy() -> None:
    def dissipated(**keys: Any) -> float:
        simulation = column().build()
        simulation.run(0.005, quiet=True, **keys)
        assert abs(simulation.energy["balance"]) < 1e-6 * WEIGHT
        return simulation.energy["damping"]

    assert dissipated() == dissipated(damping="none") == dissipated(damping=0) == 0.0
    assert dissipated(damping=0.05) > 0 and dissipated(damping={"local": 0.3}) > 0
    assert dissipated(damping=0.05) == dissipated(damping={"ratio": 0.05})


def test_relax_returns_number_of_steps() -> None:
    simulation = column().build()
    steps = simulation.relax(quiet=True)
    assert steps == simulation.steps > 1
    again = simulation.relax(increments=3, tolerance=1e-3, quiet=True)
    assert simulation.steps == steps + again


def test_stage_applies_its_loads() -> None:
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

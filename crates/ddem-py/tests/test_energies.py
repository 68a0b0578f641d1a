"""Energies balance after any change that a program makes to a simulation."""

from __future__ import annotations

import ddem
import numpy as np
import pytest
from sample_models import ROCK, column


def driven(damping: float | None = None) -> ddem.Simulation:
    """A column in motion, driven by a support."""
    model = column(kinematics="small")
    model.fix("x", z=2.0, velocity=(1.0, 0, 0))
    simulation = model.build()
    simulation.start(damping=damping)
    simulation.step(200)
    return simulation


def relative_imbalance(simulation: ddem.Simulation) -> float:
    """The imbalance relative to the strain energy."""
    energy = simulation.energy
    return abs(energy["balance"]) / (energy["strain_bodies"] + energy["strain_joints"])


@pytest.mark.parametrize("damping", [None, 0.05])
def test_setting_states_keeps_energy_balance(damping: float | None) -> None:
    simulation = driven(damping)
    assert relative_imbalance(simulation) < 1e-9
    simulation.displacement = 1.5 * simulation.displacement
    assert relative_imbalance(simulation) < 1e-9
    simulation.step(100)
    assert relative_imbalance(simulation) < 1e-9
    simulation.velocity = 0.5 * simulation.velocity
    assert relative_imbalance(simulation) < 1e-9
    simulation.step(100)
    assert relative_imbalance(simulation) < 1e-9


def test_applying_forces_in_motion_keeps_energy_balance() -> None:
    simulation = driven(0.05)
    nodes = simulation.nodes(z=(0.5, 1.5))
    for factor in (1.0, -2.0, 0.0):
        simulation.apply_force(nodes, (0, factor * 1e5, 0))
        assert relative_imbalance(simulation) < 1e-9
        simulation.step(50)
        assert relative_imbalance(simulation) < 1e-9


def test_energies_restart_after_divergence_is_reset() -> None:
    simulation = column().build()
    simulation.velocity = np.full((simulation.n_nodes, 3), 1e200)
    with pytest.raises(ddem.Diverged):
        simulation.step(1000)
    zero = np.zeros((simulation.n_nodes, 3))
    simulation.displacement = zero
    simulation.velocity = zero
    simulation.step(10)
    assert all(np.isfinite(value) for value in simulation.energy.values())


@pytest.mark.parametrize(
    ("body", "divisions", "times"),
    [("deformable", 1, 3.0), ("deformable", 2, 1.5), ("deformable", 4, 1.125), ("rigid", 1, 1.0)],
)
def test_lumped_masses_increase_moment_of_inertia(body: str, divisions: int, times: float) -> None:
    model = ddem.Model()
    model.add_blocks(
        origin=(-0.5, -0.5, -0.5), size=(1, 1, 1), divisions=divisions, material=ROCK, body=body
    )
    model.initial(spin=(0, 0, 1))
    turning = model.build(threads=1).angular_momentum[2]
    assert turning == pytest.approx(times * 2400 / 6, rel=1e-12)

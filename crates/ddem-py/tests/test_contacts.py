"""Rigid blocks and contacts: a block that falls on another, slides and comes to rest."""

from __future__ import annotations

import warnings
from pathlib import Path

import ddem
import numpy as np
import pytest

SOFT = ddem.Material(density=2400, young=1e8, poisson=0.25)


def fallen(**contact: float) -> ddem.Model:
    """A rigid cube that lies on a floor that is held, and a deformable one above it."""
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


def test_blocks_fall_on_each_other_and_rest() -> None:
    simulation = fallen(friction=30, restitution=0.1).build()
    simulation.run(0.8, damping={"local": 0.5}, quiet=True)
    u = simulation.displacement
    nodes = len(u)
    assert u.shape == simulation.velocity.shape == (8 + 8 + 27, 3)
    assert np.isfinite(u).all() and np.isfinite(simulation.stress).all()
    # Down by the gap, and no deeper than the springs need.
    assert np.allclose(u[nodes - 27 :, 2], -0.02, atol=2e-3)
    assert np.abs(u[:8]).max() == 0.0
    assert np.abs(simulation.velocity).max() < 0.05
    # The floor bears both, and itself.
    weight = 2400 * 9.81 * (1 + 0.8**3 + 5 * 5 * 0.5)
    assert simulation.reaction(simulation.nodes(set="floor"))[2] == pytest.approx(weight, rel=1e-3)
    assert simulation.energy["friction"] >= 0
    assert simulation.energy["damping"] > 0


def test_what_touches_is_saved_and_gone_on_with(tmp_path: Path) -> None:
    whole = fallen().build()
    whole.run(0.1, damping="none", quiet=True)
    whole.save(tmp_path / "state.h5")
    again = ddem.load(tmp_path / "state.h5")
    for simulation in (whole, again):
        simulation.run(0.1, damping="none", quiet=True)
    for name in ("displacement", "velocity", "stress"):
        assert np.array_equal(getattr(whole, name), getattr(again, name)), name


def test_contacts_that_are_not_meant_are_warned_of() -> None:
    with pytest.warns(UserWarning, match=r"normal_stiffness.*no time step may be longer"):
        fallen(normal_stiffness=1e18).build()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        fallen().build()

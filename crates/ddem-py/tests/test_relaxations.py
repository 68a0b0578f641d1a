"""Supports and loads that a relaxation needs, and the stage that a call begins."""

from __future__ import annotations

import warnings

import ddem
import numpy as np
import pytest
from sample_models import ROCK, SEAM, column, cube, staged


def warned(call: object) -> list[str]:
    """The warnings of a call."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        call()  # type: ignore[operator]
    return [str(warning.message) for warning in caught]


def test_missing_supports_are_named() -> None:
    simulation = cube().build()
    with pytest.raises(ddem.ModelError, match="translation along x.*rotation about z"):
        simulation.relax()
    assert simulation.steps == 0
    model = ddem.Model(gravity=(0, 0, -9.81))
    model.add_blocks(size=(1, 1, 2), count=(1, 1, 2), divisions=2, material=ROCK, joint=SEAM)
    model.fix("z", z=0.0)
    with pytest.raises(ddem.ModelError, match="translation along x, translation along y, rot"):
        model.build().relax()
    simulation.run(1e-4, quiet=True)


def test_load_of_zero_in_relaxation_warns() -> None:
    for history in ({"ramp": 0.1}, lambda time: 10 * time):
        model = column()
        model.load(pressure=1e6, z=2.0, history=history)
        simulation = model.build()
        message = warned(lambda simulation=simulation: simulation.relax(quiet=True))
        assert any("load 0 does not act" in text for text in message)
        assert warned(lambda simulation=simulation: simulation.run(1e-4, quiet=True)) == []


def test_stage_name_enters_its_stage() -> None:
    by_name, by_hand = staged().build(), staged().build()
    by_name.relax(tolerance=1e-5, name="settle", quiet=True)
    by_hand.relax(tolerance=1e-5, quiet=True)
    by_name.run(2e-3, damping=0.02, name="push", quiet=True)
    by_hand.enter("push")
    by_hand.run(2e-3, damping=0.02, quiet=True)
    assert np.array_equal(by_name.displacement, by_hand.displacement)
    # The second run does not begin the stage again: the load is past its ramp.
    by_name.run(1e-4, name="push", quiet=True)
    by_hand.run(1e-4, quiet=True)
    assert np.array_equal(by_name.displacement, by_hand.displacement)


def test_misspelt_stage_name_warns() -> None:
    simulation = staged().build()
    message = warned(lambda: simulation.run(1e-5, name="psuh", quiet=True))
    assert any(text.endswith("[unknown-stage]") and "`push`" in text for text in message)
    assert warned(lambda: simulation.run(1e-5, name="shake", quiet=True)) == []
    # The stage has begun: a name like it is another name for the results.
    simulation.enter("push")
    assert warned(lambda: simulation.run(1e-5, name="push2", quiet=True)) == []


def test_call_without_name_enters_no_stage() -> None:
    model = column()
    model.load(traction=(1e5, 0, 0), z=2.0, from_="run 2")
    model.stage("first", kind="dynamic", duration=1.0)
    model.stage("run 2", kind="dynamic", duration=1.0)
    simulation = model.build()
    simulation.run(1e-4, quiet=True)
    simulation.run(1e-4, quiet=True)
    assert abs(simulation.displacement[:, 0].mean()) < 1e-12


def test_damping_persists_after_relaxation() -> None:
    simulation = column().build()
    simulation.start(damping=0.05)
    simulation.relax(quiet=True)
    simulation.velocity = np.full((simulation.n_nodes, 3), 0.01)
    simulation.step(50)
    assert simulation.energy["damping"] > 0


def test_collapse_reports_ratio_and_moving_blocks() -> None:
    weak = ddem.Joint(thickness=0.01, material=ROCK, cohesion=1e3, friction=20, tension=1e3)
    model = column(weak, contact=False)
    model.load(traction=(0, 0, 1e6), z=2.0)
    simulation = model.build()
    with pytest.raises(ddem.Collapsed) as caught:
        simulation.relax(quiet=True)
    assert 0 < caught.value.ratio == simulation.unbalanced
    assert caught.value.blocks == (0, 1)
    ((name, block, distance, direction),) = caught.value.moving
    assert (name, block) == ("all", 1) and distance > 1e-6
    assert direction == pytest.approx((0, 0, 1), abs=1e-2)
    # A failed relaxation is a result, too.
    assert model.build().relax(on_failure="continue", quiet=True) > 0

"""Exceptions: their classes, their attributes and copies of them."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import ddem
import numpy as np
import pytest
from sample_models import breaking, column


def test_exception_hierarchy() -> None:
    for kind in (ddem.Busy, ddem.Diverged, ddem.ModelError, ddem.NotConverged, ddem.Collapsed):
        assert issubclass(kind, ddem.Error)
    assert issubclass(ddem.Error, Exception)
    assert issubclass(ddem.ModelError, ValueError)
    assert issubclass(ddem.Collapsed, ddem.NotConverged)
    assert not issubclass(ddem.Diverged, ValueError)


@pytest.mark.parametrize(
    "error",
    [
        ddem.Error("a"),
        ddem.Busy("a"),
        ddem.NotConverged("a", 0.5),
        ddem.Collapsed("a", 0.5, (1, 2), 3.0, [("slope", 2, 3.0, (0.0, 0.0, -1.0))]),
        ddem.Diverged("a", 1, 2.0, 3, 4),
        ddem.ModelError("a", [("density", "is wrong", None, "out-of-range")]),
        ddem.ModelError("a"),
    ],
)
@pytest.mark.parametrize(
    "copied", [copy.copy, copy.deepcopy, lambda a: pickle.loads(pickle.dumps(a))]
)
def test_exceptions_can_be_copied_and_pickled(error: ddem.Error, copied: Any) -> None:
    again = copied(error)
    assert type(again) is type(error)
    assert str(again) == str(error) == "a"
    assert again.__dict__ == error.__dict__
    assert again.args == error.args


def test_unconverged_relaxation_raises_not_converged() -> None:
    simulation = column().build()
    with pytest.raises(ddem.NotConverged) as caught:
        simulation.relax(max_steps=7, quiet=True)
    error = caught.value
    assert error.code == "not-converged" and str(error).endswith("[not-converged]")
    assert isinstance(error.ratio, float) and 1e-6 < error.ratio < 10
    assert error.ratio == simulation.unbalanced
    assert str(error).startswith("not in equilibrium after 7 steps")
    assert simulation.steps >= 7
    assert simulation.relax(quiet=True) > 0, "it may go on"


def test_endless_separation_raises_collapsed() -> None:
    model = breaking()
    model.load(traction=(0, 0, 5e5), z=2.0)
    simulation = model.build()
    with pytest.raises(ddem.NotConverged) as caught:
        simulation.relax(quiet=True)
    error = caught.value
    assert isinstance(error, ddem.Collapsed)
    assert tuple(sorted(error.blocks)) == (0, 1)
    assert error.distance > 0 and error.ratio > 0
    assert np.isfinite(simulation.displacement).all()


@pytest.mark.parametrize("how", ["run", "step"])
def test_divergence_raises_diverged(how: str) -> None:
    simulation = column().build()
    velocity = np.zeros((54, 3))
    velocity[40] = [1e300, -1e300, 1e300]
    simulation.velocity = velocity
    calls: dict[str, Callable[[], Any]] = {
        "run": lambda: simulation.run(1e-2, quiet=True),
        "step": lambda: simulation.step(1000),
    }
    with pytest.raises(ddem.Diverged) as caught:
        calls[how]()
    error = caught.value
    assert simulation.node_block[error.node] == error.block
    assert error.block == 1, "the block that was thrown"
    assert 0 < error.step < 1000 and 0 <= error.time < 1e-2
    assert f"diverged at step {error.step}" in str(error)
    assert f"node {error.node} of block {error.block}" in str(error)
    assert simulation.steps == error.step
    # A state that can be set can be corrected.
    simulation.displacement = np.zeros((54, 3))
    simulation.velocity = np.zeros((54, 3))
    simulation.step(3)
    assert np.isfinite(simulation.displacement).all()


def test_exceptions_have_the_code_of_their_message(tmp_path: Path) -> None:
    simulation = column().build()
    wrong = tmp_path / "wrong.toml"
    wrong.write_text("title = ")

    def use(seen: ddem.Simulation) -> None:
        seen.step()

    calls: dict[str, Callable[[], Any]] = {
        "busy": lambda: simulation.run(1e-4, callback=use, quiet=True),
        "unknown-key": lambda: simulation.run(1e-4, every_step=3),  # type: ignore[call-arg]
        "syntax": lambda: ddem.Model.from_deck(wrong),
        "not-converged": lambda: simulation.relax(max_steps=2, quiet=True),
        "unstable-time-step": lambda: simulation.start(time_step=1.0),
    }
    for code, call in calls.items():
        with pytest.raises(ddem.Error) as caught:
            call()
        assert caught.value.code == code and f"[{code}]" in str(caught.value)
    with pytest.raises(ddem.Busy, match=r"^the simulation is busy: another thread is using it.*\[busy\]$"):
        calls["busy"]()


def test_errors_of_the_system_have_codes(tmp_path: Path) -> None:
    nothing = tmp_path / "nothing" / "deck.toml"
    with pytest.raises(FileNotFoundError, match=r"\[file-access\]: '.*nothing"):
        column().to_deck(nothing)
    (tmp_path / "deck.toml").write_text("")
    with pytest.raises(FileNotFoundError, match=r"did you mean '.*deck.toml'\? \[invalid-file\]"):
        ddem.run_deck(tmp_path / "dek.toml")

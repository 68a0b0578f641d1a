"""Functions as histories: times of their calls, their values and their exceptions."""

from __future__ import annotations

import gc
import weakref
from pathlib import Path
from typing import Any

import ddem
import numpy as np
import pytest
from sample_models import column, cube, run_python, same, same_state


def table(time: float) -> float:
    """The linear ramp that the core computes, in the core's order of operations."""
    return time / 1e-3 if time < 1e-3 else 1.0


@pytest.mark.parametrize("kind", ["load", "fix", "boundary", "charge"])
def test_function_equals_history_of_deck(kind: str) -> None:
    def simulate(history: Any) -> ddem.Simulation:
        model = column()
        if kind == "load":
            model.load(traction=(1e5, 0, 0), z=2.0, history=history)
        elif kind == "fix":
            model.fix("x", velocity=(0.1, 0, 0), z=2.0, history=history)
        elif kind == "charge":
            model.charge(pressure=1e6, z=1.0, history=history)
        else:
            model.boundary("viscous", velocity=(0.1, 0, 0), z=2.0, history=history)
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


def test_function_gets_times_of_the_run() -> None:
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


def test_function_time_starts_with_its_stage() -> None:
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


def test_load_needs_the_function_again(tmp_path: Path) -> None:
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


class Wrong(Exception):
    """Exception of a history."""


@pytest.mark.parametrize("how", ["run", "step", "relax"])
def test_exception_of_history_is_raised(how: str) -> None:
    broken = [False]

    def history(time: float) -> float:
        if broken[0]:
            raise Wrong("no value here")
        return 1.0

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


def test_exception_during_run_leaves_valid_state() -> None:
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


@pytest.mark.parametrize("section", ["load", "fix", "boundary", "charge"])
@pytest.mark.parametrize("how", ["run", "step"])
def test_exception_is_raised_once(how: str, section: str) -> None:
    """Measurements after the failed call need the same value of the function."""

    def history(time: float) -> float:
        if time > 5e-4:
            raise Wrong(f"no value at {time}")
        return 1.0

    model = column()
    given: dict[str, Any] = {
        "load": {"force": (1e4, 0, 0)},
        "fix": {"axes": "x", "velocity": (0.1, 0, 0)},
        "boundary": {"kind": "viscous", "velocity": (0.1, 0, 0)},
        "charge": {"pressure": 1e6},
    }
    place = {"z": 1.0 if section == "charge" else 2.0}
    getattr(model, section)(**given[section], **place, history=history)
    simulation = model.build()

    def move() -> None:
        simulation.run(1e-3, quiet=True) if how == "run" else simulation.step(1000)

    with pytest.raises(Wrong) as caught:
        move()
    assert [entry.name for entry in caught.traceback][-1] == "history"
    assert np.isfinite(simulation.energy["balance"])
    assert np.isfinite(simulation.displacement).all()
    simulation.apply_force(0, (1, 0, 0))
    assert np.isfinite(simulation.force).all()
    assert simulation.summary["blocks"] == 2
    # The simulation cannot go on.
    with pytest.raises(Wrong):
        move()


def test_measurement_raises_exception_of_history() -> None:
    def history(time: float) -> float:
        raise Wrong

    model = column()
    model.load(force=(1e4, 0, 0), z=2.0, history=history)
    simulation = model.build()
    with pytest.raises(Wrong):
        simulation.force
    assert np.isfinite(simulation.force).all()
    with pytest.raises(Wrong):
        simulation.step()


@pytest.mark.parametrize("value", [None, "a", float("nan"), float("inf"), 1j, [1.0], np.zeros(2)])
def test_history_must_return_numbers(value: Any) -> None:
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


def test_history_may_use_another_simulation() -> None:
    # One thread for both: the thread that computes also calls the history.
    script = """
import ddem
from sample_models import cube
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


def test_history_cannot_use_its_own_simulation() -> None:
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


def test_history_cycles_are_garbage_collected() -> None:
    class Machine:
        def __init__(self) -> None:
            self.model = column()
            self.model.load(pressure=1e5, z=2.0, history=self.factor)
            self.simulation = self.model.build(threads=1)

        def factor(self, time: float) -> float:
            return 1.0

    machine = Machine()
    machine.simulation.step(10)
    gone = weakref.ref(machine)
    del machine
    gc.collect()
    assert gone() is None


def test_history_in_other_calls_is_refused() -> None:
    simulation = column().build()
    for call in (
        lambda: simulation.run(1e-4, history=lambda time: 1.0),
        lambda: simulation.nodes(history=lambda time: 1.0),
        lambda: ddem.Model(history=lambda time: 1.0),
        lambda: ddem.Material(density=1, young=1, poisson=0, history=lambda time: 1.0),
    ):
        with pytest.raises(ddem.ModelError, match="history: only loads"):
            call()

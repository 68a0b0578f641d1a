"""Callbacks during runs, and runs that end by a condition."""

from __future__ import annotations

import threading
import warnings
from pathlib import Path
from typing import Any

import ddem
import numpy as np
import pytest
from sample_models import (
    assert_same_results,
    assert_still_works,
    breaking,
    column,
    refused,
    same,
    same_state,
    staged,
)

DURATION = 2e-3


def probed() -> ddem.Simulation:
    model = breaking()
    model.probe("fine", at=(0, 0, 2), every=1e-4)
    return model.build()


def look_at_everything(simulation: ddem.Simulation) -> None:
    for name in dir(simulation):
        if not name.startswith("_") and not name.startswith("peak_"):
            getattr(simulation, name)


def test_callback_changes_no_bit(tmp_path: Path) -> None:
    plain, observed = probed(), probed()
    options: dict[str, Any] = {"damping": 0.02, "frames": 7, "quiet": True}
    plain.run(DURATION, record=tmp_path / "plain", **options)
    seen: list[ddem.Simulation] = []

    def callback(simulation: ddem.Simulation) -> None:
        seen.append(simulation)
        look_at_everything(simulation)

    steps = observed.run(
        DURATION,
        record=tmp_path / "observed",
        callback=callback,
        until=lambda simulation: simulation.time > 1.0,
        every=3e-5,
        **options,
    )
    assert steps == observed.steps and len(seen) > 50
    assert all(simulation is observed for simulation in seen)
    assert (observed.pairs.state > 0).any()
    assert same_state(plain, observed)
    assert all(same(plain.probes[name], observed.probes[name]) for name in plain.probes)
    assert_same_results(tmp_path / "plain", tmp_path / "observed")


def test_callback_interval_equals_probe_interval() -> None:
    simulation, times = probed(), []
    simulation.run(DURATION, callback=lambda s: times.append(s.time), every=1e-4, quiet=True)
    # A probe has one more sample, at the start.
    assert times == simulation.probes["fine"]["time"][1:].tolist()
    assert times[-1] == simulation.time


def test_default_is_a_hundred_callbacks() -> None:
    simulation, times = column().build(), []
    step = simulation.critical_step
    duration = 400 * step
    simulation.run(duration, callback=lambda s: times.append(s.time), quiet=True)
    assert len(times) in range(85, 116)
    assert np.allclose(np.diff(times)[:-1], duration / 100, atol=1.1 * step)


def test_until_ends_run_like_its_duration(tmp_path: Path) -> None:
    simulation, looks = probed(), []

    def until(simulation: ddem.Simulation) -> np.bool_:
        looks.append(simulation.time)
        return np.bool_(simulation.displacement[:, 2].max() > 2e-5)

    simulation.run(1.0, until=until, every=1e-4, record=tmp_path, frames=3, quiet=True)
    assert simulation.displacement[:, 2].max() > 2e-5
    assert looks[-1] == simulation.time < 0.01
    # The files have all data due at the end, once.
    results = ddem.Results(tmp_path)
    for last in (results.energy.time, results.probes["fine"].time, results.probes["top"].time):
        assert last[-1] == simulation.time and (np.diff(last) > 0).all()
    assert results.summary["stages"][-1]["steps"] == simulation.steps
    pytest.importorskip("pyvista")
    assert results.times[-1] == simulation.time
    assert np.array_equal(results[-1].displacement, simulation.displacement)
    # The simulation can continue.
    other = probed()
    other.run(1.0, until=lambda s: s.time >= simulation.time, every=1e-4, quiet=True)
    assert same_state(simulation, other)
    assert_still_works(simulation)


def test_callback_precedes_until_and_runs_once_at_end() -> None:
    calls: list[str] = []
    simulation = column().build()
    step = simulation.critical_step

    def until(_: ddem.Simulation) -> bool:
        calls.append("until")
        return len(calls) >= 4

    simulation.run(
        100 * step, every=10 * step, until=until, callback=lambda _: calls.append("call"), quiet=True
    )
    assert calls == ["call", "until"] * 2


@pytest.mark.parametrize("which", ["until", "callback"])
@pytest.mark.parametrize("error", [KeyError("mine"), KeyboardInterrupt(), SystemExit(3)])
def test_exception_of_callback_is_raised(
    which: str, error: BaseException, tmp_path: Path
) -> None:
    simulation = column().build()

    def fails(simulation: ddem.Simulation) -> None:
        if simulation.time > 2e-4:
            raise error

    with pytest.raises(type(error)) as caught:
        simulation.run(1e-3, every=1e-4, record=tmp_path, quiet=True, **{which: fails})
    assert caught.value is error
    assert 2e-4 < simulation.time < 1e-3
    assert_still_works(simulation)
    # The folder is complete, and its run can continue.
    simulation.run(1e-4, record=tmp_path, quiet=True)
    assert ddem.Results(tmp_path).times[-1] == simulation.time
    assert ddem.load(tmp_path).time == simulation.time


def test_exception_at_end_of_run_is_raised() -> None:
    simulation = column().build()

    def fails(simulation: ddem.Simulation) -> None:
        if simulation.time >= 1e-3:
            raise KeyError("late")

    with pytest.raises(KeyError, match="late"):
        simulation.run(1e-3, every=1e-4, callback=fails, quiet=True)
    assert simulation.time == pytest.approx(1e-3, rel=1e-12)
    assert_still_works(simulation)


def test_stepping_in_callback_is_refused() -> None:
    refusals: list[type[BaseException]] = []

    def tries(simulation: ddem.Simulation) -> None:
        for call in (
            lambda: simulation.run(1e-4),
            lambda: simulation.relax(),
            lambda: simulation.step(),
            lambda: simulation.start(),
            lambda: simulation.enter("push"),
            lambda: ddem.factor_of_safety(simulation),
        ):
            with pytest.raises(ddem.Busy):
                call()
            refusals.append(ddem.Busy)

    simulation, plain = staged().build(), staged().build()
    for one, keys in ((plain, {}), (simulation, {"callback": tries, "every": 1.0})):
        one.relax(quiet=True)
        one.run(2e-4, name="push", quiet=True, **keys)
    assert len(refusals) == 6
    assert same_state(plain, simulation)


def test_callback_may_apply_forces_and_save(tmp_path: Path) -> None:
    """A spring that the program adds, step by step and in a run."""
    looped, observed = (column().build() for _ in range(2))
    top = looped.nodes(z=2.0)

    def pull(simulation: ddem.Simulation) -> None:
        simulation.apply_force(top, -1e6 * simulation.field("displacement", nodes=top))

    step = 0.5 * looped.critical_step
    looped.start(time_step=step)
    for _ in range(50):
        looped.step()
        pull(looped)
    observed.run(50 * step, time_step=step, every=step, callback=pull, quiet=True)
    assert observed.steps == looped.steps and np.abs(observed.displacement).max() > 0.0
    assert same(observed.displacement, looped.displacement)

    simulation, saved = column().build(), tmp_path / "saved.h5"
    simulation.run(
        1e-3, every=4e-4, until=lambda s: s.save(saved) or s.time > 5e-4, time_step=1e-5, quiet=True
    )
    # The state was saved in the middle of its last step, and continues from there.
    loaded = ddem.load(saved)
    assert loaded.steps == simulation.steps
    assert same(loaded.displacement, simulation.displacement)


def test_other_threads_may_read_during_run() -> None:
    simulation, over, seen = column().build(), threading.Event(), []

    def look() -> None:
        while not over.is_set():
            try:
                seen.append(simulation.time)
            except ddem.Busy:
                seen.append(-1.0)

    thread = threading.Thread(target=look)
    thread.start()
    step = simulation_step()
    steps = simulation.run(300 * step, every=step, callback=lambda s: None, quiet=True)
    over.set()
    thread.join(30)
    assert steps >= 300 and seen


def simulation_step() -> float:
    return column().build().critical_step


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"every": 1e-4}, "every: needs `until` or `callback`"),
        ({"until": 3}, "until: must be a function of the simulation"),
        ({"callback": "look"}, "callback: must be a function of the simulation"),
        ({"callback": print, "every": 0.0}, "every: must be a finite number above 0, found 0"),
        ({"callback": print, "every": float("nan")}, "every: must be a finite number above 0"),
        ({"calback": print}, "calback: unknown key `calback` (did you mean `callback`?"),
        ({"evry": 1e-4}, "evry: unknown key `evry` (did you mean `every`?"),
        ({"until_rest": 3}, "until_rest: expected"),
        ({"tolerance": 1e-5}, "tolerance"),
        ({"callback": print, "every": "often"}, "every: must be a number of seconds"),
    ],
)
def test_invalid_arguments_are_refused(keys: dict[str, Any], message: str) -> None:
    simulation = column().build()
    assert message in refused(lambda: simulation.run(1e-4, quiet=True, **keys))
    assert simulation.steps == 0
    assert_still_works(simulation)


def messages(call: Any) -> list[str]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        call()
    assert all(warning.category is UserWarning for warning in caught)
    return [str(warning.message) for warning in caught]


def test_waiting_stages_warn_once() -> None:
    simulation = staged().build()
    assert messages(lambda: simulation.relax(quiet=True)) == []
    (message,) = messages(lambda: simulation.run(1e-4, quiet=True))
    assert message.endswith("[waiting-stages]") and 'run(..., name="push")' in message
    assert messages(lambda: simulation.run(1e-4, quiet=True)) == []
    # No stage is waiting any more, and a named run never warns.
    named = staged().build()
    assert messages(lambda: named.run(1e-4, name="settle", quiet=True)) == []
    named.enter("push")
    assert messages(lambda: named.run(1e-4, quiet=True)) == []


def test_every_waiting_stage_is_named() -> None:
    model = column()
    model.stage("rest", kind="relax")
    for name in ("push", "pull", "idle"):
        model.stage(name, kind="dynamic", duration=1e-3)
    model.load(traction=(1e5, 0, 0), z=2.0, from_="push")
    model.fix("y", z=2.0, from_="pull")
    simulation = model.build()
    (message,) = messages(lambda: simulation.run(1e-4, quiet=True))
    assert "the stages `push`, `pull` and" in message and "idle" not in message
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(UserWarning):
            model.build().run(1e-4, quiet=True)

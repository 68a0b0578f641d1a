"""Ctrl-C stops long calls at once, and they can be continued."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import ddem
import pytest
from sample_models import (
    ENDLESS,
    assert_same_results,
    assert_still_works,
    breaking,
    column,
    environment,
    long,
    same_state,
)

#: A call ends within 0.1 s of Ctrl-C; on a busy machine it may take longer [s].
AT_ONCE = 1.0


@contextmanager
def interrupted(after: float = 0.15) -> Iterator[list[float]]:
    """Sends Ctrl-C after a while and records the time."""
    at: list[float] = []

    def interrupt() -> None:
        at.append(time.perf_counter())
        signal.raise_signal(signal.SIGINT)

    timer = threading.Timer(after, interrupt)
    timer.start()
    try:
        yield at
    finally:
        timer.cancel()
        timer.join()


@pytest.mark.parametrize("how", ["run", "step", "relax", "record"])
def test_ctrl_c_stops_immediately(how: str, tmp_path: Path) -> None:
    simulation = long()
    simulation.critical_step
    calls: dict[str, Callable[[], Any]] = {
        "run": lambda: simulation.run(ENDLESS, quiet=True),
        "step": lambda: simulation.step(10**12, quiet=True),
        "relax": lambda: simulation.relax(tolerance=1e-300, max_steps=10**12, quiet=True),
        "record": lambda: simulation.run(ENDLESS, record=tmp_path / "out", quiet=True),
    }
    with interrupted() as at, pytest.raises(KeyboardInterrupt):
        calls[how]()
    assert time.perf_counter() - at[0] < AT_ONCE
    assert simulation.steps > 0
    assert_still_works(simulation)
    if how == "record":
        simulation.run(1e-4, record=tmp_path / "out", quiet=True)
        assert same_state(ddem.load(tmp_path / "out" / "checkpoint.h5"), simulation)


def test_user_signal_handler_is_called() -> None:
    class Enough(Exception):
        pass

    def handler(number: int, frame: Any) -> None:
        raise Enough

    before = signal.signal(signal.SIGINT, handler)
    try:
        simulation = long()
        with interrupted(), pytest.raises(Enough):
            simulation.run(ENDLESS, quiet=True)
        assert_still_works(simulation)
        asked: list[int] = []
        signal.signal(signal.SIGINT, lambda number, frame: asked.append(number))
        with interrupted(0.05):
            simulation.step(1000, quiet=True)
        assert asked == [signal.SIGINT], "a handler that raises nothing stops nothing"
    finally:
        signal.signal(signal.SIGINT, before)


def test_ctrl_c_changes_no_bit() -> None:
    simulation, reference = (column(divisions=6).build() for _ in range(2))
    simulation.start(damping=0.05)
    reference.start(damping=0.05)
    with interrupted(0.1), pytest.raises(KeyboardInterrupt):
        simulation.step(10**9, quiet=True)
    reference.step(simulation.steps)
    assert simulation.steps > 0
    assert same_state(simulation, reference)


def test_run_continues_after_ctrl_c() -> None:
    simulation = long()
    step = 0.5 * simulation.critical_step
    with interrupted(), pytest.raises(KeyboardInterrupt):
        simulation.run(ENDLESS, time_step=step, quiet=True)
    done = simulation.steps
    assert simulation.time == pytest.approx(done * step)
    assert simulation.run(20 * step, time_step=step, quiet=True) == 20
    assert simulation.steps == done + 20
    assert abs(simulation.energy["balance"]) < 1e-6 * simulation.energy["external_work"]


def endless(title: str) -> ddem.Model:
    """A deck that takes about a second."""
    model = breaking(divisions=3)
    model = ddem.Model.from_deck({**model.deck, "title": title})
    model.stage("settle", kind="relax")
    model.stage("pull", kind="dynamic", duration=1.6, fields_every=0.2, damping=0.01)
    return model


def test_deck_resumes_after_ctrl_c(tmp_path: Path) -> None:
    model = endless("goes on")
    out, whole = tmp_path / "out", tmp_path / "whole"
    times = 0
    resume = False
    for _ in range(3):
        try:
            with interrupted(0.12) as at:
                ddem.run_deck(model, out=out, resume=resume, quiet=True)
            pytest.fail("ended before it was interrupted")
        except KeyboardInterrupt as error:
            assert time.perf_counter() - at[0] < AT_ONCE
            assert "resume=True" in str(error)
            times += 1
        assert (out / "checkpoint.h5").is_file()
        resume = True
    simulation = ddem.run_deck(model, out=out, resume=True, quiet=True)
    reference = ddem.run_deck(model, out=whole, quiet=True)
    assert times == 3
    assert same_state(simulation, reference)
    assert_same_results(out, whole)
    for name in reference.probes:
        # The history starts at the resumed step or at the beginning, and its values are equal.
        tail = simulation.probes[name]
        assert len(tail) > 0
        assert tail.tobytes() == reference.probes[name][-len(tail) :].tobytes()


def test_resume_without_a_checkpoint_starts(tmp_path: Path) -> None:
    deck = Path(__file__).parents[3] / "examples" / "block.toml"
    ddem.run_deck(deck, out=tmp_path / "out", resume=True, quiet=True)
    assert (tmp_path / "out" / "summary.json").exists()


def lines_after_ctrl_c(
    script: str, *arguments: str, after: float = 0.0, within: float = AT_ONCE
) -> list[str]:
    """Lines of a script that gets Ctrl-C some seconds after it has said "go".

    The first one comes within a time.
    """
    with subprocess.Popen(
        [sys.executable, "-c", script, *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment(),
    ) as process:
        try:
            assert process.stdout is not None and process.stdout.readline() == "go\n"
            time.sleep(after)
            process.send_signal(signal.SIGINT)
            start = time.perf_counter()
            first = process.stdout.readline()
            assert time.perf_counter() - start < within
            lines = [first, *process.stdout]
            assert process.wait(10) == 0
            return lines
        finally:
            process.kill()


def test_ctrl_c_in_terminal_stops_run_deck(tmp_path: Path) -> None:
    script = """
import sys
from sample_models import long
simulation = long()
told = False
def tell(simulation):
    global told
    if not told:
        told = True
        print("go", flush=True)
try:
    simulation.run(1e3, every=1e-4, callback=tell)
except KeyboardInterrupt:
    before = simulation.steps
    simulation.step(2)
    print("stopped", simulation.steps - before, flush=True)
"""
    assert lines_after_ctrl_c(script) == ["stopped 2\n"]


@pytest.mark.parametrize("how", ["build", "factor_of_safety", "run_deck", "cells"])
def test_ctrl_c_stops_building(how: str, tmp_path: Path) -> None:
    """The model takes ten seconds and more to build; the processes end before that."""
    script = """
import sys
import ddem
from sample_models import ROCK, SMOOTH, cube
how, out = sys.argv[1:]
model = ddem.Model(title="hill")
model.add_region(box=((0, 0, 0), (40, 40, 30)), material=ROCK)
for dip, direction in ((35, 270), (75, 80), (80, 170)):
    planes = {"dip": dip, "dip_direction": direction, "spacing": 0.6 if how == "cells" else 1.6}
    model.cut(set=planes, joint=SMOOTH)
model.stage("weight", kind="relax")
calls = {
    "build": model.build,
    "cells": model.cells,
    "factor_of_safety": lambda: ddem.factor_of_safety(model),
    "run_deck": lambda: ddem.run_deck(model, out=out + "/results", quiet=True),
}
print("go", flush=True)
try:
    calls[how]()
except KeyboardInterrupt:
    print("stopped", flush=True)
    simulation = cube().build()
    simulation.step(2)
    print("steps", simulation.steps, flush=True)
"""
    told = lines_after_ctrl_c(script, how, str(tmp_path), after=0.5, within=5 * AT_ONCE)
    assert told == ["stopped\n", "steps 2\n"]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("how", ["start", "critical_step", "relax", "run"])
def test_ctrl_c_stops_before_first_step(how: str) -> None:
    """In a large model the search for the critical step and for the masses takes seconds."""
    model = column(divisions=20)
    calls: dict[str, Callable[[ddem.Simulation], Any]] = {
        "start": lambda simulation: simulation.start(),
        "critical_step": lambda simulation: simulation.critical_step,
        "relax": lambda simulation: simulation.relax(quiet=True),
        "run": lambda simulation: simulation.run(1e-6, quiet=True),
    }
    simulation = model.build(threads=1)
    before = simulation.displacement
    with interrupted(0.01) as at, pytest.raises(KeyboardInterrupt):
        while True:
            # The search may have ended before the interrupt.
            calls[how](simulation)
            simulation = model.build(threads=1)
    assert time.perf_counter() - at[0] < AT_ONCE
    assert simulation.n_nodes == len(before)
    simulation.step()
    assert simulation.steps >= 1


class Interrupting:
    """An argument whose conversion is interrupted."""

    def interrupt(self, *_: Any) -> Any:
        raise KeyboardInterrupt

    __array__ = __index__ = __float__ = __fspath__ = tolist = interrupt


@pytest.mark.parametrize(
    "call",
    [
        lambda it: ddem.Material(density=it, young=1, poisson=0),
        lambda it: column().load(traction=it),
        lambda it: column().build().apply_force(it, (0, 0, 1)),
        lambda it: column().build().apply_force(0, it),
        lambda it: column().build().step(it),
        lambda it: ddem.run_deck(it),
        lambda it: ddem.Model.from_deck(it),
        lambda it: setattr(column().build(), "displacement", it),
    ],
)
def test_ctrl_c_during_argument_conversion_is_raised(call: Callable[[Any], Any]) -> None:
    with pytest.raises(KeyboardInterrupt):
        call(Interrupting())


def test_ctrl_c_takes_precedence_over_errors() -> None:
    """A loop over models that ignores errors can be stopped."""

    def late(time: float) -> float:
        if time > 1e-4:
            signal.raise_signal(signal.SIGINT)
            raise ValueError("late")
        return 1.0

    model = column()
    model.load(pressure=1e5, z=2.0, history=late)
    with pytest.raises(KeyboardInterrupt):
        model.build().run(1e-3, quiet=True)


def test_ctrl_c_is_raised_despite_failing_progress_bar(monkeypatch: Any) -> None:
    import ddem._progress

    def close(bar: Any) -> None:
        raise RuntimeError("close")

    monkeypatch.setattr(ddem._progress.ProgressBar, "close", close)
    simulation = long()
    # Interrupts before the first progress: a new progress bar closes the one before it.
    with interrupted(0.05), pytest.raises(KeyboardInterrupt):
        simulation.run(ENDLESS)

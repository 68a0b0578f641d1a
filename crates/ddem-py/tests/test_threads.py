"""Long calls release the interpreter for other threads; only one thread may use a simulation."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import ddem
import numpy as np
import pytest
from sample_models import (
    ENDLESS,
    assert_still_works,
    breaking,
    column,
    long,
    run_python,
    same_state,
)


@contextmanager
def elsewhere(call: Callable[[], Any]) -> Iterator[threading.Thread]:
    """A call in another thread, from its start to its end."""
    thread = threading.Thread(target=call)
    thread.start()
    yield thread
    thread.join(30)
    assert not thread.is_alive()


@pytest.mark.parametrize("how", ["run", "step", "relax"])
def test_other_threads_run_during_a_call(how: str) -> None:
    simulation = long()
    calls = {
        "run": lambda: simulation.run(simulation.critical_step * 600, quiet=True),
        "step": lambda: simulation.step(600, quiet=True),
        "relax": lambda: simulation.relax(tolerance=1e-12, quiet=True),
    }
    counts: list[int] = []
    over = threading.Event()

    def count() -> None:
        number = 0
        while not over.is_set():
            number += 1
        counts.append(number)

    start = time.perf_counter()
    for _ in range(200_000):
        over.is_set()
    alone = 200_000 / (time.perf_counter() - start)
    with elsewhere(count):
        start = time.perf_counter()
        calls[how]()
        seconds = time.perf_counter() - start
        over.set()
    # The run shares the cores with the other thread, but not the interpreter.
    assert counts[0] > 0.05 * alone * seconds
    assert seconds > 0.01, "too short to tell"


def uses(simulation: ddem.Simulation, folder: Path) -> dict[str, Callable[[], Any]]:
    """All uses of a simulation."""
    zeros = np.zeros((simulation.n_nodes, 3))
    all_: dict[str, Callable[[], Any]] = {
        "relax": lambda: simulation.relax(quiet=True),
        "run": lambda: simulation.run(1.0, quiet=True),
        "step": lambda: simulation.step(),
        "start": lambda: simulation.start(),
        "enter": lambda: simulation.enter("a"),
        "apply_force": lambda: simulation.apply_force([0], (1, 0, 0)),
        "mesh": lambda: simulation.mesh(),
        "save": lambda: simulation.save(folder / "state.h5"),
        "field": lambda: simulation.field("velocity"),
        "nodes": lambda: simulation.nodes(z=0.0),
        "nearest_node": lambda: simulation.nearest_node((0, 0, 0)),
        "reaction": lambda: simulation.reaction([0]),
        "displacement =": lambda: setattr(simulation, "displacement", zeros),
        "velocity =": lambda: setattr(simulation, "velocity", zeros),
    }
    for name in dir(ddem.Simulation):
        if not name.startswith("_") and not callable(getattr(ddem.Simulation, name)):
            all_[name] = lambda name=name: getattr(simulation, name)
    return all_


def test_simulation_is_used_by_one_thread_at_a_time(tmp_path: Path) -> None:
    model = column(divisions=8)
    model.stage("a", kind="relax")
    simulation = model.build(threads=1)
    calls = uses(simulation, tmp_path)
    public = {name for name in dir(ddem.Simulation) if not name.startswith("_")}
    assert public <= set(calls), "a method of which this test does not know"
    failed: dict[str, BaseException | None] = {}
    begun = threading.Event()

    def use() -> None:
        begun.wait()
        deadline = time.perf_counter() + 5
        while time.perf_counter() < deadline:
            try:
                simulation.steps
            except ddem.Busy:
                break
        for name, call in calls.items():
            try:
                call()
                failed[name] = None
            except BaseException as error:
                failed[name] = error
        signal.raise_signal(signal.SIGINT)

    with elsewhere(use):
        with pytest.raises(KeyboardInterrupt):
            begun.set()
            simulation.run(ENDLESS, quiet=True)
    wrong = {name: error for name, error in failed.items() if type(error) is not ddem.Busy}
    assert wrong == {}
    assert failed
    assert "busy" in str(failed["step"]) and isinstance(failed["step"], ddem.Error)
    assert list(tmp_path.iterdir()) == []
    assert_still_works(simulation)


def test_simulations_of_two_threads_run_concurrently() -> None:
    # Both run in turns on one thread each, and neither may wait for the end of the other.
    one, other = (column(divisions=6).build(threads=1) for _ in range(2))
    stop = threading.Event()

    def run() -> None:
        while not stop.is_set():
            other.step(2000, quiet=True)

    one.step(5)
    with elsewhere(run):
        time.sleep(0.05)
        start = time.perf_counter()
        one.step(5)
        waited = time.perf_counter() - start
        busy = other_is_busy(other)
        stop.set()
    assert busy, "the other one has ended: too short to tell"
    assert waited < 1.0


def other_is_busy(simulation: ddem.Simulation) -> bool:
    try:
        simulation.steps
    except ddem.Busy:
        return True
    return False


def test_many_threads_run_their_own_simulations() -> None:
    done: list[ddem.Simulation] = []

    def run() -> None:
        simulation = breaking().build(threads=2)
        simulation.run(1e-3, quiet=True)
        done.append(simulation)

    threads = [threading.Thread(target=run) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(30)
    assert len(done) == 8
    run()
    assert [same_state(simulation, done[-1]) for simulation in done] == [True] * 9


def test_threads_share_a_model_without_deadlock() -> None:
    # A call must not wait for the interpreter while it holds the lock of the model.
    script = """
import sys, threading, ddem
sys.setswitchinterval(1e-6)
model = ddem.Model()
rock = ddem.Material(density=1, young=1, poisson=0)
model.add_blocks(size=(1, 1, 1), divisions=1, material=rock)
def look():
    for _ in range(100):
        model.deck, repr(model), model.to_deck()
def write():
    for _ in range(100):
        model.fix("x", z=0.0)
threads = [threading.Thread(target=f) for f in (look, write, look)]
for thread in threads: thread.start()
for thread in threads: thread.join()
print(len(model.deck["fix"]))
"""
    assert run_python(script, timeout=10) == "100\n"


def test_nested_add_blocks_keeps_materials() -> None:
    model = ddem.Model()

    class Adding:
        """A number whose conversion adds blocks of another material."""

        def __float__(self) -> float:
            other = ddem.Material(density=1000, young=1e9, poisson=0.2)
            model.add_blocks(size=(1, 1, 1), material=other, name="inner")
            return 1.0

    rock = ddem.Material(density=2400, young=18e9, poisson=0.25)
    model.add_blocks(size=(1, 1, Adding()), origin=(3, 0, 0), material=rock, name="outer")
    deck = model.deck
    found = {e["name"]: deck["materials"][e["material"]]["density"] for e in deck["blocks"]}
    assert found == {"inner": 1000, "outer": 2400}

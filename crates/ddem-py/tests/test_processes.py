"""Simulations in other processes, forked or new."""

from __future__ import annotations

import multiprocessing
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import ddem
import pytest
from sample_models import ROCK, SEAM, breaking, run_python


def simulated(threads: int | None) -> bytes:
    """Displacements from another process."""
    simulation = breaking().build(threads=threads)
    simulation.run(5e-4, quiet=True)
    return simulation.displacement.tobytes()


def run_in_child(queue: Any, simulation: ddem.Simulation | None) -> None:
    if simulation is not None:
        simulation.step(5)
    queue.put((simulated(None), simulated(2)))


@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_forked_process_runs() -> None:
    found = simulated(None), simulated(2)
    simulation = breaking().build()
    simulation.step(5)
    context = multiprocessing.get_context("fork")
    queue = context.Queue()
    children = [
        context.Process(target=run_in_child, args=(queue, one)) for one in (None, simulation)
    ]
    try:
        for child in children:
            child.start()
        for _ in children:
            assert queue.get(timeout=20) == found
        for child in children:
            child.join(10)
            assert child.exitcode == 0
    finally:
        for child in children:
            child.kill()
    # The parent process still works.
    simulation.step(5)
    assert simulated(None) == found[0]


def wall() -> ddem.Model:
    """Blocks that are more than the work of one thread."""
    model = ddem.Model()
    model.add_blocks(size=(8, 8, 8), count=(8, 8, 8), divisions=2, material=ROCK, joint=SEAM)
    model.fix("xyz", z=0.0)
    return model


def read_in_child(queue: Any, simulation: ddem.Simulation) -> None:
    new = wall().build(threads=1)
    for one in (simulation, new):
        one.step(2)
        one.displacement, one.energy, one.pairs, one.fragments  # noqa: B018
    queue.put((simulation.steps, new.steps))


@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_forked_process_reads() -> None:
    simulation = wall().build()
    simulation.step(2)
    simulation.displacement
    context = multiprocessing.get_context("fork")
    queue = context.Queue()
    child = context.Process(target=read_in_child, args=(queue, simulation))
    try:
        child.start()
        assert queue.get(timeout=20) == (4, 2)
        child.join(10)
        assert child.exitcode == 0
    finally:
        child.kill()


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="counts threads by Linux")
def test_simulation_has_the_threads_of_its_call() -> None:
    script = """
import os
from test_processes import wall
model = wall()
def number():
    return len(os.listdir("/proc/self/task"))
before = number()
simulation = model.build(threads=1)
simulation.step(2, quiet=True)
for name in dir(simulation):
    if not name.startswith(("_", "peak_")):
        getattr(simulation, name)
simulation.apply_force(0, (1, 0, 0))
simulation.displacement = simulation.displacement
simulation.relax(max_steps=2, on_failure="continue", quiet=True)
simulation.field("stress")
assert number() == before + 1, (number(), before)
"""
    run_python(script, timeout=60)


@pytest.mark.parametrize("method", ["fork", "spawn"])
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_process_pool_gives_same_bits(method: str) -> None:
    expected = simulated(1)
    context = multiprocessing.get_context(method)
    with ProcessPoolExecutor(2, mp_context=context) as pool:
        assert list(pool.map(simulated, [1, 2, None], timeout=40)) == [expected] * 3


def diverge(n: int) -> None:
    raise ddem.Diverged("gone", n, 0.5, 3, 4)


def test_exceptions_cross_process_boundaries() -> None:
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        with pytest.raises(ddem.Diverged) as caught:
            pool.submit(diverge, 7).result(30)
        assert caught.value.step == 7
        with pytest.raises(ddem.ModelError, match="^threads: "):
            pool.submit(simulated, 0).result(30)

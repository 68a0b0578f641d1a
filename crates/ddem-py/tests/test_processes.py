"""Simulations in other processes, forked or new."""

from __future__ import annotations

import multiprocessing
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import ddem
import pytest
from sample_models import breaking


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

"""Cost of Python: calls of 100 steps against one call, calls of one step, reading arrays.

    python benches/python.py

Install the module first (`pip install .`). Prints the best of several rounds, taken in turns.
"""

import time
from collections.abc import Callable

import ddem
import numpy as np

ROCK = ddem.Material(density=2400, young=18e9, poisson=0.25)
SEAM = ddem.Joint(thickness=0.01, material=ROCK)


def seconds(call: Callable[[], object]) -> float:
    """Duration of a call."""
    start = time.perf_counter()
    call()
    return time.perf_counter() - start


def started(size: tuple[int, int, int]) -> ddem.Simulation:
    """Moving cubes of a metre with 5 x 5 x 5 nodes each."""
    model = ddem.Model()
    model.add_blocks(size=size, count=size, divisions=4, material=ROCK, joint=SEAM)
    model.fix("xyz", x=0.0)
    model.load(traction=(0, 0, -1e5), x=float(size[0]))
    simulation = model.build()
    simulation.start(damping=0.05)
    simulation.step(10)
    return simulation


def stepping(steps: int = 3000, rounds: int = 7) -> None:
    """Compares one long call with many short ones, on the beam of 13 500 nodes."""
    beam = started((12, 3, 3))
    one, hundreds = [], []
    for _ in range(rounds):
        one.append(seconds(lambda: beam.step(steps)))
        hundreds.append(seconds(lambda: [beam.step(100) for _ in range(steps // 100)]))
    rate = beam.n_nodes * steps / min(one) / 1e6
    print(f"{beam.n_nodes} nodes, one call of {steps} steps: {rate:.1f} M node updates/s")
    print(f"  in calls of 100 steps: {100 * (min(hundreds) / min(one) - 1):+.2f} %")
    singles = min(seconds(lambda: [beam.step() for _ in range(300)]) for _ in range(rounds)) / 300
    print(f"  a call of one step: {1e6 * (singles - min(one) / steps):+.0f} µs")


def reading() -> None:
    """Measures reading the arrays of a model of a million nodes."""
    large = started((20, 20, 20))
    out = np.empty((large.n_nodes, 3))
    for name in ("displacement", "velocity", "stress"):
        best = min(seconds(lambda name=name: large.field(name)) for _ in range(5))
        print(f"{large.n_nodes} nodes, {name}: {1e3 * best:.0f} ms")
    best = min(seconds(lambda: large.field("displacement", out=out)) for _ in range(5))
    print(f"  displacement into an array: {1e3 * best:.0f} ms")


stepping()
reading()

"""One peer in a process of its own: `python one.py PEER RESULTS TIME_STEP STEPS THREADS`.

Prints a JSON object with its version, its node updates per second, its peak memory and the largest
difference from the displacements of ddem. `absent` says that the peer is not installed, and
`no threads` that it has no version with so many.
"""

import json
import os
import resource
import sys
import time
from pathlib import Path


def main() -> dict[str, object]:
    peer, folder, time_step, steps, threads = sys.argv[1:]
    steps, threads = int(steps), int(threads)
    # Before any library makes its threads.
    os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:threads])
    for name in ("OMP", "OPENBLAS", "MKL"):
        os.environ[f"{name}_NUM_THREADS"] = str(threads)
    try:
        module = __import__(peer)
    except ImportError as error:
        return {"absent": str(error)}
    if threads not in getattr(module, "THREADS", (threads,)):
        return {"no threads": threads}
    from mesh import DdemResults, Grid

    import numpy as np

    results = DdemResults.read(Path(folder))
    grid = Grid.of(results.points)
    model = module.PEER(grid, float(time_step), threads)
    model.step(steps)
    expected = results.displacement
    found = model.displacement()[grid.numbers(results.points)]
    difference = np.abs(found - expected).max() / np.abs(expected).max()
    rates = []
    for _ in range(5):
        start = time.perf_counter()
        model.step(max(steps // 5, 1))
        rates.append(grid.nodes * max(steps // 5, 1) / (time.perf_counter() - start))
    peak = 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return {
        "version": module.VERSION,
        "rate": max(rates),
        "bytes": peak / grid.nodes,
        "difference": float(difference),
    }


if __name__ == "__main__":
    print(json.dumps(main()))

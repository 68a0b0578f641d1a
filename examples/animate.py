#!/usr/bin/env python3
"""A film or one picture of a run, coloured by the original position or by the speed of the blocks.

    cargo run --release -- examples/toppling.toml
    python examples/animate.py results/toppling toppling.gif
    python examples/animate.py results/toppling pile.png --by speed

Blocks that never move are grey. The others are coloured by their initial position along x, y or z,
or by their speed. Needs `pip install ".[plot]"`, as docs/python.md says; no display.
"""

import argparse
from pathlib import Path

import ddem
import numpy as np


def origin(results, axis):
    """Initial position of its block (m) for each element; NaN if the block never moves."""
    first, last = results[0], results[-1]
    _, block = np.unique(first.block, return_inverse=True)
    centres = first.points[first.elements].mean(axis=1)[:, "xyz".index(axis)]
    values = (np.bincount(block, centres) / np.bincount(block))[block]
    moved = np.linalg.norm(last.displacement, axis=1)[last.elements].max(axis=1)
    return np.where(moved > 0.0, values, np.nan)


def camera(direction, focus, height):
    """Camera in a direction, with `height` metres above and below the focus."""
    back = np.array(direction) / np.linalg.norm(direction)
    return np.array(focus) + back * height / np.tan(np.radians(15.0)), focus, (0.0, 0.0, 1.0)


def main():
    """Draws the film or the picture."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("results", type=Path, help="folder of the results")
    parser.add_argument("output", type=Path, help="the film, .gif or .mp4, or a picture, .png")
    parser.add_argument("--by", choices=("x", "y", "z", "speed"), default="z", help="colours")
    parser.add_argument("--view", default="iso", help="iso, xz, yz, xy; -xz, -yz, -xy from behind")
    given = parser.parse_args()
    results = ddem.Results(given.results)
    field, label = "velocity", "speed (m/s)"
    if given.by != "speed":
        field, label = origin(results, given.by), f"{given.by} at the start (m)"
    look = {"label": label, "view": given.view, "scale": 1.0}
    if given.output.suffix == ".png":
        ddem.plot(results, field, screenshot=given.output, **look)
    else:
        ddem.animate(results, given.output, field, **look)
    print(given.output)


if __name__ == "__main__":
    main()

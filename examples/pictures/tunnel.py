#!/usr/bin/env python3
"""A tunnel in jointed rock: blocks where they are, coloured by the stress along z.

    cargo run --release -- examples/tunnel.toml
    python examples/pictures/tunnel.py

Needs `pip install ".[plot]"`, as docs/python.md says; no display.
"""

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import LineCollection, PolyCollection

from results import FAINT, INK, Frames, results, save

TIMES = ((0.0, "before"), (0.25, "the heading is dug"), (0.5, "blocks slide out of the roof"), (1.0, "the bench is dug"))
MOST = 2.5
FRONT = (0, 1, 5, 4)


def section(axes, blocks, frame):
    """The front of all blocks that are there, and the joints between them."""
    moved = blocks.points + blocks.point_field("displacement", frame)
    there = blocks.cell_field("removed", frame) == 0
    hexes = blocks.cells.reshape(-1, 8)
    front = there & (blocks.points[hexes[:, 0], 1] < 0.01)
    quads = moved[hexes[front][:, FRONT]][:, :, [0, 2]]
    pressure = -blocks.cell_field("stress", frame)[front, 2] / 1e6
    shown = PolyCollection(quads, array=pressure, cmap="YlGnBu", clim=(0, MOST), edgecolors="face", lw=0.3)
    axes.add_collection(shown)
    # A block has four elements here; its outline is what they do not share.
    numbers = blocks.cell_field("block", frame)[front]
    ends = hexes[front][:, FRONT]
    sides = np.stack([ends, np.roll(ends, -1, axis=1)], axis=2).reshape(-1, 2)
    keys, counts = np.unique(np.sort(sides, axis=1), axis=0, return_counts=True)
    assert len(numbers) == len(quads)
    axes.add_collection(LineCollection(moved[keys[counts == 1]][:, :, [0, 2]], colors=INK, lw=0.35))
    axes.set(xlim=(-9.5, 9.5), ylim=(-6.5, 8.5), aspect="equal")
    axes.axis("off")
    return shown


def main():
    """Draws four times."""
    blocks = Frames(results("tunnel") / "blocks.vtkhdf")
    figure = plt.figure(figsize=(12, 10.3))
    figure.text(0.035, 0.955, "A tunnel in jointed rock, 60 m below ground", size=19, weight="bold")
    about = "stress in place at the start; the joints of the crown have lost their cohesion"
    figure.text(0.035, 0.926, about, size=12, color=FAINT)
    for place, (time, words) in enumerate(TIMES):
        left, low = 0.01 + 0.49 * (place % 2), 0.475 - 0.455 * (place // 2)
        axes = figure.add_axes((left, low, 0.49, 0.42))
        frame = int(np.abs(blocks.times - time).argmin())
        shown = section(axes, blocks, frame)
        axes.text(-9.4, 8.75, f"{time:g} s: {words}", size=12, weight="bold")
    bar = figure.colorbar(shown, cax=figure.add_axes((0.72, 0.955, 0.24, 0.016)), orientation="horizontal")
    bar.set_label("pressure along z, MPa")
    save(figure, "tunnel.png")


if __name__ == "__main__":
    main()

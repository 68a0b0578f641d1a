#!/usr/bin/env python3
"""A bench that is blasted hole after hole: blocks where they are, coloured by their speed.

    cargo run --release -- examples/bench-blast.toml
    python examples/pictures/bench_blast.py

Needs `pip install ".[plot]"`, as docs/python.md says; no display.
"""

import matplotlib.pyplot as plt
import numpy as np
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from results import FAINT, Frames, results, save

TIMES = (0.005, 0.025, 0.05, 0.08)
FASTEST = 20.0
SIDES = ((0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))


def bench(axes, blocks, frame):
    """All faces of blocks in one frame."""
    moved = blocks.points + blocks.point_field("displacement", frame)
    speed = np.linalg.norm(blocks.point_field("velocity", frame), axis=1)
    hexes = blocks.cells.reshape(-1, 8)
    faces = moved[hexes[:, SIDES].reshape(-1, 4)]
    colours = np.repeat(speed[hexes].mean(axis=1), len(SIDES))
    shown = plt.cm.YlOrRd(np.clip(colours / FASTEST, 0, 1))
    axes.add_collection3d(Poly3DCollection(faces, facecolors=shown, edgecolors="#1f293366", lw=0.2))
    axes.set(xlim=(0, 11), ylim=(-1.5, 5.5), zlim=(0, 5))
    axes.set_box_aspect((11, 7, 5), zoom=1.1)
    axes.view_init(elev=32, azim=-62)
    axes.axis("off")


def main():
    """Draws four times."""
    blocks = Frames(results("bench-blast") / "blocks.vtkhdf")
    figure = plt.figure(figsize=(12, 8))
    figure.text(0.035, 0.95, "A bench is blasted, a hole every 10 ms", size=19, weight="bold")
    about = "blocks where they are, by speed; in each hole gas of 10 MPa expands"
    figure.text(0.035, 0.918, about, size=12, color=FAINT)
    for place, time in enumerate(TIMES):
        left, low = 0.01 + 0.49 * (place % 2), 0.48 - 0.43 * (place // 2)
        axes = figure.add_axes((left, low, 0.49, 0.43), projection="3d", computed_zorder=True)
        frame = int(np.abs(blocks.times - time).argmin())
        bench(axes, blocks, frame)
        axes.text2D(0.08, 0.86, f"{time * 1e3:.0f} ms", transform=axes.transAxes, size=13, weight="bold")
    scale = plt.cm.ScalarMappable(cmap="YlOrRd")
    scale.set_clim(0, FASTEST)
    bar = figure.colorbar(scale, cax=figure.add_axes((0.72, 0.95, 0.24, 0.018)), orientation="horizontal")
    bar.set_label("speed, m/s")
    save(figure, "bench-blast.png")


if __name__ == "__main__":
    main()

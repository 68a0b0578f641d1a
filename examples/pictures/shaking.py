#!/usr/bin/env python3
"""A slope in an earthquake: velocities as the wave comes up, turns at the surface and leaves.

    cargo run --release -- examples/shaking.toml
    python examples/pictures/shaking.py

Needs `pip install ".[plot]"`, as docs/python.md says; no display.
"""

import csv

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import LineCollection, PolyCollection

from results import FAINT, INK, LOAD, Frames, outlines, results, save, side

TIMES = (0.125, 0.165, 0.205, 0.265)
REACH = 0.3
CURVES = (
    ("crest", "at the crest", LOAD),
    ("before", "on level ground before the face", INK),
    ("base", "at the base", FAINT),
)


def slope(axes, blocks, joints, frame, shape):
    """The side y = 0 with its velocity along x, and joints that have failed."""
    faces, cells, edges = shape
    flat = blocks.points[:, [0, 2]]
    velocity = blocks.point_field("velocity", frame)[:, 0]
    colours = PolyCollection(flat[faces], array=velocity[faces].mean(axis=1), cmap="RdBu_r")
    colours.set(edgecolor="face", linewidth=0.2, clim=(-REACH, REACH))
    axes.add_collection(colours)
    axes.add_collection(LineCollection(flat[edges], colors=INK, linewidths=0.25, alpha=0.6))
    failed = joints.point_field("state", frame) > 0
    quads = joints.cells.reshape(-1, 4)
    broken = quads[failed[quads].all(axis=1)]
    lines = []
    for quad in broken:
        ends = joints.points[quad][:, [0, 2]]
        lines.append([ends.min(axis=0), ends.max(axis=0)])
    axes.add_collection(LineCollection(lines, colors="#111111", linewidths=2.0))
    axes.set(xlim=(-0.5, 80.5), ylim=(-0.5, 32.5), aspect="equal")
    axes.axis("off")
    return colours


def main():
    """Draws four times and three curves."""
    folder = results("shaking")
    blocks, joints = Frames(folder / "blocks.vtkhdf"), Frames(folder / "joints.vtkhdf")
    with open(folder / "probes.csv", encoding="utf-8") as table:
        rows = [row for row in csv.DictReader(table) if row["stage"] == "earthquake"]
    faces, cells = side(blocks, 1, 0.0)
    shape = (faces, cells, outlines(faces, blocks.cell_field("block", 0)[cells]))

    figure = plt.figure(figsize=(12, 8.6))
    figure.text(0.035, 0.95, "An earthquake shakes a rock slope", size=19, weight="bold")
    about = "velocity along x on a viscous base with free-field sides; failed joints in black"
    figure.text(0.035, 0.918, about, size=12, color=FAINT)
    for place, time in enumerate(TIMES):
        left, low = 0.03 + 0.475 * (place % 2), 0.635 - 0.29 * (place // 2)
        axes = figure.add_axes((left, low, 0.46, 0.27))
        frame = int(np.abs(blocks.times - time).argmin())
        colours = slope(axes, blocks, joints, frame, shape)
        axes.text(0.0, 27.0, f"{time * 1e3:.0f} ms", size=13, weight="bold")

    axes = figure.add_axes((0.07, 0.07, 0.62, 0.24))
    times = np.array([float(row["time"]) for row in rows]) * 1e3
    for probe, name, colour in CURVES:
        speed = [float(row[f"{probe}.x"]) for row in rows]
        axes.plot(times, speed, color=colour, lw=1.8, label=name)
    axes.axhline(0.0, color=FAINT, lw=0.6)
    axes.set(xlim=(0, 500), xlabel="time, ms", ylabel="velocity along x, m/s")
    axes.legend(frameon=False, loc="upper right")
    bar = figure.colorbar(colours, cax=figure.add_axes((0.75, 0.19, 0.2, 0.02)), orientation="horizontal")
    bar.set_label("velocity along x, m/s")
    save(figure, "shaking.png")


if __name__ == "__main__":
    main()

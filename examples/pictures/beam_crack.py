#!/usr/bin/env python3
"""Axial stress in the beam at several lengths of the crack: figure 14 of the paper.

    cargo run --release -- examples/beam-crack.toml
    python examples/pictures/beam_crack.py

Needs `pip install ".[plot]"`, as docs/python.md says; no display.
"""

import csv

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import LineCollection, PolyCollection

from results import FAINT, GROUND, INK, LOAD, Frames, outlines, results, save, side

SCALE = 250
REACH = 1.2


def pushed(time):
    """Displacement of the load line at a time, `m`: 0.01 m/s after a ramp of 0.05 s."""
    return np.where(time < 0.05, 0.1 * time**2, 0.01 * (time - 0.025))


def crack(joints, frame):
    """Height up to which pairs at midspan have failed."""
    middle = np.abs(joints.points[:, 0] - 6.0) < 1e-6
    failed = middle & (joints.point_field("state", frame) > 0)
    return joints.points[failed, 2].max() if failed.any() else 0.0


def beam(axes, blocks, faces, cells, edges, frame):
    """The side y = 0, deformed, with its axial stress."""
    moved = blocks.points + SCALE * blocks.point_field("displacement", frame)
    flat = moved[:, [0, 2]]
    stress = blocks.cell_field("stress", frame)[cells, 0] / 1e6
    colours = PolyCollection(flat[faces], array=stress, cmap="RdBu_r", clim=(-REACH, REACH))
    colours.set(edgecolor="face", linewidth=0.2)
    axes.add_collection(colours)
    axes.add_collection(LineCollection(flat[edges], colors=INK, linewidths=0.7))
    line = np.abs(blocks.points - (6.0, 0.0, 3.0)).sum(axis=1) < 0.02
    top = flat[line].mean(axis=0)
    style = {"arrowstyle": "-|>", "color": LOAD, "lw": 2.2, "mutation_scale": 16}
    axes.annotate("", top, top + (0.0, 0.85), arrowprops=style)
    for end, marker in ((0.0, "^"), (12.0, "o")):
        x, z = flat[np.abs(blocks.points - (end, 0.0, 0.0)).sum(axis=1).argmin()]
        axes.plot(x, z - 0.22, marker, ms=11, color=GROUND, mec=FAINT, clip_on=False)
    axes.set(xlim=(-0.4, 12.4), ylim=(-1.15, 4.0), aspect="equal")
    axes.axis("off")
    return colours


def main():
    """Draws four states and the force on the line."""
    folder = results("beam-crack")
    blocks, joints = Frames(folder / "blocks.vtkhdf"), Frames(folder / "joints.vtkhdf")
    with open(folder / "probes.csv", encoding="utf-8") as table:
        rows = [row for row in csv.DictReader(table) if row["line.z"]]
    times = np.array([float(row["time"]) for row in rows])
    force = -np.array([float(row["line.z"]) for row in rows]) / 1e6

    heights = np.array([crack(joints, frame) for frame in range(len(joints.times))])
    frames = [int(np.flatnonzero(heights == 0.0)[-1])]
    frames += [int(np.flatnonzero(heights >= most - 1e-6)[0]) for most in (1.0, 1.75, 2.5)]
    faces, cells = side(blocks, 1, 0.0)
    edges = outlines(faces, blocks.cell_field("block", 0)[cells])

    figure = plt.figure(figsize=(12, 7.6))
    figure.text(0.035, 0.945, "A beam cracks at midspan", size=19, weight="bold")
    about = "axial stress on the side of the 12 × 3 × 3 m beam; displacements × "
    figure.text(0.035, 0.905, f"{about}{SCALE}", size=12, color=FAINT)
    names = "abcd"
    for place, (name, frame) in enumerate(zip(names, frames)):
        left, low = 0.03 + 0.48 * (place % 2), 0.56 - 0.3 * (place // 2)
        axes = figure.add_axes((left, low, 0.46, 0.31))
        colours = beam(axes, blocks, faces, cells, edges, frame)
        down = 1e3 * pushed(blocks.times[frame])
        cracked = f"crack {heights[frame]:.2f} m" if heights[frame] else "intact"
        axes.text(0.0, 3.75, name, size=15, weight="bold")
        axes.text(0.45, 3.75, f"{cracked}, line {down:.2f} mm down", size=11.5)
    bar = figure.add_axes((0.055, 0.115, 0.33, 0.024))
    figure.colorbar(colours, cax=bar, orientation="horizontal", extend="both")
    bar.set_title("axial stress (MPa), tension red", size=11.5, loc="left", pad=7)
    bar.set_xticks([-1.2, -0.8, -0.4, 0, 0.4, 0.8, 1.2])

    axes = figure.add_axes((0.52, 0.08, 0.44, 0.18))
    axes.plot(1e3 * pushed(times), force, color=INK, lw=1.6)
    for name, frame in zip(names, frames):
        time = blocks.times[frame]
        x, y = 1e3 * float(pushed(time)), force[np.abs(times - time).argmin()]
        axes.plot(x, y, "o", color=LOAD, ms=7)
        aside = (-13, 6) if name in "ab" else (7, 5)
        axes.annotate(name, (x, y), aside, textcoords="offset points", weight="bold")
    axes.set(xlim=(0, None), ylim=(0, 2.4), ylabel="force (MN)", yticks=[0, 1, 2])
    axes.set_xlabel("way of the line (mm)")
    save(figure, "beam-crack.png")


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""A slope in an earthquake: velocities as the wave rises, is reflected at the surface and leaves.

    cargo run --release -- examples/shaking.toml
    python examples/pictures/shaking.py

Needs `pip install ".[plot]"`, as docs/python.md says; no display.
"""

import csv

import ddem
import numpy as np

from results import FAINT, INK, LOAD, colour_bar, nearest, panel, results, save, scene, sheet

TIMES = (0.125, 0.185, 0.205, 0.265)
COLOURS, RANGE = "PRGn", (-0.25, 0.25)
MIDDLE, HEIGHT = (40.0, 1.0, 16.0), 34.0
CURVES = (
    ("crest", "at the crest", LOAD),
    ("before", "on level ground before the face", INK),
    ("base", "at the base", FAINT),
)


def curves(axes, rows):
    """Draws the velocities of three points over time."""
    times = np.array([float(row["time"]) for row in rows]) * 1e3
    for probe, name, colour in CURVES:
        speed = [float(row[f"{probe}.x"]) for row in rows]
        axes.plot(times, speed, color=colour, lw=1.8, label=name)
    axes.axhline(0.0, color=FAINT, lw=0.6)
    axes.set(xlim=(0, 500), xlabel="time (ms)", ylabel="velocity along x (m/s)")
    axes.legend(frameon=False, loc="upper right")


def main():
    """Draws four times and three curves."""
    folder = results("shaking")
    run = ddem.Results(folder)
    with open(folder / "probes.csv", encoding="utf-8") as table:
        rows = [row for row in csv.DictReader(table) if row["stage"] == "earthquake"]
    about = "joints that failed in tension: red, open ones: orange; true displacements"
    figure = sheet((12, 8.7), "An earthquake shakes a rock slope", about)
    for place, time in enumerate(TIMES):
        frame = nearest(run, time)
        look = {"cmap": COLOURS, "clim": RANGE, "view": "xz", "joints": "traces", "bold": 2.0}
        at = (0.2 + 5.85 * (place % 2), 5.15 - 2.75 * (place // 2), 5.75, 2.35)
        words = f"{1e3 * frame.time:.0f} ms"
        values = frame.velocity[:, 0]
        panel(figure, at, words, lambda size: scene(frame, values, MIDDLE, HEIGHT, size, **look))
    curves(figure.add_axes((0.07, 0.065, 0.91, 0.185)), rows)
    colour_bar(figure, (8.5, 8.3, 3.2, 0.13), COLOURS, RANGE, "velocity along x (m/s)")
    save(figure, "shaking.png")


if __name__ == "__main__":
    main()

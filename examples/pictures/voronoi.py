#!/usr/bin/env python3
"""A sample of bonded grains under compression: its cracks, and stress over strain.

    cargo run --release -- examples/voronoi.toml
    python examples/pictures/voronoi.py

Needs `pip install ".[plot]"`, as docs/python.md says; no display.
"""

import ddem
import numpy as np

from results import FAINT, panel, results, save, scene, sheet

HEIGHT, AREA, SCALE = 0.1, 0.05**2, 4.0


def main():
    """Draws the fragments at the end, and the curve."""
    run = ddem.Results(results("voronoi"))
    stress = 1e-6 * np.abs(run.probes["plate"]["z"]) / AREA
    strain = -1e3 * run.probes["top"]["z"] / HEIGHT
    frame = run[-1]
    figure = sheet((12, 7.6), run.title, f"the sample at {strain[-1]:.1f} mm/m; displacements × {SCALE:g}")
    panel(
        figure,
        (0.2, 0.5, 5.6, 5.9),
        "fragments; thick lines: open bonds (orange)",
        lambda size: scene(frame, "fragment", (0.0, 0.0, 0.05), 0.13, size, (0.6, -1.0, 0.25), joints="traces", scale=SCALE),
    )
    axes = figure.add_axes((0.55, 0.12, 0.37, 0.68))
    axes.plot(strain, stress, color="#1f6fb4", linewidth=1.8)
    at = int(stress.argmax())
    axes.annotate(f"{stress[at]:.0f} MPa", (strain[at], stress[at]), xytext=(6, 6), textcoords="offset points")
    axes.set_xlabel("axial strain (mm/m)")
    axes.set_ylabel("axial stress (MPa)")
    axes.set_xlim(0.0)
    axes.set_ylim(0.0)
    axes.grid(alpha=0.25)
    failed = [np.count_nonzero(one.pairs["state"]) / len(one.pairs["state"]) for one in run]
    times = run.probes["top"]["time"]
    other = axes.twinx()
    other.spines["right"].set_visible(True)
    other.plot(np.interp(run.times, times, strain), 100.0 * np.array(failed), color=FAINT, linestyle="--")
    other.set_ylabel("failed bonds (%), dashed")
    other.set_ylim(0.0, 100.0)
    save(figure, "voronoi.png")


if __name__ == "__main__":
    main()

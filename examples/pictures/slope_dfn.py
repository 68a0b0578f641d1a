#!/usr/bin/env python3
"""A bench at its factor of safety: the blocks that move in the failing trial.

    cargo run --release -- examples/slope-dfn.toml
    python examples/pictures/slope_dfn.py

Needs `pip install ".[plot]"`, as docs/python.md says; no display.
"""

import ddem
import numpy as np

from results import by_block, colour_bar, panel, results, save, scene, sheet

COLOURS, SCALE, LEAST = "YlOrRd", 100.0, 1.5


def main():
    """Draws the last frame, that of the failing trial, and the bench before."""
    run = ddem.Results(results("slope-dfn"))
    frame, stage = run[-1], run.summary["stages"][-1]
    size = 1e3 * np.linalg.norm(frame.displacement, axis=1)[frame.elements].mean(axis=1)
    values = by_block(frame, size, LEAST)
    most = float(np.nanmax(values))
    about = f"the blocks that move when all strengths are divided by {stage['bracket'][1]:.2f}; displacements × {SCALE:g}"
    figure = sheet((12, 8.4), f"A bench with sets, a fault and fractures: factor of safety {stage['factor']:.2f}", about)
    look = {"cmap": COLOURS, "clim": (0.0, most), "joints": "traces", "scale": SCALE}
    panel(
        figure,
        (0.2, 0.95, 11.6, 6.2),
        "blocks beyond their limit; thick lines: joints that hold (black), slide (blue), open (orange)",
        lambda pixels: scene(frame, values, (16.0, 10.0, 9.9), 38.0, pixels, (-1.0, -0.8, 0.55), **look),
    )
    colour_bar(figure, (4.0, 0.62, 4.0, 0.14), COLOURS, (0.0, most), f"displacement (mm), below {LEAST:g} mm grey")
    save(figure, "slope-dfn.png")


if __name__ == "__main__":
    main()

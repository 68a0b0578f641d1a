#!/usr/bin/env python3
"""A slope at its factor of safety: the blocks that move in the failing trial.

    cargo run --release -- examples/slope-safety.toml
    python examples/pictures/slope_safety.py

Needs `pip install ".[plot]"`, as docs/python.md says; no display.
"""

import ddem
import numpy as np

from results import by_block, colour_bar, panel, results, save, scene, sheet

COLOURS, SCALE, LEAST = "YlOrRd", 200.0, 0.5


def main():
    """Draws the last frame, that of the failing trial."""
    run = ddem.Results(results("slope-safety"))
    frame, factor = run[-1], run.summary["stages"][-1]["factor"]
    size = 1e3 * np.linalg.norm(frame.displacement, axis=1)[frame.elements].mean(axis=1)
    values = by_block(frame, size, LEAST)
    most = float(np.nanmax(values))
    about = f"the blocks that move when all strengths are divided by a little more; displacements × {SCALE:g}"
    figure = sheet((12, 9), f"A slope in bedded rock: factor of safety {factor:.2f}", about)
    look = {"cmap": COLOURS, "clim": (0.0, most), "view": "xz", "moving": True, "scale": SCALE}
    place = (0.2, 0.85, 11.6, 6.9)
    words = f"{frame.stage}, step {frame.step}"
    panel(figure, place, words, lambda pixels: scene(frame, values, (12.0, 0.5, 3.95), 18.0, pixels, **look))
    label = f"displacement (mm), below {LEAST:g} mm grey"
    colour_bar(figure, (4.0, 0.6, 4.0, 0.14), COLOURS, (0.0, most), label)
    save(figure, "slope-safety.png")


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""A tunnel dug through three joint sets: displaced blocks, coloured by their displacement.

    cargo run --release -- examples/tunnel-sets.toml
    python examples/pictures/tunnel_sets.py

Needs `pip install ".[plot]"`, as docs/python.md says; no display.
"""

import ddem
import numpy as np

from results import by_block, colour_bar, panel, results, save, scene, sheet

COLOURS, RANGE = "YlOrRd", (0.0, 0.25)
LOOK = {"cmap": COLOURS, "clim": RANGE, "joints": "traces"}


def moved(frame):
    """Displacement of its block (m) for each element."""
    nodes = np.linalg.norm(frame.displacement, axis=1)
    return by_block(frame, nodes[frame.elements].mean(axis=1))


def main():
    """Draws the front of the rock after the excavation large, and before it small."""
    run = ddem.Results(results("tunnel-sets"))
    about = "true displacements; thick lines: joints that hold (black), failed in shear (blue), open (orange)"
    figure = sheet((12, 8.6), "A tunnel in three joint sets, 60 m below ground", about)
    first, last = run[0], run[-1]
    ahead, below = (-0.25, -1.0, -0.12), (0.0, -0.7, -1.0)
    panel(
        figure,
        (0.2, 0.2, 7.7, 7.0),
        f"{run.times[-1]:.1f} s: the tunnel is dug, and a wedge and a roof block come loose",
        lambda size: scene(last, moved(last), (0.0, 0.0, 3.2), 14.5, size, ahead, **LOOK),
    )
    panel(
        figure,
        (8.1, 4.5, 3.7, 2.7),
        "the rock before",
        lambda size: scene(first, moved(first), (0.0, 0.0, 3.0), 19.0, size, ahead, **LOOK),
    )
    panel(
        figure,
        (8.1, 1.2, 3.7, 2.7),
        "roof and side from inside",
        lambda size: scene(last, moved(last), (0.0, 0.0, 4.5), 8.0, size, below, **LOOK),
    )
    colour_bar(figure, (8.3, 0.65, 3.3, 0.13), COLOURS, RANGE, "displacement of a block (m)")
    save(figure, "tunnel-sets.png")


if __name__ == "__main__":
    main()

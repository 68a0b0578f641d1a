#!/usr/bin/env python3
"""A tunnel in jointed rock: displaced blocks, coloured by the vertical pressure.

    cargo run --release -- examples/tunnel.toml
    python examples/pictures/tunnel.py

Needs `pip install ".[plot]"`, as docs/python.md says; no display.
"""

import ddem

from results import colour_bar, nearest, panel, results, save, scene, sheet

# Time, words, centre and height of the view, and place on the sheet.
VIEWS = (
    (1.0, "1 s: the bench is dug, blocks of the roof fall", (0.0, 0.5, 0.2), 13.4, (0.2, 0.25, 7.7, 7.3)),
    (0.0, "before", (0.0, 0.5, 0.4), 11.5, (8.1, 5.55, 3.7, 2.0)),
    (0.25, "0.25 s: the heading is dug", (0.0, 0.5, 0.4), 11.5, (8.1, 3.15, 3.7, 2.0)),
    (0.5, "0.5 s: the roof comes down", (0.0, 0.5, 0.4), 11.5, (8.1, 0.75, 3.7, 2.0)),
)
COLOURS, RANGE = "RdYlBu", (0.0, 3.0)


def main():
    """Draws the final state large, and earlier states small."""
    run = ddem.Results(results("tunnel"))
    about = "true displacements; thick lines: joints that hold (black), failed in shear (blue), open (orange)"
    figure = sheet((12, 9), "A tunnel in jointed rock, 60 m below ground", about)
    for time, words, focus, height, place in VIEWS:
        frame = nearest(run, time)
        pressure = -frame.stress[:, 2] / 1e6
        look = {"cmap": COLOURS, "clim": RANGE, "view": "xz", "joints": "traces"}
        panel(figure, place, words, lambda size: scene(frame, pressure, focus, height, size, **look))
    colour_bar(figure, (8.3, 0.55, 3.3, 0.13), COLOURS, RANGE, "vertical pressure (MPa)")
    save(figure, "tunnel.png")


if __name__ == "__main__":
    main()

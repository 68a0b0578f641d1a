#!/usr/bin/env python3
"""A block of rock blasted from its centre, at two times, from outside and cut open, and the sizes
of its fragments.

    cargo run --release -- examples/blast.toml
    python examples/pictures/blast.py

Needs `pip install ".[plot]"`, as docs/python.md says; no display.
"""

import ddem

from results import PICTURES, colour_bar, nearest, panel, results, save, scene, sheet, speed

TIMES = (0.01, 0.02)
COLOURS, RANGE, LEAST = "YlOrRd", (0.0, 15.0), 1.0
# Words, plane that cuts the block open, view direction, centre and height of the view.
VIEWS = (
    ("from outside", None, (-5.0, -8.0, 4.0), (1.2, 1.2, 1.25), 3.75),
    ("cut open", 1.2, (-2.0, -8.0, 2.0), (1.2, 1.8, 1.32), 3.05),
)


def main():
    """Draws both pictures."""
    folder = results("blast")
    run = ddem.Results(folder)
    about = "2.4 m across; true displacements; slower than 1 m/s: grey"
    figure = sheet((12, 12.2), "1 kg of TNT in the middle of a block of rock", about)
    for row, time in enumerate(TIMES):
        frame = nearest(run, time)
        values, look = speed(frame, LEAST), {"cmap": COLOURS, "clim": RANGE}
        for column, (words, behind, eye, focus, height) in enumerate(VIEWS):
            place = (0.2 + 5.85 * column, 5.8 - 5.65 * row, 5.75, 5.2)
            panel(
                figure,
                place,
                f"{1e3 * time:.0f} ms, {words}",
                lambda size: scene(frame, values, focus, height, size, eye, behind, **look),
            )
    colour_bar(figure, (8.5, 11.8, 3.2, 0.13), COLOURS, RANGE, "speed (m/s)")
    save(figure, "blast.png")
    sizes = PICTURES / "blast-sizes.png"
    ddem.plot_sizes(folder, file=sizes)
    print(sizes)


if __name__ == "__main__":
    main()

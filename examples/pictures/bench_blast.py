#!/usr/bin/env python3
"""A bench blasted hole after hole: displaced blocks, coloured by their speed.

    cargo run --release -- examples/bench-blast.toml
    python examples/pictures/bench_blast.py

Needs `pip install ".[plot]"`, as docs/python.md says; no display.
"""

import ddem

from results import colour_bar, nearest, panel, results, save, scene, sheet, speed

# Time, height of the view, and place on the sheet.
VIEWS = (
    (0.01, 8.5, (0.2, 5.6, 3.8, 2.1)),
    (0.03, 8.5, (4.1, 5.6, 3.8, 2.1)),
    (0.05, 8.5, (8.0, 5.6, 3.8, 2.1)),
    (0.08, 7.9, (0.2, 0.05, 11.6, 5.2)),
)
COLOURS, RANGE, LEAST = "YlOrRd", (0.0, 30.0), 1.0


def main():
    """Draws four times, the last one large."""
    run = ddem.Results(results("bench-blast"))
    about = "five charged holes behind the face; true displacements; slower than 1 m/s: grey"
    figure = sheet((12, 9), "A bench is blasted, a hole every 10 ms", about)
    for time, height, place in VIEWS:
        frame = nearest(run, time)
        values, look = speed(frame, LEAST), {"cmap": COLOURS, "clim": RANGE}
        panel(
            figure,
            place,
            f"{1e3 * frame.time:.0f} ms",
            lambda size: scene(frame, values, (5.5, 2.6, 2.07), height, size, (0.4, -1.0, 0.58), **look),
        )
    colour_bar(figure, (8.3, 8.6, 3.3, 0.13), COLOURS, RANGE, "speed (m/s)")
    save(figure, "bench-blast.png")


if __name__ == "__main__":
    main()

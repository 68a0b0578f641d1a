#!/usr/bin/env python3
"""Falling rigid blocks: a film of toppling columns, pictures of a wall and of a rockfall.

    cargo run --release -- examples/toppling.toml
    cargo run --release -- examples/wall.toml
    cargo run --release -- examples/rockfall.toml
    python examples/pictures/collapses.py

Needs `pip install ".[plot]"`, as docs/python.md says; no display.
"""

import sys

import ddem
import numpy as np

from results import PICTURES, ROOT, colour_bar, nearest, panel, results, save, scene, sheet

sys.path.insert(0, str(ROOT / "examples"))

from animate import camera, origin

# Materials are numbered in the order of their names: sandstone, steel.
STEEL = 1


def toppling():
    """Draws the film until everything is at rest."""
    run, path = ddem.Results(results("toppling")), PICTURES / "toppling.gif"
    ddem.animate(
        run,
        path,
        origin(run, "x"),
        label="x at the start (m)",
        title="Columns topple off a rock slope: 129 rigid blocks, friction 21°",
        frames=np.flatnonzero(run.times < 7.4)[::2],
        camera=camera((-0.2, -1.0, 0.35), (12.0, 3.0, 6.3), 14.7),
        fps=9,
        window_size=(720, 420),
    )
    print(path)


def pair(name, title, about, seen, moments, apart=None):
    """Draws two moments of a run, coloured by the initial height of the blocks; blocks of the
    material `apart` are grey.
    """
    direction, focus, height, tall = seen
    run = ddem.Results(results(name))
    values = origin(run, "z")
    if apart is not None:
        values[run[0].material == apart] = np.nan
    clim = np.nanmin(values), np.nanmax(values)
    figure = sheet((12, tall + 1.35), title, about)
    for column, (moment, words) in enumerate(moments):
        frame = nearest(run, moment)
        panel(
            figure,
            (0.2 + 5.85 * column, 0.1, 5.75, tall),
            f"{frame.time:.1f} s: {words}",
            lambda size: scene(frame, values, focus, height, size, direction, clim=clim),
        )
    colour_bar(figure, (8.5, tall + 0.97, 3.2, 0.13), "viridis", clim, "height at the start (m)")
    save(figure, f"{name}.png")


def wall():
    """Draws the wall as it falls, and the stones at rest."""
    about = "86 stones in running bond, which weight and friction hold; true displacements"
    moments = (1.9, "it tilts about its toe"), (6.0, "at rest")
    seen = (0.9, 1.2, 0.5), (1.5, 1.6, 0.62), 3.8, 3.7
    pair("wall", "A dry-stone wall is pushed over", about, seen, moments, apart=STEEL)


def rockfall():
    """Draws the blocks as they hit the berm, and at the end."""
    about = "34 blocks of 1 to 10 t slide off a bedding plane; true displacements"
    moments = (2.9, "the first ones hit the berm"), (10.0, "caught by the berm, or on the floor")
    seen = (0.9, -1.0, 0.55), (-5.0, 4.0, 9.2), 31.0, 5.6
    pair("rockfall", "Rockfall down a benched slope", about, seen, moments)


def main():
    """Draws all of them."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    for draw in (toppling, wall, rockfall):
        draw()


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Rigid blocks that fall: a film of toppling columns, pictures of a wall and of a rockfall.

    cargo run --release -- examples/toppling.toml
    cargo run --release -- examples/wall.toml
    cargo run --release -- examples/rockfall.toml
    python examples/pictures/collapses.py

Needs `pip install pyvista pillow`; no display.
"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image

EXAMPLES = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(EXAMPLES))

from animate import Film, Run, View, write_gif

RESULTS = EXAMPLES.parent / "results"
PICTURES = EXAMPLES.parent / "docs" / "pictures"


def toppling(path):
    """The film, until everything is at rest."""
    run = Run(RESULTS / "toppling")
    look = {"size": (900, 500), "by": "x", "bar": False, "left": 0.53}
    view = View((-0.2, -1.0, 0.35), (13.5, 3.0, 6.3), 10.0, **look)
    film = Film(run, view)
    frames = [i for i, time in enumerate(run.times) if time < 7.4]
    text = "129 rigid blocks, friction 21 degrees"
    title = "Columns topple off a rock slope"
    pictures = [film.draw(i, title, f"{text}; {run.times[i]:.1f} s") for i in frames]
    write_gif(pictures, path, 0.07)


def pair(name, view, moments, words):
    """Two moments of a run side by side, with the words over each."""
    run = Run(RESULTS / name)
    view.size, view.bar = (900, 1000), False
    halves = []
    for moment, (title, text) in zip(moments, words):
        frame = int(np.abs(np.array(run.times) - moment).argmin())
        halves.append(Film(run, view).draw(frame, title, f"{text}{run.times[frame]:.1f} s"))
    return Image.fromarray(np.hstack(halves))


def wall(path):
    """The wall as it falls, and the stones at rest."""
    view = View((1.0, 1.2, 0.55), (1.7, 1.9, 1.05), 3.5)
    words = (("A dry-stone wall is pushed over", "86 stones in running bond; "), ("", "at rest; "))
    pair("wall", view, (1.9, 6.0), words).save(path)


def rockfall(path):
    """The blocks as they hit the berm, and at rest."""
    view = View((0.75, -1.0, 0.5), (-3.0, 4.0, 13.2), 19.5)
    words = (("Rockfall down a benched slope", "34 blocks of 1 to 10 t; "), ("", "at rest; "))
    pair("rockfall", view, (2.9, 10.0), words).save(path)


def main():
    """Draws all of them."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    for draw, name in ((toppling, "toppling.gif"), (wall, "wall.png"), (rockfall, "rockfall.png")):
        draw(PICTURES / name)
        print(PICTURES / name)


if __name__ == "__main__":
    main()

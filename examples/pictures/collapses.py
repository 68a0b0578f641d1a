#!/usr/bin/env python3
"""Rigid blocks that fall: a film of toppling columns, pictures of a wall and of a rockfall.

    cargo run --release -- examples/toppling.toml
    cargo run --release -- examples/wall.toml
    cargo run --release -- examples/rockfall.toml
    python examples/pictures/collapses.py

Needs `pip install ".[plot]"`, as docs/python.md says; no display.
"""

import sys
from pathlib import Path

import ddem
import numpy as np
from PIL import Image

EXAMPLES = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(EXAMPLES))

from animate import camera, origin

RESULTS = EXAMPLES.parent / "results"
PICTURES = EXAMPLES.parent / "docs" / "pictures"


def toppling(path):
    """The film, until everything is at rest."""
    results = ddem.Results(RESULTS / "toppling")
    ddem.animate(
        results,
        path,
        origin(results, "x"),
        label="x at the start (m)",
        title="Columns topple off a rock slope: 129 rigid blocks, friction 21°",
        frames=np.flatnonzero(results.times < 7.4),
        camera=camera((-0.2, -1.0, 0.35), (12.0, 3.0, 6.6), 13.5),
        fps=14,
        window_size=(900, 500),
    )


def pair(name, seen, moments):
    """Two moments of a run side by side."""
    results = ddem.Results(RESULTS / name)
    values, halves = origin(results, "z"), []
    for moment in moments:
        frame = results[int(np.abs(results.times - moment).argmin())]
        plotter = ddem.plot(
            frame, values, label="height at the start (m)", window_size=(900, 1000), show=False
        )
        plotter.camera_position = seen
        plotter.camera.parallel_scale = np.linalg.norm(np.subtract(*seen[:2])) * np.tan(np.radians(15.0))
        plotter.reset_camera_clipping_range()
        halves.append(plotter.screenshot(return_img=True))
        plotter.close()
    return Image.fromarray(np.hstack(halves))


def wall(path):
    """The wall as it falls, and the stones at rest."""
    pair("wall", camera((1.0, 1.2, 0.55), (1.7, 1.9, 1.05), 3.5), (1.9, 6.0)).save(path)


def rockfall(path):
    """The blocks as they hit the berm, and at rest."""
    pair("rockfall", camera((0.75, -1.0, 0.5), (-3.0, 4.0, 13.2), 19.5), (2.9, 10.0)).save(path)


def main():
    """Draws all of them."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    for draw, name in ((toppling, "toppling.gif"), (wall, "wall.png"), (rockfall, "rockfall.png")):
        draw(PICTURES / name)
        print(PICTURES / name)


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Surfaces of the examples, as binary STL files beside this script.

    python examples/surfaces/make.py

`slope-dfn.stl` is all that is above the ground of a bench, and `arch.stl` all that is below an arch. Both are closed, so
that decks can cut by them and remove what is inside. Needs NumPy.
"""

import struct
from pathlib import Path

import numpy as np


def write(name, triangles):
    """Writes triangles (n, 3, 3) that point outward."""
    corners = np.asarray(triangles, float)
    volume = np.einsum("ni,ni->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6.0
    if volume < 0.0:
        corners = corners[:, ::-1]
    data = b" " * 80 + struct.pack("<I", len(corners))
    for corner in corners.reshape(-1, 9):
        data += struct.pack("<12fH", 0.0, 0.0, 0.0, *corner, 0)
    path = Path(__file__).with_name(name)
    path.write_bytes(data)
    print(path)


def above(x, y, heights, lid):
    """Triangles of the space between a ground with heights (nx, ny) over a grid and a level lid."""
    nx, ny = len(x), len(y)
    at = lambda i, j, z: (x[i], y[j], z)
    ground = lambda i, j: at(i, j, heights[i][j])
    triangles = []
    for i in range(nx - 1):
        for j in range(ny - 1):
            a, b, c, d = ground(i, j), ground(i + 1, j), ground(i + 1, j + 1), ground(i, j + 1)
            triangles += [(a, c, b), (a, d, c)]
            a, b, c, d = (at(*k, lid) for k in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)))
            triangles += [(a, b, c), (a, c, d)]
    rim = [(i, 0) for i in range(nx)] + [(nx - 1, j) for j in range(1, ny)]
    rim += [(i, ny - 1) for i in range(nx - 2, -1, -1)] + [(0, j) for j in range(ny - 2, 0, -1)]
    for (i, j), (k, m) in zip(rim, rim[1:] + rim[:1]):
        a, b, c, d = ground(i, j), ground(k, m), at(k, m, lid), at(i, j, lid)
        triangles += [(a, b, c), (a, c, d)]
    return triangles


def bench():
    """A bench 14 m high, whose face winds, below a hill that rises."""
    x, y = (-2.0, 9.0, 15.0, 34.0), (-2.0, 10.0, 22.0)
    heights = (
        (4.0, 4.0, 4.0),
        (4.0, 4.0, 4.0),
        (17.0, 18.5, 17.0),
        (20.0, 22.0, 21.0),
    )
    return above(x, y, heights, 30.0)


def below_arch():
    """The inside of a semicircular arch of 20 straight sides with corners 1 m from its middle, and the space below."""
    angles = np.linspace(0.0, np.pi, 21)
    outline = [(np.cos(angle), np.sin(angle)) for angle in angles] + [(-1.0, -0.3), (1.0, -0.3)]
    front, back = ([(x, y, z) for x, z in outline] for y in (-0.1, 0.3))
    triangles = []
    for i, j in zip(range(len(outline)), [*range(1, len(outline)), 0]):
        triangles += [(front[i], front[j], back[j]), (front[i], back[j], back[i])]
    for i in range(1, len(outline) - 1):
        triangles += [(front[0], front[i + 1], front[i]), (back[0], back[i], back[i + 1])]
    return triangles


if __name__ == "__main__":
    write("arch.stl", below_arch())
    write("slope-dfn.stl", bench())

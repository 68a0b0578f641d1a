#!/usr/bin/env python3
"""Surfaces of the examples, as binary STL files beside this script.

    python examples/surfaces/make.py

`slope-dfn.stl` is all that is above the ground of a bench. It is closed, so that a deck can cut by it and remove what is
inside. Needs NumPy.
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


if __name__ == "__main__":
    write("slope-dfn.stl", bench())

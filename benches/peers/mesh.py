"""The finite element model that ddem computes while joints hold, from the points of its results.

Blocks, joints, strips and corners together are one rectilinear grid of hexahedra. Its elements have
eight nodes and eight Gauss points, and each gives an eighth of its mass to each of its nodes.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import product
from pathlib import Path

import h5py
import numpy as np

DENSITY, YOUNG, POISSON = 2400.0, 18e9, 0.25
GRAVITY = -9.81
CORNERS = np.array(
    [[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1],
     [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]],
    float,
)  # fmt: skip


def elasticity() -> np.ndarray:
    """Elasticity for the strains xx yy zz xy yz zx, shear strains in full."""
    lame = YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON))
    shear = YOUNG / (2 * (1 + POISSON))
    matrix = np.diag([2 * shear] * 3 + [shear] * 3)
    matrix[:3, :3] += lame
    return matrix


def strain_of(gradients: np.ndarray) -> np.ndarray:
    """Strains from the amplitudes of some functions with these gradients, shape (n, 3)."""
    matrix = np.zeros((6, 3 * len(gradients)))
    for n, (x, y, z) in enumerate(gradients):
        matrix[:, 3 * n : 3 * n + 3] = [[x, 0, 0], [0, y, 0], [0, 0, z], [y, x, 0], [0, z, y], [z, 0, x]]
    return matrix


def stiffness(size: tuple[float, float, float]) -> np.ndarray:
    """Stiffness of a box, shape (24, 24)."""
    half = np.array(size) / 2
    matrix = np.zeros((24, 24))
    for point in product((-1 / np.sqrt(3), 1 / np.sqrt(3)), repeat=3):
        at = np.array(point)
        factors = 1 + CORNERS * at
        shape = [CORNERS[:, k] * factors[:, k - 2] * factors[:, k - 1] / 8 for k in range(3)]
        own = strain_of(np.stack(shape, axis=1) / half)
        matrix += half.prod() * own.T @ elasticity() @ own
    return matrix


@dataclass
class Grid:
    """Rectilinear grid of hexahedra, with x fastest."""

    axes: tuple[np.ndarray, np.ndarray, np.ndarray]

    @classmethod
    def of(cls, points: np.ndarray) -> "Grid":
        return cls(tuple(np.unique(points[:, k].round(9)) for k in range(3)))

    @property
    def nodes(self) -> int:
        return int(np.prod([len(axis) for axis in self.axes]))

    def numbers(self, points: np.ndarray) -> np.ndarray:
        """Numbers of the nodes at some points."""
        i, j, k = (np.searchsorted(axis, points[:, c].round(9)) for c, axis in enumerate(self.axes))
        nx, ny, _ = map(len, self.axes)
        return i + nx * (j + ny * k)

    @cached_property
    def elements(self) -> tuple[np.ndarray, np.ndarray]:
        """Nodes of the elements, shape (n, 8), and their sizes, shape (n, 3)."""
        cells = [np.arange(len(axis) - 1) for axis in self.axes]
        k, j, i = (grid.ravel() for grid in np.meshgrid(*cells[::-1], indexing="ij"))
        nx, ny, _ = map(len, self.axes)
        place = ((CORNERS + 1) / 2).astype(int)
        nodes = [(i + a) + nx * ((j + b) + ny * (k + c)) for a, b, c in place]
        sizes = [np.diff(axis)[cell] for axis, cell in zip(self.axes, (i, j, k))]
        return np.stack(nodes, axis=1), np.stack(sizes, axis=1)

    @cached_property
    def kinds(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Elements of equal size: their nodes, shape (n, 8), and their stiffness."""
        nodes, sizes = self.elements
        distinct, kind = np.unique(sizes.round(9), axis=0, return_inverse=True)
        kind = kind.ravel()
        return [(nodes[kind == n], stiffness(tuple(size))) for n, size in enumerate(distinct)]

    @cached_property
    def mass(self) -> np.ndarray:
        """Mass of each node."""
        nodes, sizes = self.elements
        mass = np.zeros(self.nodes)
        np.add.at(mass, nodes, (DENSITY * sizes.prod(axis=1) / 8)[:, None])
        return mass

    @property
    def held(self) -> np.ndarray:
        """True for the nodes at z = 0, which do not move."""
        nx, ny, nz = map(len, self.axes)
        return np.repeat(self.axes[2] == 0.0, nx * ny)


@dataclass
class DdemResults:
    """Points and last displacements of a run of ddem."""

    points: np.ndarray
    displacement: np.ndarray

    @classmethod
    def read(cls, folder: Path) -> "DdemResults":
        with h5py.File(folder / "blocks.vtkhdf") as file:
            data = file["VTKHDF"]
            count = int(data["NumberOfPoints"][-1])
            points = data["Points"][:count]
            return cls(points, data["PointData/displacement"][-count:])

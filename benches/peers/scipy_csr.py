"""Steps with the assembled matrix of SciPy in compressed rows."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import scipy
import scipy.sparse
from mesh import GRAVITY, Grid

VERSION = f"SciPy {scipy.__version__}, assembled CSR"


def assemble(grid: Grid) -> scipy.sparse.csr_matrix:
    size = 3 * grid.nodes
    matrix = scipy.sparse.csr_matrix((size, size))
    for nodes, stiffness in grid.kinds:
        places = (3 * nodes[:, :, None] + np.arange(3)).reshape(-1, 24).astype(np.int32)
        rows = np.repeat(places, 24, axis=1).ravel()
        columns = np.tile(places, (1, 24)).ravel()
        values = np.broadcast_to(stiffness.ravel(), (len(nodes), 576)).ravel()
        matrix += scipy.sparse.coo_matrix((values, (rows, columns)), shape=(size, size)).tocsr()
    return matrix


class CsrMatrix:
    """Velocities of half steps and displacements."""

    def __init__(self, grid: Grid, time_step: float, threads: int) -> None:
        free = np.repeat(~grid.held, 3).astype(float)
        scale = time_step * free / np.repeat(grid.mass, 3)
        # The matrix gives the change of the velocities in a step.
        matrix = scipy.sparse.diags(scale) @ assemble(grid)
        matrix = matrix.tocsr()
        bounds = np.linspace(0, matrix.shape[0], threads + 1).astype(int)
        self.parts = [slice(a, b) for a, b in zip(bounds, bounds[1:])]
        self.rows = [matrix[part] for part in self.parts] if threads > 1 else [matrix]
        self.pool = ThreadPoolExecutor(threads) if threads > 1 else None
        self.weight = np.tile([0.0, 0.0, GRAVITY * time_step], grid.nodes) * free
        self.time_step = time_step
        self.u = np.zeros(3 * grid.nodes)
        self.v = np.zeros(3 * grid.nodes)
        self.moved = False

    def advance(self, part: int) -> None:
        own = self.parts[part]
        change = self.weight[own] - self.rows[part] @ self.u
        self.v[own] += change if self.moved else 0.5 * change

    def step(self, count: int) -> None:
        for _ in range(count):
            if self.pool:
                list(self.pool.map(self.advance, range(len(self.parts))))
            else:
                self.advance(0)
            self.moved = True
            self.u += self.time_step * self.v

    def displacement(self) -> np.ndarray:
        return self.u.reshape(-1, 3)


PEER = CsrMatrix

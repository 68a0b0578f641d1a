"""Steps with Akantu's solid mechanics model, explicit with lumped masses, on one thread."""

import tempfile
from pathlib import Path

import akantu
import numpy as np
from mesh import DENSITY, GRAVITY, POISSON, YOUNG, Grid

VERSION = f"Akantu {akantu.__version__}, explicit"
# The package is built without threads.
THREADS = (1,)

MATERIAL = f"""
material elastic [
    name = rock
    rho = {DENSITY}
    E = {YOUNG}
    nu = {POISSON}
]
"""


class AkantuSolid:
    """Model of Akantu on a grid."""

    def __init__(self, grid: Grid, time_step: float, threads: int) -> None:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "material.dat"
            path.write_text(MATERIAL)
            akantu.parseInput(str(path))
        self.mesh = akantu.Mesh(3)
        accessor = akantu.MeshAccessor(self.mesh)
        accessor.resizeNodes(grid.nodes)
        z, y, x = np.meshgrid(*grid.axes[::-1], indexing="ij")
        self.mesh.getNodes()[:] = np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)
        elements, _ = grid.elements
        self.mesh.addConnectivityType(akantu._hexahedron_8)
        accessor.resizeConnectivity(len(elements), akantu._hexahedron_8)
        self.mesh.getConnectivity(akantu._hexahedron_8)[:] = elements
        accessor.makeReady()
        self.model = akantu.SolidMechanicsModel(self.mesh)
        self.model.initFull(_analysis_method=akantu._explicit_lumped_mass)
        self.model.setTimeStep(time_step)
        self.model.getBlockedDOFs()[grid.held] = True
        self.model.getExternalForce()[:, 2] = GRAVITY * grid.mass
        # Its scheme begins with the accelerations of the state before the first step.
        self.model.getAcceleration()[~grid.held, 2] = GRAVITY

    def step(self, count: int) -> None:
        for _ in range(count):
            self.model.solveStep("explicit_lumped")

    def displacement(self) -> np.ndarray:
        return self.model.getDisplacement()


PEER = AkantuSolid

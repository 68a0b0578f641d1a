"""Blocks given as hexahedra from another program."""

import copy

import ddem
import numpy as np
import pytest

CUBE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float)


def column(blocks: int) -> dict:
    nodes = np.vstack([CUBE + (0, 0, block) for block in range(blocks)])
    hexes = np.arange(8 * blocks).reshape(blocks, 8)
    return {"nodes": nodes, "hexes": hexes, "blocks": np.arange(blocks)}


def test_mesh_column_carries_weight():
    rock = ddem.Material(density=2400, young=18e9, poisson=0.25)
    seam = ddem.Joint(normal_stiffness=1e10, shear_stiffness=4e9)
    model = ddem.Model(gravity=(0, 0, -9.81))
    model.add_blocks(mesh=column(5), material=rock, joint=seam)
    model.fix("xyz", z=0.0)
    simulation = model.build()
    assert (simulation.n_blocks, simulation.n_nodes) == (5, 40)
    simulation.relax(tolerance=1e-8)
    assert simulation.reaction(simulation.nodes(z=0.0))[2] == pytest.approx(5 * 2400 * 9.81, rel=1e-6)
    assert copy.deepcopy(model).build().n_nodes == 40


def test_face_pairs_make_joints():
    rock = ddem.Material(density=2400, young=18e9, poisson=0.25)
    seam = ddem.Joint(normal_stiffness=1e10, shear_stiffness=4e9)
    mesh = column(2)
    mesh["joints"] = [{"faces": [mesh["hexes"][0][4:], mesh["hexes"][1][:4]], "joint": seam}]
    model = ddem.Model()
    model.add_blocks(mesh=mesh, material=rock)
    of_pairs = model.build().n_pairs
    model = ddem.Model()
    model.add_blocks(mesh=column(2), material=rock, joint=seam)
    assert of_pairs == model.build().n_pairs > 0


def test_mesh_errors_are_named():
    rock = ddem.Material(density=2400, young=18e9, poisson=0.25)
    mesh = column(2)
    mesh["nodes"][3] += 0.1
    model = ddem.Model()
    model.add_blocks(mesh=mesh, material=rock)
    with pytest.raises(ddem.ModelError, match=r"block 0 \(number of hexahedra: 1\) is not a parallelepiped"):
        model.build()

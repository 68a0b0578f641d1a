"""Fixtures of all tests of pictures."""

import json

import numpy as np
import pytest
from ddem._plot import plot
from four_blocks import four_blocks


@pytest.fixture
def simulation():
    return four_blocks()


@pytest.fixture
def drawn(simulation):
    """The meshes of a picture by the name of their actor."""
    plotters = []

    def draw(*args, **options):
        plotters.append(plot(options.pop("of", simulation), *args, show=False, **options))
        return {
            name: actor.mapper.dataset
            for name, actor in plotters[-1].actors.items()
            if hasattr(getattr(actor, "mapper", None), "dataset")
        }

    yield draw
    for plotter in plotters:
        plotter.close()


@pytest.fixture
def folder(simulation, tmp_path):
    """Two frames written by VTK; in the second frame all displacements are twice as large."""
    pv = pytest.importorskip("pyvista")
    from vtkmodules.util.vtkAlgorithm import VTKPythonAlgorithmBase
    from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline as Pipeline
    from vtkmodules.vtkIOHDF import vtkHDFWriter

    class MovingGrid(VTKPythonAlgorithmBase):
        def __init__(self, grid, moving):
            super().__init__(nInputPorts=0, nOutputPorts=1, outputType="vtkUnstructuredGrid")
            self.grid, self.moving = grid, moving

        def RequestInformation(self, request, inputs, outputs):
            out = outputs.GetInformationObject(0)
            out.Set(Pipeline.TIME_STEPS(), [0.5, 1.0], 2)
            out.Set(Pipeline.TIME_RANGE(), [0.5, 1.0], 2)
            return 1

        def RequestData(self, request, inputs, outputs):
            out = outputs.GetInformationObject(0)
            grid = self.grid.copy()
            for name in self.moving:
                grid.point_data[name] = self.grid[name] * 2.0 * out.Get(Pipeline.UPDATE_TIME_STEP())
            grid.GetInformation().Set(grid.DATA_TIME_STEP(), out.Get(Pipeline.UPDATE_TIME_STEP()))
            outputs.GetInformationObject(0).Get(grid.DATA_OBJECT()).ShallowCopy(grid)
            return 1

    def write(name, grid, moving):
        source, writer = MovingGrid(grid, moving), vtkHDFWriter()
        writer.SetInputConnection(source.GetOutputPort())
        writer.SetFileName(str(tmp_path / name))
        writer.SetWriteAllTimeSteps(True)
        writer.Write()

    grid = pv.UnstructuredGrid({pv.CellType.HEXAHEDRON: simulation.elements}, simulation.points)
    grid.point_data["displacement"] = simulation.displacement.astype(np.float32)
    grid.cell_data["stress"] = simulation.stress.astype(np.float32)
    grid.cell_data["block"] = simulation.element_block.astype(np.int32)
    write("blocks.vtkhdf", grid, ["displacement"])
    quads = pv.UnstructuredGrid({pv.CellType.QUAD: simulation.quads}, simulation.pairs["point"])
    for name in ("displacement", "state", "slip"):
        quads.point_data[name] = simulation.pairs[name].astype(np.float32)
    write("joints.vtkhdf", quads, ["displacement"])
    (tmp_path / "summary.json").write_text(json.dumps({"title": "written", "deck": ""}))
    return tmp_path

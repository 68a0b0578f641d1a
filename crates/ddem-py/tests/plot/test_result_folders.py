"""Folders of results are drawn frame by frame."""

import json

import numpy as np
import pytest
from ddem._plot import plot

pv = pytest.importorskip("pyvista")
pytest.importorskip("plotly")


@pytest.fixture
def folder(simulation, tmp_path):
    """Two frames written by VTK; in the second frame all displacements are twice as large."""
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


def test_results_are_drawn_frame_by_frame(drawn, folder, simulation):
    for frame, share in ((0, 1.0), (-2, 1.0), (1, 2.0), (-1, 2.0)):
        mesh = drawn(of=folder, frame=frame, scale=50.0)["blocks"]
        moved = simulation.points + 50.0 * share * simulation.displacement
        assert np.allclose(mesh.points, moved[mesh["node"]], atol=1e-5)
    mesh = drawn("stress", of=str(folder), component="xx")["blocks"]
    exact = simulation.stress.astype(np.float32)[mesh["element"], 0]
    assert np.array_equal(mesh.cell_data["stress xx (Pa)"], exact)
    mesh = drawn("block", of=folder)["blocks"]
    assert np.array_equal(mesh.cell_data["block"], simulation.element_block[mesh["element"]])


def test_joints_of_results_are_drawn(drawn, folder):
    meshes = drawn(of=folder, joints="state", scale=10.0)
    assert np.isclose(meshes["failed in tension"].bounds[4], 10 * 2 * 0.002 * np.sin(3), atol=1e-6)


def test_missing_frames_fields_and_folders_are_refused(folder, tmp_path):
    with pytest.raises(ValueError, match=r"frame: 2 does not exist, .* has 2 frames"):
        plot(folder, frame=2, show=False)
    with pytest.raises(ValueError, match="field: 'strss' .* did you mean 'stress'.*'block'"):
        plot(folder, "strss", show=False)
    with pytest.raises(FileNotFoundError, match="elsewhere does not exist"):
        plot(tmp_path / "elsewhere", show=False)
    (folder / "joints.vtkhdf").unlink()
    with pytest.raises(ValueError, match="no joints"):
        plot(folder, joints="state", show=False)

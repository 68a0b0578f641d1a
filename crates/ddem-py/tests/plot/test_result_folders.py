"""Folders of results are drawn frame by frame."""

import numpy as np
import pytest
from ddem import Results
from ddem._plot import plot

pytest.importorskip("pyvista")
pytest.importorskip("plotly")


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


def test_changed_bits_never_give_other_fields(folder):
    file = folder / "blocks.vtkhdf"
    whole, noticed = file.read_bytes(), 0
    exact = Results(folder)[-1].displacement
    for at in range(31, len(whole), len(whole) // 60):
        changed = bytearray(whole)
        changed[at] ^= 1 << at % 8
        file.write_bytes(changed)
        try:
            assert np.array_equal(Results(folder)[-1].displacement, exact), at
        except OSError as error:
            assert "is damaged: restore it" in str(error), at
            noticed += 1
    assert noticed > 0

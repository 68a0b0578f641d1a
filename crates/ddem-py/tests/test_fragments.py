"""Fragments and peaks of a cube that is pulled apart."""

from __future__ import annotations

from pathlib import Path

import ddem
import h5py
import numpy as np
import pytest

ROCK = ddem.Material(density=2400, young=18e9, poisson=0.25)
SEAM = ddem.Joint(thickness=0.0, normal_stiffness=1e10, shear_stiffness=1e10)
WEAK = ddem.Joint(
    thickness=0.0,
    normal_stiffness=1e10,
    shear_stiffness=1e10,
    cohesion=1e5,
    friction=30,
    tension=1e4,
)


def cube(peaks: bool = True) -> ddem.Model:
    model = ddem.Model(title="cube", peaks=peaks)
    model.add_blocks(size=(3, 3, 3), count=(3, 3, 3), divisions=1, material=ROCK, joint=SEAM)
    model.assign(joint=WEAK, z=1.0)
    model.fix("xyz", z=0.0)
    model.fix("xyz", velocity=(0, 0, 1), history={"ramp": 1e-3}, z=3.0)
    return model


def test_cube_pulled_apart_has_two_fragments(tmp_path: Path) -> None:
    simulation = cube().build()
    assert simulation.fragments["blocks"].tolist() == [27]
    simulation.run(0.02, record=tmp_path / "whole", name="pull", quiet=True)
    fragments = simulation.fragments
    assert fragments["blocks"].tolist() == [18, 9]
    assert fragments["volume"] == pytest.approx([18.0, 9.0], rel=1e-12)
    assert fragments["mass"] == pytest.approx([18.0 * 2400, 9.0 * 2400], rel=1e-12)
    assert fragments["size"] == pytest.approx(np.cbrt([18.0, 9.0]), rel=1e-12)
    assert fragments["passing"] == pytest.approx([1.0, 1 / 3], rel=1e-12)
    assert fragments["centroid"].shape == fragments["velocity"].shape == (2, 3)
    assert fragments["velocity"][0, 2] == pytest.approx(1.0, abs=0.2)
    assert simulation.block_fragment.tolist() == [1] * 9 + [0] * 18
    expected = simulation.block_fragment[simulation.element_block]
    assert np.array_equal(simulation.field("fragment"), expected)
    assert simulation.summary["fragments"]["number"] == 2
    assert simulation.summary["fragments"]["largest_volume"] == pytest.approx(18.0)
    # The files contain the same.
    assert np.array_equal(ddem.read_fragments(tmp_path / "whole"), fragments)
    assert np.array_equal(ddem.read_fragments(tmp_path / "whole", "pull"), fragments)
    with pytest.raises(ValueError, match="stage: 'pulls' .* did you mean 'pull'"):
        ddem.read_fragments(tmp_path / "whole", "pulls")
    with h5py.File(tmp_path / "whole" / "blocks.vtkhdf") as file:
        root = file["VTKHDF"]
        last = root["CellData"]["fragment"][-simulation.n_elements :]
        assert np.issubdtype(last.dtype, np.integer) and np.array_equal(last, expected)
        for name, group in [
            ("peak_velocity", "PointData"),
            ("peak_tension", "CellData"),
            ("peak_compression", "CellData"),
        ]:
            values = getattr(simulation, name)
            assert np.array_equal(root[group][name][-len(values) :], values), name


def test_peaks_grow_and_are_saved(tmp_path: Path) -> None:
    whole = cube().build()
    assert whole.peak_velocity.shape == (whole.n_nodes,)
    assert whole.peak_tension.shape == whole.peak_compression.shape == (whole.n_elements,)
    assert not whole.peak_velocity.any() and not whole.peak_tension.any()
    whole.start()
    whole.step(10, quiet=True)
    before = whole.peak_velocity
    whole.save(tmp_path / "state.h5")
    again = ddem.load(tmp_path / "state.h5")
    for simulation in (whole, again):
        simulation.step(100, quiet=True)
    for name in ("peak_velocity", "peak_tension", "peak_compression"):
        assert np.array_equal(getattr(whole, name), getattr(again, name)), name
    assert (whole.peak_velocity >= before).all() and (whole.peak_velocity > before).any()
    assert (whole.peak_tension > 0).all()
    # Peaks use velocities at mid-step; the present velocities lie between two of these.
    assert (np.linalg.norm(whole.velocity, axis=1) <= 1.05 * whole.peak_velocity + 1e-9).all()


def test_peaks_need_the_model_option() -> None:
    simulation = cube(peaks=False).build()
    with pytest.raises(ddem.ModelError, match="peak_velocity.*"):
        _ = simulation.peak_velocity
    with pytest.raises(ddem.ModelError, match=r"Model\(peaks=True\)"):
        simulation.field("peak_tension")
    assert "peaks" not in cube(peaks=False).deck["model"]
    assert cube().deck["model"]["peaks"] is True


def test_fragment_sizes_are_drawn(tmp_path: Path) -> None:
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    simulation = cube().build()
    simulation.run(0.02, record=tmp_path / "run", quiet=True)
    for source in (simulation, tmp_path / "run", simulation.fragments):
        figure = ddem.plot_sizes(source, file=tmp_path / "sizes.png")
        (axes,) = figure.axes
        assert axes.get_xscale() == "log"
        (line,) = axes.lines
        assert line.get_xdata() == pytest.approx(np.cbrt([18.0, 9.0]))
        assert line.get_ydata() == pytest.approx([100.0, 100 / 3])
    assert (tmp_path / "sizes.png").stat().st_size > 5000
    plt.close("all")
    with pytest.raises(ValueError, match="there are no fragments to draw"):
        ddem.plot_sizes(simulation.fragments[:0])
    with pytest.raises(ValueError, match="fragments: expected a simulation"):
        ddem.plot_sizes(np.zeros(3))
    with pytest.raises(ValueError, match="only folders"):
        ddem.plot_sizes(simulation, stage="pull")
    with pytest.raises(FileNotFoundError):
        ddem.plot_sizes(tmp_path)


@pytest.mark.parametrize(
    "sizes", [(0.05, 1.4), (0.3, 0.9), (0.195, 0.246), (1.4, 1.4), (1e-4, 7.0), (3e-3, 3.3e-3)]
)
def test_size_labels_do_not_overlap(sizes: tuple[float, float]) -> None:
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    rows = np.zeros(2, [("size", "f8"), ("mass", "f8")])
    rows["size"], rows["mass"] = sorted(sizes, reverse=True), 1.0
    figure = ddem.plot_sizes(rows)
    (axes,) = figure.axes
    figure.canvas.draw()
    low, high = axes.get_xlim()
    assert low < min(sizes) <= max(sizes) < high
    marks = [*axes.xaxis.get_major_ticks(), *axes.xaxis.get_minor_ticks()]
    named = [m for m in marks if low <= m.get_loc() <= high and m.label1.get_text()]
    named.sort(key=lambda mark: mark.get_loc())
    assert len(named) >= 2
    for mark in named:
        assert float(mark.label1.get_text()) == pytest.approx(mark.get_loc(), rel=1e-5)
    places = [mark.label1.get_window_extent() for mark in named]
    for left, right in zip(places, places[1:]):
        assert left.x1 + 5 < right.x0, [mark.label1.get_text() for mark in named]
    plt.close("all")

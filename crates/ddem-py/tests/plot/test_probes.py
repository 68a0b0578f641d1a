"""Histories of probes, read and drawn."""

import csv

import pytest
from ddem._probes import plot_probes, read_probes

pytest.importorskip("pyvista")
pytest.importorskip("plotly")


@pytest.fixture
def probed(tmp_path):
    rows = [
        ["stage", "step", "time", "a.b.x", "a.b.y", "a.b.z"]
        + [f"core.{part}" for part in ("xx", "yy", "zz", "xy", "yz", "zx")],
        ["settle", 0, 0.0, 0.1, -2e-300, 3, 1, 2, 3, 4, 5, 6],
        ["settle", 7, 0.0, "", "", "", 2, 3, 4, 5, 6, 7],
        ["push", 9, 0.30000000000000004, 1, 2, 3, "", "", "", "", "", ""],
    ]
    with open(tmp_path / "probes.csv", "w", newline="") as file:
        csv.writer(file).writerows(rows)
    return tmp_path


def test_probes_are_read_back(probed):
    probes = read_probes(probed)
    assert list(probes) == ["a.b", "core"]
    assert probes["a.b"].dtype.names == ("time", "step", "x", "y", "z")
    assert probes["a.b"]["step"].tolist() == [0, 9]
    assert probes["a.b"]["time"][1] == 0.30000000000000004
    assert probes["a.b"]["y"].tolist() == [-2e-300, 2.0]
    assert probes["core"]["step"].tolist() == [0, 7]
    assert probes["core"]["zx"].tolist() == [6.0, 7.0]


def test_incomplete_last_row_is_ignored(probed):
    with open(probed / "probes.csv", "a") as file:
        file.write("push,11,0.4,1,2")
    assert read_probes(probed)["a.b"]["step"].tolist() == [0, 9]


def test_probes_are_drawn_over_time_or_steps(probed, simulation, tmp_path):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure = plot_probes(probed, file=tmp_path / "probes.png")
    assert (tmp_path / "probes.png").stat().st_size > 5000
    first, second = figure.axes
    assert first.get_title(loc="left") == "a.b"
    assert [line.get_label() for line in second.lines] == ["xx", "yy", "zz", "xy", "yz", "zx"]
    assert second.get_ylabel() == "stress (Pa)"
    assert second.get_xlabel() == "time (s)"
    assert first.lines[1].get_ydata().tolist() == [-2e-300, 2.0]

    (axes,) = plot_probes(simulation, "top", component="z").axes
    assert axes.get_xlabel() == "step"
    assert axes.get_ylabel() == "velocity (m/s)"
    assert axes.lines[0].get_xdata().tolist() == [0, 10, 20, 30, 40]

    first, _ = plot_probes(read_probes(probed)).axes
    assert first.lines[1].get_ydata().tolist() == [-2e-300, 2.0]
    with pytest.raises(TypeError, match="or histories, found list"):
        plot_probes([1.0, 2.0])
    plt.close("all")


def test_invalid_probes_are_refused(probed, simulation):
    with pytest.raises(ValueError, match="names: 'tap' .* did you mean 'top'"):
        plot_probes(simulation, ["tap"])
    with pytest.raises(ValueError, match="component: 'xx' .* valid: 'x', 'y', 'z'"):
        plot_probes(simulation, "top", component="xx")
    with pytest.raises(FileNotFoundError):
        plot_probes(probed / "elsewhere")
    simulation.probes = {}
    with pytest.raises(ValueError, match="there are no probes to draw"):
        plot_probes(simulation)

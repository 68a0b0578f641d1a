"""Pictures of cut rock: blocks in colours, and stereonets."""

from __future__ import annotations

from pathlib import Path

import ddem
import numpy as np
import pytest
from ddem import _scene
from ddem._stereonet import great_circle, mean_normal, normals_of, project


def rock() -> ddem.Model:
    """A cube with a joint set, a fault and a joined cut."""
    granite = ddem.Material(density=2700, young=50e9, poisson=0.25)
    joint = ddem.Joint(normal_stiffness=5e9, shear_stiffness=1e9, friction=22)
    model = ddem.Model(title="cube")
    model.add_region(box={"from": (0, 0, 0), "to": (6, 6, 6)}, material=granite, seed=1)
    model.cut(
        name="set", set={"dip": 30, "dip_direction": 90, "fisher": 100, "spacing": 2.0}, joint=joint
    )
    model.cut(
        name="fault", plane={"dip": 60, "dip_direction": 250, "through": (3, 3, 3)}, joint=joint
    )
    model.cut(name="half", plane={"dip": 90, "dip_direction": 0, "through": (3, 3, 3)}, join=True)
    return model


def test_equal_area_projection() -> None:
    # Schmidt's net: a plunge p lies at √2 sin((90° − p)/2) from the centre.
    plunge, trend = np.radians([90, 60, 30, 0.0]), np.radians([0, 40, 130, 250.0])
    directions = np.stack(
        [np.cos(plunge) * np.sin(trend), np.cos(plunge) * np.cos(trend), -np.sin(plunge)], axis=1
    )
    radius = np.sqrt(2) * np.sin((np.pi / 2 - plunge) / 2)
    expected = radius[:, None] * np.stack([np.sin(trend), np.cos(trend)], axis=1)
    assert np.allclose(project(directions), expected, atol=1e-15)
    # Both ends of an axis are one pole.
    assert np.allclose(project(-directions[:3]), expected[:3], atol=1e-15)


def test_great_circles_lie_in_their_plane() -> None:
    for dip, direction in ((40, 130), (90, 20), (0, 0)):
        normal = normals_of(dip, direction)[0]
        places = great_circle(normal)
        # Back from the net to directions.
        square = (places**2).sum(axis=1)
        directions = np.column_stack(
            [places * np.sqrt(np.maximum(2 - square, 0))[:, None], -(1 - square)]
        )
        assert np.abs(directions @ normal).max() < 1e-9
    steepest = great_circle(normals_of(40, 130)[0])[90]
    trend = np.degrees(np.arctan2(*steepest)) % 360
    assert trend == pytest.approx(130, abs=1e-9)


def test_mean_of_poles_counts_axes() -> None:
    normals = normals_of([89, 89], [10, 190])
    mean = mean_normal(normals, np.ones(2))
    assert abs(mean[2]) < 1e-9 and abs(mean @ normals_of(90, 10)[0]) == pytest.approx(1)


def test_stereonet_has_the_poles(tmp_path: Path) -> None:
    cells = rock().cells()
    figure = ddem.plot_stereonet(cells, slope=(70, 90), file=tmp_path / "net.png")
    assert (tmp_path / "net.png").stat().st_size > 10_000
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert [text.split()[0] for text in texts] == ["set", "fault", "slope"]
    assert texts[1:] == ["fault 60/250", "slope 70/090"]
    poles = [line for line in figure.axes[0].lines if line.get_label().startswith("fault")][0]
    place = np.radians(250 - 180)
    radius = np.sqrt(2) * np.sin(np.radians(60) / 2)
    assert np.allclose(poles.get_xydata(), [[radius * np.sin(place), radius * np.cos(place)]])
    with pytest.raises(ValueError, match="did you mean 'fault'"):
        ddem.plot_stereonet(cells, cuts="falut")


def test_blocks_are_drawn(tmp_path: Path) -> None:
    pyvista = pytest.importorskip("pyvista")
    cells = rock().cells()
    for color in ("block", "mode", "factor", "volume", "region", cells.table["width"] * 2):
        path = tmp_path / "blocks.png"
        ddem.plot_blocks(cells, color, explode=0.3, screenshot=path, window_size=(400, 300))
        assert pyvista.read(path).dimensions[:2] == (400, 300)
        path.unlink()
    ddem.plot_blocks(rock(), "mode", html=tmp_path / "blocks.html")
    assert "plotly" in (tmp_path / "blocks.html").read_text()[:200_000]


def test_drawn_faces_are_those_of_blocks() -> None:
    pytest.importorskip("pyvista")
    cells = rock().cells()
    plotter = ddem.plot_blocks(cells, show=False)
    drawn = plotter.actors["blocks"].mapper.dataset
    # The faces of the joined cut are inside of blocks.
    inner = cells.planes[cells.planes["joined"]]["area"].sum()
    whole = cells.table["surface"].sum() - 2 * inner
    assert inner == pytest.approx(36) and drawn.area == pytest.approx(whole, rel=1e-6)
    plotter.close()
    one = np.arange(len(cells)) == 2
    plotter = ddem.plot_blocks(cells, "volume", where=one, explode=0.5, show=False)
    drawn = plotter.actors["blocks"].mapper.dataset
    assert drawn.area == pytest.approx(cells.table["surface"][2], rel=1e-6)
    plotter.close()


def test_joined_cells_have_no_lines_between_them() -> None:
    """A cut that ends on another one leaves faces whose corners do not match, within one block."""
    pytest.importorskip("pyvista")
    model = ddem.Model()
    granite = ddem.Material(density=2700, young=50e9, poisson=0.25)
    model.add_region(box={"from": (0, 0, 0), "to": (4, 3, 2)}, material=granite)
    model.cut(plane={"dip": 60, "dip_direction": 90, "through": (2, 1, 1)}, join=True)
    model.cut(plane={"dip": 90, "dip_direction": 0, "through": (2, 1.7, 1)}, join=True, x=(0, 2))
    cells = model.cells()

    def length(where: list[int]) -> float:
        plotter = ddem.plot_blocks(cells, where=where, show=False)
        drawn = plotter.actors["edges"].mapper.dataset.compute_cell_sizes()["Length"].sum()
        plotter.close()
        return float(drawn)

    assert length([0, 1, 2]) == pytest.approx(4 * (4 + 3 + 2), rel=1e-6)
    # Without the small cell its place is seen, with the edges of the joined plane.
    corner = int(np.argmin(cells.table["volume"]))
    assert length([cell for cell in range(3) if cell != corner]) > 4 * (4 + 3 + 2) + 1


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"color": "volumes"}, "did you mean 'volume'"),
        ({"color": [1.0, 2.0]}, r"color: has the shape \(2,\)"),
        ({"where": [10_000]}, "where: "),
        ({"where": []}, "no cell is left"),
        ({"explode": float("nan")}, "explode: nan is not finite"),
    ],
)
def test_wrong_arguments_are_refused(keys: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        ddem.plot_blocks(rock(), **keys, show=False)
    with pytest.raises(TypeError, match="expected a Model or its cells"):
        ddem.plot_blocks("deck.toml")


def test_parts_of_a_cell_have_no_lines_between_them() -> None:
    """A plane through a brick of 2×1×1 m makes two cells, of which each edge is halved by its parts."""
    stiff = {"normal_stiffness": 1e10, "shear_stiffness": 1e10}
    model = ddem.Model(contact=False)
    rock = ddem.Material(density=2500, young=20e9, poisson=0.25)
    model.add_region(box={"from": (0, 0, 0), "to": (2, 1, 1)}, material=rock)
    middle = {"dip": 90, "dip_direction": 90, "through": (1, 0, 0)}
    model.cut(plane=middle, joint=ddem.Joint(**stiff))
    model.fix("xyz", z=0.0)
    model.load(pressure=1e6, z=1.0)
    simulation = model.build(threads=1)
    simulation.relax(quiet=True)
    frame = _scene.scene_of(simulation, -1, False)
    faces, _ = _scene.skin(frame.elements)
    assert len(faces) == 2 * 6 * 4
    assert len(_scene.lines_of(frame.points, faces, False)) == 2 * 12 * 2

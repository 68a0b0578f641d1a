"""Regions and cuts: models and decks cut the same cells, and tables, polyhedra and runs agree."""

from __future__ import annotations

import csv
import math
import pickle
import subprocess
from pathlib import Path

import ddem
import numpy as np
import pytest
from sample_models import ROCK, command_line, refused, run_command, same, same_state, wedge

SMOOTH = ddem.Joint(normal_stiffness=1e9, shear_stiffness=1e9, friction=30, name="smooth")


def sets() -> ddem.Model:
    """A cube cut by scattered sets and a tunnel, which a stage excavates."""
    model = ddem.Model(title="sets", gravity=(0, 0, -9.81))
    # The tunnel may be named before it is cut.
    model.remove(inside="adit", from_="dig")
    model.add_region(box={"from": (0, 0, 0), "to": (8, 8, 8)}, material=ROCK, seed=3)
    for dip, direction in ((30, 80), (70, 200)):
        spacing = {"mean": 3.0, "spread": 0.9}
        model.cut(
            set={"dip": dip, "dip_direction": direction, "fisher": 80, "spacing": spacing},
            joint=SMOOTH,
        )
    outline = np.array([(-1, 0), (1, 0), (1, 2), (-1, 2)])
    model.cut(
        name="adit", tunnel={"outline": outline, "from": (4, 0, 3), "to": (4, 8, 3)}, join=True
    )
    model.fix("xyz", z=0.0)
    model.stage("rest", kind="relax", tolerance=1e-3)
    model.stage("dig", kind="dynamic", duration=2e-4)
    return model


def test_wedge_has_its_volume_and_factor() -> None:
    # Hoek and Bray's wedge by the vectors of its faces: the numbers of examples/verification/cells_wedge.toml.
    cells = wedge().cells()
    (row,) = np.flatnonzero(cells.table["mode"] == "slides on two")
    found = cells.table[row]
    assert found["volume"] == pytest.approx(390.05724, rel=1e-7)
    assert (found["plunge"], found["trend"]) == pytest.approx((37.05830, 155.84807), abs=1e-5)
    assert found["factor"] == pytest.approx(0.877022, rel=1e-6)
    assert found["on"] == "a;b"
    # Its faces: the two joints, the face of the slope and its top.
    areas = sorted(area(face) for face in cells.faces(int(row)))
    assert len(areas) == found["faces"] == 4
    assert found["surface"] == pytest.approx(sum(areas), rel=1e-12)
    assert any(part == pytest.approx(170.39287, rel=1e-7) for part in areas)
    assert any(part == pytest.approx(61.68365, rel=1e-7) for part in areas)
    assert repr(cells) == "<Cells 'wedge': 4 blocks of 4 cells>"


def test_joints_are_left_out(tmp_path: Path) -> None:
    model = wedge()
    model.join(cut="a")
    assert model.deck["join"] == [{"where": {"cut": "a"}}]
    assert len(set(model.cells().table["block"])) < len(set(wedge().cells().table["block"]))
    path = tmp_path / "deck.toml"
    assert ddem.Model.from_deck(model.to_deck(path) and path).deck == model.deck
    model.join(cut="c")
    assert "there is no cut named `c`" in refused(model.cells, ddem.ModelError)


def area(corners: np.ndarray) -> float:
    """Area of a plane polygon [m²]."""
    start = corners[0]
    turns = np.cross(corners[1:-1] - start, corners[2:] - start)
    return 0.5 * float(np.linalg.norm(turns.sum(axis=0)))


def test_planes_have_their_orientation() -> None:
    planes = wedge().cells().planes
    assert planes["cut"].tolist() == ["a", "b"]
    assert planes["dip"] == pytest.approx([40, 60], abs=1e-12)
    assert planes["dip_direction"] == pytest.approx([130, 220], abs=1e-12)
    assert not planes["joined"].any()


def test_cells_fill_the_region_and_close() -> None:
    cells = sets().cells()
    assert len(cells) == len(cells.table) > 20
    assert cells.table["volume"].sum() == pytest.approx(512, rel=1e-12)
    assert cells.blocks["volume"].sum() == pytest.approx(512, rel=1e-12)
    assert cells.blocks["cells"].sum() == len(cells)
    for number in range(len(cells)):
        faces = cells.faces(number)
        # Divergence theorem: the sum of x · n A / 3.
        volume = 0.0
        for face in faces:
            turns = np.cross(face[1:-1] - face[0], face[2:] - face[0]).sum(axis=0)
            volume += float(face[0] @ turns) / 6.0
        assert volume == pytest.approx(cells.table["volume"][number], rel=1e-9, abs=1e-12)
        corners = {tuple(corner) for face in faces for corner in face}
        assert len(corners) == cells.table["vertices"][number]
    with pytest.raises(IndexError):
        cells.faces(len(cells))
    # Every plane of a cut has a face on either side.
    assert np.bincount(cells.face_plane[cells.face_plane >= 0]).min() >= 2


def test_table_is_that_of_the_command_line(tmp_path: Path) -> None:
    model = sets()
    model.to_deck(tmp_path / "sets.toml")
    command = [command_line(), "cut", tmp_path / "sets.toml", "--out", tmp_path / "cut"]
    subprocess.run(command, check=True, capture_output=True, timeout=60)
    table = model.cells().table
    with (tmp_path / "cut" / "blocks.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(table)
    numbers = ("volume", "surface", "free_area", "width", "faces", "vertices", "hexes", "block")
    for name in (*numbers, "factor", "plunge", "trend"):
        of_file = np.array([float(row[name] or "nan") for row in rows])
        assert same(of_file, np.asarray(table[name], np.float64)), name
    assert same(
        np.array([[float(row[axis]) for axis in "xyz"] for row in rows]),
        np.ascontiguousarray(table["centroid"]),
    )
    for name in ("region", "material", "cuts", "mode", "on"):
        assert [row[name] for row in rows] == table[name].tolist(), name


def test_shorthands_give_the_same_cells() -> None:
    model = ddem.Model(title="sets")
    model.add_region(box=((0, 0, 0), (8, 8, 8)), material=ROCK)
    outline = [(-1, 0), (1, 0), (1, 2), (-1, 2)]
    model.cut(
        tunnel={"outline": outline, "start": (4, 0, 3), "end": (4, 8, 3)}, join=True, name="adit"
    )
    other = ddem.Model(title="sets")
    other.add_region(box={"from": (0, 0, 0), "to": (8, 8, 8)}, material=ROCK)
    other.cut(
        tunnel={"outline": outline, "from": (4, 0, 3), "to": (4, 8, 3)}, join=True, name="adit"
    )
    assert same(model.blocks(), other.cells().table)
    assert model.to_deck() == other.to_deck()
    assert "box" in refused(lambda: model.add_region(box=((0, 0, 0),), material=ROCK))


def test_runs_give_the_same_bits_as_decks(tmp_path: Path) -> None:
    model = sets()
    model.to_deck(tmp_path / "sets.toml")
    run_command(tmp_path / "sets.toml", tmp_path / "command")
    simulation = model.build(threads=1)
    simulation.relax(name="rest", tolerance=1e-3, quiet=True)
    simulation.run(2e-4, name="dig", quiet=True)
    assert same_state(simulation, ddem.load(tmp_path / "command" / "checkpoint.h5"))


def test_blocks_are_whole_blocks() -> None:
    model = sets()
    cells, simulation = model.cells(), model.build()
    blocks = np.unique(cells.table["block"])
    assert simulation.n_blocks == len(blocks) < len(cells) < simulation.n_elements
    assert np.array_equal(np.unique(simulation.element_block), blocks)
    assert np.array_equal(np.unique(simulation.node_block), blocks)
    assert simulation.block_fragment.shape == (len(blocks),)
    assert f"{len(blocks)} blocks" in repr(simulation)
    # Every element lies in a block with its number.
    centres = simulation.points[simulation.elements].mean(axis=1)
    for block in blocks:
        own = centres[simulation.element_block == block]
        points = np.concatenate(
            [np.concatenate(cells.faces(int(i))) for i in np.flatnonzero(cells.table["block"] == block)]
        )
        assert (own > points.min(axis=0)).all() and (own < points.max(axis=0)).all()


def test_arguments_of_cuts_and_of_where() -> None:
    model = ddem.Model()
    model.add_region(box={"from": (0, 0, 0), "to": (2, 2, 4)}, material=ROCK)
    plane = {"dip": 0, "dip_direction": 0, "through": (1, 1, 2)}
    model.cut(plane=plane, joint=SMOOTH)
    # `plane` and `set` are shapes of the cut; `x`, `z` and `where` select cells.
    upright = {"dip": 90, "dip_direction": 90, "through": (1, 1, 1)}
    model.cut(plane=upright, joint=SMOOTH, z=(2, 4))
    upright = {"dip": 90, "dip_direction": 0, "through": (1, 1, 1)}
    model.cut(plane=upright, joint=SMOOTH, where={"z": (0, 2)})
    assert sorted(model.cells().table["volume"]) == [4, 4, 4, 4]
    assert model.deck["cut"][1]["where"] == {"z": [2.0, 4.0]}
    message = refused(lambda: model.cut(plnae=plane, joint=SMOOTH), ddem.ModelError)
    assert "did you mean `plane`?" in message and message.count("`plane`") == 2
    model.cut(plane=plane, joint=SMOOTH, where={"plane": {"point": (0, 0, 0), "dip": 0}})
    message = refused(model.cells, ddem.ModelError)
    assert "no cell" in message and "test_rock.py:" in message


def test_tunnels_are_found_by_name() -> None:
    model = sets()
    simulation = model.build()
    inside = simulation.nodes(inside="adit")
    points = simulation.points[inside]
    assert len(inside) and (abs(points[:, 0] - 4) <= 1 + 1e-6).all()
    assert ((points[:, 2] >= 3 - 1e-6) & (points[:, 2] <= 5 + 1e-6)).all()
    wrong = sets()
    wrong.remove(where={"inside": "audit"}, from_="dig")
    message = refused(wrong.build, ddem.ModelError)
    assert "did you mean `adit`?" in message and "test_rock.py:" in message
    message = refused(lambda: wrong.remove(inside="adit.stl"), ddem.ModelError)
    assert message.startswith("inside: cannot read `adit.stl`")


def test_models_without_regions_have_no_cells() -> None:
    assert "the deck has no regions to cut" in refused(ddem.Model().cells, ddem.ModelError)
    assert repr(sets()) == '<Model "sets": 1 regions, 3 cuts>'


def test_models_with_regions_are_pickled() -> None:
    model = pickle.loads(pickle.dumps(sets()))
    assert same(np.ascontiguousarray(model.cells().points), sets().cells().points)


def test_meshes_are_the_polyhedra() -> None:
    pytest.importorskip("pyvista")
    cells = sets().cells()
    mesh = cells.mesh()
    assert mesh.n_cells == len(cells)
    sizes = mesh.compute_cell_sizes(length=False, area=False)["Volume"]
    assert sizes == pytest.approx(np.asarray(cells.table["volume"]), rel=1e-6, abs=1e-9)
    assert np.array_equal(mesh["block"], cells.table["block"])


def test_angle_of_the_wedge_is_the_line_of_both_joints() -> None:
    # The line of intersection is normal to both joints.
    cells = wedge().cells()
    a, b = cells.planes["normal"]
    line = np.cross(a, b)
    line *= -np.sign(line[2]) / np.linalg.norm(line)
    found = cells.table[cells.table["mode"] == "slides on two"][0]
    assert math.degrees(math.asin(-line[2])) == pytest.approx(found["plunge"], abs=1e-9)


def test_voronoi_cells_are_nearest_to_their_seeds() -> None:
    seeds = np.random.default_rng(4).uniform(0, 2, (50, 3))
    model = ddem.Model()
    model.add_region(box={"from": (0, 0, 0), "to": (2, 2, 2)}, material=ROCK)
    model.cut(voronoi={"points": seeds}, joint=SMOOTH)
    cells = model.cells()
    assert len(cells) == 50 and cells.table["volume"].sum() == pytest.approx(8, rel=1e-12)

    def distances(points: np.ndarray) -> np.ndarray:
        return np.linalg.norm(points[:, None] - seeds, axis=2)

    owners = distances(np.asarray(cells.table["centroid"])).argmin(axis=1)
    assert sorted(owners) == list(range(50))
    for cell, owner in enumerate(owners):
        of_corners = distances(np.concatenate(cells.faces(cell)))
        assert (of_corners[:, owner] - of_corners.min(axis=1)).max() < 1e-6


def test_regions_of_files(tmp_path: Path) -> None:
    corners = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
    quads = [(1, 3, 4, 2), (5, 6, 8, 7), (1, 2, 6, 5), (3, 7, 8, 4), (1, 5, 7, 3), (2, 4, 8, 6)]
    lines = []
    for body in range(3):
        lines.append(f"g stone {body}")
        lines += [f"v {x + body} {y} {z}" for x, y, z in corners]
        lines += ["f " + " ".join(str(8 * body + corner) for corner in quad) for quad in quads]
    file = tmp_path / "wall.obj"
    file.write_text("\n".join(lines))
    model = ddem.Model()
    model.add_region(file=str(file), material=ROCK, joint=SMOOTH)
    cells = model.cells()
    assert list(cells.table["volume"]) == [1, 1, 1]
    assert list(cells.table["surface"]) == [6, 6, 6]
    assert list(cells.table["free_area"]) == [1, 1, 1]
    assert list(cells.table["block"]) == [0, 1, 2]
    joined = ddem.Model()
    joined.add_region(file=str(file), material=ROCK, join=True)
    assert list(joined.cells().table["block"]) == [0, 0, 0]
    missing = ddem.Model()
    with pytest.raises(ddem.ModelError, match=r"did you mean `.*wall\.obj`"):
        missing.add_region(file=str(tmp_path / "wal.obj"), material=ROCK, joint=SMOOTH)

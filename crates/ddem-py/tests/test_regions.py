"""Selections by place in field terms: the same keys as in a deck."""

from __future__ import annotations

import os
import struct
from pathlib import Path

import ddem
import numpy as np
import pytest
from sample_models import refused


def cube() -> ddem.Model:
    """4 × 4 × 4 blocks of 1 m."""
    rock = ddem.Material(density=2400, young=18e9, poisson=0.25)
    seam = ddem.Joint(thickness=0.01, material=rock)
    model = ddem.Model()
    model.add_blocks(
        size=(4, 4, 4), count=(4, 4, 4), divisions=1, material=rock, joint=seam, name="cube"
    )
    return model


def write_box(path: Path, low: tuple[float, ...], high: tuple[float, ...], left_out: int = 0) -> None:
    """A binary STL file of a box."""
    corners = [[(low, high)[k >> d & 1][d] for d in range(3)] for k in range(8)]
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    triangles = [three for a, b, c, d in quads for three in ((a, b, c), (a, c, d))]
    triangles = triangles[left_out:]
    data = b" " * 80 + struct.pack("<I", len(triangles))
    for three in triangles:
        numbers = [x for k in three for x in corners[k]]
        data += struct.pack("<12fH", 0, 0, 0, *numbers, 0)
    path.write_bytes(data)


def test_planes_sides_and_half_spaces_select_same_nodes() -> None:
    simulation = cube().build()
    top = simulation.nodes(z=4.0)
    assert len(top) == 16 * 4
    normal = np.array([0.0, 0.0, -2.0])
    for where in (
        {"plane": {"point": (1, 2, 4), "normal": normal}},
        {"plane": {"point": [9, 9, 4], "dip": 0, "dip_direction": 77}},
        {"side": "z+"},
        {"above": 3.999},
        {"above": {"point": (0, 0, 3.999), "normal": (0, 0, 1)}},
        {"below": {"point": (0, 0, 4), "dip": 0}, "z": 4},
    ):
        assert np.array_equal(simulation.nodes(**where), top), where
    slope = {"point": (0, 0, 4), "dip": 45, "dip_direction": 90}
    points = simulation.points
    above = np.flatnonzero(points[:, 0] + points[:, 2] >= 4 - 1e-9)
    assert np.array_equal(simulation.nodes(above=slope), above)


def test_rotated_set_carries_pressure_times_area() -> None:
    rock = ddem.Material(density=2400, young=18e9, poisson=0.25)
    model = ddem.Model()
    model.add_blocks(size=(2, 3, 1), material=rock, divisions=2, dip=30, dip_direction=130)
    model.fix("xyz", side="z-")
    model.load(pressure=1e5, side="z+")
    simulation = model.build()
    simulation.relax(tolerance=1e-9, quiet=True)
    found = simulation.reaction(simulation.nodes(side="z-"))
    dip, direction = np.radians([30, 130])
    up = [np.sin(dip) * np.sin(direction), np.sin(dip) * np.cos(direction), np.cos(dip)]
    assert np.allclose(found, 6e5 * np.array(up), rtol=1e-6)


def test_dip_selects_joints() -> None:
    weak = ddem.Joint(thickness=0.01, young=18e9, poisson=0.25, density=2400, cohesion=1e5)
    model = cube()
    model.assign(joint=weak, dip=90, dip_direction=180)
    model.fix("xyz", side="z-")
    assert model.deck["assign"][0]["where"] == {"dip": 90.0, "dip_direction": 180.0}
    # 3 planes across y, each with 16 faces of 4 pairs.
    broken = np.isfinite(model.build().pairs["failure_time"])
    assert len(broken) == 3 * 48 * 4 and not broken.any()
    message = refused(lambda: model.build().nodes(dip=90), ddem.ModelError)
    assert message.startswith("dip: `dip` selects joints and outer faces")


def test_files_select_blocks_and_nodes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_box(tmp_path / "pit.stl", (1.0, 0.0, 2.0), (3.0, 4.0, 4.0))
    (tmp_path / "ground.csv").write_text("x,y,z\n0,0,2\n4,0,4\n0,4,2\n4,4,4\n")
    model = cube()
    model.remove(inside=tmp_path / "pit.stl")
    model.fix("xyz", side="z-")
    simulation = model.build()
    assert simulation.n_blocks == 64 - 16
    points = simulation.points
    above = np.flatnonzero(points[:, 2] >= 2 + points[:, 0] / 2 - 1e-9)
    found = simulation.nodes(above={"topography": tmp_path / "ground.csv"})
    assert np.array_equal(found, above)

    # A checkpoint does not need the file, and a deck can be read from any folder.
    simulation.save(tmp_path / "saved.h5")
    (tmp_path / "deck").mkdir()
    os.rename(tmp_path / "pit.stl", tmp_path / "deck" / "pit.stl")
    assert ddem.load(tmp_path / "saved.h5").n_blocks == 48
    text = model.to_deck().replace(str(tmp_path) + "/", "")
    (tmp_path / "deck" / "pit.toml").write_text(text)
    monkeypatch.chdir(tmp_path)
    assert ddem.Model.from_deck("deck/pit.toml").build().n_blocks == 48
    assert ddem.Model.from_deck(Path("deck/pit.toml").absolute()).build().n_blocks == 48


def test_invalid_files_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    write_box(tmp_path / "open.stl", (1.0, 0.0, 2.0), (3.0, 4.0, 4.0), left_out=1)
    message = refused(lambda: cube().remove(inside="opne.stl"), ddem.ModelError)
    assert message.startswith("inside: cannot read `opne.stl`") and "`open.stl`" in message
    model = cube()
    model.remove(inside="open.stl")
    message = refused(model.build, ddem.ModelError)
    assert "test_regions.py:" in message and "not closed: 3 open edges of 11 triangles" in message
    (tmp_path / "low.csv").write_text("0,0,2\n2,0,4\n0,4,2\n2,4,4\n")
    model = cube()
    model.fix("x", above={"topography": "low.csv"})
    message = refused(model.build, ddem.ModelError)
    assert "covers x from 0 to 2 and y from 0 to 4, and the model has" in message

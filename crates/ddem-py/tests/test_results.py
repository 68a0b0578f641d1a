"""Folders of results, read in Python, equal the written files and the simulation."""

from __future__ import annotations

import copy
import csv
import json
import pickle
from pathlib import Path
from typing import Any

import ddem
import h5py
import numpy as np
import pytest
from sample_models import breaking, column, refused, same, staged
from test_contacts import fallen

pytest.importorskip("pyvista")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results of a deck of two stages with joints and probes."""
    out = tmp_path_factory.mktemp("results") / "staged"
    ddem.run_deck(staged(), out=out, quiet=True)
    return out


def frames_of(folder: Path) -> list[list[str]]:
    with open(folder / "frames.csv", newline="") as file:
        return list(csv.reader(file))[1:]


def test_frames_have_stage_step_and_time(folder: Path) -> None:
    results = ddem.Results(folder)
    assert len(results) == 1 + 1 + 5
    # The first frame is the start. A relaxation takes no time, so its frame has the same time.
    assert results.stages.tolist() == ["settle"] * 2 + ["push"] * 5
    assert results.times[:2].tolist() == [0.0, 0.0] and results.times[-1] == 2e-3
    assert np.allclose(np.diff(results.times[1:]), 4e-4, atol=3e-5)
    assert results.steps[0] == 0 and (np.diff(results.steps) > 0).all()
    steps = [stage["steps"] for stage in results.summary["stages"]]
    assert results.steps[1] == steps[0] and results.steps[-1] == sum(steps)
    # The times in the files for ParaView must increase.
    with h5py.File(folder / "blocks.vtkhdf") as file:
        shown = file["VTKHDF/Steps/Values"][:]
    assert (np.diff(shown) > 0).all()
    assert [float(row[3]) for row in frames_of(folder)] == shown.tolist()


def test_frames_are_indexed_like_a_list(folder: Path) -> None:
    results = ddem.Results(str(folder))
    assert [frame.index for frame in results] == list(range(7))
    assert [frame.index for frame in results[1:5:2]] == [1, 3]
    assert results[-1].index == 6 and results[np.int64(2)].step == results.steps[2]
    assert results[-1].stage == "push" and results[-1].time == 2e-3
    with pytest.raises(IndexError, match="7 does not exist, .* has 7 frames"):
        results[7]
    assert "7 frames" in repr(results) and "push" in repr(results[3])


def test_frame_fields_equal_the_file(folder: Path) -> None:
    results = ddem.Results(folder)
    for name, place in (("blocks", "Point"), ("blocks", "Cell"), ("joints", "Point")):
        with h5py.File(folder / f"{name}.vtkhdf") as file:
            root = file["VTKHDF"]
            for field, offsets in root[f"Steps/{place}DataOffsets"].items():
                values = root[f"{place}Data/{field}"][:]
                rows = len(values) // len(results)
                for frame, offset in zip(results, offsets[:], strict=True):
                    exact = values[offset : offset + rows]
                    read = frame.pairs[field] if name == "joints" else frame[field]
                    assert np.array_equal(read, exact, equal_nan=exact.dtype.kind == "f"), field
                    if name == "blocks" or field != "displacement":
                        assert same(getattr(frame, field), frame[field])


def test_last_frame_equals_the_simulation(tmp_path: Path) -> None:
    model = breaking()
    simulation = model.build()
    simulation.run(2e-3, record=tmp_path / "run", quiet=True)
    results = ddem.Results(tmp_path / "run")
    frame = results[-1]
    assert (frame.time, frame.step) == (simulation.time, simulation.steps)
    assert same(frame.points, simulation.points) and same(frame.elements, simulation.elements)
    assert same(frame.quads, simulation.quads) and same(frame.block, frame.element_block.astype("i4"))
    assert np.array_equal(frame.material, simulation.element_material)
    for name in ("displacement", "velocity", "stress"):
        assert np.array_equal(frame[name], getattr(simulation, name))
    for name in ("point", "traction", "slip", "opening", "state", "open", "joint"):
        assert np.array_equal(frame.pairs[name], simulation.pairs[name]), name
    assert (frame.state > 0).any()
    # Returned arrays are copies that belong to the caller.
    frame.displacement[:] = 7.0
    assert frame.displacement.max() < 1.0
    for part in ("blocks", "joints", "contacts"):
        recorded, now = frame.mesh(part), simulation.mesh(part)
        assert np.array_equal(recorded.points, now.points)
        assert np.array_equal(recorded.cell_connectivity, now.cell_connectivity)
        known = set(recorded.array_names)
        assert known <= set(now.array_names), known - set(now.array_names)
        for name in known:
            assert np.allclose(recorded[name], now[name], equal_nan=True), name
    assert refused(lambda: frame.mesh("block")).count("did you mean 'blocks'")
    assert refused(lambda: simulation.mesh("block")).count("did you mean 'blocks'")


@pytest.mark.parametrize(
    "copied", [copy.copy, copy.deepcopy, lambda a: pickle.loads(pickle.dumps(a))]
)
def test_results_and_frames_are_copied(folder: Path, copied: Any) -> None:
    results = ddem.Results(folder)
    frame = results[-1]
    exact = frame.displacement
    for again in (copied(results)[-1], copied(frame)):
        assert (again.index, again.time, again.stage) == (frame.index, frame.time, frame.stage)
        assert same(again.displacement, exact)
    assert same(copied(results).probes["foot"], results.probes["foot"])


def test_contacts_equal_the_simulation(tmp_path: Path) -> None:
    simulation = fallen(friction=30).build()
    simulation.run(0.1, record=tmp_path, damping={"local": 0.5}, quiet=True)
    frame, exact = ddem.Results(tmp_path)[-1], simulation.contacts
    assert len(exact) > 0 and frame.contacts.dtype == exact.dtype
    for name in exact.dtype.names:
        assert np.array_equal(frame.contacts[name], exact[name]), name
    mesh = simulation.mesh("contacts")
    assert np.array_equal(mesh["force"], exact["force"]) and mesh.n_cells == len(exact)


def test_mesh_excludes_removed_blocks(tmp_path: Path) -> None:
    model = column()
    model.remove(z=(1.0, 2.0), from_="dig")
    model.stage("before", kind="relax")
    model.stage("dig", kind="relax")
    simulation = ddem.run_deck(model, out=tmp_path / "dug", quiet=True)
    results = ddem.Results(tmp_path / "dug")
    assert [results[at].mesh().n_cells for at in (0, -1)] == [16, 8]
    for mesh in (results[-1].mesh(), simulation.mesh()):
        assert mesh.bounds[5] == pytest.approx(1.0, abs=0.01)
        assert np.array_equal(mesh["displacement"], simulation.displacement[mesh["node"]])
        assert np.array_equal(mesh["stress"], simulation.stress[mesh["element"]])
        assert (mesh["block"] == 0).all() and (simulation.element_block[mesh["element"]] == 0).all()
    # The arrays themselves have all rows.
    assert len(results[-1].displacement) == simulation.n_nodes
    assert results[-1].mesh("joints").n_cells == 0 < results[0].mesh("joints").n_cells


def test_tables_equal_the_files(folder: Path) -> None:
    results = ddem.Results(folder)
    assert results.title == "staged" and "[[stage]]" in results.deck
    assert results.summary == json.loads((folder / "summary.json").read_text())
    with open(folder / "energy.csv", newline="") as file:
        header, *rows = csv.reader(file)
    assert list(results.energy.dtype.names) == header
    for at, name in enumerate(header[2:], start=2):
        assert results.energy[name].tolist() == [float(row[at]) for row in rows]
    assert set(results.energy.stage) == {"settle", "push"}
    probes, again = results.probes, ddem.read_probes(folder)
    assert set(probes) == {"top", "foot", "stress"}
    assert all(same(probes[name], again[name]) for name in probes)
    assert results.fragments("settle").blocks.tolist() == [2]
    assert refused(lambda: results.fragments("setle")).count("did you mean 'settle'")


def test_tables_become_data_frames(folder: Path) -> None:
    pandas = pytest.importorskip("pandas")
    results = ddem.Results(folder)
    pairs = results[-1].pairs
    frame = pairs.to_pandas()
    assert isinstance(frame, pandas.DataFrame) and len(frame) == len(pairs)
    assert np.array_equal(frame["traction.y"], pairs.traction[:, 1])
    assert np.array_equal(frame["opening"], pairs.opening)
    # The same as pandas reads from the file.
    assert results.energy.to_pandas().equals(pandas.read_csv(folder / "energy.csv"))
    fragments = pandas.read_csv(folder / "fragments.csv").iloc[-1:]
    own = results.fragments().to_pandas()
    assert np.array_equal(own.to_numpy(), fragments[own.columns].to_numpy())
    wide, written = results.probes.to_pandas(), pandas.read_csv(folder / "probes.csv")
    written = written.drop_duplicates(["step", "time"], keep="last")
    assert list(wide.columns) == ["step", "time", *written.columns[3:]]
    assert np.array_equal(wide.to_numpy(), written[wide.columns].to_numpy(), equal_nan=True)


def test_arrays_of_a_simulation_become_data_frames() -> None:
    pytest.importorskip("pandas")
    simulation = breaking().build()
    simulation.run(2e-3, quiet=True)
    pairs = simulation.pairs.to_pandas()
    assert np.array_equal(pairs["nodes.b"], simulation.pairs["nodes"][:, 1])
    assert (pairs["state"] > 0).sum() == (simulation.pairs.state > 0).sum() > 0
    assert simulation.contacts.to_pandas().columns[-2:].tolist() == ["blocks.a", "blocks.b"]
    assert simulation.fragments.to_pandas()["mass"].sum() == simulation.fragments.mass.sum()
    wide = simulation.probes.to_pandas()
    assert np.array_equal(wide["top.z"], simulation.probes["top"]["z"])


def test_missing_pandas_is_named(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import sys

    monkeypatch.setitem(sys.modules, "pandas", None)
    assert "pip install pandas" in refused(ddem.Results(folder).energy.to_pandas, ImportError)


def test_unknown_names_suggest_similar_ones(folder: Path) -> None:
    frame = ddem.Results(folder)[0]
    calls: list[tuple[Any, type[Exception]]] = [
        (lambda: frame.displacment, AttributeError),
        (lambda: frame["displacment"], KeyError),
        (lambda: frame.field("displacment"), ValueError),
    ]
    for call, kind in calls:
        message = refused(call, kind)
        assert "did you mean 'displacement'" in message and "'traction'" in message
    assert not hasattr(frame, "__array__") and "traction" in dir(frame)
    assert "did you mean 'contacts'" in refused(lambda: frame.contact, AttributeError)


def test_folders_without_results_are_refused(folder: Path, tmp_path: Path) -> None:
    def message(path: Path) -> str:
        return refused(lambda: ddem.Results(path), FileNotFoundError)

    assert "stagd does not exist" in message(folder.with_name("stagd"))
    assert f"did you mean {str(folder)!r}" in message(folder.with_name("stagd"))
    assert "blocks.vtkhdf, probes.csv" in message(tmp_path)
    assert repr(str(folder)) in message(folder.parent)
    assert "is a file" in message(folder / "energy.csv")


def test_unfinished_run_can_be_read(tmp_path: Path) -> None:
    counts: list[int] = []

    def look(simulation: ddem.Simulation) -> None:
        results = ddem.Results(tmp_path)
        assert results[-1].step == results.steps[-1] <= simulation.steps
        assert "at the end of the run" in refused(lambda: results.summary, FileNotFoundError)
        counts.append(len(results))

    simulation = column().build()
    simulation.run(1e-3, record=tmp_path, frames=4, every=2.6e-4, until=look, quiet=True)
    assert counts == [2, 3, 4] and len(ddem.Results(tmp_path)) == 5


def test_pyvista_reads_the_time_steps(folder: Path) -> None:
    """PyVista reads the time steps as documented."""
    import pyvista as pv

    results = ddem.Results(folder)
    reader = pv.get_reader(folder / "blocks.vtkhdf")
    reader.reader.UpdateInformation()
    assert reader.reader.GetNumberOfSteps() == len(results)
    for number in (0, 6, 3):
        reader.reader.SetStep(number)
        assert np.array_equal(reader.read()["displacement"], results[number].displacement)

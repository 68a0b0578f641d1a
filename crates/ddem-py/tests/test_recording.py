"""Folders of results: files that are written, extended and kept."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import ddem
import h5py
import numpy as np
import pytest
from sample_models import assert_same_results, column, cube, same, same_state, staged

COMPONENTS = ("xx", "yy", "zz", "xy", "yz", "zx")


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


# --- folders ---


def test_results_go_to_folder_named_after_deck(tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.chdir(tmp_path)
    staged().to_deck("tower.toml")
    ddem.run_deck("tower.toml", quiet=True)
    assert (tmp_path / "results" / "tower" / "summary.json").is_file()


def test_calls_append_to_their_folder(tmp_path: Path) -> None:
    simulation = column(title="appended").build()
    out = tmp_path / "out"
    frames = []
    for turn in range(3):
        simulation.run(2e-4, frames=2, record=out, name=f"turn {turn}", quiet=True)
        with h5py.File(out / "blocks.vtkhdf") as file:
            frames.append(len(file["VTKHDF/Steps/Values"]))
            times = np.asarray(file["VTKHDF/Steps/Values"])
    assert frames == [3, 5, 7]
    assert (np.diff(times) > 0).all()
    assert times[-1] == pytest.approx(6e-4)
    energy = rows(out / "energy.csv")
    assert {row["stage"] for row in energy} == {"turn 0", "turn 1", "turn 2"}
    steps = [int(row["step"]) for row in energy]
    assert steps == sorted(steps) and steps[-1] == simulation.steps
    names = [stage["name"] for stage in json.loads((out / "summary.json").read_text())["stages"]]
    assert names == ["turn 0", "turn 1", "turn 2"]
    # The checkpoint in the folder is a saved simulation.
    assert same_state(ddem.load(out / "checkpoint.h5"), simulation)


def test_recording_alternates_between_folders(tmp_path: Path) -> None:
    simulation = column().build()
    frames: dict[str, list[float]] = {"a": [], "b": []}
    for name in ("a", "b", "a", "b"):
        simulation.run(1e-4, frames=1, record=tmp_path / name, quiet=True)
        with h5py.File(tmp_path / name / "blocks.vtkhdf") as file:
            times = np.asarray(file["VTKHDF/Steps/Values"]).tolist()
        assert times[: len(frames[name])] == frames[name], "what was there stays"
        assert len(times) > len(frames[name])
        frames[name] = times
    assert frames["a"][0] == 0.0
    assert (frames["a"][-1], frames["b"][-1]) == pytest.approx((3e-4, 4e-4))


def test_deleted_file_does_not_stop_the_simulation(tmp_path: Path) -> None:
    simulation = column().build()
    out = tmp_path / "out"
    simulation.run(1e-4, record=out, quiet=True)
    steps = simulation.steps
    (out / "blocks.vtkhdf").unlink()
    with pytest.raises(FileNotFoundError):
        simulation.run(1e-4, record=out, quiet=True)
    assert simulation.steps == steps
    simulation.run(1e-4, record=tmp_path / "other", quiet=True)


def files(folder: Path) -> dict[str, bytes]:
    """The bytes of the results in a folder, without `ddem.json`, which is rewritten when they are
    moved.
    """
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.name != "ddem.json"}


def test_results_of_a_deck_are_kept(tmp_path: Path) -> None:
    simulation = ddem.run_deck(staged(), out=tmp_path / "out", quiet=True)
    before = files(tmp_path / "out")
    simulation.run(1e-4, record=tmp_path / "out", quiet=True)
    assert files(tmp_path / "out.1") == before
    simulation.run(1e-4, record=tmp_path / "more", quiet=True)


def test_run_deck_keeps_or_overwrites_results(tmp_path: Path) -> None:
    out = tmp_path / "out"
    ddem.run_deck(staged(), out=out, quiet=True)
    before = files(out)
    ddem.run_deck(staged(), out=out, quiet=True)
    assert files(tmp_path / "out.1") == before
    ddem.run_deck(staged(), out=out, overwrite=True, quiet=True)
    assert not (tmp_path / "out.2").exists()
    with pytest.raises(ValueError, match="exclude each other"):
        ddem.run_deck(staged(), out=out, resume=True, overwrite=True, quiet=True)


def test_calls_without_record_write_no_file(tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.chdir(tmp_path)
    simulation = column().build()
    simulation.relax(quiet=True)
    simulation.run(1e-4, quiet=True)
    simulation.step(3)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("title", ["", "tower"])
def test_results_of_another_model_are_kept(tmp_path: Path, title: str) -> None:
    out = tmp_path / "out"
    column(title=title).build().run(1e-4, record=out, quiet=True)
    before = files(out)
    other = cube(title="cube" if title else "").build()
    other.run(1e-4, record=out, quiet=True)
    assert files(tmp_path / "out.1") == before


def test_recording_continues_after_a_reader_closes(tmp_path: Path) -> None:
    simulation = column().build()
    out = tmp_path / "out"
    simulation.run(1e-4, record=out, quiet=True)
    with h5py.File(out / "blocks.vtkhdf", "r"):
        try:
            simulation.run(1e-4, record=out, quiet=True)
        except OSError:
            pass
    simulation.run(1e-4, record=out, quiet=True)
    assert same_state(ddem.load(out / "checkpoint.h5"), simulation)


# --- probes and the summary ---


def test_stage_and_probe_names_may_be_any_text(tmp_path: Path) -> None:
    model = cube()
    model.probe('a,"b"', at=(0, 0, 0))
    simulation = model.build()
    simulation.run(1e-4, record=tmp_path / "out", name='one, "two"', quiet=True)
    found = rows(tmp_path / "out" / "probes.csv")
    assert set(found[0]) == {"stage", "step", "time", *(f'a,"b".{c}' for c in "xyz")}
    assert {row["stage"] for row in found} == {'one, "two"'}
    assert list(simulation.probes) == ['a,"b"']


def test_probes_have_columns_and_samples() -> None:
    model = staged()
    simulation = model.build()
    names = {name: history.dtype.names for name, history in simulation.probes.items()}
    assert names == {
        "top": ("time", "step", "x", "y", "z"),
        "foot": ("time", "step", "x", "y", "z"),
        "stress": ("time", "step", *COMPONENTS),
    }
    simulation.enter("push")
    simulation.run(1e-3, time_step=1e-5, quiet=True)
    top, stress = simulation.probes["top"], simulation.probes["stress"]
    assert (top.dtype["time"], top.dtype["step"]) == (np.dtype("f8"), np.dtype("i8"))
    assert top["step"].tolist() == list(range(101))
    assert np.allclose(top["time"], top["step"] * 1e-5)
    assert stress["step"].tolist() == list(range(0, 101, 10))
    node = simulation.nearest_node((1, 1, 2))
    assert [top[c][-1] for c in "xyz"] == simulation.displacement[node].tolist()
    foot = simulation.probes["foot"]
    assert [foot[c][-1] for c in "xyz"] == simulation.reaction(simulation.nodes(z=0.0)).tolist()
    seen = simulation.probes["top"]
    seen["x"] = 7
    assert not (simulation.probes["top"]["x"] == 7).any()
    simulation.run(1e-3, time_step=1e-5, quiet=True)
    assert simulation.probes["top"]["step"].tolist() == list(range(201))


def test_probes_equal_the_file(tmp_path: Path) -> None:
    simulation = ddem.run_deck(staged(), out=tmp_path / "out", quiet=True)
    found = rows(tmp_path / "out" / "probes.csv")
    for name, history in simulation.probes.items():
        components = history.dtype.names[2:]
        written = [row for row in found if row[f"{name}.{components[0]}"]]
        assert len(written) == len(history) > 2
        assert [int(row["step"]) for row in written] == history["step"].tolist()
        for component in components:
            column_ = [float(row[f"{name}.{component}"]) for row in written]
            assert same(np.array(column_), history[component].copy())


def test_summary_has_sizes_and_stages(tmp_path: Path) -> None:
    simulation = column(title="tower").build()
    assert simulation.summary["stages"] == []
    steps = simulation.relax(record=tmp_path / "out", quiet=True)
    more = simulation.run(1e-4, record=tmp_path / "out", name="go", quiet=True)
    summary = simulation.summary
    assert (summary["title"], summary["version"]) == ("tower", ddem.__version__)
    sizes = ("blocks", "nodes", "elements", "pairs")
    assert [summary[name] for name in sizes] == [2, 54, 16, 9]
    stages = summary["stages"]
    assert [stage["kind"] for stage in stages] == ["relax", "dynamic"]
    assert [stage["steps"] for stage in stages] == [steps, more]
    assert stages[1]["name"] == "go"
    assert summary["deck"] == column(title="tower").to_deck()
    written = json.loads((tmp_path / "out" / "summary.json").read_text())
    written.pop("peak_memory_bytes"), summary.pop("peak_memory_bytes")
    assert written == summary


def times(folder: Path) -> list[float]:
    """Times of the frames in a folder of results."""
    with h5py.File(folder / "blocks.vtkhdf") as file:
        return [float(time) for time in np.asarray(file["VTKHDF/Steps/Values"])]


def test_dynamic_frames_have_their_times(tmp_path: Path) -> None:
    model = column()
    model.stage("settle", kind="relax")
    simulation = model.build()
    simulation.relax(name="settle", record=tmp_path / "out", quiet=True)
    simulation.run(1e-3, frames=4, record=tmp_path / "out", quiet=True)
    assert times(tmp_path / "out")[-1] == simulation.time
    assert times(tmp_path / "out")[-4:] == pytest.approx([0.25e-3, 0.5e-3, 0.75e-3, 1e-3], rel=0.1)


def test_equivalent_paths_are_one_folder(tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.chdir(tmp_path)
    simulation = column().build()
    for name in ("out", "./out", tmp_path / "out"):
        simulation.run(1e-4, frames=1, record=name, quiet=True)
    assert len(times(tmp_path / "out")) == 4


def test_loaded_simulation_continues_in_its_folder(tmp_path: Path) -> None:
    whole = column().build()
    for _ in range(2):
        whole.run(1e-4, frames=1, record=tmp_path / "whole", quiet=True)
    first = column().build()
    first.run(1e-4, frames=1, record=tmp_path / "parts", quiet=True)
    del first
    second = ddem.load(tmp_path / "parts")
    second.run(1e-4, frames=1, record=tmp_path / "parts", quiet=True)
    assert_same_results(tmp_path / "whole", tmp_path / "parts")


def test_changed_model_with_same_title_is_another_model(tmp_path: Path) -> None:
    def pressed(pressure: float) -> ddem.Simulation:
        model = column(title="study")
        model.load(pressure=pressure, z=2.0)
        return model.build()

    pressed(1e6).relax(record=tmp_path / "out", quiet=True)
    before = (tmp_path / "out" / "summary.json").read_text()
    pressed(2e6).relax(record=tmp_path / "out", quiet=True)
    assert (tmp_path / "out.1" / "summary.json").read_text() == before
    assert (tmp_path / "out" / "summary.json").read_text() != before


def test_folder_belongs_to_one_simulation(tmp_path: Path) -> None:
    out = tmp_path / "out"
    first = column().build()
    first.run(1e-4, frames=2, record=out, quiet=True)
    one, other = ddem.load(out), ddem.load(out)
    one.run(1e-4, frames=2, record=out, quiet=True)
    one.run(1e-4, frames=2, record=out, quiet=True)
    times = ddem.Results(out).times
    for late in (first, other):
        steps = late.steps
        with pytest.raises(FileExistsError, match="another simulation has recorded in"):
            late.run(1e-4, frames=2, record=out, quiet=True)
        assert late.steps == steps
    assert same(ddem.Results(out).times, times)
    # A new simulation starts new results, and the previous one cannot continue there.
    column().build().run(1e-4, frames=2, record=out, quiet=True)
    assert same(ddem.Results(tmp_path / "out.1").times, times)
    with pytest.raises(FileExistsError):
        one.run(1e-4, record=out, quiet=True)


def test_decreasing_frame_times_are_refused(tmp_path: Path) -> None:
    out = tmp_path / "out"
    column().build().run(1e-4, frames=4, record=out, quiet=True)
    lines = (out / "frames.csv").read_text().splitlines()
    (out / "frames.csv").write_text("\n".join([*lines, *lines[2:]]) + "\n")
    with pytest.raises(ValueError, match="frames of more than one run: frame 5 at"):
        len(ddem.Results(out))

"""Messages about wrong files and folders."""

from __future__ import annotations

import errno
import re
from pathlib import Path

import ddem
import h5py
import pytest
from sample_models import column, cube, refused


def test_missing_files_are_refused(tmp_path: Path) -> None:
    nothing = tmp_path / "nothing"
    for call in (
        lambda: ddem.load(nothing),
        lambda: ddem.run_deck(nothing),
        lambda: ddem.Model.from_deck(nothing),
        lambda: column().to_deck(nothing / "deck.toml"),
        lambda: column().build().save(nothing / "state.h5"),
    ):
        with pytest.raises(FileNotFoundError) as caught:
            call()
        assert caught.value.errno == errno.ENOENT
        assert str(nothing) in str(caught.value)
        assert re.search(r"\[(file-access|invalid-file)\]", str(caught.value))
    assert list(tmp_path.iterdir()) == []


def test_folders_in_place_of_files_are_refused(tmp_path: Path) -> None:
    # A folder of results has a checkpoint.
    with pytest.raises(FileNotFoundError, match="checkpoint.h5"):
        ddem.load(tmp_path)
    for call in (
        lambda: ddem.run_deck(tmp_path),
        lambda: ddem.Model.from_deck(tmp_path),
        lambda: column().to_deck(tmp_path),
        lambda: column().build().save(tmp_path),
    ):
        with pytest.raises(IsADirectoryError) as caught:
            call()
        assert "0x" not in str(caught.value)
    assert list(tmp_path.iterdir()) == []


def test_files_in_place_of_folders_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("mine")
    model = column()
    model.stage("a", kind="relax")
    simulation = column().build()
    for out in (file, file / "below"):
        for call in (
            lambda out=out: ddem.run_deck(model, out=out, quiet=True),
            lambda out=out: simulation.run(1e-4, record=out, quiet=True),
            lambda out=out: simulation.relax(record=out, quiet=True),
        ):
            with pytest.raises(OSError, match="file"):
                call()
    assert file.read_text() == "mine"
    assert simulation.steps == 0
    with pytest.raises(OSError):
        simulation.save(file / "state.h5")


def test_files_of_wrong_format_are_refused(tmp_path: Path) -> None:
    for name, content in (("text", b"hello"), ("empty", b""), ("hdf", b"\x89HDF\r\n\x1a\n")):
        path = tmp_path / name
        path.write_bytes(content)
        with pytest.raises(OSError, match=f"{name}.*HDF5 file"):
            ddem.load(path)
    path = tmp_path / "bytes"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises((OSError, ddem.ModelError), match="UTF-8|utf-8"):
        ddem.Model.from_deck(path)


def test_foreign_files_are_not_overwritten(tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / "probes.csv").write_text("mine")
    simulation = column().build()
    with pytest.raises(
        FileExistsError, match=r"probes\.csv.*which ddem did not write"
    ) as c:
        simulation.run(1e-4, record=out, quiet=True)
    assert "--out" not in str(c.value)
    assert [path.name for path in out.iterdir()] == ["probes.csv"]
    assert simulation.steps == 0


def test_paths_with_null_are_refused(tmp_path: Path) -> None:
    for call in (
        lambda: ddem.load("a\0b"),
        lambda: ddem.Model.from_deck("a\0b"),
        lambda: column().to_deck("a\0b"),
        lambda: column().build().save("a\0b"),
        lambda: column().build().run(1e-4, record="a\0b", quiet=True),
    ):
        with pytest.raises((OSError, ValueError), match="(?i)null|nul"):
            call()


def test_missing_path_suggests_similar_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    simulation = cube().build()
    simulation.run(1e-4, record="results/pile", quiet=True)
    simulation.save("state.h5")
    cube().to_deck("block.toml")
    for call, near in (
        (lambda: ddem.Results("result/pile"), "results/pile"),
        (lambda: ddem.load("result/pile"), "results/pile"),
        (lambda: ddem.load("state.hdf"), "state.h5"),
        (lambda: ddem.run_deck("blok.toml"), "block.toml"),
        (lambda: ddem.Model.from_deck("blok.toml"), "block.toml"),
    ):
        assert f"did you mean '{near}'?" in refused(call, FileNotFoundError)
    with pytest.raises(TypeError, match=r"frame: expected a whole number, found 1.0; frame \d+ is"):
        ddem.Results("results/pile")[1.0]  # type: ignore[call-overload]
    with pytest.raises(TypeError, match="give the folder that `record=` of `run`"):
        ddem.animate(simulation)  # type: ignore[arg-type]


def test_damaged_numbers_of_results_are_noticed(tmp_path: Path) -> None:
    """A flipped bit in any array of a file, those of the index of the frames among them."""
    column().build().run(1e-3, record=tmp_path, frames=2, quiet=True)
    file = tmp_path / "blocks.vtkhdf"
    places: list[int] = []

    def note(_: str, array: object) -> None:
        if isinstance(array, h5py.Dataset):
            chunks = range(array.id.get_num_chunks())
            places.extend(array.id.get_chunk_info(chunk).byte_offset for chunk in chunks)

    with h5py.File(file) as opened:
        opened.visititems(note)
    whole = file.read_bytes()
    for place in places:
        flipped = bytearray(whole)
        flipped[place] ^= 1
        file.write_bytes(flipped)
        with pytest.raises(OSError, match="is damaged: restore it"):
            results = ddem.Results(tmp_path)
            for frame in range(len(results)):
                results[frame]["displacement"]
    assert len(places) > 20

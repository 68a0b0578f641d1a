"""No path and no checkpoint panics, crashes or hangs."""

from __future__ import annotations

import math
import os
import warnings
from pathlib import Path
from typing import Any

import ddem
import h5py
import numpy as np
import pytest
from fuzz_calls import BREAKING, attempt, read_everything, some
from fuzz_values import Raises, Silent, Somewhere, any_value
from hypothesis import given
from hypothesis import strategies as st

PATHS: list[Any] = [
    "", ".", "..", "\0", "a\0b", "a" * 300, "a/" * 3000, "\ud800", "nothing", "no/thing", "file",
    "folder", "folder/", "file/x", b"", b"file", b"\xff\xfe", b"a\0b", 5, -1, None, 1.5, [], {},
    Path("nothing"), Path("file"), Path("folder"), Somewhere("file"), Somewhere(None), Somewhere(5),
    Somewhere(b"file"), Raises(), Silent(), "state.h5", "text.toml", "folder\n", " ",
]  # fmt: skip


@some
@given(st.sampled_from(PATHS), st.sampled_from(PATHS), any_value)
def test_calls_survive_any_path(tmp_path_factory: Any, path: Any, other: Any, value: Any) -> None:
    folder = tmp_path_factory.getbasetemp() / "paths"
    (folder / "folder").mkdir(parents=True, exist_ok=True)
    before = os.getcwd()
    os.chdir(folder)
    try:
        Path("file").write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(range(256)))
        model = BREAKING
        simulation = model.build(threads=1)
        simulation.save("state.h5")
        for call in (
            lambda: ddem.load(path),
            lambda: ddem.load("state.h5", model=value),
            lambda: ddem.load("state.h5", threads=value if not isinstance(value, int) else 2),
            lambda: ddem.Model.from_deck(path),
            lambda: ddem.run_deck(path, out=other, quiet=True, threads=1),
            lambda: ddem.run_deck(model, out=other, quiet=True, threads=1),
            lambda: ddem.run_deck(model, out=other, resume=True, quiet=True, threads=1),
            lambda: model.to_deck(path),
            lambda: simulation.save(path),
            lambda: simulation.run(1e-5, record=path, quiet=True),
            lambda: simulation.relax(max_steps=2, record=other, quiet=True),
            lambda: simulation.run(1e-5, record=other, name=value, quiet=True),
            lambda: (
                ddem.run_deck(value, out=value, quiet=True) if not isinstance(value, str) else None
            ),
        ):
            attempt(call)
        assert isinstance(simulation.steps, int)
    finally:
        os.chdir(before)


# --- checkpoints ---


@pytest.fixture(scope="module")
def saved(tmp_path_factory: Any) -> tuple[bytes, list[str]]:
    simulation = BREAKING.build(threads=1)
    simulation.run(1e-3, quiet=True)
    path = tmp_path_factory.mktemp("saved") / "state.h5"
    simulation.save(path)
    names: list[str] = []
    with h5py.File(path) as file:
        file.visititems(lambda name, item: names.append(name))
        names += [f"@{name}" for name in file.attrs]
    return path.read_bytes(), names


@some
@given(data=st.data())
def test_damaged_checkpoints_are_refused_or_loaded(
    tmp_path_factory: Any, saved: tuple[bytes, list[str]], data: st.DataObject
) -> None:
    content, _ = saved
    path = tmp_path_factory.getbasetemp() / "bad.h5"
    if data.draw(st.booleans()):
        content = content[: data.draw(st.integers(0, len(content)))]
    else:
        at = data.draw(st.integers(0, len(content) - 1))
        content = content[:at] + data.draw(st.binary(min_size=1, max_size=9)) + content[at + 9 :]
    path.write_bytes(content)
    simulation = attempt(lambda: ddem.load(path, threads=1))
    if simulation is not None:
        read_everything(simulation)
        attempt(lambda: simulation.step(2))


@some
@given(data=st.data())
def test_checkpoints_survive_any_number(
    tmp_path_factory: Any, saved: tuple[bytes, list[str]], data: st.DataObject
) -> None:
    content, names = saved
    path = tmp_path_factory.getbasetemp() / "fuzz.h5"
    path.write_bytes(content)
    name = data.draw(st.sampled_from(names))
    number = data.draw(
        st.sampled_from([0, 1, 127, 128, 255, -1, 2**32, 2**63, 1e300, math.nan, 0.5])
    )
    how = data.draw(st.sampled_from(["one", "all", "longer", "shorter", "gone", "scalar"]))
    with h5py.File(path, "r+") as file, warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        try:
            holder: Any = file.attrs if name.startswith("@") else file
            name = name.removeprefix("@")
            if isinstance(holder[name], h5py.Group):
                del file[name]
            else:
                value = np.asarray(holder[name][()])
                del holder[name]
                if how == "longer":
                    holder[name] = np.resize(value, value.size + 1)
                elif how == "shorter":
                    holder[name] = np.resize(value, max(value.size - 1, 0))
                elif how == "scalar":
                    holder[name] = number
                elif how != "gone":
                    value = np.array(value)
                    if how == "all" or value.ndim == 0:
                        value[...] = number
                    else:
                        value.flat[data.draw(st.integers(0, max(value.size - 1, 0)))] = number
                    holder[name] = value
        except (ValueError, TypeError, OverflowError, IndexError, KeyError):
            pass
    simulation = attempt(lambda: ddem.load(path, threads=1))
    if simulation is None:
        return
    read_everything(simulation)
    attempt(lambda: simulation.step(2))
    attempt(lambda: simulation.enter("a"))
    attempt(lambda: simulation.relax(max_steps=3, quiet=True))
    attempt(lambda: simulation.run(1e-5, quiet=True))
    read_everything(simulation)


@pytest.mark.parametrize("number", [0, 1, 127, 128, 255])
def test_checkpoints_survive_any_changed_byte(
    tmp_path: Path, saved: tuple[bytes, list[str]], number: int
) -> None:
    content, names = saved
    assert {"deck", "run", "state"} <= set(names)
    for name, at in [(name, at) for name in ("run", "state") for at in range(60)]:
        path = tmp_path / "bytes.h5"
        path.write_bytes(content)
        with h5py.File(path, "r+") as file:
            file[name][at] = number
        simulation = attempt(lambda path=path: ddem.load(path, threads=1))
        if simulation is None:
            continue
        read_everything(simulation)
        for call in (
            lambda simulation=simulation: simulation.step(2),
            lambda simulation=simulation: simulation.relax(max_steps=3, quiet=True),
            lambda simulation=simulation: simulation.run(1e-5, quiet=True),
            lambda simulation=simulation: simulation.enter("a"),
        ):
            attempt(call)

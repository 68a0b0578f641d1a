"""Reader of folders of results."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, overload

import numpy as np
import numpy.typing as npt

from ._files import LOOKED_FOR, File, not_there, rows_of
from ._frame import Frame
from ._html import of_results
from ._names import one_of
from ._table import Histories, Table

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]

_FRAGMENT = np.dtype(
    [
        ("blocks", "i8"),
        *((name, "f8") for name in ("volume", "mass", "size", "passing")),
        ("centroid", "f8", 3),
        ("velocity", "f8", 3),
    ]
)


class Results(Sequence["Frame"]):
    """Folder of results: frames, histories of probes, energies and summary.

    Data are read on demand, so that folders of any size open at once. During a run the folder shows
    the results so far; create another `Results` to see later ones. Fields and meshes need PyVista,
    all other data need NumPy only.

    Parameters
    ----------
    folder : str or os.PathLike
        Folder written by ``ddem DECK``, by :func:`run_deck` or by ``record=`` of a call.

    Raises
    ------
    FileNotFoundError
        If the folder does not exist or has no results.
    ValueError
        On access to the frames, if times or steps of the frames decrease, because more than one run
        has written to the folder.

    Examples
    --------
    >>> results = ddem.Results("results/beam-crack")
    >>> lowest = [frame.displacement[:, 2].min() for frame in results]
    >>> pushed = [frame for frame in results if frame.stage == "push"]
    >>> results[-1].mesh().plot(scalars="stress")  # doctest: +SKIP
    """

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        if not isinstance(folder, (str, os.PathLike)):
            hint = ""
            if hasattr(folder, "element_block"):
                hint = ": give the folder that `record=` of `run` or `relax` has named"
            kind = type(folder).__name__
            raise TypeError(f"folder: expected the path of a folder of results, found {kind}{hint}")
        self._folder = Path(folder)
        if not any((self._folder / name).exists() for name in LOOKED_FOR):
            raise FileNotFoundError(not_there(self._folder))

    @property
    def folder(self) -> Path:
        """Path of the folder."""
        return self._folder

    def __repr__(self) -> str:
        return f"<Results {str(self.folder)!r}: {len(self)} frames>"

    def _repr_html_(self) -> str:
        return of_results(self)

    @cached_property
    def title(self) -> str:
        """Title of the model, or the name of the folder if there is none."""
        return str(self._marker.get("title") or self.folder.resolve().name)

    @cached_property
    def deck(self) -> str:
        """Text of the deck that was run."""
        return str(self._marker.get("text") or "")

    @cached_property
    def _marker(self) -> dict[str, Any]:
        for name, text in (("ddem.json", "text"), ("summary.json", "deck")):
            path = self.folder / name
            if path.exists():
                found = json.loads(path.read_text("utf-8"))
                return {"title": found["title"], "text": found[text]}
        return {}

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Contents of ``summary.json``, written at the end of a run: the model, and each stage with
        its result."""
        path = self.folder / "summary.json"
        if not path.exists():
            raise FileNotFoundError(f"{path} does not exist: it is written at the end of the run")
        found: dict[str, Any] = json.loads(path.read_text("utf-8"))
        return found

    @cached_property
    def _frames(self) -> tuple[Floats, Integers, npt.NDArray[np.str_]]:
        """Time, step and stage of each frame."""
        if (self.folder / "frames.csv").exists():
            _, rows = rows_of(self.folder / "frames.csv")
            stages = np.array([row[0] for row in rows], np.str_)
            steps = np.array([int(row[1]) for row in rows], np.int64)
            times = np.array([float(row[2]) for row in rows])
            back = np.flatnonzero((np.diff(times) < 0.0) | (np.diff(steps) < 0))
            if len(back):
                at = int(back[0]) + 1
                raise ValueError(
                    f"{self.folder} has frames of more than one run: frame {at} at "
                    f"{times[at]:.6g} s, step {steps[at]}, follows a frame at {times[at - 1]:.6g} s, "
                    f"step {steps[at - 1]}; record each run in a folder of its own"
                )
            return times, steps, stages
        # The files are from another version, or not from ddem.
        times = np.array(self._file("blocks").times, np.float64)
        return times, np.full(len(times), -1), np.full(len(times), "", np.str_)

    @property
    def times(self) -> Floats:
        """Simulated time of each frame [s], shape (n,). Frames of one relaxation have the same time."""
        return self._frames[0].copy()

    @property
    def steps(self) -> Integers:
        """Steps since the start of the run at each frame, shape (n,); -1 if unknown."""
        return self._frames[1].copy()

    @property
    def stages(self) -> npt.NDArray[np.str_]:
        """Name of the stage of each frame, shape (n,); the first frame is the start of its stage."""
        return self._frames[2].copy()

    def __len__(self) -> int:
        return len(self._frames[0])

    @overload
    def __getitem__(self, index: int) -> Frame: ...
    @overload
    def __getitem__(self, index: slice) -> list[Frame]: ...
    def __getitem__(self, index: int | slice) -> Frame | list[Frame]:
        if isinstance(index, slice):
            return [self[at] for at in range(*index.indices(len(self)))]
        if not hasattr(index, "__index__"):
            hint = ""
            if isinstance(index, float) and len(self):
                nearest = int(np.abs(self.times - index).argmin())
                hint = f"; frame {nearest} is the nearest to {index:g} s, see `times`"
            raise TypeError(f"frame: expected a whole number, found {index!r}{hint}")
        at = index.__index__()
        if not -len(self) <= at < len(self):
            raise IndexError(f"frame: {index} does not exist, {self.folder} has {len(self)} frames")
        return Frame(self, at % len(self))

    def __iter__(self) -> Iterator[Frame]:
        return (self[at] for at in range(len(self)))

    @cached_property
    def probes(self) -> Histories:
        """Histories of the probes by name: tables with the columns ``time`` (s), ``step`` and ``x``,
        ``y``, ``z`` or ``xx`` to ``zx``, as :attr:`Simulation.probes`."""
        header, rows = rows_of(self.folder / "probes.csv")
        columns: dict[str, list[int]] = {}
        for number, column in enumerate(header[3:], start=3):
            columns.setdefault(column.rpartition(".")[0], []).append(number)
        probes = Histories()
        for name, numbers in columns.items():
            parts = [header[number].rpartition(".")[2] for number in numbers]
            kind = np.dtype([("time", "f8"), ("step", "i8"), *((part, "f8") for part in parts)])
            samples = [
                (float(row[2]), int(row[1]), *(float(row[number]) for number in numbers))
                for row in rows
                if row[numbers[0]] != ""
            ]
            probes[name] = np.array(samples, kind).view(Table)
        return probes

    @cached_property
    def energy(self) -> Table:
        """Energies over time: a table of ``stage``, ``step``, ``time`` (s) and the energies [J]."""
        header, rows = rows_of(self.folder / "energy.csv")
        width = max((len(row[0]) for row in rows), default=1)
        kind = np.dtype(
            [("stage", f"U{width}"), ("step", "i8"), *((name, "f8") for name in header[2:])]
        )
        values = [(row[0], int(row[1]), *map(float, row[2:])) for row in rows]
        return np.array(values, kind).view(Table)

    def fragments(self, stage: str | None = None) -> Table:
        """Fragments at the end of a stage, by default the last one that was run.

        Parameters
        ----------
        stage : str, optional
            Name of the stage.

        Returns
        -------
        Table
            Table as :attr:`Simulation.fragments`.

        Raises
        ------
        ValueError
            If no stage of that name has run.
        """
        header, rows = rows_of(self.folder / "fragments.csv")
        if stage is not None:
            done = dict.fromkeys(row[0] for row in rows)
            rows = [row for row in rows if row[0] == one_of("stage", stage, done)]
        # A stage of the same name may have run more than once: take the last.
        rows = [row for row in rows if row[:2] == rows[-1][:2]]
        start = header.index("blocks")
        numbers = [[float(cell) for cell in row[start:]] for row in rows]
        fragments = [(int(n[0]), *n[1:5], tuple(n[5:8]), tuple(n[8:11])) for n in numbers]
        return np.array(fragments, _FRAGMENT).view(Table)

    def _file(self, name: str) -> File:
        files: dict[str, File] = self.__dict__.setdefault("_files", {})
        if name not in files:
            files[name] = File(self.folder / f"{name}.vtkhdf")
        return files[name]

"""Folders of results: the one reader of what a run has written."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

import numpy as np
import numpy.typing as npt

from ._files import LOOKED_FOR, File, Read, not_there, rows_of
from ._mesh import mesh_of
from ._names import choices, one_of
from ._table import Histories, Table

if TYPE_CHECKING:
    import pyvista as pv

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]

_VECTOR = ("force", "traction", "normal")
_CONTACT = np.dtype(
    [
        ("point", "f8", 3),
        *((name, "f8", 3) for name in _VECTOR),
        *((name, "f8") for name in ("area", "gap", "slip")),
        ("sliding", "?"),
        ("blocks", "i8", 2),
    ]
)
_FRAGMENT = np.dtype(
    [
        ("blocks", "i8"),
        *((name, "f8") for name in ("volume", "mass", "size", "passing")),
        ("centroid", "f8", 3),
        ("velocity", "f8", 3),
    ]
)


class Results(Sequence["Frame"]):
    """A folder of results: its frames, the histories of its probes, its energies, its summary.

    Nothing is read before it is asked for, so that folders of any size open at once, and one of a
    run that still goes on shows what is there; make another to see what has come since. Fields and
    meshes need PyVista, all else NumPy alone.

    Parameters
    ----------
    folder : str or os.PathLike
        What ``ddem DECK``, :func:`run_deck` or ``record=`` of a call have written.

    Raises
    ------
    FileNotFoundError
        If there is no such folder, or no results in it.

    Examples
    --------
    >>> results = ddem.Results("results/beam-crack")
    >>> lowest = [frame.displacement[:, 2].min() for frame in results]
    >>> pushed = [frame for frame in results if frame.stage == "push"]
    >>> results[-1].mesh().plot(scalars="stress")  # doctest: +SKIP
    """

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        self._folder = Path(folder)
        if not any((self._folder / name).exists() for name in LOOKED_FOR):
            raise FileNotFoundError(not_there(self._folder))

    @property
    def folder(self) -> Path:
        """The folder."""
        return self._folder

    def __repr__(self) -> str:
        return f"<Results {str(self.folder)!r}: {len(self)} frames>"

    @cached_property
    def title(self) -> str:
        """Title of the model; the name of the folder where it has none."""
        return str(self._marker.get("title") or self.folder.resolve().name)

    @cached_property
    def deck(self) -> str:
        """The deck that was run, its text."""
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
        """What was run and how it went: the contents of ``summary.json``, at the end of a run."""
        path = self.folder / "summary.json"
        if not path.exists():
            raise FileNotFoundError(f"{path} is not there: it is written when the run ends")
        found: dict[str, Any] = json.loads(path.read_text("utf-8"))
        return found

    @cached_property
    def _frames(self) -> tuple[Floats, Integers, npt.NDArray[np.str_]]:
        """Time, step and stage of each frame."""
        if (self.folder / "frames.csv").exists():
            _, rows = rows_of(self.folder / "frames.csv")
            stages = np.array([row[0] for row in rows], np.str_)
            steps = np.array([int(row[1]) for row in rows], np.int64)
            return np.array([float(row[2]) for row in rows]), steps, stages
        # Not of this version, or not of ddem.
        times = np.array(self._file("blocks").times, np.float64)
        return times, np.full(len(times), -1), np.full(len(times), "", np.str_)

    @property
    def times(self) -> Floats:
        """Simulated time of each frame [s], shape (n,). Frames of one relaxation share theirs."""
        return self._frames[0].copy()

    @property
    def steps(self) -> Integers:
        """Steps since the start of the run at each frame, shape (n,); -1 where it is not known."""
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
        at = index.__index__()
        if not -len(self) <= at < len(self):
            raise IndexError(f"frame: {index} is not there, {self.folder} has {len(self)} frames")
        return Frame(self, at % len(self))

    def __iter__(self) -> Iterator[Frame]:
        return (self[at] for at in range(len(self)))

    @cached_property
    def probes(self) -> Histories:
        """What probes have recorded, by their names: tables of ``time`` (s), ``step`` and ``x``,
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
        """Energies over time [J], a row of ``stage``, ``step``, ``time`` (s) and each of them."""
        header, rows = rows_of(self.folder / "energy.csv")
        width = max((len(row[0]) for row in rows), default=1)
        kind = np.dtype(
            [("stage", f"U{width}"), ("step", "i8"), *((name, "f8") for name in header[2:])]
        )
        values = [(row[0], int(row[1]), *map(float, row[2:])) for row in rows]
        return np.array(values, kind).view(Table)

    def fragments(self, stage: str | None = None) -> Table:
        """Fragments at the end of a stage, of the last one that was done if none is named.

        Parameters
        ----------
        stage : str, optional
            Name of the stage.

        Returns
        -------
        Table
            As :attr:`Simulation.fragments`.

        Raises
        ------
        ValueError
            If no stage of that name has been done.
        """
        header, rows = rows_of(self.folder / "fragments.csv")
        if stage is not None:
            done = dict.fromkeys(row[0] for row in rows)
            rows = [row for row in rows if row[0] == one_of("stage", stage, done)]
        # A stage of the same name may have been done more than once.
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


class Frame:
    """One frame of results. It has every field as an attribute, and by its name as an item.

    Arrays are as those of :class:`Simulation`, and of the caller alone: ``displacement``
    (n_nodes, 3), ``stress`` (n_elements, 6), ``traction`` (n_pairs, 3). Where nodes and pairs have
    a field of the same name it is that of the nodes; ``pairs`` has the other.
    """

    def __init__(self, results: Results, index: int) -> None:
        self._results = results
        self.index = index
        #: Simulated time [s].
        self.time = float(results._frames[0][index])
        step = int(results._frames[1][index])
        #: Steps since the start of the run; None where it is not known.
        self.step = step if step >= 0 else None
        #: Name of the stage.
        self.stage = str(results._frames[2][index])

    def __repr__(self) -> str:
        when = f"step {self.step}" if self.still else f"{self.time:.6g} s"
        return f"<Frame {self.index} of {str(self._results.folder)!r}: {self.stage}, {when}>"

    @property
    def still(self) -> bool:
        """Whether it is of a relaxation: no time has passed since the frame before, or, of the first
        one, until the next."""
        times, _, stages = self._results._frames
        at = max(self.index, 1)
        if at == len(times) or stages[at] != stages[self.index]:
            return False
        return bool(times[at] <= times[at - 1])

    @property
    def title(self) -> str:
        """Title of the model."""
        return self._results.title

    def _blocks(self) -> Read:
        return self._results._file("blocks").read(self.index)

    def _joints(self) -> Read | None:
        there = (self._results.folder / "joints.vtkhdf").exists()
        return self._results._file("joints").read(self.index) if there else None

    @property
    def _fields(self) -> tuple[list[str], list[str]]:
        read = self._blocks()
        return list(read.nodal), list(read.elemental)

    @property
    def fields(self) -> tuple[str, ...]:
        """Names of all fields."""
        joints = self._joints()
        nodal, elemental = self._fields
        return tuple(dict.fromkeys((*nodal, *elemental, *(joints.nodal if joints else ()))))

    @property
    def points(self) -> Floats:
        """Reference positions of the nodes [m], shape (n_nodes, 3)."""
        return self._blocks().points.copy()

    @property
    def elements(self) -> Integers:
        """The nodes of each element, in VTK's order, shape (n_elements, 8)."""
        return self._blocks().cells.reshape(-1, 8).copy()

    @property
    def element_block(self) -> Integers:
        """The block of each element, shape (n_elements,)."""
        return self.field("block").astype(np.int64)

    @property
    def quads(self) -> Integers:
        """The pairs around each joint element, shape (n_quads, 4)."""
        joints = self._joints()
        return joints.cells.reshape(-1, 4).copy() if joints else np.empty((0, 4), np.int64)

    @property
    def pairs(self) -> Table:
        """The pairs of facing nodes with their fields: a table as :attr:`Simulation.pairs`, without
        their normals and nodes. Empty of a model that has no joints."""
        joints = self._joints()
        if joints is None:
            return np.empty(0, [("point", "f8", 3)]).view(Table)
        return _table({"point": joints.points, **joints.nodal})

    @property
    def contacts(self) -> Table:
        """What presses, a table as :attr:`Simulation.contacts`. Empty where no blocks meet."""
        if not (self._results.folder / "contacts.vtkhdf").exists():
            return np.empty(0, _CONTACT).view(Table)
        read = self._results._file("contacts").read(self.index)
        rows = np.zeros(len(read.points), _CONTACT)
        # A frame without contacts has no arrays.
        for name in _CONTACT.names or ():
            if len(rows):
                rows[name] = read.points if name == "point" else read.nodal[name]
        return rows.view(Table)

    def field(self, name: str) -> npt.NDArray[Any]:
        """An array by the name of a field.

        Parameters
        ----------
        name : str
            One of :attr:`fields`.

        Returns
        -------
        array
            One row for each node, element or pair.

        Raises
        ------
        ValueError
            If there is no such field.
        """
        found = self._found(name)
        if found is None:
            one_of("field", name, self.fields)
        return np.array(found)

    def _found(self, name: str) -> npt.NDArray[Any] | None:
        read = self._blocks()
        for fields in (read.nodal, read.elemental):
            if name in fields:
                return fields[name]
        joints = self._joints()
        return joints.nodal.get(name) if joints else None

    def __getitem__(self, name: str) -> npt.NDArray[Any]:
        found = self._found(name)
        if found is None:
            raise _Missing(f"the frame has no field {name!r}; {choices(name, self.fields)}")
        return found.copy()

    def __getattr__(self, name: str) -> npt.NDArray[Any]:
        found = None if name.startswith("_") else self._found(name)
        if found is None:
            known = () if name.startswith("_") else (*self.fields, *_own())
            raise AttributeError(f"the frame has no {name!r}; {choices(name, known)}")
        return found.copy()

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self.fields]

    def mesh(self, part: str = "blocks") -> pv.UnstructuredGrid:
        """The frame as a PyVista grid with all its fields, as :meth:`Simulation.mesh`.

        Parameters
        ----------
        part : {"blocks", "joints", "contacts"}, optional
            Hexahedra of the blocks, quadrilaterals of the joints, or a point for each contact.

        Returns
        -------
        pyvista.UnstructuredGrid
            At the reference positions, contacts where they are then. Removed blocks are left out:
            `node` and `element`, or `pair` and `quad`, are the rows of the arrays.

        Raises
        ------
        ValueError
            If there is no such part.
        ImportError
            If PyVista is not installed.
        """
        return mesh_of(self, part)


class _Missing(KeyError):
    """A field that is not there. The text of other errors of this kind is quoted."""

    def __str__(self) -> str:
        return str(self.args[0])


def _own() -> list[str]:
    own = [name for name in vars(Frame) if not name.startswith("_")]
    return [*own, "index", "time", "step", "stage"]


def _table(columns: dict[str, npt.NDArray[Any]]) -> Table:
    kinds = [
        (name, "?" if name in ("open", "released", "removed") else values.dtype, values.shape[1:])
        for name, values in columns.items()
    ]
    rows = np.empty(len(columns["point"]), kinds)
    for name, values in columns.items():
        rows[name] = values
    return rows.view(Table)

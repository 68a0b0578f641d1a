"""One frame of results: arrays, tables and mesh."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ._files import Read
from ._mesh import mesh_of
from ._names import choices, one_of
from ._table import Table

if TYPE_CHECKING:
    import pyvista as pv

    from ._results import Results

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


class Frame:
    """One frame of results. Every field is an attribute, and an item by its name.

    Arrays are copies with the shapes of the arrays of :class:`Simulation`: ``displacement``
    (n_nodes, 3), ``stress`` (n_elements, 6), ``traction`` (n_pairs, 3). If nodes and pairs have
    fields of the same name, the attribute is the field of the nodes; ``pairs`` has the other one.
    """

    def __init__(self, results: Results, index: int) -> None:
        self._results = results
        self.index = index
        #: Simulated time [s].
        self.time = float(results._frames[0][index])
        step = int(results._frames[1][index])
        #: Steps since the start of the run; None if unknown.
        self.step = step if step >= 0 else None
        #: Name of the stage.
        self.stage = str(results._frames[2][index])

    def __repr__(self) -> str:
        when = f"step {self.step}" if self.still else f"{self.time:.6g} s"
        return f"<Frame {self.index} of {str(self._results.folder)!r}: {self.stage}, {when}>"

    @property
    def still(self) -> bool:
        """True for a frame of a relaxation, whose time is that of the frame before it.

        Frame 0 is compared with the next frame of its stage.
        """
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
        """Nodes of each element in VTK's order, shape (n_elements, 8)."""
        return self._blocks().cells.reshape(-1, 8).copy()

    @property
    def element_block(self) -> Integers:
        """Number of the block of each element, shape (n_elements,)."""
        return self.field("block").astype(np.int64)

    @property
    def quads(self) -> Integers:
        """Pairs at the corners of each joint element, shape (n_quads, 4)."""
        joints = self._joints()
        return joints.cells.reshape(-1, 4).copy() if joints else np.empty((0, 4), np.int64)

    @property
    def pairs(self) -> Table:
        """Pairs of facing nodes with their fields: a table as :attr:`Simulation.pairs`, without
        normals and nodes. It is empty if the model has no joints."""
        joints = self._joints()
        if joints is None:
            return np.empty(0, [("point", "f8", 3)]).view(Table)
        return _table({"point": joints.points, **joints.nodal})

    @property
    def contacts(self) -> Table:
        """Contacts that press: a table as :attr:`Simulation.contacts`. It is empty if there are none."""
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
        """Array of a field.

        Parameters
        ----------
        name : str
            Name of the field, one of :attr:`fields`.

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
            raise KeyError(f"the frame has no field {name!r}; {choices(name, self.fields)}")
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
        """PyVista grid of the frame with all its fields, as :meth:`Simulation.mesh`.

        Parameters
        ----------
        part : {"blocks", "joints", "contacts"}, optional
            Hexahedra of the blocks, quadrilaterals of the joints, or a point for each contact.

        Returns
        -------
        pyvista.UnstructuredGrid
            Grid at the reference positions, or contacts at their positions in this frame. Removed
            blocks are left out: the arrays `node` and `element`, or `pair` and `quad`, have the rows
            of the frame's arrays.

        Raises
        ------
        ValueError
            If there is no such part.
        ImportError
            If PyVista is not installed.
        """
        return mesh_of(self, part)


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

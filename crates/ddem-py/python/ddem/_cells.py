"""Cells of rock that cuts leave: table, polyhedra, whole blocks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ._table import Table

if TYPE_CHECKING:
    import pyvista as pv

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]

_BLOCK = np.dtype([("cells", "i8"), ("volume", "f8"), ("width", "f8"), ("centroid", "f8", 3)])


class Cells:
    """Cells of rock that the cuts of a model leave, from :meth:`Model.cells`.

    A block is one cell, or several that are joined.

    Attributes
    ----------
    title : str
        Title of the model.
    table : Table
        Row for each cell, with the columns of ``blocks.csv``: `volume` [m³], `surface` [m²], `free_area` of
        free faces [m²], `width` [m], numbers of `faces`, `vertices` and elements (`hexes`), `centroid` (3) [m],
        `region`, `material`, number of the `block`, `cuts` that bound it, and by block theory `mode`, `factor`,
        `plunge` and `trend` of the motion [degrees] and the cuts `on` which it slides. Names of several cuts
        are separated by ``;``. `factor`, `plunge` and `trend` are NaN where ``blocks.csv`` has nothing.
    planes : Table
        Row for each plane of a cut: `cut`, `joined` (it makes no joint), `normal` (3), `dip` and
        `dip_direction` [degrees], `area` between cells [m²].
    points : array of float64, shape (n_points, 3)
        Corners of the cells [m].
    corners : array of int
        Numbers of the points of all faces, face after face, counter-clockwise seen from outside.
    starts : array of int, shape (n_faces + 1,)
        Rows of `corners` at which faces begin, and its length.
    face_cell : array of int, shape (n_faces,)
        Cell of each face; faces of a cell are neighbours.
    face_plane : array of int, shape (n_faces,)
        Row of `planes` of each face; -1 for a face of a region.
    """

    def __init__(
        self,
        title: str,
        table: Table,
        planes: Table,
        points: Floats,
        corners: Integers,
        starts: Integers,
        face_cell: Integers,
        face_plane: Integers,
    ) -> None:
        self.title = title
        self.table, self.planes = table, planes
        self.points, self.corners, self.starts = points, corners, starts
        self.face_cell, self.face_plane = face_cell, face_plane

    def __len__(self) -> int:
        return len(self.table)

    def __repr__(self) -> str:
        number = len(np.unique(self.table["block"]))
        return f"<Cells {self.title!r}: {number} blocks of {len(self)} cells>"

    def faces(self, cell: int) -> list[Floats]:
        """Corners of each face of a cell [m], shape (n, 3), counter-clockwise seen from outside.

        Parameters
        ----------
        cell : int
            Number of the cell, a row of `table`; negative numbers count from the end.

        Returns
        -------
        list of array
            Polygons.

        Raises
        ------
        IndexError
            If there is no such cell.
        """
        number = range(len(self))[cell]
        first, last = np.searchsorted(self.face_cell, [number, number + 1])
        return [self.points[self.face_corners(face)] for face in range(first, last)]

    def face_corners(self, face: int) -> Integers:
        """Numbers of the points of a face, counter-clockwise seen from outside."""
        return self.corners[self.starts[face] : self.starts[face + 1]]

    @property
    def blocks(self) -> Table:
        """Row for each block: number of `cells`, `volume` [m³], least `width` [m] and `centroid` (3) [m]."""
        block, volume = np.asarray(self.table["block"]), np.asarray(self.table["volume"])
        n = int(block.max(initial=-1)) + 1
        blocks = np.zeros(n, _BLOCK)
        blocks["cells"] = np.bincount(block, minlength=n)
        blocks["volume"] = np.bincount(block, volume, n)
        blocks["width"] = np.inf
        np.minimum.at(blocks["width"], block, self.table["width"])
        for d in range(3):
            moment = np.bincount(block, volume * self.table["centroid"][:, d], n)
            blocks["centroid"][:, d] = moment / blocks["volume"]
        return blocks.view(Table)

    def mesh(self) -> pv.UnstructuredGrid:
        """Polyhedra as a PyVista grid, with the columns of `table` that are numbers.

        Returns
        -------
        pyvista.UnstructuredGrid
            A copy.

        Raises
        ------
        ImportError
            If PyVista is not installed: ``pip install "ddem[plot]"``.
        """
        try:
            import pyvista as pv
        except ImportError as missing:
            raise ImportError('meshes need PyVista: pip install "ddem[plot]"') from missing
        stream: list[int] = []
        bounds = np.searchsorted(self.face_cell, np.arange(len(self) + 1))
        for first, last in zip(bounds[:-1], bounds[1:]):
            own: list[int] = [int(last - first)]
            for face in range(first, last):
                corners = self.face_corners(face)
                own += [len(corners), *corners.tolist()]
            stream += [len(own), *own]
        kinds = np.full(len(self), int(pv.CellType.POLYHEDRON), np.uint8)
        grid = pv.UnstructuredGrid(np.array(stream, np.int64), kinds, self.points)
        data: Any = grid.cell_data
        for name in self.table.dtype.names or ():
            column = np.asarray(self.table[name])
            if column.dtype.kind != "U":
                data[name] = column
        return grid

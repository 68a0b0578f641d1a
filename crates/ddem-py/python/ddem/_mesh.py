"""PyVista grids of a simulation in its present state, or of a frame of results."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ._names import one_of

if TYPE_CHECKING:
    import pyvista as pv

PARTS = ("blocks", "joints", "contacts")


def mesh_of(source: Any, part: str = "blocks") -> pv.UnstructuredGrid:
    """Grid of a part of a simulation or frame with all its fields, without removed blocks."""
    try:
        import pyvista as pv
    except ImportError as missing:
        raise ImportError('meshes need PyVista: pip install "ddem[plot]"') from missing
    one_of("part", part, PARTS)
    grid: pv.UnstructuredGrid
    if part == "contacts":
        met = source.contacts
        points = np.asarray(met["point"])
        grid = pv.UnstructuredGrid({pv.CellType.VERTEX: np.arange(len(points))[:, None]}, points)
        _put(grid.point_data, {name: met[name] for name in met.dtype.names if name != "point"})
        return grid
    nodal, elemental = source._fields
    if part == "joints":
        pairs, quads = source.pairs, source.quads
        gone = np.zeros(len(pairs), bool)
        if "removed" in pairs.dtype.names:
            gone = np.asarray(pairs["removed"]) != 0
        kept = np.flatnonzero(~gone[quads].any(axis=1))
        grid, rows = _grid(pv.CellType.QUAD, quads, kept, np.asarray(pairs["point"]))
        fields = {name: pairs[name][rows] for name in pairs.dtype.names if name != "point"}
        _put(grid.point_data, {"pair": rows, **fields})
        _put(grid.cell_data, {"quad": kept})
        return grid
    values = {name: np.asarray(source.field(name)) for name in (*nodal, *elemental)}
    kept = np.arange(len(source.elements))
    if "removed" in values:
        kept = np.flatnonzero(values["removed"].reshape(-1) == 0)
    grid, rows = _grid(pv.CellType.HEXAHEDRON, source.elements, kept, source.points)
    for name in ("block", "material"):
        if name not in values:
            values[name] = getattr(source, f"element_{name}")
            elemental = [*elemental, name]
    rigid = getattr(source, "element_rigid", None) if "rigid" not in values else None
    if rigid is not None and rigid.any():
        values["rigid"], elemental = rigid, [*elemental, "rigid"]
    _put(grid.point_data, {"node": rows, **{name: values[name][rows] for name in nodal}})
    _put(grid.cell_data, {"element": kept, **{name: values[name][kept] for name in elemental}})
    return grid


def _grid(
    kind: Any, cells: npt.NDArray[Any], kept: npt.NDArray[Any], points: npt.NDArray[Any]
) -> tuple[Any, npt.NDArray[Any]]:
    """Grid of the kept cells with their points, and the rows of these points."""
    import pyvista as pv

    if len(kept) == len(cells):
        return pv.UnstructuredGrid({kind: cells}, points), np.arange(len(points))
    rows, own = np.unique(cells[kept], return_inverse=True)
    return pv.UnstructuredGrid({kind: own.reshape(-1, cells.shape[1])}, points[rows]), rows


def _put(data: Any, fields: dict[str, npt.NDArray[Any]]) -> None:
    """Add fields to a grid. VTK has no Boolean type, and PyVista refuses fields without rows."""
    for name, values in fields.items():
        if len(values):
            plain = values.astype(np.uint8) if values.dtype == bool else values
            data[name] = np.ascontiguousarray(plain)

"""Pictures of the blocks that cuts leave, before a model is built."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ._cells import Cells
from ._ddem import Model
from ._draw import VIEWS
from ._layers import FRAGMENTS, INK, PLAIN, ColourBar, Layer, bar_of, listed
from ._names import one_of
from ._plot import check_size, present

if TYPE_CHECKING:
    import pyvista as pv

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]

# Difference of unit vectors within which they are one, and of places relative to the size of the model.
_FLAT = 1e-6

# Modes of block theory and their colours.
_MODES = {
    "falls": "#c0392b",
    "slides": "#f08c00",
    "slides on two": "#ffd43b",
    "keyed": "#7fb069",
    "held": "#a9b4c0",
    "buried": "#d5dbe1",
    "removed": "#ffffff",
}
# Columns that have a unit.
_UNITS = {"volume": "m³", "surface": "m²", "width": "m"}
# Ends of the colours of factors of safety: those of blocks that slide by far differ in nothing that matters.
_FACTORS = (0.0, 2.0)


def plot_blocks(
    cells: Model | Cells,
    color: str | npt.ArrayLike = "block",
    *,
    explode: float = 0.0,
    where: npt.ArrayLike | None = None,
    view: str = "iso",
    cmap: Any = None,
    clim: tuple[float, float] | None = None,
    opacity: float = 1.0,
    edges: bool = True,
    label: str | None = None,
    background: str = "white",
    window_size: tuple[int, int] = (1200, 900),
    screenshot: str | os.PathLike[str] | None = None,
    html: str | os.PathLike[str] | None = None,
    show: bool = True,
) -> pv.Plotter:
    """Draw the blocks of regions and cuts, as :func:`plot` draws a simulation.

    Parameters
    ----------
    cells : Model or Cells
        Model with regions, or what :meth:`Model.cells` returns, which need not be cut again.
    color : str or array, optional
        Colour of the cells: ``"block"`` (default) tells blocks apart; ``"mode"`` of block theory; a
        column with numbers of :attr:`Cells.table`, such as ``"factor"``, ``"volume"`` or ``"width"``;
        ``"region"`` or ``"material"``; or your own numbers, one for each cell. Cells without a number
        are grey.
    explode : float, optional
        Distance by which blocks move apart, relative to their distance from the middle of the rock.
    where : mask or array of int, optional
        Cells to draw. By default all except removed ones.
    view, cmap, clim, opacity, label, background, window_size, screenshot, html, show : optional
        As in :func:`plot`. The colours of factors end at 2, unless `clim` is given.
    edges : bool, optional
        If True, draw the edges of the blocks. A joint that ends inside a block has none.

    Returns
    -------
    pyvista.Plotter
        Plotter, which is closed unless `show` is False.

    Raises
    ------
    ModelError
        If the model has no regions, or cannot be cut.
    ValueError
        If a name is unknown, an array has the wrong shape, or nothing is left to draw.
    ImportError
        If PyVista is not installed, or plotly for a page: ``pip install "ddem[plot]"``.
    RuntimeError
        If there is no display for a window.

    Examples
    --------
    >>> ddem.plot_blocks(model, "factor", explode=0.2, screenshot="blocks.png")
    """
    one_of("view", view, VIEWS)
    check_size(window_size)
    if not np.isfinite(explode):
        raise ValueError(f"explode: {explode!r} is not finite")
    rock = cells_of(cells)
    shown = _chosen(rock, where)
    drawn = shown[rock.face_cell] & ~_inner(rock, shown)
    corners, faces, owners = _faces(rock, drawn, explode)
    layers = _coloured(rock, color, (corners, faces, owners), (cmap, clim), label, opacity)
    if edges:
        lines = _edges(rock, drawn)
        offsets = _offsets(rock, explode)
        ends = (rock.points[lines[:, :2]] + offsets[lines[:, 2]][:, None]).reshape(-1, 3)
        faint = 1.0 if opacity == 1.0 else 0.45
        layers.append(Layer("edges", ends, np.arange(len(ends)).reshape(-1, 2), faint, INK))
    blocks, number = len(np.unique(rock.table["block"][shown])), int(shown.sum())
    words = [rock.title, f"{blocks} block{'s' if blocks > 1 else ''} of {number} cell{'s' if number > 1 else ''}"]
    files = (screenshot, html)
    return present(layers, words, view, background, window_size, files, show)


def cells_of(cells: Model | Cells) -> Cells:
    """Cells of a model, or the cells themselves."""
    if isinstance(cells, Model):
        return cells.cells()
    if not isinstance(cells, Cells):
        raise TypeError(f"cells: expected a Model or its cells, found {type(cells).__name__}")
    return cells


def _chosen(rock: Cells, where: npt.ArrayLike | None) -> npt.NDArray[np.bool_]:
    """Mask of the cells to draw."""
    if where is None:
        shown: npt.NDArray[np.bool_] = np.asarray(rock.table["mode"] != "removed")
    else:
        chosen = np.asarray(where)
        # NumPy makes floats of an empty list.
        chosen = chosen if chosen.size else np.empty(0, np.int64)
        shown = np.zeros(len(rock), np.bool_)
        try:
            shown[chosen if chosen.dtype == np.bool_ else chosen.astype(np.int64, casting="same_kind")] = True
        except (IndexError, TypeError) as error:
            raise ValueError(f"where: {error}") from None
    if not shown.any():
        raise ValueError("where: nothing to draw, no cell is left")
    return shown


def _offsets(rock: Cells, explode: float) -> Floats:
    """Displacement of each cell, the same for the cells of a block."""
    low, high = rock.points.min(axis=0), rock.points.max(axis=0)
    offsets: Floats = explode * (rock.blocks["centroid"] - 0.5 * (low + high))
    return offsets[rock.table["block"]]


def _inner(rock: Cells, shown: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Mask of the faces between two shown cells of one block, whose corners match."""
    first, counts = rock.starts[:-1], np.diff(rock.starts)
    low, high = np.minimum.reduceat(rock.corners, first), np.maximum.reduceat(rock.corners, first)
    total = np.add.reduceat(rock.corners, first)
    block = np.asarray(rock.table["block"])[rock.face_cell]
    # Two faces of a block with equal least, greatest and summed corners are the two sides of one.
    keys = np.column_stack([block, low, high, total, counts, np.where(shown[rock.face_cell], -1, first)])
    _, group, size = np.unique(keys, axis=0, return_inverse=True, return_counts=True)
    inner: npt.NDArray[np.bool_] = size[group.reshape(-1)] == 2
    return inner


def _faces(rock: Cells, drawn: npt.NDArray[np.bool_], explode: float) -> tuple[Floats, Integers, Integers]:
    """Points, quadrilaterals and their cells: fans of the drawn faces, the last of which may be a triangle."""
    counts = np.diff(rock.starts)
    face = np.repeat(np.arange(len(counts)), counts)
    points = rock.points[rock.corners] + _offsets(rock, explode)[rock.face_cell[face]]
    quads, owners = [], []
    for n in np.unique(counts):
        own = np.flatnonzero((counts == n) & drawn)
        for i in range(1, n - 1, 2):
            # The last corner of a triangle is there twice.
            fan = np.array([0, i, i + 1, min(i + 2, n - 1)])
            quads.append(rock.starts[own][:, None] + fan)
            owners.append(rock.face_cell[own])
    return points, np.concatenate(quads), np.concatenate(owners)


def _edges(rock: Cells, drawn: npt.NDArray[np.bool_]) -> Integers:
    """Edges of blocks: both ends and the cell. Those within a flat side of joined cells are left out."""
    counts = np.diff(rock.starts)
    face = np.repeat(np.arange(len(counts)), counts)
    next_one = np.arange(len(rock.corners)) + 1
    next_one[rock.starts[1:] - 1] = rock.starts[:-1]
    kept = drawn[face]
    ends, face = np.stack([rock.corners, rock.corners[next_one]], axis=1)[kept], face[kept]
    normal = _normals(rock)[face]
    # The cell is on the left of an edge, seen from outside.
    inward = np.cross(normal, rock.points[ends[:, 1]] - rock.points[ends[:, 0]])
    inward /= np.maximum(np.linalg.norm(inward, axis=1, keepdims=True), np.finfo(float).tiny)
    block = np.asarray(rock.table["block"])
    ends, edge = _pieces(rock, ends, block[rock.face_cell[face]])
    face, normal, inward = face[edge], normal[edge], inward[edge]
    owner = block[rock.face_cell[face]]
    # Two faces with one half-plane are the sides of joined cells whose corners do not match.
    sides = np.column_stack([owner, ends, np.round(inward / _FLAT)])
    _, group, size = np.unique(sides, axis=0, return_inverse=True, return_counts=True)
    outer = size[group.reshape(-1)] == 1
    ends, face, normal, owner = ends[outer], face[outer], normal[outer], owner[outer]
    rows = np.column_stack([owner, ends])
    _, first, group = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    group = group.reshape(-1)
    off = np.linalg.norm(normal - normal[first][group], axis=1)
    furthest = np.zeros(len(first))
    np.maximum.at(furthest, group, off)
    level = (furthest < _FLAT) & (np.bincount(group, minlength=len(first)) > 1)
    edges: Integers = np.column_stack([ends, rock.face_cell[face]])[first[~level]]
    return edges


def _pieces(rock: Cells, ends: Integers, block: Integers) -> tuple[Integers, Integers]:
    """Pieces of edges between the ends of all edges of a block on one line: sorted ends, and the edge."""
    rows = np.arange(len(ends))
    # Edges of one cell meet at corners only.
    several = (rock.blocks["cells"] > 1)[block]
    rows = rows[several]
    low, high = rock.points.min(axis=0), rock.points.max(axis=0)
    start, end = np.moveaxis(rock.points[ends[rows]] - 0.5 * (low + high), 1, 0)
    along = end - start
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), np.finfo(float).tiny)
    # One direction for both ways along a line.
    leading = np.take_along_axis(along, (np.abs(along) > 0.51).argmax(axis=1)[:, None], axis=1)
    along *= np.sign(leading)
    step = _FLAT * max(float((high - low).max()), np.finfo(float).tiny)
    at = np.stack([(start * along).sum(axis=1), (end * along).sum(axis=1)], axis=1)
    foot = start - at[:, :1] * along
    lines = np.column_stack([block[rows], np.round(along / _FLAT), np.round(foot / step)])
    _, line = np.unique(lines, axis=0, return_inverse=True)
    places = np.column_stack([np.repeat(line.reshape(-1), 2), np.round(at / step).reshape(-1)])
    _, one, place = np.unique(places, axis=0, return_index=True, return_inverse=True)
    points, place = ends[rows].reshape(-1)[one], np.sort(place.reshape(-1, 2), axis=1)
    number = place[:, 1] - place[:, 0]
    edge = np.repeat(np.arange(len(rows)), number)
    piece = np.arange(len(edge)) - np.repeat(np.cumsum(number) - number, number) + place[edge, 0]
    pieces = np.stack([points[piece], points[piece + 1]], axis=1) if len(edge) else ends[:0]
    ends = np.concatenate([ends[~several], pieces])
    return np.sort(ends, axis=1), np.concatenate([np.flatnonzero(~several), rows[edge]])


def _normals(rock: Cells) -> Floats:
    """Unit normal of each face."""
    counts = np.diff(rock.starts)
    face = np.repeat(np.arange(len(counts)), counts)
    next_one = np.arange(len(rock.corners)) + 1
    next_one[rock.starts[1:] - 1] = rock.starts[:-1]
    start = rock.points[rock.corners[rock.starts[:-1]]][face]
    turn = np.cross(rock.points[rock.corners] - start, rock.points[rock.corners[next_one]] - start)
    sums = np.stack([np.bincount(face, turn[:, d]) for d in range(3)], axis=1)
    normals: Floats = sums / np.maximum(np.linalg.norm(sums, axis=1, keepdims=True), np.finfo(float).tiny)
    return normals


def _coloured(
    rock: Cells,
    color: str | npt.ArrayLike,
    faces: tuple[Floats, Integers, Integers],
    bar: tuple[Any, tuple[float, float] | None],
    label: str | None,
    opacity: float,
) -> list[Layer]:
    """Layers of the faces: a colour for each name, or colours of numbers."""
    (points, quads, owners), (cmap, clim) = faces, bar
    columns = [name for name in rock.table.dtype.names or () if name not in ("centroid", "cuts", "on")]
    values = np.asarray(rock.table[one_of("color", color, columns)] if isinstance(color, str) else color)
    if values.shape != (len(rock),):
        raise ValueError(f"color: has the shape {values.shape}, expected ({len(rock)},)")
    if values.dtype.kind == "U":
        listed_ones = [mode for mode in _MODES if (values == mode).any()] if color == "mode" else []
        layers = []
        for number, name in enumerate(listed_ones or np.unique(values[owners]).tolist()):
            own = values[owners] == name
            if own.any():
                colour = _MODES[name] if listed_ones else FRAGMENTS[number % len(FRAGMENTS)]
                count = len(np.unique(rock.table["block"][owners[own]]))
                legend = f"{name} ({count})"
                layers.append(Layer(f"blocks {name}", points, quads[own], opacity, colour, legend=legend))
        return layers
    if values.dtype.kind not in "fiub":
        raise ValueError(f"color: must have numbers, found {values.dtype}")
    layer = Layer("blocks", points, quads, opacity, PLAIN)
    if isinstance(color, str) and (color, cmap, clim, label) == ("block", None, None, None):
        # Blocks with near numbers are often neighbours: an odd factor gives them other colours.
        layer.values = ((values * 7) % len(FRAGMENTS))[owners].astype(np.float64)
        layer.bar = ColourBar("colour of the block", listed(FRAGMENTS), (-0.5, len(FRAGMENTS) - 0.5), shown=False)
        return [layer]
    layer.values = values[owners].astype(np.float64)
    name = color if isinstance(color, str) else "values"
    unit = _UNITS.get(name, "")
    if name == "factor":
        cmap, clim = cmap or "RdYlGn", clim or _FACTORS
    title = label or name + (f" ({unit})" if unit else "")
    layer.bar = bar_of(title, layer.values, cmap, clim)
    if not np.isfinite(layer.values).any():
        layer.values, layer.bar, layer.legend = None, None, f"{title}: no values"
    return [layer]

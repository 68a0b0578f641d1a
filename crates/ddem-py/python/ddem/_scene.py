"""Contents of a picture as NumPy arrays: deformed faces of blocks and joints with their values."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import numpy.typing as npt

from ._names import ELEMENTAL, JOINTS, NODAL, PEAKS, STRESSES, TENSOR, UNITS, VECTOR, one_of
from ._results import Frame
from ._results import Results

if TYPE_CHECKING:
    from ._ddem import Simulation

Floats: TypeAlias = npt.NDArray[np.float64]
Integers: TypeAlias = npt.NDArray[np.int64]
Source: TypeAlias = "Simulation | Results | Frame | str | os.PathLike[str]"

# Corners of the six faces of a hexahedron, counterclockwise from outside, in the order of VTK.
_FACES = np.array(
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
)


@dataclass
class Scene:
    """One state of a model: the present state of a simulation, or a frame of results."""

    title: str
    when: str  # stage, and time in motion or step in a relaxation
    points: Floats  # (n_nodes, 3) m, reference positions
    displacement: Floats  # (n_nodes, 3) m
    elements: Integers  # (n_elements, 8) in the order of VTK; parts of a cell share nodes
    blocks: Integers  # (n_elements,) number of the block
    removed: npt.NDArray[np.bool_]  # (n_elements,) true for removed blocks
    rigid: npt.NDArray[np.bool_]  # (n_elements,) true for rigid blocks, which have no stress
    fields: Sequence[str]
    values: Callable[[str], npt.NDArray[Any]]
    pairs: Mapping[str, npt.NDArray[Any]] | npt.NDArray[np.void]
    pair_fields: Sequence[str]
    quads: Integers  # (n_quads, 4) pair numbers
    contacts: Mapping[str, npt.NDArray[Any]]


def scene_of(source: Source, index: int, joints: bool, contacts: bool = False) -> Scene:
    """State to draw. Pairs and contacts are read only if `joints` or `contacts` is true."""
    seen: Any = Results(source) if isinstance(source, (str, os.PathLike)) else source
    if isinstance(seen, Results):
        folder = seen.folder
        if not -len(seen) <= index < len(seen):
            raise ValueError(f"frame: {index} does not exist, {folder} has {len(seen)} frames")
        if joints and not (folder / "joints.vtkhdf").exists():
            raise ValueError(f"joints: {folder} has no joints.vtkhdf, the model has no joints")
        if contacts and not (folder / "contacts.vtkhdf").exists():
            raise ValueError(f"contacts: {folder} has no contacts.vtkhdf: its blocks cannot be in contact")
        seen = seen[index]
    elif not hasattr(seen, "element_block"):
        kind = type(seen).__name__
        raise TypeError(f"simulation: expected a Simulation or a folder of results, found {kind}")
    elif index != -1:
        raise ValueError("frame: a Simulation has only its present state; folders of results have frames")
    if isinstance(seen, Frame):
        fields: Sequence[str] = [name for names in seen._fields for name in names]
        values = _recorded(seen, fields)
    else:
        fields, values = (*NODAL, *ELEMENTAL), _present(seen)
    elements = seen.elements

    def marked(name: str, present: str | None = None) -> npt.NDArray[np.bool_]:
        """Mask of the elements with a nonzero value of a field; all false if there is no such field."""
        if present is not None and hasattr(seen, present):
            return np.asarray(getattr(seen, present), np.bool_)
        try:
            found: npt.NDArray[np.bool_] = np.asarray(seen.field(name)).reshape(-1) != 0
            return found
        except (ValueError, KeyError):
            return np.zeros(len(elements), np.bool_)

    blocks = np.asarray(seen.element_block, np.int64)
    displacement = np.asarray(seen.displacement, np.float64)
    pairs: Any = seen.pairs if joints else {}
    met = seen.contacts if contacts else None
    return Scene(
        title=seen.title,
        when=_when(seen),
        points=seen.points,
        displacement=displacement,
        elements=_shared(elements, blocks, seen.points, displacement),
        blocks=blocks,
        removed=marked("removed"),
        rigid=marked("rigid", "element_rigid"),
        fields=fields,
        values=values,
        pairs=pairs,
        pair_fields=pairs.dtype.names if joints else (),
        quads=seen.quads if joints else np.empty((0, 4), np.int64),
        contacts={} if met is None else {name: met[name] for name in met.dtype.names or ()},
    )


# Distance at rest within which nodes of a block are one, relative to the size of the model.
_ONE = 1e-9


def _shared(elements: Integers, blocks: Integers, points: Floats, displacement: Floats) -> Integers:
    """Same elements with one node for those of a block that have one place and one displacement.

    Cells consist of parts whose nodes are copies of each other. Sides of a slit may part, and stay two.
    """
    _, number = np.unique(blocks, return_counts=True)
    # All blocks are divided evenly: none has copies.
    if int(((np.round(np.cbrt(number)) + 1) ** 3).sum()) == len(points) or len(elements) == 0:
        return elements
    owner = np.zeros(len(points), np.int64)
    owner[elements] = blocks[:, None]
    low = points.min(axis=0)
    step = max(_ONE * float((points.max(axis=0) - low).max()), np.finfo(float).tiny)
    places = np.round((points - low) / step).astype(np.int64)
    # Zero added turns -0 into 0.
    bits = np.ascontiguousarray(displacement + 0.0).view(np.int64)
    _, first, copy = np.unique(
        np.column_stack([owner, places, bits]), axis=0, return_index=True, return_inverse=True
    )
    shared: Integers = first[copy.reshape(-1)][elements]
    return shared


def _when(seen: Any) -> str:
    """Text with the stage of a state and its time, or its step in a relaxation, which takes no time."""
    if isinstance(seen, Frame):
        words, still, step = [seen.stage] if seen.stage else [], seen.still, seen.step
    else:
        # If the time step is 0, the simulation has not run in time, or has been relaxed since.
        still, step = not getattr(seen, "time_step", 1.0), getattr(seen, "steps", None)
        done = seen.summary.get("stages", [])
        # If further steps have followed, as in a run that calls this, the state is not the end of a stage.
        over = done and sum(stage["steps"] for stage in done) == step
        words = [done[-1]["name"]] if over and done[-1]["name"] else []
    if not still:
        words.append(f"t = {seen.time:.4g} s")
    elif step is not None:
        words.append(f"step {step}")
    return ", ".join(words)


def _recorded(frame: Frame, fields: Sequence[str]) -> Callable[[str], npt.NDArray[Any]]:
    return lambda name: frame.field(one_of("field", name, fields))


def _present(simulation: Simulation) -> Callable[[str], npt.NDArray[Any]]:
    def values(name: str) -> npt.NDArray[Any]:
        if name == "block":
            return simulation.element_block
        if name in (*NODAL, "stress"):
            return np.asarray(getattr(simulation, name))
        try:
            return simulation.field(name)
        except (ValueError, KeyError):
            nodal, elemental = getattr(simulation, "_fields", ((), ()))
            peaks = [peak for peak in PEAKS if peak in nodal or peak in elemental]
            one_of("field", name, (*NODAL, *ELEMENTAL, *peaks))
            raise

    return values


@dataclass
class Values:
    """Scalars of a picture with their place, label and unit."""

    scalars: Floats
    on_nodes: bool
    label: str
    unit: str  # empty if unknown


def values_of(
    frame: Scene, field: str | npt.ArrayLike, component: str | None, label: str | None
) -> Values:
    """Scalars of a field, given by its name or as an array of the user."""
    name = field if isinstance(field, str) else "values"
    if name in JOINTS and name not in frame.fields:
        raise ValueError(f"field: {name!r} is a field of the joints: use joints={name!r}")
    given = np.asarray(frame.values(field) if isinstance(field, str) else field)
    counts = (len(frame.points), len(frame.elements))
    if given.ndim not in (1, 2) or len(given) not in counts:
        raise ValueError(
            f"field: {name!r} has the shape {given.shape}; its first length must be "
            f"{counts[0]} (nodes) or {counts[1]} (elements)"
        )
    if not np.issubdtype(given.dtype, np.number) and given.dtype != np.bool_:
        raise ValueError(f"field: {name!r} must have numbers, found {given.dtype}")
    scalars, part = measure(given.astype(np.float64), component)
    words = f"{name} {part.replace('von_mises', 'von Mises')}".strip()
    if name in STRESSES:
        scalars[frame.rigid] = np.nan
    unit = UNITS.get(name, "")
    if label is not None:
        return Values(scalars, len(given) == counts[0], label, "")
    return Values(scalars, len(given) == counts[0], words + (f" ({unit})" if unit else ""), unit)


# Distance from the initial model beyond which a block is left outside, relative to the model's size.
_BEYOND = 0.5
# Largest part of the blocks that may be left outside, because the picture must show the model.
_FEW = 0.25


def outside(frame: Scene, scale: float) -> Integers:
    """Numbers of the blocks that are drawn far from the initial model; none if they are too many."""
    kept = ~frame.removed
    if not kept.any():
        return np.empty(0, np.int64)
    corners = frame.elements[kept]
    start = frame.points[corners].reshape(-1, 3)
    low, high = start.min(axis=0), start.max(axis=0)
    room = _BEYOND * float((high - low).max())
    middles = (frame.points + scale * frame.displacement)[corners].mean(axis=1)
    there = ((middles >= low - room) & (middles <= high + room)).all(axis=1)
    blocks = frame.blocks[kept]
    far = np.setdiff1d(blocks, blocks[there])
    return far if len(far) <= _FEW * len(np.unique(blocks)) else far[:0]


def measure(
    values: Floats, component: str | None, argument: str = "component"
) -> tuple[Floats, str]:
    """Scalar of each value, and its name.

    Parameters
    ----------
    values : (n,), (n, 1), (n, 3) or (n, 6) array
        Scalars, vectors, or stresses as xx yy zz xy yz zx.
    component : str or None
        For vectors ``"x"`` ``"y"`` ``"z"`` ``"magnitude"`` (default); for stresses ``"xx"`` …
        ``"zx"``, ``"von_mises"`` (default), or the principal stresses ``"s1"`` ≥ ``"s2"`` ≥
        ``"s3"``, tension positive.
    """
    width = 1 if values.ndim == 1 else values.shape[1]
    if width == 1:
        if component is not None:
            raise ValueError(
                f"{argument}: {component!r} is not possible: scalars have no components"
            )
        return values.reshape(-1), ""
    if width == 3:
        part = one_of(argument, component or "magnitude", (*VECTOR, "magnitude"))
        if part == "magnitude":
            return np.linalg.norm(values, axis=1), part
        return values[:, VECTOR.index(part)].copy(), part
    if width == 6:
        part = one_of(argument, component or "von_mises", (*TENSOR, "von_mises", "s1", "s2", "s3"))
        if part in TENSOR:
            return values[:, TENSOR.index(part)].copy(), part
        xx, yy, zz, xy, yz, zx = values.T
        if part == "von_mises":
            unequal = (xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2
            return np.sqrt(0.5 * unequal + 3.0 * (xy**2 + yz**2 + zx**2)), part
        full = np.stack([xx, xy, zx, xy, yy, yz, zx, yz, zz], axis=1).reshape(-1, 3, 3)
        return np.linalg.eigvalsh(full)[:, 3 - int(part[1])], part
    raise ValueError(f"field: {width} numbers per row, expected 1, 3 or 6")


def automatic_scale(points: Floats, displacement: Floats) -> float:
    """Magnification, 1, 2 or 5 × 10ⁿ, that shows the largest displacement as about 5 % of the model.

    It is 1 if displacements are already that large, or all zero.
    """
    most = float(np.linalg.norm(displacement, axis=1).max(initial=0.0))
    size = float(np.ptp(points, axis=0).max())
    # The last test is for displacements so small that the quotient overflows.
    if most == 0.0 or 0.05 * size <= most or not np.isfinite(size / most):
        return 1.0
    wanted = 0.05 * size / most
    power = 10.0 ** np.floor(np.log10(wanted))
    return float(min((1, 2, 5, 10), key=lambda m: abs(np.log(m * power / wanted))) * power)


def skin(elements: Integers) -> tuple[Integers, Integers]:
    """Outer faces of the blocks: their nodes (n, 4), counterclockwise from outside, and their elements."""
    faces = elements[:, _FACES].reshape(-1, 4)
    owner = np.repeat(np.arange(len(elements)), 6)
    # One diagonal identifies a face, and one number sorts faster than four.
    row, first = np.arange(len(faces)), faces.argmin(axis=1)
    key = faces[row, first] * (faces.max(initial=0) + 1) + faces[row, (first + 2) % 4]
    _, index, count = np.unique(key, return_index=True, return_counts=True)
    outer = np.sort(index[count == 1])
    return faces[outer], owner[outer]


# Most cells along the longest edge of the grid that finds neighbours.
_FINEST = 200


def neighbours(frame: Scene, fragments: Integers) -> Integers:
    """Neighbouring fragments at the start, two by two (n, 2), from the fragment of each element."""
    kept = np.flatnonzero(~frame.removed)
    corners = frame.points[frame.elements[kept]]
    blocks, one, block = np.unique(
        np.asarray(frame.values("block"), np.int64).reshape(-1)[kept],
        return_index=True,
        return_inverse=True,
    )
    low, high = np.full((len(blocks), 3), np.inf), np.full((len(blocks), 3), -np.inf)
    np.minimum.at(low, block.reshape(-1), corners.min(axis=1))
    np.maximum.at(high, block.reshape(-1), corners.max(axis=1))
    start = low.min(axis=0)
    size = high.max(axis=0) - start
    # Cells slightly smaller than the smallest block: each block has at least one, and joints have none.
    edge = max(0.9 * float((high - low).min()), float(size.max()) / _FINEST)
    grid = np.full(np.ceil(size / edge).astype(int) + 1, -1, np.int64)
    first = np.floor((low - start) / edge).astype(int)
    last = np.floor((high - start) / edge).astype(int)
    for number, at, to in zip(fragments[kept][one], first, last):
        grid[at[0] : to[0] + 1, at[1] : to[1] + 1, at[2] : to[2] + 1] = number
    pairs = []
    for axis in range(3):
        a, b = (np.moveaxis(grid, axis, 0)[part] for part in (slice(None, -1), slice(1, None)))
        meet = (a != b) & (a >= 0) & (b >= 0)
        pairs.append(np.stack([a[meet], b[meet]], axis=1))
    both = np.sort(np.concatenate(pairs), axis=1)
    return np.unique(both, axis=0)


def apart(frame: Scene, fragments: Integers, colours: int) -> Integers:
    """Colour of each fragment, by its number: 0 for the first, which is the largest.

    The others have 1 to `colours`: neighbours differ, and all colours are used about equally often.
    """
    around: dict[int, list[int]] = {}
    for a, b in neighbours(frame, fragments).tolist():
        # Only neighbours with lower numbers have a colour already.
        around.setdefault(b, []).append(a)
    chosen = np.zeros(int(fragments.max(initial=0)) + 1, np.int64)
    used = np.zeros(colours + 1)
    for number in range(1, len(chosen)):
        near = np.bincount(chosen[around.get(number, [])], minlength=colours + 1)[1:]
        # The colour of the fewest neighbours: there may be more neighbours than colours.
        colour = int(np.lexsort((used[1:], near))[0]) + 1
        chosen[number] = colour
        used[colour] += 1
    return chosen


def lines_of(points: Floats, faces: Integers, every: bool) -> Integers:
    """Ends (n, 2) of the lines to draw: edges at which faces meet at more than 30°, or `every` edge."""
    normals = np.cross(
        points[faces[:, 2]] - points[faces[:, 0]], points[faces[:, 3]] - points[faces[:, 1]]
    )
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), np.finfo(float).tiny)
    edges = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    key = edges[:, 0] * (faces.max(initial=0) + 1) + edges[:, 1]
    order = np.argsort(key, kind="stable")
    edges, key, face = edges[order], key[order], order // 4
    twin = key[1:] == key[:-1]
    keep = np.ones(len(key), bool)
    keep[1:][twin] = False
    if not every:
        level = (normals[face[1:]] * normals[face[:-1]]).sum(axis=1) > np.cos(np.radians(30.0))
        keep[:-1][twin & level] = False
    return edges[keep]


def quarters(corners: Floats) -> tuple[Floats, Integers]:
    """Divide each quadrilateral (n, 4, 3) into four, one per corner: points (9 n, 3), cells (4 n, 4).

    Values of a joint are values of its pairs. Half of an element may have failed: colours
    interpolated between the corners would show states that no pair has.
    """
    middles = 0.5 * (corners + np.roll(corners, -1, axis=1))
    centre = corners.mean(axis=1, keepdims=True)
    points = np.concatenate([corners, middles, centre], axis=1).reshape(-1, 3)
    cells = np.array([[0, 4, 8, 7], [1, 5, 8, 4], [2, 6, 8, 5], [3, 7, 8, 6]])
    return points, (9 * np.arange(len(corners))[:, None, None] + cells).reshape(-1, 4)

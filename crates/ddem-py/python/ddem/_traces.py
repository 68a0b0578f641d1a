"""Lines on the outer faces of the model: traces of joints, and edges of moving blocks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ._layers import INK, STATES, Layer, pairs_by_state, states
from ._scene import Floats, Integers, Scene, lines_of, skin

# Width of the traces of bonded joints and of others, in pixels of a picture of 1200 × 900.
_HOLDS, _FAILED = 3.5, 5.5
# Opacity of the traces of bonded joints if faces of joints are drawn, too.
_FAINT = 0.35
# Largest distance from the centre of a joint element to the centres of the faces on its sides, and largest relative
# displacement of these faces before the joint has separated. Both are parts of the shortest edge of the element.
_BESIDE, _PARTED = 0.35, 0.5
# Marks of a joint element without faces on its sides: they do not match, or have separated.
_ALONE, _GONE = -1, -2
MOVING = "#d6006c"


def traces(frame: Scene, scale: float, alone: bool) -> list[Layer]:
    """Traces of joints on the outer faces of the model, a layer for each state.

    The width of a line does not depend on the thickness of its joint. If `alone` is true, the lines
    have a legend; otherwise lines of bonded joints are faint. The lines lie on the edges of the
    blocks on both sides, so that they are also seen in views along the joints.
    """
    if len(frame.quads) == 0:
        raise ValueError("joints: the model has no joints")
    state, moved = states(frame), frame.points + scale * frame.displacement
    found = _found(frame)
    parts = [(moved[found.ends], state[found.pairs])]
    # Nonconforming joints: the rims, at their own positions.
    if len(found.alone):
        drawn = np.asarray(frame.pairs["point"], np.float64) + scale * np.asarray(
            frame.pairs["displacement"], np.float64
        )
        parts.append((drawn[found.alone], state[found.alone]))
    return _layers_of(parts, state, pairs_by_state(frame), alone)


@dataclass
class _Found:
    """Edges at which joints meet the outer faces of the model."""

    ends: Integers  # (n, 2) nodes: edges of blocks
    pairs: Integers  # (n, 2) pairs at these nodes
    faces: Integers  # (k, 2, 4) nodes of the faces on both sides of joint elements
    blocks: Integers  # (k, 2) blocks of these faces
    alone: Integers  # (m, 2) pairs: rims of nonconforming joints


def _found(frame: Scene) -> _Found:
    quads = frame.quads
    if "removed" in frame.pair_fields:
        gone = np.asarray(frame.pairs["removed"]).reshape(-1) != 0
        quads = quads[~gone[quads].any(axis=1)]
    rim = _rim(quads)
    outer = rim.any(axis=1)
    quads, rim = quads[outer], rim[outer]
    edges = np.stack([quads, np.roll(quads, -1, axis=1)], axis=2)
    kept = np.flatnonzero(~frame.removed)
    faces, owners = skin(frame.elements[kept])
    blocks = frame.blocks[kept[owners]]
    sides = _sides(frame, quads, faces, blocks)
    ends, pairs = _outer_edges(frame, quads, faces, sides)
    # The face beside one at the rim may be at an inner element of the same joint, left out above: keep the rim only.
    rims, count = np.sort(edges[rim], axis=1), len(frame.pairs["point"])
    at_rim = np.isin(np.sort(pairs, axis=1) @ [count, 1], rims @ [count, 1])
    mates = sides[sides[:, 0] >= 0]
    alone = edges[rim & (sides[:, :1] == _ALONE)]
    return _Found(ends[at_rim], pairs[at_rim], faces[mates], blocks[mates], alone)


def _layers_of(
    parts: list[tuple[Floats, Integers]], state: Integers, numbers: Integers, alone: bool
) -> list[Layer]:
    """Layers of the traces. Each half of a line has the state of the pair at its end."""
    ends = np.concatenate([ends for ends, _ in parts])
    of_ends = np.concatenate([of_ends for _, of_ends in parts]).reshape(-1)
    middles = np.repeat(ends.mean(axis=1, keepdims=True), 2, axis=1)
    halves = np.stack([ends, middles], axis=2).reshape(-1, 2, 3)
    layers = []
    for number, (title, colour) in enumerate(STATES):
        if not numbers[number]:
            continue
        points = halves[of_ends == number].reshape(-1, 3)
        colour = colour if number else INK
        opacity = 1.0 if number or alone else _FAINT
        cells = np.arange(len(points)).reshape(-1, 2)
        layer = Layer(f"{title}, traces", points, cells, opacity, colour)
        layer.width = _FAILED if number else _HOLDS
        if alone:
            layer.legend = f"{title} ({numbers[number]})"
        layers.append(layer)
    return layers


def _rim(quads: Integers) -> npt.NDArray[np.bool_]:
    """Mask of the edges of each joint element that belong to no other element, (n, 4)."""
    edges = np.sort(np.stack([quads, np.roll(quads, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    _, number, count = np.unique(edges, axis=0, return_inverse=True, return_counts=True)
    rim: npt.NDArray[np.bool_] = (count[number.reshape(-1)] == 1).reshape(-1, 4)
    return rim


def _sides(frame: Scene, quads: Integers, faces: Integers, blocks: Integers) -> Integers:
    """Faces of blocks on both sides of each joint element (n, 2), or `_ALONE` or `_GONE`."""
    from pyvista import convert_array
    from vtkmodules.vtkCommonCore import vtkIdList, vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkPolyData, vtkStaticPointLocator

    corners = np.asarray(frame.pairs["point"], np.float64)[quads]
    middles = corners.mean(axis=1)
    centres = np.ascontiguousarray(frame.points[faces].mean(axis=1))
    points, cloud, locator = vtkPoints(), vtkPolyData(), vtkStaticPointLocator()
    points.SetData(convert_array(centres))
    cloud.SetPoints(points)
    locator.SetDataSet(cloud)
    locator.BuildLocator()
    found, near = np.full((len(quads), 2), -1), vtkIdList()
    for row, middle in enumerate(middles):
        locator.FindClosestNPoints(2, middle, near)
        if near.GetNumberOfIds() == 2:
            found[row] = near.GetId(0), near.GetId(1)
    reach = _BESIDE * np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).min(axis=1)
    off = np.linalg.norm(centres[found] - middles[:, None], axis=2).max(axis=1)
    other = blocks[found[:, 0]] != blocks[found[:, 1]]
    # If the sides have separated there is no joint any more.
    means = frame.displacement[faces].mean(axis=1)[found]
    apart = np.linalg.norm(means[:, 0] - means[:, 1], axis=1)
    found[apart > _PARTED / _BESIDE * reach] = _GONE
    found[~((off <= reach) & other)] = _ALONE
    return found


def _outer_edges(
    frame: Scene, quads: Integers, faces: Integers, sides: Integers
) -> tuple[Integers, Integers]:
    """Edges between a face at a joint and a face that is not: nodes and pairs at their ends, each
    (n, 2)."""
    quad = np.full(len(faces), -1)
    matched = sides[:, 0] >= 0
    quad[sides[matched].reshape(-1)] = np.repeat(np.flatnonzero(matched), 2)
    ends = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)
    face = np.arange(len(ends)) // 4
    key = np.sort(ends, axis=1)
    order = np.lexsort((key[:, 1], key[:, 0]))
    twins = np.flatnonzero((key[order[1:]] == key[order[:-1]]).all(axis=1))
    two = np.stack([order[twins], order[twins + 1]], axis=1)
    at_joint = quad[face[two]] >= 0
    edge = two[at_joint[:, 0] != at_joint[:, 1]][at_joint[at_joint[:, 0] != at_joint[:, 1]]]
    own = quads[quad[face[edge]]]
    corners = np.asarray(frame.pairs["point"], np.float64)[own]
    off = np.linalg.norm(frame.points[ends[edge]][:, :, None] - corners[:, None], axis=3)
    pairs = np.take_along_axis(own, off.argmin(axis=2), axis=1)
    return ends[edge], pairs


def moving(frame: Scene, blocks: Integers, scale: float) -> Layer:
    """Edges of the moving blocks of a run that fails, without edges at joints between two of them."""
    these = np.isin(frame.blocks, blocks) & ~frame.removed
    faces, _ = skin(frame.elements[these])
    edges = lines_of(frame.points, faces, False)
    if len(frame.quads):
        found = _found(frame)
        mates = found.faces[np.isin(found.blocks, blocks).all(axis=1)].reshape(-1, 4)
        inside = np.sort(np.stack([mates, np.roll(mates, -1, axis=1)], axis=2), axis=2)
        count = len(frame.points)
        edges = edges[~np.isin(edges @ [count, 1], inside @ [count, 1])]
    ends, lines = np.unique(edges, return_inverse=True)
    points = (frame.points + scale * frame.displacement)[ends]
    layer = Layer("moving", points, lines.reshape(-1, 2), 1.0, MOVING, width=_FAILED)
    number = len(np.unique(frame.blocks[these]))
    layer.legend = f"moving: {number} block{'s' if number > 1 else ''}"
    return layer

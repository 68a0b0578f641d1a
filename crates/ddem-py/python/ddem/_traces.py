"""Lines on the outside of the model: traces of joints, and edges of blocks that move."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ._layers import INK, STATES, Layer, pairs_by_state, states
from ._scene import Floats, Frame, Integers, lines_of, skin

# Of traces that hold and of others, in pixels of a picture of 1200 × 900.
_HOLDS, _FAILED = 3.5, 5.5
# Among the faces of joints those that hold are seen through.
_FAINT = 0.35
# How far the middle of a joint element may be from those of the faces on its sides, and how far these
# may have moved apart before the joint is no more than two faces: parts of the edge of an element.
_BESIDE, _PARTED = 0.35, 0.5
# Why an element of a joint has no faces on its sides: they do not match, or have parted.
_ALONE, _GONE = -1, -2
MOVING = "#d6006c"


def traces(frame: Frame, scale: float, alone: bool) -> list[Layer]:
    """Lines where joints come to the outside, a layer for each state; lines have one width,
    however thick the joints are. `alone` they have a legend, otherwise those that hold are faint.

    They lie on the edges of the blocks on both sides, so that they are seen along the joints.
    """
    if len(frame.quads) == 0:
        raise ValueError("joints: the model has no joints")
    state, moved = states(frame), frame.points + scale * frame.displacement
    found = _found(frame)
    parts = [(moved[found.ends], state[found.pairs])]
    # Faces that do not match: the rims of their joints, wherever they are.
    if len(found.alone):
        drawn = np.asarray(frame.pairs["point"], np.float64) + scale * np.asarray(
            frame.pairs["displacement"], np.float64
        )
        parts.append((drawn[found.alone], state[found.alone]))
    return _layers_of(parts, state, pairs_by_state(frame), alone)


@dataclass
class _Found:
    """Edges at which joints come to the outside."""

    ends: Integers  # (n, 2) nodes: edges of blocks
    pairs: Integers  # (n, 2) pairs at these
    faces: Integers  # (k, 2, 4) nodes of the faces on both sides of elements of joints
    blocks: Integers  # (k, 2) and their blocks
    alone: Integers  # (m, 2) pairs: rims of joints between faces that do not match


def _found(frame: Frame) -> _Found:
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
    # Beside a face at the rim of a joint there may be one of the same joint, not looked for above.
    rims, count = np.sort(edges[rim], axis=1), len(frame.pairs["point"])
    at_rim = np.isin(np.sort(pairs, axis=1) @ [count, 1], rims @ [count, 1])
    mates = sides[sides[:, 0] >= 0]
    alone = edges[rim & (sides[:, :1] == _ALONE)]
    return _Found(ends[at_rim], pairs[at_rim], faces[mates], blocks[mates], alone)


def _layers_of(
    parts: list[tuple[Floats, Integers]], state: Integers, numbers: Integers, alone: bool
) -> list[Layer]:
    """Half of each line has the state of the pair at its end."""
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
    """Mask of the edges of each element of a joint that belong to no other, (n, 4)."""
    edges = np.sort(np.stack([quads, np.roll(quads, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    _, number, count = np.unique(edges, axis=0, return_inverse=True, return_counts=True)
    rim: npt.NDArray[np.bool_] = (count[number.reshape(-1)] == 1).reshape(-1, 4)
    return rim


def _sides(frame: Frame, quads: Integers, faces: Integers, blocks: Integers) -> Integers:
    """Faces of blocks on both sides of elements of joints (n, 2), or why there are none."""
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
    # Where the sides have parted there is no joint any more.
    means = frame.displacement[faces].mean(axis=1)[found]
    apart = np.linalg.norm(means[:, 0] - means[:, 1], axis=1)
    found[apart > _PARTED / _BESIDE * reach] = _GONE
    found[~((off <= reach) & other)] = _ALONE
    return found


def _outer_edges(
    frame: Frame, quads: Integers, faces: Integers, sides: Integers
) -> tuple[Integers, Integers]:
    """Edges between faces that are at a joint and those that are not: nodes and pairs at their
    ends, each (n, 2)."""
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


def moving(frame: Frame, blocks: Integers, scale: float) -> Layer:
    """Edges of the blocks that move where a run fails, without those at which they keep together."""
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

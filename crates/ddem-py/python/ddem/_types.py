"""Types of arguments, for type checkers."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal, TypeAlias, TypedDict, Union

import numpy as np
import numpy.typing as npt

Floats: TypeAlias = npt.NDArray[np.float64]
Integers: TypeAlias = npt.NDArray[np.int64]
Vector: TypeAlias = Union[Sequence[float], npt.NDArray[Any]]
#: Coordinate of a plane, or (from, to).
Extent: TypeAlias = Union[float, Sequence[float]]
History: TypeAlias = Union[
    Callable[[float], float], Mapping[str, Any], Sequence[Sequence[float]], npt.NDArray[Any]
]
Damping: TypeAlias = Union[float, Literal["none"], Mapping[str, float]]
Path: TypeAlias = Union[str, "os.PathLike[str]"]


class Sphere(TypedDict):
    """Inside of a sphere."""

    # entries: Sphere
    centre: Vector
    radius: float
    # end


#: Inside of a cylinder.
# dictionary: Cylinder
Cylinder = TypedDict("Cylinder", {"from": Vector, "to": Vector, "radius": float})
# end


class Plane(TypedDict, total=False):
    """Plane: a point, and a normal or a dip with its direction."""

    # entries: Plane
    point: Vector
    normal: Vector
    dip: float
    dip_direction: float
    # end


class Topography(TypedDict):
    """File of heights."""

    topography: Path


#: Surface of `above` and `below`: a level z, a plane or a file of heights.
Sheet: TypeAlias = Union[float, Plane, Topography]


class Place(TypedDict, total=False):
    """Keys that select cells: ranges and shapes."""

    # entries: Where only x y z sphere cylinder above below inside
    x: Extent
    y: Extent
    z: Extent
    sphere: Sphere
    cylinder: Cylinder
    above: Sheet
    below: Sheet
    inside: Path
    # end


class Where(Place, total=False):
    """Keys that select a part of a model: planes, ranges, shapes, orientations, a set of blocks or its side."""

    # entries: Where only plane side dip dip_direction within cut set
    plane: Plane
    side: Literal["x-", "x+", "y-", "y+", "z-", "z+"]
    dip: float
    dip_direction: float
    within: float
    cut: str
    set: str
    # end


class When(Where, total=False):
    """Keys that select a part of a model, and the stages in which an entry is in force."""

    # entries: Fix only from until
    from_: str
    until: str
    # end

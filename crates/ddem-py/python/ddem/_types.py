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
#: A plane, or from and to.
Extent: TypeAlias = Union[float, Sequence[float]]
History: TypeAlias = Union[
    Callable[[float], float], Mapping[str, Any], Sequence[Sequence[float]], npt.NDArray[Any]
]
Damping: TypeAlias = Union[float, Literal["none"], Mapping[str, float]]
Path: TypeAlias = Union[str, "os.PathLike[str]"]


class Sphere(TypedDict):
    """Inside a sphere."""

    centre: Vector
    radius: float


#: Inside a cylinder.
Cylinder = TypedDict("Cylinder", {"from": Vector, "to": Vector, "radius": float})


class Plane(TypedDict, total=False):
    """A plane: a point, and a normal or a dip with its direction."""

    point: Vector
    normal: Vector
    dip: float
    dip_direction: float


class Topography(TypedDict):
    """A file of heights."""

    topography: Path


#: What parts above from below: a level z, a plane, heights.
Sheet: TypeAlias = Union[float, Plane, Topography]


class Where(TypedDict, total=False):
    """Part of a model: planes and ranges, shapes, a side or the whole of a set of blocks."""

    x: Extent
    y: Extent
    z: Extent
    sphere: Sphere
    cylinder: Cylinder
    plane: Plane
    above: Sheet
    below: Sheet
    inside: Path
    side: Literal["x-", "x+", "y-", "y+", "z-", "z+"]
    dip: float
    dip_direction: float
    within: float
    set: str


class When(Where, total=False):
    """Part of a model, and the stages in which something is in force."""

    from_: str
    until: str

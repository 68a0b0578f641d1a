"""Stereonets: orientations of the planes that cut the rock."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ._cells import Cells
from ._ddem import Model
from ._layers import INK
from ._names import one_of
from ._rock import cells_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Floats = npt.NDArray[np.float64]

_COLOURS = ("#1f6fb4", "#d9480f", "#2b8a3e", "#862e9c", "#c29d0b", "#0b7285", "#a61e4d", "#5c5f66")


def normals_of(dip: npt.ArrayLike, dip_direction: npt.ArrayLike) -> Floats:
    """Upward unit normals (n, 3) of planes, with x to the east and y to the north."""
    d, b = np.radians(np.atleast_1d(dip)), np.radians(np.atleast_1d(dip_direction))
    return np.stack([np.sin(d) * np.sin(b), np.sin(d) * np.cos(b), np.cos(d)], axis=-1)


def project(directions: Floats) -> Floats:
    """Places (n, 2) of directions (n, 3) in Lambert's equal-area projection of the lower hemisphere.

    x is to the east and y to the north. The horizontal is the circle of radius 1.
    """
    down = np.where(directions[:, 2:] > 0.0, -directions, directions)
    # √2 sin(θ/2) with the angle θ from straight down is √(1 + z).
    share = 1.0 / np.sqrt(np.maximum(1.0 - down[:, 2:], 1.0))
    placed: Floats = down[:, :2] * share
    return placed


def great_circle(normal: Floats, n: int = 181) -> Floats:
    """Places (n, 2) of the great circle of a plane, from one end on the horizontal to the other."""
    level = np.array([-normal[1], normal[0], 0.0])
    length = float(np.linalg.norm(level))
    along = level / length if length > 1e-12 else np.array([1.0, 0.0, 0.0])
    down = np.cross(normal, along)
    down = -down if down[2] > 0.0 else down
    angle = np.linspace(0.0, np.pi, n)[:, None]
    places: Floats = project(np.cos(angle) * along + np.sin(angle) * down)
    # A direction in the horizontal stays at its end.
    places[0], places[-1] = along[:2], -along[:2]
    return places


def mean_normal(normals: Floats, weights: Floats) -> Floats:
    """Axis (3,), upward, about which the normals scatter least: both ends of a normal count the same."""
    tensor = (normals * weights[:, None]).T @ normals
    axis: Floats = np.linalg.eigh(tensor)[1][:, -1]
    return axis if axis[2] >= 0.0 else -axis


def plot_stereonet(
    cells: Model | Cells,
    *,
    cuts: str | Sequence[str] | None = None,
    circles: bool = True,
    slope: tuple[float, float] | None = None,
    file: str | os.PathLike[str] | None = None,
) -> Figure:
    """Draw the poles of the planes that cut the rock: equal area, lower hemisphere.

    Parameters
    ----------
    cells : Model or Cells
        Model with regions, or what :meth:`Model.cells` returns, which need not be cut again.
    cuts : str or list of str, optional
        Names of the cuts to draw. By default all that make joints.
    circles : bool, optional
        If True (default), draw the great circle of the mean plane of each cut.
    slope : (float, float), optional
        Dip and dip direction of a slope (degrees), whose great circle is drawn, too.
    file : str or os.PathLike, optional
        Image file to write, in any format of matplotlib.

    Returns
    -------
    matplotlib.figure.Figure
        Figure with the pole of each plane, and by name the mean plane of each cut as dip/dip direction.
        Directions count from `north` of the first region.

    Raises
    ------
    ModelError
        If the model has no regions, or cannot be cut.
    ValueError
        If a name is unknown, or no plane is left.
    ImportError
        If matplotlib is not installed: ``pip install "ddem[plot]"``.

    Examples
    --------
    >>> ddem.plot_stereonet(model, slope=(70, 156), file="stereonet.png")
    """
    try:
        import matplotlib.pyplot as plt
    except ImportError as missing:
        raise ImportError('plots need matplotlib: pip install "ddem[plot]"') from missing
    rock = cells_of(cells)
    planes, names = rock.planes, _names(rock, cuts)
    figure, axes = plt.subplots(figsize=(8.0, 6.0), layout="constrained")
    _net(axes)
    for number, name in enumerate(names):
        own = planes[planes["cut"] == name]
        colour = _COLOURS[number % len(_COLOURS)]
        normals = normals_of(own["dip"], own["dip_direction"])
        mean = mean_normal(normals, np.ones(len(own)))
        poles = project(normals)
        axes.plot(*poles.T, "o", color=colour, markersize=4, alpha=0.7, label=f"{name} {_shown(mean)}", zorder=3)
        if circles:
            axes.plot(*great_circle(mean).T, color=colour, linewidth=1.2, zorder=2)
    if slope is not None:
        normal = normals_of(*slope)[0]
        axes.plot(*great_circle(normal).T, color=INK, linewidth=2.0, label=f"slope {_shown(normal)}", zorder=4)
    figure.legend(loc="outside right upper", frameon=False)
    if rock.title:
        axes.set_title(rock.title, loc="left")
    if file is not None:
        figure.savefig(os.fspath(file), dpi=150)
    return figure


def _names(rock: Cells, cuts: str | Sequence[str] | None) -> list[str]:
    """Names of the cuts to draw, in their order."""
    known = list(dict.fromkeys(rock.planes["cut"].tolist()))
    if cuts is None:
        joined = rock.planes["joined"]
        names = [name for name in known if not joined[rock.planes["cut"] == name].all()]
    else:
        names = [cuts] if isinstance(cuts, str) else list(cuts)
        names = [one_of("cuts", name, known) for name in names]
    if not names:
        raise ValueError("cuts: there are no planes to draw")
    return names


def _shown(normal: Floats) -> str:
    """Dip and dip direction of a plane with this upward normal."""
    dip = np.degrees(np.arctan2(np.hypot(normal[0], normal[1]), normal[2]))
    direction = np.degrees(np.arctan2(normal[0], normal[1])) % 360.0
    return f"{dip:.0f}/{direction % 359.9999:03.0f}"


def _net(axes: Any) -> None:
    """Frame of the net: the horizontal, its directions, and its centre."""
    angle = np.linspace(0.0, 2.0 * np.pi, 361)
    axes.plot(np.sin(angle), np.cos(angle), color=INK, linewidth=1.2, zorder=5)
    axes.plot([0.0], [0.0], "+", color=INK, markersize=7)
    for degrees in range(0, 360, 10):
        east, north = np.sin(np.radians(degrees)), np.cos(np.radians(degrees))
        inner = 0.97 if degrees % 90 else 0.94
        axes.plot([inner * east, east], [inner * north, north], color=INK, linewidth=0.8)
        if degrees % 90 == 0:
            text = "N E S W".split()[degrees // 90]
            axes.text(1.06 * east, 1.06 * north, text, ha="center", va="center", color=INK)
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_xlim(-1.12, 1.12)
    axes.set_ylim(-1.12, 1.12)

"""Layers of a picture, which PyVista or a page draws."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ._names import STRESSES, UNITS, one_of
from ._scene import (
    Floats,
    Integers,
    Scene,
    apart,
    lines_of,
    measure,
    outside,
    quarters,
    skin,
    values_of,
)
from ._units import prefix

INK, PLAIN = "#1f2933", "#aab4be"
# States of joints and their colours. The last state is that of failed joints which are open now, and of joints which
# contacts have replaced.
STATES = (
    ("bonded", "#8a94a0"),
    ("failed in shear", "#1f6fb4"),
    ("failed in tension", "#c0392b"),
    ("open or released", "#f08c00"),
)
# Colours of the largest fragment and of the others.
FRAGMENTS = (
    "#d9480f",
    "#a6cee3",
    "#b2df8a",
    "#cab2d6",
    "#ffe08a",
    "#5b9bd0",
    "#66b08a",
    "#8d7ab8",
    "#d8c3a5",
    "#9aa5b1",
    "#7fcdbb",
    "#f3c6d8",
)
OPEN = 3
# Opacity of bonded joints: they can be seen, but many of them do not hide the parts behind.
HOLDING = 0.04
# Part of its strength that a colour keeps below dark lines.
_PALE = 0.6
# Half the thickness of the bar of the largest contact force, relative to the median length of the bars.
THICK = 0.22
# Faces of a bar: four sides and two ends.
_SIDES = np.array(
    [[0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7], [3, 2, 1, 0], [4, 5, 6, 7]]
)


@dataclass
class ColourBar:
    """Meaning of the colours of a layer."""

    label: str
    cmap: Any
    clim: tuple[float, float]
    # SI unit in the label; empty if the numbers are not scaled.
    unit: str = ""
    # False if the colours only distinguish parts.
    shown: bool = True
    # The value, if all values are equal: the only number beside the bar.
    only: float | None = None

    @property
    def scale(self) -> tuple[float, str]:
        """Divisor of the numbers beside the bar, and the prefix of their unit."""
        largest = max(map(abs, self.clim)) if self.only is None else abs(self.only)
        return prefix(largest, self.unit)

    @property
    def title(self) -> str:
        """Label with the unit of the numbers beside the bar."""
        whole = f"({self.unit})"
        if not self.unit or not self.label.endswith(whole):
            return self.label
        return f"{self.label.removesuffix(whole)}({self.scale[1]}{self.unit})"


@dataclass
class Layer:
    """Faces (n, 4) or lines (n, 2) of one kind, in one colour or in the colours of a bar."""

    name: str
    points: Floats  # (m, 3) m, drawn positions
    cells: Integers
    opacity: float
    colour: str
    values: Floats | None = None  # of points or cells
    on_points: bool = False
    bar: ColourBar | None = None
    legend: str | None = None
    nodes: Integers | None = None  # node of the model at each point
    owners: Integers | None = None  # element of each cell
    width: float = 1.2  # of lines, in pixels of a picture of 1200 × 900
    far: npt.NDArray[np.bool_] | None = None  # mask of the points outside the picture
    beyond: str = ""  # text on the largest value there, if outside the range of the bar


def blocks(
    frame: Scene,
    field: str | npt.ArrayLike | None,
    component: str | None,
    label: str | None,
    bar: tuple[Any, tuple[float, float] | None],
    scale: float,
    edges: str,
    opacity: float,
) -> list[Layer]:
    """Layers of the blocks at their present positions: outer faces and lines."""
    kept = np.flatnonzero(~frame.removed)
    faces, owners = skin(frame.elements[kept])
    owners = kept[owners]
    nodes, cells = np.unique(faces, return_inverse=True)
    points = (frame.points + scale * frame.displacement)[nodes]
    layer = Layer("blocks", points, cells.reshape(-1, 4), opacity, PLAIN)
    layer.nodes, layer.owners = nodes, owners
    layer.far = far_points(frame, layer, scale)
    if field is not None:
        values = values_of(frame, field, component, label)
        layer.on_points = values.on_nodes
        layer.values = values.scalars[nodes if values.on_nodes else owners]
        far = layer.far if values.on_nodes else layer.far[layer.cells].any(axis=1)
        layer.bar = bar_of(values.label, layer.values[~far], *bar, unit=values.unit)
        layer.beyond = _beyond(layer.bar, layer.values[far])
        if not np.isfinite(layer.values).any():
            layer.values, layer.bar, layer.legend = None, None, f"{values.label}: no values"
        if isinstance(field, str) and field in STRESSES:
            _without_stress(frame, layer)
        if isinstance(field, str) and (field, bar, label) == ("fragment", (None, None), None):
            _tell_apart(frame, layer, values.scalars)
    if edges == "none":
        return [layer]
    # From the reference positions: a bent block keeps its edges.
    lines = lines_of(frame.points, faces, edges == "elements")
    ends, lines = np.unique(lines, return_inverse=True)
    drawn = (frame.points + scale * frame.displacement)[ends]
    faint = 1.0 if opacity == 1.0 else 0.45
    return [layer, Layer("edges", drawn, lines.reshape(-1, 2), faint, INK, nodes=ends)]


def far_points(frame: Scene, layer: Layer, scale: float) -> npt.NDArray[np.bool_]:
    """Mask of the points of the blocks that are left outside the picture."""
    far = outside(frame, scale)
    if len(far) == 0:
        return np.zeros(len(layer.points), np.bool_)
    marked: npt.NDArray[np.bool_] = np.isin(np.asarray(layer.nodes), frame.elements[np.isin(frame.blocks, far)])
    return marked


def _beyond(bar: ColourBar, values: Floats) -> str:
    """Text on the largest magnitude, if values are outside the range of the bar; otherwise empty."""
    finite = values[np.isfinite(values)]
    low, high = bar.clim if bar.only is None else (bar.only, bar.only)
    if len(finite) == 0 or (low <= finite.min() and finite.max() <= high):
        return ""
    largest = float(finite[np.abs(finite).argmax()])
    factor, name = prefix(abs(largest), bar.unit)
    label = bar.label.removesuffix(f"({bar.unit})").strip()
    return f"{label} up to {largest / factor:.3g} {name}{bar.unit}".strip()


def _without_stress(frame: Scene, layer: Layer) -> None:
    """State in the legend that rigid blocks have no stress; drop the colours if all blocks are rigid."""
    rigid = frame.rigid & ~frame.removed
    if rigid.any():
        number = len(np.unique(frame.blocks[rigid]))
        layer.legend = f"rigid, no stress ({number} block{'s' if number > 1 else ''})"
    if rigid[~frame.removed].all():
        layer.values, layer.bar = None, None


def _tell_apart(frame: Scene, layer: Layer, fragments: Floats) -> None:
    """Colour the fragments: neighbours differently, and the largest in a colour of its own."""
    number = fragments.astype(np.int64)
    there = number[~frame.removed]
    colour = apart(frame, number, len(FRAGMENTS) - 1)
    layer.values = colour[np.asarray(layer.values, np.int64)].astype(np.float64)
    layer.colour = FRAGMENTS[0]
    layer.legend = f"the largest of {len(np.unique(there))} fragments"
    if there.max(initial=0) == 0:
        layer.legend = "one fragment"
    layer.bar = ColourBar(
        "colour of the fragment", listed(FRAGMENTS), (-0.5, len(FRAGMENTS) - 0.5), shown=False
    )


def joints(
    frame: Scene,
    name: str,
    component: str | None,
    bar: tuple[Any, tuple[float, float] | None],
    scale: float,
) -> list[Layer]:
    """Layers of joint elements at their present positions: a colour per state, or a field of the joints."""
    if len(frame.quads) == 0:
        raise ValueError("joints: the model has no joints")
    pairs, quads = frame.pairs, frame.quads
    if "removed" in frame.pair_fields:
        quads = quads[~(np.asarray(pairs["removed"]).reshape(-1)[quads] != 0).any(axis=1)]
    state, numbers = states(frame), pairs_by_state(frame)
    if name not in ("slip", "traction") and component is not None:
        raise ValueError(f"joint_component: {name!r} has no components")
    moved = np.asarray(pairs["point"]) + scale * np.asarray(pairs["displacement"], np.float64)
    points, cells = quarters(moved[quads])
    of_cells = state[quads].reshape(-1)

    def part(title: str, which: npt.NDArray[np.bool_], opacity: float, colour: str) -> Layer:
        used, at = np.unique(cells[which], return_inverse=True)
        return Layer(title, points[used], at.reshape(-1, 4), opacity, colour)

    layers = []
    if name == "state":
        for number, (title, colour) in enumerate(STATES):
            if number == OPEN and not (state == OPEN).any():
                continue
            opacity = 1.0 if number else HOLDING
            layers.append(part(title, of_cells == number, opacity, colour))
            layers[-1].legend = f"{title} ({numbers[number]})"
        return layers
    values, words = measure(np.asarray(pairs[name], np.float64), component, "joint_component")
    shown = np.ones(len(of_cells), bool) if name == "traction" else of_cells > 0
    title = f"{name} {words}".strip() + (f" ({UNITS[name]})" if name in UNITS else "")
    layer = part("joints", shown, 1.0, PLAIN)
    layer.values = values[quads].reshape(-1)[shown]
    unit = UNITS.get(name, "")
    layer.bar = bar_of(title.replace("_", " "), layer.values, *bar, plain="plasma", unit=unit)
    if name == "traction":
        return [layer]
    bonded = part("bonded", ~shown, HOLDING, STATES[0][1])
    bonded.legend = f"bonded ({numbers[0]})"
    if not shown.any():
        layer.bar = None
    return [bonded, layer]


def states(frame: Scene) -> Integers:
    """State of each pair, as an index of :data:`STATES`."""
    pairs = frame.pairs
    state = np.asarray(pairs["state"]).astype(np.int64)
    if "open" in frame.pair_fields:
        state[(state > 0) & (np.asarray(pairs["open"]) != 0)] = OPEN
    if "released" in frame.pair_fields:
        state[np.asarray(pairs["released"]) != 0] = OPEN
    return state


def pairs_by_state(frame: Scene) -> Integers:
    """Number of pairs in each state, without pairs of removed blocks."""
    state = states(frame)
    if "removed" in frame.pair_fields:
        state = state[np.asarray(frame.pairs["removed"]).reshape(-1) == 0]
    return np.bincount(state, minlength=len(STATES))


def contacts(frame: Scene, bar: tuple[Any, tuple[float, float] | None]) -> list[Layer]:
    """Force between each two blocks: a bar along the force, with a thickness proportional to it."""
    # A dashpot may cancel the force of the contact spring; an empty frame has no arrays.
    force = np.asarray(frame.contacts.get("force", np.empty((0, 3))), np.float64)
    acts = force.any(axis=1)
    if not acts.any():
        raise ValueError("contacts: nothing to draw, no contact has a force")
    force, met = force[acts], {name: frame.contacts[name][acts] for name in ("point", "blocks")}
    pairs, number = np.unique(met["blocks"].astype(np.int64), axis=0, return_inverse=True)

    def sums(values: Floats) -> Floats:
        parts = values.reshape(len(values), -1).T
        return np.stack([np.bincount(number.reshape(-1), part) for part in parts], axis=1)

    weights = np.linalg.norm(force, axis=1)
    middle = sums(met["point"] * weights[:, None]) / sums(weights)
    force = sums(force)
    size = np.maximum(np.linalg.norm(force, axis=1), np.finfo(float).tiny)
    along = force / size[:, None]
    # Length of a bar: the shortest edge of the two blocks, so that bars of stacked blocks touch.
    long = _lowest(frame)[pairs].min(axis=1)
    half = THICK * np.median(long) * size / size.max()
    # Two directions normal to the force; the first is normal to the axis farthest from the force.
    across = np.cross(along, np.eye(3)[np.abs(along).argmin(axis=1)])
    across *= (half / np.maximum(np.linalg.norm(across, axis=1), 0.1))[:, None]
    other = np.cross(along, across)
    ring = np.stack([across, other, -across, -other], axis=1)
    ends = np.stack([middle - 0.5 * long[:, None] * along, middle + 0.5 * long[:, None] * along], 1)
    points = (ends[:, :, None] + ring[:, None]).reshape(-1, 3)
    cells = (8 * np.arange(len(pairs))[:, None, None] + _SIDES).reshape(-1, 4)
    layer = Layer("contacts", points, cells, 1.0, PLAIN)
    layer.values = np.repeat(size, len(_SIDES))
    clim = bar[1] or (0.0, float(size.max()))
    layer.bar = bar_of("contact force (N)", layer.values, bar[0], clim, plain="plasma", unit="N")
    return [layer]


def _lowest(frame: Scene) -> Floats:
    """Shortest edge of the box around each block [m]."""
    block = np.repeat(frame.blocks, 8)
    ends = np.full((2, block.max() + 1, 3), np.inf)
    for end, sign in zip(ends, (1.0, -1.0)):
        np.minimum.at(end, block, sign * frame.points[frame.elements.reshape(-1)])
    sizes: Floats = -ends[1] - ends[0]
    lowest: Floats = sizes.min(axis=1)
    return lowest


def bar_of(
    label: str,
    values: Floats,
    cmap: Any,
    clim: tuple[float, float] | None,
    plain: str = "viridis",
    unit: str = "",
) -> ColourBar:
    """Colour bar of values, symmetric about zero if both signs matter."""
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 0.0)
    # An end that is only rounding relative to the other end is 0.
    most = max(abs(low), abs(high))
    low, high = (0.0 if abs(end) < 1e-9 * most else end for end in (low, high))
    only = None
    both = low < 0.0 < high and min(-low, high) > 0.05 * max(-low, high)
    if clim is None:
        clim = (-most, most) if both and cmap is None else (low, high)
        # All values are equal except for rounding: the bar gets some length, with the value in its middle.
        if clim[1] - clim[0] <= 1e-6 * most:
            room = 0.5 * abs(low) or 1.0
            only, clim = low, (low - room, low + room)
    elif not clim[0] < clim[1]:
        raise ValueError(f"clim: {clim!r} must be two numbers that increase")
    chosen = colours(cmap or ("RdBu_r" if both else plain))
    if only is not None:
        chosen = listed((chosen(0.5),))
    return ColourBar(label, chosen, clim, unit, only=only)


def ticks(bar: ColourBar) -> list[tuple[float, str]]:
    """Values along a bar with their text: round values and both ends."""
    from matplotlib.ticker import MaxNLocator

    low, high = bar.clim
    factor, _ = bar.scale
    if bar.only is not None:
        return [(bar.only, f"{bar.only / factor:.4g}")]
    locator: Any = MaxNLocator(4, steps=[1, 2, 2.5, 5, 10])
    round_ones = factor * np.asarray(locator.tick_values(low / factor, high / factor))
    # Smallest distance between two texts.
    near = 0.15 * (high - low)
    inner = [tick for tick in round_ones if low + near < tick < high - near]
    steps = max(abs(low), abs(high)) / (0.25 * (high - low))
    digits = max(4, math.ceil(math.log10(steps)) + 2)
    # A value that is only rounding is shown as 0.
    values = [0.0 if abs(tick) < 1e-9 * (high - low) else float(tick) for tick in (low, *inner, high)]
    return [(tick, f"{tick / factor:.{digits}g}") for tick in values]


def listed(names: tuple[Any, ...]) -> Any:
    """Colour map of the given colours."""
    from matplotlib.colors import ListedColormap

    return ListedColormap(list(names))


def pale(cmap: Any) -> Any:
    """Paler colour map, on which dark lines can be seen."""
    from matplotlib.colors import ListedColormap

    full = colours(cmap)(np.linspace(0.0, 1.0, 256))[:, :3]
    return ListedColormap(1.0 - _PALE * (1.0 - full))


def colours(cmap: Any) -> Any:
    """Colour map by its name; a colour map itself is returned unchanged."""
    import matplotlib

    return (
        matplotlib.colormaps[one_of("cmap", cmap, matplotlib.colormaps)]
        if isinstance(cmap, str)
        else cmap
    )

"""A picture as one page for a browser: nothing is fetched, no server is needed."""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping
from importlib import resources
from typing import Any

import numpy as np
import numpy.typing as npt

from ._layers import Bar, Layer

# Three in each corner of a quadrilateral: two triangles.
_TRIANGLES = np.array([0, 1, 2, 0, 2, 3])


def page_of(
    layers: list[Layer],
    about: list[str],
    views: Mapping[str, Any],
    view: str,
    background: str,
) -> str:
    """The page as text: the template `page.html` with the numbers of the picture in it."""
    points = layers[0].points
    # Coordinates of a site may need more digits than the single precision that browsers draw in.
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    scene = {
        "about": about,
        "background": background,
        "views": views,
        "view": view,
        "size": (np.ptp(points, axis=0)).tolist(),
        "layers": [_layer(layer, centre) for layer in layers if len(layer.cells)],
        "bars": [_bar(layer.bar) for layer in layers if layer.bar is not None],
        "legend": [[layer.legend, layer.colour] for layer in layers if layer.legend is not None],
    }
    template = resources.files(__package__).joinpath("page.html").read_text("utf-8")
    # A title must not be able to end the script that it stands in.
    text = json.dumps(scene, ensure_ascii=False, allow_nan=False).replace("<", "\\u003c")
    return template.replace('"SCENE"', text)


def _layer(layer: Layer, centre: npt.NDArray[np.float64]) -> dict[str, Any]:
    points, cells, values = layer.points - centre, layer.cells, layer.values
    if values is not None and not layer.on_points:
        # Cells have their own value, so none of them can share its corners.
        points, values = points[cells.reshape(-1)], np.repeat(values, 4)
        cells = np.arange(len(points)).reshape(-1, 4)
    lines = cells.shape[1] == 2
    said: dict[str, Any] = {
        "points": _packed(points, np.float32),
        "cells": _packed(cells if lines else cells[:, _TRIANGLES], np.uint32),
        "lines": lines,
        # Joints without thickness lie on the faces of blocks, which stand back.
        "back": 2 if layer.name == "blocks" else 1,
        "colour": layer.colour,
        "opacity": layer.opacity,
    }
    if values is not None and layer.bar is not None:
        low, high = layer.bar.clim
        share = np.clip((values - low) / (high - low), 0.0, 1.0)
        said["values"] = _packed(np.where(np.isfinite(values), share, -1.0), np.float32)
        said["colours"] = _packed(_colours(layer.bar), np.uint8)
    return said


def _bar(bar: Bar) -> dict[str, Any]:
    low, high = bar.clim
    ticks = [f"{tick:.3g}" for tick in np.linspace(low, high, 5)]
    stops = [f"rgb({r} {g} {b})" for r, g, b, _ in _colours(bar)[::15]]
    return {"label": bar.label, "ticks": ticks, "stops": stops}


def _colours(bar: Bar) -> npt.NDArray[np.uint8]:
    """256 colours (256, 4) from the lower end to the upper."""
    return np.asarray(bar.cmap(np.linspace(0.0, 1.0, 256), bytes=True), np.uint8)


def _packed(array: npt.NDArray[Any], kind: Any) -> str:
    # WebGL reads the order of bytes that every browser's machine has.
    little = np.ascontiguousarray(array, np.dtype(kind).newbyteorder("<"))
    return base64.b64encode(little.tobytes()).decode("ascii")

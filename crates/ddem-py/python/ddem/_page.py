"""Picture as one page for a browser, drawn by plotly. It needs no network and no server."""

from __future__ import annotations

import gzip
from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import replace
from html import escape
from importlib import import_module
from itertools import product
from typing import Any

import numpy as np
import numpy.typing as npt

from ._draw import bulk
from ._layers import INK, ColourBar, Layer, ticks
from ._scene import Floats

Views = Mapping[str, tuple[tuple[float, float, float], tuple[float, float, float]]]

# Half the height that plotly's camera sees at unit distance: its view angle is 45°.
_HALF = np.tan(np.radians(22.5))
# Plotly's camera is near: to show the faces of "iso" it looks from farther to the side and above.
_ISO = (0.85, -1.0, 0.7)
# Light from the camera, with little shading: colours must match those of the bar.
_LIGHT = {
    "ambient": 0.75,
    "diffuse": 0.25,
    "specular": 0.0,
    "fresnel": 0.0,
    "facenormalsepsilon": 0.0,
    "vertexnormalsepsilon": 0.0,
}

# A page that unpacks another and becomes it.
_UNPACK = """<!DOCTYPE html><meta charset="utf-8"><script>
const bytes = Uint8Array.from(atob("{}"), letter => letter.charCodeAt(0));
const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
new Response(stream).text().then(page => {{ document.open(); document.write(page); document.close(); }});
</script>"""


def page_of(
    layers: list[Layer],
    about: list[str],
    views: Views,
    view: str,
    background: tuple[float, float, float],
    size: tuple[int, int],
) -> str:
    """HTML text of the page, which contains plotly's script and all data."""
    figure = _figure(layers, about, views, view, background, size)
    page: str = figure.to_html(
        # No button of Plotly 7 that sends the picture, with all its data, to a server of Plotly.
        config={"displaylogo": False, "showSendToCloud": False},
        include_plotlyjs=True,
        default_height="100vh",
        div_id="picture",
    )
    head = f"<head><title>{escape(about[0])}</title><style>body {{margin: 0}}</style>"
    return page.replace("<head>", head, 1)


def frame_of(page: str, size: tuple[int, int]) -> str:
    """HTML text of a page within another, compressed: notebooks store plotly with each picture."""
    packed = b64encode(gzip.compress(page.encode(), mtime=0)).decode()
    style = f"width: 100%; aspect-ratio: {size[0]} / {size[1]}; border: 0"
    # Inside a div: IPython warns about an iframe that stands alone, as if it had an address.
    return f'<div><iframe srcdoc="{escape(_UNPACK.format(packed))}" style="{style}"></iframe></div>'


def _figure(
    layers: list[Layer],
    about: list[str],
    views: Views,
    view: str,
    background: tuple[float, float, float],
    size: tuple[int, int],
) -> Any:
    try:
        go: Any = import_module("plotly.graph_objects")
    except ImportError as missing:
        raise ImportError('pages need plotly: pip install "ddem[plot]"') from missing
    title, subtitle = about
    drawn = [layer for layer in layers if len(layer.cells)]
    far = any(layer.far is not None and layer.far.any() for layer in drawn)
    # Joints and lines lie on the blocks: if some blocks are far away, only the others are fitted.
    fitted = [bulk(layer) for layer in (drawn[:1] if far else drawn)]
    low = np.min([points.min(axis=0) for points in fitted], axis=0)
    high = np.max([points.max(axis=0) for points in fitted], axis=0)
    origin = _origin(low, high)
    # A margin: plotly cuts off parts that lie on the edge of the axes.
    room = 0.02 * (high - low).max()
    low, high = low - room, high + room
    ink = INK if sum(background) > 1.5 else "white"
    paper = "rgb({:.0f}, {:.0f}, {:.0f})".format(*(255 * part for part in background))

    bars = [layer.bar for layer in drawn if layer.bar is not None and layer.bar.shown]
    figure = go.Figure()
    for layer in drawn:
        if layer.cells.shape[1] == 2:
            colour = ink if layer.colour == INK else layer.colour
            figure.add_trace(_lines(layer, origin, colour))
            continue
        for part in _numbers_apart(layer):
            place = bars.index(part.bar) if part.bar in bars else 0
            bar = None if part.bar is None else (part.bar, place, len(bars))
            figure.add_trace(_faces(part, origin, bar))
    for layer in layers:
        if layer.legend is not None:
            figure.add_trace(_entry(layer))
    aspect = size[0] / size[1]
    cameras = {
        name: _camera(low, high, _ISO if name == "iso" else back, aspect)
        for name, (back, _) in views.items()
    }
    figure.update_layout(
        template="none",
        title={
            "text": f'{_plain(title)}<br><span style="font-size: 13px">{_plain(subtitle)}</span>',
            "font": {"size": 18},
            "x": 0.01,
        },
        paper_bgcolor=paper,
        font={"color": ink, "size": 12},
        margin={"l": 0, "r": 0, "t": 64, "b": 70 if bars else 10},
        legend={"x": 0.99, "xanchor": "right", "y": 0.02, "yanchor": "bottom"},
        scene={
            # Not "data": plotly would measure the visible data, and the axes are longer.
            "aspectmode": "manual",
            "aspectratio": dict(zip("xyz", ((high - low) / (high - low).max()).tolist())),
            "camera": cameras[view],
            "dragmode": "turntable",
            **{
                f"{name}axis": _axis(name, float(shift), [float(a - shift), float(b - shift)], ink)
                for name, shift, a, b in zip("xyz", origin, low, high)
            },
        },
        updatemenus=[
            {
                "type": "buttons",
                "direction": "right",
                "showactive": False,
                "x": 0.99,
                "xanchor": "right",
                "y": 1.0,
                "yanchor": "bottom",
                "buttons": [
                    {
                        "label": name,
                        "method": "relayout",
                        "args": [{"scene.camera": cameras[name]}],
                    }
                    for name in ("iso", "xy", "xz", "yz")
                ],
            }
        ],
    )
    return figure


def _origin(low: Floats, high: Floats) -> Floats:
    """Origin of the positions: round numbers if single precision would be too coarse, otherwise 0."""
    size = float((high - low).max()) or 1.0
    middle = 0.5 * (low + high)
    step = 10.0 ** np.ceil(np.log10(size))
    return np.where(np.abs(middle) > 100.0 * size, np.round(middle / step) * step, 0.0)


def _numbers_apart(layer: Layer) -> list[Layer]:
    """Split a layer into its cells with values and, in plain colour, its cells without values."""
    if layer.values is None or layer.bar is None:
        return [layer]
    known = np.isfinite(layer.values)
    if layer.on_points:
        known = np.logical_and.reduce(known[layer.cells], axis=1)
    if known.all():
        return [layer]
    values = layer.values if layer.on_points else layer.values[known]
    parts = [
        replace(layer, cells=layer.cells[known], values=values),
        replace(layer, cells=layer.cells[~known], values=None, bar=None),
    ]
    return [part for part in parts if len(part.cells)]


def _places(points: Floats, origin: Floats) -> dict[str, npt.NDArray[np.float32]]:
    return dict(zip("xyz", np.ascontiguousarray((points - origin).T, np.float32)))


def _faces(layer: Layer, origin: Floats, bar: tuple[ColourBar, int, int] | None) -> dict[str, Any]:
    cells = layer.cells.astype(np.min_scalar_type(len(layer.points)))
    trace: dict[str, Any] = {
        "type": "mesh3d",
        "name": layer.name,
        "legendgroup": layer.name,
        "hoverinfo": "skip" if layer.legend is None else "name",
        **_places(layer.points, origin),
        # Each face is two triangles.
        "i": np.repeat(cells[:, 0], 2),
        "j": cells[:, 1:3].reshape(-1),
        "k": cells[:, 2:4].reshape(-1),
        "opacity": layer.opacity,
        "color": layer.colour,
        "flatshading": True,
        "lighting": _LIGHT,
        "lightposition": {"x": 0, "y": 0, "z": 1e5},
    }
    if layer.values is not None and bar is not None:
        about, number, count = bar
        values = layer.values.astype(np.float32)
        low, high = about.clim
        marks = ticks(about)
        trace |= {
            "intensity": values if layer.on_points else np.repeat(values, 2),
            "intensitymode": "vertex" if layer.on_points else "cell",
            "cmin": low,
            "cmax": high,
            "colorscale": _colours(about),
            "showscale": about.shown,
        }
        if about.shown:
            trace |= {
                "hoverinfo": "all",
                "hovertemplate": f"{_plain(about.label)}: %{{intensity:.4g}}<extra></extra>",
                "colorbar": {
                    "orientation": "h",
                    "title": {"text": _plain(about.title), "side": "top"},
                    "tickvals": [tick for tick, _ in marks],
                    "ticktext": [text for _, text in marks],
                    "len": 0.36,
                    "thickness": 14,
                    "x": (number + 0.5) / count,
                    "y": 0.0,
                    "yanchor": "top",
                },
            }
    return trace


def _lines(layer: Layer, origin: Floats, colour: str) -> dict[str, Any]:
    # NaN after each line makes a gap, because plotly does not draw NaN.
    ends = np.full((len(layer.cells), 3, 3), np.nan)
    ends[:, :2] = layer.points[layer.cells]
    return {
        "type": "scatter3d",
        "mode": "lines",
        "name": layer.name,
        "legendgroup": layer.name,
        "showlegend": False,
        "hoverinfo": "skip",
        **_places(ends.reshape(-1, 3), origin),
        "line": {"color": colour, "width": round(2.0 * layer.width / 1.2, 1)},
        "opacity": layer.opacity,
    }


def _entry(layer: Layer) -> dict[str, Any]:
    """Legend entry of a layer: an opaque marker, because the layer may be almost transparent."""
    return {
        "type": "scatter3d",
        "mode": "markers",
        "name": layer.legend,
        "legendgroup": layer.name,
        "showlegend": True,
        "x": [None],
        "y": [None],
        "z": [None],
        "marker": {"symbol": "square", "color": layer.colour, "size": 9},
    }


def _camera(low: Floats, high: Floats, back: Sequence[float], aspect: float) -> dict[str, Any]:
    """Camera in a direction, at a distance from which all corners of the axes are seen."""
    toward = np.array(back, np.float64)
    # Slightly in front of straight above or below, so that z is up there, too.
    if toward[0] == toward[1] == 0.0:
        toward[1] = -1e-4
    toward /= np.linalg.norm(toward)
    right = np.cross([0.0, 0.0, 1.0], toward)
    right /= np.linalg.norm(right)
    up = np.cross(toward, right)
    # Plotly's unit of length is the longest axis.
    half = 0.5 * (high - low) / (high - low).max()
    seen = half * list(product((-1.0, 1.0), repeat=3)) @ np.stack([right, up, toward], axis=1)
    # Leave room for the numbers and names of the axes, the title and the bar.
    wide = np.abs(seen[:, 0]) / (0.92 * aspect * _HALF)
    tall = np.abs(seen[:, 1]) / (0.9 * _HALF)
    eye = toward * float((seen[:, 2] + np.maximum(wide, tall)).max())
    return {
        "eye": dict(zip("xyz", eye.tolist())),
        "center": dict.fromkeys("xyz", 0.0),
        "up": {"x": 0.0, "y": 0.0, "z": 1.0},
    }


def _axis(name: str, shift: float, ends: list[float], ink: str) -> dict[str, Any]:
    from_ = f" − {shift:.12g}" if shift > 0 else f" + {-shift:.12g}" if shift else ""
    return {
        "title": {"text": f"{name}{from_} (m)"},
        "range": ends,
        "showgrid": False,
        "zeroline": False,
        "showspikes": False,
        "showbackground": False,
        "showline": True,
        "linecolor": ink,
        "nticks": 6,
    }


def _plain(text: str) -> str:
    """Text escaped so that plotly does not read it as tags."""
    return escape(text, quote=False)


def _colours(bar: ColourBar) -> list[tuple[float, str]]:
    """256 colours of a bar, from its lower to its upper end."""
    shares = np.linspace(0.0, 1.0, 256)
    shown = np.asarray(bar.cmap(shares, bytes=True))[:, :3]
    return [(float(share), "rgb({},{},{})".format(*rgb)) for share, rgb in zip(shares, shown)]

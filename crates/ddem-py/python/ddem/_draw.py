"""PyVista scene of layers: faces, lines, colour bars, text and camera."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from ._layers import INK, ColourBar, Layer, ticks
from ._scene import Floats

# Direction from the model to the camera, and upward direction, of each view.
VIEWS = {
    "iso": ((0.55, -1.0, 0.5), (0.0, 0.0, 1.0)),
    "xy": ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0)),
    "xz": ((0.0, -1.0, 0.0), (0.0, 0.0, 1.0)),
    "yz": ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
    "-xy": ((0.0, 0.0, -1.0), (0.0, -1.0, 0.0)),
    "-xz": ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    "-yz": ((-1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
}


# The type hints of PyVista reject some valid calls: its objects are Any here.
def fill(plotter: Any, layers: list[Layer], words: list[str], view: str, background: str) -> Any:
    """Add layers, bars, title and the line below it to a scene; return the actor of that line."""
    import pyvista as pv

    plotter.set_background(background)
    # Light from the camera, with little shading: colours must match those of the bar.
    plotter.add_light(pv.Light(light_type="headlight"))
    ink = INK if sum(pv.Color(background).float_rgb) > 1.5 else "white"
    drawn: list[tuple[ColourBar, Any]] = []
    nearer = 0.0
    for layer in layers:
        if len(layer.cells) == 0:
            continue
        if layer.cells.shape[1] == 2:
            _lines(plotter, layer, ink if layer.colour == INK else layer.colour, nearer)
            nearer += 2.0
            continue
        mapper = _faces(plotter, layer)
        if layer.bar is not None and layer.bar.shown:
            drawn.append((layer.bar, mapper))
    for number, (bar, mapper) in enumerate(drawn):
        left = 0.32 if len(drawn) == 1 else 0.12 + 0.45 * number
        _bar(plotter, bar, mapper, left, ink)
    _say(plotter, words[0], (0.02, 0.945), 13, ink)
    line = _say(plotter, words[1], (0.02, 0.91), 9, ink)
    named = [(layer.legend, layer.colour) for layer in layers if layer.legend is not None]
    named = [(legend, ink if colour == INK else colour) for legend, colour in named]
    low = 0.04 if len(drawn) < 2 else 0.13
    for number, (legend, colour) in enumerate(reversed(named)):
        _say(plotter, legend, (0.98, low + 0.035 * number), 10, colour, "right")
    plotter.add_axes(color=ink)
    look(plotter, bulk(layers[0]), view)
    return line


def _lines(plotter: Any, layer: Layer, colour: str, nearer: float) -> None:
    """Add lines. Of lines in the same place, those with the larger `nearer` are seen."""
    actor = plotter.add_mesh(
        mesh_of(layer),
        name=layer.name,
        color=colour,
        opacity=layer.opacity,
        line_width=max(layer.width * _share(plotter), 1.2),
        lighting=False,
    )
    actor.mapper.SetResolveCoincidentTopologyToPolygonOffset()
    actor.mapper.SetRelativeCoincidentTopologyLineOffsetParameters(0.0, -nearer)


def _faces(plotter: Any, layer: Layer) -> Any:
    """Add faces and return their mapper."""
    style: dict[str, Any] = {"color": layer.colour}
    if layer.bar is not None and layer.values is not None:
        style = {
            "scalars": layer.bar.label,
            "preference": "point" if layer.on_points else "cell",
            "cmap": layer.bar.cmap,
            "clim": list(layer.bar.clim),
            "nan_color": layer.colour,
            "show_scalar_bar": False,
        }
    style |= {"name": layer.name, "opacity": layer.opacity, "ambient": 0.65, "diffuse": 0.35}
    actor = plotter.add_mesh(mesh_of(layer), **style)
    # Lines lie on faces, and joints without thickness on faces of blocks: blocks are drawn behind both.
    actor.mapper.SetResolveCoincidentTopologyToPolygonOffset()
    back = 2.0 if layer.name == "blocks" else 1.0
    actor.mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(back, back)
    return actor.mapper


def mesh_of(layer: Layer) -> Any:
    """PyVista mesh of the faces or lines of a layer, with their values."""
    import pyvista as pv

    if layer.cells.shape[1] == 2:
        lines = np.insert(layer.cells, 0, 2, axis=1)
        return pv.PolyData(layer.points, lines=lines.reshape(-1))
    faces: Any = layer.cells
    mesh: Any = pv.PolyData.from_regular_faces(layer.points, faces)
    if layer.nodes is not None:
        mesh.point_data["node"] = layer.nodes
    if layer.owners is not None:
        mesh.cell_data["element"] = layer.owners
    if layer.bar is not None and layer.values is not None:
        data = mesh.point_data if layer.on_points else mesh.cell_data
        data[layer.bar.label] = layer.values
        mesh.set_active_scalars(layer.bar.label, preference="point" if layer.on_points else "cell")
    return mesh


def _bar(plotter: Any, bar: ColourBar, mapper: Any, left: float, ink: str) -> None:
    """Add a colour bar at the lower edge, with its own text: VTK draws numbers over title or colours."""
    width = 0.36
    drawn = plotter.add_scalar_bar(
        title=bar.label,
        mapper=mapper,
        vertical=False,
        width=width,
        height=0.02,
        position_x=left,
        position_y=0.065,
        n_labels=0,
    )
    drawn.SetTitle("")
    drawn.SetBarRatio(1.0)
    _say(plotter, bar.title, (left + 0.5 * width, 0.095), 10, ink, "center")
    for value, text in ticks(bar):
        share = (value - bar.clim[0]) / (bar.clim[1] - bar.clim[0])
        _say(plotter, text, (left + share * width, 0.036), 8, ink, "center")


def _say(
    plotter: Any,
    text: str,
    place: tuple[float, float],
    size: int,
    colour: str,
    side: Literal["left", "center", "right"] = "left",
) -> Any:
    size = max(round(size * _share(plotter)), 4)
    actor = plotter.add_text(text, position=place, viewport=True, font_size=size, color=colour)
    actor.prop.justification_horizontal = side
    return actor


def _share(plotter: Any) -> float:
    """Factor on the sizes of text and lines, which were chosen for 1200 × 900 pixels."""
    width, height = plotter.window_size
    return min(float(width) / 1200, float(height) / 900)


def bulk(layer: Layer) -> Floats:
    """Points of the blocks that the picture must show: all except the few that are far away."""
    points: Floats = layer.points if layer.far is None else layer.points[~layer.far]
    return points


def axes(view: str) -> tuple[Floats, Floats, Floats]:
    """Unit vectors of a view: to the camera, to the right and up."""
    back, up = (np.array(vector) / np.linalg.norm(vector) for vector in VIEWS[view])
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    return back, right, np.cross(back, right)


def look(plotter: Any, points: Floats, view: str) -> None:
    """Turn the camera to a view and fit the model between the title and the bar."""
    back, right, up = axes(view)
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    seen = (points - middle) @ np.column_stack([right, up])
    low, high = seen.min(axis=0), seen.max(axis=0)
    width, height = plotter.window_size
    half = 0.5 * np.maximum(high - low, 1e-30)
    camera = plotter.camera
    camera.parallel_projection = True
    camera.parallel_scale = max(half[1] / 0.74, half[0] / (0.9 * width / height))
    focus = middle + 0.5 * (low + high) @ np.stack([right, up]) - 0.03 * camera.parallel_scale * up
    camera.focal_point = tuple(focus)
    camera.position = tuple(focus + 2.0 * np.ptp(points, axis=0).sum() * back)
    camera.up = tuple(up)
    plotter.reset_camera_clipping_range()

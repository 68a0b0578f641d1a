"""Pictures of blocks and joints: windows, image files, pages for a browser."""

from __future__ import annotations

import os
import sys
from contextlib import nullcontext
from importlib import import_module
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from . import _layers
from ._layers import INK, Bar, Layer, ticks
from ._names import JOINTS, one_of
from ._page import page_of
from ._scene import Floats, Frame, Source, automatic_scale, frame_of

if TYPE_CHECKING:
    import pyvista as pv

# From where the model is seen, and what is up there.
VIEWS = {
    "iso": ((0.55, -1.0, 0.5), (0.0, 0.0, 1.0)),
    "xy": ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0)),
    "xz": ((0.0, -1.0, 0.0), (0.0, 0.0, 1.0)),
    "yz": ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
    "-xy": ((0.0, 0.0, -1.0), (0.0, -1.0, 0.0)),
    "-xz": ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    "-yz": ((-1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
}


def plot(
    simulation: Source,
    field: str | npt.ArrayLike | None = None,
    *,
    component: str | None = None,
    scale: float | None = None,
    joints: str | None = None,
    joint_component: str | None = None,
    contacts: bool = False,
    frame: int = -1,
    view: str = "iso",
    cmap: Any = None,
    clim: tuple[float, float] | None = None,
    opacity: float | None = None,
    edges: Literal["blocks", "elements", "none"] = "blocks",
    label: str | None = None,
    background: str = "white",
    window_size: tuple[int, int] = (1200, 900),
    screenshot: str | os.PathLike[str] | None = None,
    html: str | os.PathLike[str] | None = None,
    show: bool = True,
) -> pv.Plotter:
    """Draw the deformed blocks, and the joints or the forces of contacts where wanted.

    With `screenshot` or `html` files are written and no window opens. With neither the picture
    opens in a window, or appears below the cell of a notebook.

    Parameters
    ----------
    simulation : Simulation, Results, Frame, str or os.PathLike
        What to draw: a simulation as it is now, results or their folder, or one frame of them.
    field : str or array, optional
        What colours the blocks. Of a simulation ``"displacement"`` (m), ``"velocity"`` (m/s),
        ``"force"`` (N), ``"mass"`` (kg), ``"stress"`` (Pa), ``"block"``, ``"fragment"`` or, of a
        model with ``peaks=True``, ``"peak_velocity"`` (m/s), ``"peak_tension"`` and
        ``"peak_compression"`` (Pa); of a folder, what its ``blocks.vtkhdf`` holds. Or numbers of your own: an array of shape ``(n,)``, ``(n, 3)`` or
        ``(n, 6)`` with n = n_nodes or n_elements. By default the displacement; blocks are plain
        where joints are drawn. Fragments have colours that tell neighbours apart, the largest its own;
        with `cmap`, `clim` or `label` those of their numbers.
    component : str, optional
        Of vectors ``"x"``, ``"y"``, ``"z"`` or ``"magnitude"`` (default). Of stresses ``"xx"``,
        ``"yy"``, ``"zz"``, ``"xy"``, ``"yz"``, ``"zx"``, ``"von_mises"`` (default) or the principal
        stresses ``"s1"`` ≥ ``"s2"`` ≥ ``"s3"``; tension is positive.
    scale : float, optional
        Magnification of the displacements. By default 1, 2 or 5 × 10ⁿ, so that the largest is
        about 5 % of the model, and 1 where it is that large already or where contacts are drawn.
    joints : str, optional
        What colours the joints, which are left out by default: ``"state"``, ``"failure_time"``
        (s), ``"slip"`` (m), ``"opening"`` (m), ``"traction"`` (Pa) or ``"damage"``. The blocks
        are translucent then; joints that hold show but faintly, save with ``"traction"``.
    joint_component : str, optional
        Of ``"slip"`` and ``"traction"``: ``"x"``, ``"y"``, ``"z"`` or ``"magnitude"`` (default).
    contacts : bool, optional
        Draws what each two blocks that meet exert on each other: a bar where they do, along the
        force, as thick as the force is large. The blocks are translucent then, and
        displacements are true: `scale` is 1.
    frame : int, optional
        Of a folder: which frame, negative from the end. By default the last.
    view : str, optional
        ``"iso"``, ``"xz"`` (seen along y), ``"xy"``, ``"yz"``, or from behind ``"-xz"``,
        ``"-xy"``, ``"-yz"``.
    cmap : str or matplotlib.colors.Colormap, optional
        Colours of the field, or of joints or contacts where the blocks are plain. By default
        ``"viridis"``; where values of both signs matter, ``"RdBu_r"`` about zero.
    clim : (float, float), optional
        Values at the ends of those colours.
    opacity : float, optional
        Of the blocks, 0 to 1.
    edges : {"blocks", "elements", "none"}, optional
        Which lines are drawn.
    label : str, optional
        Title of the colour bar of the field.
    background : str, optional
        Any colour that PyVista knows.
    window_size : (int, int), optional
        Width and height in pixels; pages fill their window, and the model fits this shape.
    screenshot : str or os.PathLike, optional
        Image file to write, ``.png``, ``.jpg``, ``.tif`` or ``.bmp``.
    html : str or os.PathLike, optional
        Page to write: one file to turn and zoom in any browser with WebGL, without network. It
        has 5 MB, and 60 bytes for each outer face of an element: 11 MB for 100 000 of them, 23 MB
        with ``edges="elements"``. An element of a joint takes 250 bytes. In a notebook a picture
        is such a page, which the file of the notebook then holds.
    show : bool, optional
        False opens no window and leaves the plotter open: add to it, then call its ``show()`` or
        ``screenshot()``, and ``close()`` in the end.

    Returns
    -------
    pyvista.Plotter
        Closed already, unless `show` is False. Its actor ``"blocks"`` has the mesh of the outer
        faces of the blocks, with the array ``"node"`` of its points and ``"element"`` of its
        cells: rows of the arrays of the simulation. Others are ``"edges"``, ``"contacts"`` and
        ``"joints"``, or ``"bonded"``, ``"failed in shear"`` and ``"failed in tension"``.

    Raises
    ------
    ValueError
        If a name is wrong, an array has the wrong shape, displacements are not finite, the model
        has no joints or contacts to draw, or contacts are to be drawn with another `scale`.
    FileNotFoundError
        If the folder has no results.
    ImportError
        If PyVista is not installed, or plotly where a page is wanted:
        ``pip install "ddem[plot]"``.
    RuntimeError
        If a window is wanted where there is no display.

    Examples
    --------
    >>> ddem.plot(sim, "stress", component="s1", screenshot="beam.png")
    >>> ddem.plot("results/beam-crack", joints="state", html="crack.html")
    """
    try:
        import pyvista as pv
    except ImportError as missing:
        raise ImportError('plots need PyVista: pip install "ddem[plot]"') from missing
    one_of("view", view, VIEWS)
    one_of("edges", edges, ("blocks", "elements", "none"))
    if joints is not None:
        one_of("joints", joints, JOINTS)
    to_file = screenshot is not None or html is not None
    notebook = show and not to_file and _in_notebook()
    window = show and not to_file and not notebook
    if window and no_display() and not pv.OFF_SCREEN:
        raise RuntimeError(
            'there is no display for a window: give screenshot="picture.png" or html="page.html"'
        )

    if contacts and scale not in (None, 1.0):
        raise ValueError(f"scale: {scale!r} with contacts, which are drawn where they are")
    state = frame_of(simulation, frame, joints is not None, contacts)
    wrong = int((~np.isfinite(state.displacement)).any(axis=1).sum())
    if wrong:
        raise ValueError(f"displacement: not finite at {wrong} nodes, there is nothing to draw")
    if contacts:
        scale = 1.0
    if scale is None:
        scale = automatic_scale(state.points, state.displacement)
    inside = joints is not None or contacts
    if field is None and not inside:
        field = "displacement"
    if opacity is None:
        opacity = 1.0 if not inside else 0.06 if field is None else 0.15
    wanted = (cmap, clim)
    layers = _layers.blocks(state, field, component, label, wanted, scale, edges, opacity)
    if joints is not None:
        spare = wanted if field is None else (None, None)
        layers += _layers.joints(state, joints, joint_component, spare, scale)
    if contacts:
        spare = wanted if field is None and joints is None else (None, None)
        layers += _layers.contacts(state, spare)
    words = [state.title, about(state, scale)]

    if html is not None or notebook:
        paper = pv.Color(background).float_rgb
        page = page_of(layers, words, VIEWS, view, paper, window_size)
        if html is not None:
            with open(html, "w", encoding="utf-8") as file:
                file.write(page)
        else:
            _inline(page, window_size)
    # Without a display VTK finds another way to draw, but complains first.
    with pv.vtk_verbosity("off") if no_display() else nullcontext():
        hidden = True if to_file or notebook or no_display() else None
        size = list(window_size)
        plotter = pv.Plotter(off_screen=hidden, window_size=size, lighting="none")
        try:
            fill(plotter, layers, words, view, background)
            if screenshot is not None:
                plotter.screenshot(os.fspath(screenshot))
            if window:
                plotter.show()
        finally:
            # PyVista keeps each plotter, with all its meshes, until it is closed.
            if show:
                plotter.close()
    return plotter


def about(frame: Frame, scale: float) -> str:
    """When a state is, and how it is drawn."""
    moved = "true displacements" if scale == 1.0 else f"displacements × {scale:g}"
    when = [frame.stage] if frame.stage else []
    # In a relaxation at the start time stands still.
    if frame.time:
        when.append(f"t = {frame.time:.4g} s")
    elif frame.step:
        when.append(f"step {frame.step}")
    return ", ".join([*when, moved])


# PyVista's own types do not let some of its methods be called: here its objects are Any.
def fill(plotter: Any, layers: list[Layer], words: list[str], view: str, background: str) -> Any:
    """Puts layers, bars, title and the line below it into a scene; gives that line."""
    import pyvista as pv

    plotter.set_background(background)
    # Little shade, from the eye: colours must be found again in the bar.
    plotter.add_light(pv.Light(light_type="headlight"))
    ink = INK if sum(pv.Color(background).float_rgb) > 1.5 else "white"
    drawn: list[tuple[Bar, Any]] = []
    for layer in layers:
        if len(layer.cells) == 0:
            continue
        mesh = mesh_of(layer)
        if layer.cells.shape[1] == 2:
            plotter.add_mesh(
                mesh,
                name=layer.name,
                color=layer.colour if ink == INK else ink,
                opacity=layer.opacity,
                line_width=1.2,
                lighting=False,
            )
            continue
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
        actor = plotter.add_mesh(
            mesh, name=layer.name, opacity=layer.opacity, ambient=0.65, diffuse=0.35, **style
        )
        # Lines lie on faces, and joints without thickness on those of blocks: blocks stand back.
        actor.mapper.SetResolveCoincidentTopologyToPolygonOffset()
        back = 2.0 if layer.name == "blocks" else 1.0
        actor.mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(back, back)
        if layer.bar is not None and layer.bar.shown:
            drawn.append((layer.bar, actor.mapper))
    for number, (bar, mapper) in enumerate(drawn):
        left = 0.32 if len(drawn) == 1 else 0.12 + 0.45 * number
        _bar(plotter, bar, mapper, left, ink)
    _say(plotter, words[0], (0.02, 0.945), 13, ink)
    line = _say(plotter, words[1], (0.02, 0.91), 9, ink)
    named = [(layer.legend, layer.colour) for layer in layers if layer.legend is not None]
    low = 0.04 if len(drawn) < 2 else 0.13
    for number, (legend, colour) in enumerate(reversed(named)):
        _say(plotter, legend, (0.98, low + 0.035 * number), 10, colour, "right")
    plotter.add_axes(color=ink)
    look(plotter, layers[0].points, view)
    return line


def mesh_of(layer: Layer) -> Any:
    """Faces or lines of a layer with their values."""
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


def _bar(plotter: Any, bar: Bar, mapper: Any, left: float, ink: str) -> None:
    """Colour bar at the lower edge. VTK writes its numbers across its title or its colours."""
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
    _say(plotter, bar.label, (left + 0.5 * width, 0.095), 10, ink, "center")
    for number, (_, text) in enumerate(ticks(bar.clim)):
        _say(plotter, text, (left + 0.25 * number * width, 0.036), 8, ink, "center")


def _say(
    plotter: Any,
    text: str,
    place: tuple[float, float],
    size: int,
    colour: str,
    side: Literal["left", "center", "right"] = "left",
) -> Any:
    size = _pixels(plotter, size)
    actor = plotter.add_text(text, position=place, viewport=True, font_size=size, color=colour)
    actor.prop.justification_horizontal = side
    return actor


def _pixels(plotter: Any, size: int) -> int:
    """A size of text that was chosen for 1200 × 900."""
    width, height = plotter.window_size
    return max(round(size * min(float(width) / 1200, float(height) / 900)), 4)


def axes(view: str) -> tuple[Floats, Floats, Floats]:
    """To the eye, to the right and up in a view."""
    back, up = (np.array(vector) / np.linalg.norm(vector) for vector in VIEWS[view])
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    return back, right, np.cross(back, right)


def look(plotter: Any, points: Floats, view: str) -> None:
    """Turns to a view and fits the model between the title and the bar."""
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


def no_display() -> bool:
    named = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    return sys.platform.startswith("linux") and not named


def _in_notebook() -> bool:
    shell = sys.modules.get("IPython")
    shell = shell.get_ipython() if shell is not None else None
    return shell is not None and hasattr(shell, "kernel")


def _inline(page: str, size: tuple[int, int]) -> None:
    """Shows a page below the cell of a notebook, with no server behind it."""
    from html import escape

    shell: Any = import_module("IPython.display")
    style = f"width: 100%; aspect-ratio: {size[0]} / {size[1]}; border: 0"
    # Within a div: IPython warns of frames that stand alone, as if they had an address.
    frame = f'<div><iframe srcdoc="{escape(page)}" style="{style}"></iframe></div>'
    shell.display(shell.HTML(frame))

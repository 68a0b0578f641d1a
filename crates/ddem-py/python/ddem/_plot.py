"""Pictures of blocks and joints in windows, image files and pages for a browser."""

from __future__ import annotations

import os
import sys
from contextlib import nullcontext
from importlib import import_module
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from . import _layers, _traces
from ._draw import VIEWS, fill
from ._layers import Layer
from ._names import JOINTS, one_of
from ._page import frame_of, page_of
from ._results import Frame
from ._results import Results
from ._scene import Integers, Scene, Source, automatic_scale, outside, scene_of

if TYPE_CHECKING:
    import pyvista as pv

def plot(
    simulation: Source,
    field: str | npt.ArrayLike | None = None,
    *,
    component: str | None = None,
    scale: float | None = None,
    joints: str | None = None,
    joint_component: str | None = None,
    contacts: bool = False,
    moving: bool = False,
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
    """Draw the deformed blocks and, if requested, the joints or the contact forces.

    With `screenshot` or `html` the picture is written to a file, and no window opens. Otherwise it
    opens in a window, or appears below the cell of a notebook.

    Parameters
    ----------
    simulation : Simulation, Results, Frame, str or os.PathLike
        Source of the picture: a simulation in its present state, results or their folder, or one
        frame of them.
    field : str or array, optional
        Colour of the blocks. For a simulation ``"displacement"`` (m), ``"velocity"`` (m/s),
        ``"force"`` (N), ``"mass"`` (kg), ``"stress"`` (Pa), ``"block"`` or ``"fragment"``. With
        ``peaks=True`` in the model also ``"peak_velocity"`` (m/s), ``"peak_tension"`` and
        ``"peak_compression"`` (Pa). For a folder, a field of its ``blocks.vtkhdf``. Or your own
        array of shape ``(n,)``, ``(n, 3)`` or ``(n, 6)`` with n = n_nodes or n_elements. By default
        the displacement, but blocks are plain if joint faces or contacts are drawn. Neighbouring
        fragments differ in colour, and the largest has its own. With `cmap`, `clim` or `label`
        fragments are coloured by their numbers.
    component : str, optional
        Component of the field. For vectors ``"x"``, ``"y"``, ``"z"`` or ``"magnitude"`` (default).
        For stresses ``"xx"``, ``"yy"``, ``"zz"``, ``"xy"``, ``"yz"``, ``"zx"``, ``"von_mises"``
        (default) or the principal stresses ``"s1"`` ≥ ``"s2"`` ≥ ``"s3"``; tension is positive.
    scale : float, optional
        Magnification of the displacements. By default 1, 2 or 5 × 10ⁿ, so that the largest
        displacement is drawn as about 5 % of the model. It is 1 if the largest displacement already
        has that size, or if contacts are drawn.
    joints : str, optional
        Colour of the joints: ``"state"``, ``"failure_time"`` (s), ``"slip"`` (m), ``"opening"``
        (m), ``"traction"`` (Pa) or ``"damage"``. By default joints are not drawn. The blocks are
        then translucent, and bonded joints are faint, except with ``"traction"``. With ``"traces"``
        the blocks stay opaque, and thick lines show the state of joints at the outer faces of the
        model. ``"state"`` draws these lines, too.
    joint_component : str, optional
        Component of ``"slip"`` and ``"traction"``: ``"x"``, ``"y"``, ``"z"`` or ``"magnitude"``
        (default).
    contacts : bool, optional
        If True, draw the contact force between each two blocks as a bar at the contact, along the
        force. The thickness of the bar is proportional to the force. The blocks are then
        translucent, and displacements are true: `scale` is 1.
    moving : bool, optional
        If True, outline the moving blocks of a stage that fails, or of the failing trial of a
        factor of safety.
    frame : int, optional
        Frame of results or of their folder; negative numbers count from the end. By default the
        last.
    view : str, optional
        Direction of view: ``"iso"``, ``"xz"`` (along y), ``"xy"``, ``"yz"``, or from the opposite
        side ``"-xz"``, ``"-xy"``, ``"-yz"``.
    cmap : str or matplotlib.colors.Colormap, optional
        Colour map of the field, or of joints or contacts if the blocks are plain. By default
        ``"viridis"`` for fields and ``"plasma"`` for joints and contacts; ``"RdBu_r"`` about zero if
        values of both signs matter.
    clim : (float, float), optional
        Values at the ends of the colour map.
    opacity : float, optional
        Opacity of the blocks, 0 to 1.
    edges : {"blocks", "elements", "none"}, optional
        Lines to draw.
    label : str, optional
        Title of the colour bar of the field.
    background : str, optional
        Any colour that PyVista knows.
    window_size : (int, int), optional
        Width and height in pixels. A page fills its window; the model fits this aspect ratio.
    screenshot : str or os.PathLike, optional
        Image file to write, ``.png``, ``.jpg``, ``.tif`` or ``.bmp``.
    html : str or os.PathLike, optional
        Page to write: one file to rotate and zoom in any browser with WebGL, without network. Its
        size is 5 MB plus 60 bytes for each outer face of an element: 11 MB for 100 000 faces, 23 MB
        with ``edges="elements"``. A joint element takes 250 bytes. In a notebook the picture is
        such a page, and the file of the notebook contains it compressed, in 2 MB at least.
    show : bool, optional
        If False, no window opens and the plotter stays open: add to it, then call its ``show()`` or
        ``screenshot()``, and finally ``close()``.

    Returns
    -------
    pyvista.Plotter
        Plotter, which is closed unless `show` is False. Its actor ``"blocks"`` has the mesh of the
        outer faces of the blocks. The array ``"node"`` of its points and the array ``"element"`` of
        its cells have the rows of the simulation's arrays. Other actors are ``"edges"``,
        ``"contacts"``, ``"joints"`` and ``"moving"``. Those of joint states are ``"bonded"``,
        ``"failed in shear"``, ``"failed in tension"`` and ``"open or released"``, and those of
        traces have names such as ``"bonded, traces"``.

    Raises
    ------
    ValueError
        If a name is unknown, an array has the wrong shape, displacements are not finite, the model
        has no joints or contacts to draw, or `scale` is not 1 with `contacts`.
    FileNotFoundError
        If the folder has no results.
    ImportError
        If PyVista is not installed, or plotly for a page: ``pip install "ddem[plot]"``.
    RuntimeError
        If there is no display for a window.

    Examples
    --------
    >>> ddem.plot(sim, "stress", component="s1", screenshot="beam.png")
    >>> ddem.plot("results/beam-crack", joints="state", html="crack.html")
    """
    library = _pyvista()
    _check(view, edges, joints, scale, contacts)
    check_size(window_size)
    if show and screenshot is None and html is None and not _in_notebook():
        check_display(library)
    state = scene_of(simulation, frame, joints is not None, contacts)
    scale = _scale(state, scale, contacts)
    shown, bar = (field, component, label), (cmap, clim)
    layers = _drawn(state, shown, bar, (joints, joint_component), contacts, scale, edges, opacity)
    words = [state.title, about(state, scale, len(outside(state, scale)), layers[0].beyond)]
    if moving:
        layers += [_traces.moving(state, number, scale) for number in _moving(simulation, frame)]
    return present(layers, words, view, background, window_size, (screenshot, html), show)


def present(
    layers: list[Layer],
    words: list[str],
    view: str,
    background: str,
    window_size: tuple[int, int],
    files: tuple[str | os.PathLike[str] | None, str | os.PathLike[str] | None],
    show: bool,
) -> pv.Plotter:
    """Draw layers to a picture and a page, or in a window or notebook."""
    pv, (screenshot, html) = _pyvista(), files
    to_file = screenshot is not None or html is not None
    notebook = show and not to_file and _in_notebook()
    window = show and not to_file and not notebook
    if window:
        check_display(pv)
    if html is not None or notebook:
        page = page_of(layers, words, VIEWS, view, pv.Color(background).float_rgb, window_size)
        if html is not None:
            with open(html, "w", encoding="utf-8") as file:
                file.write(page)
        else:
            _inline(page, window_size)
    # Without a display VTK draws in another way, but prints warnings first.
    with pv.vtk_verbosity("off") if no_display() else nullcontext():
        hidden = True if to_file or notebook or no_display() else None
        plotter = pv.Plotter(off_screen=hidden, window_size=list(window_size), lighting="none")
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


def _pyvista() -> Any:
    try:
        import pyvista
    except ImportError as missing:
        raise ImportError('plots need PyVista: pip install "ddem[plot]"') from missing
    return pyvista


def check_display(pv: Any) -> None:
    """Raise a RuntimeError if there is no display for a window."""
    if no_display() and not pv.OFF_SCREEN:
        raise RuntimeError(
            'there is no display for a window: give screenshot="picture.png" or html="page.html"'
        )


def check_size(window_size: tuple[int, int]) -> None:
    """Raise a ValueError unless the window size is two positive numbers of pixels."""
    if len(window_size) != 2 or not all(size >= 1 for size in window_size):
        raise ValueError(f"window_size: {window_size!r} must be two positive numbers of pixels")


def _check(
    view: str, edges: str, joints: str | None, scale: float | None, contacts: bool
) -> None:
    """Raise a ValueError for unknown names and for magnifications that cannot be drawn."""
    one_of("view", view, VIEWS)
    one_of("edges", edges, ("blocks", "elements", "none"))
    if joints is not None:
        one_of("joints", joints, (*JOINTS, "traces"))
    if scale is not None and not np.isfinite(scale):
        raise ValueError(f"scale: {scale!r} is not finite")
    if contacts and scale not in (None, 1.0):
        raise ValueError(f"scale: must be 1 with contacts, found {scale!r}")


def _scale(state: Scene, scale: float | None, contacts: bool) -> float:
    """Magnification of the displacements, 1 with contacts, which are drawn at their true positions."""
    wrong = int((~np.isfinite(state.displacement)).any(axis=1).sum())
    if wrong:
        raise ValueError(f"displacement: not finite at {wrong} nodes, so the model cannot be drawn")
    if contacts:
        return 1.0
    return automatic_scale(state.points, state.displacement) if scale is None else scale


def _drawn(
    state: Scene,
    shown: tuple[str | npt.ArrayLike | None, str | None, str | None],
    bar: tuple[Any, tuple[float, float] | None],
    seams: tuple[str | None, str | None],
    contacts: bool,
    scale: float,
    edges: str,
    opacity: float | None,
) -> list[Layer]:
    """Layers of blocks, joints and contacts. If blocks are plain, `bar` is that of joints or contacts."""
    (field, component, label), (joints, joint_component) = shown, seams
    inside = joints not in (None, "traces") or contacts
    if field is None and not inside:
        field = "displacement"
    if opacity is None:
        opacity = 1.0 if not inside else 0.06 if field is None else 0.15
    layers = _layers.blocks(state, field, component, label, bar, scale, edges, opacity)
    if joints is not None:
        spare = bar if field is None or joints == "traces" else (None, None)
        layers += _joints(state, layers[0], joints, joint_component, spare, scale)
    if contacts:
        spare = bar if field is None and joints is None else (None, None)
        layers += _layers.contacts(state, spare)
    return layers


def _joints(
    state: Scene,
    blocks: Layer,
    name: str,
    component: str | None,
    bar: tuple[Any, tuple[float, float] | None],
    scale: float,
) -> list[Layer]:
    """Layers of joints: their faces, their traces on the outer faces of the model, or both."""
    if name == "traces":
        # Dark lines cannot be seen on dark blocks.
        if bar[0] is None and blocks.bar is not None and blocks.bar.shown:
            blocks.bar.cmap = _layers.pale(blocks.bar.cmap)
        return _traces.traces(state, scale, alone=True)
    layers = _layers.joints(state, name, component, bar, scale)
    return layers + (_traces.traces(state, scale, alone=False) if name == "state" else [])


def about(frame: Scene, scale: float, far: int = 0, beyond: str = "") -> str:
    """Line below the title: stage and time or step, magnification, blocks outside the picture."""
    words = [frame.when] if frame.when else []
    words.append("true displacements" if scale == 1.0 else f"displacements × {scale:g}")
    if far:
        there = f"{far} block{' is' if far == 1 else 's are'} far outside the picture"
        words.append(f"{there} ({beyond})" if beyond else there)
    return ", ".join(words)


def _moving(source: Any, index: int) -> list[Integers]:
    """Numbers of the moving blocks as one array in a list; an empty list if the stage does not fail."""
    seen = Results(source) if isinstance(source, (str, os.PathLike)) else source
    seen = seen[index] if isinstance(seen, Results) else seen
    if isinstance(seen, Frame):
        try:
            marked = seen.element_block[seen.field("unstable").reshape(-1) != 0]
        except ValueError:
            marked = np.empty(0, np.int64)
        if len(marked):
            return [np.unique(marked)]
        stage, stages_of = seen.stage, seen._results.stages
        # The summary names the blocks that move at the end of the stage, which its last frame shows.
        if (stages_of[seen.index + 1 :] == stage).any():
            return []
        try:
            stages = seen._results.summary["stages"]
        except FileNotFoundError:
            return []
        # A stage of the same name may have run more than once.
        done = [entry for entry in stages if entry["name"] == stage][-1:]
    else:
        done = seen.summary["stages"][-1:]
    blocks = [moved["index"] for entry in done for moved in entry.get("moving", [])]
    return [np.array(blocks, np.int64)] if blocks else []


def no_display() -> bool:
    named = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    return sys.platform.startswith("linux") and not named


def _in_notebook() -> bool:
    shell = sys.modules.get("IPython")
    shell = shell.get_ipython() if shell is not None else None
    return shell is not None and hasattr(shell, "kernel")


def _inline(page: str, size: tuple[int, int]) -> None:
    """Show a page below the cell of a notebook, without a server."""
    shell: Any = import_module("IPython.display")
    shell.display(shell.HTML(frame_of(page, size)))

"""Films of results: one scene whose points and colours change with the frames."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from . import _draw, _layers, _plot
from ._draw import VIEWS
from ._layers import Layer
from ._names import one_of
from ._results import Results
from ._scene import Floats, Scene, automatic_scale, outside, scene_of, values_of

Picture = npt.NDArray[np.uint8]

# Number of colours of a .gif, and approximate number of pictures that they are chosen from.
_COLOURS, _SAMPLES = 128, 6
# Shortest time for which a .gif shows its last picture [ms].
_REST = 1500
# Tangent of half the view angle of PyVista's camera, from the centre to the upper edge.
_HALF = np.tan(np.radians(15.0))


def animate(
    results: Results | str | os.PathLike[str],
    file: str | os.PathLike[str] = "film.gif",
    field: str | npt.ArrayLike | None = None,
    *,
    component: str | None = None,
    scale: float | None = None,
    frames: slice | Iterable[int] | None = None,
    fps: float = 15.0,
    view: str = "iso",
    camera: Sequence[Sequence[float]] | None = None,
    cmap: Any = None,
    clim: tuple[float, float] | None = None,
    edges: Literal["blocks", "elements", "none"] = "blocks",
    label: str | None = None,
    title: str | None = None,
    background: str = "white",
    window_size: tuple[int, int] = (900, 600),
) -> Path:
    """Draw the frames of results as a film, without removed blocks.

    Colours, magnification and camera are the same in all frames, so that frames can be compared.

    Parameters
    ----------
    results : Results, str or os.PathLike
        Results, or their folder.
    file : str or os.PathLike, optional
        Film to write, ``.gif`` or ``.mp4``; ``.mp4`` needs ``pip install "imageio[ffmpeg]"``.
    field : str or array, optional
        Colour of the blocks, as in :func:`plot`: the name of a field, or your own array with a row
        for each node or element. An array is the same in all frames; blocks are grey where it is
        NaN. By default the displacement.
    component : str, optional
        Component of vectors and stresses, as in :func:`plot`.
    scale : float, optional
        Magnification of the displacements; by default chosen from the largest displacement.
    frames : slice or sequence of int, optional
        Frames to draw; ``slice(None, None, 2)`` takes every second one. By default all.
    fps : float, optional
        Frames per second. In a ``.gif`` the time of each is rounded to hundredths of a second.
    view : str, optional
        Direction of view, as in :func:`plot`. The picture fits the blocks of all frames, except
        the few that are far away.
    camera : (position, focal point, up), optional
        Camera instead of `view`, in the form of PyVista's ``plotter.camera_position``. The distance
        between position and focal point sets the size of the part that is seen.
    cmap : str or matplotlib.colors.Colormap, optional
        Colour map, as in :func:`plot`.
    clim : (float, float), optional
        Values at the ends of the colour map; by default the range of all frames.
    edges : {"blocks", "elements", "none"}, optional
        Lines to draw.
    label : str, optional
        Title of the colour bar.
    title : str, optional
        Title of the film; by default that of the model.
    background : str, optional
        Any colour that PyVista knows.
    window_size : (int, int), optional
        Width and height in pixels.

    Returns
    -------
    pathlib.Path
        Path of the film.

    Raises
    ------
    TypeError
        If `results` is neither Results nor a path.
    ValueError
        If a name is unknown, `fps`, `camera` or `window_size` is invalid, there are no frames, or
        the file is neither ``.gif`` nor ``.mp4``.
    FileNotFoundError
        If the folder has no results.
    ImportError
        If PyVista is not installed: ``pip install "ddem[plot]"``.

    Examples
    --------
    >>> ddem.animate("results/beam-crack", "crack.gif", "velocity", fps=10)
    """
    try:
        import pyvista as pv
    except ImportError as missing:
        raise ImportError('films need PyVista: pip install "ddem[plot]"') from missing
    path = Path(file)
    one_of("file", path.suffix.lower(), (".gif", ".mp4"))
    one_of("view", view, VIEWS)
    one_of("edges", edges, ("blocks", "elements", "none"))
    if not (np.isfinite(fps) and fps > 0.0):
        raise ValueError(f"fps: {fps!r} must be above 0")
    _plot.check_size(window_size)
    source = results if isinstance(results, Results) else Results(results)
    numbers = _numbers(source, frames)
    write = _gif if path.suffix.lower() == ".gif" else _mp4()
    if field is None:
        field = "displacement"
    drawn = _Drawn(source, (field, component, label), (cmap, clim), edges)
    extent = _Extent(view, 1.0 if scale is None else scale)
    for number in numbers:
        extent.add(drawn.at(number), drawn.frame)
        drawn.widen()
    drawn.scale = extent.choose(drawn.frame.points) if scale is None else scale
    layers = drawn.at(numbers[0], anew=True)
    name = drawn.frame.title if title is None else title
    with pv.vtk_verbosity("off") if _plot.no_display() else nullcontext():
        plotter = pv.Plotter(off_screen=True, window_size=list(window_size), lighting="none")
        try:
            text = _draw.fill(plotter, layers, [name, " "], view, background)
            if camera is None:
                _draw.look(plotter, extent.corners(drawn.scale), view)
            else:
                _aim(plotter, camera)

            def picture(number: int) -> Picture:
                _show(plotter, drawn.at(number))
                far = len(outside(drawn.frame, drawn.scale)) if camera is None else 0
                text.input = _plot.about(drawn.frame, drawn.scale, far)
                plotter.reset_camera_clipping_range()
                plotter.render()
                shown: Any = plotter.screenshot(return_img=True)
                return np.asarray(shown)

            write(path, picture, numbers, fps)
        finally:
            plotter.close()
    return path


def _numbers(results: Results, frames: slice | Iterable[int] | None) -> list[int]:
    """Numbers of the frames to draw."""
    every = range(len(results))
    if frames is None or isinstance(frames, slice):
        numbers = list(every[frames or slice(None)])
    else:
        numbers = [int(number) for number in frames]
        for number in numbers:
            if not -len(every) <= number < len(every):
                raise ValueError(f"frames: {number} does not exist, there are {len(every)} frames")
        numbers = [number % len(every) for number in numbers]
    if not numbers:
        raise ValueError(f"frames: the selection is empty; {results.folder} has {len(every)} frames")
    return numbers


class _Drawn:
    """Layers of one frame after another.

    Outer faces and lines are found again only if the removed blocks change or fragments are coloured.
    """

    def __init__(
        self,
        results: Results,
        shown: tuple[str | npt.ArrayLike, str | None, str | None],
        bar: tuple[Any, tuple[float, float] | None],
        edges: str,
    ) -> None:
        self.scale = 1.0
        self.frame: Scene
        self._results, self._shown, self._edges = results, shown, edges
        self._cmap, self._clim = bar
        # Neighbouring fragments differ in colour, and neighbours change from frame to frame.
        self._changing = isinstance(shown[0], str) and shown[0] == "fragment"
        self._range = (np.inf, -np.inf)
        self._layers: list[Layer] = []
        self._removed: npt.NDArray[np.bool_] | None = None

    def at(self, number: int, anew: bool = False) -> list[Layer]:
        """Layers of a frame, which the next call of this method changes."""
        frame = self.frame = scene_of(self._results, number, joints=False)
        same = self._removed is not None and np.array_equal(frame.removed, self._removed)
        if anew or self._changing or not same:
            bar = (self._cmap, self._clim)
            field, component, label = self._shown
            self._layers = _layers.blocks(
                frame, field, component, label, bar, self.scale, self._edges, 1.0
            )
            self._removed = frame.removed
        else:
            moved = frame.points + self.scale * frame.displacement
            for layer in self._layers:
                layer.points = moved[layer.nodes]
            blocks = self._layers[0]
            if blocks.values is not None:
                values = values_of(frame, *self._shown)
                blocks.values = values.scalars[blocks.nodes if values.on_nodes else blocks.owners]
            blocks.far = _layers.far_points(frame, blocks, self.scale)
        blocks = self._layers[0]
        if not self._changing and self._range[0] <= self._range[1] and blocks.bar is not None:
            ends = np.array(self._range)
            old = blocks.bar
            blocks.bar = _layers.bar_of(old.label, ends, self._cmap, self._clim, unit=old.unit)
        return self._layers

    def widen(self) -> None:
        """Extend the range of the colour map to the values of this frame."""
        values = self._layers[0].values
        if values is not None and (finite := values[np.isfinite(values)]).size:
            low, high = self._range
            self._range = (min(low, float(finite.min())), max(high, float(finite.max())))


class _Extent:
    """Extent of the blocks in the picture, over all frames."""

    def __init__(self, view: str, scale: float) -> None:
        self._axes = np.column_stack(_draw.axes(view))
        self._scale = scale
        self._low, self._high = np.full((2, 2, 3), [[[np.inf]], [[-np.inf]]])
        self._most = np.zeros((1, 3))

    def add(self, layers: list[Layer], frame: Scene) -> None:
        """Include a frame: the drawn positions of its blocks, and their displacements."""
        rows, far = layers[0].nodes, layers[0].far
        if rows is None or len(rows) == 0:
            return
        if far is not None:
            rows = rows[~far]
        points, moved = frame.points[rows], frame.displacement[rows]
        lengths = np.linalg.norm(moved, axis=1)
        if lengths.max() > np.linalg.norm(self._most):
            self._most = moved[[lengths.argmax()]]
        for at, seen in enumerate(((points + self._scale * moved), moved)):
            seen = seen @ self._axes
            self._low[at] = np.minimum(self._low[at], seen.min(axis=0))
            self._high[at] = np.maximum(self._high[at], seen.max(axis=0))

    def choose(self, points: Floats) -> float:
        """Magnification that suits the largest displacement."""
        return automatic_scale(points, self._most)

    def corners(self, scale: float) -> Floats:
        """Corners of a box around all frames, with edges along the axes of the view."""
        # If the magnification was chosen later, the largest displacements bound the additional ones.
        more = scale - self._scale
        low = self._low[0] + more * np.minimum(self._low[1], 0.0)
        high = self._high[0] + more * np.maximum(self._high[1], 0.0)
        box = np.array([[(low, high)[k][axis] for axis, k in enumerate(c)] for c in np.ndindex(2, 2, 2)])
        corners: Floats = box @ self._axes.T
        return corners


def _show(plotter: Any, layers: list[Layer]) -> None:
    """Give the meshes of the scene the points and values of the layers."""
    for layer in layers:
        actor = plotter.actors.get(layer.name)
        if actor is None:
            continue
        # A new mesh, not changes in place: PyVista draws a copy of the mesh.
        actor.mapper.dataset = _draw.mesh_of(layer)


def _aim(plotter: Any, camera: Sequence[Sequence[float]]) -> None:
    """Point the camera from its position to the focal point, in parallel projection."""
    points = np.asarray(camera, np.float64)
    if points.shape != (3, 3) or not np.isfinite(points).all():
        raise ValueError("camera: expected three vectors: position, focal point and up")
    position, focus, up = points
    plotter.camera.parallel_projection = True
    plotter.camera.parallel_scale = np.linalg.norm(position - focus) * _HALF
    plotter.camera.focal_point, plotter.camera.position = tuple(focus), tuple(position)
    plotter.camera.up = tuple(up)


Draw = Callable[[int], Picture]


def _gif(path: Path, draw: Draw, numbers: list[int], fps: float) -> None:
    """Write a .gif with one palette for all pictures, so that unchanged areas take no space."""
    from PIL import Image

    samples = numbers[:: max(1, len(numbers) // _SAMPLES)]
    tall = np.vstack([draw(number) for number in samples])
    palette = Image.fromarray(tall).quantize(_COLOURS, method=Image.Quantize.MEDIANCUT, kmeans=3)

    def pictures() -> Iterator[Image.Image]:
        for number in numbers:
            picture = Image.fromarray(draw(number))
            yield picture.quantize(palette=palette, dither=Image.Dither.NONE)

    each = max(round(100.0 / fps), 2) * 10
    first, *others = pictures()
    times = [each] * len(others) + [max(each, _REST)]
    first.save(path, "GIF", save_all=True, append_images=others, duration=times, loop=0)


def _mp4() -> Callable[[Path, Draw, list[int], float], None]:
    """Return the function that writes a film with ffmpeg; raise an ImportError if ffmpeg is missing."""
    try:
        import imageio_ffmpeg  # noqa: F401
        from imageio.v2 import get_writer
    except ImportError as missing:
        raise ImportError('films as .mp4 need pip install "imageio[ffmpeg]"') from missing

    def write(path: Path, draw: Draw, numbers: list[int], fps: float) -> None:
        # ffmpeg needs an even width and an even height.
        writer: Any = get_writer(path, fps=fps, macro_block_size=2)
        with writer as film:
            for number in numbers:
                film.append_data(draw(number))

    return write

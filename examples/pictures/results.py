"""Shared parts of the pictures: scenes by `ddem.plot`, sheets, fields of results, and the style."""

import io
from pathlib import Path

import ddem
import matplotlib
import matplotlib.pyplot as plt
import numpy as np
from PIL import Image

matplotlib.use("Agg")

INK = "#1f2933"
FAINT = "#52606d"
LOAD = "#c0392b"
GROUND = "#d5dae0"
ROOT = Path(__file__).resolve().parents[2]
PICTURES = ROOT / "docs" / "pictures"
# Largest size of a picture in bytes.
MOST = 300_000

matplotlib.rcParams.update(
    {
        "figure.dpi": 150,
        "font.size": 11,
        "text.color": INK,
        "axes.labelcolor": INK,
        "axes.edgecolor": FAINT,
        "axes.linewidth": 0.8,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "xtick.color": FAINT,
        "ytick.color": FAINT,
    }
)


class Frames:
    """The blocks or the joints of results: points and fields, frame by frame."""

    def __init__(self, path):
        if not path.exists():
            name = path.parent.name
            raise SystemExit(f"{path}: not there; cargo run --release -- examples/{name}.toml")
        self.results, self.joints = ddem.Results(path.parent), path.stem == "joints"
        self.times, first = self.results.times, self.results[0]
        self.points = first.pairs["point"] if self.joints else first.points
        self.cells = (first.quads if self.joints else first.elements).reshape(-1)

    def point_field(self, name, frame=-1):
        """Field on the points."""
        return self.results[frame].pairs[name] if self.joints else self.results[frame][name]

    def cell_field(self, name, frame=-1):
        """Field on the cells."""
        return self.results[frame][name]


def results(name):
    """Folder of the results of an example."""
    return ROOT / "results" / name


def save(figure, name):
    """Writes a figure."""
    whole = io.BytesIO()
    figure.savefig(whole, facecolor="white")
    write(Image.open(whole), PICTURES / name)


def write(picture, path):
    """Writes a picture, with only 256 colours if it would be too large, and prints its path."""
    path.parent.mkdir(parents=True, exist_ok=True)
    picture = picture.convert("RGB")
    picture.save(path, optimize=True)
    if path.stat().st_size > MOST:
        picture.quantize(256, kmeans=3, dither=Image.Dither.NONE).save(path, optimize=True)
    print(path)


def nearest(results, time):
    """The frame nearest to a time in motion."""
    return results[int(np.abs(results.times - time).argmin())]


def by_block(frame, values, least=0.0):
    """Mean over its block for each element; NaN, which is drawn grey, below `least`."""
    _, block = np.unique(frame.element_block, return_inverse=True)
    means = (np.bincount(block, values) / np.bincount(block))[block]
    return np.where(means < least, np.nan, means)


def speed(frame, least):
    """Speed of its block (m/s) for each element; NaN below `least`."""
    nodes = np.linalg.norm(frame.velocity, axis=1)
    return by_block(frame, nodes[frame.elements].mean(axis=1), least)


SIDE = (0.0, -1.0, 0.0)


def scene(frame, values, focus, height, size, direction=SIDE, behind=None, bold=1.0, scale=1.0, **look):
    """A picture of the model alone by `ddem.plot`: `height` metres around `focus`, seen from a
    direction, cut open to the part `behind` a plane across y. `bold` widens the traces of failed
    joints. Displacements are true unless a `scale` is given.
    """
    plotter = ddem.plot(frame, values, scale=scale, window_size=size, show=False, **look)
    for words in plotter.renderer.GetActors2D():
        words.VisibilityOff()
    plotter.hide_axes()
    for name, actor in plotter.actors.items():
        if name.endswith(", traces") and not name.startswith("bonded"):
            actor.prop.line_width *= bold
    if behind is not None:
        _open(plotter, frame, behind)
    camera, back = plotter.camera, np.array(direction) / np.linalg.norm(direction)
    camera.focal_point, camera.position = focus, np.array(focus) + 100.0 * back
    camera.up, camera.parallel_scale = (0.0, 0.0, 1.0), 0.5 * height
    plotter.reset_camera_clipping_range()
    picture = plotter.screenshot(return_img=True)
    plotter.close()
    return picture


def _open(plotter, frame, plane):
    """Keeps the blocks whose centre is behind the plane, with their edges."""
    middles = by_block(frame, frame.points[frame.elements][:, :, 1].mean(axis=1))
    mapper = plotter.actors["blocks"].mapper
    faces = mapper.dataset
    kept = faces.extract_cells(middles[faces["element"]] > plane)
    kept = kept.extract_surface(algorithm="dataset_surface")
    edges = kept.extract_feature_edges(30.0, non_manifold_edges=False, manifold_edges=False)
    mapper.dataset, plotter.actors["edges"].mapper.dataset = kept, edges


def sheet(size, title, about):
    """An empty figure with its title and a subtitle."""
    figure = plt.figure(figsize=size)
    figure.text(0.02, 1.0 - 0.5 / size[1], title, size=21, weight="bold")
    figure.text(0.02, 1.0 - 0.82 / size[1], about, size=13, color=FAINT)
    return figure


def panel(figure, place, words, draw):
    """A part of a figure with a title line: `place` is left, low, width, height in inches, and
    `draw` makes the picture for a size in pixels.
    """
    left, low, width, height = np.array(place) / np.tile(figure.get_size_inches(), 2)
    axes = figure.add_axes((left, low, width, height))
    pixels = tuple(int(round(figure.dpi * length)) for length in place[2:])
    axes.imshow(draw(pixels), aspect="auto", interpolation="antialiased")
    axes.axis("off")
    axes.set_title(words, loc="left", size=13, weight="bold", pad=5)


def colour_bar(figure, place, cmap, clim, label):
    """Colour bar; `place` as for a panel."""
    colours = plt.cm.ScalarMappable(cmap=cmap)
    colours.set_clim(*clim)
    axes = figure.add_axes(np.array(place) / np.tile(figure.get_size_inches(), 2))
    figure.colorbar(colours, cax=axes, orientation="horizontal").set_label(label)


def side(frames, axis, place):
    """Faces of elements on a plane: four points each, in order, and their cells."""
    corners = frames.cells.reshape(-1, 8)
    on_plane = np.abs(frames.points[corners][:, :, axis] - place) < 1e-9
    cells = np.flatnonzero(on_plane.sum(axis=1) == 4)
    faces = corners[cells][on_plane[cells]].reshape(-1, 4)
    flat = np.delete(frames.points[faces], axis, axis=2)
    off = flat - flat.mean(axis=1, keepdims=True)
    order = np.argsort(np.arctan2(off[:, :, 1], off[:, :, 0]), axis=1)
    return np.take_along_axis(faces, order, axis=1), cells


def outlines(faces, blocks):
    """Edges of faces that belong to one element of a block only: pairs of points."""
    edges = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2)
    keyed = np.sort(edges.reshape(-1, 2), axis=1)
    keyed = np.column_stack([np.repeat(blocks, 4), keyed])
    unique, count = np.unique(keyed, axis=0, return_counts=True)
    return unique[count == 1][:, 1:]

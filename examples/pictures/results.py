"""Fields of results for pictures by matplotlib, and the style of these."""

from pathlib import Path

import ddem
import matplotlib
import numpy as np

matplotlib.use("Agg")

INK = "#1f2933"
FAINT = "#52606d"
LOAD = "#c0392b"
GROUND = "#d5dae0"
ROOT = Path(__file__).resolve().parents[2]
PICTURES = ROOT / "docs" / "pictures"

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
        """A field on the points."""
        return self.results[frame].pairs[name] if self.joints else self.results[frame][name]

    def cell_field(self, name, frame=-1):
        """A field on the cells."""
        return self.results[frame][name]


def results(name):
    """Folder of the results of an example."""
    return ROOT / "results" / name


def save(figure, name):
    """Writes a picture and says where."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    path = PICTURES / name
    figure.savefig(path, facecolor="white")
    print(path)


def side(frames, axis, place):
    """Faces of elements that lie on a plane: four points each, in order, and their cells."""
    corners = frames.cells.reshape(-1, 8)
    on_plane = np.abs(frames.points[corners][:, :, axis] - place) < 1e-9
    cells = np.flatnonzero(on_plane.sum(axis=1) == 4)
    faces = corners[cells][on_plane[cells]].reshape(-1, 4)
    flat = np.delete(frames.points[faces], axis, axis=2)
    off = flat - flat.mean(axis=1, keepdims=True)
    order = np.argsort(np.arctan2(off[:, :, 1], off[:, :, 0]), axis=1)
    return np.take_along_axis(faces, order, axis=1), cells


def outlines(faces, blocks):
    """Edges of faces that only one element of a block has: pairs of points."""
    edges = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2)
    keyed = np.sort(edges.reshape(-1, 2), axis=1)
    keyed = np.column_stack([np.repeat(blocks, 4), keyed])
    unique, count = np.unique(keyed, axis=0, return_counts=True)
    return unique[count == 1][:, 1:]

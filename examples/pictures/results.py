"""Reads results of ddem with h5py alone, and the style of the pictures."""

from pathlib import Path

import h5py
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
    """One VTKHDF file: points and fields, frame by frame."""

    def __init__(self, path):
        if not path.exists():
            name = path.parent.name
            raise SystemExit(f"{path}: not there; cargo run --release -- examples/{name}.toml")
        self.group = h5py.File(path)["VTKHDF"]
        self.times = self.group["Steps/Values"][:]
        self.points = self.group["Points"][:]
        self.cells = self.group["Connectivity"][:]

    def point_field(self, name, frame=-1):
        """A field on the points."""
        first = int(self.group[f"Steps/PointDataOffsets/{name}"][frame])
        return self.group[f"PointData/{name}"][first : first + len(self.points)]

    def cell_field(self, name, frame=-1):
        """A field on the cells."""
        first = int(self.group[f"Steps/CellDataOffsets/{name}"][frame])
        count = int(np.ravel(self.group["NumberOfCells"])[0])
        return self.group[f"CellData/{name}"][first : first + count]


def results(name):
    """Folder of the results of an example."""
    return ROOT / "results" / name


def save(figure, name):
    """Writes a picture and says where."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    path = PICTURES / name
    figure.savefig(path, facecolor="white")
    print(path)

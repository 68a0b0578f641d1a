"""Command ``python -m ddem plot DIR``, which ``ddem plot`` calls."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np

from ._draw import VIEWS
from ._names import JOINTS, one_of
from ._plot import plot
from ._results import Results

# A model is thin if its smallest size is below this part of the next larger one.
_THIN = 0.1


def _arguments() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m ddem", description="Pictures of results.")
    commands = parser.add_subparsers(dest="command", required=True)
    draw = commands.add_parser("plot", prog="ddem plot", help="draw results to a picture")
    draw.add_argument("folder", metavar="DIR", help="folder of the results")
    draw.add_argument("--field", metavar="NAME", help="field of the blocks or joints")
    draw.add_argument("--frame", metavar="N", default="last", type=_frame)
    draw.add_argument("--view", choices=list(VIEWS))
    draw.add_argument("--scale", metavar="X", type=float, help="magnification of displacements")
    draw.add_argument("--out", metavar="FILE.png", type=Path, help="image file (default: DIR/plot.png)")
    return parser


def _frame(text: str) -> int:
    if text == "last":
        return -1
    try:
        return int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is neither a whole number nor 'last'") from None


def draw(given: argparse.Namespace) -> Path:
    """Draw a picture of a folder of results and return its path."""
    results = Results(given.folder)
    if not -len(results) <= given.frame < len(results):
        raise ValueError(f"--frame: {given.frame} does not exist, the folder has {len(results)} frames")
    frame = results[given.frame]
    if given.field is not None:
        one_of("--field", given.field, frame.fields)
    options: dict[str, Any] = {"field": given.field, "scale": given.scale}
    if (results.folder / "joints.vtkhdf").exists():
        options["joints"] = "traces"
        if given.field in JOINTS:
            options |= {"field": None, "joints": given.field}
    view = given.view or _view(frame.points)
    path: Path = given.out or results.folder / "plot.png"
    plot(frame, moving=True, view=view, screenshot=path, **options)
    return path


def _view(points: Any) -> str:
    """View of a thin model along its thin axis, and of any other model from a corner."""
    size = np.ptp(points, axis=0)
    thin = size < _THIN * np.sort(size)[1]
    return dict(zip((0, 1, 2), ("yz", "xz", "xy")))[int(size.argmin())] if thin.any() else "iso"


def main() -> int:
    """Run the command and return its exit status: 2 if the picture cannot be drawn, otherwise 0."""
    given = _arguments().parse_args()
    try:
        print(draw(given))
    except (ValueError, ImportError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())

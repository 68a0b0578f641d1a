"""Files of results: VTKHDF files, read by VTK, tables, and the message about missing results."""

from __future__ import annotations

import csv
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ._ddem import _near
from ._names import choices

# Every folder of results has at least one of these files.
LOOKED_FOR = ("frames.csv", "blocks.vtkhdf", "probes.csv", "energy.csv", "summary.json")


class Read:
    """Contents of one frame of a VTKHDF file."""

    def __init__(self, grid: Any) -> None:
        self.points = np.array(grid.points, np.float64)
        self.cells = np.array(grid.cell_connectivity, np.int64)
        self.nodal = {name: np.array(grid.point_data[name]) for name in grid.point_data.keys()}
        self.elemental = {name: np.array(grid.cell_data[name]) for name in grid.cell_data.keys()}


class File:
    """A VTKHDF file with its time steps."""

    def __init__(self, path: Path) -> None:
        try:
            import pyvista  # noqa: F401
            from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
            from vtkmodules.vtkIOHDF import vtkHDFReader
        except ImportError as missing:
            message = 'fields of results are read with PyVista: pip install "ddem[plot]"'
            raise ImportError(message) from missing
        if not path.exists():
            raise FileNotFoundError(f"{path} does not exist")
        self._path = path
        self._reader: Any = vtkHDFReader()
        # VTK tells its errors to observers, and goes on without what it could not read.
        self._errors: list[str] = []
        for source in (self._reader, self._reader.GetExecutive()):
            source.AddObserver("ErrorEvent", self._heard)
        self._reader.SetFileName(os.fspath(path))
        self._update(self._reader.UpdateInformation)
        self._check()
        information = self._reader.GetOutputInformation(0)
        self.times = information.Get(vtkStreamingDemandDrivenPipeline.TIME_STEPS()) or ()
        # Last frame read: callers often read several fields of a frame.
        self._last: tuple[int, Read] | None = None

    def read(self, index: int) -> Read:
        """Contents of one frame. Callers must not change them."""
        import pyvista as pv

        if self._last is None or self._last[0] != index:
            if index < len(self.times):
                self._update(lambda: self._reader.UpdateTimeStep(self.times[index]))
            self._check(index < len(self.times))
            self._last = (index, Read(pv.wrap(self._reader.GetOutputDataObject(0))))
        return self._last[1]

    def __reduce__(self) -> tuple[type[File], tuple[Path]]:
        """Support of `copy` and `pickle`, as readers of VTK have none."""
        return File, (self._path,)

    def _heard(self, *_: object) -> None:
        self._errors.append("damaged")

    def _update(self, work: Callable[[], object]) -> None:
        """Lets the reader work. Its errors about parts of arrays are heard by the window of VTK only."""
        from vtkmodules.vtkCommonCore import vtkOutputWindow

        window = vtkOutputWindow.GetInstance()
        heard = window.AddObserver("ErrorEvent", self._heard)
        try:
            work()
        finally:
            window.RemoveObserver(heard)

    def _check(self, has_step: bool = True) -> None:
        """Raises an error if the reader has met one, or if a time step is missing."""
        if self._errors or not has_step:
            raise OSError(f"{self._path} is damaged: restore it, or run the deck again")


def rows_of(path: Path) -> tuple[list[str], list[list[str]]]:
    """Header and complete rows of a table. The last row of a killed run may be incomplete."""
    with open(path, encoding="utf-8", newline="") as file:
        header, *rows = csv.reader(file)
    return header, [row for row in rows if len(row) == len(header)]


def not_there(folder: Path) -> str:
    """Message about a folder without results. It names nearby folders that have results."""
    if folder.is_file():
        return f"{folder} is a file: results are in a folder, such as {str(folder.parent)!r}"
    looked = ", ".join(LOOKED_FOR)
    message = f"{folder} has no results: none of these files exists: {looked}"
    around = folder
    if not folder.exists():
        message, around = f"{folder} does not exist", folder.parent
        meant = _near(folder)
        if meant is not None and any((meant / name).exists() for name in LOOKED_FOR):
            return f"{message}; did you mean {str(meant)!r}?"
    inside = sorted(around.iterdir()) if around.is_dir() else []
    near = [str(path) for path in inside if any((path / name).exists() for name in LOOKED_FOR)]
    return f"{message}; {choices(str(folder), near)}" if near else message

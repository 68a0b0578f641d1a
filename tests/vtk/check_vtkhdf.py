"""Reads a .vtkhdf file with VTK's own reader and prints its contents as JSON.

    python check_vtkhdf.py FILE

Prints the times, and for each of them the number of points and cells, the cell types, the bounds
and every array: components, number of rows, smallest and largest value, sum over all numbers, and
the sum weighted by position (1, 2, 3, ... over the numbers in order), which also detects values
that moved. Smallest, largest and sums leave out NaN; "nan" counts them.

Needs VTK 9.3 or newer and NumPy, but neither a display nor OpenGL.
"""

import json
import sys

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkOutputWindow, vtkStringOutputWindow
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
from vtkmodules.vtkIOHDF import vtkHDFReader


def describe_array(array):
    values = vtk_to_numpy(array)
    flat = values.astype(float).ravel()
    number = np.isfinite(flat)
    kept = flat[number]
    place = np.arange(1, flat.size + 1, dtype=float)[number]
    return {
        "type": str(values.dtype),
        "components": array.GetNumberOfComponents(),
        "rows": array.GetNumberOfTuples(),
        "nan": int(flat.size - kept.size),
        "min": float(kept.min()) if kept.size else None,
        "max": float(kept.max()) if kept.size else None,
        "sum": float(kept.sum()),
        "weighted": float((kept * place).sum()),
    }


def describe_data(data):
    return {data.GetArrayName(i): describe_array(data.GetArray(i))
            for i in range(data.GetNumberOfArrays())}


def describe_grid(grid, time):
    cells = range(grid.GetNumberOfCells())
    points = grid.GetPoints()
    cell_array = grid.GetCells()
    return {
        "time": time,
        "points": grid.GetNumberOfPoints(),
        "cells": grid.GetNumberOfCells(),
        "cell_types": sorted({grid.GetCellType(i) for i in cells}),
        "coordinates": describe_array(points.GetData()) if points else None,
        "connectivity": describe_array(cell_array.GetConnectivityArray()) if cell_array else None,
        "point_data": describe_data(grid.GetPointData()),
        "cell_data": describe_data(grid.GetCellData()),
    }


def main(path):
    messages = vtkStringOutputWindow()
    vtkOutputWindow.SetInstance(messages)
    reader = vtkHDFReader()
    if not reader.CanReadFile(path):
        sys.exit(f"{path}: VTK does not take it for a VTKHDF file")
    reader.SetFileName(path)
    reader.UpdateInformation()
    information = reader.GetOutputInformation(0)
    times = information.Get(vtkStreamingDemandDrivenPipeline.TIME_STEPS()) or ()
    steps = []
    # A file without time steps is read as it is.
    for time in times or (None,):
        reader.Update() if time is None else reader.UpdateTimeStep(time)
        steps.append(describe_grid(reader.GetOutputDataObject(0), time))
    if messages.GetOutput():
        sys.exit(f"{path}: {messages.GetOutput()}")
    json.dump({"file": path, "times": list(times), "steps": steps}, sys.stdout, indent=1)
    print()


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])

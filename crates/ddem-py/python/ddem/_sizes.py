"""Fragments, read from a folder of results, and pictures of their sizes."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import numpy.typing as npt

from ._results import Results
from ._scene import Source
from ._table import Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Fragments: TypeAlias = "Source | npt.NDArray[np.void]"


def read_fragments(folder: str | os.PathLike[str], stage: str | None = None) -> Table:
    """Read the fragments at the end of a stage from a folder of results.

    Parameters
    ----------
    folder : str or os.PathLike
        Folder of results, with ``fragments.csv``.
    stage : str, optional
        Name of the stage; by default the last one that was run.

    Returns
    -------
    Table
        Table as :attr:`Simulation.fragments`.

    Raises
    ------
    ValueError
        If no stage of that name has run.
    FileNotFoundError
        If the folder has no ``fragments.csv``.

    Examples
    --------
    >>> sizes = ddem.read_fragments("results/beam-crack")["size"]
    """
    return Results(folder).fragments(stage)


def plot_sizes(
    fragments: Fragments,
    *,
    stage: str | None = None,
    file: str | os.PathLike[str] | None = None,
) -> Figure:
    """Draw the size distribution of fragments: passing by mass over size.

    Parameters
    ----------
    fragments : Simulation, Results, str, os.PathLike or structured array
        A simulation in its present state, results or their folder, or some of the rows of
        :attr:`Simulation.fragments`.
    stage : str, optional
        Name of the stage of a folder, at whose end fragments are drawn; by default the last one
        that was run.
    file : str or os.PathLike, optional
        Image file to write, in any format of matplotlib.

    Returns
    -------
    matplotlib.figure.Figure
        Figure of the cumulative passing by mass (%) over the equivalent size (m), the edge of a
        cube of the same volume, on a logarithmic axis.

    Raises
    ------
    ValueError
        If there are no fragments, no stage of that name has run, or `stage` is given without a
        folder.
    FileNotFoundError
        If the folder has no ``fragments.csv``.
    ImportError
        If matplotlib is not installed: ``pip install "ddem[plot]"``.

    Examples
    --------
    >>> ddem.plot_sizes(sim, file="sizes.png")
    """
    try:
        import matplotlib.pyplot as plt
    except ImportError as missing:
        raise ImportError('plots need matplotlib: pip install "ddem[plot]"') from missing
    if isinstance(fragments, (str, os.PathLike)):
        fragments = Results(fragments)
    if isinstance(fragments, Results):
        rows: npt.NDArray[np.void] = fragments.fragments(stage)
    elif stage is not None:
        raise ValueError("stage: only folders of results have stages")
    else:
        rows = np.asarray(getattr(fragments, "fragments", fragments))
    if rows.dtype.names is None or not {"size", "mass"} <= set(rows.dtype.names):
        raise ValueError("fragments: expected a simulation, a folder of results or rows of `Simulation.fragments`")
    if len(rows) == 0:
        raise ValueError("fragments: there are no fragments to draw")
    # Passing is a part of the mass of the given rows, of which the largest fragment comes first.
    passing = 100.0 * np.cumsum(rows["mass"][::-1])[::-1] / rows["mass"].sum()
    figure, axes = plt.subplots(figsize=(7.0, 4.5), layout="constrained")
    # Passing is constant between one size and the next larger one.
    steps = {"drawstyle": "steps-pre", "marker": "o", "markersize": 3, "linewidth": 1.4}
    axes.plot(rows["size"], passing, **steps)
    axes.set_xscale("log")
    _mark(axes, rows["size"])
    axes.set_ylim(0.0, 102.0)
    axes.set_xlabel("size (m)")
    axes.set_ylabel("passing by mass (%)")
    number = len(rows)
    axes.set_title(f"{number} fragment{'s' if number > 1 else ''}", loc="left")
    axes.grid(alpha=0.25, which="both")
    if file is not None:
        figure.savefig(os.fspath(file), dpi=150)
    return figure


def _mark(axes: Any, sizes: npt.NDArray[np.float64]) -> None:
    """Mark a logarithmic axis with plain numbers, few enough that they do not overlap."""
    from matplotlib import ticker

    low, high = float(sizes.min()), float(sizes.max())
    if high < 1.05 * low:
        # All fragments have one size: the axis needs some length around it.
        low, high = 0.5 * low, 2.0 * high
        axes.set_xlim(low, high)
    marks: Any = ticker.MaxNLocator(7, steps=[1, 2, 2.5, 5, 10])
    if high > 4.0 * low:
        decades = np.log10(high / low)
        marks = ticker.LogLocator(subs=(1.0, 2.0, 5.0) if decades < 3.0 else (1.0,))
    else:
        axes.xaxis.set_minor_locator(ticker.NullLocator())
    axes.xaxis.set_major_locator(marks)
    axes.xaxis.set_major_formatter(ticker.FuncFormatter(lambda size, _: f"{size:g}"))
    axes.xaxis.set_minor_formatter(ticker.NullFormatter())

"""Histories of probes, read from a folder of results and drawn over time."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from importlib import import_module
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import numpy.typing as npt

from ._names import UNITS, VECTOR, one_of
from ._results import Results
from ._scene import Source
from ._table import Histories

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Probes: TypeAlias = "Source | Mapping[str, npt.NDArray[np.void]]"


def read_probes(folder: str | os.PathLike[str]) -> Histories:
    """Read the histories of probes from a folder of results.

    Parameters
    ----------
    folder : str or os.PathLike
        Folder of results, with ``probes.csv``.

    Returns
    -------
    dict of str to Table
        Table of each probe, by the name of the probe, with a row for each sample. The columns are
        ``time`` (s), ``step``, and ``x``, ``y``, ``z``; for stresses ``xx``, ``yy``, ``zz``,
        ``xy``, ``yz``, ``zx``; for a single number the name of the quantity (m, m/s, N or Pa).

    Raises
    ------
    FileNotFoundError
        If the folder has no ``probes.csv``.

    Examples
    --------
    >>> force = ddem.read_probes("results/beam-crack")["line"]
    >>> force["time"], force["z"]
    """
    return Results(folder).probes


def plot_probes(
    probes: Probes,
    names: str | Iterable[str] | None = None,
    *,
    component: str | None = None,
    file: str | os.PathLike[str] | None = None,
) -> Figure:
    """Draw the histories of probes, one below the other.

    Parameters
    ----------
    probes : Simulation, Results, str, os.PathLike or mapping
        A simulation, results or their folder, or histories by name, as `read_probes` returns them.
    names : str or sequence of str, optional
        Probes to draw; by default all.
    component : str, optional
        Component to draw: ``"x"``, ``"y"``, ``"z"``; for stresses ``"xx"``, ``"yy"``, ``"zz"``,
        ``"xy"``, ``"yz"``, ``"zx"``. By default all components of each probe.
    file : str or os.PathLike, optional
        Image file to write, in any format of matplotlib.

    Returns
    -------
    matplotlib.figure.Figure
        Figure over the time (s), or over the steps if time does not advance, as in a relaxation.

    Raises
    ------
    TypeError
        If `probes` is of another type.
    ValueError
        If there are no probes, or a name or the component is unknown.
    FileNotFoundError
        If the folder has no ``probes.csv``.
    ImportError
        If matplotlib is not installed: ``pip install "ddem[plot]"``.

    Examples
    --------
    >>> ddem.plot_probes(sim, "top", component="x", file="top.png")
    """
    try:
        import matplotlib.pyplot as plt
    except ImportError as missing:
        raise ImportError('plots need matplotlib: pip install "ddem[plot]"') from missing
    if isinstance(probes, (str, os.PathLike)):
        probes = Results(probes)
    histories: Mapping[str, npt.NDArray[np.void]]
    deck: Any = None
    if isinstance(probes, Results):
        histories, deck = probes.probes, probes.deck
    elif isinstance(probes, Mapping):
        histories = probes
    elif hasattr(probes, "probes"):
        histories, deck = probes.probes, probes.summary.get("deck")
    else:
        kind = type(probes).__name__
        raise TypeError(f"probes: expected a Simulation, a folder or histories, found {kind}")
    chosen = [names] if isinstance(names, str) else list(histories if names is None else names)
    if not histories or not chosen:
        raise ValueError("probes: there are no probes to draw")
    quantities = _quantities(deck)
    shown = [histories[one_of("names", name, histories)] for name in chosen]
    still = all(np.ptp(history["time"]) == 0.0 for history in shown if len(history))
    along = "step" if still else "time"
    figure, rows = plt.subplots(
        len(shown),
        sharex=True,
        squeeze=False,
        figsize=(8.0, 1.2 + 2.1 * len(shown)),
        layout="constrained",
    )
    for axes, name, history in zip(rows[:, 0], chosen, shown):
        parts = [part for part in history.dtype.names or () if part not in ("time", "step")]
        if component is not None:
            parts = [one_of("component", component, parts)]
        for part in parts:
            axes.plot(history[along], history[part], label=part, linewidth=1.4)
        quantity = quantities.get(name, "" if parts[0] in VECTOR else "stress")
        unit = {**UNITS, "reaction": "N"}.get(quantity)
        axes.set_ylabel(f"{quantity} ({unit})" if unit else quantity)
        axes.set_title(name, loc="left")
        axes.legend(loc="best", frameon=False)
        axes.grid(alpha=0.25)
    rows[-1, 0].set_xlabel("step" if still else "time (s)")
    if file is not None:
        figure.savefig(os.fspath(file), dpi=150)
    return figure


def _quantities(deck: Any) -> Mapping[str, str]:
    """Quantity of each probe in the deck; empty if the deck cannot be read."""
    if isinstance(deck, str):
        try:
            tomllib = import_module("tomllib")  # from Python 3.11 on
        except ImportError:
            return {}
        deck = tomllib.loads(deck)
    listed = deck.get("probe", []) if isinstance(deck, dict) else []
    return {probe["name"]: probe.get("quantity", "displacement") for probe in listed}

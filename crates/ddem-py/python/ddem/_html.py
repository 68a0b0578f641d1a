"""Tables that notebooks show for models, simulations and folders of results."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING, Any

from ._errors import Busy
from ._units import prefix

if TYPE_CHECKING:
    from ._ddem import Simulation
    from ._results import Results

# Sections of a deck that have tables of their own here.
_SHOWN = ("model", "materials", "joints", "stage")


def of_model(title: str, size: str, deck: Mapping[str, Any]) -> str:
    """HTML text with the size of a model, its materials, joints, other entries and stages."""
    parts = [_head("Model", title), f"<p>{escape(size)}</p>"]
    for section in ("materials", "joints"):
        entries = deck.get(section, {})
        if entries:
            keys = list(dict.fromkeys(key for entry in entries.values() for key in entry))
            rows = [(name, *(_cell(entry.get(key)) for key in keys)) for name, entry in entries.items()]
            parts.append(_table(rows, (section, *keys)))
    others = {name: value for name, value in deck.items() if name not in _SHOWN and name != "title"}
    rows = [(name, str(len(value))) for name, value in others.items() if isinstance(value, list)]
    parts.append(_table(rows, ("entries", "number")))
    stages = [(stage["name"], stage["kind"]) for stage in deck.get("stage", [])]
    parts.append(_table(stages, ("stage", "kind")))
    return "".join(parts)


def of_simulation(simulation: Simulation) -> str | None:
    """HTML text with the size of a model, its state and the stages so far; None while another thread works."""
    try:
        state = [("time", _quantity(simulation.time, "s")), ("steps", str(simulation.steps))]
        summary = simulation.summary
    except Busy:
        return None
    return _head("Simulation", simulation.title) + _table([*_size(summary), *state]) + _stages(summary)


def of_results(results: Results) -> str:
    """HTML text with the folder of a run and its stages; during a run with its frames so far."""
    frames = [("folder", str(results.folder)), ("frames", str(len(results)))]
    try:
        summary = results.summary
    except FileNotFoundError:
        if len(results):
            frames += [("last stage", results[-1].stage), ("time", _quantity(results[-1].time, "s"))]
        return _head("Results", results.title) + _table(frames)
    return _head("Results", results.title) + _table([*frames, *_size(summary)]) + _stages(summary)


def _size(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Rows of the model and its state in a summary."""
    failed = summary["failed_pairs"]
    rows = [(name, str(summary[name])) for name in ("blocks", "elements", "nodes", "pairs")]
    rows.append(("failed pairs", f"{failed['shear']} in shear, {failed['tension']} in tension"))
    rows.append(("fragments", str(summary["fragments"]["number"])))
    return rows


def _stages(summary: Mapping[str, Any]) -> str:
    """Table of the stages in a summary."""
    stages = summary["stages"]
    safe = any("bracket" in stage for stage in stages)
    rows = []
    for stage in stages:
        joints = stage["state"]["joints"]
        failed = sum(joint["shear"] + joint["tension"] for joint in joints)
        largest = stage["state"]["displacement"]["size"]
        row = [stage["name"], stage["kind"], stage["verdict"], str(stage["steps"])]
        # Only joints that can fail are in the list.
        pairs = sum(joint["pairs"] for joint in joints)
        row += [_quantity(largest, "m"), f"{failed} of {pairs}" if pairs else ""]
        rows.append(row + [_factor(stage)] * safe)
    head = ["stage", "kind", "verdict", "steps", "largest displacement", "failed pairs"]
    return _table(rows, head + ["factor of safety"] * safe)


def _factor(stage: Mapping[str, Any]) -> str:
    """Factor of safety, or its bound if the search ended at an end of its bracket."""
    if "factor" in stage:
        return f"{stage['factor']:.3f}"
    stable, unstable = stage.get("bracket", (None, None))
    if stable is not None:
        return f"above {stable}"
    return "" if unstable is None else f"below {unstable}"


def _head(kind: str, title: str) -> str:
    return f"<p><strong>{kind}{escape(f' “{title}”') if title else ''}</strong></p>"


def _table(rows: Sequence[Iterable[str]], head: Iterable[str] | None = None) -> str:
    """Table whose first column names its rows; nothing without rows."""
    if not rows:
        return ""
    columns = "".join(f'<th scope="col">{escape(name)}</th>' for name in head or ())
    lines = [f"<thead><tr>{columns}</tr></thead>"] if columns else []
    for name, *cells in rows:
        values = "".join(f"<td>{escape(cell)}</td>" for cell in cells)
        lines.append(f'<tr><th scope="row">{escape(name)}</th>{values}</tr>')
    return f"<table>{''.join(lines)}</table>"


def _cell(value: object) -> str:
    """Value of a key of a deck; nothing if it is not given."""
    if value is None:
        return ""
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _quantity(value: float, unit: str) -> str:
    factor, name = prefix(abs(value), unit)
    return f"{value / factor:.4g} {name}{unit}"

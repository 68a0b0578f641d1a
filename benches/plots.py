"""Plots of docs/performance.md with matplotlib."""

from pathlib import Path

import matplotlib

matplotlib.use("svg")
# The same picture for the same numbers.
matplotlib.rcParams["svg.hashsalt"] = "ddem"

import matplotlib.pyplot as plt  # noqa: E402


def lines(
    path: Path, title: str, x_label: str, y_label: str, series: dict[str, list[tuple[float, float]]]
) -> None:
    """Curves over a logarithmic axis; names that end in `1 thread` are dashed."""
    figure, axes = plt.subplots(figsize=(8, 4))
    for number, (name, points) in enumerate(series.items()):
        style = "o--" if name.endswith("1 thread") else "o-"
        axes.semilogx(*zip(*points), style, color=f"C{number // 2}", label=name)
    axes.set(title=title, xlabel=x_label, ylabel=y_label)
    axes.set_ylim(bottom=0)
    axes.grid(alpha=0.3)
    axes.legend(loc="upper left", bbox_to_anchor=(1, 1), frameon=False)
    save(figure, path)


def bars(path: Path, title: str, unit: str, rows: list[tuple[str, float, str]]) -> None:
    """Horizontal bars with a label, a value and a group each; groups have colours."""
    figure, axes = plt.subplots(figsize=(8, 0.8 + 0.35 * len(rows)))
    names, values, groups = zip(*rows)
    colours = [f"C{sorted(set(groups)).index(group)}" for group in groups]
    axes.bar_label(axes.barh(names, values, color=colours), fmt="%.0f", padding=3)
    axes.set(title=title, xlabel=unit)
    axes.invert_yaxis()
    save(figure, path)


def save(figure: plt.Figure, path: Path) -> None:
    figure.savefig(path, bbox_inches="tight", metadata={"Date": None})
    plt.close(figure)

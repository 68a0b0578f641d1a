#!/usr/bin/env python3
"""A wedge that slides out of a slope, and the poles of its joints.

    cargo run --release -- examples/wedge.toml
    python examples/pictures/wedge.py

Needs `pip install ".[plot]"`, as docs/python.md says; no display.
"""

import ddem
import matplotlib.pyplot as plt
import numpy as np

from results import ROOT, by_block, colour_bar, panel, results, save, scene, sheet

COLOURS, SCALE, LEAST = "YlOrRd", 100.0, 0.6


def main():
    """Draws the last frame, that of the failing trial, and the stereonet."""
    run = ddem.Results(results("wedge"))
    frame, stage = run[-1], run.summary["stages"][-1]
    size = 1e3 * np.linalg.norm(frame.displacement, axis=1)[frame.elements].mean(axis=1)
    values = by_block(frame, size, LEAST)
    most = float(np.nanmax(values))
    low, high = stage["bracket"]
    about = f"strength reduction: {stage['factor']:.3f} (stable at {low:.3f}, unstable at {high:.3f}); displacements × {SCALE:g}"
    figure = sheet((12, 8.2), run.title, about)
    look = {"cmap": COLOURS, "clim": (0.0, most), "scale": SCALE}
    panel(
        figure,
        (0.2, 0.9, 7.4, 6.1),
        "the wedge as it begins to slide",
        lambda pixels: scene(frame, values, (-9.5, -0.5, 0.5), 38.0, pixels, (1.0, -0.75, 0.55), **look),
    )
    colour_bar(figure, (2.1, 0.6, 3.6, 0.13), COLOURS, (0.0, most), f"displacement (mm), below {LEAST:g} mm grey")
    net(figure, (7.7, 1.5, 4.2, 4.8))
    save(figure, "wedge.png")


def net(figure, place):
    """The poles of the joints, with the great circles of joints and slope."""
    drawn = ddem.plot_stereonet(ddem.Model.from_deck(ROOT / "examples" / "wedge.toml"), slope=(70, 156))
    axes = figure.add_axes(np.array(place) / np.tile(figure.get_size_inches(), 2))
    for line in drawn.axes[0].lines:
        axes.plot(*line.get_data(), color=line.get_color(), marker=line.get_marker(), linestyle=line.get_linestyle(),
                  linewidth=line.get_linewidth(), markersize=line.get_markersize(), label=line.get_label())
    for text in drawn.axes[0].texts:
        axes.text(*text.get_position(), text.get_text(), ha="center", va="center")
    plt.close(drawn)
    axes.set_aspect("equal")
    axes.axis("off")
    axes.set_title("joints and slope", loc="left", size=13, weight="bold")
    lines = [line for line in axes.lines if not line.get_label().startswith("_")]
    axes.legend(handles=lines, loc="lower center", bbox_to_anchor=(0.5, -0.14), ncols=3, frameon=False, fontsize=9.5, columnspacing=1.2)


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Displacements across two weak planes, and their failure times: figures 9, 10 and 11 of the paper.

    cargo run --release -- examples/shear.toml
    python examples/pictures/shear.py

Needs `pip install ".[plot]"`, as docs/python.md says; no display.
"""

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import BoundaryNorm

from results import FAINT, GROUND, INK, LOAD, Frames, outlines, results, save, side

PLANES = (2.0, 3.0)
SCALE = 25
SHADES = ("#9db7d5", "#5b8dc0", "#2a5f9e", "#12305a")


def load(time):
    """Traction on y = 0 at a time, `MPa`."""
    return 0.2 + 2.0 * time


def column(axes, blocks, frame):
    """The side x = 4, deformed, coloured by the displacement along y."""
    faces, cells = side(blocks, 0, 4.0)
    edges = outlines(faces, blocks.cell_field("block")[cells])
    u = blocks.point_field("displacement", frame)
    flat = (blocks.points + SCALE * u)[:, 1:]
    along = 1e3 * u[faces][:, :, 1].mean(axis=1)
    colours = PolyCollection(flat[faces], array=along, cmap="viridis", clim=(0, along.max()))
    colours.set(edgecolor="face", linewidth=0.2)
    axes.add_collection(colours)
    axes.add_collection(LineCollection(flat[edges], colors="white", linewidths=0.6))
    box = [(0, 0), (0, 8), (4, 8), (4, 0)]
    axes.add_patch(plt.Polygon(box, fill=False, ec=FAINT, lw=0.9, ls=(0, (4, 3))))
    axes.fill_between([-0.6, 4.6], -0.28, 0, color=GROUND, lw=0)
    loaded = (np.abs(blocks.points[:, 1]) < 1e-9) & (blocks.points[:, 0] > 4.0 - 1e-9)
    for z in np.arange(0.5, 8.0):
        y = np.interp(z, *np.sort(flat[loaded][:, ::-1], axis=0).T)
        style = {"arrowstyle": "-|>", "color": LOAD, "lw": 1.6, "mutation_scale": 12}
        axes.annotate("", (y, z), (y - 0.85, z), arrowprops=style)
    axes.set(xlim=(-1.1, 6.1), ylim=(-0.4, 8.3), aspect="equal")
    axes.axis("off")
    return colours


def profiles(axes, blocks, frames):
    """Displacement along y over the height, on the line x = 2, y = 2."""
    near = np.abs(blocks.points[:, :2] - (1.995, 1.995)).sum(axis=1) < 1e-6
    line = np.flatnonzero(near)
    line = line[np.argsort(blocks.points[line, 2], kind="stable")]
    for frame, shade in zip(frames, SHADES):
        along = 1e3 * blocks.point_field("displacement", frame)[line, 1]
        height = blocks.points[line, 2]
        axes.plot(along, height, color=shade, lw=2.0)
        axes.plot(along, height, "o", color=shade, ms=3)
        label = f"{load(blocks.times[frame]):.2f} MPa"
        style = {"ha": "center", "color": shade, "size": 10.5}
        axes.annotate(label, (along[-1], 8.0), (0, 6), textcoords="offset points", **style)
    for plane in PLANES:
        axes.axhline(plane, color=LOAD, lw=0.9, ls=(0, (5, 3)), zorder=0)
    axes.set(ylim=(0, 8), xlim=(0, None), yticks=[0, 2, 3, 8], ylabel="height z (m)")
    axes.set_xlabel("displacement along y (mm)")


def displacements():
    """Figure 9: the column, and profiles with their jumps at the planes."""
    blocks = Frames(results("shear") / "blocks.vtkhdf")
    frames = [int(np.abs(blocks.times - time).argmin()) for time in (0.05, 0.15, 0.2, 0.23)]
    figure = plt.figure(figsize=(12, 7.4))
    figure.text(0.035, 0.945, "A column shears along its weak planes", size=19, weight="bold")
    about = "4 × 4 × 8 m, weak planes at z = 2 and 3 m; left: traction"
    about = f"{about} {load(blocks.times[frames[-1]]):.2f} MPa, displacements × {SCALE}"
    figure.text(0.035, 0.905, about, size=12, color=FAINT)
    axes = figure.add_axes((0.02, 0.03, 0.5, 0.85))
    colours = column(axes, blocks, frames[-1])
    bar = figure.add_axes((0.475, 0.2, 0.014, 0.5))
    figure.colorbar(colours, cax=bar)
    bar.set_title("mm", size=11, pad=8)
    profiles(figure.add_axes((0.6, 0.105, 0.36, 0.73)), blocks, frames)
    save(figure, "shear-displacement.png")


def failures():
    """Figures 10 and 11: failure times of the points of each plane."""
    joints = Frames(results("shear") / "joints.vtkhdf")
    times = 1e3 * joints.point_field("failure_time")
    figure = plt.figure(figsize=(12, 6.9))
    figure.text(0.035, 0.94, "When the weak planes failed", size=19, weight="bold")
    about = "milliseconds since the traction on y = 0 began to grow from 0.2 MPa by 2 MPa/s"
    figure.text(0.035, 0.897, about, size=12, color=FAINT)
    levels = (15, 20, 25, 30, 40, 50, 60, 70, 80, 100, 125, 150, 200, 250, 300, 400, 450)
    norm = BoundaryNorm(levels, 256)
    for place, (plane, name) in enumerate(zip(PLANES, ("lower", "upper"))):
        on_plane = np.abs(joints.points[:, 2] - plane) < 1e-6
        spots = np.round(joints.points[on_plane, :2], 6)
        x, y = np.unique(spots[:, 0]), np.unique(spots[:, 1])
        grid = np.full((len(y), len(x)), np.nan)
        grid[np.searchsorted(y, spots[:, 1]), np.searchsorted(x, spots[:, 0])] = times[on_plane]
        axes = figure.add_axes((0.07 + 0.435 * place, 0.135, 0.375, 0.665))
        axes.set_facecolor(GROUND)
        colours = axes.contourf(x, y, grid, levels=levels, cmap="viridis_r", norm=norm)
        lines = axes.contour(x, y, grid, levels=levels, colors="white", linewidths=0.8)
        axes.clabel(lines, lines.levels[:-2], fmt="%d", fontsize=8.5)
        for cut in (1, 2, 3):
            axes.axhline(cut, color=INK, lw=0.4, alpha=0.35)
            axes.axvline(cut, color=INK, lw=0.4, alpha=0.35)
        for at in np.arange(0.25, 4.0, 0.5):
            style = {"arrowstyle": "-|>", "color": LOAD, "lw": 1.6, "mutation_scale": 11}
            axes.annotate("", (at, 0.0), (at, -0.3), arrowprops=style, annotation_clip=False)
        axes.set(aspect="equal", xlim=(0, 4), ylim=(0, 4), xticks=range(5), yticks=range(5))
        axes.tick_params(axis="x", pad=20)
        axes.set_xlabel("x (m)", labelpad=4)
        axes.set_ylabel("y (m)")
        held = " (grey: not yet)" if np.isnan(grid).any() else ""
        span = f"{np.nanmin(grid):.0f} to {np.nanmax(grid):.0f} ms{held}"
        axes.set_title(f"{name} plane, z = {plane:g} m: {span}", size=12.5, pad=9)
    bar = figure.add_axes((0.925, 0.17, 0.016, 0.59))
    figure.colorbar(colours, cax=bar, ticks=levels, spacing="uniform")
    bar.set_title("ms", size=11, pad=8)
    save(figure, "shear-failure.png")


if __name__ == "__main__":
    displacements()
    failures()

#!/usr/bin/env python3
"""A block of rock that is blasted from its middle: at two times, from outside and cut open, and the
sizes of its fragments.

    cargo run --release -- examples/blast.toml
    python examples/pictures/blast.py

Needs `pip install ".[plot]" h5py`; no display.
"""

import os

os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")

import ddem
import numpy as np
import pyvista as pv

from results import FAINT, INK, PICTURES, Frames, results

TIMES = (0.01, 0.02)
FASTEST = 15.0
MIDDLE = 1.2
FOCUS = np.array((1.2, 1.2, 1.4))


def blocks_at(frames, time, behind):
    """Blocks where they are at a time, with their speed: all, or those behind the charge."""
    frame = int(np.abs(frames.times - time).argmin())
    hexes = frames.cells.reshape(-1, 8)
    if behind:
        hexes = hexes[frames.points[hexes].mean(axis=1)[:, 1] > MIDDLE]
    moved = frames.points + frames.point_field("displacement", frame)
    grid = pv.UnstructuredGrid({pv.CellType.HEXAHEDRON: hexes}, moved)
    grid["speed"] = np.linalg.norm(frames.point_field("velocity", frame), axis=1)
    return grid.extract_surface(algorithm="dataset_surface")


def label(plotter, text, height, size, colour=INK):
    """A line of text at the left."""
    plotter.add_text(text, position=(0.06, height), viewport=True, font_size=size, color=colour)


def draw(frames, file):
    """From outside above, cut open below, one column for each time."""
    plotter = pv.Plotter(off_screen=True, window_size=(1800, 1720), shape=(2, 2), border=False)
    for row, behind in enumerate((False, True)):
        for column, time in enumerate(TIMES):
            plotter.subplot(row, column)
            plotter.set_background("white")
            plotter.enable_parallel_projection()
            plotter.add_mesh(
                blocks_at(frames, time, behind),
                scalars="speed",
                cmap="YlOrRd",
                clim=(0.0, FASTEST),
                ambient=0.4,
                diffuse=0.6,
                show_edges=True,
                edge_color=INK,
                show_scalar_bar=False,
            )
            look = np.array((-2.5, -8.0, 2.0) if behind else (-5.0, -8.0, 4.0))
            plotter.camera_position = [tuple(look + FOCUS), tuple(FOCUS), (0, 0, 1)]
            plotter.camera.parallel_scale = 2.2
            plotter.reset_camera_clipping_range()
            if not behind:
                label(plotter, f"{time * 1e3:.0f} ms", 0.82, 17)
    plotter.subplot(0, 0)
    label(plotter, "1 kg of TNT in the middle of a block of rock", 0.94, 19)
    label(plotter, f"below cut open; blocks by speed, to {FASTEST:.0f} m/s", 0.895, 12, FAINT)
    plotter.screenshot(file)
    plotter.close()
    print(file)


def main():
    """Draws both pictures."""
    folder = results("blast")
    draw(Frames(folder / "blocks.vtkhdf"), PICTURES / "blast.png")
    sizes = PICTURES / "blast-sizes.png"
    ddem.plot_sizes(folder, file=sizes)
    print(sizes)


if __name__ == "__main__":
    main()

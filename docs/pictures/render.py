#!/usr/bin/env python3
"""Pictures of the examples, from their results.

    cargo run --release -- examples/beam.toml
    cargo run --release -- examples/poisson.toml
    python docs/pictures/render.py [results folder] [output folder]

Needs `pip install ".[plot]"`, as docs/python.md says; no display.
"""

import argparse
import os
from pathlib import Path

os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")

import ddem
import numpy as np
import pyvista as pv
import vtk

INK = "#1f2933"
FAINT = "#52606d"
LOAD = "#c0392b"
SUPPORT = "#9aa5b1"
SIZE = (1800, 1000)

# Lines on faces are drawn in front of them.
vtk.vtkMapper.SetResolveCoincidentTopologyToPolygonOffset()
vtk.vtkMapper.SetResolveCoincidentTopologyPolygonOffsetParameters(2.0, 2.0)


def stage(title, subtitle):
    """An empty picture with its title."""
    plotter = pv.Plotter(off_screen=True, window_size=SIZE, lighting="none")
    plotter.set_background("white")
    plotter.enable_anti_aliasing("ssaa")
    plotter.enable_parallel_projection()
    for position, intensity in (((-7, -8, 8), 0.62), ((9, -6, 4), 0.32), ((0, 0, 10), 0.22)):
        plotter.add_light(
            pv.Light(position=position, light_type="scene light", intensity=intensity)
        )
    plotter.add_text(title, position=(0.035, 0.915), viewport=True, font_size=20, color=INK)
    plotter.add_text(subtitle, position=(0.035, 0.868), viewport=True, font_size=13, color=FAINT)
    return plotter


def add_blocks(plotter, grid, scale, scalars, bar, **colours):
    """Deformed blocks: coloured faces, faint element lines, dark block edges."""
    surface = grid.extract_surface(algorithm="dataset_surface")
    # Blocks share no nodes, so the sharp edges of the surface are the edges of the blocks.
    edges = surface.extract_feature_edges(
        feature_angle=45.0, boundary_edges=False, manifold_edges=False, non_manifold_edges=False
    )
    mesh = surface.extract_all_edges()

    def deformed(part):
        return part.warp_by_vector("displacement", factor=scale)

    actor = plotter.add_mesh(
        deformed(surface),
        scalars=scalars,
        ambient=0.5,
        diffuse=0.6,
        smooth_shading=False,
        show_scalar_bar=False,
        **colours,
    )
    plotter.add_mesh(deformed(mesh), color="white", line_width=1.0, opacity=0.3, lighting=False)
    plotter.add_mesh(deformed(edges), color=INK, line_width=2.6, lighting=False)
    plotter.add_scalar_bar(
        title=bar,
        mapper=actor.mapper,
        n_labels=5,
        fmt="%.1f",
        color=INK,
        width=0.36,
        height=0.055,
        position_x=0.32,
        position_y=0.055,
        title_font_size=26,
        label_font_size=22,
    )


def outline(plotter, bounds):
    """The region before it is loaded."""
    box = pv.Box(bounds).extract_all_edges()
    plotter.add_mesh(box, color=FAINT, line_width=1.2, opacity=0.65, lighting=False)


def arrow(plotter, tip, direction, length):
    """A load that points at `tip`."""
    direction = np.asarray(direction, float)
    shape = pv.Arrow(
        start=np.asarray(tip) - length * direction,
        direction=direction,
        scale=length,
        tip_length=0.32,
        tip_radius=0.11,
        shaft_radius=0.035,
        tip_resolution=32,
        shaft_resolution=32,
    )
    plotter.add_mesh(shape, color=LOAD, ambient=0.35, diffuse=0.75)


def wedge(x, width, z, height):
    """A pinned edge along y at (x, z): a prism below it."""
    half = 0.6 * height
    corners = [(x, z), (x + half, z - height), (x - half, z - height)]
    points = [(a, y, c) for y in (0.0, width) for a, c in corners]
    faces = [[3, 0, 2, 1], [3, 3, 4, 5], [4, 0, 1, 4, 3], [4, 1, 2, 5, 4], [4, 2, 0, 3, 5]]
    return pv.PolyData(np.array(points), np.hstack(faces))


def look(plotter, direction, focus, height):
    """Camera from `direction`, with `height` metres of picture above and below `focus`."""
    focus = np.asarray(focus, float)
    plotter.camera.focal_point = focus
    plotter.camera.position = focus + 60.0 * np.asarray(direction) / np.linalg.norm(direction)
    plotter.camera.up = (0, 0, 1)
    plotter.camera.parallel_scale = height
    plotter.reset_camera_clipping_range()


def beam(grid, output):
    """The simply supported beam under a line load."""
    scale = 800.0
    u = grid["displacement"]
    grid["down"] = -1e3 * u[:, 2]
    plotter = stage(
        "Simply supported beam, 12 × 3 × 3 m",
        f"108 blocks, 13 500 nodes, line load 600 kN/m at midspan; displacements × {scale:g}",
    )
    outline(plotter, grid.bounds)
    top = 0.4 * np.ceil(grid["down"].max() / 0.4)
    add_blocks(
        plotter, grid, scale, "down", "downward displacement (mm)\n", cmap="viridis", clim=(0, top)
    )
    width, upper = grid.bounds[3], grid.bounds[5]
    under = (np.abs(grid.points[:, 0] - 6.0) < 0.05) & (grid.points[:, 2] > upper - 1e-6)
    sunk = upper + scale * u[under, 2].mean()
    for y in np.linspace(0.0, width, 7):
        arrow(plotter, (6.0, y, sunk), (0, 0, -1), 1.25)
    bar = pv.Line((6.0, 0.0, sunk + 1.25), (6.0, width, sunk + 1.25)).tube(radius=0.035)
    plotter.add_mesh(bar, color=LOAD, ambient=0.35, diffuse=0.75)
    plotter.add_mesh(wedge(0.0, width, 0.0, 0.55), color=SUPPORT, ambient=0.3)
    rolled = 12.0 + scale * u[np.argmin(np.abs(grid.points - (12, 0, 0)).sum(axis=1)), 0]
    roller = pv.Cylinder(
        center=(rolled, width / 2, -0.275),
        direction=(0, 1, 0),
        radius=0.275,
        height=width,
        resolution=64,
    )
    plotter.add_mesh(roller, color=SUPPORT, ambient=0.3)
    for x in (0.0, rolled):
        ground = pv.Box((x - 0.75, x + 0.75, -0.15, width + 0.15, -0.65, -0.55))
        plotter.add_mesh(ground, color="#d5dae0", ambient=0.35)
    look(plotter, (-0.42, -1.0, 0.42), (6.0, 1.5, 1.35), 4.9)
    plotter.screenshot(output)
    plotter.close()


def poisson(grid, output):
    """The cube that grows sideways under pressure."""
    scale = 4e4
    # One corner is held: the displacement from the axis is what shows the effect.
    u = np.array(grid["displacement"])
    u[:, :2] -= u[:, :2].mean(axis=0)
    grid["displacement"] = u
    grid["sideways"] = 1e6 * u[:, 0]
    plotter = stage(
        "Poisson effect, 4 × 4 × 4 m",
        f"64 blocks, 8 000 nodes, 50 kPa on top, smooth base; displacements × 40 000",
    )
    outline(plotter, grid.bounds)
    reach = 0.2 * np.ceil(np.abs(grid["sideways"]).max() / 0.2)
    add_blocks(
        plotter,
        grid,
        scale,
        "sideways",
        "displacement along x, relative to the axis (µm)\n",
        cmap="coolwarm",
        clim=(-reach, reach),
    )
    upper = grid.bounds[5] + scale * u[:, 2].min()
    for x in np.linspace(0.5, 3.5, 4):
        for y in np.linspace(0.5, 3.5, 4):
            arrow(plotter, (x, y, upper), (0, 0, -1), 0.7)
    plotter.add_mesh(pv.Box((-0.5, 4.5, -0.5, 4.5, -0.16, -0.02)), color="#d5dae0", ambient=0.35)
    look(plotter, (-0.5, -1.0, 0.42), (2.0, 2.0, 1.75), 4.6)
    plotter.screenshot(output)
    plotter.close()


def main():
    """Renders every example whose results are there."""
    parser = argparse.ArgumentParser(description="Pictures of the examples, from their results.")
    parser.add_argument("results", nargs="?", type=Path, default=Path("results"))
    parser.add_argument("output", nargs="?", type=Path, default=Path(__file__).parent)
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    for name, draw in (("beam", beam), ("poisson", poisson)):
        folder = arguments.results / name
        if not folder.exists():
            print(f"{folder}: not there; cargo run --release -- examples/{name}.toml makes it")
            continue
        picture = arguments.output / f"{name}.png"
        draw(ddem.Results(folder)[-1].mesh(), picture)
        print(picture)


if __name__ == "__main__":
    main()

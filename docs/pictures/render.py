#!/usr/bin/env python3
"""Pictures of the examples, from their results.

    cargo run --release -- examples/beam.toml
    cargo run --release -- examples/poisson.toml
    cargo run --release -- cut examples/cut.toml
    python docs/pictures/render.py [results folder] [output folder]

Needs `pip install ".[plot]"`, as docs/python.md says; no display.
"""

import argparse
import sys
from pathlib import Path

import ddem
import matplotlib
import numpy as np
import pyvista as pv
from PIL import Image

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "examples" / "pictures"))

from results import FAINT, GROUND, LOAD, write

SUPPORT = "#9aa5b1"
SIZE = (1500, 1000)


def blocks(frame, values, scale, label, shift=(0.0, 0.0, 0.0), **look):
    """A picture by `ddem.plot` to add to, with the region before it was loaded, shifted."""
    plotter = ddem.plot(frame, values, scale=scale, label=label, window_size=SIZE, show=False, **look)
    bounds = np.stack([frame.points.min(axis=0), frame.points.max(axis=0)], axis=1).reshape(-1)
    box = pv.Box(bounds).extract_all_edges().translate(shift)
    plotter.add_mesh(box, color=FAINT, line_width=1.5, opacity=0.65, lighting=False)
    return plotter


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


def finish(plotter, wider, output):
    """Shows what was added, too, and writes the picture."""
    plotter.camera.parallel_scale *= wider
    plotter.reset_camera_clipping_range()
    write(Image.fromarray(plotter.screenshot(return_img=True)), output)
    plotter.close()


def beam(frame, output):
    """The simply supported beam under a line load."""
    scale, u, points = 1000.0, frame.displacement, frame.points
    down = -1e3 * u[:, 2]
    plotter = blocks(frame, down, scale, "downward displacement (mm)", clim=(0.0, down.max()))
    width, upper = points[:, 1].max(), points[:, 2].max()
    under = (np.abs(points[:, 0] - 6.0) < 0.05) & (points[:, 2] > upper - 1e-6)
    sunk = upper + scale * u[under, 2].mean()
    for y in np.linspace(0.0, width, 7):
        arrow(plotter, (6.0, y, sunk), (0, 0, -1), 1.25)
    bar = pv.Line((6.0, 0.0, sunk + 1.25), (6.0, width, sunk + 1.25)).tube(radius=0.035)
    plotter.add_mesh(bar, color=LOAD, ambient=0.35, diffuse=0.75)
    above = [(6.0, width, sunk + 1.5)]
    plotter.add_point_labels(
        above,
        ["600 kN/m"],
        shape=None,
        show_points=False,
        text_color=LOAD,
        font_size=22,
        bold=False,
        always_visible=True,
    )
    plotter.add_mesh(wedge(0.0, width, 0.0, 0.55), color=SUPPORT, ambient=0.3)
    rolled = 12.0 + scale * u[np.argmin(np.abs(points - (12, 0, 0)).sum(axis=1)), 0]
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
        plotter.add_mesh(ground, color=GROUND, ambient=0.35)
    finish(plotter, 1.04, output)


def poisson(frame, output):
    """The cube that grows sideways under pressure."""
    # One corner is held: the displacement from the axis is what shows the effect.
    u = frame.displacement
    sideways = 1e6 * (u[:, 0] - u[:, 0].mean())
    reach = np.abs(sideways).max()
    scale = 5e4
    shift = scale * u.mean(axis=0) * (1.0, 1.0, 0.0)
    label = "displacement along x, relative to the axis (µm)"
    plotter = blocks(frame, sideways, scale, label, shift, cmap="coolwarm", clim=(-reach, reach))
    low, upper = scale * u[:, :2].min(axis=0), 4.0 + scale * u[:, 2].min()
    high = 4.0 + scale * u[:, :2].max(axis=0)
    for x in np.linspace(0.5, 3.5, 4):
        for y in np.linspace(0.5, 3.5, 4):
            arrow(plotter, (x, y, upper), (0, 0, -1), 0.7)
    plate = (low[0] - 0.5, high[0] + 0.5, low[1] - 0.5, high[1] + 0.5, -0.16, -0.02)
    plotter.add_mesh(pv.Box(plate), color=GROUND, ambient=0.35)
    finish(plotter, 1.18, output)


def cut(path, output):
    """The blocks of a cut slope, a little apart."""
    mesh = pv.read(path)
    blocks = mesh.cell_data["block"]
    colours = np.random.default_rng(1).permutation(blocks.max() + 1) % 20
    plotter = pv.Plotter(window_size=SIZE, off_screen=True)
    for block in np.unique(blocks):
        part = mesh.extract_cells(blocks == block).extract_surface(algorithm="dataset_surface")
        part = part.translate(0.06 * (np.array(part.center) - mesh.center))
        plotter.add_mesh(part, color=matplotlib.colormaps["tab20"](colours[block]))
    plotter.camera_position = [(-45, -60, 55), np.array(mesh.center) - (0, 0, 2), (0, 0, 1)]
    write(Image.fromarray(plotter.screenshot(return_img=True)), output)
    plotter.close()


def stereonet(deck, output):
    """The poles of the planes that cut a slope, and its face."""
    figure = ddem.plot_stereonet(ddem.Model.from_deck(deck), slope=(55, 270))
    figure.savefig(output, dpi=130, facecolor="white")
    write(Image.open(output), output)


def main():
    """Renders every example whose results are there."""
    parser = argparse.ArgumentParser(description="Pictures of the examples, from their results.")
    parser.add_argument("results", nargs="?", type=Path, default=Path("results"))
    parser.add_argument("output", nargs="?", type=Path, default=Path(__file__).parent)
    arguments = parser.parse_args()
    for name, draw in (("beam", beam), ("poisson", poisson)):
        folder = arguments.results / name
        if not folder.exists():
            print(f"{folder}: not there; cargo run --release -- examples/{name}.toml makes it")
            continue
        draw(ddem.Results(folder)[-1], arguments.output / f"{name}.png")
    examples = Path(__file__).resolve().parents[2] / "examples"
    stereonet(examples / "cut.toml", arguments.output / "stereonet.png")
    slope = arguments.results / "cut-cut" / "blocks.vtkhdf"
    if slope.exists():
        cut(slope, arguments.output / "cut.png")
    else:
        print(f"{slope}: not there; cargo run --release -- cut examples/cut.toml makes it")


if __name__ == "__main__":
    main()

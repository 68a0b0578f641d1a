#!/usr/bin/env python3
"""A film, or one picture, of a run: what its blocks have done, frame by frame.

    cargo run --release -- examples/toppling.toml
    python examples/animate.py results/toppling toppling.gif --from -1 -1.6 0.6
    python examples/animate.py results/toppling pile.png --frame -1 --by speed

Blocks that never move are grey. The others have the colour of the place from which they come, along
x, y or z, or of their speed; those of another material than most of them, such as a ram, are dark.

Needs `pip install pyvista pillow`; no display.
"""

import argparse
import io
import os
from pathlib import Path

os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")

import numpy as np
import pyvista as pv
import vtk
from PIL import Image

INK = "#1f2933"
FAINT = "#52606d"
HELD = "#d5dae0"
OTHER = "#52606d"
LIGHTS = (((-7, -8, 8), 0.62), ((9, -6, 4), 0.32), ((0, 0, 10), 0.22))
TITLES = {
    "x": "x at the start (m)\n",
    "y": "y at the start (m)\n",
    "z": "height at the start (m)\n",
    "speed": "speed (m/s)\n",
}

# Lines on faces are drawn in front of them.
vtk.vtkMapper.SetResolveCoincidentTopologyToPolygonOffset()
vtk.vtkMapper.SetResolveCoincidentTopologyPolygonOffsetParameters(2.0, 2.0)


class Run:
    """The blocks of a folder of results, at any of its frames."""

    def __init__(self, folder):
        path = Path(folder) / "blocks.vtkhdf"
        if not path.exists():
            raise SystemExit(f"{path}: not there; `cargo run --release -- DECK` makes it")
        # PyVista's own reader knows no time steps of such files.
        self.reader = vtk.vtkHDFReader()
        self.reader.SetFileName(str(path))
        self.reader.UpdateInformation()
        key = vtk.vtkStreamingDemandDrivenPipeline.TIME_STEPS()
        self.times = self.reader.GetOutputInformation(0).Get(key)
        first, last = self.at(0), self.at(-1)
        start = first.cell_centers().points
        _, block = np.unique(first["block"], return_inverse=True)
        count = np.bincount(block)
        self.start = np.column_stack([np.bincount(block, x) / count for x in start.T])[block]
        moved = np.linalg.norm(last["displacement"], axis=1)
        self.held = moved[first.cells_dict[12]].max(axis=1) == 0.0
        most = np.bincount(first["material"][~self.held]).argmax()
        self.other = ~self.held & (first["material"] != most)

    def at(self, frame):
        """The undeformed grid with the fields of a frame; frame -1 is the last."""
        self.reader.UpdateTimeStep(self.times[frame])
        return pv.wrap(self.reader.GetOutputDataObject(0)).copy()

    def scalars(self, grid, by):
        """What the blocks are coloured by, one number for each element."""
        if by == "speed":
            speed = np.linalg.norm(grid["velocity"], axis=1)
            return speed[grid.cells_dict[12]].mean(axis=1)
        return self.start[:, "xyz".index(by)]


class Film:
    """A run seen from one side, always with the same colours and the same part of the world."""

    def __init__(self, run, view):
        self.run, self.view = run, view
        pv.global_theme.font.family = "arial"
        self.plotter = pv.Plotter(off_screen=True, window_size=view.size, lighting="none")
        self.plotter.set_background("white")
        self.plotter.enable_anti_aliasing("ssaa")
        self.plotter.enable_parallel_projection()
        for position, intensity in LIGHTS:
            light = pv.Light(position=position, light_type="scene light", intensity=intensity)
            self.plotter.add_light(light)
        free = ~(run.held | run.other)
        frames = [run.at(i) for i in range(len(run.times))] if view.by == "speed" else [run.at(0)]
        values = [run.scalars(grid, view.by)[free] for grid in frames]
        self.limits = (0.0 if view.by == "speed" else np.min(values), np.max(values))

    def draw(self, frame, title="", text=""):
        """Draws a frame with a title and a line below it; gives the picture as an array."""
        grid = self.run.at(frame)
        grid["value"] = self.run.scalars(grid, self.view.by)
        run, style = self.run, {"ambient": 0.5, "diffuse": 0.6, "show_scalar_bar": False}
        for name, cells in (("held", run.held), ("other", run.other)):
            colour = HELD if name == "held" else OTHER
            self._blocks(grid, name, cells, color=colour, **style)
        free = ~(run.held | run.other)
        colours = {"cmap": "viridis", "clim": self.limits, "scalars": "value"}
        actor = self._blocks(grid, "free", free, **colours, **style)
        size = self.view.size[1] / 1000
        if self.view.bar:
            self._bar(actor, size)
        for name, words, height, points, colour in (
            ("title", title, 0.915, 20, INK),
            ("text", text, 0.868, 13, FAINT),
        ):
            place = {"position": (self.view.left, height), "viewport": True}
            self.plotter.add_text(
                words, name=name, font_size=round(points * size), color=colour, **place
            )
        self._look(grid.bounds)
        return self.plotter.screenshot(return_img=True)

    def _blocks(self, grid, name, cells, **style):
        """Some of the blocks, deformed, with dark edges."""
        if not cells.any():
            return None
        part = grid.extract_cells(cells).warp_by_vector("displacement")
        # Blocks share no nodes, so the sharp edges of the surface are the edges of the blocks.
        surface = part.extract_surface(algorithm="dataset_surface")
        edges = surface.extract_feature_edges(
            30.0, boundary_edges=False, manifold_edges=False, non_manifold_edges=False
        )
        width = 2.2 * self.view.size[1] / 1000
        line = {"color": INK, "line_width": max(width, 1.0), "lighting": False}
        self.plotter.add_mesh(edges, name=f"{name} edges", reset_camera=False, **line)
        return self.plotter.add_mesh(surface, name=name, reset_camera=False, **style)

    def _bar(self, actor, size):
        """The bar of colours, once."""
        if self.plotter.scalar_bars:
            return
        self.plotter.add_scalar_bar(
            title=TITLES[self.view.by],
            mapper=actor.mapper,
            n_labels=5,
            fmt="%.3g",
            color=INK,
            width=0.36,
            height=0.055,
            position_x=0.32,
            position_y=0.055,
            title_font_size=round(26 * size),
            label_font_size=round(22 * size),
        )

    def _look(self, bounds):
        """The camera, at the same place in every frame."""
        low, high = np.array(bounds).reshape(3, 2).T
        focus = (low + high) / 2 if self.view.focus is None else np.array(self.view.focus)
        height = np.linalg.norm(high - low) / 3 if self.view.height is None else self.view.height
        away = np.array(self.view.direction) / np.linalg.norm(self.view.direction)
        camera = self.plotter.camera
        camera.focal_point = focus
        camera.position = focus + 10 * np.linalg.norm(high - low) * away
        camera.up = (0, 0, 1)
        camera.parallel_scale = height
        self.plotter.reset_camera_clipping_range()


class View:
    """From where, how large and in which colours a run is seen."""

    def __init__(self, direction, focus=None, height=None, **more):
        self.direction, self.focus, self.height = direction, focus, height
        self.size, self.by = more.get("size", (1800, 1000)), more.get("by", "z")
        # Whether with the bar of colours, and how far from the left the title is.
        self.bar, self.left = more.get("bar", True), more.get("left", 0.035)


def write_gif(pictures, path, seconds):
    """One palette for all frames: what stands still costs nothing then."""
    tall = np.vstack(pictures[:: max(1, len(pictures) // 8)])
    palette = Image.fromarray(tall).quantize(96, method=Image.Quantize.MEDIANCUT)
    plain = Image.Dither.NONE
    frames = [Image.fromarray(p).quantize(palette=palette, dither=plain) for p in pictures]
    times = [round(1000 * seconds)] * (len(frames) - 1) + [2000]
    buffer = io.BytesIO()
    frames[0].save(
        buffer, "GIF", save_all=True, append_images=frames[1:], duration=times, loop=0, optimize=True
    )
    Path(path).write_bytes(buffer.getvalue())


def arguments():
    """What the command line says."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    three = {"type": float, "nargs": 3, "metavar": ("X", "Y", "Z")}
    parser.add_argument("results", type=Path, help="folder of the results")
    parser.add_argument("output", type=Path, help="the film, .gif, or one picture, .png")
    parser.add_argument("--from", dest="direction", default=(-0.6, -1.0, 0.45), **three)
    parser.add_argument("--focus", help="point in the middle of the picture, m", **three)
    parser.add_argument("--height", type=float, help="metres above and below that point")
    parser.add_argument("--size", type=int, nargs=2, help="pixels of the picture")
    parser.add_argument("--by", choices=TITLES, default="z", help="what the colours show")
    parser.add_argument("--no-bar", action="store_true", help="without the bar of colours")
    parser.add_argument("--frame", type=int, default=-1, help="of a picture; -1 is the last")
    parser.add_argument("--every", type=int, default=1, help="of a film: every so many frames")
    parser.add_argument("--seconds", type=float, default=0.06, help="of a film: a frame takes")
    parser.add_argument("--title", default="", help="words above the picture")
    return parser.parse_args()


def main():
    """Draws the film or the picture."""
    given = arguments()
    run = Run(given.results)
    film_wanted = given.output.suffix.lower() == ".gif"
    size = tuple(given.size or ((900, 500) if film_wanted else (1800, 1000)))
    view = View(
        given.direction, given.focus, given.height, size=size, by=given.by, bar=not given.no_bar
    )
    film = Film(run, view)
    if film_wanted:
        frames = range(0, len(run.times), given.every)
        title = given.title
        pictures = [film.draw(i, title, f"{run.times[i]:.1f} s") for i in frames]
        write_gif(pictures, given.output, given.seconds)
    else:
        picture = film.draw(given.frame, given.title, f"{run.times[given.frame]:.1f} s")
        Image.fromarray(picture).save(given.output)
    print(given.output)


if __name__ == "__main__":
    main()

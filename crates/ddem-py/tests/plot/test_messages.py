"""Every message of the module itself is raised once, and kept in messages.txt.

`DDEM_DOCS=1 pytest crates/ddem-py/tests/plot/test_messages.py` writes the file anew.
"""

import argparse
import ast
import os
import re
import shutil
import sys
from pathlib import Path

import ddem
import numpy as np
import pytest
from ddem import __main__ as program
from ddem import _animate, _mesh, _plot, _probes, _results, _rock, _sizes, _stereonet, _table
from module_calls import module_calls
from sample_models import REPOSITORY, column, cube, wedge

pytest.importorskip("pyvista")
pytest.importorskip("plotly")

KEPT = Path(__file__).with_name("messages.txt")
SOURCES = Path(_plot.__file__).parent

#: Texts of the Rust sources that are not in messages.txt, each with the reason.
NOT_KEPT = {
    "could not be read": "a table that was read can be written",
    "is not a list of entries": "a deck that was read has lists there",
    "is not a table of names": "a deck that was read has tables there",
    "it no longer exists": "functions are removed only with their simulation",
    "cannot start the threads: {error} [{code}]": "needs a system without free threads",
    "the work was lost": "a fault in the program",
    "the folder of the deck": "is replaced by the next text",
    "{} regions, {} cuts": "part of a repr",
    "{} blocks, {} nodes": "part of a repr",
}

#: Comments, attributes, characters and texts of a Rust source; only texts are a group.
RUST = re.compile(
    r'//[^\n]*|#!?\[(?:"(?:\\.|[^"\\])*"|\[[^\]]*\]|[^"\[\]])*\]'
    r"|'(?:\\.|[^'\\])'"
    r'|"((?:\\.|[^"\\])*)"',
    re.DOTALL,
)


def without(monkeypatch, package, call):
    """Calls a function while a package is missing."""
    with monkeypatch.context() as missing:
        missing.setitem(sys.modules, package, None)
        call()


def calls(simulation, folder, tmp_path, monkeypatch):
    """Wrong calls, by name."""
    page, wrong = str(tmp_path / "page.html"), str(tmp_path / "elsewhere")
    built, single = column().build(), cube().build()

    def draw(**options):
        _plot.plot(simulation, show=False, **options)

    def film(**options):
        _animate.animate(folder, tmp_path / "film.gif", **options)

    def options(**given):
        plain = {"folder": folder, "field": None, "frame": -1, "view": None, "scale": None, "out": None}
        program.draw(argparse.Namespace(**plain | given))

    def without_display():
        with monkeypatch.context() as plain:
            plain.setattr(sys, "platform", "linux")
            plain.delenv("DISPLAY", raising=False)
            plain.delenv("WAYLAND_DISPLAY", raising=False)
            plain.setattr(sys.modules["pyvista"], "OFF_SCREEN", False)
            _plot.plot(simulation)

    def infinite():
        simulation.displacement[3, 1] = np.inf
        try:
            draw()
        finally:
            simulation.displacement[3, 1] = 0.0

    def without_contacts():
        simulation.contacts = {}
        draw(contacts=True)

    def without_summary():
        (folder / "summary.json").rename(folder / "other.json")
        try:
            _results.Results(folder).summary  # noqa: B018
        finally:
            (folder / "other.json").rename(folder / "summary.json")

    def several_runs():
        (folder / "frames.csv").write_text("stage,step,time\nweight,9,0.9\nweight,1,0.1\n")
        try:
            _results.Results(folder).times  # noqa: B018
        finally:
            (folder / "frames.csv").unlink()

    def damaged():
        copy = shutil.copytree(folder, tmp_path / "copies" / "damaged")
        file = copy / "blocks.vtkhdf"
        file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
        _results.Results(copy)[0].fields  # noqa: B018

    yield "damaged file", damaged
    yield "frames of several runs", several_runs
    yield "frame by its time", lambda: _results.Results(folder)[0.9]
    yield "frame of the program", lambda: program._frame("first")
    yield "frame beyond the last", lambda: options(frame=7)
    yield "frames beyond the last", lambda: film(frames=[7])
    yield "no frames", lambda: film(frames=[])
    yield "camera", lambda: film(camera=[[1.0, 2.0, 3.0]])
    yield "pictures per second", lambda: film(fps=0.0)
    yield "films without PyVista", lambda: without(monkeypatch, "pyvista", film)
    yield "films without ffmpeg", lambda: without(monkeypatch, "imageio_ffmpeg", _animate._mp4)
    yield "files without PyVista", lambda: without(
        monkeypatch, "pyvista", lambda: len(_results.Results(folder))
    )
    yield "field of a frame", lambda: _results.Results(folder)[0]["strss"]
    yield "attribute of a frame", lambda: _results.Results(folder)[0].strss
    yield "frame of a folder", lambda: _plot.plot(folder, frame=2, show=False)
    yield "frame of results", lambda: _results.Results(folder)[7]
    yield "joints of a folder", lambda: _plot.plot(wrong_joints(folder), joints="state", show=False)
    yield "contacts of a folder", lambda: _plot.plot(folder, contacts=True, show=False)
    yield "joints", lambda: _plot.plot(single, joints="state", show=False)
    yield "traces", lambda: _plot.plot(single, joints="traces", show=False)
    yield "component of a joint", lambda: draw(joints="damage", joint_component="x")
    yield "contacts", lambda: _plot.plot(built, contacts=True, show=False)
    yield "range of colours", lambda: draw(clim=(1.0, 1.0))
    yield "meshes without PyVista", lambda: without(
        monkeypatch, "pyvista", lambda: _mesh.mesh_of(simulation)
    )
    yield "name", lambda: draw(view="zx")
    yield "pages without plotly", lambda: without(
        monkeypatch, "plotly.graph_objects", lambda: draw(html=page)
    )
    yield "display", without_display
    yield "size of the window", lambda: draw(window_size=(0, 100))
    yield "scale", lambda: draw(scale=np.nan)
    yield "scale with contacts", lambda: draw(scale=2.0, contacts=True)
    yield "displacement", infinite
    yield "plots without PyVista", lambda: without(monkeypatch, "pyvista", draw)
    yield "no probes", lambda: _probes.plot_probes({})
    yield "probes without matplotlib", lambda: without(
        monkeypatch, "matplotlib.pyplot", lambda: _probes.plot_probes({})
    )
    yield "kind of probes", lambda: _probes.plot_probes([1.0])
    yield "folder of results", lambda: _results.Results(3)
    yield "missing folder", lambda: _results.Results(wrong)
    yield "missing summary", without_summary
    yield "resume and overwrite", lambda: ddem.run_deck(column(), resume=True, overwrite=True)
    yield "folder of a record", lambda: built.run(1e-3, record="")
    yield "model for a factor", lambda: ddem.factor_of_safety("deck.toml")
    yield "threads for a factor", lambda: ddem.factor_of_safety(built, threads=2)
    yield "width of a field", lambda: draw(field=np.zeros((108, 4)))
    yield "field of joints", lambda: draw(field="slip")
    yield "length of a field", lambda: draw(field=np.zeros(7))
    yield "text as a field", lambda: draw(field=np.array(["a"] * 108))
    yield "kind of simulation", lambda: _plot.plot(3, show=False)
    yield "component of a field", lambda: draw(field="mass", component="x")
    yield "frame of a simulation", lambda: draw(frame=3)
    yield "sizes without matplotlib", lambda: without(
        monkeypatch, "matplotlib.pyplot", lambda: _sizes.plot_sizes(built)
    )
    yield "kind of fragments", lambda: _sizes.plot_sizes(3)
    yield "no fragments", lambda: _sizes.plot_sizes(built.fragments[:0])
    yield "stage of sizes", lambda: _sizes.plot_sizes(built, stage="weight")
    yield from rock_calls(monkeypatch)
    yield from module_calls(tmp_path, monkeypatch)
    yield "tables without pandas", lambda: without(monkeypatch, "pandas", _table._pandas)


def rock_calls(monkeypatch):
    """Wrong calls about cut rock, by name."""
    model = wedge()
    cells = model.cells()
    joined = ddem.Model()
    joined.add_region(box={"from": (0, 0, 0), "to": (1, 1, 1)}, material=model_rock())
    yield "polyhedra without PyVista", lambda: without(monkeypatch, "pyvista", cells.mesh)
    yield "kind of cells", lambda: _rock.plot_blocks("deck.toml")
    yield "distance of blocks", lambda: _rock.plot_blocks(cells, explode=np.inf)
    yield "cells to draw", lambda: _rock.plot_blocks(cells, where=[9])
    yield "no cells to draw", lambda: _rock.plot_blocks(cells, where=[])
    yield "colour of cells", lambda: _rock.plot_blocks(cells, "factors")
    yield "number of colours", lambda: _rock.plot_blocks(cells, [1.0])
    yield "kind of colours", lambda: _rock.plot_blocks(cells, [None] * 4)
    yield "name of a cut", lambda: _stereonet.plot_stereonet(cells, cuts="c")
    yield "no planes", lambda: _stereonet.plot_stereonet(joined)
    yield "nets without matplotlib", lambda: without(
        monkeypatch, "matplotlib.pyplot", lambda: _stereonet.plot_stereonet(cells)
    )


def model_rock():
    """A material."""
    return ddem.Material(density=2600, young=10e9, poisson=0.25)


def wrong_joints(folder):
    """Folder without the file of its joints."""
    (folder / "joints.vtkhdf").unlink(missing_ok=True)
    return folder


def test_messages_are_kept(simulation, folder, tmp_path, monkeypatch):
    lines = []
    for name, call in calls(simulation, folder, tmp_path, monkeypatch):
        with pytest.raises((Exception, KeyboardInterrupt)) as raised:  # noqa: B017, PT011
            call()
        text = str(raised.value).replace(str(tmp_path), "DIR").replace("\0", "NUL")
        assert "\n" not in text, name
        lines.append(f"{name}: {raised.type.__name__}: {text}")
    found = "\n".join(lines) + "\n"
    if os.environ.get("DDEM_DOCS"):
        KEPT.write_text(found, encoding="utf-8")
    assert found == KEPT.read_text(encoding="utf-8")


def texts():
    """Constant parts of every message that the Python sources raise, with its place."""
    for path in sorted(SOURCES.glob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call) and node.exc.args:
                given = node.exc.args[0]
                values = given.values if isinstance(given, ast.JoinedStr) else [given]
                parts = [v.value for v in values if isinstance(v, ast.Constant)]
                if parts:
                    yield f"{path.name}:{node.lineno}", parts


def rust_texts():
    """Every text of three words or more in the Rust sources, but reprs and tests."""
    for path in sorted((REPOSITORY / "crates/ddem-py/src").rglob("*.rs")):
        source = path.read_text(encoding="utf-8").split("#[cfg(test)]")[0]
        for text in filter(None, RUST.findall(source)):
            text = re.sub(r"\\\n\s*", "", text).replace('\\"', '"')
            if len(text.split()) > 2 and not text.startswith("<"):
                yield text


def is_kept(parts, kept):
    """True if a line has all parts of a message, in their order."""
    return re.search(".*".join(map(re.escape, parts)), kept) is not None


def test_all_messages_are_kept():
    kept = KEPT.read_text(encoding="utf-8")
    assert [one for one in texts() if not is_kept(one[1], kept)] == []
    parts = {text: re.split(r"\{[^}]*\}", text) for text in rust_texts()}
    missing = {text for text in parts if not is_kept(parts[text], kept)}
    assert missing == set(NOT_KEPT)

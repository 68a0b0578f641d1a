"""Pages: the data given to plotly, and pages without external files."""

import base64
import gzip
import json
import re
import shutil
import subprocess
import sys
from html import unescape
from html.parser import HTMLParser
from itertools import product

import numpy as np
import pytest
from ddem import _layers, _plot
from ddem._plot import plot
from four_blocks import four_blocks

pv = pytest.importorskip("pyvista")
pytest.importorskip("plotly")


class Tags(HTMLParser):
    """The tags of a page, all its references and its scripts."""

    def __init__(self):
        super().__init__()
        self.tags, self.refers, self.scripts = [], [], [""]

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        self.refers += [value for key, value in attributes if key in ("src", "href", "srcset")]
        self.scripts.append("")

    def handle_data(self, data):
        if self.tags[-1:] == ["script"]:
            self.scripts[-1] += data


def page(path):
    """The tags of a page, and the data given to plotly: traces, layout and settings."""
    tags = Tags()
    tags.feed(path.read_text("utf-8"))
    arguments = tags.scripts[-1].split("Plotly.newPlot(", 1)[1]
    decoder, given = json.JSONDecoder(object_hook=numbers), []
    while len(given) < 4:
        arguments = arguments.lstrip(" ,")
        value, end = decoder.raw_decode(arguments)
        given.append(value)
        arguments = arguments[end:]
    return tags, *given[1:]


def numbers(value):
    """An array in the packed form of plotly."""
    if set(value) != {"dtype", "bdata"}:
        return value
    return np.frombuffer(base64.b64decode(value["bdata"]), "<" + value["dtype"])


def places(trace):
    return np.stack([trace[axis] for axis in "xyz"], axis=1)


def triangles(trace):
    return np.stack([trace[corner] for corner in "ijk"], axis=1)


# --- contents ---


def test_page_has_no_external_files(simulation, tmp_path):
    plot(simulation, joints="state", html=tmp_path / "page.html")
    tags, _, layout, settings = page(tmp_path / "page.html")
    assert tags.refers == []
    # The title can neither end the script nor add tags.
    assert set(tags.tags) == {"html", "head", "meta", "title", "style", "body", "div", "script"}
    assert layout["title"]["text"].startswith("four blocks &lt;/script&gt;&lt;b&gt;<br>")
    # Plotly 7 would offer to send all numbers to a server.
    assert settings["showSendToCloud"] is False


def test_page_has_nodal_field(drawn, simulation, tmp_path):
    field = {"component": "z", "scale": 10.0}
    plot(simulation, "velocity", html=tmp_path / "page.html", **field)
    _, (faces, lines), layout, _ = page(tmp_path / "page.html")
    mesh = drawn("velocity", **field)["blocks"]
    assert np.array_equal(places(faces), mesh.points.astype(np.float32))
    quads = mesh.regular_faces
    halves = np.stack([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]], axis=1)
    assert np.array_equal(triangles(faces), halves.reshape(-1, 3))
    assert faces["intensitymode"] == "vertex"
    exact = simulation.velocity[mesh["node"], 2]
    assert np.array_equal(faces["intensity"], exact.astype(np.float32))
    assert (faces["cmin"], faces["cmax"]) == (-np.abs(exact).max(), np.abs(exact).max())
    assert faces["colorbar"]["title"]["text"] == "velocity z (m/s)"
    assert faces["flatshading"] is True
    ends = places(lines).reshape(-1, 3, 3)
    assert len(ends) == 4 * 12 * 2
    assert np.isnan(ends[:, 2]).all()
    assert np.allclose(np.ptp(ends[:, :2], axis=1).max(axis=1), 0.5, atol=0.01)
    assert layout["title"]["text"].split("<br>")[1].count("t = 0.25 s, displacements × 10<") == 1


def test_page_has_element_field(drawn, simulation, tmp_path):
    plot(simulation, "stress", component="s1", html=tmp_path / "page.html", edges="none")
    _, (faces,), _, _ = page(tmp_path / "page.html")
    mesh = drawn("stress", component="s1")["blocks"]
    assert faces["intensitymode"] == "cell"
    exact = mesh.cell_data["stress s1 (Pa)"].astype(np.float32)
    assert np.array_equal(faces["intensity"].reshape(-1, 2), np.stack([exact, exact], axis=1))
    assert len(faces["intensity"]) == len(faces["i"])


def test_page_has_colours_of_the_colour_map(simulation, tmp_path):
    import matplotlib

    plot(simulation, cmap="magma", clim=(0.0, 1.0), html=tmp_path / "page.html")
    _, (faces, _), _, _ = page(tmp_path / "page.html")
    for share, colour in faces["colorscale"]:
        exact = matplotlib.colormaps["magma"](share, bytes=True)[:3]
        assert colour == "rgb({},{},{})".format(*exact)
    assert [float(tick) for tick in faces["colorbar"]["ticktext"]] == [0, 0.25, 0.5, 0.75, 1]


def test_page_lists_joint_states_with_counts(drawn, simulation, tmp_path):
    simulation.pairs["state"][simulation.pairs["state"] == 2] = 1
    plot(simulation, joints="state", scale=10.0, html=tmp_path / "page.html")
    _, traces, _, _ = page(tmp_path / "page.html")
    entries = {trace["name"]: trace for trace in traces if trace.get("showlegend")}
    assert list(entries) == ["bonded (9)", "failed in shear (18)", "failed in tension (0)"]
    faces = {trace["name"]: trace for trace in traces if trace["type"] == "mesh3d"}
    assert list(faces) == ["blocks", "bonded", "failed in shear"]
    for (legend, entry), (name, colour) in zip(entries.items(), _layers.STATES[:3], strict=True):
        # A click on the entry hides its whole group.
        assert entry["legendgroup"] == name
        assert entry["marker"]["color"] == colour
        assert legend.startswith(name)
    assert faces["bonded"]["opacity"] < 0.1
    assert faces["failed in shear"]["opacity"] == 1.0
    mesh = drawn(joints="state", scale=10.0)["failed in shear"]
    assert np.array_equal(places(faces["failed in shear"]), mesh.points.astype(np.float32))


def test_page_offsets_large_coordinates(simulation, tmp_path):
    site = np.array([500000.0, -4100000.0, 12.0])
    simulation.points = simulation.points / 3.0 + site
    plot(simulation, scale=1.0, html=tmp_path / "page.html")
    _, (faces, lines), layout, _ = page(tmp_path / "page.html")
    titles = [layout["scene"][f"{axis}axis"]["title"]["text"] for axis in "xyz"]
    assert titles == ["x − 500000 (m)", "y + 4100000 (m)", "z (m)"]
    moved = simulation.points + simulation.displacement
    for trace in (faces, lines):
        ends = places(trace)
        ends = ends[np.isfinite(ends).all(axis=1)] + [500000.0, -4100000.0, 0.0]
        # Single precision alone would cause errors of decimetres.
        assert np.allclose(ends.min(axis=0), moved.min(axis=0), rtol=0, atol=1e-6)
        assert np.allclose(ends.max(axis=0), moved.max(axis=0), rtol=0, atol=1e-6)


@pytest.mark.parametrize("stretch", [(1, 1, 1), (50, 1, 1), (1, 1, 300), (0.1, 9, 1)])
def test_page_shows_whole_model_undistorted(simulation, tmp_path, stretch):
    simulation.points = simulation.points * stretch
    views = ("iso", "xy", "xz", "yz", "-xy", "-xz", "-yz")
    for view in views:
        html, size = tmp_path / "page.html", (1500, 900)
        plot(simulation, view=view, scale=1.0, html=html, window_size=size)
        _, (faces, _), layout, _ = page(html)
        scene = layout["scene"]
        low, high = np.array([scene[f"{axis}axis"]["range"] for axis in "xyz"]).T
        aspect = np.array([scene["aspectratio"][axis] for axis in "xyz"])
        assert np.allclose(aspect / (high - low), aspect[0] / (high - low)[0])
        points = (places(faces).astype(float) - low) / (high - low)
        assert points.min() > 0.0
        assert points.max() < 1.0
        # All corners of the axes are in the picture and not too far away.
        points = (np.array(list(product((0.0, 1.0), repeat=3))) - 0.5) * aspect
        eye, up = (np.array(list(scene["camera"][of].values())) for of in ("eye", "up"))
        back = eye / np.linalg.norm(eye)
        right = np.cross(up, back)
        right /= np.linalg.norm(right)
        far = np.linalg.norm(eye) - points @ back
        assert far.min() > 0.02
        half = far * np.tan(np.pi / 8)
        places_x = points @ right / (half * size[0] / size[1])
        places_y = points @ np.cross(back, right) / half
        assert max(np.abs(places_x).max(), np.abs(places_y).max()) < 0.95
        assert max(np.ptp(places_x), np.ptp(places_y)) > 0.5
        if view != "iso":
            assert np.allclose([back, np.cross(back, right)], _plot.VIEWS[view], atol=1e-3)


def test_page_draws_nan_values_in_plain_colour(simulation, tmp_path):
    ages = np.arange(len(simulation.elements), dtype=float)
    ages[0] = np.nan
    plot(simulation, ages, html=tmp_path / "page.html", edges="none")
    _, (known, unknown), _, _ = page(tmp_path / "page.html")
    # An element in the corner of its block has three outer faces.
    assert (len(known["i"]), len(unknown["i"])) == (2 * (4 * 24 - 3), 2 * 3)
    assert np.isfinite(known["intensity"]).all()
    assert "intensity" not in unknown
    assert unknown["color"] == _layers.PLAIN
    ages = np.arange(len(simulation.points), dtype=float)
    ages[0] = np.nan
    plot(simulation, ages, html=tmp_path / "page.html", edges="none")
    _, (known, unknown), _, _ = page(tmp_path / "page.html")
    assert len(unknown["i"]) == 2 * 3
    assert np.isfinite(known["intensity"][triangles(known)]).all()


def test_page_needs_plotly(simulation, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "plotly.graph_objects", None)
    with pytest.raises(ImportError, match=r"plotly: pip install \"ddem\[plot\]\""):
        plot(simulation, html=tmp_path / "page.html")
    assert not (tmp_path / "page.html").exists()
    plot(simulation, screenshot=tmp_path / "picture.png")


def test_page_size_grows_with_surface_only(tmp_path):
    big = four_blocks(divisions=32)
    plot(big, "stress", html=tmp_path / "big.html")
    plot(four_blocks(divisions=1), "stress", html=tmp_path / "small.html")
    sizes = [(tmp_path / name).stat().st_size for name in ("small.html", "big.html")]
    assert 3e6 < sizes[0] < 6e6
    assert 30 < (sizes[1] - sizes[0]) / (4 * 6 * 32**2) < 75


# --- where pages are shown ---


@pytest.fixture
def inline(monkeypatch):
    """Objects that plot() displays below the cell of a notebook."""
    display = pytest.importorskip("IPython.display")
    monkeypatch.setattr(_plot, "_in_notebook", lambda: True)
    shown = []
    monkeypatch.setattr(display, "display", shown.append)
    return shown


def test_notebook_shows_page(inline, simulation, tmp_path):
    assert plot(simulation, "mass", html=tmp_path / "page.html") is not None
    assert inline == []
    plot(simulation, "mass")
    (shown,) = inline
    frame = re.fullmatch(r'<div><iframe srcdoc="([^"]*)" style="[^"]*"></iframe></div>', shown.data)
    packed = re.search(r'atob\("([^"]*)"\)', unescape(frame[1]))[1]
    exact = (tmp_path / "page.html").read_text("utf-8")
    assert gzip.decompress(base64.b64decode(packed)).decode() == exact
    # Notebooks store it.
    assert len(shown.data) < 0.45 * len(exact)


@pytest.mark.parametrize("notebook", [False, True], ids=["page", "notebook"])
def test_browser_shows_page_without_network(inline, simulation, tmp_path, notebook):
    browser = next(filter(None, map(shutil.which, ("chromium", "chromium-browser"))), None)
    if browser is None:
        pytest.skip("no Chromium")
    html, picture = tmp_path / "page.html", tmp_path / "page.png"
    if notebook:
        plot(simulation, joints="state")
        html.write_text(f'<meta charset="utf-8">{inline[0].data}', "utf-8")
    else:
        plot(simulation, joints="state", html=html)
    software = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    quiet = ["--no-first-run", "--disable-background-networking", "--disable-component-update"]
    cut = ["--host-resolver-rules=MAP * ~NOTFOUND", "--disable-quic", "--disable-sync"]
    run = ["--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path / 'user'}"]
    drawn = ["--window-size=1200,900", "--virtual-time-budget=20000", f"--screenshot={picture}"]
    command = [browser, *run, *software, *quiet, *cut, *drawn, html.as_uri()]
    subprocess.run(command, check=True, capture_output=True, timeout=120)
    image = pv.read(picture).active_scalars[:, :3].astype(int)
    counts = [(image[:, strong] - image[:, weak] > 60).sum() for strong, weak in ((0, 2), (2, 0))]
    assert min(counts) > 2000  # joints in red and blue, far more than the legend has

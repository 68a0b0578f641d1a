"""Pictures: what is on them, what they refuse, and that they stand alone."""

import base64
import csv
import json
import re
import shutil
import subprocess
import sys
from html import unescape
from html.parser import HTMLParser
from itertools import product
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

pv = pytest.importorskip("pyvista")
pytest.importorskip("plotly")

from ddem import _layers, _plot, _scene  # noqa: E402
from ddem._plot import plot  # noqa: E402
from ddem._probes import plot_probes, read_probes  # noqa: E402

CORNERS = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
)
PAIR = np.dtype(
    [
        ("point", "f8", 3),
        ("nodes", "i8", 2),
        ("joint", "i8"),
        ("displacement", "f8", 3),
        ("traction", "f8", 3),
        ("slip", "f8", 3),
        ("opening", "f8"),
        ("state", "i8"),
        ("open", "i8"),
        ("failure_time", "f8"),
        ("damage", "f8"),
    ]
)


def four_blocks(divisions=2, amplitude=0.002):
    """Four cubes of 1 m in a row along x, a wave of displacement, joints at x = 1, 2, 3."""
    n = divisions
    steps = np.arange(n + 1) / n
    z, y, x = np.meshgrid(steps, steps, steps, indexing="ij")
    cube = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    number = np.arange((n + 1) ** 3).reshape(n + 1, n + 1, n + 1)  # z, y, x
    cells = np.array(
        [
            [number[k + c, j + b, i + a] for a, b, c in CORNERS]
            for k in range(n)
            for j in range(n)
            for i in range(n)
        ]
    )
    points = np.concatenate([cube + (block, 0, 0) for block in range(4)])
    elements = np.concatenate([cells + block * len(cube) for block in range(4)])
    displacement = np.zeros_like(points)
    displacement[:, 2] = amplitude * np.sin(points[:, 0])
    side = np.arange((n + 1) ** 2)
    pairs = np.zeros(3 * len(side), PAIR)
    quads = []
    for joint in range(3):
        part = slice(joint * len(side), (joint + 1) * len(side))
        a = number[:, :, n].reshape(-1) + joint * len(cube)
        b = number[:, :, 0].reshape(-1) + (joint + 1) * len(cube)
        pairs["nodes"][part] = np.stack([a, b], axis=1)
        pairs["point"][part] = points[a]
        pairs["displacement"][part] = 0.5 * (displacement[a] + displacement[b])
        pairs["state"][part] = joint
        at = side.reshape(n + 1, n + 1) + joint * len(side)
        quads.append(np.stack([at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]], axis=-1))
    pairs["failure_time"] = np.where(pairs["state"] > 0, 0.1 * pairs["state"], np.nan)
    pairs["slip"][:, 1] = 0.01 * pairs["state"]
    pairs["traction"][:, 0] = np.linspace(-1e6, 1e6, len(pairs))
    rng = np.random.default_rng(1)
    history = np.zeros(5, [("time", "f8"), ("step", "i8"), ("x", "f8"), ("y", "f8"), ("z", "f8")])
    history["step"] = 10 * np.arange(5)
    history["z"] = np.arange(5) ** 2

    def field(name, *, nodes=None, out=None):
        raise ValueError(f"unknown field {name}")

    return SimpleNamespace(
        title="four blocks </script><b>",
        time=0.25,
        points=points,
        elements=elements,
        element_block=np.repeat(np.arange(4), len(cells)),
        node_block=np.repeat(np.arange(4), len(cube)),
        displacement=displacement,
        velocity=rng.normal(size=points.shape),
        force=rng.normal(size=points.shape),
        mass=rng.uniform(1.0, 2.0, len(points)),
        stress=rng.normal(scale=1e6, size=(len(elements), 6)),
        pairs=pairs,
        quads=np.concatenate(quads).reshape(-1, 4),
        probes={"top": history},
        summary={"deck": {"probe": [{"name": "top", "quantity": "velocity"}]}},
        field=field,
    )


@pytest.fixture
def simulation():
    return four_blocks()


@pytest.fixture
def drawn(simulation):
    """The meshes of a picture by the name of their actor."""
    plotters = []

    def draw(*args, **options):
        plotters.append(plot(options.pop("of", simulation), *args, show=False, **options))
        return {
            name: actor.mapper.dataset
            for name, actor in plotters[-1].actors.items()
            if hasattr(getattr(actor, "mapper", None), "dataset")
        }

    yield draw
    for plotter in plotters:
        plotter.close()


def colours(path):
    """How many colours an image has, greys of smoothed letters left out."""
    image = pv.read(path).active_scalars[:, :3].astype(int)
    return len(np.unique(image[np.ptp(image, axis=1) > 24], axis=0))


# --- where things are ---


def test_blocks_are_drawn_where_they_have_moved(drawn, simulation):
    mesh = drawn(scale=100.0)["blocks"]
    moved = simulation.points + 100.0 * simulation.displacement
    assert np.allclose(mesh.points, moved[mesh["node"]], rtol=0, atol=1e-6)
    assert np.isclose(mesh.bounds[5], moved[:, 2].max(), atol=1e-6)
    assert mesh.bounds[5] > 1.19


def test_only_faces_between_elements_of_a_block_are_left_out(drawn):
    mesh = drawn()["blocks"]
    assert mesh.n_cells == 4 * 6 * 2 * 2
    assert np.isclose(drawn(scale=0.0)["blocks"].area, 4 * 6.0)


def test_edges_are_the_twelve_of_each_block_unless_all_are_wanted(drawn):
    assert drawn(edges="blocks")["edges"].n_cells == 4 * 12 * 2
    # 3 lines of 2 edges in 2 directions on 6 faces; those on the twelve edges belong to two faces.
    assert drawn(edges="elements")["edges"].n_cells == 4 * (6 * 12 - 12 * 2)
    assert "edges" not in drawn(edges="none")


def test_faces_look_outward(simulation):
    faces, owners = _scene.skin(simulation.elements)
    at = simulation.points[faces]
    normal = np.cross(at[:, 2] - at[:, 0], at[:, 3] - at[:, 1])
    inside = simulation.points[simulation.elements[owners]].mean(axis=1)
    assert (((at.mean(axis=1) - inside) * normal).sum(axis=1) > 0).all()


@pytest.mark.parametrize(
    ("most", "scale"),
    [(0.002, 100.0), (0.003, 50.0), (1e-9, 2e8), (0.15, 1.0), (0.2, 1.0), (7.0, 1.0), (0.0, 1.0)],
)
def test_automatic_scale(most, scale):
    points = np.array([[0.0, 0.0, 0.0], [4.0, 1.0, 1.0]])
    assert _scene.automatic_scale(points, np.array([[0.0, 0.0, -most], [0.0, 0.0, 0.0]])) == scale


# --- what colours mean ---


@pytest.mark.parametrize("name", ["displacement", "velocity", "force"])
def test_nodal_values_are_those_of_the_field_to_the_last_bit(drawn, simulation, name):
    unit = {"displacement": "m", "velocity": "m/s", "force": "N"}[name]
    mesh = drawn(name, component="z")["blocks"]
    exact = getattr(simulation, name)[mesh["node"], 2]
    assert np.array_equal(mesh.point_data[f"{name} z ({unit})"], exact)


def test_stresses_are_those_of_the_elements_to_the_last_bit(drawn, simulation):
    mesh = drawn("stress", component="yz")["blocks"]
    assert np.array_equal(mesh.cell_data["stress yz (Pa)"], simulation.stress[mesh["element"], 4])


def test_arrays_of_the_user_on_nodes_and_elements(drawn, simulation):
    nodal = np.arange(len(simulation.points))
    mesh = drawn(nodal, label="age (years)")["blocks"]
    assert np.array_equal(mesh.point_data["age (years)"], nodal[mesh["node"]])
    mesh = drawn(simulation.element_block == 2)["blocks"]
    assert mesh.cell_data["values"].sum() == 6 * 2 * 2


def test_measures_of_stress():
    # Pure shear: von Mises √3 τ, principal stresses ±τ.
    shear = np.array([[0.0, 0.0, 0.0, 5.0, 0.0, 0.0]])
    uniaxial = np.array([[0.0, 0.0, -7.0, 0.0, 0.0, 0.0]])
    both = np.concatenate([shear, uniaxial])
    assert np.allclose(_scene.measure(both, "von_mises")[0], [5.0 * np.sqrt(3.0), 7.0])
    for part, exact in (("s1", [5.0, 0.0]), ("s2", [0.0, 0.0]), ("s3", [-5.0, -7.0])):
        assert np.allclose(_scene.measure(both, part)[0], exact, atol=1e-12)
    # 3, 1, -2 turned about an axis in general position.
    turned, _ = np.linalg.qr([[1.0, 2.0, 3.0], [0.0, 1.0, 4.0], [5.0, 6.0, 0.0]])
    full = turned @ np.diag([3.0, 1.0, -2.0]) @ turned.T
    stress = full[[0, 1, 2, 0, 1, 2], [0, 1, 2, 1, 2, 0]][None]
    for part, exact in (("s1", 3.0), ("s2", 1.0), ("s3", -2.0), ("von_mises", np.sqrt(19.0))):
        assert np.allclose(_scene.measure(stress, part)[0], exact)


def test_signs_share_a_bar_about_zero(simulation):
    frame = _scene.frame_of(simulation, -1, False)
    bar = _layers.blocks(frame, "stress", "xx", None, (None, None), 1.0, "none", 1.0)[0].bar
    assert bar.cmap.name == "RdBu_r"
    assert bar.clim[0] == -bar.clim[1]
    bar = _layers.blocks(frame, "mass", None, None, (None, (0.0, 3.0)), 1.0, "none", 1.0)[0].bar
    assert (bar.cmap.name, bar.clim) == ("viridis", (0.0, 3.0))


# --- joints ---


def test_states_have_layers_of_their_own(drawn, simulation):
    meshes = drawn(joints="state", scale=10.0)
    for joint, name in enumerate(("bonded", "failed in shear", "failed in tension")):
        mesh = meshes[name]
        assert mesh.n_cells == 4 * 4
        assert np.isclose(mesh.area, 1.0)
        z = 10.0 * 0.002 * np.sin(joint + 1.0)
        assert np.allclose(mesh.bounds, [joint + 1, joint + 1, 0, 1, z, 1 + z], atol=1e-6)
    assert meshes["blocks"].array_names == ["node", "element"]


def test_an_element_shows_the_state_of_each_of_its_pairs(drawn, simulation):
    simulation.pairs["state"] = 0
    simulation.pairs["state"][4] = 1  # the middle of the face at x = 1
    mesh = drawn(joints="state", scale=0.0)["failed in shear"]
    assert np.allclose(mesh.bounds, [1, 1, 0.25, 0.75, 0.25, 0.75])


def test_fields_of_joints_show_what_failed(drawn, simulation):
    mesh = drawn(joints="failure_time")["joints"]
    assert np.allclose(np.unique(mesh.cell_data["failure time (s)"]), [0.1, 0.2])
    mesh = drawn(joints="slip", joint_component="y")["joints"]
    assert np.allclose(np.unique(mesh.cell_data["slip y (m)"]), [0.01, 0.02])
    mesh = drawn(joints="traction", joint_component="x")["joints"]
    values = simulation.pairs["traction"][simulation.quads.reshape(-1), 0]
    assert np.array_equal(mesh.cell_data["traction x (Pa)"], values)


def test_nothing_failed_is_a_picture_too(drawn, simulation):
    simulation.pairs["state"] = 0
    simulation.pairs["failure_time"] = np.nan
    meshes = drawn(joints="failure_time")
    assert "joints" not in meshes
    assert meshes["bonded"].n_cells == 3 * 4 * 4


def test_blocks_and_joints_both_coloured(drawn):
    meshes = drawn("stress", component="s1", joints="slip")
    assert "stress s1 (Pa)" in meshes["blocks"].cell_data
    assert "slip magnitude (m)" in meshes["joints"].cell_data


# --- files ---


def test_screenshot_is_not_blank(simulation, tmp_path):
    plot(simulation, screenshot=tmp_path / "u.png", window_size=(600, 450))
    image = pv.read(tmp_path / "u.png")
    assert image.dimensions[:2] == (600, 450)
    assert colours(tmp_path / "u.png") > 100


def test_a_screenshot_has_the_colours_of_the_states(simulation, tmp_path):
    file = tmp_path / "joints.png"
    plot(simulation, joints="state", opacity=0.0, edges="none", screenshot=file)
    image = pv.read(file).active_scalars[:, :3].astype(int)
    counts = [(image[:, strong] - image[:, weak] > 60).sum() for strong, weak in ((0, 2), (2, 0))]
    assert min(counts) > 2000  # red and blue


def test_translucent_blocks_are_there(simulation, tmp_path):
    file = tmp_path / "clear.png"
    plot(simulation, joints="state", edges="none", opacity=0.5, screenshot=file)
    image = pv.read(file).active_scalars[:, :3].astype(int)
    assert (image.sum(axis=1) < 720).mean() > 0.1


def test_files_leave_no_plotter_behind(simulation, tmp_path):
    before = len(pv.plotting._ALL_PLOTTERS)
    plot(simulation, screenshot=tmp_path / "a.png", html=tmp_path / "a.html")
    with pytest.raises(ValueError):
        plot(simulation, screenshot=tmp_path / "a.nothing")
    assert len(pv.plotting._ALL_PLOTTERS) == before


class Tags(HTMLParser):
    """The tags of a page, all that they refer to, and its scripts."""

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
    """The tags of a page, and what plotly is told to draw: traces, layout and settings."""
    tags = Tags()
    tags.feed(path.read_text("utf-8"))
    told = tags.scripts[-1].split("Plotly.newPlot(", 1)[1]
    decoder, given = json.JSONDecoder(object_hook=numbers), []
    while len(given) < 4:
        told = told.lstrip(" ,")
        value, end = decoder.raw_decode(told)
        given.append(value)
        told = told[end:]
    return tags, *given[1:]


def numbers(value):
    """An array as plotly packs it."""
    if set(value) != {"dtype", "bdata"}:
        return value
    return np.frombuffer(base64.b64decode(value["bdata"]), "<" + value["dtype"])


def places(trace):
    return np.stack([trace[axis] for axis in "xyz"], axis=1)


def triangles(trace):
    return np.stack([trace[corner] for corner in "ijk"], axis=1)


def test_page_stands_alone(simulation, tmp_path):
    plot(simulation, joints="state", html=tmp_path / "page.html")
    tags, _, layout, settings = page(tmp_path / "page.html")
    assert tags.refers == []
    # The title cannot end the script nor write tags of its own.
    assert set(tags.tags) == {"html", "head", "meta", "title", "style", "body", "div", "script"}
    assert layout["title"]["text"].startswith("four blocks &lt;/script&gt;&lt;b&gt;<br>")
    # Plotly 7 would offer to send all numbers to a server.
    assert settings["showSendToCloud"] is False


def test_page_holds_the_nodal_field(drawn, simulation, tmp_path):
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


def test_page_holds_the_field_of_elements(drawn, simulation, tmp_path):
    plot(simulation, "stress", component="s1", html=tmp_path / "page.html", edges="none")
    _, (faces,), _, _ = page(tmp_path / "page.html")
    mesh = drawn("stress", component="s1")["blocks"]
    assert faces["intensitymode"] == "cell"
    exact = mesh.cell_data["stress s1 (Pa)"].astype(np.float32)
    assert np.array_equal(faces["intensity"].reshape(-1, 2), np.stack([exact, exact], axis=1))
    assert len(faces["intensity"]) == len(faces["i"])


def test_page_has_the_colours_of_the_map(simulation, tmp_path):
    import matplotlib

    plot(simulation, cmap="magma", clim=(0.0, 1.0), html=tmp_path / "page.html")
    _, (faces, _), _, _ = page(tmp_path / "page.html")
    for share, colour in faces["colorscale"]:
        exact = matplotlib.colormaps["magma"](share, bytes=True)[:3]
        assert colour == "rgb({},{},{})".format(*exact)
    assert [float(tick) for tick in faces["colorbar"]["ticktext"]] == [0, 0.25, 0.5, 0.75, 1]


def test_page_has_each_state_with_its_count(drawn, simulation, tmp_path):
    simulation.pairs["state"][simulation.pairs["state"] == 2] = 1
    plot(simulation, joints="state", scale=10.0, html=tmp_path / "page.html")
    _, traces, _, _ = page(tmp_path / "page.html")
    entries = {trace["name"]: trace for trace in traces if trace.get("showlegend")}
    assert list(entries) == ["bonded (9)", "failed in shear (18)", "failed in tension (0)"]
    faces = {trace["name"]: trace for trace in traces if trace["type"] == "mesh3d"}
    assert list(faces) == ["blocks", "bonded", "failed in shear"]
    for (legend, entry), (name, colour) in zip(entries.items(), _layers.STATES):
        # A click on the entry hides what belongs to it.
        assert entry["legendgroup"] == name
        assert entry["marker"]["color"] == colour
        assert legend.startswith(name)
    assert faces["bonded"]["opacity"] < 0.1
    assert faces["failed in shear"]["opacity"] == 1.0
    mesh = drawn(joints="state", scale=10.0)["failed in shear"]
    assert np.array_equal(places(faces["failed in shear"]), mesh.points.astype(np.float32))


def test_page_counts_from_near_where_coordinates_are_large(simulation, tmp_path):
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
        # Single precision alone would be off by decimetres.
        assert np.allclose(ends.min(axis=0), moved.min(axis=0), rtol=0, atol=1e-6)
        assert np.allclose(ends.max(axis=0), moved.max(axis=0), rtol=0, atol=1e-6)


@pytest.mark.parametrize("stretch", [(1, 1, 1), (50, 1, 1), (1, 1, 300), (0.1, 9, 1)])
def test_page_shows_all_of_the_model_in_true_proportions(simulation, tmp_path, stretch):
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
        # All corners of the axes are in the picture, and they are not far away.
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


def test_page_draws_values_that_are_not_numbers_in_plain_colour(simulation, tmp_path):
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


def test_page_stays_small(tmp_path):
    big = four_blocks(divisions=32)
    plot(big, "stress", html=tmp_path / "big.html")
    plot(four_blocks(divisions=1), "stress", html=tmp_path / "small.html")
    sizes = [(tmp_path / name).stat().st_size for name in ("small.html", "big.html")]
    assert 3e6 < sizes[0] < 6e6
    assert 30 < (sizes[1] - sizes[0]) / (4 * 6 * 32**2) < 75


@pytest.fixture
def inline(monkeypatch):
    """What plot() shows below the cell of a notebook."""
    display = pytest.importorskip("IPython.display")
    monkeypatch.setattr(_plot, "_in_notebook", lambda: True)
    shown = []
    monkeypatch.setattr(display, "display", shown.append)
    return shown


def test_notebook_shows_the_page(inline, simulation, tmp_path):
    assert plot(simulation, "mass", html=tmp_path / "page.html") is not None
    assert inline == []
    plot(simulation, "mass")
    (shown,) = inline
    frame = re.fullmatch(r'<div><iframe srcdoc="([^"]*)" style="[^"]*"></iframe></div>', shown.data)
    assert unescape(frame[1]) == (tmp_path / "page.html").read_text("utf-8")


@pytest.mark.parametrize("notebook", [False, True], ids=["page", "notebook"])
def test_browser_without_network_shows_the_page(inline, simulation, tmp_path, notebook):
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


# --- folders of results ---


@pytest.fixture
def folder(simulation, tmp_path):
    """Two frames, written by VTK; in the second everything has moved twice as far."""
    from vtkmodules.util.vtkAlgorithm import VTKPythonAlgorithmBase
    from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline as Pipeline
    from vtkmodules.vtkIOHDF import vtkHDFWriter

    class Frames(VTKPythonAlgorithmBase):
        def __init__(self, grid, moving):
            super().__init__(nInputPorts=0, nOutputPorts=1, outputType="vtkUnstructuredGrid")
            self.grid, self.moving = grid, moving

        def RequestInformation(self, request, inputs, outputs):
            out = outputs.GetInformationObject(0)
            out.Set(Pipeline.TIME_STEPS(), [0.5, 1.0], 2)
            out.Set(Pipeline.TIME_RANGE(), [0.5, 1.0], 2)
            return 1

        def RequestData(self, request, inputs, outputs):
            out = outputs.GetInformationObject(0)
            grid = self.grid.copy()
            for name in self.moving:
                grid.point_data[name] = self.grid[name] * 2.0 * out.Get(Pipeline.UPDATE_TIME_STEP())
            grid.GetInformation().Set(grid.DATA_TIME_STEP(), out.Get(Pipeline.UPDATE_TIME_STEP()))
            outputs.GetInformationObject(0).Get(grid.DATA_OBJECT()).ShallowCopy(grid)
            return 1

    def write(name, grid, moving):
        source, writer = Frames(grid, moving), vtkHDFWriter()
        writer.SetInputConnection(source.GetOutputPort())
        writer.SetFileName(str(tmp_path / name))
        writer.SetWriteAllTimeSteps(True)
        writer.Write()

    grid = pv.UnstructuredGrid({pv.CellType.HEXAHEDRON: simulation.elements}, simulation.points)
    grid.point_data["displacement"] = simulation.displacement.astype(np.float32)
    grid.cell_data["stress"] = simulation.stress.astype(np.float32)
    grid.cell_data["block"] = simulation.element_block.astype(np.int32)
    write("blocks.vtkhdf", grid, ["displacement"])
    quads = pv.UnstructuredGrid({pv.CellType.QUAD: simulation.quads}, simulation.pairs["point"])
    for name in ("displacement", "state", "slip"):
        quads.point_data[name] = simulation.pairs[name].astype(np.float32)
    write("joints.vtkhdf", quads, ["displacement"])
    (tmp_path / "summary.json").write_text(json.dumps({"title": "written", "deck": ""}))
    return tmp_path


def test_folder_is_drawn_frame_by_frame(drawn, folder, simulation):
    for frame, share in ((0, 1.0), (-2, 1.0), (1, 2.0), (-1, 2.0)):
        mesh = drawn(of=folder, frame=frame, scale=50.0)["blocks"]
        moved = simulation.points + 50.0 * share * simulation.displacement
        assert np.allclose(mesh.points, moved[mesh["node"]], atol=1e-5)
    mesh = drawn("stress", of=str(folder), component="xx")["blocks"]
    exact = simulation.stress.astype(np.float32)[mesh["element"], 0]
    assert np.array_equal(mesh.cell_data["stress xx (Pa)"], exact)
    mesh = drawn("block", of=folder)["blocks"]
    assert np.array_equal(mesh.cell_data["block"], simulation.element_block[mesh["element"]])


def test_folder_with_joints(drawn, folder):
    meshes = drawn(of=folder, joints="state", scale=10.0)
    assert np.isclose(meshes["failed in tension"].bounds[4], 10 * 2 * 0.002 * np.sin(3), atol=1e-6)


def test_folder_errors(folder, tmp_path):
    with pytest.raises(ValueError, match=r"frame: 2 is not there, .* has 2 frames"):
        plot(folder, frame=2, show=False)
    with pytest.raises(ValueError, match="field: 'strss' .* did you mean 'stress'.*'block'"):
        plot(folder, "strss", show=False)
    with pytest.raises(FileNotFoundError, match="blocks.vtkhdf"):
        plot(tmp_path / "elsewhere", show=False)
    (folder / "joints.vtkhdf").unlink()
    with pytest.raises(ValueError, match="no joints"):
        plot(folder, joints="state", show=False)


# --- probes ---


@pytest.fixture
def probed(tmp_path):
    rows = [
        ["stage", "step", "time", "a.b.x", "a.b.y", "a.b.z"]
        + [f"core.{part}" for part in ("xx", "yy", "zz", "xy", "yz", "zx")],
        ["settle", 0, 0.0, 0.1, -2e-300, 3, 1, 2, 3, 4, 5, 6],
        ["settle", 7, 0.0, "", "", "", 2, 3, 4, 5, 6, 7],
        ["push", 9, 0.30000000000000004, 1, 2, 3, "", "", "", "", "", ""],
    ]
    with open(tmp_path / "probes.csv", "w", newline="") as file:
        csv.writer(file).writerows(rows)
    return tmp_path


def test_probes_are_read_back(probed):
    probes = read_probes(probed)
    assert list(probes) == ["a.b", "core"]
    assert probes["a.b"].dtype.names == ("time", "step", "x", "y", "z")
    assert probes["a.b"]["step"].tolist() == [0, 9]
    assert probes["a.b"]["time"][1] == 0.30000000000000004
    assert probes["a.b"]["y"].tolist() == [-2e-300, 2.0]
    assert probes["core"]["step"].tolist() == [0, 7]
    assert probes["core"]["zx"].tolist() == [6.0, 7.0]


def test_a_row_that_a_killed_run_left_short_is_left_out(probed):
    with open(probed / "probes.csv", "a") as file:
        file.write("push,11,0.4,1,2")
    assert read_probes(probed)["a.b"]["step"].tolist() == [0, 9]


def test_histories_over_time_or_steps(probed, simulation, tmp_path):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure = plot_probes(probed, file=tmp_path / "probes.png")
    assert (tmp_path / "probes.png").stat().st_size > 5000
    first, second = figure.axes
    assert first.get_title(loc="left") == "a.b"
    assert [line.get_label() for line in second.lines] == ["xx", "yy", "zz", "xy", "yz", "zx"]
    assert second.get_ylabel() == "stress (Pa)"
    assert second.get_xlabel() == "time (s)"
    assert first.lines[1].get_ydata().tolist() == [-2e-300, 2.0]

    (axes,) = plot_probes(simulation, "top", component="z").axes
    assert axes.get_xlabel() == "step"
    assert axes.get_ylabel() == "velocity (m/s)"
    assert axes.lines[0].get_xdata().tolist() == [0, 10, 20, 30, 40]
    plt.close("all")


def test_wrong_probes(probed, simulation):
    with pytest.raises(ValueError, match="names: 'tap' .* did you mean 'top'"):
        plot_probes(simulation, ["tap"])
    with pytest.raises(ValueError, match="component: 'xx' .* valid: 'x', 'y', 'z'"):
        plot_probes(simulation, "top", component="xx")
    with pytest.raises(FileNotFoundError):
        plot_probes(probed / "elsewhere")
    simulation.probes = {}
    with pytest.raises(ValueError, match="there are none"):
        plot_probes(simulation)


# --- mistakes ---


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"field": "displacment"}, "field: 'displacment' .* did you mean 'displacement'"),
        ({"field": "slip"}, "joints='slip' draws it"),
        ({"component": "zz"}, "component: 'zz' .* valid: 'x', 'y', 'z', 'magnitude'"),
        ({"field": "stress", "component": "mises"}, "did you mean 'von_mises'"),
        ({"field": "mass", "component": "x"}, "component: 'x' was asked of plain numbers"),
        ({"field": np.zeros(7)}, r"field: .* \(7,\); .* 108 \(nodes\) or 32 \(elements\)"),
        ({"field": np.zeros((108, 4))}, "field: values of 4 numbers"),
        ({"field": np.array(["a"] * 108)}, "has no numbers"),
        ({"joints": "states"}, "joints: 'states' .* did you mean 'state'"),
        ({"joints": "damage", "joint_component": "x"}, "joint_component: 'damage' has none"),
        ({"view": "zx"}, "view: 'zx'"),
        ({"edges": "block"}, "edges: 'block' .* did you mean 'blocks'"),
        ({"cmap": "virids"}, "cmap: 'virids' .* did you mean 'viridis'"),
        ({"clim": (1.0, 1.0)}, "clim"),
        ({"frame": 3}, "frame"),
    ],
)
def test_mistakes_are_named(simulation, options, message):
    with pytest.raises(ValueError, match=message):
        plot(simulation, show=False, **options)


def test_what_cannot_be_drawn_is_refused(simulation):
    simulation.displacement[3, 1] = np.inf
    with pytest.raises(ValueError, match="not finite at 1 nodes"):
        plot(simulation, show=False)
    simulation.displacement[3, 1] = 0.0
    simulation.pairs, simulation.quads = simulation.pairs[:0], simulation.quads[:0]
    with pytest.raises(ValueError, match="no joints"):
        plot(simulation, joints="state", show=False)
    with pytest.raises(TypeError, match="a folder of results is needed, not int"):
        plot(3, show=False)


def test_no_display_is_said(simulation, monkeypatch):
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(RuntimeError, match="no display"):
        plot(simulation)


@pytest.mark.parametrize("name", ["pyvista", "matplotlib"])
def test_missing_extras_are_named(name):
    call = "_plot.plot(None)" if name == "pyvista" else "_probes.plot_probes(None)"
    code = f"""
import sys
sys.modules[{name!r}] = None
from ddem import _plot, _probes
try:
    {call}
except ImportError as error:
    assert 'pip install "ddem[plot]"' in str(error), error
else:
    raise SystemExit("no error")
assert not any(m.split(".")[0] in ("vtk", "vtkmodules") for m in sys.modules)
"""
    package = Path(_scene.__file__).parents[1]
    run = [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(package)!r})\n{code}"]
    subprocess.run(run, check=True)

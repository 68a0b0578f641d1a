"""Notebooks show models, simulations and results as tables with exact numbers."""

from __future__ import annotations

import threading
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import ddem
import pytest
from sample_models import REPOSITORY, ROCK, column, long, staged, wedge


class Rows(HTMLParser):
    """Rows of all tables, and the text outside of them."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.rows: list[list[str]] = []
        self.text = ""
        self.inside = False
        self.feed(html)

    def handle_starttag(self, tag: str, attributes: Any) -> None:
        if tag == "tr":
            self.rows.append([])
        elif tag in ("th", "td"):
            self.rows[-1].append("")
            self.inside = True

    def handle_endtag(self, tag: str) -> None:
        self.inside = self.inside and tag not in ("th", "td")

    def handle_data(self, data: str) -> None:
        if self.inside:
            self.rows[-1][-1] += data
        else:
            self.text += data


def shown(what: Any) -> Rows:
    return Rows(what._repr_html_())


def test_model_shows_its_size_and_entries() -> None:
    model = column(title="<b>column</b> & more")
    model.stage("settle", kind="relax")
    found = shown(model)
    # Each of two cubes has 3 × 3 × 3 nodes.
    assert "2 blocks, 54 nodes" in found.text
    assert "“<b>column</b> & more”" in found.text
    assert ["materials", "density", "young", "poisson"] in found.rows
    assert ["material-1", "2400", "1.8e+10", "0.25"] in found.rows
    assert ["fix", "1"] in found.rows and ["probe", "1"] in found.rows
    assert ["settle", "relax"] in found.rows


def test_model_with_a_function_or_a_mesh_is_shown() -> None:
    model = column(title="shaken")
    model.load(traction=(1e3, 0, 0), z=2.0, history=lambda time: time)
    assert ["load", "1"] in shown(model).rows
    corners = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
    mesh = {"nodes": corners, "hexes": [[0, 1, 3, 2, 4, 5, 7, 6]], "blocks": [0]}
    model = ddem.Model()
    model.add_blocks(mesh=mesh, material=ROCK)
    assert "1 blocks, 8 nodes" in shown(model).text
    assert ["blocks", "1"] in shown(model).rows
    assert shown(wedge()).text == "Model “wedge”1 regions, 2 cuts"
    assert shown(ddem.Model()).rows == []


def test_simulation_shows_state_and_stages() -> None:
    seam = ddem.Joint(thickness=0.01, material=ROCK, cohesion=1e7, friction=30, tension=1e7)
    simulation = column(seam, title="column").build()
    before = dict(row for row in shown(simulation).rows if len(row) == 2)
    # Joined faces of 3 × 3 nodes.
    exact = {"blocks": "2", "elements": "16", "nodes": "54", "pairs": "9", "time": "0 s", "steps": "0"}
    assert before.items() >= exact.items()
    steps = simulation.relax(name="settle")
    head, row = shown(simulation).rows[-2:]
    largest = 1e6 * abs(simulation.displacement).max()
    assert head == ["stage", "kind", "verdict", "steps", "largest displacement", "failed pairs"]
    assert row == ["settle", "relax", "at rest", str(steps), f"{largest:.4g} µm", "0 of 9"]


def test_simulation_is_text_while_another_thread_works() -> None:
    simulation = long()
    seen: list[str | None] = []

    def look() -> None:
        while True:
            try:
                simulation.steps
            except ddem.Busy:
                break
        seen.append(simulation._repr_html_())

    worker = threading.Thread(target=look, daemon=True)
    worker.start()
    simulation.step(3000, quiet=True)
    worker.join(30)
    assert seen == [None]
    # Joined faces of 9 × 9 nodes.
    assert ["pairs", "81"] in shown(simulation).rows


def test_results_show_frames_and_factor(tmp_path: Path) -> None:
    pytest.importorskip("pyvista")
    ddem.run_deck(staged(), out=tmp_path / "staged", quiet=True)
    results = ddem.Results(tmp_path / "staged")
    rows = shown(results).rows
    assert ["frames", "7"] in rows and ["folder", str(tmp_path / "staged")] in rows
    names = [row[0] for row in rows]
    assert names[-2:] == ["settle", "push"]
    (tmp_path / "staged" / "summary.json").unlink()
    unfinished = shown(ddem.Results(tmp_path / "staged")).rows
    assert ["last stage", "push"] in unfinished and ["time", "2 ms"] in unfinished


def test_results_show_factor_of_safety(tmp_path: Path) -> None:
    pytest.importorskip("pyvista")
    ddem.run_deck(REPOSITORY / "examples" / "block.toml", out=tmp_path / "block", quiet=True)
    rows = shown(ddem.Results(tmp_path / "block")).rows
    head, weight, safety = rows[-3:]
    assert (head[-1], weight[-1]) == ("factor of safety", "")
    # tan 35° / tan 30°, within the resolution of the search.
    assert abs(float(safety[-1]) - 1.2128) < 0.005

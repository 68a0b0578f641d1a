"""The examples, the notebook and all Python blocks in the documentation run as for a user."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
EXAMPLES = ROOT / "examples"
SIGNATURE = b"\x89PNG\r\n\x1a\n"

pytest.importorskip("pyvista")


def run(script, folder, *arguments):
    """Runs a script in a folder and returns its output."""
    command = [sys.executable, str(script), *arguments]
    environment = {**os.environ, "MPLBACKEND": "Agg"}
    done = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def is_picture(path):
    return path.read_bytes().startswith(SIGNATURE) and path.stat().st_size > 10_000


def test_beam_example_has_known_deflection(tmp_path):
    printed = run(EXAMPLES / "beam.py", tmp_path)
    assert abs(float(re.search(r"deflection at midspan ([\d.]+) mm", printed)[1]) - 0.681) < 0.001
    assert is_picture(tmp_path / "beam.png")
    assert "displacement" in (tmp_path / "beam.html").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", ["sweep", "coupling"])
def test_example_scripts_match_known_values(name, tmp_path):
    # Both scripts compare their results with known values and fail if they differ.
    run(EXAMPLES / f"{name}.py", tmp_path, str(tmp_path))
    assert is_picture(tmp_path / f"{name}.png")


def test_slope_safety_example_orders_factors(tmp_path):
    printed = run(EXAMPLES / "slope-safety.py", tmp_path, "slope")
    factors = [float(factor) for factor in re.findall(r"safety ([\d.]+)", printed)]
    # Friction of the bedding of 30, 34 and 32 degrees.
    assert len(factors) == 3
    assert 1.0 < factors[0] < factors[2] < factors[1] < 1.4
    assert is_picture(tmp_path / "slope" / "slope.png")


def test_notebook_runs(tmp_path):
    nbformat = pytest.importorskip("nbformat")
    nbclient = pytest.importorskip("nbclient")
    notebook = nbformat.read(EXAMPLES / "notebook.ipynb", as_version=4)
    nbformat.validate(notebook)
    stored = [shown(cell) for cell in notebook.cells]
    # As on the web, where the notebook does not run: small, and with no picture that only a script draws.
    assert (EXAMPLES / "notebook.ipynb").stat().st_size < 300_000
    assert sum(kind == "image/png" for kinds, _ in stored for kind in kinds) == 4
    resources = {"metadata": {"path": str(tmp_path)}}
    nbclient.NotebookClient(notebook, timeout=300, resources=resources).execute()
    executed = [shown(cell) for cell in notebook.cells]
    # `docs/pictures/notebook.py` renews them.
    assert [text for _, text in stored] == [text for _, text in executed]
    assert sum("iframe" in text for cell in notebook.cells for text in pages(cell)) == 2


def shown(cell):
    """Kinds of the outputs of a cell, and its text and tables."""
    outputs = [out for out in cell.get("outputs", []) if out.get("name") != "stderr"]
    tables = [out["data"].get("text/html", "") for out in outputs if "data" in out]
    printed = "".join(out.text for out in outputs if "text" in out)
    kinds = [kind for out in outputs for kind in out.get("data", {})]
    return kinds, printed + "".join(text for text in tables if "<table>" in text)


def pages(cell):
    return [out["data"].get("text/html", "") for out in cell.get("outputs", []) if "data" in out]


@pytest.mark.parametrize("page", ["README.md", "docs/python.md"])
def test_code_of_pages_runs(page, tmp_path):
    text = (ROOT / page).read_text(encoding="utf-8")
    blocks = re.findall(r"```python\n(.*?)```", text, flags=re.DOTALL)
    assert blocks
    script = tmp_path / "page.py"
    script.write_text("\n".join(blocks), encoding="utf-8")
    run(script, tmp_path)
    assert all(is_picture(path) for path in tmp_path.glob("*.png"))
    assert list(tmp_path.glob("*.png"))

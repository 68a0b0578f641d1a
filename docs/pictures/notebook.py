#!/usr/bin/env python3
"""Outputs of examples/notebook.ipynb, which it shows where it cannot run.

    python docs/pictures/notebook.py

Runs the notebook and stores its outputs, with small pictures instead of pages to rotate. Needs
`pip install ".[plot]" ipykernel nbclient`; no display.
"""

from pathlib import Path

import nbclient
import nbformat

NOTEBOOK = Path(__file__).resolve().parents[2] / "examples" / "notebook.ipynb"

# Runs first. Pages would be 2 MB each, and would not be shown on the web.
SMALL = """
import ddem
from IPython.display import Image, display
from tempfile import TemporaryDirectory

def plot(*arguments, _plot=ddem.plot, **keys):
    with TemporaryDirectory() as folder:
        _plot(*arguments, **keys, screenshot=f"{folder}/picture.png", window_size=(800, 600))
        display(Image(filename=f"{folder}/picture.png", width=600))

ddem.plot = plot
"""


def main():
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    small = nbformat.v4.new_code_cell(SMALL)
    notebook.cells.insert(0, small)
    nbclient.NotebookClient(notebook, timeout=600).execute(cwd=str(NOTEBOOK.parent))
    notebook.cells.remove(small)
    number = 0
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)
        if cell.cell_type != "code":
            continue
        number += 1
        # No bars of progress.
        kept = [out for out in cell.outputs if out.get("name") != "stderr" and not is_widget(out)]
        cell.outputs, cell.execution_count = kept, number
        for out in kept:
            if "execution_count" in out:
                out["execution_count"] = number
    notebook.metadata["language_info"] = {"name": "python"}
    nbformat.write(notebook, NOTEBOOK)


def is_widget(out):
    return any("widget" in kind for kind in out.get("data", {}))


if __name__ == "__main__":
    main()

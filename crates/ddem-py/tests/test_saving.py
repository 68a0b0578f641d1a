"""Saved and loaded simulations continue like the originals."""

from __future__ import annotations

from pathlib import Path

import ddem
from sample_models import breaking, cube, run_python, same_state


def test_saved_simulation_loads_with_same_bits(tmp_path: Path) -> None:
    simulation = breaking().build()
    simulation.relax(quiet=True)
    simulation.run(5e-4, damping=0.02, quiet=True)
    simulation.step(7)
    path = tmp_path / "state.h5"
    simulation.save(path)
    simulation.save(str(path))
    again = ddem.load(path, threads=1)
    assert same_state(simulation, again)
    assert again.title == simulation.title
    assert again.summary["stages"] == simulation.summary["stages"]
    for one in (simulation, again):
        one.step(50)
        one.run(1e-3, damping={"local": 0.1}, quiet=True)
    assert same_state(simulation, again)
    assert simulation.pairs["state"].any()


def test_applied_forces_are_saved(tmp_path: Path) -> None:
    simulation = cube().build()
    simulation.apply_force([0, 5], (1e3, 0, 0))
    simulation.step(3)
    simulation.save(tmp_path / "state.h5")
    again = ddem.load(tmp_path / "state.h5")
    assert same_state(simulation, again)
    for one in (simulation, again):
        one.step(7)
        one.apply_force(5, (0, 0, 0))
        one.step(7)
    assert same_state(simulation, again)
    assert simulation.force[0, 0] != 0


def test_h5py_works_in_the_same_process(tmp_path: Path) -> None:
    # Both modules have their own HDF5 library and may use one file in turns.
    script = f"""
import pathlib
folder = pathlib.Path({str(tmp_path)!r})
import h5py
import numpy as np
with h5py.File(folder / "mine.h5", "w") as file: file["a"] = np.arange(5.0)
import ddem
from sample_models import cube, same
simulation = cube().build()
simulation.run(1e-4, record=folder / "out", quiet=True)
simulation.save(folder / "state.h5")
with h5py.File(folder / "out" / "blocks.vtkhdf", "r") as results:
    assert len(results["VTKHDF/Points"]) >= 27
    simulation.step(3)
    ddem.load(folder / "state.h5")
with h5py.File(folder / "mine.h5", "r") as mine:
    simulation.run(1e-4, record=folder / "out", quiet=True)
    assert mine["a"][3] == 3.0
"""
    run_python(script)

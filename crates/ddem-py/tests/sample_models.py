"""Small models for several tests, comparisons, and runs of other programs."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import ddem
import h5py
import numpy as np
import pytest

REPOSITORY = Path(__file__).resolve().parents[3]

ROCK = ddem.Material(density=2400, young=18e9, poisson=0.25)
SEAM = ddem.Joint(thickness=0.01, material=ROCK)
SMOOTH = ddem.Joint(normal_stiffness=1e9, shear_stiffness=1e9, friction=30)

#: Weight of the two cubes of a metre in :func:`column` [N].
WEIGHT = 2 * 2400 * 9.81

#: A duration that no test completes [s].
ENDLESS = 1e3


def column(joint: ddem.Joint | None = SEAM, divisions: int = 2, **keys: Any) -> ddem.Model:
    """Two cubes on top of each other under their own weight, fixed at the base, with a probe at the
    top.
    """
    model = ddem.Model(**{"gravity": (0, 0, -9.81), **keys})
    model.add_blocks(
        size=(1, 1, 2), count=(1, 1, 2), divisions=divisions, material=ROCK, joint=joint, name="all"
    )
    model.fix("xyz", z=0.0)
    model.probe("top", at=(1, 1, 2))
    return model


def cube(divisions: int = 2, **keys: Any) -> ddem.Model:
    """One free cube of a metre, without weight."""
    model = ddem.Model(**keys)
    model.add_blocks(size=(1, 1, 1), divisions=divisions, material=ROCK)
    return model


def wedge() -> ddem.Model:
    """A slope of 70/156 with a flat top 10 m above the toe and two joints that make a wedge; north is turned
    so that x points out of the slope.
    """
    rock = ddem.Material(density=2600, young=10e9, poisson=0.25)
    model = ddem.Model(title="wedge", gravity=(0, 0, -9.81))
    outline = [(-25, -8), (2.911761874, -8), (-3.639702343, 10), (-25, 10)]
    prism = {"outline": outline, "axis": "y", "from": -20, "to": 20}
    north = (-0.913545457643, 0.406736643076, 0)
    model.add_region(name="slope", prism=prism, material=rock, north=north)
    for name, dip, direction in (("a", 40, 130), ("b", 60, 220)):
        plane = {"dip": dip, "dip_direction": direction, "through": (0, 0, 0)}
        model.cut(name=name, plane=plane, joint=SMOOTH)
    for side in ({"z": -8.0}, {"x": -25.0}, {"y": -20.0}, {"y": 20.0}):
        model.fix("xyz", **side)
    return model


def breaking(divisions: int = 2) -> ddem.Model:
    """Two cubes with a weak joint, pulled apart at the top."""
    weak = ddem.Joint(thickness=0.01, material=ROCK, cohesion=1e4, friction=20, tension=1e4)
    model = column(weak, divisions, contact=False)
    model.load(traction=(0, 0, 1e5), z=2.0, history={"ramp": 1e-3})
    return model


def staged() -> ddem.Model:
    """A column that settles and is pushed."""
    model = column(title="staged")
    model.load(traction=(1e5, 0, 0), z=2.0, history={"ramp": 1e-3}, from_="push")
    model.probe("foot", quantity="reaction", z=0.0)
    model.probe("stress", quantity="stress", at=(0, 0, 0), every=1e-4)
    model.stage("settle", kind="relax", tolerance=1e-5)
    model.stage("push", kind="dynamic", duration=2e-3, damping=0.02, frames=5)
    return model


def long() -> ddem.Simulation:
    """A simulation with more work than any test waits for."""
    return column(divisions=8).build(threads=2)


def assert_still_works(simulation: ddem.Simulation) -> None:
    """Checks that a simulation still works."""
    before = simulation.steps
    assert np.isfinite(simulation.displacement).all()
    assert np.isfinite(simulation.energy["balance"])
    simulation.step(3)
    simulation.run(1e-5, quiet=True)
    assert simulation.steps > before + 3


def refused(call: Callable[[], Any], kind: type[BaseException] = ValueError) -> str:
    """The message of a refused call."""
    with pytest.raises(kind) as caught:
        call()
    # For an argument of the wrong type its name is in a note, which tracebacks show.
    return "\n".join([str(caught.value), *getattr(caught.value, "__notes__", [])])


def same(a: Any, b: Any) -> bool:
    """True if two arrays have the same bits, NaN included."""
    a, b = np.asarray(a), np.asarray(b)
    return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()


def same_state(a: ddem.Simulation, b: ddem.Simulation) -> bool:
    """True if all output of two simulations has the same bits."""
    scalars = ("time", "steps", "time_step", "unbalanced", "critical_step")
    arrays = ("displacement", "velocity", "force", "stress")
    pairs_a, pairs_b = a.pairs, b.pairs
    return (
        all(getattr(a, name) == getattr(b, name) for name in scalars)
        and all(same(getattr(a, name), getattr(b, name)) for name in arrays)
        and all(same(pairs_a[name], pairs_b[name]) for name in pairs_a.dtype.names)
        and a.energy == b.energy
    )


def contents(path: Path, skip: tuple[str, ...] = ()) -> dict[str, bytes]:
    """Every data set of an HDF5 file with its bits."""
    found: dict[str, bytes] = {}

    def visit(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and name not in skip:
            value = np.asarray(item[()])
            kind = value.tolist() if value.dtype == object else value.tobytes()
            found[name] = repr((value.shape, value.dtype.str, kind)).encode()

    with h5py.File(path, "r") as file:
        file.visititems(visit)
    return found


def assert_same_results(a: Path, b: Path) -> None:
    """Asserts that two folders hold the same results, bit for bit."""
    assert (a / "probes.csv").read_text() == (b / "probes.csv").read_text()
    assert (a / "energy.csv").read_text() == (b / "energy.csv").read_text()
    assert (a / "frames.csv").read_text() == (b / "frames.csv").read_text()
    for name in ("blocks.vtkhdf", "joints.vtkhdf", "contacts.vtkhdf"):
        assert (a / name).exists() == (b / name).exists()
        if (a / name).exists():
            one, other = contents(a / name), contents(b / name)
            assert one, f"{name} holds nothing"
            assert one.keys() == other.keys()
            assert [key for key in one if one[key] != other[key]] == []


def command_line() -> Path:
    """The program `ddem`: the one in DDEM_CLI, or the one that cargo has built."""
    named = os.environ.get("DDEM_CLI")
    if named is not None:
        assert os.access(named, os.X_OK), f"DDEM_CLI: {named} is no program"
        return Path(named)
    built = sorted(REPOSITORY.glob("target/*/ddem"), key=lambda path: -path.stat().st_mtime)
    if not built:
        pytest.skip("the command line is not built (cargo build -p ddem-cli)")
    return built[0]


def run_command(deck: Path, out: Path, *options: str) -> None:
    """Runs a deck with the command line."""
    command = [command_line(), str(deck), "--out", str(out), "--quiet", *options]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr


def environment() -> dict[str, str]:
    """Environment in which another interpreter finds the same modules and the test modules."""
    path = os.pathsep.join([str(Path(__file__).parent), *sys.path])
    return {**os.environ, "PYTHONPATH": path}


def run_python(script: str, timeout: float = 15) -> str:
    """Output of another interpreter, which may hang or crash."""
    command = [sys.executable, "-c", script]
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=timeout, env=environment()
    )
    assert done.returncode == 0, done.stderr[-5000:]
    return done.stdout

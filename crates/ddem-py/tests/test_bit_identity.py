"""Steps, runs, decks and the command line give the same bits."""

from __future__ import annotations

import json
from pathlib import Path

import ddem
import h5py
import numpy as np
import pytest
from sample_models import (
    assert_same_results,
    breaking,
    column,
    run_command,
    same,
    same_state,
    staged,
)


def test_steps_in_chunks_give_same_bits() -> None:
    whole, single, numpys = (breaking().build() for _ in range(3))
    whole.step(600)
    for n in (1, 99, 100, 250, 0, 150):
        single.step(n)
    for _ in range(6):
        numpys.step(np.int32(100))
    assert whole.steps == single.steps == 600
    assert same_state(whole, single)
    assert same_state(whole, numpys)
    assert whole.pairs["state"].any(), "something has failed on the way"


def test_run_equals_its_steps() -> None:
    model = column()
    model.load(force=(1e5, 0, 0), z=2.0)
    step, damping = 1e-5, {"mass": 30.0}
    run, steps, chunks = (model.build() for _ in range(3))
    assert run.run(200 * step, time_step=step, damping=damping, quiet=True) == 200
    steps.start(time_step=step, damping=damping)
    steps.step(200)
    chunks.start(time_step=step, damping=damping)
    for _ in range(20):
        chunks.step(10)
    assert run.steps == steps.steps == 200
    assert same(run.displacement, steps.displacement)
    assert same(run.velocity, steps.velocity)
    # A run ends with velocities of the present time, plain steps with velocities half a step
    # earlier. The kinetic energies therefore agree to the order of the step.
    assert run.energy["kinetic"] == pytest.approx(steps.energy["kinetic"], rel=1e-4)
    rest = [{**energy, "kinetic": 0.0} for energy in (run.energy, steps.energy)]
    assert rest[0] == pytest.approx(rest[1], rel=1e-12, abs=1e-12)
    assert same_state(steps, chunks)


def test_any_number_of_threads_gives_same_bits() -> None:
    one, two = (breaking().build(threads=n) for n in (1, 2))
    for simulation in (one, two):
        simulation.relax(quiet=True)
        simulation.run(2e-3, quiet=True)
    assert same_state(one, two)


# --- decks and the command line ---


def test_deck_gives_same_bits_as_command_line(tmp_path: Path) -> None:
    deck = tmp_path / "staged.toml"
    staged().to_deck(deck)
    run_command(deck, tmp_path / "command")
    simulation = ddem.run_deck(deck, out=tmp_path / "python", quiet=True)
    assert_same_results(tmp_path / "command", tmp_path / "python")
    # The returned simulation and the checkpoint are at the end of the last stage.
    assert simulation.time == pytest.approx(2e-3)
    assert same_state(simulation, ddem.load(tmp_path / "command" / "checkpoint.h5"))
    with h5py.File(tmp_path / "python" / "blocks.vtkhdf") as file:
        last = np.asarray(file["VTKHDF/PointData/displacement"])[-54:]
    assert np.allclose(last, simulation.displacement, rtol=1e-5, atol=1e-12)
    summary = json.loads((tmp_path / "python" / "summary.json").read_text())
    assert summary["stages"] == simulation.summary["stages"]


def test_failing_joints_give_same_bits_as_command_line(tmp_path: Path) -> None:
    model = breaking()
    model.stage("pull", kind="dynamic", duration=3e-3, frames=4)
    model.to_deck(tmp_path / "pull.toml")
    run_command(tmp_path / "pull.toml", tmp_path / "command", "--threads", "1")
    simulation = ddem.run_deck(model, out=tmp_path / "python", threads=2, quiet=True)
    assert_same_results(tmp_path / "command", tmp_path / "python")
    assert simulation.pairs["state"].any()


@pytest.mark.parametrize("form", ["path", "dictionary", "model"])
def test_decks_in_any_form_give_same_bits(tmp_path: Path, form: str) -> None:
    model = staged()
    model.to_deck(tmp_path / "deck.toml")
    forms = {"path": tmp_path / "deck.toml", "dictionary": model.deck, "model": model}
    reference = model.build()
    reference.enter("settle")
    reference.relax(tolerance=1e-5, quiet=True)
    reference.enter("push")
    reference.run(2e-3, damping=0.02, quiet=True)
    simulation = ddem.run_deck(forms[form], out=tmp_path / "out", quiet=True)
    assert same_state(simulation, reference)


def test_calls_give_same_bits_as_command_line(tmp_path: Path) -> None:
    model = staged()
    model.to_deck(tmp_path / "staged.toml")
    run_command(tmp_path / "staged.toml", tmp_path / "command")
    simulation = model.build()
    out = tmp_path / "python"
    simulation.enter("settle")
    simulation.relax(tolerance=1e-5, record=out, name="settle", quiet=True)
    simulation.enter("push")
    simulation.run(2e-3, damping=0.02, frames=5, record=out, name="push", quiet=True)
    assert_same_results(tmp_path / "command", out)
    assert same_state(simulation, ddem.load(tmp_path / "command" / "checkpoint.h5"))

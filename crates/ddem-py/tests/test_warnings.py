"""Warnings of one model on the command line, in Python and in summary.json."""

from __future__ import annotations

import json
import math
import subprocess
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import ddem
import pytest
from sample_models import ROCK, command_line

#: Codes of the warnings of :func:`doubtful`, in their order.
CODES = [
    "load-at-rest",
    "far-probe",
    "loose-tolerance",
    "unreachable-tension",
    "factor-above-bracket",
]

SEARCH: dict[str, Any] = {"bracket": (0.2, 0.5), "tolerance": 1e-3}


def doubtful() -> ddem.Model:
    """A block on a plane, with faults that only give warnings."""
    model = ddem.Model(gravity=(9.81 * math.sin(math.pi / 6), 0, -9.81 * math.cos(math.pi / 6)))
    stiffness = {"normal_stiffness": 1e10, "shear_stiffness": 1e10}
    seam = ddem.Joint(**stiffness, friction=38, cohesion=1e3, tension=1e5, name="seam")
    model.add_blocks(
        size=(1, 1, 2), count=(1, 1, 2), divisions=1, material=ROCK, joint=seam, body="rigid"
    )
    model.fix("xyz", z=0.0)
    model.load(force=(1e3, 0, 0), z=2.0, history={"ramp": 0.1})
    model.probe("far", at=(50, 0, 0))
    model.stage("weight", kind="relax")
    model.stage("factor", kind="safety", **SEARCH)
    return model


def caught(call: Callable[[], Any]) -> tuple[Any, list[str]]:
    """The result of a call and its warnings."""
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        result = call()
    return result, [str(warning.message) for warning in found]


def texts(summary: dict[str, Any]) -> list[str]:
    """The warnings of a summary as lines."""
    lines = []
    for warning in summary["warnings"]:
        advice = "" if warning["help"] is None else f"; {warning['help']}"
        lines.append(f"{warning['place']}: {warning['message']}{advice} [{warning['code']}]")
    return lines


def codes(lines: list[str]) -> list[str]:
    return [line.rsplit("[", 1)[1].rstrip("]") for line in lines]


def written(folder: Path) -> dict[str, Any]:
    summary: dict[str, Any] = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    return summary


def printed(*arguments: object) -> list[str]:
    """The warnings that the command line prints."""
    command = [str(command_line()), *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, encoding="utf-8", timeout=60)
    assert done.returncode == 0, done.stderr
    lines = (done.stderr + done.stdout).splitlines()
    return [line.removeprefix("warning: ") for line in lines if line.startswith("warning: ")]


def test_all_channels_show_the_same_warnings(tmp_path: Path) -> None:
    deck, command, python = (tmp_path / name for name in ("deck.toml", "command", "python"))
    doubtful().to_deck(deck)
    shown = printed(deck, "--out", command)
    assert codes(shown) == CODES
    simulation, issued = caught(lambda: ddem.run_deck(deck, out=python, quiet=True))
    assert issued == shown
    assert texts(simulation.summary) == texts(written(python)) == texts(written(command)) == shown
    assert printed("info", command) == printed("info", python) == shown


def test_summary_has_the_warnings_of_every_call(tmp_path: Path) -> None:
    simulation, built = caught(lambda: doubtful().build())
    assert texts(simulation.summary) == built
    # The warnings of a relaxation without a name say so.
    _, moved = caught(lambda: simulation.relax(record=tmp_path, quiet=True))
    _, searched = caught(lambda: ddem.factor_of_safety(simulation, **SEARCH))
    assert codes(searched) == ["loose-tolerance", "factor-above-bracket"]
    issued = [*built, *moved, *searched]
    assert set(codes(issued)) == set(CODES)
    assert texts(simulation.summary) == issued
    assert texts(written(tmp_path)) == [*built, *moved]
    simulation.run(1e-4, record=tmp_path, quiet=True)
    assert texts(written(tmp_path)) == issued


def test_summary_has_each_warning_once(tmp_path: Path) -> None:
    simulation, first = caught(lambda: doubtful().build())
    for _ in range(2):
        simulation.relax(quiet=True)
        with pytest.warns(UserWarning):
            ddem.factor_of_safety(simulation, **SEARCH)
    once = texts(simulation.summary)
    assert len(once) == len(set(once)) > len(first)
    simulation.save(tmp_path / "state.h5")
    loaded, again = caught(lambda: ddem.load(tmp_path / "state.h5"))
    assert again == first
    assert texts(loaded.summary) == once


def test_summary_has_warnings_about_waiting_stages() -> None:
    model = doubtful()
    model.load(force=(2e3, 0, 0), z=2.0, from_="push")
    model.stage("push", kind="dynamic", duration=1e-3)
    simulation, built = caught(model.build)
    _, waiting = caught(lambda: simulation.run(1e-4, quiet=True))
    assert codes(waiting) == ["waiting-stages"]
    assert codes(texts(simulation.summary)) == codes([*built, *waiting])


def test_allowed_warnings_are_nowhere() -> None:
    model = doubtful()
    model.lint(allow=CODES)
    simulation, issued = caught(model.build)
    _, searched = caught(lambda: ddem.factor_of_safety(simulation, **SEARCH))
    assert issued == searched == simulation.summary["warnings"] == []

"""Long calls show their progress in a terminal, unless this is switched off."""

from __future__ import annotations

import io
import sys
import types
from collections.abc import Callable
from typing import Any

import pytest
from sample_models import ENDLESS, assert_still_works, column, long


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def shown(call: Callable[[], Any], monkeypatch: Any, terminal: bool = True) -> str:
    output = Terminal() if terminal else io.StringIO()
    monkeypatch.setattr(sys, "stderr", output)
    call()
    monkeypatch.undo()
    return output.getvalue()


@pytest.fixture
def at_once(monkeypatch: Any) -> None:
    import ddem._progress

    monkeypatch.setattr(ddem._progress, "DELAY", 0.0)


def test_progress_is_shown_in_a_terminal(monkeypatch: Any) -> None:
    pytest.importorskip("tqdm")
    import ddem._progress

    delay = ddem._progress.DELAY
    assert 0 < delay <= 1
    simulation = long()
    step = simulation.critical_step / 2
    for call, name in (
        (lambda: simulation.run(3000 * step, time_step=step, name="shaking"), "shaking"),
        (lambda: simulation.relax(tolerance=1e-20, max_steps=3000), "relax"),
        (lambda: simulation.step(3000), "step"),
    ):
        ddem._progress.DELAY = 0.0
        try:

            def stopped(call: Callable[[], Any] = call) -> None:
                try:
                    call()
                except ddem.NotConverged:
                    pass

            assert name in shown(stopped, monkeypatch)
        finally:
            ddem._progress.DELAY = delay


def test_no_progress_without_terminal_or_when_quiet(
    monkeypatch: Any, at_once: None, capfd: Any
) -> None:
    simulation = long()
    step = simulation.critical_step / 2
    assert shown(lambda: simulation.run(300 * step), monkeypatch, terminal=False) == ""
    import ddem._progress

    monkeypatch.setattr(ddem._progress, "DELAY", 0.0)
    assert shown(lambda: simulation.step(3000), monkeypatch) != ""
    assert shown(lambda: simulation.run(300 * step, quiet=True), monkeypatch) == ""
    assert shown(lambda: simulation.step(3000, quiet=True), monkeypatch) == ""
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("blocked", ["tqdm", "tqdm.auto"])
def test_calls_run_without_tqdm(monkeypatch: Any, blocked: str) -> None:
    monkeypatch.setitem(sys.modules, blocked, None)
    monkeypatch.setitem(sys.modules, "tqdm.auto", None)
    simulation = column().build()
    simulation.run(1e-3)
    simulation.relax()
    simulation.step(100)
    assert simulation.steps > 100


def test_failing_progress_bar_ends_only_the_call(monkeypatch: Any) -> None:
    class Broken:
        def __init__(self, **keys: Any) -> None:
            raise RuntimeError("no bar today")

    monkeypatch.setitem(sys.modules, "tqdm", types.ModuleType("tqdm"))
    auto = types.ModuleType("tqdm.auto")
    auto.tqdm = Broken  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "tqdm.auto", auto)
    simulation = long()
    with pytest.raises(RuntimeError, match="no bar today"):
        simulation.run(ENDLESS)
    assert_still_works(simulation)

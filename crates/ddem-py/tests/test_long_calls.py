"""Long calls: other threads go on, Ctrl-C stops them, processes are forked, progress is shown."""

from __future__ import annotations

import copy
import io
import multiprocessing
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
import types
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import ddem
import numpy as np
import pytest
from small import assert_same_results, breaking, column, cube, long, same_state

#: A duration of which no test sees the end [s].
ENDLESS = 1e3


@contextmanager
def interrupted(after: float = 0.15) -> Iterator[list[float]]:
    """Ctrl-C after a while; says when."""
    at: list[float] = []

    def interrupt() -> None:
        at.append(time.perf_counter())
        signal.raise_signal(signal.SIGINT)

    timer = threading.Timer(after, interrupt)
    timer.start()
    try:
        yield at
    finally:
        timer.cancel()
        timer.join()


def moves(simulation: ddem.Simulation) -> None:
    """What can still be done with a simulation is done."""
    before = simulation.steps
    assert np.isfinite(simulation.displacement).all()
    assert np.isfinite(simulation.energy["balance"])
    simulation.step(3)
    simulation.run(1e-5, quiet=True)
    assert simulation.steps > before + 3


@contextmanager
def elsewhere(call: Callable[[], Any]) -> Iterator[threading.Thread]:
    """A call in another thread, from when it has begun to when it has ended."""
    thread = threading.Thread(target=call)
    thread.start()
    yield thread
    thread.join(30)
    assert not thread.is_alive()


# --- other threads ---


@pytest.mark.parametrize("how", ["run", "step", "relax"])
def test_other_threads_go_on(how: str) -> None:
    simulation = long()
    calls = {
        "run": lambda: simulation.run(simulation.critical_step * 600, quiet=True),
        "step": lambda: simulation.step(600, quiet=True),
        "relax": lambda: simulation.relax(tolerance=1e-12, quiet=True),
    }
    counts: list[int] = []
    over = threading.Event()

    def count() -> None:
        number = 0
        while not over.is_set():
            number += 1
        counts.append(number)

    start = time.perf_counter()
    for _ in range(200_000):
        over.is_set()
    alone = 200_000 / (time.perf_counter() - start)
    with elsewhere(count):
        start = time.perf_counter()
        calls[how]()
        seconds = time.perf_counter() - start
        over.set()
    # The cores are shared with the run, but not the interpreter.
    assert counts[0] > 0.05 * alone * seconds
    assert seconds > 0.01, "too short to tell"


def uses(simulation: ddem.Simulation, folder: Path) -> dict[str, Callable[[], Any]]:
    """Every way to use a simulation."""
    zeros = np.zeros((simulation.n_nodes, 3))
    all_: dict[str, Callable[[], Any]] = {
        "relax": lambda: simulation.relax(quiet=True),
        "run": lambda: simulation.run(1.0, quiet=True),
        "step": lambda: simulation.step(),
        "start": lambda: simulation.start(),
        "enter": lambda: simulation.enter("a"),
        "apply_force": lambda: simulation.apply_force([0], (1, 0, 0)),
        "save": lambda: simulation.save(folder / "state.h5"),
        "field": lambda: simulation.field("velocity"),
        "nodes": lambda: simulation.nodes(z=0.0),
        "nearest_node": lambda: simulation.nearest_node((0, 0, 0)),
        "reaction": lambda: simulation.reaction([0]),
        "displacement =": lambda: setattr(simulation, "displacement", zeros),
        "velocity =": lambda: setattr(simulation, "velocity", zeros),
        "repr": lambda: repr(simulation),
    }
    for name in dir(ddem.Simulation):
        if not name.startswith("_") and not callable(getattr(ddem.Simulation, name)):
            all_[name] = lambda name=name: getattr(simulation, name)
    return all_


def test_a_simulation_is_used_by_one_thread_at_a_time(tmp_path: Path) -> None:
    model = column(divisions=8)
    model.stage("a", kind="relax")
    simulation = model.build(threads=1)
    calls = uses(simulation, tmp_path)
    public = {name for name in dir(ddem.Simulation) if not name.startswith("_")}
    assert public <= set(calls), "a method of which this test does not know"
    failed: dict[str, BaseException | None] = {}
    begun = threading.Event()

    def use() -> None:
        begun.wait()
        deadline = time.perf_counter() + 5
        while time.perf_counter() < deadline:
            try:
                simulation.steps
            except ddem.Busy:
                break
        for name, call in calls.items():
            try:
                call()
                failed[name] = None
            except BaseException as error:
                failed[name] = error
        signal.raise_signal(signal.SIGINT)

    with elsewhere(use):
        with pytest.raises(KeyboardInterrupt):
            begun.set()
            simulation.run(ENDLESS, quiet=True)
    wrong = {name: error for name, error in failed.items() if type(error) is not ddem.Busy}
    assert wrong == {}
    assert failed
    assert "busy" in str(failed["step"]) and isinstance(failed["step"], ddem.Error)
    assert list(tmp_path.iterdir()) == []
    moves(simulation)


def test_simulations_of_two_threads_do_not_wait_for_each_other() -> None:
    # In turn, on one thread each: neither may be held up until the other has ended.
    one, other = (column(divisions=6).build(threads=1) for _ in range(2))
    stop = threading.Event()

    def run() -> None:
        while not stop.is_set():
            other.step(2000, quiet=True)

    one.step(5)
    with elsewhere(run):
        time.sleep(0.05)
        start = time.perf_counter()
        one.step(5)
        waited = time.perf_counter() - start
        busy = other_is_busy(other)
        stop.set()
    assert busy, "the other one has ended: too short to tell"
    assert waited < 0.5


def other_is_busy(simulation: ddem.Simulation) -> bool:
    try:
        simulation.steps
    except ddem.Busy:
        return True
    return False


def test_many_threads_with_simulations_of_their_own() -> None:
    done: list[ddem.Simulation] = []

    def run() -> None:
        simulation = breaking().build(threads=2)
        simulation.run(1e-3, quiet=True)
        done.append(simulation)

    threads = [threading.Thread(target=run) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(30)
    assert len(done) == 8
    run()
    assert [same_state(simulation, done[-1]) for simulation in done] == [True] * 9


# --- Ctrl-C ---


@pytest.mark.parametrize("how", ["run", "step", "relax", "record"])
def test_ctrl_c_stops_at_once(how: str, tmp_path: Path) -> None:
    simulation = long()
    simulation.critical_step
    calls: dict[str, Callable[[], Any]] = {
        "run": lambda: simulation.run(ENDLESS, quiet=True),
        "step": lambda: simulation.step(10**12, quiet=True),
        "relax": lambda: simulation.relax(tolerance=1e-300, max_steps=10**12, quiet=True),
        "record": lambda: simulation.run(ENDLESS, record=tmp_path / "out", quiet=True),
    }
    with interrupted() as at, pytest.raises(KeyboardInterrupt):
        calls[how]()
    assert time.perf_counter() - at[0] < 0.2
    assert simulation.steps > 0
    moves(simulation)
    if how == "record":
        simulation.run(1e-4, record=tmp_path / "out", quiet=True)
        assert same_state(ddem.load(tmp_path / "out" / "checkpoint.h5"), simulation)


def test_a_handler_of_ones_own_is_asked() -> None:
    class Enough(Exception):
        pass

    def handler(number: int, frame: Any) -> None:
        raise Enough

    before = signal.signal(signal.SIGINT, handler)
    try:
        simulation = long()
        with interrupted(), pytest.raises(Enough):
            simulation.run(ENDLESS, quiet=True)
        moves(simulation)
        asked: list[int] = []
        signal.signal(signal.SIGINT, lambda number, frame: asked.append(number))
        with interrupted(0.05):
            simulation.step(1000, quiet=True)
        assert asked == [signal.SIGINT], "a handler that raises nothing stops nothing"
    finally:
        signal.signal(signal.SIGINT, before)


def test_steps_after_ctrl_c_are_those_without() -> None:
    simulation, reference = (column(divisions=6).build() for _ in range(2))
    simulation.start(damping=0.05)
    reference.start(damping=0.05)
    with interrupted(0.1), pytest.raises(KeyboardInterrupt):
        simulation.step(10**9, quiet=True)
    reference.step(simulation.steps)
    assert simulation.steps > 0
    assert same_state(simulation, reference)


def test_a_run_goes_on_after_ctrl_c() -> None:
    simulation = long()
    step = 0.5 * simulation.critical_step
    with interrupted(), pytest.raises(KeyboardInterrupt):
        simulation.run(ENDLESS, time_step=step, quiet=True)
    done = simulation.steps
    assert simulation.time == pytest.approx(done * step)
    assert simulation.run(20 * step, time_step=step, quiet=True) == 20
    assert simulation.steps == done + 20
    assert abs(simulation.energy["balance"]) < 1e-6 * simulation.energy["external_work"]


def endless(title: str) -> ddem.Model:
    """A deck that takes about a second."""
    model = breaking(divisions=3)
    model = ddem.Model.from_deck({**model.deck, "title": title})
    model.stage("settle", kind="relax")
    model.stage("pull", kind="dynamic", duration=1.6, fields_every=0.2, damping=0.01)
    return model


def test_a_deck_goes_on_after_ctrl_c(tmp_path: Path) -> None:
    model = endless("goes on")
    out, whole = tmp_path / "out", tmp_path / "whole"
    times = 0
    resume = False
    for _ in range(3):
        try:
            with interrupted(0.12) as at:
                ddem.run_deck(model, out=out, resume=resume, quiet=True)
            pytest.fail("ended before it was interrupted")
        except KeyboardInterrupt as error:
            assert time.perf_counter() - at[0] < 0.2
            assert "resume=True" in str(error)
            times += 1
        assert (out / "checkpoint.h5").is_file()
        resume = True
    simulation = ddem.run_deck(model, out=out, resume=True, quiet=True)
    reference = ddem.run_deck(model, out=whole, quiet=True)
    assert times == 3
    assert same_state(simulation, reference)
    assert_same_results(out, whole)
    for name in reference.probes:
        # From where it went on, or all of it: never something else.
        tail = simulation.probes[name]
        assert len(tail) > 0
        assert tail.tobytes() == reference.probes[name][-len(tail) :].tobytes()


def test_resume_needs_a_checkpoint(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="no checkpoint to resume"):
        ddem.run_deck(endless("none"), out=tmp_path / "out", resume=True, quiet=True)


def test_ctrl_c_of_a_terminal(tmp_path: Path) -> None:
    script = """
import sys
from small import long
simulation = long()
simulation.critical_step
print("go", flush=True)
try:
    simulation.run(1e3)
except KeyboardInterrupt:
    simulation.step(2)
    print("stopped", simulation.steps > 2, flush=True)
"""
    with subprocess.Popen(
        [sys.executable, "-c", script],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(Path(__file__).parent), *sys.path])},
    ) as process:
        try:
            assert process.stdout is not None and process.stdout.readline() == "go\n"
            time.sleep(0.1)
            process.send_signal(signal.SIGINT)
            start = time.perf_counter()
            assert process.stdout.readline() == "stopped True\n"
            assert time.perf_counter() - start < 0.5
            assert process.wait(10) == 0
        finally:
            process.kill()


# --- processes ---


def simulated(threads: int | None) -> bytes:
    """What another process finds."""
    simulation = breaking().build(threads=threads)
    simulation.run(5e-4, quiet=True)
    return simulation.displacement.tobytes()


def run_in_child(queue: Any, simulation: ddem.Simulation | None) -> None:
    if simulation is not None:
        simulation.step(5)
    queue.put((simulated(None), simulated(2)))


@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_a_forked_process_runs_too() -> None:
    found = simulated(None), simulated(2)
    simulation = breaking().build()
    simulation.step(5)
    context = multiprocessing.get_context("fork")
    queue = context.Queue()
    children = [
        context.Process(target=run_in_child, args=(queue, one)) for one in (None, simulation)
    ]
    try:
        for child in children:
            child.start()
        for _ in children:
            assert queue.get(timeout=20) == found
        for child in children:
            child.join(10)
            assert child.exitcode == 0
    finally:
        for child in children:
            child.kill()
    # The parent is none the worse.
    simulation.step(5)
    assert simulated(None) == found[0]


@pytest.mark.parametrize("method", ["fork", "spawn"])
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_a_pool_of_processes(method: str) -> None:
    expected = simulated(1)
    context = multiprocessing.get_context(method)
    with ProcessPoolExecutor(2, mp_context=context) as pool:
        assert list(pool.map(simulated, [1, 2, None], timeout=40)) == [expected] * 3


def diverge(n: int) -> None:
    raise ddem.Diverged("gone", n, 0.5, 3, 4)


def test_exceptions_come_from_other_processes() -> None:
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        with pytest.raises(ddem.Diverged) as caught:
            pool.submit(diverge, 7).result(30)
        assert caught.value.step == 7
        with pytest.raises(ddem.ModelError, match="^threads: "):
            pool.submit(simulated, 0).result(30)


@pytest.mark.parametrize(
    "error",
    [
        ddem.Error("a"),
        ddem.Busy("a"),
        ddem.NotConverged("a", 0.5),
        ddem.Collapsed("a", 0.5, (1, 2), 3.0),
        ddem.Diverged("a", 1, 2.0, 3, 4),
        ddem.ModelError("a", [("density", "is wrong", None)]),
        ddem.ModelError("a"),
    ],
)
@pytest.mark.parametrize(
    "copied", [copy.copy, copy.deepcopy, lambda a: pickle.loads(pickle.dumps(a))]
)
def test_exceptions_are_copied(error: ddem.Error, copied: Any) -> None:
    again = copied(error)
    assert type(again) is type(error)
    assert str(again) == str(error) == "a"
    assert again.__dict__ == error.__dict__
    assert again.args == error.args


# --- progress ---


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
        (lambda: simulation.relax(tolerance=1e-15, max_steps=3000), "relax"),
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


def test_nothing_is_shown_without_a_terminal_or_when_quiet(
    monkeypatch: Any, at_once: None, capfd: Any
) -> None:
    simulation = long()
    step = simulation.critical_step / 2
    assert shown(lambda: simulation.run(300 * step), monkeypatch, terminal=False) == ""
    import ddem._progress

    monkeypatch.setattr(ddem._progress, "DELAY", 0.0)
    assert shown(lambda: simulation.run(300 * step, quiet=True), monkeypatch) == ""
    assert shown(lambda: simulation.step(300, quiet=True), monkeypatch) == ""
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("blocked", ["tqdm", "tqdm.auto"])
def test_progress_needs_no_tqdm(monkeypatch: Any, blocked: str) -> None:
    monkeypatch.setitem(sys.modules, blocked, None)
    monkeypatch.setitem(sys.modules, "tqdm.auto", None)
    simulation = cube().build()
    simulation.run(1e-2)
    simulation.relax()
    simulation.step(100)
    assert simulation.steps > 100


def test_a_broken_bar_ends_the_call_and_no_more(monkeypatch: Any) -> None:
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
    moves(simulation)

"""What is said about mistakes, and which exception says it."""

from __future__ import annotations

import errno
import inspect
import pickle
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import ddem
import numpy as np
import pytest
from small import ROCK, SEAM, breaking, column, cube

HERE = Path(__file__).name


def refused(call: Callable[[], Any], kind: type[BaseException] = ValueError) -> str:
    """The message of a call that is refused."""
    with pytest.raises(kind) as caught:
        call()
    # The name of an argument of the wrong type is in a note, which tracebacks show.
    return "\n".join([str(caught.value), *getattr(caught.value, "__notes__", [])])


def line() -> int:
    """Line of the caller."""
    frame = inspect.currentframe()
    assert frame is not None and frame.f_back is not None
    return frame.f_back.f_lineno


def test_the_tree_of_exceptions() -> None:
    for kind in (ddem.Busy, ddem.Diverged, ddem.ModelError, ddem.NotConverged, ddem.Collapsed):
        assert issubclass(kind, ddem.Error)
    assert issubclass(ddem.Error, Exception)
    assert issubclass(ddem.ModelError, ValueError)
    assert issubclass(ddem.Collapsed, ddem.NotConverged)
    assert not issubclass(ddem.Diverged, ValueError)


# --- arrays ---

WRONG: dict[str, tuple[Any, str]] = {
    "shape": (np.zeros((3, 3)), r"has shape \(3, 3\), expected \(27, 3\)"),
    "one row": (np.zeros(3), r"has shape \(3,\), expected \(27, 3\)"),
    "turned": (np.zeros((3, 27)), r"has shape \(3, 27\)"),
    "empty": ([], r"has shape \(0,\)"),
    "number": (1.0, r"has shape \(\)"),
    "complex": (np.zeros((27, 3), complex), "has dtype complex128"),
    "text": (np.full((27, 3), "1"), "has dtype <U1"),
    "objects": (np.full((27, 3), None), "has dtype object"),
    "dates": (np.zeros((27, 3), "M8[s]"), r"has dtype datetime64\[s\]"),
    "structured": (np.zeros((27, 3), "f8,i4"), "has dtype"),
    "NaN": (np.full((27, 3), np.nan), "is NaN in row 0"),
    "infinite": (np.where(np.arange(81).reshape(27, 3) == 50, np.inf, 0), "is inf in row 16"),
    "too large": (np.full((27, 3), np.longdouble("1e4000")), "is inf in row 0"),
    "ragged": ([[1, 2, 3], [1, 2]], "is no array of numbers"),
    "None": (None, "has dtype object"),
    "dictionary": ({}, "has dtype object"),
}


@pytest.mark.parametrize("name", ["displacement", "velocity"])
@pytest.mark.parametrize("wrong", WRONG)
def test_states(name: str, wrong: str) -> None:
    simulation = cube().build()
    simulation.velocity = np.ones((27, 3))
    before = simulation.displacement, simulation.velocity
    value, message = WRONG[wrong]
    with pytest.raises(ValueError, match=f"^{name}: {message}"):
        setattr(simulation, name, value)
    assert (simulation.displacement == before[0]).all()
    assert (simulation.velocity == before[1]).all(), "nothing was set"


NODES: dict[str, tuple[Any, str]] = {
    "too large": ([0, 27], "there is no node 27: they go from 0 to 26"),
    "negative": (-1, "there is no node -1"),
    "huge": (2**62, "there is no node 4611686018427387904"),
    "larger still": (np.array([2**64 - 1], "u8"), "there is no node"),
    "too many digits": (10**30, ""),
    "fractions": ([0.0, 1.0], "must be whole numbers"),
    "mask": (np.zeros(5, bool), r"is a mask of shape \(5,\), expected \(27,\)"),
    "flat mask": (np.zeros((27, 1), bool), r"is a mask of shape \(27, 1\)"),
    "rows": ([[0, 1]], r"has shape \(1, 2\), expected one dimension"),
    "complex": ([1j], "has dtype complex128"),
    "text": ("top", "has dtype <U3"),
    "None": (None, "has dtype object"),
    "NaN": ([np.nan], "must be whole numbers"),
}


@pytest.mark.parametrize("wrong", NODES)
def test_numbers_of_nodes(wrong: str) -> None:
    simulation = cube().build()
    nodes, message = NODES[wrong]
    for call in (
        lambda: simulation.apply_force(nodes, (1, 0, 0)),
        lambda: simulation.reaction(nodes),
        lambda: simulation.field("velocity", nodes=nodes),
    )[: 2 if nodes is None else 3]:
        with pytest.raises(ValueError, match=f"^nodes: {message}"):
            call()
    assert not simulation.force.any()


@pytest.mark.parametrize(
    ("nodes", "force", "message"),
    [
        ([0], (1, 2), r"has shape \(2,\), expected \(3,\) or \(1, 3\)"),
        ([0, 1], np.zeros((3, 3)), r"has shape \(3, 3\), expected \(3,\) or \(2, 3\)"),
        ([0, 1], [[1, 2, 3]], r"has shape \(1, 3\)"),
        ([0], (0, np.nan, 0), "is NaN in row 0"),
        ([0], (0, 0, -np.inf), "is -inf in row 0"),
        ([0], 5, r"has shape \(\)"),
        ([0], "abc", "has dtype <U3"),
        ([0], (1j, 0, 0), "has dtype complex128"),
    ],
)
def test_forces(nodes: Any, force: Any, message: str) -> None:
    simulation = cube().build()
    with pytest.raises(ValueError, match=f"^force: {message}"):
        simulation.apply_force(nodes, force)
    assert not simulation.force.any()


def test_positions() -> None:
    simulation = cube().build()
    with pytest.raises(ValueError, match=r"^at: has shape \(2,\), expected \(3,\)"):
        simulation.nearest_node((1, 2))
    with pytest.raises(ValueError, match="^at: is NaN"):
        simulation.nearest_node((1, 2, np.nan))


def test_out_arrays() -> None:
    simulation = cube().build()

    def refusal(out: Any, name: str = "velocity") -> str:
        return refused(lambda: simulation.field(name, out=out))

    assert refusal([0.0]) == "out: must be a NumPy array"
    assert refusal(np.zeros((3, 3))) == "out: has shape (3, 3), expected (27, 3)"
    assert refusal(np.zeros((27, 3), "f4")).startswith("out: has dtype float32, expected float64")
    assert refusal(np.zeros((27, 3), ">f8")).startswith("out: has dtype >f8, expected float64")
    frozen = np.zeros((27, 3))
    frozen.setflags(write=False)
    assert refusal(frozen).startswith("out: ") and "write" in refusal(frozen)
    assert refusal(np.broadcast_to(np.zeros(3), (27, 3))).startswith("out: ")
    assert refusal(np.zeros((8, 6)), "velocity").startswith("out: has shape (8, 6)")


def test_fields() -> None:
    simulation = cube().build()
    message = refused(lambda: simulation.field("displacment"))
    assert message.startswith("name: there is no `displacment` (did you mean `displacement`?")
    message = refused(lambda: simulation.field("stress", nodes=[0]))
    assert message == "nodes: `stress` is not a field at nodes"


@pytest.mark.parametrize("n", [-1, 1.5, "a", None, [1], 2**70, np.nan, np.float64(3)])
def test_numbers_of_steps(n: Any) -> None:
    simulation = cube().build()
    if n is None:
        simulation.step(n)
        assert simulation.steps == 1
        return
    assert refused(lambda: simulation.step(n)).startswith("n: must be a whole number")
    assert simulation.steps == 0


# --- models ---


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda m: m.fix("xyz", hist=3), "hist: unknown key `hist` (did you mean `history`?"),
        (lambda m: m.fix(5), "axes: expected text"),
        (
            lambda m: m.stage("a", kind="dyn"),
            'kind: expected `"relax"` or `"dynamic"`, found "dyn"',
        ),
        (lambda m: m.load(force=(1, 2)), "force: expected 3 numbers, found 2"),
        (lambda m: m.load(force=(1, 2, np.nan)), "force[2]: NaN where a finite number must be"),
        (lambda m: m.load(pressure=np.inf), "pressure: inf where a finite number must be"),
        (lambda m: m.load(force=(1, 2, 3), x="a"), "x: expected a number (a plane) or two numbers"),
        (lambda m: m.load(force=(1, 2, 3), x=(1, 2, 3)), "x: expected a number (a plane) or two"),
        (lambda m: m.load(force=(1, 2, 3), history={"ram": 1}), "history.ram: unknown key `ram`"),
        (lambda m: m.fix("x", from_=3), "from_: expected text"),
        (lambda m: m.fix("x", sphere={"centre": (0, 0, 0)}), "sphere.radius: key `radius`"),
        (lambda m: m.add_blocks(material=ROCK, count=(1, 1, -1)), "count[2]: expected a whole"),
        (lambda m: m.add_blocks(material=ROCK, divisions=2.5), "divisions: expected a whole"),
        (lambda m: m.add_blocks(material=ROCK, edges={"q": [0, 1]}), "edges.q: unknown key `q`"),
        (lambda m: m.add_blocks(material=10**30), "material: "),
        (lambda m: m.probe("p", quantity="strain", at=(0, 0, 0)), "quantity: expected"),
        (lambda m: m.initial(velocity=object()), "velocity: expected a number, text, a list"),
        (lambda m: m.boundary("free"), 'kind: expected `"viscous"`'),
        (lambda m: m.refine(factor=0.5, z=0.0), "factor: expected a whole"),
        (lambda m: ddem.Model(gravty=1), "gravty: unknown key `gravty` (did you mean `gravity`?"),
        (lambda m: ddem.Model(gravity=(1, 2)), "gravity: expected 3 numbers, found 2"),
        (lambda m: ddem.Model(kinematics="big"), "kinematics: expected"),
        (lambda m: ddem.Material(density=1, young=1), "poisson: key `poisson` is missing"),
        (lambda m: ddem.Material(density="a", young=1, poisson=0), "density: expected a number"),
        (lambda m: ddem.Joint(thicknes=1), "thicknes: unknown key `thicknes` (did you mean"),
        (lambda m: ddem.Joint(thickness=1, material=SEAM), "material: a joint is no material"),
        (lambda m: ddem.Joint(fracture_energy=1), "fracture_energy: expected a list of 2 numbers"),
    ],
)
def test_a_call_says_what_is_wrong_at_once(call: Any, message: str) -> None:
    model = column()
    before = model.deck
    with pytest.raises(ddem.ModelError) as caught:
        call(model)
    assert str(caught.value).startswith(message)
    ((place, text, _),) = caught.value.faults
    assert f"{place}: {text}" in str(caught.value)
    assert model.deck == before


@pytest.mark.parametrize(
    "call",
    [
        lambda m: m.fix("xyz", q=3),
        lambda m: m.load(q=3),
        lambda m: m.probe("a", q=3),
        lambda m: m.build().nodes(q=3),
    ],
)
def test_the_keys_that_are_named_are_those_of_python(call: Any) -> None:
    message = refused(lambda: call(column()), ddem.ModelError)
    assert message.startswith("q: unknown key `q`")
    for key in ("`x`", "`y`", "`z`", "`sphere`", "`set`"):
        assert key in message
    assert "`where`" not in message and "`from`" not in message


def test_the_keys_of_run_are_its_own() -> None:
    simulation = cube().build()
    for call in (lambda: simulation.run(1e-3, foo=1), lambda: simulation.start(foo=1)):
        message = refused(call, ddem.ModelError)
        assert message.startswith("foo: ")
        assert "`damping`" in message and "`time_step`" in message
        assert "`kind`" not in message
    message = refused(lambda: simulation.relax(foo=1), ddem.ModelError)
    assert "`tolerance`" in message and "`kind`" not in message


def test_a_part_must_be_named() -> None:
    message = refused(column().remove, ddem.ModelError)
    assert "`x`" in message and "`where`" not in message


def test_build_says_where_the_script_is_wrong() -> None:
    model = column()
    model.fix("q", z=0.0); fixed = line()  # fmt: skip # noqa: E702
    model.load(force=(1, 0, 0), x=77.0)
    model.add_blocks(
        size=(1, 1, 1),
        origin=(9, 9, 9),
        material="chalk",
    )
    with pytest.raises(ddem.ModelError) as caught:
        model.build()
    lines = str(caught.value).splitlines()
    places = [place for place, _, _ in caught.value.faults]
    assert any(text.startswith(f"{HERE}:{fixed}: fix[1].axes: ") for text in lines)
    assert any(
        re.match(rf"{HERE}:\d+: blocks\[1\].material: there is no material named `chalk`", text)
        for text in lines
    )
    assert places and len(places) == len(lines)
    model = column()
    model.load(force=(1, 0, 0), x=77.0); loaded = line()  # fmt: skip # noqa: E702
    message = refused(model.build, ddem.ModelError)
    assert message.startswith(f"{HERE}:{loaded}: load[0]")
    assert "selects nothing" in message


def test_all_mistakes_at_once() -> None:
    model = ddem.Model()
    chalk = ddem.Material(density=-1, young=0, poisson=0.5)
    model.add_blocks(size=(1, 1, 0), count=(2, 1, 1), material=chalk)
    with pytest.raises(ddem.ModelError) as caught:
        model.build()
    places = {place for place, _, _ in caught.value.faults}
    assert {
        "materials.material-1.density",
        "materials.material-1.young",
        "materials.material-1.poisson",
    } <= places
    assert len(caught.value.faults) >= 5


@pytest.mark.parametrize("form", ["model", "dictionary"])
def test_a_model_is_no_file(form: str, tmp_path: Path) -> None:
    model = column()
    model.stage("a", kind="relax")
    model.load(force=(1, 0, 0), x=77.0); loaded = line()  # fmt: skip # noqa: E702
    given = model if form == "model" else model.deck
    message = refused(
        lambda: ddem.run_deck(given, out=tmp_path / "out", quiet=True), ddem.ModelError
    )
    assert "model.toml" not in message
    assert "load[0]" in message and "selects nothing" in message
    if form == "model":
        assert message.startswith(f"{HERE}:{loaded}: ")
    assert list(tmp_path.iterdir()) == []


def test_nothing_to_run(tmp_path: Path) -> None:
    message = refused(lambda: ddem.run_deck(column(), out=tmp_path / "out"), ddem.ModelError)
    assert "no stage" in message
    assert list(tmp_path.iterdir()) == []


def test_a_file_is_shown_where_it_is_wrong(tmp_path: Path) -> None:
    text = column().to_deck().replace("young", "yuong")
    path = tmp_path / "deck.toml"
    path.write_text(text)
    for call in (lambda: ddem.Model.from_deck(path), lambda: ddem.run_deck(path)):
        message = refused(call, ddem.ModelError)
        number = 1 + text.splitlines().index(next(t for t in text.splitlines() if "yuong" in t))
        assert f"deck.toml:{number}:" in message
        assert "did you mean `young`?" in message
        assert "\x1b" not in message


@pytest.mark.parametrize("threads", [0, -1, 10**9, 2**70, 1.5, "two"])
def test_threads(threads: Any, tmp_path: Path) -> None:
    model = column()
    simulation = model.build()
    simulation.save(tmp_path / "state.h5")
    model.stage("a", kind="relax")
    for call in (
        lambda: model.build(threads=threads),
        lambda: ddem.load(tmp_path / "state.h5", threads=threads),
        lambda: ddem.run_deck(model, out=tmp_path / "out", threads=threads, quiet=True),
    ):
        assert "threads" in refused(call, (ValueError, TypeError))  # type: ignore[arg-type]
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("call", "name"),
    [
        (lambda: ddem.Model(title=5), "title"),
        (lambda: ddem.Material(density=1, young=1, poisson=0, name=5), "name"),
        (lambda: ddem.Joint(thickness=1, name=5), "name"),
        (lambda: cube().build().enter(5), "stage"),
        (lambda: cube().build().field(5), "name"),
        (lambda: cube().build().run(1e-3, name=5), "name"),
        (lambda: cube().build().save(5), "path"),
        (lambda: cube().build().run(1e-3, record=5), "record"),
        (lambda: ddem.load(5), "path"),
        (lambda: cube().to_deck(5), "path"),
        (lambda: ddem.run_deck(5), "deck"),
        (lambda: ddem.Model.from_deck(5), "deck"),
        (lambda: ddem.load("a", model=5), "model"),
        (lambda: cube().build().run(1e-3, quiet="no"), "quiet"),
    ],
)
def test_wrong_types_name_the_argument(call: Any, name: str) -> None:
    assert name in refused(call, (ValueError, TypeError))  # type: ignore[arg-type]


def test_what_is_not_there() -> None:
    with pytest.raises(TypeError):
        ddem.Simulation()
    simulation = cube().build()
    with pytest.raises(AttributeError, match="time"):
        simulation.time = 3.0
    with pytest.raises(AttributeError, match="foo"):
        simulation.foo = 3.0
    with pytest.raises(AttributeError):
        del simulation.velocity
    with pytest.raises(TypeError):
        type("Mine", (ddem.Simulation,), {})
    with pytest.raises(TypeError, match="pickle"):
        pickle.dumps(simulation)


# --- stages ---


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda s: s.run(-1), "duration: `duration` is -1 but must be above 0"),
        (lambda s: s.run(0), "duration: `duration` is 0 but must be above 0"),
        (lambda s: s.run(np.nan), "duration: NaN where a finite number must be"),
        (lambda s: s.run("long"), "duration: expected a number"),
        (lambda s: s.run(1e300), "duration: takes "),
        (lambda s: s.run(1e-320), "duration: "),
        (lambda s: s.run(1e-3, time_step=1e-320), "time_step: "),
        (lambda s: s.run(1e-3, damping=-1), "damping.ratio: `ratio` is -1 but must be 0 or more"),
        (lambda s: s.run(1e-3, damping={"local": 1}), "damping.local: `local` is 1"),
        (lambda s: s.run(1e-3, damping={"masss": 1}), "damping.masss: unknown key"),
        (lambda s: s.run(1e-3, damping="much"), "damping: expected"),
        (lambda s: s.run(1e-3, frames=0), "frames: `frames` is 0 but must be 1 or more"),
        (lambda s: s.run(1e-3, fields_every=-1), "fields_every: "),
        (lambda s: s.run(1e-3, kind="relax"), "kind: "),
        (lambda s: s.run(1e-3, tolerance=1e-3), "tolerance: "),
        (lambda s: s.run(1e-3, x=1.0), "x: unknown key `x`"),
        (lambda s: s.run(1e-3, time_step=1), "time_step: "),
        (lambda s: s.start(time_step=1), "time_step: "),
        (lambda s: s.start(time_step=-1), "time_step: "),
        (lambda s: s.start(damping=-1), "damping.ratio: `ratio` is -1"),
        (lambda s: s.relax(tolerance=2), "tolerance: `tolerance` is 2 but must be"),
        (lambda s: s.relax(increments=0), "increments: `increments` is 0"),
        (lambda s: s.relax(max_steps=-1), "max_steps: expected a whole number"),
        (lambda s: s.relax(duration=1.0), "duration: "),
        (lambda s: s.enter("psh"), "stage: there is no `psh` (did you mean `push`?"),
        (lambda s: s.nodes(set="al"), "set: "),
        (lambda s: s.nodes(x=(3, 1)), "x: "),
        (lambda s: s.nodes(sphere={"centre": (0, 0, 0), "radius": -1}), "sphere.radius: "),
        (lambda s: s.nodes(x=np.inf), "x: inf where a finite number must be"),
        (lambda s: s.nodes(from_="push"), "from_: "),
    ],
)
def test_arguments_of_stages(call: Any, message: str) -> None:
    model = column()
    model.stage("push", kind="dynamic", duration=1.0)
    simulation = model.build()
    with pytest.raises(ddem.ModelError) as caught:
        call(simulation)
    assert str(caught.value).startswith(message)
    assert simulation.steps == 0 and not simulation.displacement.any()
    assert simulation.summary["stages"] == []
    simulation.step(2)
    assert np.isfinite(simulation.velocity).all()


def test_a_time_step_above_the_critical_one() -> None:
    simulation = column().build()
    critical = simulation.critical_step
    for call in (
        lambda step: simulation.run(1e-3, time_step=step, quiet=True),
        lambda step: simulation.start(time_step=step),
    ):
        message = refused(lambda call=call: call(1.001 * critical), ddem.ModelError)
        assert message.startswith("time_step: ")
        assert "critical" in message and f"{critical:.4e}".split("e")[0][:5] in message
        call(0.999 * critical)


def test_relaxations_that_do_not_converge() -> None:
    simulation = column().build()
    with pytest.raises(ddem.NotConverged) as caught:
        simulation.relax(max_steps=7, quiet=True)
    error = caught.value
    assert isinstance(error.ratio, float) and 1e-6 < error.ratio < 10
    assert error.ratio == simulation.unbalanced
    assert str(error).startswith("not in equilibrium after 7 steps")
    assert simulation.steps >= 7
    assert simulation.relax(quiet=True) > 0, "it may go on"


def test_blocks_that_part_without_end() -> None:
    model = breaking()
    model.load(traction=(0, 0, 5e5), z=2.0)
    simulation = model.build()
    with pytest.raises(ddem.NotConverged) as caught:
        simulation.relax(quiet=True)
    error = caught.value
    assert isinstance(error, ddem.Collapsed)
    assert tuple(sorted(error.blocks)) == (0, 1)
    assert error.distance > 0 and error.ratio > 0
    assert np.isfinite(simulation.displacement).all()


@pytest.mark.parametrize("how", ["run", "step", "deck"])
def test_runs_that_diverge(how: str, tmp_path: Path) -> None:
    model = column()
    if how == "deck":
        model.initial(velocity=(1e300, 0, 0), z=(1.5, 2.0))
        model.stage("fly", kind="dynamic", duration=1e-2)
    simulation = model.build()
    velocity = np.zeros((54, 3))
    velocity[40] = [1e300, -1e300, 1e300]
    simulation.velocity = velocity
    calls: dict[str, Callable[[], Any]] = {
        "run": lambda: simulation.run(1e-2, quiet=True),
        "step": lambda: simulation.step(1000),
        "deck": lambda: ddem.run_deck(model, out=tmp_path / "out", quiet=True),
    }
    with pytest.raises(ddem.Diverged) as caught:
        calls[how]()
    error = caught.value
    assert simulation.node_block[error.node] == error.block
    assert error.block == 1 or how == "deck", "the block that was thrown"
    assert 0 < error.step < 1000 and 0 <= error.time < 1e-2
    assert f"diverged at step {error.step}" in str(error)
    assert f"node {error.node} of block {error.block}" in str(error)
    if how == "deck":
        assert str(error).startswith("stage `fly`: ")
        assert (tmp_path / "out" / "blocks.vtkhdf").is_file()
        return
    assert simulation.steps == error.step
    # The state that may be set may be mended.
    simulation.displacement = np.zeros((54, 3))
    simulation.velocity = np.zeros((54, 3))
    simulation.step(3)
    assert np.isfinite(simulation.displacement).all()


# --- files ---


def test_files_that_are_not_there(tmp_path: Path) -> None:
    nothing = tmp_path / "nothing"
    for call in (
        lambda: ddem.load(nothing),
        lambda: ddem.run_deck(nothing),
        lambda: ddem.Model.from_deck(nothing),
        lambda: column().to_deck(nothing / "deck.toml"),
        lambda: column().build().save(nothing / "state.h5"),
    ):
        with pytest.raises(FileNotFoundError) as caught:
            call()
        assert caught.value.errno == errno.ENOENT
        assert str(nothing) in str(caught.value)
    assert list(tmp_path.iterdir()) == []


def test_folders_that_are_no_files(tmp_path: Path) -> None:
    for call in (
        lambda: ddem.load(tmp_path),
        lambda: ddem.run_deck(tmp_path),
        lambda: ddem.Model.from_deck(tmp_path),
        lambda: column().to_deck(tmp_path),
        lambda: column().build().save(tmp_path),
    ):
        with pytest.raises(IsADirectoryError) as caught:
            call()
        assert "0x" not in str(caught.value)
    assert list(tmp_path.iterdir()) == []


def test_files_that_are_no_folders(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("mine")
    model = column()
    model.stage("a", kind="relax")
    simulation = column().build()
    for out in (file, file / "below"):
        for call in (
            lambda out=out: ddem.run_deck(model, out=out, quiet=True),
            lambda out=out: simulation.run(1e-4, record=out, quiet=True),
            lambda out=out: simulation.relax(record=out, quiet=True),
        ):
            with pytest.raises(OSError, match="file"):
                call()
    assert file.read_text() == "mine"
    assert simulation.steps == 0
    with pytest.raises(OSError):
        simulation.save(file / "state.h5")


def test_files_that_are_something_else(tmp_path: Path) -> None:
    for name, content in (("text", b"hello"), ("empty", b""), ("hdf", b"\x89HDF\r\n\x1a\n")):
        path = tmp_path / name
        path.write_bytes(content)
        with pytest.raises(OSError, match=f"{name}.*HDF5 file"):
            ddem.load(path)
    path = tmp_path / "bytes"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises((OSError, ddem.ModelError), match="UTF-8|utf-8"):
        ddem.Model.from_deck(path)


def test_files_of_others_stay(tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / "probes.csv").write_text("mine")
    simulation = column().build()
    with pytest.raises(
        FileExistsError, match=r"probes\.csv.*not known to be a result of ddem"
    ) as c:
        simulation.run(1e-4, record=out, quiet=True)
    assert "--out" not in str(c.value)
    assert [path.name for path in out.iterdir()] == ["probes.csv"]
    assert simulation.steps == 0


def test_a_name_with_a_null(tmp_path: Path) -> None:
    for call in (
        lambda: ddem.load("a\0b"),
        lambda: ddem.Model.from_deck("a\0b"),
        lambda: column().to_deck("a\0b"),
        lambda: column().build().save("a\0b"),
        lambda: column().build().run(1e-4, record="a\0b", quiet=True),
    ):
        with pytest.raises((OSError, ValueError), match="(?i)null|nul"):
            call()


# --- memory ---


@pytest.mark.parametrize("divisions", [1300, 4_000_000, 2**32 - 1, 2**32, 2**63 - 1])
def test_models_that_are_too_large(divisions: int) -> None:
    model = ddem.Model()
    with pytest.raises((MemoryError, ddem.ModelError)) as caught:
        model.add_blocks(size=(1, 1, 1), divisions=divisions, material=ROCK)
        model.build()
    assert str(caught.value)
    if divisions == 1300:
        assert isinstance(caught.value, MemoryError)


def test_warnings_are_those_of_python() -> None:
    weak = ddem.Joint(thickness=0.01, material=ROCK, cohesion=1e4, friction=20)
    with pytest.warns(UserWarning, match="joint `joint-1` can fail"):
        column(weak).build()
    with pytest.warns(UserWarning) as found:
        column(weak).build()
    assert all(Path(one.filename).name == HERE for one in found), "of the line that built it"

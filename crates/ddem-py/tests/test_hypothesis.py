"""Nothing that Python can pass in panics, crashes or hangs.

`DDEM_EXAMPLES=2000 pytest test_hypothesis.py` looks further, each time elsewhere.
"""

from __future__ import annotations

import array
import datetime
import decimal
import fractions
import math
import os
import subprocess
import sys
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import ddem
import h5py
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from small import ROCK, SEAM, breaking, column

EXAMPLES = int(os.environ.get("DDEM_EXAMPLES", "0"))
some = settings(
    max_examples=EXAMPLES or 80,
    derandomize=not EXAMPLES,
    database=None,
    deadline=None,
    suppress_health_check=list(HealthCheck),
)

#: What may come out of a call.
ALLOWED = (ddem.Error, ValueError, TypeError, OSError, MemoryError, OverflowError, AttributeError)


class Nasty(ValueError):
    """What nasty objects raise."""


def attempt(call: Callable[[], Any]) -> Any:
    """What a call gives, if it is no more than refused."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return call()
        except ALLOWED as error:
            assert "a fault in ddem itself" not in str(error), str(error)
            assert str(error) != "" or isinstance(error, (Nasty, MemoryError))
            return None
        # Anything else fails the test, PanicException included, which is no Exception.


# --- nasty values ---


class Raises:
    """An object that raises whatever is asked of it."""

    def _raise(self, *_: Any, **__: Any) -> Any:
        raise Nasty("nasty")

    __float__ = __int__ = __index__ = __len__ = __iter__ = __getitem__ = __bool__ = _raise
    __array__ = __fspath__ = __str__ = __repr__ = __call__ = tolist = keys = items = _raise


class Silent:
    """An object that raises when anything of it is looked at."""

    def __getattr__(self, name: str) -> Any:
        raise Nasty(name)


class Row(Sequence[Any]):
    """A sequence that says what it is not."""

    def __init__(self, said: int, *, ends: bool = True) -> None:
        self.said, self.ends = said, ends

    def __len__(self) -> int:
        return self.said

    def __getitem__(self, index: Any) -> Any:
        if self.ends and index >= 3:
            raise IndexError
        if index > 100_000:
            raise Nasty("far enough")
        return 1.0


class Table(Mapping[Any, Any]):
    """A mapping with items that are none."""

    def __init__(self, entries: Any) -> None:
        self.entries = entries

    def __getitem__(self, key: Any) -> Any:
        return 1.0

    def __iter__(self) -> Iterator[Any]:
        raise Nasty("no keys")

    def __len__(self) -> int:
        return 1

    def items(self) -> Any:
        return self.entries


class Itself:
    """Its list is itself."""

    def tolist(self) -> Any:
        return self


class Float(float):
    def __float__(self) -> float:
        raise Nasty("no float")


class Text(str):
    def __str__(self) -> str:
        raise Nasty("no text")


class Whole(int):
    def __index__(self) -> int:
        raise Nasty("no index")


class Array(np.ndarray):  # type: ignore[type-arg]
    def __array_finalize__(self, other: Any) -> None:
        pass

    def tolist(self) -> Any:
        raise Nasty("no list")


class Somewhere(os.PathLike[str]):
    def __init__(self, path: Any) -> None:
        self.path = path

    def __fspath__(self) -> Any:
        if self.path is None:
            raise Nasty("nowhere")
        return self.path


def cyclic() -> list[Any]:
    cycle: list[Any] = [1.0]
    cycle.append(cycle)
    return cycle


def cyclic_table() -> dict[str, Any]:
    cycle: dict[str, Any] = {"ratio": 1.0}
    cycle["mass"] = [cycle]
    return cycle


def deep(levels: int = 60) -> list[Any]:
    nested: list[Any] = []
    for _ in range(levels):
        nested = [nested]
    return nested


def shared() -> list[Any]:
    row: list[Any] = [0.0, 1.0]
    for _ in range(4):
        row = [row] * 5
    return row


def mixed() -> Any:
    row = np.zeros(3, dtype=object)
    row[0], row[1] = Raises(), None
    return row


def masked() -> Any:
    return np.ma.masked_array(np.zeros((54, 3)), mask=np.eye(54, 3))


NUMBERS = [
    0, -1, 1, 2, 3, 7, 54, 2**31, 2**32 - 1, 2**32, 2**53 + 1, 2**63 - 1, 2**63, -(2**63), 10**30,
    10**400, True, False, 0.0, -0.0, 0.5, 1.5, -1.0, 1e-300, 5e-324, -5e-324, 1e-12, 1e12, 1e150,
    1e300, 1.7e308, -1.7e308, math.nan, math.inf, -math.inf,
]  # fmt: skip
TEXTS = [
    "", " ", "x", "xyz", "zyx", "xx", "none", "auto", "all", "a", "top", "relax", "dynamic", "ü",
    "\0", "a\0b", "\ud800", "\n", "a,b", '"', "'''", "\\", "a" * 3000, "nan", "]", "[a]", "a.b",
    "displacement", "velocity", "stress", "reaction", "force", "traction", "state", "from", "where",
]  # fmt: skip
OBJECTS: list[Callable[[], Any]] = [
    lambda: None,
    object,
    Raises,
    Silent,
    Itself,
    lambda: Raises,
    lambda: Row(3),
    lambda: Row(2**62),
    lambda: Row(2**40),
    lambda: Row(3, ends=False),
    lambda: range(2**40),
    lambda: range(2**62),
    lambda: range(3),
    lambda: Table(None),
    lambda: Table([1]),
    lambda: Table([(1, 2, 3)]),
    lambda: Table([("ratio", 1.0)]),
    lambda: Table([([], 1.0)]),
    lambda: Float(1.0),
    lambda: Text("x"),
    lambda: Whole(1),
    cyclic,
    cyclic_table,
    deep,
    shared,
    masked,
    lambda: decimal.Decimal("NaN"),
    lambda: decimal.Decimal("1.5"),
    lambda: fractions.Fraction(1, 3),
    lambda: 1 + 2j,
    lambda: b"bytes",
    lambda: bytearray(24),
    lambda: memoryview(b"12345678"),
    lambda: array.array("d", [1.0, 2.0, 3.0]),
    lambda: {1, 2, 3},
    lambda: (one for one in (1.0, 2.0, 3.0)),
    lambda: iter([1.0]),
    lambda: datetime.datetime(2020, 1, 1),
    lambda: slice(0, 3),
    lambda: Ellipsis,
    lambda: NotImplemented,
    lambda: ValueError("x"),
    lambda: ROCK,
    lambda: SEAM,
    lambda: column(),
    lambda: ddem,
    lambda: lambda time: 1.0,
    lambda: {"ramp": 1.0},
    lambda: {"table": [[0.0, 1.0], [1.0, 0.0]]},
    lambda: [[0.0, 1.0]],
    lambda: [],
    lambda: {},
    lambda: (),
    lambda: {"x": 1.0, "y": SEAM, "z": ROCK},
    lambda: {"centre": [0, 0, 0], "radius": 1},
    lambda: {"": 1},
    lambda: {1: 2},
    lambda: {"a\0b": 1},
    lambda: {"\ud800": 1},
    lambda: {"ratio": math.nan},
    lambda: {"mass": -1},
    lambda: np.float16(1.5),
    lambda: np.longdouble(1.5),
    lambda: np.complex64(1),
    lambda: np.datetime64("2020-01-01"),
    lambda: np.timedelta64(3, "s"),
    lambda: np.str_("xyz"),
    lambda: np.bytes_(b"x"),
    lambda: np.bool_(True),
    lambda: np.void(b"1234"),
    lambda: np.zeros(3, "f4,i4"),
    lambda: mixed(),
    lambda: np.array("2020-01-01", "M8[s]"),
    lambda: np.zeros((54, 3)).view(Array),
    lambda: np.matrix([[1.0, 2.0, 3.0]]),
]  # fmt: skip
DTYPES = [
    "f8", "f4", "f2", "g", ">f8", "i8", ">i4", "u8", "i1", "?", "c16", "O", "U3", "S3", "M8[s]",
    "m8[s]", "f8,i4", "V8",
]  # fmt: skip
SHAPES = [
    (), (0,), (1,), (3,), (54,), (0, 3), (1, 3), (2, 3), (54, 3), (3, 54), (54, 4), (54, 0), (9,),
    (9, 3), (16, 6), (1, 1, 3), (54, 3, 1), (0, 0, 0), (1,) * 32,
]  # fmt: skip


def shaped(kind: str, shape: tuple[int, ...], number: Any, layout: str) -> Any:
    """An array of the kind, as it may lie in memory."""
    made = np.zeros(shape, kind)
    with np.errstate(all="ignore"):
        try:
            if made.dtype.kind not in "VMm":
                made[...] = number
        except (ValueError, OverflowError, TypeError):
            pass
    if layout == "fortran":
        made = np.asfortranarray(made)
    elif layout == "strided" and made.ndim:
        wide = np.zeros((*shape[:-1], 2 * shape[-1]), kind)
        wide[..., ::2] = made
        made = wide[..., ::2]
    elif layout == "backward" and made.ndim:
        made = made[::-1]
    elif layout == "spread":
        made = np.broadcast_to(np.zeros((), kind), shape)
    elif layout == "unaligned" and made.dtype.kind == "f":
        raw = np.zeros(made.nbytes + 1, "u1")[1:]
        made = raw.view(kind).reshape(shape) if made.size else made
    elif layout == "frozen":
        made.setflags(write=False)
    elif layout == "masked":
        made = np.ma.masked_array(made)
    return made


numbers = st.sampled_from(NUMBERS) | st.floats() | st.integers()
arrays = st.builds(
    shaped,
    st.sampled_from(DTYPES),
    st.sampled_from(SHAPES),
    numbers,
    st.sampled_from("plain fortran strided backward spread unaligned frozen masked".split()),
)
objects = st.sampled_from(OBJECTS).map(lambda make: make())
texts = st.sampled_from(TEXTS) | st.text(max_size=5)
leaves = numbers | texts | objects
nested = st.recursive(
    leaves,
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.tuples(inner, inner)
        | st.dictionaries(st.sampled_from(["ratio", "mass", "x", "y", "a", ""]), inner, max_size=3)
    ),
    max_leaves=6,
)
vectors = st.lists(numbers, min_size=3, max_size=3)
nasty = st.one_of(numbers, numbers, texts, vectors, objects, arrays, nested)


# --- what a call takes, right but for some of it ---

WHERE: dict[str, Any] = {
    "x": 0.0,
    "y": (0.0, 1.0),
    "z": 2.0,
    "sphere": {"centre": (0, 0, 0), "radius": 9.0},
    "set": "all",
}
WHEN = {**WHERE, "from_": "a", "until": "b", "where": {"z": 0.0}}
METHODS: dict[str, dict[str, Any]] = {
    "add_blocks": {
        "name": "more",
        "origin": (9, 0, 0),
        "size": (1, 1, 1),
        "count": (1, 1, 1),
        "edges": {"x": [0, 1]},
        "divisions": 1,
        "material": ROCK,
        "joint": SEAM,
        "axes": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
        "body": "deformable",
    },
    "assign": {"joint": SEAM, "material": ROCK, **WHEN},
    "remove": {**WHEN},
    "refine": {"factor": 2, **WHERE},
    "fix": {"axes": "xyz", "velocity": (0, 0, 0), "history": {"ramp": 1.0}, **WHEN},
    "load": {
        "traction": (0, 0, 1),
        "pressure": 1.0,
        "line": (0, 0, 1),
        "force": (0, 0, 1),
        "history": {"ramp": 1.0},
        **WHEN,
    },
    "boundary": {"kind": "viscous", **WHEN},
    "initial": {"velocity": (0, 0, 1), "spin": (0, 0, 1), "centre": (0, 0, 0), **WHERE},
    "stage": {
        "name": "a",
        "kind": "dynamic",
        "tolerance": 1e-3,
        "max_steps": 10,
        "increments": 1,
        "duration": 1e-4,
        "damping": 0.1,
        "time_step": 1e-6,
        "fields_every": 1e-5,
        "frames": 3,
    },
    "probe": {
        "name": "p",
        "at": (0, 0, 0),
        "quantity": "displacement",
        "every": 1e-5,
        "every_steps": 3,
        **WHERE,
    },
}
MATERIAL = {"density": 2400.0, "young": 18e9, "poisson": 0.25, "name": "m"}
JOINT = {
    "thickness": 0.01,
    "material": ROCK,
    "density": 2400.0,
    "young": 18e9,
    "poisson": 0.25,
    "normal_stiffness": 1e9,
    "shear_stiffness": 1e9,
    "cohesion": 1e6,
    "friction": 30.0,
    "tension": 1e5,
    "residual_cohesion": 1e3,
    "residual_friction": 20.0,
    "dilation": 5.0,
    "fracture_energy": (10.0, 100.0),
    "jrc": 5.0,
    "jcs": 1e7,
    "name": "j",
}
MODEL = {
    "title": "t",
    "gravity": (0, 0, -9.81),
    "kinematics": "small",
    "element": "standard",
    "contact": False,
}
STAGE = {**METHODS["stage"], "record": None, "quiet": True}
SIMULATION: dict[str, dict[str, Any]] = {
    "relax": {key: STAGE[key] for key in ("tolerance", "max_steps", "increments", "name", "quiet")},
    "run": {
        key: STAGE[key]
        for key in ("duration", "damping", "time_step", "fields_every", "frames", "name", "quiet")
    },
    "step": {"n": 2, "quiet": True},
    "start": {"damping": 0.1, "time_step": 1e-6},
    "enter": {"stage": "a"},
    "apply_force": {"nodes": [0, 1], "force": (0.0, 0.0, 1.0)},
    "field": {"name": "displacement", "nodes": [0, 1], "out": np.zeros((2, 3))},
    "nodes": {**WHERE},
    "nearest_node": {"at": (0, 0, 0)},
    "reaction": {"nodes": [0, 1]},
}
# `n` and a duration are how long a call takes: nothing in between is asked for.
LONG = {"n", "duration", "max_steps", "frames", "every_steps", "increments"}


def changed(
    draw: st.DrawFn, known: dict[str, Any], given_: st.SearchStrategy[Any]
) -> dict[str, Any]:
    """Some of the arguments, some of them nasty."""
    keys = draw(st.lists(st.sampled_from(sorted(known)), unique=True, max_size=len(known)))
    keys = [key for key in known if key in keys or draw(st.booleans())]
    bad = set(draw(st.lists(st.sampled_from(sorted(known)), min_size=1, max_size=2)))
    arguments = {key: known[key] for key in keys}
    arguments |= {key: draw(given_) for key in bad}
    if draw(st.integers(0, 9)) == 0:
        arguments[draw(st.sampled_from(["foo", "kind", "where", "history", "ü", "name"]))] = draw(
            given_
        )
    return arguments


@st.composite
def arguments(draw: st.DrawFn, known: dict[str, Any]) -> dict[str, Any]:
    return changed(draw, known, nasty)


def endless(arguments_: dict[str, Any]) -> bool:
    """Whether a call would take long if it were not refused."""
    for key in LONG & set(arguments_):
        given_ = arguments_[key]
        try:
            number = float(given_)
        except Exception:
            continue
        if number > (1e-3 if key == "duration" else 20):
            return True
    return False


# --- tests ---


@pytest.mark.parametrize(
    "value",
    [
        "range(2**40)",
        "range(2**62)",
        "Row(2**62)",
        "Row(2**40)",
        "Row(2**33, ends=False)",
        "np.broadcast_to(np.zeros(()), 2**40)",
        "deep(10**6)",
        "cyclic()",
        "cyclic_table()",
    ],
)
def test_rows_without_end(value: str) -> None:
    # In an interpreter of its own, with little memory: this could be its end.
    script = f"""
import resource
resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))
from test_hypothesis import *
value = {value}
for call in (
    lambda: ddem.Material(density=value, young=1, poisson=0),
    lambda: ddem.Joint(thickness=1, fracture_energy=value),
    lambda: ddem.Model(gravity=value),
    lambda: column().load(force=(1, 0, 0), history=value),
    lambda: column().load(force=(1, 0, 0), history={{"table": [value]}}),
    lambda: ddem.Model.from_deck({{"materials": value}}),
    lambda: column().build(threads=1).run(value),
    lambda: column().build(threads=1).step(value),
):
    attempt(call)
print("done")
"""
    here = os.pathsep.join([str(Path(__file__).parent), *sys.path])
    done = subprocess.run(
        [sys.executable, "-c", script],
        capture_output=True,
        text=True,
        timeout=20,
        env={**os.environ, "PYTHONPATH": here},
    )
    assert (done.returncode, done.stdout) == (0, "done\n"), done.stderr[-2000:]


@some
@given(arguments(MATERIAL), arguments(JOINT), arguments(MODEL))
def test_constructors(
    material: dict[str, Any], joint: dict[str, Any], model: dict[str, Any]
) -> None:
    for make, given_ in ((ddem.Material, material), (ddem.Joint, joint), (ddem.Model, model)):
        made = attempt(lambda make=make, given_=given_: make(**given_))
        if made is not None:
            repr(made)
            attempt(lambda made=made: made == made)
        attempt(lambda make=make, given_=given_: make(*list(given_.values())[:2]))


@pytest.mark.parametrize("method", METHODS)
@some
@given(data=st.data())
def test_models(method: str, data: st.DataObject) -> None:
    model = column()
    given_ = data.draw(arguments(METHODS[method]))
    attempt(lambda: getattr(model, method)(**given_))
    repr(model)
    text = attempt(model.to_deck)
    if text is not None:
        assert ddem.Model.from_deck(model.deck).to_deck() == text
    if not affordable(model):
        return
    simulation = attempt(lambda: model.build(threads=1))
    if simulation is not None:
        looked(simulation)
        attempt(lambda: simulation.step(2))
        looked(simulation)
    assert column().build(threads=1).n_nodes == 54


def affordable(model: ddem.Model) -> bool:
    """Whether a model is small, or too large for any memory."""
    nodes = int(repr(model).rsplit(", ", 1)[1].split()[0])
    return not 10**4 < nodes < 10**10


def looked(simulation: ddem.Simulation) -> None:
    """Everything is looked at."""
    for name in dir(simulation):
        if not name.startswith("__") and not callable(getattr(ddem.Simulation, name)):
            attempt(lambda name=name: getattr(simulation, name))
    repr(simulation)
    attempt(lambda: simulation.reaction(simulation.nodes()))


BREAKING = breaking()
BREAKING.stage("a", kind="dynamic", duration=1e-4)


@pytest.fixture(scope="module")
def simulations() -> dict[str, ddem.Simulation]:
    return {}


def sound(simulations: dict[str, ddem.Simulation]) -> ddem.Simulation:
    """One that can move."""
    simulation = simulations.get("it")
    if simulation is None or not np.isfinite(simulation.force).all() or simulation.steps > 10**5:
        simulation = simulations["it"] = BREAKING.build(threads=1)
    return simulation


@pytest.mark.parametrize("method", SIMULATION)
@some
@given(data=st.data())
def test_simulations(
    method: str, data: st.DataObject, simulations: dict[str, ddem.Simulation]
) -> None:
    simulation = sound(simulations)
    given_ = data.draw(arguments(SIMULATION[method]))
    if not endless(given_):
        attempt(lambda: getattr(simulation, method)(**given_))
    attempt(lambda: simulation.step(1, quiet=True))
    assert isinstance(simulation.steps, int)
    if method in ("start", "apply_force", "enter"):
        simulations.clear()


@some
@given(st.sampled_from(["displacement", "velocity"]), nasty)
def test_states_that_are_set(name: str, value: Any) -> None:
    simulation = BREAKING.build(threads=1)
    attempt(lambda: setattr(simulation, name, value))
    looked(simulation)
    attempt(lambda: simulation.step(2))
    attempt(lambda: simulation.relax(max_steps=3, quiet=True))
    looked(simulation)
    simulation.displacement = np.zeros((54, 3))
    simulation.velocity = np.zeros((54, 3))


@some
@given(
    st.sampled_from(["displacement", "velocity", "force"]),
    st.lists(st.sampled_from(NUMBERS[18:-3]), min_size=1, max_size=12),
)
def test_states_of_extremes(name: str, values: list[float]) -> None:
    simulation = BREAKING.build(threads=1)
    field = np.resize(np.array(values, "f8"), (54, 3))
    if name == "force":
        simulation.apply_force(np.arange(54), field)
    else:
        setattr(simulation, name, field)
    looked(simulation)
    for call in (
        lambda: simulation.step(3),
        lambda: simulation.relax(max_steps=5, quiet=True),
        lambda: simulation.run(1e-4, quiet=True),
        lambda: simulation.start(damping={"local": 0.5}),
        lambda: simulation.enter("a"),
    ):
        attempt(call)
        looked(simulation)


@some
@given(nasty)
def test_histories(value: Any) -> None:
    model = column()
    model.load(force=(1, 0, 0), z=2.0, history=lambda time: value)
    model.fix("x", z=2.0, velocity=(1, 0, 0), history=lambda time: value)
    simulation = attempt(lambda: model.build(threads=1))
    if simulation is None:
        return
    for call in (
        lambda: simulation.step(2),
        lambda: simulation.relax(max_steps=3, quiet=True),
        lambda: simulation.run(1e-5, quiet=True),
        lambda: simulation.energy,
        lambda: simulation.force,
    ):
        attempt(call)


@st.composite
def decks(draw: st.DrawFn) -> dict[str, Any]:
    """A deck with nasty numbers where numbers are; sizes stay small or are far too large."""
    deck = FULL_DECK()
    places: list[tuple[Any, Any]] = []

    def visit(item: Any) -> None:
        for key, value in item.items() if isinstance(item, dict) else enumerate(item):
            if isinstance(value, (dict, list)):
                visit(value)
            elif isinstance(value, (int, float)) and not isinstance(value, bool):
                places.append((item, key))

    visit(deck)
    for item, key in draw(st.lists(st.sampled_from(places), min_size=1, max_size=4)):
        whole = isinstance(item[key], int)
        if whole:
            item[key] = draw(st.sampled_from([0, -1, 1, 2, 3, 10**6, 2**31, 2**32, 2**63 - 1]))
        else:
            scale = draw(st.sampled_from([0.0, -1.0, 0.5, 2.0, 1e-9, 1e9, 1e-300, 1e200]))
            item[key] = draw(st.one_of(st.just(item[key] * scale), numbers.filter(small_or_float)))
    return deck


def small_or_float(number: Any) -> bool:
    return isinstance(number, float)


def FULL_DECK() -> dict[str, Any]:
    model = breaking()
    model.assign(joint=SEAM, z=1.0, y=(0.0, 0.1))
    model.load(force=(1, 0, 0), sphere={"centre": (1, 1, 2), "radius": 0.2})
    model.load(line=(1, 0, 0), x=0.0, z=2.0, history=[[0, 0], [1e-4, 1]])
    model.load(pressure=1.0, x=1.0, y=(0.2, 0.7))
    model.fix("x", velocity=(1, 0, 0), z=2.0)
    model.initial(velocity=(0, 0, 1), spin=(1, 0, 0), centre=(0, 0, 0))
    rough = ddem.Joint(
        thickness=0.01, material=ROCK, jrc=8, jcs=50e6, residual_friction=28, tension=1e3
    )
    soft = ddem.Joint(
        normal_stiffness=1e10,
        shear_stiffness=5e9,
        cohesion=1e3,
        tension=1e3,
        friction=30,
        residual_cohesion=1.0,
        residual_friction=20,
        dilation=5,
        fracture_energy=(100, 400),
    )
    model.add_blocks(
        origin=(5, 0, 0),
        edges={"x": [0, 1, 2.5]},
        size=(2.5, 1, 1),
        divisions=1,
        material=ROCK,
        joint=rough,
    )
    model.add_blocks(
        origin=(9, 0, 0), size=(1, 1, 2), count=(1, 1, 2), divisions=1, material=ROCK, joint=soft
    )
    model.fix("xyz", x=(4, 30), z=0.0)
    model.probe("foot", quantity="reaction", z=0.0)
    model.stage("a", kind="relax", max_steps=30, increments=2)
    model.stage("b", kind="dynamic", duration=1e-4, damping=0.1, frames=2)
    return model.deck


@some
@given(decks())
def test_decks_of_nasty_numbers(tmp_path_factory: Any, deck: dict[str, Any]) -> None:
    model = attempt(lambda: ddem.Model.from_deck(deck))
    if model is None:
        return
    if not affordable(model):
        return
    simulation = attempt(lambda: model.build(threads=1))
    if simulation is None:
        return
    assert simulation.n_nodes < 10**5
    looked(simulation)
    for call in (
        lambda: simulation.enter("a"),
        lambda: simulation.relax(max_steps=10, quiet=True),
        lambda: simulation.enter("b"),
        lambda: simulation.step(10),
    ):
        attempt(call)
    looked(simulation)
    a, b = model.deck["stage"]
    if not endless(a) and not endless(b) and (b.get("time_step") in (None, "auto")):
        out = tmp_path_factory.mktemp("deck")
        attempt(lambda: ddem.run_deck(model, out=out / "out", threads=1, quiet=True))


PATHS: list[Any] = [
    "", ".", "..", "\0", "a\0b", "a" * 300, "a/" * 3000, "\ud800", "nothing", "no/thing", "file",
    "folder", "folder/", "file/x", b"", b"file", b"\xff\xfe", b"a\0b", 5, -1, None, 1.5, [], {},
    Path("nothing"), Path("file"), Path("folder"), Somewhere("file"), Somewhere(None), Somewhere(5),
    Somewhere(b"file"), Raises(), Silent(), "state.h5", "text.toml", "folder\n", " ",
]  # fmt: skip


@some
@given(st.sampled_from(PATHS), st.sampled_from(PATHS), nasty)
def test_paths(tmp_path_factory: Any, path: Any, other: Any, value: Any) -> None:
    folder = tmp_path_factory.getbasetemp() / "paths"
    (folder / "folder").mkdir(parents=True, exist_ok=True)
    before = os.getcwd()
    os.chdir(folder)
    try:
        Path("file").write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(range(256)))
        model = BREAKING
        simulation = model.build(threads=1)
        simulation.save("state.h5")
        for call in (
            lambda: ddem.load(path),
            lambda: ddem.load("state.h5", model=value),
            lambda: ddem.load("state.h5", threads=value if not isinstance(value, int) else 2),
            lambda: ddem.Model.from_deck(path),
            lambda: ddem.run_deck(path, out=other, quiet=True, threads=1),
            lambda: ddem.run_deck(model, out=other, quiet=True, threads=1),
            lambda: ddem.run_deck(model, out=other, resume=True, quiet=True, threads=1),
            lambda: model.to_deck(path),
            lambda: simulation.save(path),
            lambda: simulation.run(1e-5, record=path, quiet=True),
            lambda: simulation.relax(max_steps=2, record=other, quiet=True),
            lambda: simulation.run(1e-5, record=other, name=value, quiet=True),
            lambda: (
                ddem.run_deck(value, out=value, quiet=True) if not isinstance(value, str) else None
            ),
        ):
            attempt(call)
        assert isinstance(simulation.steps, int)
    finally:
        os.chdir(before)


DECK_TEXT = BREAKING.to_deck()


@some
@given(
    st.integers(0, len(DECK_TEXT)),
    st.integers(0, 30),
    st.binary(max_size=8) | texts.map(lambda t: t.encode(errors="surrogatepass")),
)
def test_files_that_are_no_decks(tmp_path_factory: Any, at: int, length: int, put: bytes) -> None:
    path = tmp_path_factory.getbasetemp() / "deck.toml"
    text = DECK_TEXT.encode()
    path.write_bytes(text[:at] + put + text[at + length :])
    model = attempt(lambda: ddem.Model.from_deck(path))
    if model is not None and len(model.deck.get("blocks", [])) < 3:
        repr(model)


@pytest.fixture(scope="module")
def saved(tmp_path_factory: Any) -> tuple[bytes, list[str]]:
    simulation = BREAKING.build(threads=1)
    simulation.run(1e-3, quiet=True)
    path = tmp_path_factory.mktemp("saved") / "state.h5"
    simulation.save(path)
    names: list[str] = []
    with h5py.File(path) as file:
        file.visititems(lambda name, item: names.append(name))
        names += [f"@{name}" for name in file.attrs]
    return path.read_bytes(), names


@some
@given(data=st.data())
def test_files_that_are_no_checkpoints(
    tmp_path_factory: Any, saved: tuple[bytes, list[str]], data: st.DataObject
) -> None:
    content, _ = saved
    path = tmp_path_factory.getbasetemp() / "bad.h5"
    if data.draw(st.booleans()):
        content = content[: data.draw(st.integers(0, len(content)))]
    else:
        at = data.draw(st.integers(0, len(content) - 1))
        content = content[:at] + data.draw(st.binary(min_size=1, max_size=9)) + content[at + 9 :]
    path.write_bytes(content)
    simulation = attempt(lambda: ddem.load(path, threads=1))
    if simulation is not None:
        looked(simulation)
        attempt(lambda: simulation.step(2))


@some
@given(data=st.data())
def test_checkpoints_of_nasty_numbers(
    tmp_path_factory: Any, saved: tuple[bytes, list[str]], data: st.DataObject
) -> None:
    content, names = saved
    path = tmp_path_factory.getbasetemp() / "nasty.h5"
    path.write_bytes(content)
    name = data.draw(st.sampled_from(names))
    number = data.draw(
        st.sampled_from([0, 1, -1, 2**32, 2**63, 1e300, -1e300, math.nan, math.inf, 0.5])
    )
    how = data.draw(st.sampled_from(["one", "all", "longer", "shorter", "gone", "scalar"]))
    with h5py.File(path, "r+") as file, warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        try:
            holder: Any = file.attrs if name.startswith("@") else file
            name = name.removeprefix("@")
            if isinstance(holder[name], h5py.Group):
                del file[name]
            else:
                value = np.asarray(holder[name][()])
                del holder[name]
                if how == "longer":
                    holder[name] = np.resize(value, value.size + 1)
                elif how == "shorter":
                    holder[name] = np.resize(value, max(value.size - 1, 0))
                elif how == "scalar":
                    holder[name] = number
                elif how != "gone":
                    value = np.array(value)
                    if how == "all" or value.ndim == 0:
                        value[...] = number
                    else:
                        value.flat[data.draw(st.integers(0, max(value.size - 1, 0)))] = number
                    holder[name] = value
        except (ValueError, TypeError, OverflowError, IndexError, KeyError):
            pass
    simulation = attempt(lambda: ddem.load(path, threads=1))
    if simulation is None:
        return
    looked(simulation)
    attempt(lambda: simulation.step(2))
    attempt(lambda: simulation.enter("a"))
    attempt(lambda: simulation.relax(max_steps=3, quiet=True))
    attempt(lambda: simulation.run(1e-5, quiet=True))
    looked(simulation)


@pytest.mark.parametrize("number", [0, 1, 2**32, 2**63, 2**64 - 1])
def test_counters_of_checkpoints(
    tmp_path: Path, saved: tuple[bytes, list[str]], number: int
) -> None:
    content, names = saved
    counters = [name for name in names if name.startswith("counters/")]
    assert counters
    for name in counters:
        path = tmp_path / "counters.h5"
        path.write_bytes(content)
        with h5py.File(path, "r+") as file:
            file[name][()] = number
        simulation = attempt(lambda path=path: ddem.load(path, threads=1))
        if simulation is None:
            continue
        looked(simulation)
        for call in (
            lambda simulation=simulation: simulation.step(2),
            lambda simulation=simulation: simulation.relax(max_steps=3, quiet=True),
            lambda simulation=simulation: simulation.run(1e-5, quiet=True),
            lambda simulation=simulation: simulation.enter("a"),
        ):
            attempt(call)


@some
@given(nasty, nasty)
def test_functions(one: Any, other: Any) -> None:
    attempt(lambda: ddem.Model.from_deck(one) if not isinstance(one, str) else None)
    attempt(lambda: column().build(threads=one) if not isinstance(one, int) else None)
    attempt(lambda: ddem.Simulation(one))  # type: ignore[call-arg]
    attempt(lambda: ROCK == one)
    attempt(lambda: SEAM == one)
    attempt(lambda: ddem.schema(one))  # type: ignore[call-arg]
    attempt(lambda: setattr(sound({}), "foo", one))
    attempt(lambda: ddem.Model.from_deck({"title": one, "model": other}))
    attempt(lambda: ddem.Model.from_deck({**DECK, "blocks": one, "stage": other}).build(threads=1))


DECK = BREAKING.deck

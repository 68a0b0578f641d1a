"""No argument makes a call panic, crash or hang."""

from __future__ import annotations

from typing import Any

import ddem
import numpy as np
import pytest
from fuzz_calls import BREAKING, affordable, attempt, endless, read_everything, some
from fuzz_values import any_value
from hypothesis import given
from hypothesis import strategies as st
from sample_models import ROCK, SEAM, column, run_python

# --- arguments of a call, correct except for some ---

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
    "contact": {
        "normal_stiffness": 1e9,
        "shear_stiffness": 1e9,
        "friction": 30.0,
        "damping": 0.1,
        "restitution": 0.5,
    },
    "assign": {"joint": SEAM, "material": ROCK, **WHEN},
    "remove": {**WHEN},
    "join": {**WHERE},
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
    "charge": {
        "mass": 1.0,
        "explosive": "tnt",
        "pressure": 1.0,
        "gamma": 3.0,
        "history": "gas",
        "delay": 1.0,
        **WHEN,
    },
    "boundary": {"kind": "viscous", "velocity": (0, 0, 1), "history": {"ramp": 1.0}, **WHEN},
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


@st.composite
def arguments(draw: st.DrawFn, known: dict[str, Any]) -> dict[str, Any]:
    """Some of the known arguments, some of them replaced by any values."""
    keys = draw(st.lists(st.sampled_from(sorted(known)), unique=True, max_size=len(known)))
    keys = [key for key in known if key in keys or draw(st.booleans())]
    bad = set(draw(st.lists(st.sampled_from(sorted(known)), min_size=1, max_size=2)))
    given_ = {key: known[key] for key in keys}
    given_ |= {key: draw(any_value) for key in bad}
    if draw(st.integers(0, 9)) == 0:
        besides = draw(st.sampled_from(["foo", "kind", "where", "history", "ü", "name"]))
        given_[besides] = draw(any_value)
    return given_


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
def test_endless_sequences_are_refused(value: str) -> None:
    # Runs in another interpreter with little memory, because this can crash it.
    script = f"""
import resource
resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))
import ddem
import numpy as np
from fuzz_calls import attempt
from fuzz_values import Row, cyclic, cyclic_table, deep
from sample_models import column
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
    assert run_python(script, timeout=20) == "done\n"


@some
@given(arguments(MATERIAL), arguments(JOINT), arguments(MODEL))
def test_constructors_survive_any_argument(
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
def test_model_methods_survive_any_argument(method: str, data: st.DataObject) -> None:
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
        read_everything(simulation)
        attempt(lambda: simulation.step(2))
        read_everything(simulation)
    assert column().build(threads=1).n_nodes == 54


@pytest.fixture(scope="module")
def simulations() -> dict[str, ddem.Simulation]:
    return {}


def sound(simulations: dict[str, ddem.Simulation]) -> ddem.Simulation:
    """A simulation that can still move."""
    simulation = simulations.get("it")
    if simulation is None or not np.isfinite(simulation.force).all() or simulation.steps > 10**5:
        simulation = simulations["it"] = BREAKING.build(threads=1)
    return simulation


@pytest.mark.parametrize("method", SIMULATION)
@some
@given(data=st.data())
def test_simulation_methods_survive_any_argument(
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


DECK = BREAKING.deck


@some
@given(any_value, any_value)
def test_functions_survive_any_argument(one: Any, other: Any) -> None:
    attempt(lambda: ddem.Model.from_deck(one) if not isinstance(one, str) else None)
    attempt(lambda: column().build(threads=one) if not isinstance(one, int) else None)
    attempt(lambda: ddem.Simulation(one))  # type: ignore[call-arg]
    attempt(lambda: ROCK == one)
    attempt(lambda: SEAM == one)
    attempt(lambda: ddem.schema(one))  # type: ignore[call-arg]
    attempt(lambda: setattr(sound({}), "foo", one))
    attempt(lambda: ddem.Model.from_deck({"title": one, "model": other}))
    attempt(lambda: ddem.Model.from_deck({**DECK, "blocks": one, "stage": other}).build(threads=1))

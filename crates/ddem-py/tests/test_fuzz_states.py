"""No state, force or history makes a simulation panic, crash or hang."""

from __future__ import annotations

from typing import Any

import numpy as np
from fuzz_calls import BREAKING, attempt, read_everything, some
from fuzz_values import NUMBERS, any_value
from hypothesis import given
from hypothesis import strategies as st
from sample_models import column


@some
@given(st.sampled_from(["displacement", "velocity"]), any_value)
def test_set_states_survive_any_value(name: str, value: Any) -> None:
    simulation = BREAKING.build(threads=1)
    attempt(lambda: setattr(simulation, name, value))
    read_everything(simulation)
    attempt(lambda: simulation.step(2))
    attempt(lambda: simulation.relax(max_steps=3, quiet=True))
    read_everything(simulation)
    simulation.displacement = np.zeros((54, 3))
    simulation.velocity = np.zeros((54, 3))


@some
@given(
    st.sampled_from(["displacement", "velocity", "force"]),
    st.lists(st.sampled_from(NUMBERS[18:-3]), min_size=1, max_size=12),
)
def test_extreme_states_are_refused_or_diverge(name: str, values: list[float]) -> None:
    simulation = BREAKING.build(threads=1)
    field = np.resize(np.array(values, "f8"), (54, 3))
    if name == "force":
        simulation.apply_force(np.arange(54), field)
    else:
        setattr(simulation, name, field)
    read_everything(simulation)
    for call in (
        lambda: simulation.step(3),
        lambda: simulation.relax(max_steps=5, quiet=True),
        lambda: simulation.run(1e-4, quiet=True),
        lambda: simulation.start(damping={"local": 0.5}),
        lambda: simulation.enter("a"),
    ):
        attempt(call)
        read_everything(simulation)


@some
@given(any_value)
def test_histories_survive_any_return_value(value: Any) -> None:
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

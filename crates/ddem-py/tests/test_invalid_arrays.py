"""Messages about arrays and numbers that simulations cannot take."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from sample_models import cube, refused

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
def test_invalid_states_are_refused(name: str, wrong: str) -> None:
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
def test_invalid_node_numbers_are_refused(wrong: str) -> None:
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
def test_invalid_forces_are_refused(nodes: Any, force: Any, message: str) -> None:
    simulation = cube().build()
    with pytest.raises(ValueError, match=f"^force: {message}"):
        simulation.apply_force(nodes, force)
    assert not simulation.force.any()


def test_invalid_positions_are_refused() -> None:
    simulation = cube().build()
    with pytest.raises(ValueError, match=r"^at: has shape \(2,\), expected \(3,\)"):
        simulation.nearest_node((1, 2))
    with pytest.raises(ValueError, match="^at: is NaN"):
        simulation.nearest_node((1, 2, np.nan))


def test_invalid_out_arrays_are_refused() -> None:
    simulation = cube().build()

    def refusal(out: Any, name: str = "velocity") -> str:
        return refused(lambda: simulation.field(name, out=out))

    assert refusal([0.0]) == "out: must be a NumPy array of float64 [invalid-argument]"
    assert refusal(np.zeros((3, 3))) == "out: has shape (3, 3), expected (27, 3) [invalid-argument]"
    assert refusal(np.zeros((27, 3), "f4")).startswith("out: has dtype float32, expected float64")
    assert refusal(np.zeros((27, 3), ">f8")).startswith("out: has dtype >f8, expected float64")
    frozen = np.zeros((27, 3))
    frozen.setflags(write=False)
    assert refusal(frozen).startswith("out: ") and "write" in refusal(frozen)
    assert refusal(np.broadcast_to(np.zeros(3), (27, 3))).startswith("out: ")
    assert refusal(np.zeros((8, 6)), "velocity").startswith("out: has shape (8, 6)")


def test_unknown_fields_are_refused() -> None:
    simulation = cube().build()
    message = refused(lambda: simulation.field("displacment"))
    assert message.startswith("name: there is no `displacment` (did you mean `displacement`?")
    message = refused(lambda: simulation.field("stress", nodes=[0]))
    assert message == "nodes: `stress` is not a field at nodes: leave `nodes` out [invalid-argument]"


@pytest.mark.parametrize("n", [-1, 1.5, "a", None, [1], 2**70, np.nan, np.float64(3)])
def test_invalid_numbers_of_steps_are_refused(n: Any) -> None:
    simulation = cube().build()
    if n is None:
        simulation.step(n)
        assert simulation.steps == 1
        return
    assert refused(lambda: simulation.step(n)).startswith("n: must be a whole number")
    assert simulation.steps == 0

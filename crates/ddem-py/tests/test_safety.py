"""Factors of safety."""

import math
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import ddem

ROCK = ddem.Material(density=2400, young=18e9, poisson=0.25)


def slope(friction: float) -> ddem.Model:
    """A block on a plane of 30 degrees, by inclined gravity."""
    gravity = (9.81 * math.sin(math.pi / 6), 0, -9.81 * math.cos(math.pi / 6))
    model = ddem.Model(gravity=gravity)
    seam = ddem.Joint(normal_stiffness=1e10, shear_stiffness=1e10, friction=friction, name="seam")
    model.add_blocks(
        size=(1, 1, 2), count=(1, 1, 2), divisions=1, material=ROCK, joint=seam, body="rigid"
    )
    model.fix("xyz", z=0.0)
    return model


def test_block_on_plane_has_exact_factor() -> None:
    exact = math.tan(math.radians(38)) / math.tan(math.radians(30))
    found = ddem.factor_of_safety(slope(38.0))
    assert found.factor == pytest.approx(exact, rel=5e-3)
    stable, unstable = found.bracket
    assert stable is not None and unstable is not None and 0 < unstable - stable <= 0.005
    assert {verdict for _, verdict, _ in found.trials} == {"at rest", "fails"}
    assert [block for _, block in found.moving] == [1]
    simulation = slope(38.0).build()
    simulation.relax(quiet=True)
    before = simulation.displacement.copy()
    assert ddem.factor_of_safety(simulation, bracket=(1.0, 2.0)).factor == pytest.approx(exact, rel=5e-3)
    assert (simulation.displacement == before).all()


@pytest.mark.parametrize(
    ("bracket", "code", "finding"),
    [
        ((2.0, 3.0), "factor-below-bracket", "the blocks fail with the smallest factor, 2"),
        ((0.5, 1.0), "factor-above-bracket", "the blocks hold with the largest factor, 1"),
    ],
)
def test_a_factor_outside_the_bracket_warns_as_in_a_deck(
    bracket: tuple[float, float], code: str, finding: str, tmp_path: Path
) -> None:
    def said(call: Callable[[], object]) -> str:
        with pytest.warns(UserWarning) as caught:
            call()
        (warning,) = caught
        assert warning.filename == __file__ or call is deck
        return str(warning.message)

    model = slope(38.0)
    model.stage("weight", kind="relax")
    model.stage("factor", kind="safety", bracket=bracket)

    def deck() -> None:
        ddem.run_deck(model, out=tmp_path / "out", quiet=True)

    message = said(lambda: ddem.factor_of_safety(slope(38.0), bracket=bracket))
    assert message.startswith(f"bracket: {finding}") and message.endswith(f"[{code}]")
    assert said(deck) == f"stage[1].{message}"


@pytest.mark.parametrize(
    ("code", "keys"),
    [
        ("undecided-trial", {"max_steps": 2}),
        ("not-in-equilibrium", {"max_steps": 2}),
        ("waiting-stages", {}),
        ("factor-below-bracket", {"bracket": (2.0, 3.0)}),
        ("factor-above-bracket", {"bracket": (0.5, 1.0)}),
        ("loose-tolerance", {"tolerance": 1e-3}),
    ],
)
def test_a_model_silences_warnings(code: str, keys: dict[str, Any]) -> None:
    def codes(allow: list[str]) -> set[str]:
        model = slope(38.0)
        model.lint(allow=allow)
        if code == "waiting-stages":
            model.load(force=(2e3, 0, 0), z=2.0, from_="push")
            model.stage("weight", kind="relax")
            model.stage("push", kind="relax")
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            ddem.factor_of_safety(model, **keys)
        return {str(warning.message).rsplit("[")[-1].rstrip("]") for warning in caught}

    assert code in codes([])
    assert codes([code]) == codes([]) - {code}


@pytest.mark.parametrize("friction", [25.0, 30.0])
def test_failing_model_has_factor_below_1(friction: float) -> None:
    exact = math.tan(math.radians(friction)) / math.tan(math.radians(30))
    found = ddem.factor_of_safety(slope(friction))
    assert found.factor == pytest.approx(exact, rel=5e-3)
    assert [block for _, block in found.moving] == [1]


def test_search_at_the_limit_ends() -> None:
    # The slope neither comes to rest nor fails; its first relaxation must not use all steps of a
    # trial.
    found = ddem.factor_of_safety(slope(30.0), bracket=(0.9, 1.2), max_steps=5000)
    assert found.factor == pytest.approx(1.0, rel=5e-3)
    assert max(steps for _, _, steps in found.trials) <= 5000


def test_undecided_trials_warn() -> None:
    simulation = slope(38.0).build()
    simulation.relax(quiet=True)
    with pytest.warns(UserWarning, match=r"no factor of safety.*undecided after 2 steps.*\[undecided-trial\]"):
        found = ddem.factor_of_safety(simulation, max_steps=2)
    assert (found.factor, found.bracket) == (None, (None, None))
    with pytest.warns(UserWarning, match="undecided after 200 steps and counts as unstable"):
        ddem.factor_of_safety(simulation, bracket=(0.9, 4.0), max_steps=200)


def test_model_not_at_rest_warns() -> None:
    with pytest.warns(UserWarning, match=r"not in equilibrium after 2 steps.*\[not-in-equilibrium\]"):
        ddem.factor_of_safety(slope(38.0), max_steps=2)


def test_later_stages_are_excluded_from_search() -> None:
    model = slope(38.0)
    model.load(force=(2e3, 0, 0), z=2.0, from_="push")
    model.stage("weight", kind="relax")
    model.stage("push", kind="relax")
    with pytest.warns(UserWarning, match=r"wait for the stage `push` and.*\[waiting-stages\]"):
        ddem.factor_of_safety(model)


def test_threads_are_given_with_a_model_only() -> None:
    assert ddem.factor_of_safety(slope(25.0), threads=1).factor is not None
    with pytest.raises(TypeError, match="threads"):
        ddem.factor_of_safety(slope(25.0).build(), threads=1)
    with pytest.raises(TypeError, match="expected a Model or a Simulation"):
        ddem.factor_of_safety("deck.toml")  # type: ignore[arg-type]


def test_invalid_searches_are_refused() -> None:
    simulation = slope(38.0).build()
    for keys in ({"bracket": (2.0, 1.0)}, {"joints": ["no"]}, {"resolution": 0.0}):
        with pytest.raises(ddem.ModelError):
            ddem.factor_of_safety(simulation, **keys)

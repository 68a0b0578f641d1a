"""Models: conversion between Python and decks."""

from __future__ import annotations

import copy
import json
import math
import pickle
import re
import sys
from pathlib import Path
from typing import Any

import ddem
import numpy as np
import pytest
from sample_models import ROCK, SEAM, column, cube, same_state


def full() -> ddem.Model:
    """A model with every section that this version can run."""
    spring = ddem.Joint(normal_stiffness=1e10, shear_stiffness=5e9, thickness=0.0)
    weak = ddem.Joint(
        thickness=0.01,
        density=2300,
        young=9e9,
        poisson=0.2,
        cohesion=1e6,
        friction=35,
        tension=5e5,
        residual_cohesion=1e4,
        residual_friction=30,
        dilation=5,
        fracture_energy=(100, 400),
        name="weak",
    )
    rough = ddem.Joint(
        thickness=0.01, material=ROCK, jrc=8, jcs=50e6, residual_friction=28, name="rough"
    )
    soft = ddem.Material(density=2000, young=5e9, poisson=0.3, name="soft")
    model = ddem.Model(
        title="everything",
        gravity=(0, 0, -9.81),
        kinematics="small",
        element="incompatible",
        contact=True,
    )
    model.contact(normal_stiffness=1e10, shear_stiffness=5e9, friction=20, restitution=0.5)
    model.lint(allow=["suspicious-unit"])
    model.add_blocks(
        name="base",
        size=(2, 1, 2),
        count=(2, 1, 2),
        divisions=2,
        material=ROCK,
        joint={"x": weak, "z": SEAM},
    )
    model.add_blocks(
        name="side",
        origin=(5, 0, 0),
        edges={"x": [0, 1, 2.5], "z": [0, 1]},
        size=(2.5, 1, 1),
        divisions=1,
        material=ROCK,
        joint=spring,
        axes=[(1, 0, 0), (0, 1, 0), (0, 0.5, 1)],
        body="deformable",
    )
    model.assign(joint=rough, z=1.0, set="base")
    model.assign(material=soft, x=(0, 1), sphere={"centre": (0.5, 0.5, 0.5), "radius": 0.3})
    model.remove(x=(6, 8), set="side")
    model.fix("xyz", z=0.0)
    model.fix("x", velocity=(0.1, 0, 0), history={"ramp": 0.01}, x=0.0, from_="push", until="end")
    model.load(traction=(0, 0, -1e4), z=2.0)
    model.load(pressure=1e4, x=2.0, history={"table": [[0, 0], [1, 1]]})
    model.load(line=(0, 0, -1e3), z=2.0, x=2.0, from_="push")
    model.load(force=(1, 2, 3), sphere={"centre": (2, 1, 2), "radius": 0.1}, until="push")
    hole = {"from": (1, 0.5, 0), "to": (1, 0.5, 2), "radius": 2}
    blast = {"mass": 0.1, "explosive": "anfo", "delay": 1e-4, "from_": "push"}
    model.charge(cylinder=hole, set="base", **blast)
    pulse = {"duvall": {"alpha": 100, "beta": 300}}
    model.charge(pressure=1e5, cylinder=hole, set="base", until="end", history=pulse)
    own = {"density": 1000, "detonation_velocity": 4000, "gamma": 3}
    model.charge(mass=0.1, explosive=own, history="gas", z=1.0, set="base")
    wave = {"velocity": (0, 0.1, 0), "history": {"ramp": 0.02}}
    model.boundary("viscous", y=0.0, set="base", from_="push", until="end", **wave)
    model.initial(velocity=(0, 0, 0.1), spin=(0, 0, 0.1), centre=(1, 1, 1), set="side")
    model.stage("settle", kind="relax", tolerance=1e-4, max_steps=5000, increments=2)
    model.stage("push", kind="dynamic", duration=1e-3, damping=0.05, time_step=1e-6, frames=3)
    model.stage("end", kind="dynamic", duration=1e-3, damping={"local": 0.1}, fields_every=1e-4)
    model.probe("top", at=(1, 1, 2), quantity="velocity", every=1e-4, every_steps=7)
    model.probe("foot", quantity="reaction", z=0.0)
    return model


def rounds(model: ddem.Model, folder: Path) -> None:
    """Writes a model as text, file and dictionary, and reads it back."""
    path = folder / "deck.toml"
    text = model.to_deck(path)
    assert path.read_text() == text
    for again in (ddem.Model.from_deck(path), ddem.Model.from_deck(model.deck)):
        assert again.to_deck() == text
        assert again.deck == model.deck


def test_every_section_round_trips(tmp_path: Path) -> None:
    model = full()
    rounds(model, tmp_path)
    sections = set(ddem.schema()["properties"])
    # These are the only sections that the full model lacks.
    assert sections - set(model.deck) == {"refine", "region", "cut", "join", "output"}
    assert model.build().n_blocks == 4 + 1


def test_refine_splits_blocks() -> None:
    model = column()
    before = model.build().n_blocks
    model.refine(factor=2, set="all")
    assert model.deck["refine"] == [{"factor": 2, "where": {"set": "all"}}]
    assert model.build().n_blocks == 8 * before


def test_deck_has_the_given_values() -> None:
    deck = full().deck
    assert deck["title"] == "everything"
    assert deck["model"] == {
        "gravity": [0.0, 0.0, -9.81],
        "kinematics": "small",
        "element": "incompatible",
        "contact": True,
    }
    assert deck["contact"] == {
        "normal_stiffness": 1e10,
        "shear_stiffness": 5e9,
        "friction": 20.0,
        "restitution": 0.5,
    }
    assert deck["joints"]["weak"]["fracture_energy"] == [100.0, 400.0]
    assert deck["joints"]["weak"]["residual_friction"] == 30.0
    assert deck["joints"]["rough"]["jrc"] == 8.0
    assert deck["blocks"][1]["edges"] == {"x": [0.0, 1.0, 2.5], "z": [0.0, 1.0]}
    assert deck["assign"][0] == {"joint": "rough", "where": {"z": 1.0, "set": "base"}}
    assert deck["remove"] == [{"where": {"x": [6.0, 8.0], "set": "side"}}]
    assert deck["initial"][0]["spin"] == [0.0, 0.0, 0.1]
    assert deck["probe"][0]["every_steps"] == 7
    assert deck["probe"][1]["where"] == {"z": 0.0}


def test_contact_replaces_earlier_contact() -> None:
    model = column()
    assert "contact" not in model.deck
    model.contact(friction=20, damping=np.float64(0.5))
    assert model.deck["contact"] == {"friction": 20.0, "damping": 0.5}
    model.contact(restitution=0)
    assert model.deck["contact"] == {"restitution": 0.0}
    assert "[contact]\nrestitution = 0.0\n" in model.to_deck()
    model.contact()
    assert "contact" not in model.deck


def test_output_sets_the_time_between_checkpoints() -> None:
    model = column()
    assert "output" not in model.deck
    model.output(checkpoint_every=5)
    assert model.deck["output"] == {"checkpoint_every": 5.0}
    assert "[output]\ncheckpoint_every = 5.0\n" in model.to_deck()
    model.output()
    assert "output" not in model.deck
    model.output(checkpoint_every=-1)
    with pytest.raises(ddem.ModelError, match="0 or more"):
        model.build()


@pytest.mark.parametrize("every", [-1.0, float("nan"), "often"])
def test_time_between_checkpoints_is_a_number(every: Any) -> None:
    with pytest.raises(ddem.ModelError, match="checkpoint_every.*number of seconds"):
        ddem.run_deck(column(), checkpoint_every=every)


def test_deck_is_a_copy() -> None:
    model = column()
    deck = model.deck
    deck["model"]["gravity"] = [1.0, 2.0, 3.0]
    deck["blocks"].clear()
    assert model.deck["model"]["gravity"] == [0.0, 0.0, -9.81]
    changed = model.deck
    changed["blocks"][0]["divisions"] = 1
    assert ddem.Model.from_deck(changed).build().n_nodes == 2 * 8
    json.dumps(deck)


def test_from_underscore_is_key_from() -> None:
    model = column()
    model.stage("push", kind="relax")
    model.load(force=(1, 0, 0), z=2.0, from_="push", until="push")
    model.fix("x", z=2.0, from_="push")
    assert model.deck["load"][0]["from"] == "push"
    assert model.deck["load"][0]["until"] == "push"
    assert model.deck["fix"][1]["from"] == "push"


def test_where_may_be_a_dictionary() -> None:
    one, other = column(), column()
    one.fix("x", z=2.0, x=(0, 1))
    other.fix("x", where={"z": 2.0, "x": [0, 1]})
    assert one.deck == other.deck


@pytest.mark.parametrize(
    ("given", "written"),
    [
        (0.05, {"ratio": 0.05}),
        (0, {"ratio": 0.0}),
        (np.float32(0.5), {"ratio": 0.5}),
        ({"ratio": 0.05}, {"ratio": 0.05}),
        ({"mass": 3}, {"mass": 3.0}),
        ({"stiffness": 1e-5}, {"stiffness": 1e-5}),
        ({"local": 0.8}, {"local": 0.8}),
        ("none", "none"),
    ],
)
def test_damping_is_number_or_dictionary(given: Any, written: Any) -> None:
    model = column()
    model.stage("a", kind="dynamic", duration=1, damping=given)
    assert model.deck["stage"][0]["damping"] == written


@pytest.mark.parametrize(
    ("given", "written"),
    [
        ({"ramp": 1}, {"ramp": 1.0}),
        ({"table": [(0, 0), (1, 2)]}, {"table": [[0.0, 0.0], [1.0, 2.0]]}),
        ([(0, 0), (1, 2)], {"table": [[0.0, 0.0], [1.0, 2.0]]}),
        (((0, 0), (1, 2)), {"table": [[0.0, 0.0], [1.0, 2.0]]}),
        (np.array([[0, 0], [1, 2]]), {"table": [[0.0, 0.0], [1.0, 2.0]]}),
    ],
)
def test_histories_are_rows_or_dictionaries(given: Any, written: Any) -> None:
    model = column()
    model.load(force=(1, 0, 0), z=2.0, history=given)
    model.fix("x", velocity=(1, 0, 0), z=2.0, history=given)
    assert model.deck["load"][0]["history"] == written
    assert model.deck["fix"][1]["history"] == written


def test_functions_cannot_be_written_to_a_deck(tmp_path: Path) -> None:
    model = column()
    model.load(force=(1, 0, 0), z=2.0)
    model.load(force=(1, 0, 0), z=2.0, history=lambda time: time)
    driven = column()
    driven.fix("x", velocity=(1, 0, 0), z=2.0, history=lambda time: time)
    for case, place in ((model, r"load\[1\].history"), (driven, r"fix\[1\].history")):
        for use in (
            case.to_deck,
            lambda case=case: case.deck,
            lambda case=case: ddem.run_deck(case, out=tmp_path / "out"),
        ):
            with pytest.raises(ddem.ModelError, match=f"^{place}: is a Python function"):
                use()
        case.build()
    with pytest.raises(ddem.ModelError, match="load"):
        model.to_deck(tmp_path / "deck.toml")
    assert list(tmp_path.iterdir()) == []


def test_initial_conditions_take_no_function() -> None:
    with pytest.raises(ddem.ModelError, match="^history: "):
        column().initial(velocity=(1, 0, 0), history=lambda time: time)


def test_numpy_numbers_and_arrays_are_accepted() -> None:
    model = ddem.Model(gravity=np.array([0, 0, -10], dtype=np.int32))
    rock = ddem.Material(density=np.float32(2400), young=np.int64(10**10), poisson=np.float64(0.25))
    model.add_blocks(
        size=np.ones(3), count=np.array([1, 1, 1], np.uint8), divisions=np.int16(2), material=rock
    )
    model.fix(np.str_("xyz"), z=np.array(0.0))
    model.fix("x", x=np.array([0.0, 1.0]))
    assert model.deck["blocks"][0]["count"] == [1, 1, 1]
    assert model.deck["fix"][1]["where"] == {"x": [0.0, 1.0]}
    assert model.build().n_nodes == 27


def test_long_double_is_accepted() -> None:
    assert ddem.Material(density=np.longdouble(2400), young=1, poisson=0).density == 2400.0


def test_free_cube_has_no_joints() -> None:
    assert "joints" not in cube().deck or cube().deck["joints"] == {}


# --- models as objects ---


@pytest.mark.parametrize(
    "copied", [copy.copy, copy.deepcopy, lambda a: pickle.loads(pickle.dumps(a))]
)
def test_copies_and_pickles_are_equal(copied: Any) -> None:
    named = ddem.Joint(
        normal_stiffness=1e9, shear_stiffness=2e9, fracture_energy=(1, 2), tension=1, name="n"
    )
    for one in (ROCK, SEAM, named, ddem.Material(density=1, young=2, poisson=0, name="ü")):
        assert copied(one) == one
        assert repr(copied(one)) == repr(one)
        assert copied(one) is not one
    model = full()
    again = copied(model)
    assert again.deck == model.deck
    again.fix("x", z=2.0)
    assert again.deck != model.deck, "a copy is a model of its own"


class Steady:
    """A history that pickle can find by the name of its class."""

    def __init__(self, factor: float) -> None:
        self.factor = factor

    def __call__(self, time: float) -> float:
        return self.factor


@pytest.mark.parametrize(
    "copied", [copy.copy, copy.deepcopy, lambda a: pickle.loads(pickle.dumps(a))]
)
def test_copies_of_models_have_functions_and_script_lines(copied: Any) -> None:
    model = column()
    model.load(force=(1e6, 0, 0), z=2.0)
    model.load(force=(1e6, 0, 0), z=2.0, history=math.sin)
    model.fix("x", velocity=(1e-3, 0, 0), z=2.0, history=Steady(2.0))
    simulation, again = model.build(), copied(model).build()
    simulation.step(20)
    again.step(20)
    assert same_state(simulation, again)
    with pytest.raises(ddem.ModelError, match=r"^load\[1\].history: is a Python function"):
        copied(model).to_deck()
    model.load(force=(1, 0, 0), x=77.0)
    with pytest.raises(ddem.ModelError) as caught:
        model.build()
    with pytest.raises(ddem.ModelError, match=re.escape(str(caught.value))):
        copied(model).build()


def test_deep_copies_of_models_have_functions_of_their_own() -> None:
    class Hammer:
        def __init__(self) -> None:
            self.model = column()
            self.model.load(pressure=1e5, z=2.0, history=self.factor)
            self.pushed = 1.0

        def factor(self, time: float) -> float:
            return self.pushed

    hammer = Hammer()
    other = copy.deepcopy(hammer)
    hammer.pushed = np.nan
    other.model.build().step(2)
    with pytest.raises(ddem.ModelError, match="not a finite number"):
        hammer.model.build().step(2)


def test_functions_without_a_name_cannot_be_pickled() -> None:
    model = column()
    model.load(force=(1, 0, 0), z=2.0, history=lambda time: time)
    assert copy.deepcopy(model).build().n_nodes == model.build().n_nodes
    with pytest.raises((AttributeError, pickle.PicklingError), match="lambda"):
        pickle.dumps(model)


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, pickle.dumps])
def test_simulations_cannot_be_copied(copied: Any) -> None:
    with pytest.raises(TypeError, match=r"save\(path\), and each ddem.load\(path\) makes a copy"):
        copied(cube().build())


def test_repr_evaluates_to_an_equal_object() -> None:
    for one in (ROCK, SEAM, ddem.Joint(thickness=1, material="a", fracture_energy=(1, 2))):
        assert eval(repr(one), {"Material": ddem.Material, "Joint": ddem.Joint}) == one
    assert repr(column(title="tower")) == '<Model "tower": 2 blocks, 54 nodes>'


def test_model_keeps_no_extra_references() -> None:
    class Held:
        def __call__(self, time: float) -> float:
            return 1.0

    held = Held()
    before = sys.getrefcount(held)
    model = column()
    model.load(force=(1, 0, 0), z=2.0, history=held)
    model.build()
    del model
    assert sys.getrefcount(held) == before

"""Materials and joints: their attributes, and their names in a deck."""

from __future__ import annotations

import json

import ddem
import pytest
from sample_models import ROCK, SEAM


def test_attributes_equal_deck_keys() -> None:
    assert (ROCK.name, ROCK.density, ROCK.young, ROCK.poisson) == (None, 2400.0, 18e9, 0.25)
    joint = ddem.Joint(thickness=1, material="rock", friction=30, name="it")
    assert (joint.name, joint.thickness, joint.material) == ("it", 1.0, "rock")
    assert SEAM.material is ROCK or SEAM.material == ROCK
    given = {"thickness": 1.0, "material": "rock", "friction": 30.0}
    for key in ddem.schema()["$defs"]["Joint"]["properties"]:
        assert getattr(joint, key) == given.get(key)
    with pytest.raises(AttributeError, match="'Joint' object has no attribute 'fiction' .did you mean `friction`"):
        joint.fiction
    with pytest.raises(AttributeError, match="'Material' object has no attribute 'thickness'"):
        ROCK.thickness
    with pytest.raises(AttributeError):
        ROCK.density = 3.0


def test_equal_materials_share_a_name() -> None:
    model = ddem.Model()
    for x in range(3):
        rock = ddem.Material(density=2400, young=18e9, poisson=0.25)
        seam = ddem.Joint(thickness=0.01, material=rock)
        model.add_blocks(
            origin=(3 * x, 0, 0), size=(2, 1, 1), count=(2, 1, 1), material=rock, joint=seam
        )
    deck = model.deck
    assert len(deck["materials"]) == len(deck["joints"]) == 1
    assert len({(b["material"], json.dumps(b["joint"])) for b in deck["blocks"]}) == 1
    other = ddem.Material(density=2400, young=18e9, poisson=0.26)
    model.add_blocks(origin=(9, 0, 0), size=(1, 1, 1), material=other)
    assert len(model.deck["materials"]) == 2


def test_materials_are_given_by_object_or_name() -> None:
    model = ddem.Model()
    rock = ddem.Material(density=2400, young=18e9, poisson=0.25, name="rock")
    seam = ddem.Joint(thickness=0.01, material="rock", name="seam")
    model.add_blocks(size=(2, 1, 1), count=(2, 1, 1), material=rock, joint=seam)
    model.add_blocks(
        origin=(9, 0, 0), size=(2, 1, 1), count=(2, 1, 1), material="rock", joint={"x": "seam"}
    )
    assert list(model.deck["materials"]) == ["rock"]
    assert model.deck["joints"] == {"seam": {"thickness": 0.01, "material": "rock"}}
    assert model.build().n_blocks == 4


def test_conflicting_names_are_refused() -> None:
    model = ddem.Model()
    rock = ddem.Material(density=2400, young=18e9, poisson=0.25, name="rock")
    model.add_blocks(size=(1, 1, 1), material=rock)
    other = ddem.Material(density=2500, young=18e9, poisson=0.25, name="rock")
    with pytest.raises(ddem.ModelError, match="another material named `rock`, with other values"):
        model.add_blocks(origin=(2, 0, 0), size=(1, 1, 1), material=other)
    assert len(model.deck["blocks"]) == 1, "a call that fails adds nothing"
    assert model.deck["materials"]["rock"]["density"] == 2400.0
    a = ddem.Joint(thickness=0.01, material=rock, name="a")
    b = ddem.Joint(thickness=0.02, material=rock, name="a")
    with pytest.raises(ddem.ModelError, match="another joint named `a`"):
        model.add_blocks(size=(2, 1, 1), count=(2, 1, 1), material=rock, joint={"x": a, "y": b})


def test_automatic_names_avoid_given_names() -> None:
    model = ddem.Model()
    first = ddem.Material(density=1, young=1, poisson=0, name="material-1")
    second = ddem.Material(density=2, young=1, poisson=0)
    model.add_blocks(size=(1, 1, 1), material=first)
    model.add_blocks(origin=(2, 0, 0), size=(1, 1, 1), material=second)
    blocks, materials = model.deck["blocks"], model.deck["materials"]
    assert [materials[block["material"]]["density"] for block in blocks] == [1.0, 2.0]


def test_materials_and_joints_compare_by_value() -> None:
    assert ddem.Material(density=2400, young=18e9, poisson=0.25) == ROCK
    assert ddem.Material(density=2400, young=18e9, poisson=0.25, name="a") != ROCK
    assert ddem.Material(density=2401, young=18e9, poisson=0.25) != ROCK
    assert ddem.Joint(thickness=0.01, material=ROCK) == SEAM
    assert ddem.Joint(thickness=0.02, material=ROCK) != SEAM
    assert ROCK != SEAM
    assert SEAM != "seam"

"""Models: what Python writes is a deck, and back."""

from __future__ import annotations

import ast
import copy
import inspect
import json
import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import ddem
import numpy as np
import pytest
from small import ROCK, SEAM, column, cube

STUB = Path(inspect.getfile(ddem)).with_name("_ddem.pyi")


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
        contact=False,
    )
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
    model.initial(velocity=(0, 0, 0.1), spin=(0, 0, 0.1), centre=(1, 1, 1), set="side")
    model.stage("settle", kind="relax", tolerance=1e-4, max_steps=5000, increments=2)
    model.stage("push", kind="dynamic", duration=1e-3, damping=0.05, time_step=1e-6, frames=3)
    model.stage("end", kind="dynamic", duration=1e-3, damping={"local": 0.1}, fields_every=1e-4)
    model.probe("top", at=(1, 1, 2), quantity="velocity", every=1e-4, every_steps=7)
    model.probe("foot", quantity="reaction", z=0.0)
    return model


def rounds(model: ddem.Model, folder: Path) -> None:
    """There and back by a text, a file and a dictionary."""
    path = folder / "deck.toml"
    text = model.to_deck(path)
    assert path.read_text() == text
    for again in (ddem.Model.from_deck(path), ddem.Model.from_deck(model.deck)):
        assert again.to_deck() == text
        assert again.deck == model.deck


def test_every_section_is_written_and_read_again(tmp_path: Path) -> None:
    model = full()
    rounds(model, tmp_path)
    sections = set(ddem.schema()["properties"])
    # These two are read but refused when built.
    assert sections - set(model.deck) == {"refine", "boundary"}
    assert model.build().n_blocks == 4 + 1


def test_sections_that_this_version_has_not_are_written_too(tmp_path: Path) -> None:
    model = column()
    model.refine(factor=2, set="all")
    model.boundary("viscous", z=2.0)
    assert model.deck["refine"] == [{"factor": 2, "where": {"set": "all"}}]
    assert model.deck["boundary"] == [{"kind": "viscous", "where": {"z": 2.0}}]
    with pytest.raises(ddem.ModelError, match=r"refine\[0\]: this version does not have"):
        model.build()


def test_what_a_deck_says_is_what_was_given() -> None:
    deck = full().deck
    assert deck["title"] == "everything"
    assert deck["model"] == {
        "gravity": [0.0, 0.0, -9.81],
        "kinematics": "small",
        "element": "incompatible",
        "contact": False,
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


def test_the_deck_is_a_copy() -> None:
    model = column()
    deck = model.deck
    deck["model"]["gravity"] = [1.0, 2.0, 3.0]
    deck["blocks"].clear()
    assert model.deck["model"]["gravity"] == [0.0, 0.0, -9.81]
    changed = model.deck
    changed["blocks"][0]["divisions"] = 1
    assert ddem.Model.from_deck(changed).build().n_nodes == 2 * 8
    json.dumps(deck)


def test_from_is_from_() -> None:
    model = column()
    model.stage("push", kind="relax")
    model.load(force=(1, 0, 0), z=2.0, from_="push", until="push")
    model.fix("x", z=2.0, from_="push")
    assert model.deck["load"][0]["from"] == "push"
    assert model.deck["load"][0]["until"] == "push"
    assert model.deck["fix"][1]["from"] == "push"


def test_where_may_be_written_as_in_the_deck() -> None:
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
        ({"local": 0.8}, {"local": 0.8}),
        ("none", "none"),
    ],
)
def test_damping_is_a_ratio_or_as_in_the_deck(given: Any, written: Any) -> None:
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
def test_histories_as_rows_and_dictionaries(given: Any, written: Any) -> None:
    model = column()
    model.load(force=(1, 0, 0), z=2.0, history=given)
    model.fix("x", velocity=(1, 0, 0), z=2.0, history=given)
    assert model.deck["load"][0]["history"] == written
    assert model.deck["fix"][1]["history"] == written


def test_a_function_is_no_part_of_a_deck(tmp_path: Path) -> None:
    model = column()
    model.load(force=(1, 0, 0), z=2.0)
    model.load(force=(1, 0, 0), z=2.0, history=lambda time: time)
    driven = column()
    driven.fix("x", velocity=(1, 0, 0), z=2.0, history=lambda time: time)
    for case, place in ((model, r"load\[1\].history"), (driven, r"fix\[1\].history")):
        for use in (
            case.to_deck,
            lambda case=case: case.deck,
            lambda case=case: pickle.dumps(case),
            lambda case=case: copy.copy(case),
            lambda case=case: ddem.run_deck(case, out=tmp_path / "out"),
        ):
            with pytest.raises(ddem.ModelError, match=f"^{place}: is a Python function"):
                use()
        case.build()
    with pytest.raises(ddem.ModelError, match="load"):
        model.to_deck(tmp_path / "deck.toml")
    assert list(tmp_path.iterdir()) == []


def test_only_loads_and_supports_have_functions() -> None:
    with pytest.raises(ddem.ModelError, match="^history: "):
        column().initial(velocity=(1, 0, 0), history=lambda time: time)


def test_numpy_numbers_and_arrays_are_numbers() -> None:
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


def test_a_long_double_is_a_number() -> None:
    assert ddem.Material(density=np.longdouble(2400), young=1, poisson=0).density == 2400.0


# --- materials and joints ---


def test_attributes_are_the_keys() -> None:
    assert (ROCK.name, ROCK.density, ROCK.young, ROCK.poisson) == (None, 2400.0, 18e9, 0.25)
    joint = ddem.Joint(thickness=1, material="rock", friction=30, name="it")
    assert (joint.name, joint.thickness, joint.material) == ("it", 1.0, "rock")
    assert SEAM.material is ROCK or SEAM.material == ROCK
    given = {"thickness": 1.0, "material": "rock", "friction": 30.0}
    for key in ddem.schema()["$defs"]["Joint"]["properties"]:
        assert getattr(joint, key) == given.get(key)
    with pytest.raises(AttributeError, match="'Joint' object has no attribute 'fiction'"):
        joint.fiction
    with pytest.raises(AttributeError, match="'Material' object has no attribute 'thickness'"):
        ROCK.thickness
    with pytest.raises(AttributeError):
        ROCK.density = 3.0


def test_equal_ones_share_a_name() -> None:
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


def test_by_object_and_by_name() -> None:
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


def test_given_names_are_not_taken_by_nameless_ones() -> None:
    model = ddem.Model()
    first = ddem.Material(density=1, young=1, poisson=0, name="material-1")
    second = ddem.Material(density=2, young=1, poisson=0)
    model.add_blocks(size=(1, 1, 1), material=first)
    model.add_blocks(origin=(2, 0, 0), size=(1, 1, 1), material=second)
    blocks, materials = model.deck["blocks"], model.deck["materials"]
    assert [materials[block["material"]]["density"] for block in blocks] == [1.0, 2.0]


def test_equality() -> None:
    assert ddem.Material(density=2400, young=18e9, poisson=0.25) == ROCK
    assert ddem.Material(density=2400, young=18e9, poisson=0.25, name="a") != ROCK
    assert ddem.Material(density=2401, young=18e9, poisson=0.25) != ROCK
    assert ddem.Joint(thickness=0.01, material=ROCK) == SEAM
    assert ddem.Joint(thickness=0.02, material=ROCK) != SEAM
    assert ROCK != SEAM
    assert SEAM != "seam"


@pytest.mark.parametrize(
    "copied", [copy.copy, copy.deepcopy, lambda a: pickle.loads(pickle.dumps(a))]
)
def test_pickle_and_copy(copied: Any) -> None:
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


def test_what_repr_says_makes_the_same() -> None:
    for one in (ROCK, SEAM, ddem.Joint(thickness=1, material="a", fracture_energy=(1, 2))):
        assert eval(repr(one), {"Material": ddem.Material, "Joint": ddem.Joint}) == one
    assert repr(column(title="tower")) == '<Model "tower": 2 blocks, 54 nodes>'


def test_a_model_holds_on_to_nothing_it_was_not_given() -> None:
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


def test_threads_share_a_model() -> None:
    # The interpreter must not be waited for with the model locked.
    script = """
import sys, threading, ddem
sys.setswitchinterval(1e-6)
model = ddem.Model()
rock = ddem.Material(density=1, young=1, poisson=0)
model.add_blocks(size=(1, 1, 1), divisions=1, material=rock)
def look():
    for _ in range(100):
        model.deck, repr(model), model.to_deck()
def write():
    for _ in range(100):
        model.fix("x", z=0.0)
threads = [threading.Thread(target=f) for f in (look, write, look)]
for thread in threads: thread.start()
for thread in threads: thread.join()
print(len(model.deck["fix"]))
"""
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=10
    )
    assert done.stdout.strip() == "100", done.stderr


# --- the stub ---


def stub_class(name: str) -> ast.ClassDef:
    """A class of the stub, or of the types beside it."""
    trees = [ast.parse(path.read_text()) for path in (STUB, STUB.with_name("_types.py"))]
    nodes = [node for tree in trees for node in tree.body]
    found = [node for node in nodes if isinstance(node, ast.ClassDef) and node.name == name]
    assert found, f"the stub has no class {name}"
    return found[0]


def typed_dict(name: str) -> set[str]:
    """Keys of one of the stub's dictionaries, with those of the one it extends."""
    node = stub_class(name)
    keys = {n.target.id for n in node.body if isinstance(n, ast.AnnAssign)}
    for base in node.bases:
        if isinstance(base, ast.Name) and base.id != "TypedDict":
            keys |= typed_dict(base.id)
    return keys


def keywords(name: str, method: str) -> set[str]:
    """Names of the arguments that the stub gives a method."""
    functions = [n for n in stub_class(name).body if isinstance(n, ast.FunctionDef)]
    found = [f for f in functions if f.name == method]
    assert found, f"the stub has no {name}.{method}"
    arguments = found[0].args
    names = {a.arg for a in [*arguments.args, *arguments.kwonlyargs]} - {"self", "cls"}
    if arguments.kwarg is not None:
        unpacked = arguments.kwarg.annotation
        assert isinstance(unpacked, ast.Subscript)
        names |= typed_dict(ast.unparse(unpacked.slice))
    return names


def keys_of(definition: str) -> set[str]:
    """Keys of a table of the deck as Python writes them."""
    keys = set(ddem.schema()["$defs"][definition]["properties"])
    if "where" in keys:
        where = set(ddem.schema()["$defs"]["Where"]["properties"])
        keys = keys - {"where"} | where
    return {"from_" if key == "from" else key for key in keys}


@pytest.mark.parametrize(
    ("place", "definition", "besides"),
    [
        ("Material.__new__", "Material", {"name"}),
        ("Joint.__new__", "Joint", {"name"}),
        ("Model.__new__", "ModelTable", {"title"}),
        ("Model.add_blocks", "BlockSet", set()),
        ("Model.refine", "Refine", set()),
        ("Model.fix", "Fix", set()),
        ("Model.load", "Load", set()),
        ("Model.boundary", "Boundary", set()),
        ("Model.initial", "Initial", set()),
        ("Model.stage", "Stage", set()),
        ("Model.probe", "Probe", set()),
        ("Model.assign", "Assign", set()),
        ("Model.remove", "Remove", set()),
        ("Simulation.nodes", "Where", set()),
    ],
)
def test_the_stub_names_every_key(place: str, definition: str, besides: set[str]) -> None:
    assert keywords(*place.split(".")) == keys_of(definition) | besides


def test_every_section_of_the_deck_has_a_method() -> None:
    made_by = {
        "title": "__new__",
        "model": "__new__",
        "materials": "add_blocks",
        "joints": "add_blocks",
        "blocks": "add_blocks",
    }
    for section in ddem.schema()["properties"]:
        assert keywords("Model", made_by.get(section, section))


def test_the_stub_has_the_keys_of_relax_and_run() -> None:
    stage = keys_of("Stage") - {"name", "kind"}
    relax = keywords("Simulation", "relax") - {"name", "record", "quiet"}
    run = keywords("Simulation", "run") - {"name", "record", "quiet"}
    assert relax | run == stage
    assert relax & run == set()
    assert keywords("Simulation", "start") <= run


def test_the_stub_has_what_schema_calls_words() -> None:
    text = STUB.read_text()
    for definition in (
        "Kinematics",
        "ElementKind",
        "Body",
        "StageKind",
        "Quantity",
        "BoundaryKind",
    ):
        schema = ddem.schema()["$defs"][definition]
        words = schema.get("enum") or [one["const"] for one in schema["oneOf"]]
        for word in words:
            assert f'"{word}"' in text, f"{definition} {word} is not in the stub"


@pytest.mark.parametrize("name", ["Material", "Joint", "Model", "Simulation"])
def test_the_stub_has_what_is_there(name: str) -> None:
    there = {n for n in dir(getattr(ddem, name)) if not n.startswith("_")}
    if name in ("Material", "Joint"):
        there |= set(ddem.schema()["$defs"][name]["properties"])
    body = stub_class(name).body
    written = {n.name for n in body if isinstance(n, ast.FunctionDef)}
    written |= {n.target.id for n in body if isinstance(n, ast.AnnAssign)}
    assert {n for n in written if not n.startswith("_")} == there


def test_the_schema_is_a_dictionary_of_its_own() -> None:
    schema = ddem.schema()
    schema.clear()
    assert ddem.schema()["$defs"]


def test_a_free_cube_has_no_joints() -> None:
    assert "joints" not in cube().deck or cube().deck["joints"] == {}

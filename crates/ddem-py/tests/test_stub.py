"""The stub contains all keys, words and names."""

from __future__ import annotations

import ast
import inspect
from pathlib import Path

import ddem
import pytest
from sample_models import cube

STUB = Path(inspect.getfile(ddem)).with_name("_ddem.pyi")


def stub_class(name: str) -> ast.ClassDef:
    """A class of the stub, or of the types module beside it."""
    trees = [ast.parse(path.read_text()) for path in (STUB, STUB.with_name("_types.py"))]
    nodes = [node for tree in trees for node in tree.body]
    found = [node for node in nodes if isinstance(node, ast.ClassDef) and node.name == name]
    assert found, f"the stub has no class {name}"
    return found[0]


def typed_dict(name: str) -> set[str]:
    """Keys of one of the stub's dictionaries, including inherited ones."""
    node = stub_class(name)
    keys = {n.target.id for n in node.body if isinstance(n, ast.AnnAssign)}
    for base in node.bases:
        if isinstance(base, ast.Name) and base.id != "TypedDict":
            keys |= typed_dict(base.id)
    return keys


def keywords(name: str, method: str) -> set[str]:
    """Names of the arguments of a method in the stub."""
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
    """Keys of a table of the deck in Python notation."""
    keys = set(ddem.schema()["$defs"][definition]["properties"])
    if "where" in keys:
        where = set(ddem.schema()["$defs"]["Where"]["properties"])
        # Keys that select cells; `plane` and `set` of a cut are its shapes.
        where = typed_dict("Place") if definition == "RockCut" else where
        keys = keys - {"where"} | where
    return {"from_" if key == "from" else key for key in keys}


@pytest.mark.parametrize(
    ("place", "definition", "besides"),
    [
        ("Material.__new__", "Material", {"name"}),
        ("Joint.__new__", "Joint", {"name"}),
        ("Model.__new__", "ModelTable", {"title"}),
        ("Model.contact", "ContactTable", set()),
        ("Model.add_blocks", "BlockSet", set()),
        ("Model.add_region", "RockRegion", set()),
        ("Model.cut", "RockCut", set()),
        ("Model.join", "Join", set()),
        ("Model.refine", "Refine", set()),
        ("Model.fix", "Fix", set()),
        ("Model.load", "Load", set()),
        ("Model.boundary", "Boundary", set()),
        ("Model.charge", "Charge", set()),
        ("Model.initial", "Initial", set()),
        ("Model.stage", "Stage", set()),
        ("Model.probe", "Probe", set()),
        ("Model.assign", "Assign", set()),
        ("Model.remove", "Remove", set()),
        ("Simulation.nodes", "Where", set()),
    ],
)
def test_stub_lists_every_key(place: str, definition: str, besides: set[str]) -> None:
    assert keywords(*place.split(".")) == keys_of(definition) | besides


def test_every_deck_section_has_a_method() -> None:
    made_by = {
        "title": "__new__",
        "model": "__new__",
        "materials": "add_blocks",
        "joints": "add_blocks",
        "blocks": "add_blocks",
        "region": "add_region",
    }
    for section in ddem.schema()["properties"]:
        assert keywords("Model", made_by.get(section, section))


def test_stub_has_keys_of_relax_and_run() -> None:
    stage = keys_of("Stage") - {"name", "kind", "bracket", "resolution", "joints", "limit"}
    relax = keywords("Simulation", "relax") - {"name", "record", "quiet"}
    run = keywords("Simulation", "run") - {"name", "record", "quiet"}
    run -= {"until", "every", "callback"}
    assert relax | run == stage
    assert relax & run == {"on_failure"}
    assert keywords("Simulation", "start") <= run


@pytest.mark.parametrize("method", ["relax", "run", "start"])
def test_methods_accept_the_keys_of_the_stub(method: str) -> None:
    simulation = cube().build()
    required = {"run": {"duration": 1e-4}}.get(method, {})
    own = {"record", "name", "quiet", "until", "every", "callback"}
    for key in keywords("Simulation", method) - own:
        with pytest.raises(ddem.ModelError) as caught:
            getattr(simulation, method)(**{**required, key: object()})
        assert caught.value.code != "unknown-key", key


def test_stub_lists_the_words_of_the_schema() -> None:
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
def test_stub_lists_every_attribute(name: str) -> None:
    there = {n for n in dir(getattr(ddem, name)) if not n.startswith("_")}
    if name in ("Material", "Joint"):
        there |= set(ddem.schema()["$defs"][name]["properties"])
    body = stub_class(name).body
    written = {n.name for n in body if isinstance(n, ast.FunctionDef)}
    written |= {n.target.id for n in body if isinstance(n, ast.AnnAssign)}
    assert {n for n in written if not n.startswith("_")} == there


def test_schema_returns_a_new_dictionary() -> None:
    schema = ddem.schema()
    schema.clear()
    assert ddem.schema()["$defs"]

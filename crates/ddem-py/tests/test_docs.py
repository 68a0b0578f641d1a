"""Documentation of the module: its examples run, and every public name is documented."""

from __future__ import annotations

import ast
import doctest
import inspect
import re
from pathlib import Path
from typing import Any

import ddem
import pytest
from sample_models import REPOSITORY, breaking, wedge

FOLDER = Path(inspect.getfile(ddem)).parent


def examples() -> list[doctest.DocTest]:
    """Examples of the module, its functions and its classes."""
    finder = doctest.DocTestFinder(exclude_empty=True)
    found = {test.name: test for test in finder.find(ddem, "ddem", extraglobs={"ddem": ddem})}
    for name in ddem.__all__:
        item = getattr(ddem, name)
        # Compiled items do not record their module, so all of them are examined.
        items = {f"ddem.{name}": item}
        if inspect.isclass(item):
            members = [member for member in dir(item) if not member.startswith("_")]
            items |= {f"ddem.{name}.{member}": getattr(item, member) for member in members}
        parser = doctest.DocTestParser()
        for place, one in items.items():
            text = inspect.getdoc(one) or ""
            test = parser.get_doctest(text, {"ddem": ddem}, place, None, 0)
            if test.examples:
                found.setdefault(place, test)
    return list(found.values())


class Checker(doctest.OutputChecker):
    """Compares no output if an example shows none, for example for a picture."""

    def check_output(self, want: str, got: str, optionflags: int) -> bool:
        return not want or super().check_output(want, got, optionflags)


@pytest.mark.parametrize("test", examples(), ids=lambda test: test.name)
def test_docstring_examples_run(test: doctest.DocTest, tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.chdir(tmp_path)
    if any(word in test.name for word in ("plot", "probes", "fragments", "Results", "animate")):
        if any(word in test.name for word in ("plot", "Results", "animate")):
            pytest.importorskip("pyvista")
            pytest.importorskip("matplotlib")
        test.globs["sim"] = recorded(Path("results/beam-crack"))
        test.globs.setdefault("model", wedge())
    report: list[str] = []
    flags = doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS
    runner = doctest.DocTestRunner(checker=Checker(), optionflags=flags)
    failed = runner.run(test, out=report.append).failed
    assert failed == 0, "".join(report)


def recorded(folder: Path) -> ddem.Simulation:
    """The simulation and results that examples of pictures and probes call `sim` and
    `results/beam-crack`.
    """
    model = breaking()
    model.probe("line", quantity="reaction", z=0.0)
    simulation = model.build()
    simulation.run(2e-3, record=folder, quiet=True)
    return simulation


def test_main_classes_have_examples() -> None:
    names = {test.name for test in examples() if test.examples}
    assert {"ddem", "ddem.Material", "ddem.Joint", "ddem.Model"} <= names


def attributes() -> list[tuple[str, str]]:
    classes = [name for name in ddem.__all__ if inspect.isclass(getattr(ddem, name))]
    return [
        (name, attribute)
        for name in classes
        for attribute in vars(getattr(ddem, name))
        if not attribute.startswith("_")
    ]


@pytest.mark.parametrize("name", [name for name in ddem.__all__ if name != "__version__"])
def test_every_name_has_a_docstring(name: str) -> None:
    text = getattr(ddem, name).__doc__
    assert text and text.strip()


@pytest.mark.parametrize(("name", "attribute"), attributes())
def test_every_attribute_has_a_docstring(name: str, attribute: str) -> None:
    text = inspect.getdoc(getattr(getattr(ddem, name), attribute)) or ""
    assert text.strip(), f"{name}.{attribute} has no documentation"
    first = text.strip().splitlines()[0]
    assert first[0].isupper() and ":param" not in text


@pytest.mark.parametrize("name", ["Model", "Simulation"])
def test_every_argument_is_documented(name: str) -> None:
    for attribute, item in vars(getattr(ddem, name)).items():
        if attribute.startswith("_") or not callable(item):
            continue
        item = getattr(getattr(ddem, name), attribute)
        given = [
            argument
            for argument in inspect.signature(item).parameters.values()
            if argument.name != "self" and argument.kind is not argument.VAR_KEYWORD
        ]
        text = inspect.getdoc(item) or ""
        for argument in given:
            assert argument.name in text, f"{name}.{attribute}: {argument.name}"


def test_all_lists_public_names() -> None:
    assert sorted(ddem.__all__, key=str.lower) == sorted(set(ddem.__all__), key=str.lower)
    public = {name for name in vars(ddem) if not name.startswith("_")}
    modules = {name for name in public if inspect.ismodule(getattr(ddem, name))}
    assert public - modules == set(ddem.__all__) - {"__version__"}
    assert all(getattr(ddem, name) is not None for name in ddem.__all__)
    assert (FOLDER / "py.typed").is_file()


def test_public_names_belong_to_module_ddem() -> None:
    for name in ("Material", "Joint", "Model", "Simulation"):
        assert getattr(ddem, name).__module__ == "ddem"
        assert getattr(ddem, name).__qualname__ == name


def arguments(function: ast.FunctionDef) -> dict[str, ast.expr | None]:
    """Arguments of a function, with their defaults."""
    given = function.args
    plain = [*given.posonlyargs, *given.args]
    none = [None] * (len(plain) - len(given.defaults))
    pairs = [*zip(plain, [*none, *given.defaults]), *zip(given.kwonlyargs, given.kw_defaults)]
    return {name.arg: default for name, default in pairs if name.arg not in ("self", "cls")}


def signatures() -> dict[str, dict[str, ast.expr | None]]:
    """Arguments of the compiled functions, from the stub, and of the others, from their source."""
    found = {}
    for node in ast.parse((FOLDER / "_ddem.pyi").read_text(encoding="utf-8")).body:
        if isinstance(node, ast.FunctionDef):
            found[f"ddem.{node.name}"] = arguments(node)
        if isinstance(node, ast.ClassDef) and node.name in ("Model", "Simulation"):
            for method in node.body:
                if isinstance(method, ast.FunctionDef) and "property" not in map(
                    ast.unparse, method.decorator_list
                ):
                    made = method.name == "__new__"
                    found[node.name if made else method.name] = arguments(method)
    for name in ddem.__all__:
        if inspect.isfunction(getattr(ddem, name)):
            node = ast.parse(inspect.getsource(getattr(ddem, name))).body[0]
            assert isinstance(node, ast.FunctionDef)
            found[f"ddem.{name}"] = arguments(node)
    for node in ast.walk(ast.parse(inspect.getsource(ddem.Results)).body[0]):
        if isinstance(node, ast.FunctionDef):
            made = node.name == "__init__"
            found.setdefault("ddem.Results" if made else node.name, arguments(node))
    return found


def calls() -> list[tuple[str, str]]:
    """Functions in the tables of the page, with their arguments."""
    page = (REPOSITORY / "docs" / "python.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `([\w.]+)\((.*)\)` \|", page, flags=re.MULTILINE)
    return [(name.removeprefix("Model."), arguments) for name, arguments in rows]


def keys_of_decks() -> set[str]:
    """Keys of all tables of a deck."""
    tables = ddem.schema()["$defs"].values()
    return {key for table in tables for key in table.get("properties", ())} | {"title"}


@pytest.mark.parametrize(("name", "written"), calls())
def test_python_page_matches_signatures(name: str, written: str) -> None:
    known = signatures()[name]
    words = [word for word in written.split(", ") if word not in ("", "*")]
    others = {"...", "where...", "from_", "until"} - set(known)
    named = [word for word in words if word not in others]
    for argument, equal, default in (word.partition("=") for word in named):
        assert argument in known, argument
        value = known[argument]
        # Keys of a deck have their defaults in docs/deck.md.
        assert equal or value is None or argument in keys_of_decks(), f"{argument} has a default"
        if equal:
            assert value is not None, argument
            assert ast.literal_eval(value) == ast.literal_eval(default), argument
    if "..." not in words:
        assert {word.partition("=")[0] for word in named} == set(known)


def test_python_page_lists_functions_with_stage_keys() -> None:
    names = [name for name, _ in calls()]
    assert {"relax", "run", "start", "stage", "ddem.factor_of_safety"} <= set(names)
    assert len(names) > 30


def test_python_page_lists_every_name() -> None:
    page = (REPOSITORY / "docs" / "python.md").read_text(encoding="utf-8")
    names = [name for name in ddem.__all__ if not name.startswith("__")]
    for holder in (ddem.Model, ddem.Simulation):
        names += [name for name in dir(holder) if not name.startswith("_")]
    message = set(re.findall(r"`[^`]*`", page))
    words = {word for code in message for word in re.findall(r"\w+", code)}
    assert [name for name in names if name not in words] == []


def test_class_names_are_unique() -> None:
    known: dict[str, Path] = {}
    folders = ("crates/ddem-py", "docs", "examples", "benches", "tests")
    paths = [path for folder in folders for path in (REPOSITORY / folder).rglob("*.py")]
    assert len(paths) > 40
    for path in paths:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ClassDef):
                assert node.name not in known, f"{node.name}: {path} and {known[node.name]}"
                known[node.name] = path

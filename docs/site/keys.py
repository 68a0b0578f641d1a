"""Pages on the keys of decks, made of the JSON Schema: one for each table, with an anchor for each key."""

from __future__ import annotations

import json
import os
import re
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

# Tables that a deck has more than once, and those with names.
MANY = "[[{}]]"
NAMED = "[{}.NAME]"


def schema():
    """The schema as the program prints it: $DDEM_CLI, or the program that was built last."""
    built = [ROOT / "target" / profile / "ddem" for profile in ("release", "debug")]
    built = sorted((path for path in built if path.exists()), key=lambda path: path.stat().st_mtime)
    program = os.environ.get("DDEM_CLI") or (built and str(built[-1]))
    if not program:
        raise SystemExit("the pages on keys need the program: `cargo build --package ddem-cli`, or set DDEM_CLI")
    done = subprocess.run([program, "schema"], capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def pages():
    """Text of each page, by its name."""
    whole = schema()
    tables = whole["$defs"]
    names = {name: slug(name) for name in tables}
    texts = {"reference/index.md": index(whole, names)}
    for name, table in tables.items():
        texts[f"reference/{names[name]}"] = page(name, table, whole, names)
    return texts


def slug(name):
    """Name of the page of a table, `block-set.md` for `BlockSet`."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "-", name).lower() + ".md"


def places(whole):
    """Places in a deck of the tables at its top, by their names in the schema."""
    found = {}
    for key, value in whole["properties"].items():
        if "items" in value and "$ref" in value["items"]:
            found.setdefault(reference(value["items"]), MANY.format(key))
        elif isinstance(value.get("additionalProperties"), dict):
            found.setdefault(reference(value["additionalProperties"]), NAMED.format(key))
        elif "$ref" in value:
            found.setdefault(reference(value), f"[{key}]")
    return found


def reference(value):
    return value["$ref"].rsplit("/", 1)[1]


def index(whole, names):
    lines = [
        "# Keys of the deck",
        "",
        "A page for each table, made of `ddem schema`. [The deck](../deck.md) explains how they work together.",
        "",
        "| Table | |",
        "|---|---|",
        "| `title` | Title of the results |",
    ]
    tops = places(whole)
    for name, place in tops.items():
        lines.append(f"| [`{place}`]({names[name]}) | {cell(whole['$defs'][name])} |")
    lines += ["", "Forms of values, and tables within tables:", "", "| Form | |", "|---|---|"]
    for name, table in whole["$defs"].items():
        # Codes of warnings have a page of their own.
        if name not in tops and name != "Code":
            lines.append(f"| [{title(name)}]({names[name]}) | {cell(table)} |")
    return "\n".join(lines) + "\n"


def title(name):
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", " ", name).capitalize()


def cell(table):
    return " ".join(table.get("description", "").split()).replace("|", "\\|")


def page(name, table, whole, names):
    heading = places(whole).get(name)
    lines = [f"# `{heading}`" if heading else f"# {title(name)}", "", cell(table), ""]
    used = users(name, whole)
    if used:
        lines += ["Used by " + ", ".join(link(user, key, whole, names) for user, key in used) + ".", ""]
    for key, value in table.get("properties", {}).items():
        needed = key in table.get("required", [])
        lines += [f"## `{key}` {{#{key}}}", "", cell(value), ""]
        lines += [f"**Form:** {kind(value, names)}" + (", required" if needed else ""), ""]
    for form in table.get("oneOf", table.get("anyOf", [])):
        lines += [f"- {kind(form, names)}" + (f": {cell(form)}" if cell(form) else "")]
    return "\n".join(lines) + "\n"


def users(name, whole):
    """Tables and keys whose values have a form."""
    found = []
    for table, body in {"": whole, **whole["$defs"]}.items():
        for key, value in body.get("properties", {}).items():
            if table and f'"#/$defs/{name}"' in json.dumps(value):
                found.append((table, key))
    return found


def link(table, key, whole, names):
    where = places(whole).get(table)
    where = f"`{where}`" if where else title(table)
    return f"[`{key}` of {where}]({names[table]}#{key})"


def kind(value, names):
    """Form of a value in words."""
    if "$ref" in value:
        name = reference(value)
        return f"[{title(name).lower()}]({names[name]})"
    if "const" in value:
        return f"`{json.dumps(value['const'])}`"
    if "enum" in value:
        return ", ".join(f"`{json.dumps(one)}`" for one in value["enum"])
    for choice in ("anyOf", "oneOf"):
        if choice in value:
            given = [one for one in value[choice] if one.get("type") != "null"]
            return " or ".join(kind(one, names) for one in given)
    if "properties" in value:
        return ", ".join(f"`{{ {key} = … }}` ({kind(one, names)})" for key, one in value["properties"].items())
    types = value.get("type", "any")
    types = [one for one in ([types] if isinstance(types, str) else types) if one != "null"]
    words = {"number": "number", "integer": "whole number", "string": "text", "boolean": "`true` or `false`"}
    if "array" in types:
        least, most = value.get("minItems"), value.get("maxItems")
        count = f"{least} × " if least and least == most else "list of "
        return count + kind(value.get("items", {}), names)
    if "object" in types:
        inner = value.get("additionalProperties")
        return f"table of {kind(inner, names)}" if isinstance(inner, dict) else "table"
    return " or ".join(words.get(one, one) for one in types)

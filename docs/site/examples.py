"""Gallery and a page for each example, made of docs/site/examples.toml."""

from __future__ import annotations

import re
from pathlib import Path

try:
    import tomllib
except ModuleNotFoundError:  # before Python 3.11
    import tomli as tomllib

from pictures import place

ROOT = Path(__file__).resolve().parents[2]
TABLE = ROOT / "docs" / "site" / "examples.toml"
LANGUAGES = {".toml": "toml", ".py": "python", ".rs": "rust"}


def rows():
    """The examples, in the order of the table. It must have every file of examples/."""
    found = tomllib.loads(TABLE.read_text(encoding="utf-8"))["example"]
    listed = {row["file"] for row in found}
    there = {path.name for path in (ROOT / "examples").iterdir() if path.is_file()}
    if listed != there:
        raise SystemExit(f"docs/site/examples.toml and examples/ differ: {sorted(listed ^ there)}")
    return found


def page(path):
    """Page of an example by its path in the repository, if it has one."""
    match = re.fullmatch(r"examples/([^/]+)\.(toml|py|rs)", path)
    return f"examples/{match[1]}-{match[2]}.md" if match else None


def pages():
    """Text of the gallery and of the page of each example, by its name."""
    found = rows()
    texts = {"gallery.md": gallery(found)}
    for row in found:
        if name := page(f"examples/{row['file']}"):
            texts[name] = text(row)
    return texts


def gallery(found):
    lines = [
        "# Gallery",
        "",
        "Every example of the repository, with its command and its time on two cores.",
        "",
        '<div class="gallery" markdown>',
    ]
    for row in found:
        target = page(f"examples/{row['file']}")
        name = f"[{row['file']}]({target})" if target else f"`{row['file']}`"
        lines += ["", '<div markdown>', ""]
        if "picture" in row:
            lines += [f"![{row['shows']}](pictures/{place(row['picture'])})", ""]
        lines += [f"**{name}**, {row['time']}", "", sentence(row), "", f"`{row['command']}`", "", "</div>"]
    return "\n".join([*lines, "", "</div>", ""])


def sentence(row):
    """What an example shows, as a sentence."""
    shows = row["shows"]
    return shows[0].upper() + shows[1:] + ("" if shows.endswith("?") else ".")


def text(row):
    file = ROOT / "examples" / row["file"]
    lines = [f"# {row['file']}", "", sentence(row), "", "```", row["command"], "```", ""]
    lines += [f"Time on two cores: {row['time']}.", ""]
    if "picture" in row:
        lines += [f"![{row['shows']}](../pictures/{place(row['picture'])})", ""]
    fence = "````"
    lines += [f"{fence}{LANGUAGES[file.suffix]}", file.read_text(encoding="utf-8").rstrip("\n"), fence, ""]
    return "\n".join(lines)

"""The table of the examples is complete, and the gallery of README.md agrees with it."""

import re
from pathlib import Path

import pytest

tomllib = pytest.importorskip("tomllib")

ROOT = Path(__file__).resolve().parents[3]
ROW = re.compile(r"^\| !\[\]\(docs/pictures/([^)]+)\) \| \[[^]]+\]\(examples/([^)]+)\) \| ([^|]+) \| ([^|]+) \|$", re.M)


def examples():
    text = (ROOT / "docs" / "site" / "examples.toml").read_text(encoding="utf-8")
    return {row["file"]: row for row in tomllib.loads(text)["example"]}


def test_every_example_is_in_the_table():
    there = {path.name for path in (ROOT / "examples").iterdir() if path.is_file()}
    assert set(examples()) == there
    for file, row in examples().items():
        assert set(row) - {"picture"} == {"file", "shows", "command", "time"}, file
        if "picture" in row:
            assert (ROOT / "docs" / "pictures" / row["picture"]).exists(), file


def test_gallery_of_the_readme_agrees_with_the_table():
    table = examples()
    rows = ROW.findall((ROOT / "README.md").read_text(encoding="utf-8"))
    assert len(rows) > 8
    for picture, file, time, shows in rows:
        assert (table[file]["picture"], table[file]["time"]) == (picture, time), file
        # The README adds further pictures after a semicolon.
        assert shows.split(";")[0].replace("*", "") == table[file]["shows"], file

"""The tutorial runs as a reader runs it: files, changes, commands and Python, with the output that it shows."""

from __future__ import annotations

import contextlib
import io
import os
import re
import subprocess
import warnings
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
PAGES = [ROOT / "docs" / "install.md", *sorted((ROOT / "docs" / "tutorial").glob("[0-9]*.md"))]
BLOCK = re.compile(r'^```(\w*)(?: title="([^"]+)")?\n(.*?)^```$', re.M | re.S)


def program() -> Path:
    """The command line: $DDEM_CLI, or the one that was built last."""
    if given := os.environ.get("DDEM_CLI"):
        return Path(given)
    built = [ROOT / "target" / profile / "ddem" for profile in ("release", "debug")]
    built = sorted((path for path in built if path.exists()), key=lambda path: path.stat().st_mtime)
    if not built:
        pytest.skip("the command line is not built")
    return built[-1]


def line_matches(shown: str, printed: str) -> bool:
    """True if a line is as shown; `...` in it stands for any text."""
    return re.fullmatch(".*".join(map(re.escape, shown.split("..."))), printed) is not None


def compare(shown: str, printed: str) -> None:
    """Compares an output with the one shown, in which a line `...` stands for any lines."""
    lines, at, free = printed.splitlines(), 0, False
    for expected in shown.splitlines():
        if expected == "...":
            free = True
            continue
        found = next(
            (n for n in range(at, len(lines)) if line_matches(expected, lines[n])), len(lines)
        )
        assert found < len(lines) and (free or found == at), f"{expected}\n--\n{printed}"
        at, free = found + 1, False
    assert free or at == len(lines), f"more is printed:\n{printed}"


def test_comparison_can_fail() -> None:
    compare("a\n...\nd 1 ... 3", "a\nb\nc\nd 1 2 3")
    for shown in ("a", "a\nc\n...", "...\nd 2 ...", "b\n..."):
        with pytest.raises(AssertionError):
            compare(shown, "a\nb\nc\nd 1 2 3")


def change(file: Path, lines: str) -> None:
    """Replaces the lines of a file that begin with `-` by those that begin with `+`."""
    old = "".join(line[1:] + "\n" for line in lines.splitlines() if line.startswith("-"))
    new = "".join(line[1:] + "\n" for line in lines.splitlines() if line.startswith("+"))
    text = file.read_text(encoding="utf-8")
    assert text.count(old) == 1, old
    file.write_text(text.replace(old, new), encoding="utf-8")


def run(commands: str, folder: Path) -> None:
    """Runs the commands after each `$` and compares what they print."""
    path = f"{program().parent}{os.pathsep}{os.environ['PATH']}"
    for part in re.split(r"^\$ ", commands, flags=re.M)[1:]:
        command, _, shown = part.partition("\n")
        done = subprocess.run(
            command, shell=True, cwd=folder, env={**os.environ, "PATH": path}, text=True,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=300,
        )  # fmt: skip
        assert done.returncode == 0, done.stdout
        compare(shown, done.stdout)


def test_tutorial_prints_what_it_shows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert len(PAGES) == 7
    for page in PAGES:
        names: dict[str, object] = {}
        printed = None
        for kind, title, text in BLOCK.findall(page.read_text(encoding="utf-8")):
            if kind == "toml" and title:
                (tmp_path / title).write_text(text, encoding="utf-8")
            elif kind == "diff":
                change(tmp_path / title, text)
            elif kind == "console":
                run(text, tmp_path)
            elif kind == "python":
                out = io.StringIO()
                # A reader who follows the page sees no warning.
                with contextlib.redirect_stdout(out), warnings.catch_warnings():
                    warnings.simplefilter("error")
                    exec(compile(text, str(page), "exec"), names)
                printed = out.getvalue()
            elif kind == "text":
                assert printed is not None, text
                compare(text, printed)


def test_first_deck_is_the_example() -> None:
    page = (ROOT / "docs" / "tutorial" / "1-block.md").read_text(encoding="utf-8")
    deck = (ROOT / "examples" / "block.toml").read_text(encoding="utf-8")
    assert f'```toml title="block.toml"\n{deck}```' in page


# What the pieces of the page on sites leave out.
SITE = """
[materials.rock]
density = 2600
young = 20e9
poisson = 0.25

[joints]
J1 = { normal_stiffness = 1e10, shear_stiffness = 5e9, friction = 35.0 }
fault = { normal_stiffness = 1e9, shear_stiffness = 5e8, friction = 25.0 }
minor = { normal_stiffness = 1e10, shear_stiffness = 5e9, friction = 30.0 }

[[region]]
box = { from = [8, 0, -8], to = [16, 8, 0] }
material = "rock"
"""


def test_pieces_of_a_site_make_a_deck(tmp_path: Path) -> None:
    page = (ROOT / "docs" / "your-site.md").read_text(encoding="utf-8")
    pieces = [text for kind, _, text in BLOCK.findall(page) if kind == "toml"]
    assert len(pieces) == 4
    (tmp_path / "site.toml").write_text(SITE + "\n".join(pieces), encoding="utf-8")
    command = [program(), "cut", "site.toml"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    for name in ("J1", "F1", "network"):
        assert name in (tmp_path / "results" / "site-cut" / "blocks.csv").read_text(), name

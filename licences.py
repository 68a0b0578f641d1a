#!/usr/bin/env python3
"""Names and texts of the licences of all code that is built into a package of the workspace besides its own.

    python3 licences.py PACKAGE FILE [NAME=TEXT ...]

writes FILE: crates for x86-64 Linux, C libraries that they bring, the Rust standard library, and each NAME with the file
TEXT. It fails if one of them has no text. release.sh runs it.
"""

import json
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

ROOT = Path(__file__).resolve().parent
TARGET = "x86_64-unknown-linux-gnu"
NAMES = re.compile(r"licen[cs]e|unlicense|copying|copyright|notice", re.I)
# Crates that build a C library, with its name and the places of its texts.
BUNDLED = {
    "hdf5-metno-src": ("HDF5", ["ext/hdf5/COPYING", "ext/hdf5/COPYING_LBNL_HDF5"]),
    "libmimalloc-sys": ("mimalloc", ["c_src/mimalloc/v2/LICENSE", "c_src/mimalloc/v3/LICENSE"]),
    "libz-sys": ("zlib", ["src/zlib/LICENSE"]),
}
# Crates that are published without a text, with the one of their licences that is taken.
WITHOUT = {
    "backtrace-ext": "Apache-2.0",
    "hdf5-metno": "Apache-2.0",
    "hdf5-metno-sys": "Apache-2.0",
    "hdf5-metno-types": "Apache-2.0",
    "prefetch-index": "MIT",
    "rstar": "Apache-2.0",
}


def run(*command):
    return subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True).stdout


def linked(package):
    """Crates of other people that are linked into a package."""
    edges = ["--edges", "normal,no-proc-macro", "--prefix", "none", "--format", "{p}"]
    lines = run("cargo", "tree", "--locked", "-p", package, "--target", TARGET, *edges).splitlines()
    names = {" ".join(line.split()[:2]) for line in lines}
    known = run("cargo", "metadata", "--locked", "--format-version", "1", "--filter-platform", TARGET)
    crates = [crate for crate in json.loads(known)["packages"] if crate["source"]]
    return [crate for crate in crates if f"{crate['name']} v{crate['version']}" in names]


def texts(crate):
    """Names and texts of a crate and of the C library that it builds."""
    name, folder = crate["name"], Path(crate["manifest_path"]).parent
    title = f"{name} {crate['version']} ({crate['license'] or 'see the text'})"
    builds = {needed["name"] for needed in crate["dependencies"] if needed["kind"] == "build"}
    if builds & {"cc", "cmake"} and name not in BUNDLED:
        raise SystemExit(f"{title} may build a C library: add the library to `BUNDLED` in licences.py")
    library, places = BUNDLED.get(name, ("", []))
    found = [(f"{library}, in {name} {crate['version']}", (folder / place).read_text(encoding="utf-8")) for place in places]
    files = sorted(file for file in folder.iterdir() if file.is_file() and NAMES.match(file.name))
    if any(re.search("licen[cs]e|copying", file.name, re.I) for file in files):
        return found + [(title, file.read_text(encoding="utf-8")) for file in files]
    # The crate may be its library alone.
    return found if crate["license_file"] in places else [*found, (title, common(crate, title))]


def common(crate, title):
    """Text of the licence of a crate that is published without one."""
    taken = WITHOUT.get(crate["name"])
    if taken is None or taken not in re.split(r" OR |/", crate["license"] or ""):
        raise SystemExit(f"{title} has no text of its licence: set the one to take in `WITHOUT` in licences.py")
    if taken == "Apache-2.0":
        return (ROOT / "LICENSE-APACHE").read_text(encoding="utf-8")
    holders = f"Copyright (c) {', '.join(crate['authors'])}"
    return re.sub("Copyright .*", holders, (ROOT / "LICENSE-MIT").read_text(encoding="utf-8"), count=1)


class Text(HTMLParser):
    """Text of a page."""

    def __init__(self, page):
        super().__init__()
        self.parts = []
        self.feed(page)

    def handle_data(self, data):
        self.parts.append(data)


def standard_library():
    """Licences of the Rust standard library, which comes with the compiler."""
    root = run("rustc", "--print", "sysroot").strip()
    page = (Path(root) / "share" / "doc" / "rust" / "COPYRIGHT-library.html").read_text(encoding="utf-8")
    text = "".join(Text(page).parts)
    return re.sub(r"\n\s*\n+", "\n\n", text)


def main(package, output, *others):
    """Writes each text once, after the names of all that are under it."""
    crates = linked(package)
    found = [pair for crate in crates for pair in texts(crate)]
    for other in others:
        name, _, file = other.partition("=")
        found.append((name, Path(file).read_text(encoding="utf-8")))
    under = {}
    for name, text in found:
        # The same text may have other line breaks.
        first = under.setdefault(" ".join(text.split()), (text, []))
        if name not in first[1]:
            first[1].append(name)
    parts = [f"{package} contains the code of others, under the licences below.\n"]
    parts += ["\n".join(names) + "\n\n" + text.strip("\n") + "\n" for text, names in under.values()]
    parts.append(standard_library().strip() + "\n")
    Path(output).write_text(f"\n{'=' * 80}\n\n".join(parts), encoding="utf-8")
    print(f"{output}: {len(crates)} crates, {len(under)} texts")


if __name__ == "__main__":
    main(*sys.argv[1:])

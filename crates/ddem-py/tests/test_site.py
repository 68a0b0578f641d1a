"""The table of the examples is complete, and the gallery of README.md agrees with it."""

import json
import posixpath
import re
from html.parser import HTMLParser
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


def test_programs_have_the_code_that_the_page_on_extending_shows():
    programs = [ROOT / "examples" / "law.rs", ROOT / "tests" / "contract" / "extending.rs"]
    sources = [path.read_text(encoding="utf-8") for path in programs]
    shown = re.findall(r"^```rust\n(.*?)^```$", (ROOT / "docs" / "extending.md").read_text(encoding="utf-8"), re.M | re.S)
    assert len(shown) == 3
    for code in shown:
        assert any(code in source for source in sources), code


class Loads(HTMLParser):
    """Files that a browser loads with a page, at most."""

    def __init__(self, page):
        super().__init__()
        self.files, self.pictures = {page.name}, []
        text = page.read_text(encoding="utf-8")
        self.feed(text)
        # Others load as they come into view.
        self.files.update(self.pictures[:3])
        # The search begins with each page.
        self.files.add(re.search(r'"search": "([^"]*)"', text)[1])

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        if tag == "img":
            self.pictures.append(given["src"])
        elif tag in ("script", "iframe", "source"):
            self.files.add(given.get("src"))
        elif tag == "link" and given.get("rel") in ("stylesheet", "icon"):
            self.files.add(given["href"])


SITE = ROOT / "target" / "site"
PAGES = sorted(SITE.rglob("*.html"))
built = pytest.mark.skipif(not PAGES, reason="the site is not built: `mkdocs build`")


def weight(file):
    """Size of a file, with all fonts of a style sheet."""
    fonts = re.findall(r"url\(([^)]+\.woff2)\)", file.read_text(encoding="utf-8")) if file.suffix == ".css" else []
    return file.stat().st_size + sum((file.parent / font).stat().st_size for font in fonts)


@built
def test_pages_of_the_site_are_small_and_need_no_network():
    sizes = {}
    for page in PAGES:
        files = Loads(page).files - {None}
        assert not [file for file in files if re.match(r"[a-z]+:|//", file)], page
        # Those of the page for wrong addresses begin at the root of the site.
        there = [(SITE if file[0] == "/" else page.parent) / file.lstrip("/").split("?")[0] for file in files]
        sizes[page.relative_to(SITE).as_posix()] = sum(weight(file) for file in there)
    assert max(sizes.values()) < 1_000_000, max(sizes, key=sizes.get)


@built
def test_links_of_the_site_lead_to_pages_and_anchors():
    texts = {page.relative_to(SITE).as_posix(): page.read_text(encoding="utf-8") for page in PAGES}
    anchors = {page: set(re.findall(r' id="([^"]+)"', text)) for page, text in texts.items()}
    dead = []
    # Links of the page for wrong addresses depend on the address of the site.
    for page in texts.keys() - {"404.html"}:
        for link in re.findall(r'<a [^>]*?href="([^"]*)"', texts[page]):
            if re.match(r"[a-z]+:", link):
                continue
            path, _, anchor = link.partition("#")
            there = posixpath.normpath(posixpath.join(posixpath.dirname(page), path)) if path else page
            found = anchor in anchors[there] if anchor and there in anchors else (SITE / there).exists()
            if not found:
                dead.append((page, link))
    assert not dead


@pytest.mark.skipif(not (SITE / "rust").exists(), reason="the site was built without `cargo doc`")
def test_items_of_the_page_on_rust_exist():
    pages = [page.read_text(encoding="utf-8") for page in (SITE / "rust").glob("*.html")]
    known = {name.rsplit(".", 1)[1] for page in pages for name in re.findall(r' id="(\w+\.[\w.]+)"', page)}
    table = (ROOT / "docs" / "rust.md").read_text(encoding="utf-8").split("re-exports these crates")[0]
    items = [name for name in re.findall(r"`([\w:]+)`", table) if name not in ("ddem", "io", "ddem::deck")]
    assert len(items) > 20
    assert not [name for name in items if name.rsplit("::", 1)[-1] not in known]


@built
def test_search_finds_examples_and_verification_in_a_small_index():
    index = SITE / "search" / "search_index.json"
    # A browser reads it before its first search.
    assert index.stat().st_size < 650_000
    pages = {}
    for entry in json.loads(index.read_text(encoding="utf-8"))["docs"]:
        page = entry["location"].partition("#")[0]
        pages[page] = pages.get(page, "") + entry["text"]
    # Headers of decks and names of cases, but no sources and numbers.
    assert "Heyman: an arch" in pages["examples/arch-toml.html"] and "[model]" not in pages["examples/arch-toml.html"]
    assert "v02_p_wave" in pages["verification.html"] and "2999.917" not in pages["verification.html"]
    # Without `cargo doc` the site has no such pages.
    if (SITE / "rust").exists():
        assert "factor_of_safety" in pages["rust/ddem.html"] and "Errors" not in pages["rust/ddem.html"]
    examples = {page.relative_to(SITE).as_posix() for page in (SITE / "examples").glob("*.html")}
    assert len(examples) > 20 and examples <= set(pages)

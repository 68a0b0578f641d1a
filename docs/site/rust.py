"""Pages on the public items of the Rust library, one for each module, made of what `cargo doc` wrote, if it is there.

The pages of rustdoc itself are ten times as large as the whole site, and some have megabytes.
"""

from __future__ import annotations

import html
import logging
import os
import posixpath
import re
from html.parser import HTMLParser
from pathlib import Path

LOG = logging.getLogger("mkdocs.hooks.ddem")
ROOT = Path(__file__).resolve().parents[2]
DOC = Path(os.environ.get("CARGO_TARGET_DIR") or ROOT / "target") / "doc"

# Crates by the names that programs use.
CRATES = {"ddem": "ddem", "ddem_deck": "ddem::deck", "ddem_io": "ddem::io"}
ITEM = re.compile(r"(struct|enum|trait|fn|type|constant)\.(\w+)\.html")
ABOUT = re.compile(r'top-doc.*?<div class="docblock"><p>(.*?)</p>', re.S)

# Parts of a page of rustdoc that are left out: its heading, the table of a module, and at the end what all types have.
HEADING = re.compile(r'^.*?<div class="main-heading">.*?</span> ?</div>', re.S)
TABLE = re.compile(r'<h2 id="[a-z]+" class="section-header">[^§]*§</a></h2><dl class="item-table.*', re.S)
REST = re.compile(r'<h2 id="(trait-impl|foreign-impl|synthetic|blanket|implementors|dyn-compat|aliased).*', re.S)
# The list of fields follows, with their types.
DECLARATION = re.compile(r'<pre class="rust item-decl">.*?</pre>(?=.*<h2 id="(fields|variants)")', re.S)

KEPT = {"p", "code", "pre", "ul", "ol", "li", "em", "strong", "table", "thead", "tbody", "tr", "th", "td", "sub", "sup"}
ORNAMENTS = {"anchor", "doc-anchor", "hideme", "impl", "item-spacer", "non-exhaustive", "rightside", "section-header", "src", "tooltip"}
WITHOUT_END = {"br", "img", "input", "wbr"}


def modules():
    """Names of the modules by the folders of rustdoc."""
    found = {}
    for crate, name in CRATES.items():
        for index in sorted((DOC / crate).rglob("index.html")):
            folder = index.parent.relative_to(DOC).as_posix()
            # Not a library of others that the crate hands on, nor another name of a module.
            if not folder.startswith("ddem/nalgebra") and 'id="main-content"' in read(folder, "index.html"):
                found[folder] = name + folder.removeprefix(crate).replace("/", "::")
    return dict(sorted(found.items(), key=lambda entry: entry[1]))


def read(folder, name):
    return (DOC / folder / name).read_text(encoding="utf-8")


def pages():
    """Text of each page, by its name: none without `cargo doc`."""
    found = modules()
    return {f"rust/{slug(name)}.md": page(folder, found) for folder, name in found.items()}


def slug(module):
    return module.replace("::", "-")


def listed():
    """Table of the modules, for the page on Rust."""
    found = modules()
    if not found:
        return ""
    rows = [(f"rust/{slug(name)}.html", name, read(folder, "index.html")) for folder, name in found.items()]
    return "\n".join(["", "## Modules and their items", "", table(rows), ""])


def table(rows):
    """Names with links, each with the first paragraph of its documentation."""
    lines = [f'<tr><td><a href="{target}"><code>{name}</code></a></td><td>{about(text)}</td></tr>' for target, name, text in rows]
    return "\n".join(["<table>", *lines, "</table>"])


def about(text):
    found = ABOUT.search(text)
    return re.sub(r"</?a\b[^>]*>", "", found[1]) if found else ""


def page(folder, found):
    """A module: a table of its items, then the items."""
    index = read(folder, "index.html")
    # A folder may have items of former builds, too.
    names = {name for name in re.findall('href="([^"/]*)"', index) if ITEM.fullmatch(name)}
    rows, items = [], []
    for name in sorted(names, key=lambda name: name.partition(".")[2].lower()):
        text, anchor = read(folder, name), name.removesuffix(".html")
        kind, short = anchor.split(".")
        rows.append((f"#{anchor}", short, text))
        items += ["", f"## {kind} `{short}` {{#{anchor}}}", "", Item(f"{folder}/{name}", found).cleaned(text)]
    if not all(about(text) for _, _, text in rows) or not rows:
        LOG.warning("the pages of rustdoc in %s have another form than docs/site/rust.py expects", DOC / folder)
    lines = [f"# `{found[folder]}`", "", Item(f"{folder}/index.html", found).cleaned(index), ""]
    return "\n".join([*lines, table(rows), *items, ""])


class Item(HTMLParser):
    """Declaration, documentation, fields and methods of an item, without the ornaments of rustdoc."""

    def __init__(self, path, found):
        super().__init__()
        self.path, self.found = path, found
        self.id = ""
        self.out = []
        # For each open element what closes it, and how many elements around are left out.
        self.ends, self.depth = [], 0

    def cleaned(self, text):
        text = text.partition('<section id="main-content"')[2].partition("</main>")[0]
        for left_out in (HEADING, TABLE, REST, DECLARATION):
            text = left_out.sub("", text, count=1)
        self.feed(text)
        return "".join(self.out).strip()

    def handle_starttag(self, tag, attributes):
        if tag in WITHOUT_END:
            return
        given = dict(attributes)
        self.id = given.get("id") or self.id
        start, end = self.replacement(tag, (given.get("class") or "").split(), given.get("href") or "")
        if tag == "h4" and not given:
            # "Fields", of a variant.
            start = None
        if start is None or self.depth:
            self.depth += 1
        else:
            self.out.append(start)
            self.ends.append(end)

    def replacement(self, tag, classes, href):
        """Texts in place of the two tags of an element; none for an element that is left out."""
        if "code-header" in classes or tag == "span" and "section-header" in classes:
            anchor = posixpath.basename(self.path).removesuffix(".html")
            return f'<p class="member" id="{anchor}.{html.escape(self.id)}"><code>', "</code></p>"
        if ORNAMENTS & set(classes):
            return None, None
        if "docblock" in classes:
            return '<div class="about">', "</div>"
        if tag == "a" and (target := self.target(href)):
            return f'<a href="{target}">', "</a>"
        if tag in ("h1", "h2", "h3", "h4", "h5", "h6"):
            return "<p><strong>", "</strong></p>"
        if tag in KEPT and not (tag == "code" and "</code></p>" in self.ends):
            return f"<{tag}>", f"</{tag}>"
        return "", ""

    def handle_endtag(self, tag):
        if tag in WITHOUT_END:
            return
        if self.depth:
            self.depth -= 1
        elif self.ends:
            self.out.append(self.ends.pop())

    def handle_data(self, data):
        if not self.depth:
            self.out.append(html.escape(data, quote=False))

    def target(self, href):
        """Place to which a link leads: none for items of other crates."""
        if re.match(r"https?:", href):
            return None if "doc.rust-lang.org" in href or "docs.rs" in href else href
        path, _, anchor = href.partition("#")
        path = posixpath.normpath(posixpath.join(posixpath.dirname(self.path), path)) if path else self.path
        folder, name = posixpath.split(path)
        if folder not in self.found or not (DOC / path).exists():
            return None
        page = f"{slug(self.found[folder])}.html"
        if not ITEM.fullmatch(name):
            return page
        item = name.removesuffix(".html")
        return f"{page}#{item}.{anchor}" if anchor else f"{page}#{item}"

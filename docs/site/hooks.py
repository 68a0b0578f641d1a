"""Pages of the site that are not in docs/: from elsewhere in the repository, or made of other files.

Links in all pages are those of the repository, so that they work there. This module turns them into links of the site:
a file of docs/ keeps its place, a page of `ELSEWHERE` and an example have pages, and any other file of the repository is
copied to `source/`. A link to a file that does not exist fails a strict build.
"""

from __future__ import annotations

import logging
import posixpath
import re
import sys
from pathlib import Path

from mkdocs.plugins import event_priority
from mkdocs.structure.files import File

sys.path.insert(0, str(Path(__file__).parent))

import examples
import keys
import pictures
import rust
import search

LOG = logging.getLogger("mkdocs.hooks.ddem")
ROOT = Path(__file__).resolve().parents[2]

# Pages outside of docs/, with their names in the site.
ELSEWHERE = {
    "README.md": "index.md",
    "ARCHITECTURE.md": "ARCHITECTURE.md",
    "CONTRIBUTING.md": "CONTRIBUTING.md",
    "SECURITY.md": "SECURITY.md",
    "CHANGELOG.md": "CHANGELOG.md",
}

LINK = re.compile(r"(\]\(|\bsrc=\"|\bhref=\")([^)\s\"]+)")
FENCE = re.compile(r"^ {0,3}(```|~~~)")
FORMULAS = re.compile(r'<script src="[^"]*site/(katex/katex\.min|math)\.js"></script>|<link [^>]*site/katex/[^>]*>')
# Markdown has no table without a head.
EMPTY_HEAD = re.compile(r"<thead>\s*<tr>(\s*<th[^>]*></th>)+\s*</tr>\s*</thead>")
# Pages with wide tables, which take the place of the navigation.
WIDE = {"method.md", "performance.md", "verification.md"}
# Contents of pages while the search reads those of its own.
WHOLE = {}


def on_files(files, config):
    """Adds the pages from elsewhere, those made of other files, and the files to which they link."""
    for path, name in ELSEWHERE.items():
        files.append(File.generated(config, name, abs_src_path=str(ROOT / path)))
    made = {**examples.pages(), **keys.pages(), **rust.pages()}
    for name, text in made.items():
        files.append(File.generated(config, name, content=text))
    for path in linked():
        name = place(path)
        if not files.get_file_from_path(name):
            files.append(File.generated(config, name, abs_src_path=str(ROOT / path)))
    return pictures.replaced(files, config)


def on_page_markdown(markdown, page, config, files):
    """Turns the links of the repository into links of the site."""
    source = origin(page.file.src_uri)
    if source is None:
        return markdown
    if source == "docs/diagnostics.md":
        # An anchor for each code.
        markdown = re.sub(r"^\| `([a-z-]+)` \|", r"| `\1`{#\1} |", markdown, flags=re.M)

    def rewritten(match):
        opening, target = match.groups()
        path, mark, anchor = target.partition("#")
        found = within(source, path)
        if found is None:
            return match[0]
        if not (ROOT / found).exists():
            LOG.warning("%s: there is no file `%s`", source, target)
            return match[0]
        start = posixpath.dirname(page.file.src_uri) or "."
        return f"{opening}{posixpath.relpath(place(found), start)}{mark}{anchor}"

    markdown = outside_fences(markdown, lambda line: LINK.sub(rewritten, line))
    return markdown + rust.listed() if source == "docs/rust.md" else markdown


def on_page_content(html, page, config, files):
    """Loads pictures as they come into view, shows tables well, and gives the search what it is to find."""

    def lazy(match):
        name = posixpath.normpath(posixpath.join(posixpath.dirname(page.file.src_uri), match[1]))
        return f'<img loading="lazy" {pictures.size(files.get_file_from_path(name))}{match[0].removeprefix("<img ")}'

    html = EMPTY_HEAD.sub("", re.sub(r'<img [^>]*?src="([^"]+)"', lazy, html))
    # No head of a row or a column.
    html = re.sub(r"<th([^>]*)></th>", r"<td\1></td>", html)
    WHOLE[page.file.src_uri] = html
    if page.file.src_uri in WIDE:
        page.meta["hide"] = ["navigation"]
    if page.file.src_uri == "verification.md":
        WHOLE[page.file.src_uri] = f'<div class="numbers">{html}</div>'
    return search.indexed(page.file.src_uri, html)


# After the plugin `search`, which takes the contents in this event.
@event_priority(-100)
def on_page_context(context, page, config, nav):
    """Shows the whole page."""
    page.content = WHOLE.pop(page.file.src_uri)
    return context


def on_post_page(output, page, config):
    """Leaves out what the page does not need."""
    return lighter(output)


def on_post_template(output, template_name, config):
    """The same for the page for wrong addresses."""
    return lighter(output) if template_name.endswith(".html") else output


def lighter(output):
    """A page without the files for formulas where there are none, and with a name of the search for screen readers."""
    output = output.replace('role="dialog">', 'role="dialog" aria-label="Search">', 1)
    if 'class="arithmatex"' in output:
        return output
    return FORMULAS.sub("", output)


def on_post_build(config):
    """Lets pages load the index of the search as it is opened."""
    search.load_when_opened(Path(config.site_dir))


def origin(name):
    """Path in the repository of a page of the site; none for a page made here, whose links are those of the site."""
    for path, page in ELSEWHERE.items():
        if page == name:
            return path
    path = f"docs/{name}"
    return path if (ROOT / path).exists() else None


def within(source, target):
    """Path in the repository to which a link of a file leads; none for links to elsewhere or within the page."""
    if not target or re.match(r"[a-z]+:", target):
        return None
    return posixpath.normpath(posixpath.join(posixpath.dirname(source), target))


def place(path):
    """Place in the site of a file of the repository."""
    if path in ELSEWHERE:
        return ELSEWHERE[path]
    if path.startswith("docs/"):
        return pictures.place(path.removeprefix("docs/"))
    if page := examples.page(path):
        return page
    # Browsers show a text, and would keep a source as a file.
    return f"source/{path}.txt"


def linked():
    """Files of the repository outside of docs/ to which pages link."""
    found = set()
    pages = [ROOT / path for path in ELSEWHERE] + sorted((ROOT / "docs").rglob("*.md"))
    for page in pages:
        source = page.relative_to(ROOT).as_posix()

        def note(line, source=source):
            for match in LINK.finditer(line):
                path = within(source, match[2].partition("#")[0])
                if path and not path.startswith("docs/") and (ROOT / path).is_file():
                    found.add(path)
            return line

        outside_fences(page.read_text(encoding="utf-8"), note)
    return sorted(path for path in found if place(path).startswith("source/"))


def outside_fences(text, change):
    """Text with its lines changed, but for those of blocks of code."""
    lines, inside = [], False
    for line in text.split("\n"):
        fence = FENCE.match(line) is not None
        inside ^= fence
        lines.append(line if inside or fence else change(line))
    return "\n".join(lines)

"""Index of the search of the site, which a page loads when the search opens."""

from __future__ import annotations

import itertools
import logging
import re

LOG = logging.getLogger("mkdocs.hooks.ddem")

DISPLAYED = re.compile(r'<div class="arithmatex">.*?</div>', re.S)
ROW = re.compile(r"<tr>.*?</tr>", re.S)
CELL = re.compile(r"<td>.*?</td>", re.S)
ITEMS = re.compile(r"<table>.*?</table>", re.S)
MEMBER = re.compile(r'<p class="member" id="[^"]*?(?:(?:method|variant)\.(\w+))?">.*?</p>\s*(?:<div class="about">.*?</div>)?\s*', re.S)
ABOUT = re.compile(r'(<div class="about">\s*<p>.*?</p>).*?</div>', re.S)
DECLARATION = re.compile(r"<pre><code>pub .*?</pre>", re.S)
SOURCE = re.compile(r"<code>((?:(?!</code>).)*)(</code></pre></div>\s*)$", re.S)

# The theme loads the index with each page served by http, and with each page to mark the words of a search. Here a page
# loads it as the reader opens the search or comes from one.
EAGER = {
    '(location.protocol!=="file:")': "(!1)",
    '("search.highlight")?': '("search.highlight")&&/[?&]h=/.test(location.search)?',
}


def load_when_opened(site):
    """Changes the script of the theme in the built site."""
    for script in (site / "assets" / "javascripts").glob("bundle.*.js"):
        text = script.read_text(encoding="utf-8")
        for eager, opened in EAGER.items():
            if text.count(eager) != 1:
                LOG.warning("%s has changed, and pages load the index of the search: look for `%s`", script.name, eager)
            text = text.replace(eager, opened)
        script.write_text(text, encoding="utf-8")


def indexed(name, html):
    """The part of a page that goes into the index, which would be too large with sources and numbers."""
    if name.startswith("examples/"):
        return SOURCE.sub(lambda match: f"<code>{header(match[1])}{match[2]}", html)
    if name == "verification.md":
        return names(html)
    if name.startswith("rust/"):
        # Items, which follow their table: what they are, and the names of their methods.
        html = DECLARATION.sub("", ITEMS.sub("", html, count=1))
        html = MEMBER.sub(lambda match: f"{match[1]} " if match[1] else "", html)
        return ABOUT.sub(r"\1</div>", html)
    # Nobody looks for LaTeX.
    return DISPLAYED.sub("", html)


def header(source):
    """The comment at the top of a source."""
    lines = source.split("\n")
    return "\n".join(itertools.takewhile(lambda line: not line or re.match('<span class="(c|sd)', line), lines))


def names(html):
    """Tables with the names of their rows instead of the numbers, each once."""
    seen = set()

    def new(row):
        cells = [cell for cell in CELL.findall(row[0])[:3] if cell not in seen]
        seen.update(cells)
        return f"<tr>{' '.join(cells)}</tr>"

    return ROW.sub(new, html)

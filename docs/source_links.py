"""Pages of the sources that the text names, and links to them: who reads of a test on the site can read the test."""

import ast
import re
from functools import cache
from html import escape
from pathlib import Path

from docutils import nodes
from literal_links import free_literals, lead
from pygments import highlight
from pygments.formatters import HtmlFormatter
from pygments.lexers import get_lexer_for_filename

ROOT = Path(__file__).resolve().parents[1]
# A file, as the text names it, and a function, class or constant in it.
_NAMED = re.compile(r"([\w./-]+\.(?:py|toml|yml|json))(?:::(\w+))?")
_FOLDER = "source"


def link_sources(app, doctree, page):
    """Make links of the literals of ``doctree`` that name a file, or a name in one. Raises ``ValueError`` for a name
    that its file has not.
    """
    for literal in free_literals(doctree):
        if (named := _named(literal)) is not None:
            path, name = named
            lead(
                literal, app.builder.get_relative_uri(page, f"{_FOLDER}/{path}") + (_anchor(path, name) if name else "")
            )


def source_pages(app):
    """A page for each file that some page names, with its lines numbered by anchors."""
    found = {
        named[0]
        for page in app.env.found_docs
        for literal in app.env.get_doctree(page).findall(nodes.literal)
        if (named := _named(literal)) is not None
    }
    formatter = HtmlFormatter(lineanchors="line", cssclass="highlight")
    for path in sorted(found):
        code = highlight((ROOT / path).read_text(encoding="utf-8"), get_lexer_for_filename(path), formatter)
        yield f"{_FOLDER}/{path}", {"title": path, "body": f"<h1>{escape(path)}</h1>{code}"}, "page.html"


def _named(literal):
    """The path and the name that a literal has, or None where it names no file of this project."""
    match = _NAMED.fullmatch(literal.astext())
    return match.groups() if match and "/" in match[1] and (ROOT / match[1]).is_file() else None


def _anchor(path, name):
    if name not in (lines := _lines(path)):
        raise ValueError(f"{path}: no {name}")
    return f"#line-{lines[name]}"


@cache
def _lines(path):
    """The line where each name of a file is defined first, the outermost before others."""
    found = {}
    for node in ast.walk(ast.parse((ROOT / path).read_text(encoding="utf-8"))):
        targets = getattr(node, "targets", [getattr(node, "target", None)])
        for name in (getattr(node, "name", None), *(getattr(target, "id", None) for target in targets)):
            found.setdefault(name, getattr(node, "lineno", None))
    return found

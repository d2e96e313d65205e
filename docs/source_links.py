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
# A file, as the text names it, and a function, class or constant in it, with those that it stands in before it and what
# a test is called with behind it.
_NAMED = re.compile(r"(\.?\w[\w./-]*\.(?:py|toml|yml|json))(?:::([\w.:]+)(?:\[.*\])?)?")
_FOLDER = "source"


def link_sources(app, doctree, page):
    """Make links of the literals of ``doctree`` that name a file, or a name in one. Raises ``ValueError`` for a name
    that its file has not.
    """
    for literal in free_literals(doctree):
        if (named := _named(literal)) is not None:
            path, name = named
            try:
                anchor = _anchor(path, name) if name else ""
            except ValueError as error:
                raise ValueError(f"{page}: {error}") from error
            lead(literal, app.builder.get_relative_uri(page, f"{_FOLDER}/{path}") + anchor)


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
    if not match or "/" not in match[1] or ".." in match[1]:
        return None
    if not (ROOT / match[1]).is_file():
        if match[2]:
            raise ValueError(f"{literal.astext()}: no such file")
        return None
    return match.groups()


def _anchor(path, name):
    lines = _lines(path) if path.endswith(".py") else {}
    if (line := lines.get(name.replace("::", "."))) is None:
        raise ValueError(f"{path}: no {name}")
    return f"#line-{line}"


@cache
def _lines(path):
    """The line where each function, class and constant of a file is defined first, those in a class by its name too."""
    found = {}
    for name, line in _definitions(ast.parse((ROOT / path).read_text(encoding="utf-8")).body):
        found.setdefault(name.rpartition(".")[2], line)
        found.setdefault(name, line)
    return found


def _definitions(body, *outer):
    """Each name that statements define, behind those of the classes ``outer`` that they stand in, and its line."""
    for node in body:
        for name in _defined_by(node):
            yield ".".join((*outer, name)), node.lineno
        if isinstance(node, ast.ClassDef):
            yield from _definitions(node.body, *outer, node.name)
        elif isinstance(node, ast.If | ast.Try | ast.With | ast.ExceptHandler):
            for block in ("body", "orelse", "handlers", "finalbody"):
                yield from _definitions(getattr(node, block, []), *outer)


def _defined_by(node):
    """The names that one statement defines: of a function or class its own, of an assignment its targets."""
    if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
        return [node.name]
    if isinstance(node, ast.Assign | ast.AnnAssign):
        targets = node.targets if isinstance(node, ast.Assign) else [node.target]
        return [part.id for target in targets for part in ast.walk(target) if isinstance(part, ast.Name)]
    return []

"""Places of names and of marked rules in a package's sources.

A rule is a statement below a comment ``# rule: short-name``; no two have the same name.
"""

import ast
import builtins
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

_MARK = re.compile(r"^\s*# rule: (\S+)$")
# The decorators of functions that are compiled.
_COMPILED = ("kernel", "inlined", "apart", "intrinsic")


@dataclass(frozen=True)
class Place:
    """A node of a module's syntax, which is read anew for each place.

    name      the module's name, and where the node has one its own: "renderer.mesh.mesh.Mesh.vertex_normals"
    compiled  whether it is part of a kernel
    """

    path: Path
    module: str
    name: str
    tree: ast.Module
    node: ast.stmt
    compiled: bool

    def text_with(self, *statements: ast.stmt) -> str:
        """The module's text with other statements in the place of the node.

        Raises ``ValueError`` where they use a name that neither the node nor the module has.
        """
        known = {*dir(builtins), *_names(self.node), *(name for node in self.tree.body for name in _bound(node))}
        new = {name for statement in statements for name in _names(statement)} - known
        if new:
            raise ValueError(f"{self.name}: expected names of the module, got {sorted(new)}")
        _put(self.tree, self.node, statements)
        return ast.unparse(ast.fix_missing_locations(self.tree))


def find_rule(package: Path, name: str) -> Place:
    """The statement that carries a name. Raises ``ValueError`` unless one does."""
    places = [place for path in _files(package, f"# rule: {name}\n") for place in _marked(path, package, name)]
    return _one(places, "rule", name)


def rules(package: Path) -> list[str]:
    """The names of all marked rules."""
    marks = (_MARK.match(line) for source in _sources(package).values() for line in source.splitlines())
    return [mark[1] for mark in marks if mark]


def find_definition(package: Path, name: str) -> Place:
    """The one function, method, class or module-level constant whose dotted name ends with ``name``.

    Raises ``ValueError`` where there is none, or more than one.
    """
    places = [
        place
        for path in _files(package, name.rpartition(".")[2])
        if any(_ends(module_of(path, package) + own, name) for own in _names_in(_sources(package)[path])[0])
        for place in _defined(path, package)
        if _ends(place.name, name)
    ]
    return _one(places, "name", name)


def find_name(package: Path, name: str) -> tuple[str, str]:
    """Module and name within it of a definition; or, where no definition has that name, of what a module imports."""
    last = name.rpartition(".")[2]
    importing = [
        module
        for path in _files(package, last)
        if _ends(f"{(module := module_of(path, package))}.{last}", name)
        for imported in _names_in(_sources(package)[path])[1]
        if imported == last
    ]
    try:
        found = find_definition(package, name)
    except ValueError:
        if len(importing) == 1:
            return importing[0], last
        raise
    return found.module, found.name.removeprefix(f"{found.module}.")


def _ends(whole: str, name: str) -> bool:
    """Whether a dotted name ends with another, part by part."""
    return f".{whole}".endswith(f".{name}")


def module_of(path: Path, package: Path) -> str:
    """The full name of a module of the package."""
    return ".".join(path.relative_to(package.parent).with_suffix("").parts).removesuffix(".__init__")


def _files(package: Path, text: str = "") -> list[Path]:
    """The sources in which a text stands."""
    return [path for path, source in _sources(package).items() if text in source]


@cache
def _sources(package: Path) -> dict[Path, str]:
    """The text of each source, read once."""
    return {path: path.read_text(encoding="utf-8") for path in sorted(package.rglob("*.py"))}


def _one(places: list[Place], what: str, name: str) -> Place:
    if len(places) != 1:
        found = ", ".join(place.name for place in places) or "none"
        raise ValueError(f"{what}: expected one {name!r}, got {found}")
    return places[0]


def _marked(path: Path, package: Path, name: str) -> Iterator[Place]:
    """Each statement of a file that carries a name."""
    text = path.read_text(encoding="utf-8")
    tree, module, lines = ast.parse(text), module_of(path, package), text.splitlines()
    for number, line in enumerate(lines, 1):
        if (mark := _MARK.match(line)) and mark[1] == name:
            below = (node for node in ast.walk(tree) if isinstance(node, ast.stmt) and node.lineno > number)
            # Of an ``if`` and what is in its line, the outer one is met first.
            node = min(below, key=lambda node: node.lineno)
            compiled = (inner for function in tree.body if _is_compiled(function) for inner in ast.walk(function))
            yield Place(path, module, f"{module}: {name}", tree, node, any(inner is node for inner in compiled))


def _defined(path: Path, package: Path) -> Iterator[Place]:
    """Each function, class, method and constant of a file."""
    tree, module = ast.parse(path.read_text(encoding="utf-8")), module_of(path, package)
    for name, node in _named(tree.body, module):
        # Constants count as parts of kernels, which may read them.
        compiled = isinstance(node, ast.Assign | ast.AnnAssign) or _is_compiled(node)
        yield Place(path, module, name, tree, node, compiled)


def _named(body: list[ast.stmt], prefix: str) -> Iterator[tuple[str, ast.stmt]]:
    """The dotted name and the node of each function, class, method and constant."""
    for node in body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield f"{prefix}.{node.name}", node
            yield from _named(node.body, f"{prefix}.{node.name}")
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            yield from ((f"{prefix}.{name}", node) for name in _bound(node))


@cache
def _names_in(text: str) -> tuple[frozenset[str], list[str]]:
    """The names that a source defines, each after a dot, and the names that its top imports from elsewhere."""
    body = ast.parse(text).body
    imports = [node for node in body if isinstance(node, ast.ImportFrom)]
    return (
        frozenset(name for name, _ in _named(body, "")),
        [name for node in imports for name in _bound(node)],
    )


def _is_compiled(node: ast.stmt) -> bool:
    return isinstance(node, ast.FunctionDef) and any(
        isinstance(name, ast.Name) and name.id in _COMPILED
        for decorator in node.decorator_list
        for name in ast.walk(decorator)
    )


def _bound(node: ast.stmt) -> list[str]:
    """The names that a statement at a module's top binds."""
    if isinstance(node, ast.Import | ast.ImportFrom):
        return [alias.asname or alias.name.partition(".")[0] for alias in node.names]
    if isinstance(node, ast.FunctionDef | ast.ClassDef):
        return [node.name]
    return [name.id for name in ast.walk(node) if isinstance(name, ast.Name) and isinstance(name.ctx, ast.Store)]


def _names(node: ast.AST) -> set[str]:
    """The names that code uses, without those that it binds itself."""
    nodes = list(ast.walk(node))
    own = {inner.arg for inner in nodes if isinstance(inner, ast.arg)}
    own |= {inner.id for inner in nodes if isinstance(inner, ast.Name) and not isinstance(inner.ctx, ast.Load)}
    return {inner.id for inner in nodes if isinstance(inner, ast.Name)} - own


def _put(tree: ast.Module, node: ast.stmt, statements: tuple[ast.stmt, ...]) -> None:
    """Put statements in the place of a node."""
    for parent in ast.walk(tree):
        for _, body in ast.iter_fields(parent):
            if isinstance(body, list) and any(inner is node for inner in body):
                at = next(i for i, inner in enumerate(body) if inner is node)
                body[at : at + 1] = statements
                return

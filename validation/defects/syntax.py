"""Finds a rule in a package's source by its syntax, and replaces it: the address of a seeded defect.

A place is found by the end of its dotted name, so it may move to another file or folder. A rule is found by its syntax
tree, so its layout may change, and so may the names of local variables.
"""

import ast
import builtins
import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

# Nodes in which a rule is searched.
_Definition = ast.FunctionDef | ast.ClassDef | ast.Assign | ast.AnnAssign
_Match = tuple[list[ast.AST], dict[str, str]]


@dataclass(frozen=True, eq=False)
class Place:
    """A function, class or constant in a file."""

    path: Path
    name: str
    node: _Definition
    known: frozenset[str]

    @property
    def text(self) -> str:
        """The file's text."""
        return self.path.read_text(encoding="utf-8")


def find_place(package: Path, name: str) -> Place:
    """The one function, method, class or module-level constant in ``package`` whose dotted name ends with ``name``.

    Raises ``ValueError`` where there is none, or more than one.
    """
    last = name.rpartition(".")[2]
    places = [
        place
        for path in sorted(package.rglob("*.py"))
        if last in path.read_text(encoding="utf-8")
        for place in _places(path, ".".join(path.relative_to(package.parent).with_suffix("").parts))
        if f".{place.name}".endswith(f".{name}")
    ]
    if len(places) != 1:
        found = ", ".join(place.name for place in places) or "none"
        raise ValueError(f"place: expected one {name!r} in {package.name}, got {found}")
    return places[0]


def _places(path: Path, module: str) -> Iterator[Place]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    known = frozenset(_bound_at_top(tree)) | frozenset(dir(builtins))

    def within(body: Sequence[ast.stmt], prefix: str) -> Iterator[Place]:
        for node in body:
            if isinstance(node, ast.FunctionDef | ast.ClassDef):
                yield Place(path, f"{prefix}.{node.name}", node, known)
                yield from within(node.body, f"{prefix}.{node.name}")
            elif isinstance(node, ast.Assign | ast.AnnAssign):
                for target in _assigned(node):
                    yield Place(path, f"{prefix}.{target}", node, known)

    yield from within(tree.body, module)


def _bound_at_top(tree: ast.Module) -> Iterator[str]:
    """Names that a module binds by imports, definitions and assignments."""
    for node in tree.body:
        if isinstance(node, ast.Import | ast.ImportFrom):
            yield from (alias.asname or alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield node.name
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            yield from _assigned(node)


def _assigned(node: ast.Assign | ast.AnnAssign) -> list[str]:
    targets = node.targets if isinstance(node, ast.Assign) else [node.target]
    return [name.id for target in targets for name in ast.walk(target) if isinstance(name, ast.Name)]


def replaced(place: Place, rule: str, broken: str) -> str:
    """The file's text with ``rule`` in ``place`` replaced by ``broken``.

    Raises ``ValueError`` unless the rule occurs there exactly once. Where no code equals the rule letter by letter,
    code that differs only in the names of local variables counts.
    """
    rule, broken = textwrap.dedent(rule).strip(), textwrap.dedent(broken).strip()
    expression = _expression(rule) if _expression(broken) else None
    pattern: list[ast.AST] = [expression] if expression else list(ast.parse(rule).body)
    found = [match for match in _candidates(place, pattern) if match is not None]
    exact = [match for match in found if all(ours == theirs for ours, theirs in match[1].items())]
    matches = exact or found
    if len(matches) != 1:
        raise ValueError(f"rule: expected once in {place.name}, got {len(matches)} times: {rule!r}")
    nodes, names = matches[0]
    tree = ast.parse(broken)
    for node in ast.walk(tree):
        if isinstance(node, ast.Name):
            node.id = names.get(node.id, node.id)
    text = ast.unparse(tree)
    return _spliced(place.text, nodes, f"({text})" if expression else text)


def _expression(text: str) -> ast.expr | None:
    try:
        return ast.parse(text, mode="eval").body
    except SyntaxError:
        return None


def _candidates(place: Place, pattern: list[ast.AST]) -> Iterator[_Match | None]:
    """Each run of code in ``place`` that matches, with the names of its local variables."""
    local = frozenset(_locals(place.node))

    def match(nodes: list[ast.AST]) -> _Match | None:
        names: dict[str, str] = {}
        same = all(_same(p, n, names, place.known, local) for p, n in zip(pattern, nodes, strict=True))
        return (nodes, names) if same and len(set(names.values())) == len(names) else None

    for node in ast.walk(place.node):
        if isinstance(pattern[0], ast.expr):
            if isinstance(node, ast.expr):
                yield match([node])
            continue
        for body in (value for _, value in ast.iter_fields(node) if isinstance(value, list)):
            yield from (match(body[i : i + len(pattern)]) for i in range(len(body) - len(pattern) + 1))
    if isinstance(pattern[0], ast.stmt) and len(pattern) == 1:
        yield match([place.node])


def _locals(node: ast.AST) -> Iterator[str]:
    for inner in ast.walk(node):
        if isinstance(inner, ast.arg):
            yield inner.arg
        elif isinstance(inner, ast.Name) and isinstance(inner.ctx, ast.Store):
            yield inner.id


def _same(pattern: object, node: object, names: dict[str, str], known: frozenset[str], local: frozenset[str]) -> bool:
    """Whether two syntax trees are equal except for names of local variables, which are recorded in ``names``."""
    if isinstance(pattern, ast.Name) and isinstance(node, ast.Name):
        free = pattern.id not in known and node.id in local
        return (pattern.id == node.id or free) and names.setdefault(pattern.id, node.id) == node.id
    if isinstance(pattern, list) and isinstance(node, list):
        return len(pattern) == len(node) and all(
            _same(p, n, names, known, local) for p, n in zip(pattern, node, strict=True)
        )
    if isinstance(pattern, ast.AST):
        return type(pattern) is type(node) and all(
            _same(getattr(pattern, f, None), getattr(node, f, None), names, known, local)
            for f in pattern._fields
            if f not in ("ctx", "type_comment", "kind")
        )
    return type(pattern) is type(node) and pattern == node


def _spliced(text: str, nodes: list[ast.AST], new: str) -> str:
    """``text`` with the code of the consecutive ``nodes`` replaced; columns count bytes."""
    first, last = nodes[0], nodes[-1]
    assert isinstance(first, ast.expr | ast.stmt) and isinstance(last, ast.expr | ast.stmt)
    lines = text.encode().splitlines(keepends=True)
    begin = sum(map(len, lines[: first.lineno - 1])) + first.col_offset
    end = sum(map(len, lines[: (last.end_lineno or last.lineno) - 1])) + (last.end_col_offset or 0)
    indented = new.replace("\n", "\n" + " " * first.col_offset)
    return (b"".join(lines)[:begin] + indented.encode() + b"".join(lines)[end:]).decode()

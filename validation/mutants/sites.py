"""Where the renderer can be broken: every fault of every operator, and a choice of some by a seed."""

import ast
import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, zip_longest
from pathlib import Path

from validation.mutants.operators import Fault, faults

_KERNELS = {"kernel", "inlined", "intrinsic"}


@dataclass(frozen=True)
class Mutant:
    """One fault in one file of a package.

    file      the file's path within the checkout, with slashes
    place     the dotted name of the function, class or module that it stands in
    line      its line
    operator  the kind of fault
    before    the code that stands there, as ``ast.unparse`` writes it
    instead   the code that takes its place
    kernel    whether it is compiled code, so that kernels are compiled anew for it
    at_top    whether it stands in no function: it is executed once, by the first import
    nth       which of the equal faults in its place it is, from 0: lines move, but what has this key stays
    """

    file: str
    place: str
    line: int
    operator: str
    before: str
    instead: str
    kernel: bool
    at_top: bool
    nth: int

    @property
    def key(self) -> str:
        """A name that stays while the code around it changes."""
        return f"{self.place} #{self.nth}: {self.before} -> {self.instead}"


@dataclass(frozen=True)
class _Site:
    place: str
    kernel: bool
    at_top: bool
    fault: Fault


def mutants(files: Sequence[Path], root: Path) -> list[Mutant]:
    """All mutants of some files below ``root``, in the order of files and lines."""
    return [mutant for path in files for mutant, _ in _of_file(path, root)]


def chosen(all_of_them: Sequence[Mutant], count: int, seed: int) -> list[Mutant]:
    """``count`` mutants in random order, half of them in kernels if there are any, each operator as often as the others
    while it lasts.

    A larger count begins with the mutants of a smaller.
    """
    dice = random.Random(seed)
    halves = [_in_turn([m for m in all_of_them if m.kernel == kernel], dice) for kernel in (True, False)]
    taken = list(chain.from_iterable(zip(*filter(None, halves), strict=False)))[:count]
    if count > len(taken):
        raise ValueError(f"mutants: expected at most {len(taken)}, got {count}")
    return taken


def _in_turn(some: Sequence[Mutant], dice: random.Random) -> list[Mutant]:
    """One of each operator, then the next of each, at random."""
    piles: dict[str, list[Mutant]] = {}
    for mutant in some:
        piles.setdefault(mutant.operator, []).append(mutant)
    for pile in piles.values():
        dice.shuffle(pile)
    rounds = zip_longest(*(piles[operator] for operator in sorted(piles)))
    return [mutant for one in rounds for mutant in one if mutant is not None]


def text_of(mutant: Mutant, root: Path) -> str:
    """The altered text of the mutant's file. Raises ``ValueError`` where its code stands there no longer."""
    path = root / mutant.file
    for found, fault in _of_file(path, root):
        if found.key == mutant.key:
            return _spliced(path.read_text(encoding="utf-8"), fault)
    raise ValueError(f"mutant: expected {mutant.before!r} in {mutant.place}, got none")


def statement_of(mutant: Mutant, root: Path) -> str:
    """The first line of the statement that a mutant stands in, as ``ast.unparse`` writes it: of equal faults in one
    place it tells which this is.
    """
    tree = ast.parse((root / mutant.file).read_text(encoding="utf-8"))
    around = [
        node for node in ast.walk(tree)
        if isinstance(node, ast.stmt) and node.lineno <= mutant.line <= (node.end_lineno or node.lineno)
    ]  # fmt: skip
    return ast.unparse(min(around, key=lambda node: (node.end_lineno or node.lineno) - node.lineno)).partition("\n")[0]


def _of_file(path: Path, root: Path) -> Iterator[tuple[Mutant, Fault]]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    module = ".".join(path.relative_to(root).with_suffix("").parts).removesuffix(".__init__")
    compiled = any(_is_kernel(node) for node in ast.walk(tree))
    seen: dict[tuple[str, str, str], int] = {}
    for site in _sites(tree, module, compiled):
        fault = site.fault
        before = ast.unparse(fault.node)
        same = site.place, before, fault.instead
        nth = seen[same] = seen.get(same, -1) + 1
        name = path.relative_to(root).as_posix()
        kind = site.kernel, site.at_top, nth
        yield Mutant(name, site.place, fault.node.lineno, fault.operator, before, fault.instead, *kind), fault


def _sites(node: ast.AST, place: str, kernel: bool, at_top: bool = True) -> Iterator[_Site]:
    """The faults below a node. Names at a module's top belong to its kernels, if it has any."""
    for child in _code(node):
        inner, compiled, outside = place, kernel, at_top
        if isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            function = not isinstance(child, ast.ClassDef)
            inner, outside = f"{place}.{child.name}", at_top and not function
            compiled = _is_kernel(child) or (kernel and not at_top)
        yield from (_Site(inner, compiled, outside, fault) for fault in faults(child))
        yield from _sites(child, inner, compiled, outside)


def _code(node: ast.AST) -> Iterator[ast.AST]:
    """The parts of a node that are executed for what they do."""
    left_out = {"annotation", "returns", "decorator_list", "bases", "type_params"}
    for field, value in ast.iter_fields(node):
        for part in value if isinstance(value, list) else [value]:
            if isinstance(part, ast.AST) and field not in left_out and not _is_idle(part):
                yield part


def _is_idle(node: ast.AST) -> bool:
    """Whether a part is words, an alias of types, or for type checkers or commands alone."""
    if isinstance(node, ast.If):
        return "TYPE_CHECKING" in ast.unparse(node.test) or "__name__" in ast.unparse(node.test)
    return isinstance(node, ast.JoinedStr) or (isinstance(node, ast.Assign) and _is_alias(node))


def _is_alias(node: ast.Assign) -> bool:
    """Whether a statement names a union of types, such as ``Camera = Perspective | Orthographic``."""
    name = ast.unparse(node.targets[0]).lstrip("_")
    return isinstance(node.value, ast.BinOp) and name[:1].isupper() and not name.isupper()


def _is_kernel(node: ast.AST) -> bool:
    return isinstance(node, ast.FunctionDef) and any(
        ast.unparse(decorator).partition("(")[0].rpartition(".")[2] in _KERNELS for decorator in node.decorator_list
    )


def _spliced(text: str, fault: Fault) -> str:
    """``text`` with one node's code replaced; columns count bytes."""
    lines, node = text.encode().splitlines(keepends=True), fault.node
    assert node.end_lineno is not None and node.end_col_offset is not None
    begin = sum(map(len, lines[: node.lineno - 1])) + node.col_offset
    end = sum(map(len, lines[: node.end_lineno - 1])) + node.end_col_offset
    instead = fault.instead if isinstance(node, ast.stmt) else f"({fault.instead})"
    whole = b"".join(lines)
    return (whole[:begin] + instead.encode() + whole[end:]).decode()

"""Edits that break one statement: small functions over its syntax, which name none of its local variables.

An edit changes a statement's expression: what an assignment assigns, a ``return`` returns, an ``if`` asks, a ``for``
goes through. In the texts that replace a part, ``_`` stands for the part as it was; other names are the module's.
"""

import ast
import copy
from collections.abc import Callable, Iterator
from functools import reduce
from typing import TypeVar, cast

Edit = Callable[[ast.stmt], ast.stmt]
_Change = Callable[[ast.expr], ast.expr]
_Node = TypeVar("_Node", bound=ast.expr)

_COMPARISONS: dict[str, type[ast.cmpop]] = {
    "<": ast.Lt, "<=": ast.LtE, ">": ast.Gt, ">=": ast.GtE, "==": ast.Eq, "!=": ast.NotEq,
}  # fmt: skip
_BINARY: dict[str, type[ast.operator]] = {
    "+": ast.Add, "-": ast.Sub, "*": ast.Mult, "/": ast.Div, "%": ast.Mod, "@": ast.MatMult,
    "|": ast.BitOr, "&": ast.BitAnd,
}  # fmt: skip
_BOOLEAN: dict[str, type[ast.boolop]] = {"and": ast.And, "or": ast.Or}
# Where each kind of statement has its expression.
_FIELDS = {"test": (ast.If, ast.While), "iter": (ast.For,)}


def drop(statement: ast.stmt) -> ast.stmt:
    """The edit that leaves the statement out."""
    return ast.copy_location(ast.Pass(), statement)


def value(text: str) -> Edit:
    """The whole expression becomes ``text``."""
    return _edit(lambda whole: _filled(text, {"_": whole}))


def compare(symbol: str, right: str = "_", nth: int = 0) -> Edit:
    """The comparison with number ``nth`` becomes ``symbol``, its right side ``right``."""

    def change(node: ast.Compare) -> ast.expr:
        other = _filled(right, {"_": node.comparators[0]})
        return ast.Compare(node.left, [_COMPARISONS[symbol](), *node.ops[1:]], [other, *node.comparators[1:]])

    return _edit(lambda whole: _replaced(whole, _nth(_all(whole, ast.Compare), nth, "comparisons"), change))


def call(name: str, text: str, nth: int = 0) -> Edit:
    """The call with number ``nth`` of the function or method ``name`` becomes ``text``.

    There ``_0``, ``_1``, ... stand for its arguments, ``_key`` for the one named ``key``, ``_call`` for the function,
    and ``_self`` for a method's object.
    """

    def change(node: ast.Call) -> ast.expr:
        parts = {"_": node, "_call": node.func} | {f"_{i}": argument for i, argument in enumerate(node.args)}
        if isinstance(node.func, ast.Attribute):
            parts["_self"] = node.func.value
        return _filled(text, parts | {f"_{keyword.arg}": keyword.value for keyword in node.keywords})

    def found(whole: ast.expr) -> ast.Call:
        return _nth([node for node in _all(whole, ast.Call) if _name_of(node.func) == name], nth, f"calls of {name}")

    return _edit(lambda whole: _replaced(whole, found(whole), change))


def argument(nth: int, text: str) -> Edit:
    """Of the first call argument ``nth`` becomes ``text``."""

    def change(node: ast.Call) -> ast.expr:
        arguments = list(node.args)
        arguments[nth] = _filled(text, {"_": _nth(node.args, nth, "arguments")})
        return ast.Call(node.func, arguments, node.keywords)

    return _edit(lambda whole: _replaced(whole, _nth(_all(whole, ast.Call), 0, "calls"), change))


def operand(symbol: str, nth: int, text: str | None) -> Edit:
    """In the first chain of an operator, such as a + b + c, operand ``nth`` becomes ``text``; None leaves it out."""

    def change(node: ast.expr) -> ast.expr:
        parts = list(_operands(node, symbol))
        was = _nth(parts, nth, "operands")
        parts[nth : nth + 1] = [] if text is None else [_filled(text, {"_": was})]
        if symbol in _BOOLEAN:
            return parts[0] if len(parts) == 1 else ast.BoolOp(_BOOLEAN[symbol](), parts)
        return reduce(lambda left, right: ast.BinOp(left, _BINARY[symbol](), right), parts)

    def found(whole: ast.expr) -> ast.expr:
        chains = [node for node in _all(whole, ast.expr) if _is_chain(node, symbol)]
        return _nth(chains, 0, f"chains of {symbol}")

    return _edit(lambda whole: _replaced(whole, found(whole), change))


def without(symbol: str, nth: int) -> Edit:
    """``operand`` with number ``nth`` left out."""
    return operand(symbol, nth, None)


def element(nth: int, text: str) -> Edit:
    """In the first tuple element ``nth`` becomes ``text``."""

    def change(node: ast.Tuple) -> ast.expr:
        changed = list(node.elts)
        changed[nth] = _filled(text, {"_": _nth(node.elts, nth, "elements")})
        return ast.Tuple(changed, ast.Load())

    return _edit(lambda whole: _replaced(whole, _nth(_all(whole, ast.Tuple), 0, "tuples"), change))


def choice(test: str = "_", then: str = "_", otherwise: str = "_") -> Edit:
    """Of the first ``a if b else c`` the test b, a or c is changed."""

    def change(node: ast.IfExp) -> ast.expr:
        parts = zip((test, then, otherwise), (node.test, node.body, node.orelse), strict=True)
        return ast.IfExp(*(_filled(text, {"_": part}) for text, part in parts))

    return _edit(lambda whole: _replaced(whole, _nth(_all(whole, ast.IfExp), 0, "choices"), change))


def _edit(change: _Change) -> Edit:
    """The edit of a statement that changes its expression."""

    def edit(statement: ast.stmt) -> ast.stmt:
        edited = copy.deepcopy(statement)
        field = next((field for field, kinds in _FIELDS.items() if isinstance(edited, kinds)), "value")
        whole = getattr(edited, field, None)
        if not isinstance(whole, ast.expr):
            raise ValueError(f"edit: expected a statement with an expression, got {ast.unparse(statement)!r}")
        setattr(edited, field, change(whole))
        return ast.fix_missing_locations(edited)

    return edit


def _filled(text: str, parts: dict[str, ast.expr]) -> ast.expr:
    """The expression ``text`` with parts in the places of their names."""

    class Filler(ast.NodeTransformer):
        def visit_Name(self, node: ast.Name) -> ast.expr:
            return copy.deepcopy(parts.get(node.id, node))

    return cast(ast.expr, Filler().visit(ast.parse(text, mode="eval").body))


def _replaced(whole: ast.expr, node: _Node, change: Callable[[_Node], ast.expr]) -> ast.expr:
    """``whole`` with one of its nodes changed."""

    class Replacer(ast.NodeTransformer):
        def visit(self, inner: ast.AST) -> ast.AST:
            return change(node) if inner is node else self.generic_visit(inner)

    return cast(ast.expr, Replacer().visit(whole))


def _all(whole: ast.AST, kind: type[_Node]) -> list[_Node]:
    """The nodes of a kind in the order of the text, outer ones first."""
    inner = [node for child in ast.iter_child_nodes(whole) for node in _all(child, kind)]
    return [whole, *inner] if isinstance(whole, kind) else inner


def _nth(nodes: list[_Node], nth: int, what: str) -> _Node:
    if nth >= len(nodes):
        raise ValueError(f"edit: expected more than {nth} {what}, got {len(nodes)}")
    return nodes[nth]


def _name_of(function: ast.expr) -> str | None:
    return function.attr if isinstance(function, ast.Attribute) else getattr(function, "id", None)


def _is_chain(node: ast.expr, symbol: str) -> bool:
    kind = _BOOLEAN.get(symbol) or _BINARY[symbol]
    return isinstance(node, ast.BoolOp | ast.BinOp) and isinstance(node.op, kind)


def _operands(node: ast.expr, symbol: str) -> Iterator[ast.expr]:
    """a, b and c of the chain a + b + c, which is (a + b) + c."""
    if isinstance(node, ast.BoolOp):
        yield from node.values
    elif isinstance(node, ast.BinOp) and _is_chain(node, symbol):
        yield from _operands(node.left, symbol)
        yield node.right
    else:
        yield node

"""The standard ways to break code in one small place: each finds its places in a syntax tree and says what stands there
instead.

The operators are those of libraries for mutation testing, which rewrite files and run a test command. None of them
swaps arguments or drops statements, and none lets gates judge.
"""

import ast
from collections.abc import Iterator
from dataclasses import dataclass

_ARITHMETIC: dict[type[ast.operator], str] = {
    ast.Add: "-", ast.Sub: "+", ast.Mult: "/", ast.Div: "*", ast.FloorDiv: "*", ast.Mod: "*", ast.Pow: "*",
    ast.MatMult: "+", ast.LShift: ">>", ast.RShift: "<<", ast.BitAnd: "|", ast.BitOr: "&", ast.BitXor: "&",
}  # fmt: skip
# How each is written, and what stands instead.
_COMPARISONS: dict[type[ast.cmpop], tuple[str, str]] = {
    ast.Lt: ("<", "<="), ast.LtE: ("<=", "<"), ast.Gt: (">", ">="), ast.GtE: (">=", ">"), ast.Eq: ("==", "!="),
    ast.NotEq: ("!=", "=="), ast.Is: ("is", "is not"), ast.IsNot: ("is not", "is"), ast.In: ("in", "not in"),
    ast.NotIn: ("not in", "in"),
}  # fmt: skip
# Statements whose loss leaves all names bound.
_DROPPED = (ast.Expr, ast.AugAssign, ast.Delete, ast.Raise, ast.Break, ast.Continue)


@dataclass(frozen=True)
class Fault:
    """What an operator does at one node: the code that stands there instead, complete as an expression or statement."""

    operator: str
    node: ast.expr | ast.stmt
    instead: str


def faults(node: ast.AST) -> Iterator[Fault]:
    """Every fault of every operator at ``node`` itself, not below it."""
    for operator in (_arithmetic, _comparison, _constant, _swapped, _dropped, _range, _negated, _logic, _unary):
        yield from operator(node)


def _arithmetic(node: ast.AST) -> Iterator[Fault]:
    if isinstance(node, ast.BinOp):
        left, right = ast.unparse(node.left), ast.unparse(node.right)
        yield Fault("arithmetic", node, f"({left}) {_ARITHMETIC[type(node.op)]} ({right})")
    elif isinstance(node, ast.AugAssign):
        new = _ARITHMETIC[type(node.op)]
        yield Fault("arithmetic", node, f"{ast.unparse(node.target)} {new}= {ast.unparse(node.value)}")


def _comparison(node: ast.AST) -> Iterator[Fault]:
    if isinstance(node, ast.Compare):
        for k in range(len(node.ops)):
            terms = [f"({ast.unparse(node.left)})"]
            for j, (other, right) in enumerate(zip(node.ops, node.comparators, strict=True)):
                terms += [_COMPARISONS[type(other)][j == k], f"({ast.unparse(right)})"]
            yield Fault("comparison", node, " ".join(terms))


def _constant(node: ast.AST) -> Iterator[Fault]:
    if isinstance(node, ast.Constant):
        value = node.value
        if isinstance(value, bool):
            yield Fault("constant", node, str(not value))
        elif isinstance(value, int):
            yield Fault("constant", node, str(value + 1))
        elif isinstance(value, float):
            yield Fault("constant", node, repr(2.0 * value) if value else "1.0")


def _swapped(node: ast.AST) -> Iterator[Fault]:
    if isinstance(node, ast.Call):
        texts = [ast.unparse(argument) for argument in node.args]
        keywords = [ast.unparse(keyword) for keyword in node.keywords]
        for k in range(len(texts) - 1):
            pair = node.args[k : k + 2]
            # Exchanged words of a message are no fault of the code.
            words = any(isinstance(one, ast.JoinedStr | ast.Starred) or _is_text(one) for one in pair)
            if texts[k] != texts[k + 1] and not words:
                swapped = [*texts[:k], texts[k + 1], texts[k], *texts[k + 2 :], *keywords]
                yield Fault("swapped arguments", node, f"{ast.unparse(node.func)}({', '.join(swapped)})")


def _is_text(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, str)


def _dropped(node: ast.AST) -> Iterator[Fault]:
    text = isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
    store = isinstance(node, ast.Assign) and not any(
        isinstance(target, ast.Name | ast.Tuple) for target in node.targets
    )
    if (isinstance(node, _DROPPED) and not text) or store:
        assert isinstance(node, ast.stmt)
        yield Fault("dropped statement", node, "pass")


def _range(node: ast.AST) -> Iterator[Fault]:
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "range":
        texts = [ast.unparse(argument) for argument in node.args]
        last = 0 if len(texts) == 1 else 1
        yield Fault("range", node, f"range({', '.join([*texts[:last], f'{texts[last]} - 1', *texts[last + 1 :]])})")
        if len(texts) > 1:
            yield Fault("range", node, f"range({', '.join([f'{texts[0]} + 1', *texts[1:]])})")


def _negated(node: ast.AST) -> Iterator[Fault]:
    if isinstance(node, ast.If | ast.While | ast.IfExp):
        yield Fault("negated condition", node.test, f"not ({ast.unparse(node.test)})")


def _logic(node: ast.AST) -> Iterator[Fault]:
    if isinstance(node, ast.BoolOp):
        word = " or " if isinstance(node.op, ast.And) else " and "
        yield Fault("logic", node, word.join(f"({ast.unparse(value)})" for value in node.values))


def _unary(node: ast.AST) -> Iterator[Fault]:
    if isinstance(node, ast.UnaryOp) and not isinstance(node.op, ast.UAdd):
        yield Fault("unary", node, f"({ast.unparse(node.operand)})")

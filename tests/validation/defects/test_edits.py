"""Edits change the part of a statement that they name, and refuse a statement that has no such part."""

import ast

import pytest

from validation.defects.edits import Edit, argument, call, choice, compare, drop, element, operand, value, without


@pytest.mark.parametrize(
    ("edit", "before", "after"),
    [
        (drop, "x = 1", "pass"),
        (drop, "if a:\n    x = 1\nelse:\n    y = 2", "pass"),
        (value("_ * 2.0"), "x = a + b", "x = (a + b) * 2.0"),
        (value("0.0"), "return a", "return 0.0"),
        (value("False"), "if a > b:\n    x = 1", "if False:\n    x = 1"),
        (value("0.0"), "x += a", "x += 0.0"),
        (value("_[1:]"), "for k in range(3):\n    f(k)", "for k in range(3)[1:]:\n    f(k)"),
        (compare("<="), "x = a < b", "x = a <= b"),
        (compare(">", "2 * _", nth=1), "return a < b or c >= d", "return a < b or c > 2 * d"),
        (call("f", "g(_1, _0)"), "x = h(f(a, b))", "x = h(g(b, a))"),
        (call("f", "_0"), "x = m.f(a)", "x = a"),
        (call("f", "_call(_0, k=_k, l=True)"), "x = m.f(a, k=b)", "x = m.f(a, k=b, l=True)"),
        (call("all", "_self.any()"), "x = (a > b).all()", "x = (a > b).any()"),
        (call("f", "0", nth=1), "x, y = f(a), f(b)", "x, y = (f(a), 0)"),
        (argument(1, "max(_, 0)"), "f(a, g(b))", "f(a, max(g(b), 0))"),
        (without("and", 1), "x = a and b and c", "x = a and c"),
        (without("or", 0), "x = a or b", "x = b"),
        (without("+", 1), "x = a + b + c", "x = a + c"),
        (without("/", 1), "f(a / b + c)", "f(a + c)"),
        (operand("%", 0, "_ + 1"), "x = (a + b) % c", "x = (a + b + 1) % c"),
        (operand("-", 0, "0.5 * _"), "f(a - b * c)", "f(0.5 * a - b * c)"),
        (element(1, "(_[0], 0)"), "return (a, b)", "return (a, (b[0], 0))"),
        (choice(then="-_"), "x = a if b else c", "x = -a if b else c"),
        (choice(test="True"), "return (a, b if c else d)", "return (a, b if True else d)"),
        (choice(otherwise="_.ravel()"), "x = None if a else b", "x = None if a else b.ravel()"),
    ],
)
def test_an_edit_changes_its_part(edit: Edit, before: str, after: str) -> None:
    statement = ast.parse(before).body[0]
    assert ast.unparse(edit(statement)) == ast.unparse(ast.parse(after))
    assert ast.unparse(statement) == ast.unparse(ast.parse(before))


@pytest.mark.parametrize(
    ("edit", "statement", "message"),
    [
        (value("0"), "pass", "expected a statement with an expression, got 'pass'"),
        (value("0"), "return", "expected a statement with an expression"),
        (compare("<"), "x = a + b", "more than 0 comparisons, got 0"),
        (compare("<", nth=1), "x = a > b", "more than 1 comparisons, got 1"),
        (call("f", "0"), "x = g(a)", "more than 0 calls of f, got 0"),
        (argument(2, "0"), "f(a, b)", "more than 2 arguments, got 2"),
        (without("or", 0), "x = a and b", "more than 0 chains of or, got 0"),
        (without("and", 2), "x = a and b", "more than 2 operands, got 2"),
        (element(0, "0"), "x = [a, b]", "more than 0 tuples, got 0"),
        (choice(test="True"), "x = a", "more than 0 choices, got 0"),
        # The body of a statement is not its expression.
        (compare("<"), "if a:\n    x = b > c", "more than 0 comparisons, got 0"),
    ],
)
def test_a_part_that_is_not_there_is_refused(edit: Edit, statement: str, message: str) -> None:
    with pytest.raises(ValueError, match=f"edit: .*{message}"):
        edit(ast.parse(statement).body[0])

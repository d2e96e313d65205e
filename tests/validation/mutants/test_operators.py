"""Each operator breaks what it names, once a place, into code that compiles and differs."""

import ast

import pytest

from validation.mutants.operators import faults


def found(code: str) -> set[tuple[str, str]]:
    """Operator and new code of every fault in ``code``."""
    return {(fault.operator, fault.instead) for node in ast.walk(ast.parse(code)) for fault in faults(node)}


@pytest.mark.parametrize(
    ("code", "operator", "instead"),
    [
        ("a + b", "arithmetic", "(a) - (b)"),
        ("a // b", "arithmetic", "(a) * (b)"),
        ("a << b", "arithmetic", "(a) >> (b)"),
        ("a &= b", "arithmetic", "a |= b"),
        ("a < b", "comparison", "(a) <= (b)"),
        ("a < b == c", "comparison", "(a) < (b) != (c)"),
        ("a is not None", "comparison", "(a) is (None)"),
        ("x = 7", "constant", "8"),
        ("x = 0.25", "constant", "0.5"),
        ("x = 0.0", "constant", "1.0"),
        ("x = True", "constant", "False"),
        ("f(a, b, k=c)", "swapped arguments", "f(b, a, k=c)"),
        ("f(a)", "dropped statement", "pass"),
        ("a += b", "dropped statement", "pass"),
        ("a[0] = b", "dropped statement", "pass"),
        ("range(n)", "range", "range(n - 1)"),
        ("range(a, b, 2)", "range", "range(a, b - 1, 2)"),
        ("range(a, b)", "range", "range(a + 1, b)"),
        ("if a:\n    b", "negated condition", "not (a)"),
        ("x = a if b else c", "negated condition", "not (b)"),
        ("a and b", "logic", "(a) or (b)"),
        ("-a", "unary", "(a)"),
        ("not a", "unary", "(a)"),
    ],
)
def test_each_operator_breaks_its_place(code: str, operator: str, instead: str) -> None:
    assert (operator, instead) in found(code)


@pytest.mark.parametrize(
    "code",
    ['"""Words."""', "f(a, a)", "f('a', b)", "f(*a, b)", "x = 'text'", "x = None", "x = y", "x = +a", "x, y = a"],
)
def test_what_is_no_fault_is_left(code: str) -> None:
    assert not {one for one in found(code) if one != ("dropped statement", "pass") or not code.startswith("f(")}


def test_what_stands_instead_compiles_and_differs() -> None:
    code = "for i in range(1, n):\n    if not (a[i] <= -b % 3 and f(i, 2.5)):\n        c -= 1\n"
    tree = ast.parse(code)
    for node in ast.walk(tree):
        for fault in faults(node):
            assert ast.dump(ast.parse(fault.instead)) != ast.dump(ast.parse(ast.unparse(fault.node)))

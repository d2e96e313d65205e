"""What a defect breaks is found by its name, wherever it stands; a name that is not there once is an error."""

import ast
from pathlib import Path

import pytest

from validation.defects.changes import Constant, Function, Rule
from validation.defects.edits import compare, drop, value
from validation.defects.places import find_name, rules

SOURCE = '''
"""A module."""
from other import helper
STEP, HALF = 2.0**-20, 0.5

@kernel
def nearer(t, best):
    # rule: lowest-face
    if t < best:
        best = t
        # rule: reset
        t = 0.0
    # Why this is added.
    return best + 1.0

class Box:
    def nearer(self):
        # rule: in-python
        return "ü", STEP + 1.0
'''


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A package with one module two folders down."""
    folder = tmp_path / "package" / "deep"
    folder.mkdir(parents=True)
    (folder / "module.py").write_text(SOURCE, encoding="utf-8")
    return tmp_path / "package"


def plain(text: str) -> str:
    return ast.unparse(ast.parse(text))


@pytest.mark.parametrize(
    ("change", "was", "then", "compiled"),
    [
        (Rule("lowest-face", compare(">")), "if t < best", "if t > best", True),
        (Rule("reset", drop), "t = 0.0", "pass", True),
        (Rule("in-python", value("STEP")), 'return "ü", STEP + 1.0', "return STEP", False),
        (Constant("HALF", "0.25"), "STEP, HALF = 2.0**-20, 0.5", "STEP, HALF = 2.0**-20, 0.5\nHALF = 0.25", True),
    ],
)
def test_what_is_named_is_altered(package: Path, change: Rule | Constant, was: str, then: str, compiled: bool) -> None:
    altered = change.altered(package)
    assert SOURCE.count(was) == 1
    assert altered.text == plain(SOURCE.replace(was, then))
    assert (altered.module, altered.compiled) == ("package.deep.module", compiled)


def test_a_function_may_call_the_sound_one(package: Path) -> None:
    altered = Function("module.nearer", "def nearer(a, b):\n    return sound(a, b) + STEP").altered(package)
    assert "@kernel\ndef sound(t, best):" in altered.text
    assert "@kernel\ndef nearer(a, b):\n    return sound(a, b) + STEP" in altered.text


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (Rule("farther", drop), "rule: expected one 'farther', got none"),
        (Rule("lowest", drop), "rule: expected one 'lowest', got none"),
        (Rule("reset", value("elsewhere(_)")), r"expected names of the module, got \['elsewhere'\]"),
        (Constant("WHOLE", "1.0"), "name: expected one 'WHOLE', got none"),
        (
            Function("nearer", "def nearer(t): return t"),
            "got package.deep.module.nearer, package.deep.module.Box.nearer",
        ),
        (Function("module.nearer", "def nearer(t):\n    return t"), "module.nearer: expected 2 arguments, got 1"),
        (Function("STEP", "def STEP(): pass"), "STEP: expected a function"),
    ],
)
def test_what_is_not_there_once_is_refused(package: Path, change: Rule | Constant | Function, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        change.altered(package)


def test_a_rule_that_stands_twice_is_refused(package: Path) -> None:
    (package / "second.py").write_text("# rule: reset\nx = 1\n")
    assert rules(package) == ["lowest-face", "reset", "in-python", "reset"]
    with pytest.raises(ValueError, match=r"rule: expected one 'reset', got package\.deep.*: reset, package\.second"):
        Rule("reset", drop).altered(package)


def test_python_is_found_where_it_is_defined_or_imported(package: Path) -> None:
    assert find_name(package, "Box.nearer") == ("package.deep.module", "Box.nearer")
    assert find_name(package, "module.helper") == ("package.deep.module", "helper")
    with pytest.raises(ValueError, match=r"expected one .module\.other., got none"):
        find_name(package, "module.other")

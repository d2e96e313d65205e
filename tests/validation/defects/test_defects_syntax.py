"""A rule's address is its syntax in a named place: it survives moves and new layouts, and fails loudly otherwise."""

import ast
from pathlib import Path

import pytest

from validation.defects.syntax import find_place, replaced

SOURCE = '''
"""A module."""
STEP = 2.0**-20

def nearer(t, best):
    # Equal t: the lowest face.
    if t < best or (t == best and STEP > 0.0):
        best = t
        t = 0.0
    return (best +
            1.0)

class Box:
    def nearer(self):
        return "ü", STEP + 1.0
'''


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A package with one module two folders down."""
    folder = tmp_path / "package" / "deep"
    folder.mkdir(parents=True)
    (folder / "module.py").write_text(SOURCE, encoding="utf-8")
    return tmp_path / "package"


def broken(package: Path, place: str, rule: str, new: str) -> str:
    """The broken module, as Python writes it."""
    return ast.unparse(ast.parse(replaced(find_place(package, place), rule, new)))


PLAIN = ast.unparse(ast.parse(SOURCE))


@pytest.mark.parametrize(
    ("place", "rule", "new", "was", "then"),
    [
        ("module.nearer", "(t < best) or t == best and STEP > 0.", "t > best", "t < best or (t == best and STEP > 0.0)",
         "t > best"),
        ("module.nearer", "best+1.0", "best", "best + 1.0", "best"),
        ("module.nearer", "best = t\nt = 0.0", "pass", "best = t\n        t = 0.0", "pass"),
        ("module.nearer", "return best + 1.0", "best = 3.0\nreturn best", "return best + 1.0",
         "best = 3.0\n    return best"),
        ("STEP", "2.0**-20", "0.5", "2.0 ** (-20)", "0.5"),
        ("Box.nearer", "STEP + 1.0", "2.0", "STEP + 1.0", "2.0"),
        # The rule's names for local variables are its own.
        ("module.nearer", "a < b or (a == b and STEP > 0.0)", "a > b", "t < best or (t == best and STEP > 0.0)",
         "t > best"),
    ],
)  # fmt: skip
def test_a_rule_is_found_by_its_syntax(package: Path, place: str, rule: str, new: str, was: str, then: str) -> None:
    assert was in PLAIN
    assert broken(package, place, rule, new) == PLAIN.replace(was, then)


@pytest.mark.parametrize(
    ("place", "rule", "message"),
    [
        ("nearer", "best", "place: expected one 'nearer' in package, got package.deep.module.nearer, "),
        ("farther", "best", "place: expected one 'farther' in package, got none"),
        ("module.nearer", "best + 2.0", r"rule: .* once in package\.deep\.module\.nearer, got 0 times: 'best .* 2.0'"),
        ("module.nearer", "best", "got 4 times"),
        # A name that the module knows is no local variable; one variable has one name.
        ("module.nearer", "t < best or (t == best and OTHER > 0.0)", "got 0 times"),
        ("module.nearer", "a < b or (b == a and STEP > 0.0)", "got 0 times"),
    ],
)
def test_what_is_not_there_once_is_refused(package: Path, place: str, rule: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        replaced(find_place(package, place), rule, "0.0")


def test_a_letter_by_letter_match_comes_before_renamed_ones(tmp_path: Path) -> None:
    folder = tmp_path / "package"
    folder.mkdir()
    (folder / "m.py").write_text("def f(a, b):\n    return a + a, b + b\n")
    place = find_place(folder, "f")
    assert replaced(place, "b + b", "b") == "def f(a, b):\n    return a + a, (b)\n"
    with pytest.raises(ValueError, match="got 2 times"):
        replaced(place, "c + c", "c")


def test_it_moves_with_its_file(package: Path) -> None:
    before = broken(package, "STEP", "2.0**-20", "0.5")
    (package / "deep" / "module.py").rename(package / "elsewhere.py")
    assert broken(package, "STEP", "2.0**-20", "0.5") == before

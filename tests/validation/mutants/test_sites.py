"""Mutants are found, chosen and written the same way each time, and named so that other edits do not move them."""

import json
from pathlib import Path

import pytest

from validation.mutants.equivalent import EQUIVALENT, LEFT
from validation.mutants.sites import Mutant, chosen, mutants, statement_of, text_of
from validation.mutants.targets import TARGETS, files

ROOT = Path(__file__).parents[3]

CODE = '''"""A module of é."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import nothing as b

Either = int | float
SIZE = 2 * 3


def plain(a: "int | None", b=1):
    """Adds 1."""
    message = f"{a + 1}"
    return a + b + SIZE


@kernel
def fast(a):
    for i in range(a):
        a += i * i
    return a


class Box:
    """A class."""

    lid = 1.5

    @property
    def open(self):
        """Whether it is."""
        return not self.lid
'''


def every(package: Path) -> list[Mutant]:
    return mutants(sorted(package.rglob("*.py")), package.parent)


@pytest.fixture
def package(tmp_path: Path) -> Path:
    folder = tmp_path / "package"
    folder.mkdir()
    (folder / "module.py").write_text(CODE, encoding="utf-8")
    return folder


def test_words_and_types_are_left_and_all_else_is_found(package: Path) -> None:
    found = every(package)
    places = {(m.place.removeprefix("package.module"), m.before, m.instead) for m in found}
    assert ("", "2 * 3", "(2) / (3)") in places and (".plain", "a + b", "(a) - (b)") in places
    assert (".fast", "a += i * i", "pass") in places and (".Box.open", "not self.lid", "(self.lid)") in places
    assert not [m for m in found if "int" in m.before or "1}" in m.before or "TYPE" in m.before]
    assert {m.place.rpartition(".")[2] for m in found if m.kernel} == {"fast", "module"}
    assert {m.place.rpartition(".")[2] for m in found if m.at_top} == {"Box", "module"}


def test_each_is_one_edit_that_compiles(package: Path) -> None:
    seen = set()
    for mutant in every(package):
        text = text_of(mutant, package.parent)
        compile(text, "module.py", "exec")
        seen.add(text)
        changed = [new for old, new in zip(CODE.splitlines(), text.splitlines(), strict=True) if old != new]
        assert len(changed) == 1
    assert CODE not in seen and len(seen) == len(every(package))


def test_equal_code_in_one_place_is_told_apart(package: Path) -> None:
    (package / "module.py").write_text("def f(a):\n    return (a + 1) * (a + 1)\n", encoding="utf-8")
    twice = [m for m in every(package) if m.before == "a + 1"]
    assert [m.nth for m in twice] == [0, 1]
    assert text_of(twice[1], package.parent).endswith("(a + 1) * (((a) - (1)))\n")


def test_what_is_left_with_a_proof_or_a_reason_stands_where_it_stood() -> None:
    """A key counts equal faults of a function, so an edit may give it to another one: then the proof must be thought
    through again, and ``statements.json`` says where the fault stands now.
    """
    every = {mutant.key: mutant for target in TARGETS for mutant in mutants(files(target, ROOT), ROOT)}
    stood = json.loads((Path(__file__).parent / "statements.json").read_text(encoding="utf-8"))
    assert stood == {key: statement_of(every[key], ROOT) for key in [*EQUIVALENT, *LEFT]}
    assert not set(EQUIVALENT) & set(LEFT)


def test_a_fault_that_has_moved_to_another_statement_is_told(package: Path) -> None:
    def statement() -> str:
        [one] = (m for m in every(package) if m.before == "1" and m.nth == 0 and m.place.endswith(".f"))
        return statement_of(one, package.parent)

    path = package / "module.py"
    path.write_text("def f(a):\n    if a:\n        return a + 1\n", encoding="utf-8")
    assert statement() == "return a + 1"
    path.write_text("def f(a):\n    if a > 1:\n        return a + 1\n", encoding="utf-8")
    assert statement() == "if a > 1:"


def test_a_key_outlives_edits_elsewhere_and_names_code_that_went(package: Path) -> None:
    mutant = next(m for m in every(package) if m.before == "a + b")
    path = package / "module.py"
    path.write_text("# A new line.\n" + CODE, encoding="utf-8")
    assert "(a) - (b)" in text_of(mutant, package.parent)
    path.write_text(CODE.replace("a + b", "a"), encoding="utf-8")
    with pytest.raises(ValueError, match=r"expected 'a \+ b' in package\.module\.plain, got none"):
        text_of(mutant, package.parent)


def test_a_choice_depends_on_its_seed_alone_and_begins_with_smaller_ones(package: Path) -> None:
    found = every(package)
    some = chosen(found, 10, 3)
    assert chosen(found, 4, 3) == some[:4] and chosen(found, 10, 3) == some != chosen(found, 10, 4)
    assert sum(m.kernel for m in some) == 5
    with pytest.raises(ValueError, match="expected at most"):
        chosen(found, 1000, 3)


def test_without_kernels_all_are_of_other_code(package: Path) -> None:
    found = [m for m in every(package) if not m.kernel]
    assert len(chosen(found, 5, 3)) == 5


def test_what_judges_the_renderer_is_found_whole() -> None:
    names = {file.relative_to(ROOT).as_posix() for file in files("judges", ROOT)}
    assert {"validation/gates.py", "validation/oracle/exact.py", "validation/references/mitsuba/phong.py"} <= names
    assert not {name for name in names if "mutants" in name or "report" in name}
    for target in TARGETS:
        assert all(mutant.file.startswith(TARGETS[target]) for mutant in mutants(files(target, ROOT), ROOT))

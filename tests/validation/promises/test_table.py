"""The table of promises covers the public contract, and the judges that it names exist."""

import argparse
import ast
import json
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal

import pytest
from annotated_types import Predicate
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PlainValidator,
    StringConstraints,
    WrapValidator,
    create_model,
    field_validator,
    model_validator,
)

import renderer
from validation.promises.contract import pieces as contract
from validation.promises.contract import table
from validation.promises.contract.fields import described
from validation.promises.contract.pieces import Piece, pieces

ROOT = Path(__file__).parents[3]
ROWS = table.read()


def test_every_piece_of_the_contract_has_a_row_and_every_row_a_piece() -> None:
    """A docstring that changes, or is new, asks for a judge here."""
    named = [(row["where"], row["says"]) for row in ROWS]
    assert sorted(set(named)) == sorted(named)
    assert set(named) == set(map(tuple, contract.contract()))
    assert table.unjudged(ROWS) == []


def test_rows_name_judges_or_say_why_there_are_none() -> None:
    for row in ROWS:
        judged = bool(row.get("judges")) and bool(row.get("against"))
        assert judged != bool(row.get("why")), row


@cache
def names_in(path: str) -> set[str]:
    """The tests of a file, as ids end."""
    found = set()
    for node in ast.parse((ROOT / path).read_text(encoding="utf-8")).body:
        inner = node.body if isinstance(node, ast.ClassDef) else []
        for function in [node, *inner]:
            if isinstance(function, ast.FunctionDef | ast.AsyncFunctionDef):
                found.add(f"{node.name}::{function.name}" if inner else function.name)  # type: ignore[attr-defined]
    return found


@pytest.mark.parametrize("judge", sorted({judge for row in ROWS for judge in row.get("judges", [])}))
def test_each_judge_exists(judge: str) -> None:
    """Tests by their ids; gates by the names of those of the last whole run that became the baseline."""
    if judge.startswith("tests/"):
        path, _, name = judge.partition("::")
        assert name in names_in(path)
    else:
        assert table.named(judge, gates())


@cache
def gates() -> list[str]:
    return list(json.loads((ROOT / "reports" / "baseline.json").read_text(encoding="utf-8"))["gates"])


@pytest.mark.parametrize(
    "judge",
    [
        "promises: no such promise: times broken",
        "hits: *: no such quantity",
        "hits: : leaks",
        "leaks",
        "*leak",
        "*",
        "hits: *",
        "hits: *: *",
        "*: *: leaks",
        "*: leaks",
        "promises: *: times broken",
        "promises: * *: times broken",
        "promises: the*: times broken",
        "queries: *: wrong answers",
        "stability: *: holds",
        "hits: *rays: rays on which we are wrong",
    ],
)
def test_a_judge_that_is_none_is_told(judge: str) -> None:
    assert table.named(judge, gates()) == []


def test_a_judge_names_gates_of_its_quantity_and_of_like_subjects() -> None:
    several = ["a: point inside: wrong", "a: point inside: wrong: slow", "a: point beside: wrong", "a: ray: wrong",
               "a: ray: slow", "b: point inside: wrong"]  # fmt: skip
    assert table.named("a: ray: wrong", several) == ["a: ray: wrong"]
    assert table.named("a: point i*: wrong", several) == ["a: point inside: wrong"]
    assert table.named("a: point *: wrong", several) == ["a: point inside: wrong", "a: point beside: wrong"]
    assert table.named("a: *: slow", several) == ["a: point inside: wrong: slow", "a: ray: slow"]
    assert table.named("a: *: wrong", several) == table.named("b: point*: wrong", several) == []


def test_a_promise_without_a_judge_is_told() -> None:
    rows = [row for row in ROWS if row["where"] != "Mesh.is_closed"]
    rows += [{**row, "judges": []} for row in ROWS if row["where"] == "Mesh.is_closed"]
    assert {piece.where for piece in table.unjudged(rows)} == {"Mesh.is_closed"}


def test_texts_are_cut_into_sentences_and_definitions() -> None:
    text = """First sentence. Second one (see there).

    name       what it is,
               in two lines
    other, b : and this. It has two.

    >>> example = 1
    >>> example
    1
    """
    assert list(pieces("f", text)) == [
        Piece("f", "First sentence."), Piece("f", "Second one (see there)."),
        Piece("f", "name what it is, in two lines"), Piece("f", "other, b : and this. It has two."),
    ]  # fmt: skip


@pytest.mark.parametrize(
    "example",
    [
        "1 + 1\n2", "[1,\n... 2]\n[1,\n 2]", "print('So it is.')\nSo it is.", "a = 1",
        "import numpy", "a.save()", "with a:\n...     a.b\n3", "'# A comment.'\n'# A comment.'",
        "f(0)\nTraceback (most recent call last):\n    ...\nValueError: expected 1, got 0",
    ],
)  # fmt: skip
@pytest.mark.parametrize("between", ["", "\n"])
def test_a_sentence_below_an_example_is_a_piece(example: str, between: str) -> None:
    said = [piece.says for piece in pieces("f", f"As in:\n>>> {example}\n{between}Never fails. Sorted.\n>>> 3\n3\n")]
    assert said == ["As in:", "Never fails.", "Sorted."]


def test_a_sentence_of_one_word_is_one_and_a_heading_is_none() -> None:
    assert [piece.says for piece in pieces("f", "Sorted. Sources: A book.")] == ["Sorted.", "A book."]


def helped(monkeypatch: pytest.MonkeyPatch, **changes: Any) -> set[str]:
    """What is read of a parser of one command with one option, which ``changes`` alter."""
    parser = argparse.ArgumentParser("p", description="Does it.")
    parser.add_argument("--version", action="version", version=changes.pop("version", renderer.__version__))
    commands = parser.add_subparsers(metavar="command", required=changes.pop("command", True))
    command = commands.add_parser("c", help="short", epilog="Ends. Twice.")
    beside = command.add_mutually_exclusive_group() if changes.pop("alone", False) else command
    beside.add_argument("--other", action="store_true")
    option = {"type": int, "default": 3, "choices": None, "required": False, "help": "how many"} | changes
    names = option.pop("names", ["-n", "--number"])
    beside.add_argument(*names, **{name: value for name, value in option.items() if value is not ...})
    command.add_argument_group("more", "Grouped.")
    monkeypatch.setattr(contract.cli, "make_parser", lambda: parser)
    return {": ".join(piece) for piece in contract._helped()}


def test_the_texts_and_the_options_of_a_command_are_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    assert helped(monkeypatch) == {
        "p: Does it.", "p --version: prints __version__", "p command: 'c', required", "p c: short", "p c: Ends.",
        "p c: Twice.", "p c: Grouped.", "p c --other: a flag", "p c --number: how many",
        "p c --number: int, default 3, or -n",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"default": 4}, "p c --number: int, default 4, or -n"),
        ({"default": "3"}, "p c --number: int, default '3', or -n"),
        ({"choices": [3, 4]}, "p c --number: 3 or 4, default 3, or -n"),
        ({"required": True}, "p c --number: int, required, or -n"),
        ({"type": None}, "p c --number: text, default 3, or -n"),
        ({"help": None}, "p c --number: int, default 3, or -n"),
        ({"nargs": "?"}, "p c --number: ? of int, default 3, or -n"),
        ({"nargs": "?", "const": 7}, "p c --number: ? of int, sets number to 7, default 3, or -n"),
        ({"action": "append"}, "p c --number: int by _AppendAction, default 3, or -n"),
        ({"names": ["--number"]}, "p c --number: int, default 3"),
        ({"alone": True}, "p c --number: int, default 3, or -n, not with --other"),
        ({"version": "9.0"}, "p --version: prints '9.0'"),
        ({"command": False}, "p command: 'c', default None"),
    ],
)
def test_an_option_that_changes_is_described_otherwise(
    monkeypatch: pytest.MonkeyPatch, changes: dict[str, Any], says: str
) -> None:
    assert says in helped(monkeypatch, **changes)


def test_a_flag_tells_what_it_sets_and_what_stands_without_it(monkeypatch: pytest.MonkeyPatch) -> None:
    none = {"type": ..., "choices": ..., "names": ["--flag"]}
    assert "p c --flag: a flag" in helped(monkeypatch, action="store_true", **none, default=False)
    assert "p c --flag: a flag, default True" in helped(monkeypatch, action="store_true", **none, default=True)
    off = helped(monkeypatch, action="store_false", **none, default=True)
    assert "p c --flag: a flag, sets flag to False, default True" in off


def test_the_package_s_own_words_are_pieces() -> None:
    assert any(piece.where == "renderer" and "costs nothing" in piece.says for piece in contract.contract())


def abs_of(value: Any) -> Any:
    return abs(value)


def lines_of(**fields: Any) -> list[str]:
    """The lines of a record with such fields, (type, default) each, in which an ellipsis stands for no default."""
    return [line for _, line in described(create_model("Record", **fields))]


def test_fields_are_described_by_type_range_and_default() -> None:
    share = Annotated[float, Field(ge=0.0, lt=1.0, strict=True)]
    assert lines_of(size=(share, 0.5)) == ["float strict from 0.0 below 1.0; default 0.5"]
    assert lines_of(a=(tuple[share, share], ...), b=(tuple[share, ...], ())) == [
        "2 of (float strict from 0.0 below 1.0); required", "list of (float strict from 0.0 below 1.0); default ()",
    ]  # fmt: skip
    assert lines_of(a=(Literal["x", "y"], "x"), b=(dict[str, int | None], {}), c=(tuple[int, str], ...)) == [
        "'x' or 'y'; default 'x'", "table of int or None; default {}", "(int, str); required",
    ]  # fmt: skip


@pytest.mark.parametrize(
    "changed",
    [
        (Annotated[float, Field(ge=0.0, lt=1.0, strict=True)], 0.25),
        (Annotated[float, Field(ge=0.0, lt=1.0, strict=True)], ...),
        (Annotated[float, Field(gt=0.0, lt=1.0, strict=True)], 0.5),
        (Annotated[float, Field(ge=0.0, lt=2.0, strict=True)], 0.5),
        (Annotated[float, Field(ge=0.0, lt=1.0)], 0.5),
        (Annotated[float, Field(ge=0.0, lt=1.0, strict=True), BeforeValidator(abs_of)], 0.5),
        (Annotated[float, Field(ge=0.0, lt=1.0, strict=True), AfterValidator(abs_of)], 0.5),
        (Annotated[float, Field(ge=0.0, lt=1.0, strict=True, multiple_of=0.25)], 0.5),
        (Annotated[float, Field(ge=0.0, lt=1.0, strict=True, alias="b")], 0.5),
        (Annotated[float, Field(ge=0.0, lt=1.0, strict=True)], Field(default_factory=lambda: 0.25)),
        (Annotated[float, Field(ge=0.0, lt=1.0, strict=True, validation_alias="b")], 0.5),
        (Annotated[float, Field(ge=0.0, lt=1.0, strict=True, allow_inf_nan=True)], 0.5),
        (Annotated[float, Field(ge=0.0, lt=1.0, strict=True, frozen=True)], 0.5),
        (Annotated[float, Field(ge=0.0, lt=1.0, strict=True, description="how large")], 0.5),
        (Annotated[float, Field(ge=0.0, lt=1.0, strict=True), WrapValidator(lambda value, inner: value)], 0.5),
        (Annotated[float, Field(ge=0.0, lt=1.0, strict=True), PlainValidator(abs_of)], 0.5),
        (Annotated[float, Field(ge=0.0, lt=1.0, strict=True), Predicate(abs_of)], 0.5),
        (Annotated[int, Field(ge=0.0, lt=1.0, strict=True)], 0.5),
        (Annotated[float, Field(ge=0.0, lt=1.0, strict=True)] | None, 0.5),
    ],
)
def test_a_field_that_changes_is_described_otherwise(changed: Any) -> None:
    before = lines_of(size=(Annotated[float, Field(ge=0.0, lt=1.0, strict=True)], 0.5))
    assert lines_of(size=changed) != before


def above(least: float) -> AfterValidator:
    return AfterValidator(lambda value: max(value, least))


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (list[int], list[str]),
        (set[int], set[str]),
        (Sequence[int], Sequence[str]),
        (dict[str, int], dict[int, int]),
        (dict[str, int], dict[str, str]),
        (list[Annotated[str, Field(pattern="a")]], list[Annotated[str, Field(pattern="b")]]),
        (list[Annotated[int, above(1)]], list[Annotated[int, above(2)]]),
        (Annotated[str, StringConstraints(strip_whitespace=True)], Annotated[str, StringConstraints(to_upper=True)]),
    ],
)
def test_types_that_differ_within_are_described_otherwise(one: Any, other: Any) -> None:
    assert lines_of(of=(one, ...)) != lines_of(of=(other, ...))


def test_a_default_that_is_made_is_described_by_its_value() -> None:
    assert lines_of(of=(list[int], Field(default_factory=lambda: [1, 2]))) == ["list of (int); default [1, 2]"]


def test_what_a_record_inherits_is_told_of_its_writer_and_its_checks_are_named() -> None:
    class Base(BaseModel):
        model_config = ConfigDict(extra="forbid")
        size: float

        @field_validator("size")
        @classmethod
        def _is_even(cls, size: float) -> float:
            return size

        @model_validator(mode="after")
        def _fits(self) -> "Base":
            return self

    class Derived(Base):
        model_config = ConfigDict(frozen=True)
        name: str = "a"

        @field_validator("*", mode="before")
        @classmethod
        def _any(cls, value: Any) -> Any:
            return value

        @model_validator(mode="before")
        @classmethod
        def _plain(cls, values: Any) -> Any:
            return values

    assert list(described(Derived)) == [
        ("Base.size", "float; required; checked by is_even; checked before the others by any"),
        ("Derived.name", "str; default 'a'; checked before the others by any"),
        ("Base", "extra: forbid"),
        ("Derived", "extra: forbid; frozen: True"),
        ("Base", "its values are checked together by fits"),
        ("Derived", "its values are checked together before the others by plain"),
    ]

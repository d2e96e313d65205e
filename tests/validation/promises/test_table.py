"""The table of promises covers the public contract, and the judges that it names exist."""

import argparse
import ast
import json
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal

import pytest
from pydantic import AfterValidator, BaseModel, BeforeValidator, Field, create_model, field_validator, model_validator

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
        assert any(table.names_gate(judge, gate) for gate in gates())


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
    ],
)
def test_a_judge_that_is_none_is_told(judge: str) -> None:
    assert not any(table.names_gate(judge, gate) for gate in gates())


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


def test_a_sentence_of_one_word_is_one_and_a_heading_is_none() -> None:
    assert [piece.says for piece in pieces("f", "Sorted. Sources: A book.")] == ["Sorted.", "A book."]


def test_the_texts_and_the_options_of_a_command_are_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    def found(**changes: Any) -> set[str]:
        parser = argparse.ArgumentParser("p", description="Does it.")
        command = parser.add_subparsers(metavar="command").add_parser("c", help="short", epilog="Ends. Twice.")
        option = {"type": int, "default": 3, "choices": None, "required": False, "help": "how many"} | changes
        command.add_argument("-n", "--number", **option)
        monkeypatch.setattr(contract.cli, "make_parser", lambda: parser)
        return {": ".join(piece) for piece in contract._helped()}

    whole = {"p: Does it.", "p c: short", "p c: Ends.", "p c: Twice.", "p c --number: how many"}
    assert found() == {*whole, "p c --number: int, default 3"}
    assert found(default=4) == {*whole, "p c --number: int, default 4"}
    assert found(choices=[3, 4]) == {*whole, "p c --number: 3 or 4, default 3"}
    assert found(required=True) == {*whole, "p c --number: int, required"}
    assert "p c --number: int, default 3" in found(help=None)


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
        (Annotated[int, Field(ge=0.0, lt=1.0, strict=True)], 0.5),
        (Annotated[float, Field(ge=0.0, lt=1.0, strict=True)] | None, 0.5),
    ],
)
def test_a_field_that_changes_is_described_otherwise(changed: Any) -> None:
    before = lines_of(size=(Annotated[float, Field(ge=0.0, lt=1.0, strict=True)], 0.5))
    assert lines_of(size=changed) != before


def test_what_a_field_inherits_is_told_of_its_writer_and_its_checks_are_named() -> None:
    class Base(BaseModel):
        size: float

        @field_validator("size")
        @classmethod
        def _is_even(cls, size: float) -> float:
            return size

        @model_validator(mode="after")
        def _fits(self) -> "Base":
            return self

    class Derived(Base):
        name: str = "a"

    assert dict(described(Derived)) == {
        "Base.size": "float; required; checked by is_even",
        "Derived.name": "str; default 'a'",
        "Base": "its values are checked together by fits",
    }

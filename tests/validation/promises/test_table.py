"""The table of promises covers the public contract, and the judges that it names exist."""

import ast
from functools import cache
from pathlib import Path

import pytest

from validation.promises import contract, table
from validation.promises.contract import Piece, pieces
from validation.sections import NAMES

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
    """Tests by their ids; of gates, the section and the quantity, as the code or the baseline has it."""
    if judge.startswith("tests/"):
        path, _, name = judge.partition("::")
        assert name in names_in(path)
        return
    section, _, rest = judge.partition(": ")
    quantity = rest.rpartition(": ")[2]
    sources = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "validation").rglob("*.py"))
    baseline = (ROOT / "reports" / "baseline.json").read_text(encoding="utf-8")
    assert section in NAMES and f'{quantity}"' in sources + baseline


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

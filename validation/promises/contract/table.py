"""The table of promises: for each piece of the public contract, the tests and gates that would notice it broken."""

import tomllib
from pathlib import Path
from typing import Any

from validation.promises.contract.pieces import Piece, contract

TABLE = Path(__file__).with_name("table.toml")
# How much of a subject stands before a ``*``: "a" or "the" would begin very many.
_SHORTEST = 6


def read() -> list[dict[str, Any]]:
    """The rows in the file's order.

    Each has ``where`` and ``says``; a promise has ``judges``, tests by their ids and gates as "section: subject:
    quantity", see ``named``, and ``against``, what these compare with. Words, which no program
    can check, have ``why`` instead.
    """
    table = tomllib.loads(TABLE.read_text(encoding="utf-8"))
    return [*table["promise"], *table["words"]]


def named(judge: str, gates: list[str]) -> list[str]:
    """The gates that a judge of the table names: one, or with a ``*`` those with equal quantities and similar subjects.

    Section and quantity are named in full. ``*`` ends the subject, after some of its words, or is the subject. No judge
    is the half of a section, which would notice nearly any change and so say nothing of a promise.
    """
    section, _, rest = judge.partition(": ")
    subject, _, quantity = rest.rpartition(": ")
    begin = subject.removesuffix("*")
    if not subject or "*" in section + begin + quantity or (begin != subject and 0 < len(begin) < _SHORTEST):
        return []
    if begin == subject:
        return [gate for gate in gates if gate == judge]
    beside = [gate for gate in gates if gate.startswith(f"{section}: ")]
    found = [gate for gate in beside if gate.startswith(f"{section}: {begin}") and gate.rpartition(": ")[2] == quantity]
    return found if 2 * len(found) < len(beside) else []


def unjudged(rows: list[dict[str, Any]]) -> list[Piece]:
    """The pieces of the contract that are not in the table, or whose row names no judge."""
    judged = {(row["where"], row["says"]) for row in rows if row.get("judges") or row.get("why")}
    return [piece for piece in contract() if piece not in judged]

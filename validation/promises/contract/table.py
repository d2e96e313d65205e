"""The table of promises: for each piece of the public contract, the tests and gates that would notice it broken."""

import re
import tomllib
from pathlib import Path
from typing import Any

from validation.promises.contract.pieces import Piece, contract

TABLE = Path(__file__).with_name("table.toml")


def read() -> list[dict[str, Any]]:
    """The rows in the file's order.

    Each has ``where`` and ``says``; a promise has ``judges``, tests by their ids and gates as "section: subject:
    quantity", see ``names_gate``, and ``against``, what these compare with. Words, which no program
    can check, have ``why`` instead.
    """
    table = tomllib.loads(TABLE.read_text(encoding="utf-8"))
    return [*table["promise"], *table["words"]]


def names_gate(judge: str, gate: str) -> bool:
    """Whether a judge of the table names a gate; ``*`` stands for any part of the name of what is judged.

    The section and the quantity are named in full: else one judge would name gates that have nothing in common.
    """
    section, _, rest = judge.partition(": ")
    subject, _, quantity = rest.rpartition(": ")
    if not subject or "*" in section + quantity:
        return False
    return re.fullmatch(".*".join(map(re.escape, judge.split("*"))), gate) is not None


def unjudged(rows: list[dict[str, Any]]) -> list[Piece]:
    """The pieces of the contract that are not in the table, or whose row names no judge."""
    judged = {(row["where"], row["says"]) for row in rows if row.get("judges") or row.get("why")}
    return [piece for piece in contract() if piece not in judged]

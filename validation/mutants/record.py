"""The record of judged mutants: a file that a later run goes on from."""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from renderer.process.files import write_atomically
from validation.mutants.equivalent import EQUIVALENT, LEFT
from validation.mutants.sites import Mutant
from validation.mutants.verdict import Verdict

SCHEMA = 1
# What is kept of each: the mutant, the verdict, and the digests of its file and of its judges.
_COLUMNS = ("key", "file", "line", "operator", "kernel", "by", "gate", "how", "seconds", "source", "judges")
Row = dict[str, Any]


class Record:
    """The verdicts on mutants of one checkout, by their keys, kept in ``path``.

    A verdict holds while the mutant's file stays as it was; that nothing noticed a mutant, or no gate one in a kernel,
    holds only while the tests and the validation suite stay too.
    """

    def __init__(self, path: Path, root: Path) -> None:
        self.path, self._root = path, root
        self._judges, stored = _judges(root), _stored(path)
        self._rows = {row["key"]: row for row in stored["mutants"]}
        self.seed, self.asked = stored["seed"], len(stored["asked"])

    def row(self, mutant: Mutant) -> Row | None:
        """The stored row of a mutant, None where its verdict holds no longer."""
        row = self._rows.get(mutant.key)
        return row if row is not None and _holds(row, self._source(mutant), self._judges) else None

    def forget(self, mutants: Sequence[Mutant]) -> None:
        """Leave out what is stored of some mutants."""
        for mutant in mutants:
            self._rows.pop(mutant.key, None)

    def add(self, mutant: Mutant, verdict: Verdict) -> None:
        """Add a verdict."""
        state = {"key": mutant.key, "source": self._source(mutant), "judges": self._judges}
        whole = {**asdict(mutant), **asdict(verdict), **state}
        self._rows[mutant.key] = {column: whole[column] for column in _COLUMNS}

    def write(self, seed: int, asked: Sequence[Mutant]) -> None:
        """Write the file: all verdicts, a line each, and which mutants this run asked for."""
        rows = ",\n".join(json.dumps(row, ensure_ascii=False) for row in self._rows.values())
        keys = ",\n".join(json.dumps(mutant.key, ensure_ascii=False) for mutant in asked)
        text = f'{{"schema": {SCHEMA}, "seed": {seed}, "asked": [\n{keys}\n], "mutants": [\n{rows}\n]}}\n'
        write_atomically(self.path, lambda file: file.write(text.encode()))

    def _source(self, mutant: Mutant) -> str:
        return digest([self._root / mutant.file])


def digest(files: Sequence[Path]) -> str:
    """SHA-256 of files' names and contents."""
    found = hashlib.sha256()
    for file in sorted(files):
        content = file.read_bytes() if file.exists() else b""
        found.update(str(file.name).encode() + b"\0" + content + b"\0")
    return found.hexdigest()


def _judges(root: Path) -> str:
    return digest([*(root / "tests").rglob("*.py"), *(root / "validation").rglob("*.py")])


def _holds(row: Row, source: str, judges: str) -> bool:
    """Whether a verdict holds with the mutant's file and what judges it as they are."""
    settled = row["gate"] if row["kernel"] else bool(row["by"])
    return bool(row["source"] == source and (settled or _changes_nothing(row) or row["judges"] == judges))


def summary(path: Path, root: Path) -> dict[str, Any] | None:
    """What the last run found, for the report; None where there was none.

    ``seed``, ``asked`` (how many), ``judged``, and ``outdated``, how many verdicts do not hold for the checkout in
    ``root``; for ``kernels`` and ``python`` the counts of all, equivalent, killed, killed by a gate, hung and crashed,
    and the survivors' rows with the reasons why they are left, None where there is none; ``operators``, a row each;
    and ``equivalent``, mutants that change no answer, with the proofs.
    """
    stored = _stored(path)
    if not stored["asked"]:
        return None
    by_key = {row["key"]: row for row in stored["mutants"]}
    rows = [by_key[key] for key in stored["asked"] if key in by_key]
    same, judges = [row for row in rows if _changes_nothing(row)], _judges(root)
    return {
        "seed": stored["seed"],
        "asked": len(stored["asked"]),
        "judged": len(rows),
        "outdated": sum(not _holds(row, digest([root / row["file"]]), judges) for row in rows),
        "kernels": _counts([row for row in rows if row["kernel"]]),
        "python": _counts([row for row in rows if not row["kernel"]]),
        "operators": [
            {"operator": operator, **_counts([row for row in rows if row["operator"] == operator])}
            for operator in sorted({row["operator"] for row in rows})
        ],
        "equivalent": [{"key": row["key"], "proof": EQUIVALENT[row["key"]]} for row in same],
    }


def _counts(rows: Sequence[Row]) -> dict[str, Any]:
    real = [row for row in rows if not _changes_nothing(row)]
    return {
        "mutants": len(rows),
        "equivalent": len(rows) - len(real),
        "killed": sum(bool(row["by"]) for row in real),
        "by_gates": sum(bool(row["by"]) and row["gate"] for row in real),
        "hung": sum(row["how"] == "hangs" for row in real),
        "crashed": sum(row["how"] == "crashes" for row in real),
        "survivors": [
            {name: row[name] for name in ("key", "file", "line")} | {"reason": LEFT.get(row["key"])}
            for row in real
            if not row["by"]
        ],
    }


def _changes_nothing(row: Row) -> bool:
    return not row["by"] and row["key"] in EQUIVALENT


def _stored(path: Path) -> dict[str, Any]:
    """The file, or an empty one where there is none of this schema."""
    if path.exists():
        try:
            stored = json.loads(path.read_text(encoding="utf-8"))
        except ValueError as error:
            raise ValueError(f"{path}: expected JSON, got a syntax error: {error}") from None
        if isinstance(stored, dict) and stored.get("schema") == SCHEMA:
            return stored
    return {"seed": None, "asked": [], "mutants": []}

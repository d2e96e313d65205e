"""The record of judged mutants: a file that a later run goes on from."""

import hashlib
import json
import re
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from renderer.system.files import write_atomically
from validation.mutants.equivalent import EQUIVALENT, LEFT
from validation.mutants.sites import Mutant
from validation.mutants.verdict import Verdict

SCHEMA = 1
# What is kept of each: the mutant, the verdict, and the digests of its file and of its judges.
_COLUMNS = ("key", "file", "line", "operator", "kernel", "by", "gate", "how", "seconds", "source", "judges")
Row = dict[str, Any]


class Record:
    """The verdicts on mutants of one checkout, by their keys, kept in ``path``.

    A verdict holds while the mutant's file stays as it was; that a test noticed it, while that test is there; that
    nothing noticed it, or no gate one in a kernel, only while the tests and the validation suite stay too. Files count
    as they were when they were first asked for: mutants are judged in copies of about then.
    """

    def __init__(self, path: Path, root: Path) -> None:
        self.path, self._root = path, root
        self._judges, stored = _judges(root), _stored(path)
        self._rows = {row["key"]: row for row in stored["mutants"]}
        self._own: set[str] = set()
        self._sources: dict[str, str] = {}
        self.seed, self.asked = stored["seed"], len(stored["asked"])

    def row(self, mutant: Mutant) -> Row | None:
        """The stored row of a mutant, None where its verdict holds no longer."""
        row = self._rows.get(mutant.key)
        source = self._source(mutant)
        return row if row is not None and _holds(row, source, self._judges, self._root) else None

    def forget(self, mutants: Sequence[Mutant]) -> None:
        """Leave out what is stored of some mutants."""
        for mutant in mutants:
            self._own.add(mutant.key)
            self._rows.pop(mutant.key, None)

    def add(self, mutant: Mutant, verdict: Verdict) -> None:
        """Add a verdict."""
        state = {"key": mutant.key, "source": self._source(mutant), "judges": self._judges}
        whole = {**asdict(mutant), **asdict(verdict), **state}
        self._own.add(mutant.key)
        self._rows[mutant.key] = {column: whole[column] for column in _COLUMNS}

    def write(self, seed: int, asked: Sequence[Mutant]) -> None:
        """Write the file: all verdicts, a line each, and which mutants this run asked for.

        Verdicts that another run has written meanwhile stay.
        """
        for row in _stored(self.path)["mutants"]:
            if row["key"] not in self._own:
                self._rows[row["key"]] = row
        rows = ",\n".join(json.dumps(row, ensure_ascii=False) for row in self._rows.values())
        keys = ",\n".join(json.dumps(mutant.key, ensure_ascii=False) for mutant in asked)
        text = f'{{"schema": {SCHEMA}, "seed": {seed}, "asked": [\n{keys}\n], "mutants": [\n{rows}\n]}}\n'
        write_atomically(self.path, lambda file: file.write(text.encode()))

    def _source(self, mutant: Mutant) -> str:
        if mutant.file not in self._sources:
            self._sources[mutant.file] = digest([self._root / mutant.file], (self._root / mutant.file).parent)
        return self._sources[mutant.file]


def digest(files: Sequence[Path], root: Path) -> str:
    """SHA-256 of files' paths within ``root`` and contents."""
    found = hashlib.sha256()
    for file in sorted(files):
        content = file.read_bytes() if file.exists() else b""
        found.update(file.relative_to(root).as_posix().encode() + b"\0" + content + b"\0")
    return found.hexdigest()


def judging_files(root: Path) -> list[Path]:
    """The sources of tests and validation suite, without the reasons for mutants that are left: these judge nothing."""
    files = [file for name in ("tests", "validation") for file in (root / name).rglob("*.py")]
    return [file for file in files if file.name != "equivalent.py"]


def _judges(root: Path) -> str:
    return digest(judging_files(root), root)


def _holds(row: Row, source: str, judges: str, root: Path) -> bool:
    """Whether a verdict holds with the mutant's file and what judges it as they are."""
    settled = row["gate"] if row["kernel"] else bool(row["by"]) and _is_there(row["by"], root)
    return bool(row["source"] == source and (settled or _changes_nothing(row) or row["judges"] == judges))


def _is_there(by: str, root: Path) -> bool:
    """Whether what noticed a mutant is still there, if it is a test: its file, and in it its function."""
    if not by.startswith("tests/"):
        return True
    file, *names = by.partition("[")[0].split("::")
    path = root / file
    if not path.exists():
        return False
    return not names or re.search(rf"def {re.escape(names[-1])}\b", path.read_text(encoding="utf-8")) is not None


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
        "outdated": sum(
            not _holds(row, digest([root / row["file"]], (root / row["file"]).parent), judges, root) for row in rows
        ),
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
    """The file, or an empty record where there is none. Raises ``ValueError`` where it is no record of this schema."""
    if not path.exists():
        return {"seed": None, "asked": [], "mutants": []}
    try:
        stored = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise ValueError(f"{path}: expected JSON, got a syntax error: {error}") from None
    if not _is_record(stored):
        raise ValueError(f"{path}: expected a record of mutants of schema {SCHEMA}, got another file; move it away")
    return dict(stored)


def _is_record(stored: Any) -> bool:
    if not isinstance(stored, dict) or stored.get("schema") != SCHEMA or not isinstance(stored.get("seed"), int):
        return False
    asked, rows = stored.get("asked"), stored.get("mutants")
    if not isinstance(asked, list) or not isinstance(rows, list):
        return False
    return all(isinstance(key, str) for key in asked) and all(
        isinstance(row, dict) and set(_COLUMNS) <= set(row) for row in rows
    )

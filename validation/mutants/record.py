"""The record of judged mutants: a file that a later run goes on from."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from renderer.process.files import write_atomically
from validation.mutants.equivalent import EQUIVALENT
from validation.mutants.judge import Verdict
from validation.mutants.sites import Mutant

SCHEMA = 1
Row = dict[str, Any]


class Record:
    """The verdicts on mutants of one checkout, by their keys, kept in ``path``.

    A verdict holds while the mutant's file stays as it was; that nothing noticed a mutant holds only while the tests
    and the validation suite stay too.
    """

    def __init__(self, path: Path, root: Path) -> None:
        self.path, self._root = path, root
        self._judges = digest([*(root / "tests").rglob("*.py"), *(root / "validation").rglob("*.py")])
        self._rows: dict[str, Row] = {}
        if path.exists():
            stored = json.loads(path.read_text(encoding="utf-8"))
            if stored.get("schema") == SCHEMA:
                self._rows = {row["key"]: row for row in stored["mutants"]}

    def row(self, mutant: Mutant) -> Row | None:
        """The stored row of a mutant, None where its verdict holds no longer."""
        row = self._rows.get(mutant.key)
        if row is None or row["source"] != self._source(mutant) or (not row["by"] and row["judges"] != self._judges):
            return None
        return row

    def add(self, mutant: Mutant, verdict: Verdict) -> None:
        """Add a verdict and write the file."""
        self._rows[mutant.key] = {
            "key": mutant.key,
            **asdict(mutant),
            **asdict(verdict),
            "source": self._source(mutant),
            "judges": self._judges,
        }
        text = json.dumps({"schema": SCHEMA, "mutants": list(self._rows.values())}, indent=1, ensure_ascii=False)
        write_atomically(self.path, lambda file: file.write((text + "\n").encode()))

    def _source(self, mutant: Mutant) -> str:
        return digest([self._root / mutant.file])


def digest(files: Sequence[Path]) -> str:
    """SHA-256 of files' names and contents."""
    found = hashlib.sha256()
    for file in sorted(files):
        found.update(str(file.name).encode() + b"\0" + file.read_bytes() + b"\0")
    return found.hexdigest()


def summary(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Counts, for mutants in kernels and in Python: all, equivalent, killed, killed by a gate, and the survivors."""
    found: dict[str, Any] = {}
    for kind, kernel in (("kernels", True), ("python", False)):
        own = [row for row in rows if row["kernel"] == kernel]
        real = [row for row in own if row["by"] or row["key"] not in EQUIVALENT]
        found[kind] = {
            "mutants": len(own),
            "equivalent": len(own) - len(real),
            "killed": sum(bool(row["by"]) for row in real),
            "by_gates": sum(bool(row["by"]) and row["gate"] for row in real),
            "hung": sum(row["how"] == "hangs" for row in real),
            "crashed": sum(row["how"] == "crashes" for row in real),
            "survivors": [row["key"] for row in real if not row["by"]],
        }
    return found

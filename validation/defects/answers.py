"""The answers of processes with defects, and those of a run that was interrupted."""

import json
import threading
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from renderer.system.files import write_atomically

# In place of a red gate, of checks that did not end in that time.
HANGS = "defects: the checks: do not end"


@dataclass(frozen=True)
class Answer:
    """Results of the checks in one process: names of all gates and of the failing ones, its error, its seconds.

    A gate's name is its section, subject and quantity; checks that do not end count as one red, ``HANGS``. An error is
    not a verdict of any gate.
    """

    gates: tuple[str, ...]
    red: tuple[str, ...]
    error: str | None
    seconds: float


def together(answers: Sequence[Answer]) -> Answer:
    """The answers of processes for one group each, as of one process for all."""
    gates = tuple(name for answer in answers for name in answer.gates)
    red = tuple(name for answer in answers for name in answer.red)
    error = next((answer.error for answer in answers if answer.error), None)
    return Answer(gates, red, error, sum(answer.seconds for answer in answers))


class Known:
    """Answers so far, in a file that lasts until its run is whole: a run that was interrupted goes on from there.

    They are those of ``sources``, a digest; a file of other sources counts as empty. An error is no answer.
    """

    def __init__(self, path: Path | None = None, sources: str = "") -> None:
        self._path, self._sources, self._lock = path, sources, threading.Lock()
        self.answers: dict[str, Answer] = {}
        if path is not None and path.exists():
            stored = json.loads(path.read_text(encoding="utf-8"))
            if stored["sources"] == sources:
                self.answers = {name: _answer_of(row) for name, row in stored["answers"].items()}

    def add(self, name: str, answer: Answer) -> None:
        """Keep one more answer."""
        if answer.error is not None:
            return
        with self._lock:
            self.answers[name] = answer
            if self._path is not None:
                rows = {name: asdict(answer) for name, answer in self.answers.items()}
                text = json.dumps({"sources": self._sources, "answers": rows})
                write_atomically(self._path, lambda file: file.write(text.encode()))

    def forget(self) -> None:
        """Remove the file."""
        if self._path is not None:
            self._path.unlink(missing_ok=True)


def _answer_of(row: dict[str, Any]) -> Answer:
    return Answer(tuple(row["gates"]), tuple(row["red"]), row["error"], row["seconds"])

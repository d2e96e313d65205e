"""Schema of ``metrics.json``, checked on writing and reading; reports/README.md explains the keys."""

import json
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

VERSION = 3

_Seconds = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid")


class GateRecord(_Strict):
    """A gate as ``Gate.record`` gives it; None is a value that is not a number, which never passes."""

    section: str
    subject: str
    quantity: str
    value: float | None
    bound: Literal["at most", "at least"]
    threshold: float
    margin: float | None
    reason: str
    judged: list[str]
    passed: bool

    @model_validator(mode="after")
    def _verdict_follows(self) -> "GateRecord":
        """A stored verdict must follow from its own numbers."""
        low, high = (self.value, self.threshold) if self.bound == "at most" else (self.threshold, self.value)
        holds = low is not None and high is not None and low <= high
        if holds is not self.passed:
            raise ValueError(f"passed is {self.passed}, but the value is {self.value}, {self.bound} {self.threshold}")
        return self


class SectionRecord(BaseModel):
    """The keys of every section's record, which has more of its own; a cost of None is unknown within the seconds."""

    model_config = ConfigDict(extra="allow")

    seconds: _Seconds
    costs: dict[str, _Seconds | None]


class Verdict(_Strict):
    """The outcome in numbers; ``passed`` is False where nothing was judged."""

    passed: bool
    gates: int
    failed: int


class Fact(_Strict):
    """One number at the head of the report."""

    value: float | None
    label: str


class MatrixRow(_Strict):
    """A section with its gates, and the seconds of each reference that judged it, None where they are unknown."""

    section: str
    gates: int
    failed: int
    seconds: _Seconds
    references: dict[str, _Seconds | None]


class ThresholdChanges(_Strict):
    """The file that changed thresholds, and each change by the key's path: from and to."""

    file: str | None
    moved: dict[str, tuple[float | None, float | None]]


class Metrics(_Strict):
    """The whole file. Sections that did not run are absent; ``left_out`` gives the reasons."""

    version: Literal[3] = Field(alias="schema")
    command: str
    quick: bool
    own: bool
    started: str
    seconds: _Seconds
    verdict: Verdict
    facts: list[Fact]
    matrix: list[MatrixRow]
    thresholds: ThresholdChanges
    gates: list[GateRecord]
    left_out: dict[str, str]
    baseline: dict[str, Any]
    environment: dict[str, Any]
    images: SectionRecord | None = None
    hits: SectionRecord | None = None
    queries: SectionRecord | None = None
    studies: SectionRecord | None = None
    promises: SectionRecord | None = None
    stability: SectionRecord | None = None
    random: SectionRecord | None = None
    efficiency: SectionRecord | None = None
    defects: dict[str, Any] | None = None


def check(metrics: Any, name: str = "metrics") -> None:
    """Raises ``ValueError`` that names the key, the expected value and the one found."""
    try:
        Metrics.model_validate(metrics)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(key) for key in first["loc"]) or "top level"
        got = "" if first["type"] == "missing" else f", got {str(first['input'])[:80]}"
        raise ValueError(f"{name}: {where}: {first['msg']}{got}") from None


def read(path: Path) -> dict[str, Any]:
    """A checked ``metrics.json``. Raises ``ValueError`` for an invalid file, ``OSError`` for an unreadable one."""
    try:
        metrics = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise ValueError(f"{path}: expected JSON, got a syntax error: {error}") from None
    check(metrics, str(path))
    return dict(metrics)


def text(metrics: dict[str, Any]) -> bytes:
    """Checked metrics as the bytes of the file; equal metrics give equal bytes."""
    check(metrics)
    return (json.dumps(metrics, indent=1, allow_nan=False, ensure_ascii=False) + "\n").encode()

"""The verdict on one mutant."""

from dataclasses import dataclass
from typing import Literal

How = Literal["fails", "crashes", "hangs"]


@dataclass(frozen=True)
class Verdict:
    """What noticed a mutant.

    by       the name of the gate, or the test; None where nothing did
    gate     whether it was a gate
    how      what the mutant did
    seconds  that it took
    """

    by: str | None
    gate: bool
    how: How | None
    seconds: float

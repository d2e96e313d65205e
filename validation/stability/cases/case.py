"""Extreme cases: one table that the tests and the report read.

A case constructs something stiff, says what must come out and who says so, runs it, and tells what came out of ours
and of the references. A reference that fails is shown as it is; only ours decides whether the case holds.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

# Exact rational arithmetic, our own brute force bit for bit, an analytic value, Embree robust, a documented policy.
Judge = Literal["exact", "brute force", "analytic", "Embree", "policy"]


@dataclass(frozen=True)
class Outcome:
    """What came out: one short text each, None for a reference that has no say, and whether ours is as expected."""

    ours: str
    holds: bool
    embree_default: str | None = None
    embree_robust: str | None = None
    mitsuba: str | None = None


@dataclass(frozen=True)
class ExtremeCase:
    """One row of the table. ``tolerance`` says how close ours must come and why; ``run(quick)`` does it."""

    number: int
    construct: str
    expected: str
    judges: tuple[Judge, ...]
    tolerance: str
    run: Callable[[bool], Outcome]

    def record(self, quick: bool) -> dict[str, object]:
        """Run the case; everything for JSON. A case that raises does not hold; a missing reference is no such case."""
        try:
            outcome = self.run(quick)
        except ImportError:
            raise
        except Exception as error:
            outcome = Outcome(f"{type(error).__name__}: {error}", holds=False)
        return {
            "number": self.number,
            "construct": self.construct,
            "expected": self.expected,
            "judges": list(self.judges),
            "tolerance": self.tolerance,
            "ours": outcome.ours,
            "holds": outcome.holds,
            "embree_default": outcome.embree_default,
            "embree_robust": outcome.embree_robust,
            "mitsuba": outcome.mitsuba,
        }

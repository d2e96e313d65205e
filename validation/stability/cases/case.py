"""Extreme cases: one table for the tests and the report.

A case constructs extreme input, states the expected result and its judges, and runs our renderer and the references.
Failures of a reference are only shown; ours alone decides whether the case holds.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

# Exact rational arithmetic, our own brute force bit for bit, a closed form, Embree robust, a documented rule.
Judge = Literal["exact", "brute force", "closed form", "Embree", "rule"]


@dataclass(frozen=True)
class Outcome:
    """One short text for each result, None for a reference that does not apply, and whether ours is as expected."""

    ours: str
    holds: bool
    embree_default: str | None = None
    embree_robust: str | None = None
    mitsuba: str | None = None


@dataclass(frozen=True)
class ExtremeCase:
    """One row of the table. ``tolerance`` says how close ours must come and why; ``run(quick)`` runs the case."""

    number: int
    construct: str
    expected: str
    judges: tuple[Judge, ...]
    tolerance: str
    run: Callable[[bool], Outcome]

    def record(self, quick: bool) -> dict[str, object]:
        """Run the case and return its row for JSON.

        A case that raises does not hold; only a missing reference (``ImportError``) is passed on.
        """
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

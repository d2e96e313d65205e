"""The checks of view factors as tasks, their record, and the gates on it."""

from collections.abc import Iterator
from functools import partial
from typing import Any

from validation.gates import Gate
from validation.job import Job, Task
from validation.studies.factors import embree, errors, forms, laws, points
from validation.studies.factors.rooms import ROOMS

_FORM = "eight standard errors, which chance exceeds once in 11,000; an exact entry: 1e-9 of the area"
_ASKED = "a row has rays until the root of the sum of its squared errors is at most rtol"
_APART = "chance is beyond five standard errors once in two million"
_SLOPE = "random rays give -1/2; chance in the mean of some dozen errors moves that by less than 0.05"
_HONEST = "a stated error is that of eight sequences: squares vary by a half, and their mean over entries by less"
_LAW = "exact: it must hold for every answer"
_WASTE = "errors stated twice as large as they are take four times the rays"
_MATRIX = ("studies.view_factors",)
_POINTS = ("studies.view_factors_from",)


def run(job: Job) -> list[Gate]:
    """The gates of all checks."""
    return gates(record(iter(job.each(tasks(job.quick)))))


def tasks(quick: bool) -> list[Task]:
    """One for each closed form, law, room beside Embree, and curve of errors."""
    return [
        *(Task(f"view factors: {name}", partial(forms.check, name, quick)) for name in forms.FORMS),
        *(Task(f"view factors: {name}", partial(points.check, name, quick)) for name in points.CHECKS),
        *(Task(f"view factors: {name}", partial(laws.check, name)) for name in laws.CHECKS),
        *(Task(f"view factors: {name} beside Embree", partial(embree.check, name, quick)) for name in ROOMS),
        *(Task(f"view factors: errors of {name}", partial(errors.check, name, quick)) for name in errors.FORMS),
    ]


def record(found: Iterator[dict[str, Any]]) -> dict[str, list[dict[str, Any]]]:
    """The results of the tasks, in their order."""
    return {
        "forms": [next(found) for _ in forms.FORMS],
        "points": [next(found) for _ in points.CHECKS],
        "laws": [next(found) for _ in laws.CHECKS],
        "embree": [next(found) for _ in ROOMS],
        "errors": [next(found) for _ in errors.FORMS],
    }


def gates(found: dict[str, list[dict[str, Any]]]) -> list[Gate]:
    """The gates on a record."""
    return [
        *(_gate(row, "error over what is allowed", "share_of_allowed", 1.0, _FORM) for row in found["forms"]),
        *(_gate(row, "error over what is allowed", "share_of_allowed", 1.0, _FORM, _POINTS)
          for row in found["points"]),
        *(_gate(row, "stated error over that requested", "share_of_asked", 1.0, _ASKED) for row in found["forms"]),
        *(_gate(row, "standard errors from Embree's rays", "apart", embree.ERRORS, _APART) for row in found["embree"]),
        *(_gate(row, "slope of the error", "slope", errors.SLOPE, _SLOPE) for row in found["errors"]),
        *(_gate(row, "mean square of true over stated error", "ratio", errors.HONEST, _HONEST)
          for row in found["errors"]),
        *(Gate("studies", row["subject"], "mean square of true over stated error", float(row["ratio"]), "at least",
               errors.WASTE, _WASTE, _MATRIX)
          for row in found["errors"]),
        *(_gate(row, "wrong answers", "wrong", 0.0, _LAW, row["judged"]) for row in found["laws"]),
    ]  # fmt: skip


def _gate(
    row: dict[str, Any], quantity: str, key: str, most: float, reason: str, judged: tuple[str, ...] = _MATRIX
) -> Gate:
    return Gate("studies", row["subject"], quantity, float(row[key]), "at most", most, reason, judged)

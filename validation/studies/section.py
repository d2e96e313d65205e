"""The section on studies: skies, sun, occlusion and view factors against closed forms, Embree and exact bits."""

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

from validation.gates import Gate
from validation.job import Job, Task
from validation.studies import bits, bodies, corners, forms, holds, picture
from validation.studies.factors import judge as factors
from validation.studies.lit import judge as lit

# Points and directions of each mesh whose bits are judged. All faces of most meshes: only points that lie as dense as
# faces are traced together.
_QUICK, _FULL = (6_000, 64), (6_000, 577)
JUDGES = ("closed form", "Embree robust", "exact arithmetic")
_BITS = (
    "exact: of each bit on which Embree differs, and of a sample of the others, exact arithmetic decides who is right"
)
_BOUND = "the bound: each patch along the boundary wrong by half of its weight, all to one side"
_SLOPE = "random directions give -1/2; an even lattice does better"
_NAMED = "exact: the normal decides on which side rays start, whichever face is named"
_HOLDS = "exact: it must hold for every answer"
PICTURE = "studies-town.png"


def steps(job: Job) -> int:
    """Number of calls of ``job.step``: one for each closed form, mesh and check, one for the slope, one to draw."""
    return len(_tasks(job)) + len(factors.tasks(job.quick)) + len(lit.tasks(job.quick))


def run(job: Job) -> tuple[dict[str, Any], list[Gate]]:
    """Ask all questions and draw a picture; returns a record for JSON and the gates."""
    found = iter(job.each([*_tasks(job), *factors.tasks(job.quick), *lit.tasks(job.quick)]))
    record, gates = _judged(found)
    exchanged, lighted = factors.record(found), lit.record(found)
    return record | {"factors": exchanged, "lit": lighted}, [*gates, *factors.gates(exchanged), *lit.gates(lighted)]


def without_factors(job: Job) -> list[Gate]:
    """The gates of all checks but those of view factors and radiosity."""
    return _judged(iter(job.each(_tasks(job))))[1]


def _judged(found: Iterator[dict[str, Any]]) -> tuple[dict[str, Any], list[Gate]]:
    """The record and the gates of what the tasks of this module found, in their order."""
    shares = [next(found) for _ in forms.forms()]
    slopes = next(found)["curves"]
    bit_rows = [next(found) for _ in bodies.bodies()]
    corner_rows = [next(found) for _ in corners.CHECKS]
    held = [next(found) for _ in holds.CHECKS]
    drawn = next(found)
    gates = [
        *(Gate("studies", row["subject"], "error over its bound", row["share_of_bound"], "at most", 1.0, _BOUND,
               (f"studies.{row['study']}",))
          for row in shares),
        *(Gate("studies", row["subject"], "slope of the error", row["slope"], "at most", forms.SLOPE, _SLOPE,
               ("studies.sky_view_factor",))
          for row in slopes),
        *(Gate("studies", row["subject"], "wrong bits", float(row["wrong"]), "at most", 0.0, _BITS,
               ("studies.occlusion",))
          for row in (*bit_rows, *corner_rows)),
        *(Gate("studies", row["subject"], "points whose sky changes when their face is named", float(row["unlike"]),
               "at most", 0.0, _NAMED, ("studies.sky_view_factor",)) for row in corner_rows),
        *(Gate("studies", row["subject"], "wrong answers", float(row["wrong"]), "at most", 0.0, _HOLDS, row["judged"])
          for row in held),
    ]  # fmt: skip
    record = {"forms": shares, "slopes": slopes, "bits": bit_rows, "corners": corner_rows, "holds": held,
              "picture": drawn, "patches": list(forms.PATCHES), "costs": dict.fromkeys(JUDGES)}  # fmt: skip
    return record, gates


def _tasks(job: Job) -> list[Task]:
    points, directions = _QUICK if job.quick else _FULL
    return [
        *(Task(f"studies: {form.name}", partial(forms.check_form, index, job.quick))
          for index, (form, _) in enumerate(forms.forms())),
        Task("studies: error against directions", partial(forms.check_slope, job.quick)),
        *(Task(f"studies: bits of {name}", partial(bits.check_bits, name, points, directions))
          for name in bodies.bodies()),
        *(Task(f"studies: bits at {kind} of {name}", partial(corners.check_corners, index, job.quick))
          for index, (name, kind) in enumerate(corners.CHECKS)),
        *(Task(f"studies: {name}", partial(holds.check, name)) for name in holds.CHECKS),
        Task("studies: picture", partial(picture.write, Path(job.folder) / PICTURE)),
    ]  # fmt: skip

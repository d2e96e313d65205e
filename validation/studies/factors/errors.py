"""How fast errors of view factors fall with the number of rays, and whether they are as large as is stated."""

from typing import Any

import numpy as np

from renderer.octree import Octree
from renderer.studies import view_factors
from validation.error_curves import slope
from validation.studies.factors.forms import Form, box_in_room, disc_between, street_with_block

_QUICK = tuple(1 << k for k in range(8, 15, 2))
_FULL = tuple(1 << k for k in range(8, 19, 2))
# So small that only the largest number of rays ends a row.
_NEVER = 1e-9
FORMS = {form.__name__: form for form in (street_with_block, box_in_room, disc_between)}
# Chance has -1/2. Errors of some dozen entries as a mean square vary by a tenth from one number of rays to the next,
# which moves the slope over four or six of them by less than this.
SLACK = 0.05
SLOPE = -0.5 + SLACK
# Squares of errors over those that are stated, in the mean.
HONEST = 2.0


def check(name: str, quick: bool) -> dict[str, Any]:
    """A row: true and stated errors as a mean square for each number of rays, their slope, and their mean ratio."""
    form, counts = FORMS[name](), _QUICK if quick else _FULL
    curves = [_errors(form, count) for count in counts]
    true, stated = ([float(np.sqrt(np.mean(part**2))) for part in parts] for parts in zip(*curves, strict=True))
    # Over all numbers of rays: of each the mean of squares over that of those stated.
    ratio = float(np.mean([(a / b) ** 2 for a, b in zip(true, stated, strict=True)]))
    falls = slope(counts, true)
    return {"subject": f"errors of {form.name}", "counts": list(counts), "entries": len(curves[0][0]), "rms": true,
            "stated": stated, "slope": np.nan if falls is None else falls, "ratio": ratio}  # fmt: skip


def _errors(form: Form, count: int) -> tuple[Any, Any]:
    """The error of each entry that has one, and the standard error that is stated."""
    octree = Octree.from_mesh(form.room.mesh)
    found = view_factors(octree, form.room.groups, rtol=_NEVER, max_rays=count, **form.options)
    exchange, stated, areas = found.exchange.toarray(), found.errors.toarray(), found.areas
    chosen = [entry for entry in form.entries if stated[entry.one, entry.other] > 0.0]
    known = np.array([(entry.low + entry.high) / 2.0 / areas[entry.one] for entry in chosen])
    ours = np.array([exchange[entry.one, entry.other] / areas[entry.one] for entry in chosen])
    return ours - known, np.array([stated[entry.one, entry.other] for entry in chosen])

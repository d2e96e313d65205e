"""Errors of view factors: how fast they fall with the number of rays, and whether they are as large as stated."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from renderer.mesh.mesh import Mesh
from renderer.octree import Octree
from renderer.studies import view_factors
from validation.error_curves import slope
from validation.studies.factors.forms import Form, sheets, street_with_block

_QUICK = tuple(1 << k for k in range(8, 15, 2))
_FULL = tuple(1 << k for k in range(8, 17, 2))
# So small that only the largest number of rays ends a row.
_NEVER = 1e-9
_SEED = 2056
# Chance has -1/2. The mean square of some dozen errors varies by a tenth from one number of rays to the next, which
# moves the slope over four or five of them by less than this.
SLACK = 0.05
SLOPE = -0.5 + SLACK
# The mean of squares of errors over that of those stated. A stated one is that of eight sequences: its square varies by
# a half, and the mean over some dozen entries, which are not independent, by a quarter.
HONEST = 1.75
# Errors that are stated twice as large as they are take four times the rays that are needed.
WASTE = 0.25


def _streets() -> list[Form]:
    """One street, turned: its surfaces have other frames, in which they send the same rays."""
    return _turned([street_with_block()] * 8)


def _sheets() -> list[Form]:
    """Several shares."""
    return _turned([sheets(a, b) for a in (0.15, 0.4, 0.6, 0.85) for b in (0.25, 0.5, 0.75)])


def _turned(forms: list[Form]) -> list[Form]:
    """Each form turned at random onto other axes, and its faces begun at a corner at random."""
    rng = np.random.default_rng(_SEED)
    found = []
    for form in forms:
        turn = np.eye(3)[rng.permutation(3)] * rng.choice([-1.0, 1.0], 3)
        turn *= np.linalg.det(turn)
        first = rng.integers(0, 3, (len(form.room.mesh.faces), 1))
        faces = np.take_along_axis(form.room.mesh.faces, (first + np.arange(3)) % 3, axis=1)
        room = form.room._replace(mesh=Mesh(form.room.mesh.vertices @ turn, faces))
        found.append(replace(form, room=room))
    return found


FORMS: dict[str, Callable[[], list[Form]]] = {
    "streets with a block": _streets,
    "sheets between two squares": _sheets,
}


def check(name: str, quick: bool) -> dict[str, Any]:
    """A row: true and stated errors as a mean square for each number of rays, their slope, and their mean ratio."""
    forms, counts = FORMS[name](), _QUICK if quick else _FULL
    curves = [np.concatenate([_errors(form, count) for form in forms], axis=1) for count in counts]
    true, stated = ([float(np.sqrt(np.mean(curve[row] ** 2))) for curve in curves] for row in (0, 1))
    # Over all numbers of rays: of each the mean of squares over that of those stated.
    ratio = float(np.mean([(a / b) ** 2 for a, b in zip(true, stated, strict=True)]))
    falls = slope(counts, true)
    return {"subject": f"errors of {name}", "counts": list(counts), "entries": curves[0].shape[1], "rms": true,
            "stated": stated, "slope": np.nan if falls is None else falls, "ratio": ratio}  # fmt: skip


def _errors(form: Form, count: int) -> Any:
    """The error of each entry that has one, and the standard error that is stated: (2, k)."""
    octree = Octree.from_mesh(form.room.mesh)
    found: Any = view_factors(octree, form.room.groups, rtol=_NEVER, max_rays=count, **form.options)
    exchange, stated, areas = found.exchange.toarray(), found.errors.toarray(), found.areas
    chosen = [entry for entry in form.entries if stated[entry.one, entry.other] > 0.0]
    known = np.array([(entry.low + entry.high) / 2.0 / areas[entry.one] for entry in chosen])
    ours = np.array([exchange[entry.one, entry.other] / areas[entry.one] for entry in chosen])
    return np.stack([ours - known, [stated[entry.one, entry.other] for entry in chosen]])

"""The section on promises: rules of the contract that random rays and pictures may miss, each judged by itself."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from validation.gates import Gate
from validation.job import Job, Task
from validation.promises.contract import table
from validation.promises.hits.alone import check_alone
from validation.promises.hits.batches import check_batches, check_refits
from validation.promises.hits.bounds import check_bounds
from validation.promises.hits.builds import check_builds
from validation.promises.hits.counts import check_counts
from validation.promises.hits.errors import check_errors
from validation.promises.hits.files import check_files
from validation.promises.hits.kept import check_kept
from validation.promises.hits.limits import check_limits
from validation.promises.hits.outlines import check_outlines
from validation.promises.hits.places import check_places
from validation.promises.hits.planes import check_planes
from validation.promises.hits.refusals import check_refusals
from validation.promises.hits.shapes import check_shapes
from validation.promises.hits.starts import check_starts
from validation.promises.hits.trees import check_trees
from validation.promises.pictures.bounces import check_bounces
from validation.promises.pictures.cameras import check_cameras
from validation.promises.pictures.codes import check_codes
from validation.promises.pictures.floors import check_floors
from validation.promises.pictures.images import check_images
from validation.promises.pictures.nesting import check_nesting
from validation.promises.pictures.openings import check_openings
from validation.promises.pictures.placing import check_placing
from validation.promises.pictures.refraction import check_refraction
from validation.promises.pictures.saved import check_saved
from validation.promises.pictures.shining import check_shining
from validation.promises.queries.angles import check_angles, check_halves
from validation.promises.queries.edges import check_edges
from validation.promises.queries.inside import check_inside
from validation.promises.queries.nearest import check_nearest
from validation.promises.queries.piles import check_piles
from validation.promises.queries.series import check_series
from validation.promises.queries.signed import check_signed
from validation.promises.queries.views import check_views

_SEED = 2031
_RAYS = 4096
_PLACED = 60
_POLYGONS = 4000
_OPENED = 40
_REFRACTED = 1000
Rows = list[dict[str, Any]]


def _random() -> np.random.Generator:
    return np.random.default_rng(_SEED)


HITS: dict[str, Callable[[], Rows]] = {
    "places of hits": lambda: check_places(_random(), _RAYS),
    "bounds of rays": lambda: check_bounds(_random(), _RAYS),
    "planes from afar": check_planes,
    "errors of t": lambda: check_errors(_random()),
    "ends of float64": check_limits,
    "starts": lambda: check_starts(_random()),
    "sizes of batches": check_batches,
    "rays alone": lambda: check_alone(_random()),
    "refits": check_refits,
    "trees": lambda: check_trees(_random()),
    "builds": lambda: check_builds(_random()),
    "counts": lambda: check_counts(_random()),
    "mesh files": lambda: check_files(_random()),
    "kept arrays": lambda: check_kept(_random()),
    "shapes of rays": lambda: check_shapes(_random()),
    "refusals": lambda: check_refusals(_random()),
    "polygons": lambda: check_outlines(_random(), _POLYGONS),
}
QUERIES: dict[str, Callable[[], Rows]] = {
    "points inside": lambda: check_inside(_random()),
    "open edges": lambda: check_edges(_random()),
    "winding numbers": lambda: check_angles(_random()),
    "sides of a half": lambda: check_halves(_random()),
    "series": lambda: check_series(_random()),
    "nearest faces": lambda: check_nearest(_random()),
    "signed distances": lambda: check_signed(_random()),
    "views": lambda: check_views(_random()),
    "piles of hits": lambda: check_piles(_random()),
}
PICTURES: dict[str, Callable[[], Rows]] = {
    "cameras": lambda: check_cameras(_random(), _PLACED),
    "objects placed": lambda: check_placing(_random(), _PLACED),
    "floors and samples": check_floors,
    "bounces": check_bounces,
    "lights": check_shining,
    "planes of pictures": lambda: check_images(_random()),
    "files of pictures": check_saved,
    "nested media": check_nesting,
    "refraction": lambda: check_refraction(_random(), _REFRACTED),
    "codes": check_codes,
    "boxes shown": lambda: check_openings(_random(), _OPENED),
}
_CHECKS = {**HITS, **QUERIES, **PICTURES}
_COVERED = "what nobody judges may be broken unseen"
_REASON = "a promise holds each time that it is asked"


def steps(job: Job) -> int:
    """Number of calls of ``job.step``: one for each check."""
    return len(_CHECKS)


def run(job: Job) -> tuple[dict[str, Any], list[Gate]]:
    """Ask everything; returns a record for JSON, and a gate for each promise that it was never broken."""
    parts = job.each([Task(_step(name), partial(_asked, name)) for name in _CHECKS])
    rows, promises = [row for part in parts for row in part], table.read()
    missing = table.unjudged(promises)
    covered = Gate("promises", "the public contract", "pieces without a judge", len(missing), "at most", 0.0, _COVERED)
    record = {
        "rows": rows,
        "table": promises,
        "unjudged": [piece._asdict() for piece in missing],
        "costs": dict.fromkeys(row["judge"] for row in rows),
    }
    return record, [*gates(rows), covered]


def judge(checks: dict[str, Callable[[], Rows]], job: Job) -> Rows:
    """The rows of some checks."""
    rows: Rows = []
    for name, check in checks.items():
        job.step(_step(name))
        rows += check()
    return rows


def _asked(name: str) -> Rows:
    return _CHECKS[name]()


def _step(name: str) -> str:
    return f"promises: {name}"


def gates(rows: Rows) -> list[Gate]:
    """A gate for each row."""
    return [Gate("promises", row["promise"], "times broken", row["broken"], "at most", 0.0, _REASON) for row in rows]

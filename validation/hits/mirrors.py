"""Closed bodies of mirrors: rays that are reflected within them again and again, aimed at their edges and corners.

Every ray goes on for ever: none is lost, and none stays at a corner.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.octree import Octree
from validation.gates import Gate
from validation.hits.watertight import KINDS, aimed
from validation.job import Job
from validation.meshes import mirror_bodies

Floats = NDArray[np.float64]

SEED = 2034
BOUNCES = 50
QUICK, FULL = 500, 20_000
# A wedge of angle a reflects a ray at most 180 / a times, and one more by rounding: 3 or 4 times between two of these
# bodies' faces, for up to three pairs of faces at a corner. A ray that stays goes on to ``BOUNCES``.
STAYS = 12


def steps() -> int:
    """Number of calls of ``job.step``."""
    return len(mirror_bodies())


def check_mirrors(job: Job, rays: int | None = None, make: Callable[..., Any] = Octree) -> Any:
    """Reflect rays in all bodies; returns records for JSON and the gates. ``make`` builds the tracer."""
    count = rays or (QUICK if job.quick else FULL)
    records, gates = [], []
    for number, (name, mesh) in enumerate(mirror_bodies().items()):
        job.step(f"mirrors: {name}")
        rng = np.random.default_rng([SEED, number])
        tracer = make(mesh.vertices, mesh.faces)
        for kind in KINDS:
            weights = rng.dirichlet(np.full(len(mesh.vertices), 2.0), count)
            family = aimed(kind, mesh.vertices, mesh.faces, weights @ mesh.vertices, rng)
            lost, stuck = reflected(tracer, family.origins, family.directions)
            records.append({"body": name, "kind": kind, "rays": count, "lost": lost, "stuck": stuck})
            subject = f"{name} of mirrors, {count:,} {kind} rays, {BOUNCES} reflections"
            for quantity, value, reason in (
                ("reflected rays that escape", lost, "a closed body has no holes"),
                ("reflected rays that stay in place", stuck, f"no corner reflects a ray {STAYS} times"),
            ):
                gates.append(Gate("hits", subject, quantity, float(value), "at most", 0.0, reason))
    return records, gates


def reflected(tracer: Any, origins: Floats, directions: Floats) -> tuple[int, int]:
    """The number of rays that are lost within ``BOUNCES`` reflections, and of others that stay at a place."""
    lost, began = 0, len(origins)
    while len(origins):
        kept, stays = _reflected_once(tracer, origins, directions)
        if kept.all():
            return lost, int(stays.sum())
        # Without those that were lost, from the beginning: hits cannot be picked apart.
        lost, origins, directions = lost + int((~kept).sum()), origins[kept], directions[kept]
    return began, 0


def _reflected_once(tracer: Any, origins: Floats, directions: Floats) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """The rays that are not lost, up to the first reflection that loses some, and those that stay."""
    hits = tracer.closest_hit(origins, directions)
    in_a_row = np.zeros(len(origins), np.int64)
    stays = np.zeros(len(origins), np.bool_)
    for _ in range(BOUNCES):
        if not hits.hit.all():
            return hits.hit, stays
        normals = hits.normals
        directions = directions - 2.0 * (directions * normals).sum(axis=1)[:, None] * normals
        hits = tracer.closest_hit(hits.points, directions, leaving=hits)
        in_a_row = np.where(hits.t == 0.0, in_a_row + 1, 0)
        stays |= in_a_row > STAYS
    return hits.hit, stays

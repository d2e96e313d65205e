"""Rays that go straight on through all that they hit: each face once, by t, of those that coincide by number."""

from collections import defaultdict
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.octree import Octree
from validation.gates import Gate
from validation.hits.bodies import Body, bodies
from validation.job import Job
from validation.oracle.contacts import contacts, hits

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

SEED = 2035
QUICK, FULL = 20, 400
# A ray from outside is rounded by 2^-50 of its length, some sizes of the body: it may pass a body that is hardly wider
# on either side, as any silhouette.
_NARROWEST = 2.0**-36


def check_walks(job: Job, rays: int | None = None, make: Callable[..., Any] = Octree) -> Any:
    """Send rays through every body, ``rays`` each; returns records for JSON, one a family, and the gates."""
    job.step("starts: through everything")
    count = rays or (QUICK if job.quick else FULL)
    totals: dict[str, tuple[int, int]] = {}
    for number, body in enumerate(bodies()):
        if _narrowest(body.mesh) < _NARROWEST:
            continue
        wrong = walk(body, count, np.random.default_rng([SEED, number]), make)
        before = totals.get(body.family, (0, 0))
        totals[body.family] = (before[0] + count, before[1] + wrong)
    records = [{"family": family, "rays": sent, "wrong": wrong} for family, (sent, wrong) in totals.items()]
    reason, quantity = (
        "a ray that goes on passes each face of its line once",
        "rays that pass other faces than their lines",
    )
    gates = [
        Gate("hits", f"{family}, {sent:,} rays through them", quantity, float(wrong), "at most", 0.0, reason)
        for family, (sent, wrong) in totals.items()
    ]
    return records, gates


def _narrowest(mesh: Mesh) -> float:
    """The least height of a face over its longest side, as a share of the mesh's size."""
    a, b, c = mesh.vertices[mesh.faces].transpose(1, 0, 2)
    sides = np.linalg.norm([c - b, a - c, b - a], axis=2).max(axis=0)
    heights = np.linalg.norm(np.cross(b - a, c - a), axis=1) / sides
    return float(heights.min() / np.ptp(mesh.vertices, axis=0).max())


def walk(body: Body, count: int, rng: Generator, make: Callable[..., Any] = Octree) -> int:
    """The number of rays through a body's faces that do not meet all that exact arithmetic says, in its order."""
    origins, directions = _rays(body.mesh, count, rng)
    vertices = np.asarray(body.mesh.vertices, np.float64)
    tracer, by_length = make(body.mesh.vertices, body.mesh.faces), defaultdict[int, list[int]](list)
    expected = []
    for ray in range(count):
        found = contacts(vertices, body.mesh.faces, origins[ray], directions[ray])
        expected.append(hits(found))
        by_length[len(expected[-1])].append(ray)
    wrong = 0
    for length, rows in by_length.items():
        want = np.array([[face for _, face in expected[ray]] for ray in rows], np.int64).reshape(len(rows), length)
        places = [np.unique([t for t, _ in expected[ray]], return_inverse=True)[1] for ray in rows]
        piles = np.array(places, np.int64).reshape(len(rows), length)
        wrong += _wrong(tracer, origins[rows], directions[rows], want, piles)
    return wrong


def _wrong(tracer: Any, origins: Floats, directions: Floats, want: Ints, piles: Ints) -> int:
    """The number of rays that do not meet the faces of their rows (n, k), one after the other, and then nothing.

    ``piles`` numbers the places along the ray: faces at one place, whose t are equal but for rounding, may be met from
    any of them on, each once.
    """
    wrong = 0
    while len(origins):
        found = tracer.closest_hit(origins, directions)
        right, met = np.ones(len(origins), np.bool_), np.zeros(want.shape, np.bool_)
        for k in range(want.shape[1]):
            here = (want == found.face[:, None]) & (piles == piles[:, k : k + 1]) & ~met
            met |= here
            right = here.any(axis=1)
            if not right.all():
                break
            found = tracer.closest_hit(found.points, directions, leaving=found.through())
        else:
            return wrong + int((found.face >= 0).sum())
        # Without those that met others, from the beginning: hits cannot be picked apart.
        wrong += int((~right).sum())
        origins, directions, want, piles = origins[right], directions[right], want[right], piles[right]
    return wrong


def _rays(mesh: Mesh, count: int, rng: Generator) -> tuple[Floats, Floats]:
    """From around the mesh through points well within its faces."""
    corners = mesh.vertices[mesh.faces[rng.integers(0, len(mesh.faces), count)]]
    weights = 0.1 + 0.7 * rng.dirichlet([2.0, 2.0, 2.0], count)
    targets = np.einsum("nk,nkx->nx", weights, corners)
    size = np.ptp(mesh.vertices, axis=0).max()
    origins = targets + 3.0 * size * rng.normal(size=(count, 3))
    return origins, targets - origins

"""Seams between placed parts: a sphere of eight mirrored eighths, which every ray from inside must hit."""

from itertools import product
from typing import Any

import numpy as np
from numpy.random import Generator

from renderer.mesh.mesh import Mesh
from validation.gates import Gate
from validation.hits import watertight
from validation.hits.rays import RayFamily, float32_exact
from validation.hits.scenes import REFERENCE
from validation.hits.watertight import KINDS
from validation.job import Job
from validation.merged import made
from validation.meshes import AWAY, TURN
from validation.oracle.placing import Body, placed
from validation.references.mitsuba.instances import MitsubaInstances

_SEED = 2041
# Edges along each side of an eighth.
_PARTS = 6
# Rays of each kind from inside each sphere.
QUICK, FULL = 2_000, 100_000
# As many for Embree's instances, one ray at a time.
_BESIDE = 1_000
_FLIPS = np.array([np.diag(signs) for signs in product((1.0, -1.0), repeat=3)])


def check_seams(job: Job, rays: int | None = None) -> tuple[list[dict[str, Any]], list[Gate]]:
    """Rays from inside at the corners and edges that eighths share, wherever the sphere lies; as ``check_leaks``."""
    count = rays or (QUICK if job.quick else FULL)
    sets, gates = [], []
    for kind in KINDS:
        job.step(f"leaks: sphere of placed parts, {kind}")
        rng = np.random.default_rng(_SEED)
        total = ours = beside = theirs = 0
        for offset, scale in product(watertight.OFFSETS, watertight.SCALES):
            body, family = _sphere(kind, offset, scale, count, rng)
            total, ours = total + count, ours + watertight.leaks(made([body]).scene, family)
            if offset == 0.0:
                some = family.select(np.arange(min(count, _BESIDE)))
                beside, theirs = beside + len(some), theirs + _leaks_of_embree(body, some)
        other = {"key": "embree_instances", "name": REFERENCE, "rays": beside, "leaks": theirs}
        where = "sphere of eight placed parts"
        sets.append({"mesh": where, "kind": f"{kind} of parts", "rays": total, "ours": ours, "references": [other]})
        subject, reason = f"{where}, {total:,} {kind} rays from inside", "parts with equal placed corners leave no gap"
        judged = ("RayScene.closest_hit", "RayScene.any_hit")
        gates.append(Gate("hits", subject, "leaks", float(ours), "at most", job.thresholds.hits.leaks, reason, judged))
    return sets, gates


def _sphere(kind: str, offset: float, scale: float, count: int, rng: Generator) -> tuple[Body, RayFamily]:
    """A sphere of eight parts, and rays from inside at corners and edges on the rims of parts."""
    eighth, centre = _eighth(), offset * AWAY
    matrices = np.empty((8, 3, 4))
    matrices[:, :, :3], matrices[:, :, 3] = scale * TURN @ _FLIPS, centre
    body = Body(eighth.vertices, eighth.faces.astype(np.int64), matrices)
    # Each edge on a rim, as a face of no width, of each part.
    rims = eighth.open_edges[:, [0, 1, 1]] + len(eighth.vertices) * np.arange(8)[:, None, None]
    inside = scale * rng.uniform(-0.4, 0.4, (count, 3)) + centre
    return body, watertight.aimed(kind, placed([body])[0], rims.reshape(-1, 3).astype(np.int32), inside, rng)


def _leaks_of_embree(body: Body, rays: RayFamily) -> int:
    """Rays that Embree's instances miss, of matrices and corners rounded to float32."""
    rounded = body._replace(vertices=float32_exact(body.vertices), matrices=float32_exact(body.matrices))
    faces = MitsubaInstances([rounded]).closest_hit(rays.origins, rays.directions)[1]
    return int(np.count_nonzero(faces < 0))


def _eighth() -> Mesh:
    """The eighth of the unit sphere where no coordinate is below 0."""
    lattice = [(i, j) for i in range(_PARTS + 1) for j in range(_PARTS + 1 - i)]
    points = np.array([(i, j, _PARTS - i - j) for i, j in lattice], np.float64)
    number = {place: k for k, place in enumerate(lattice)}
    corners = [[(i, j), (i + 1, j), (i, j + 1)] for i, j in lattice if i + j < _PARTS]
    corners += [[(i + 1, j), (i + 1, j + 1), (i, j + 1)] for i, j in lattice if i + j < _PARTS - 1]
    faces = [[number[place] for place in face] for face in corners]
    return Mesh(points / np.linalg.norm(points, axis=1, keepdims=True), faces)

"""One mesh and every family of rays: our closest hits against exact arithmetic and against each reference."""

import hashlib
import time
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.octree import Octree
from renderer.trace.ray_lanes import WIDTH
from validation.gates import Gate
from validation.hits import compare
from validation.hits.compare import ExactErrors, HitArrays, HitComparison
from validation.hits.errors import ErrorSizes, error_sizes, truth
from validation.hits.rays import RayFamily, face_rays, families, float32_exact
from validation.hits.verdicts import NEAR_EDGE
from validation.job import Job
from validation.oracle import exact
from validation.oracle.rounding import FLOAT32_ROUNDOFF, FLOAT64_ROUNDOFF
from validation.references.table import REFERENCES, HitReference
from validation.thresholds import HitLimits
from validation.timing import spending

Ints = NDArray[np.int64]

SEED = 2026
EXACT = "exact arithmetic"

# Families whose rays have no particular target. There a hit that float64 cannot decide (the ray passes an edge closer
# than the rounding of the edge function) has a chance of 1e-9 a ray, so one would be suspicious. Rays that are aimed at
# edges and vertices, begin on a face or come from far away are undecidable by design; they are counted and shown.
UNAIMED = ("camera", "camera_squares", "random", "grazing", "from_inside", "face")
# These begin in the box of the mesh. In a box without thickness they begin on faces, which is undecidable as well.
_IN_THE_BOX = ("random", "from_inside")
# Rays begin up to 1e5 radii away. Their numbers and those of hits must be float32 numbers, which end at 3e38 and lose
# digits below 1e-38.
_SMALLEST, _LARGEST = 1e-30, 1e30

# Rays of a family that are not plainly right get a slow judgement, 5 ms each. The sound renderer needs it for a few
# hundred; all rays beyond this number count as wrong.
_JUDGED = 1_500

_ROUNDOFF = {"float32": FLOAT32_ROUNDOFF, "float64": FLOAT64_ROUNDOFF}


@dataclass(frozen=True)
class HitEffort:
    """The number of rays to check, and the references.

    rays        of each family on each mesh
    exact       of these, judged by exact arithmetic whether or not a reference disagrees
    leaks       rays of each kind from inside each closed mesh
    references  that are compared
    """

    rays: int
    exact: int
    leaks: int
    references: tuple[HitReference, ...] = REFERENCES


class LoadedReference(NamedTuple):
    """A reference with the mesh loaded; ``seconds`` sums its build and its queries."""

    reference: HitReference
    tree: Any
    seconds: dict[str, float]

    def closest_hit(self, rays: RayFamily) -> HitArrays:
        """Closest hits of the reference, timed."""
        answer = spending(self.seconds, "query", self.tree.closest_hit)
        return HitArrays(*answer(rays.origins, rays.directions))


def load_reference(reference: HitReference, mesh: Mesh) -> LoadedReference:
    """Build the reference's structure over the mesh, timed."""
    began = time.perf_counter()
    tree = reference.make(mesh.vertices, mesh.faces)
    return LoadedReference(reference, tree, {"build": time.perf_counter() - began, "query": 0.0})


def can_judge(reference: HitReference, mesh: Mesh) -> str | None:
    """Why the reference cannot judge our hits on the mesh; None where it can."""
    if len(mesh.faces) > reference.most_faces:
        return f"too slow beyond {reference.most_faces:,} faces, and this mesh has {len(mesh.faces):,}"
    if reference.precision == "float32" and not np.array_equal(float32_exact(mesh.vertices), mesh.vertices):
        return "works in float32, which does not hold the vertices of this mesh: it would judge another one"
    return None


class Target(NamedTuple):
    """The subject of a check.

    tracer      has ``closest_hit``, whose hits have t and the face of the mesh, and ``any_hit``
    references  that are compared
    judged      the tracer's public names
    costs       seconds of exact arithmetic
    """

    name: str
    mesh: Mesh
    tracer: Any
    references: tuple[LoadedReference, ...]
    judged: tuple[str, ...]
    costs: dict[str, float]


class _Findings(NamedTuple):
    """Results of one family: errors on the exact sample, comparisons and error sizes by reference, and counts.

    ``any_hit_differs`` counts rays whose any hit differs from the closest hit, ``few_differ`` rays of the sample that
    have another hit when traced a few at a time.
    """

    errors: ExactErrors
    comparisons: list[HitComparison]
    sizes: list[ErrorSizes]
    any_hit_differs: int
    few_differ: int


def check_mesh(name: str, mesh: Mesh, effort: HitEffort, job: Job) -> tuple[dict[str, Any], list[Gate]]:
    """``check`` on an octree over ``mesh``, with all references that can judge it; the others are under ``left_out``.

    Raises ``ValueError`` for a mesh without faces, or of a size for which rays cannot be float32 numbers.
    """
    size = float(np.abs(mesh.vertices[mesh.faces]).max(initial=0.0))
    if not _SMALLEST <= size <= _LARGEST:
        raise ValueError(f"{name}: expected faces whose largest coordinate is 1e-30 to 1e30, got {size:g}")
    reasons = {reference: can_judge(reference, mesh) for reference in effort.references}
    loaded = tuple(load_reference(reference, mesh) for reference, reason in reasons.items() if reason is None)
    target = Target(name, mesh, Octree.from_mesh(mesh), loaded, ("Octree.closest_hit", "Octree.any_hit"), {EXACT: 0.0})
    record, gates = check(target, effort, job)
    left_out = {reference.name: reason for reference, reason in reasons.items() if reason is not None}
    return record | {"left_out": left_out}, gates


def check(target: Target, effort: HitEffort, job: Job) -> tuple[dict[str, Any], list[Gate]]:
    """Check all families of rays on a target; returns a record for JSON and the gates."""
    records: list[dict[str, Any]] = []
    gates: list[Gate] = []
    vertices, faces = target.mesh.vertices, target.mesh.faces
    for rays in (*families(vertices, faces, effort.rays, SEED), face_rays(vertices, faces)):
        job.step(f"hits: {target.name}, {rays.name}")
        record, found = _check(target, rays, effort, job.thresholds.hits)
        records.append(record)
        gates += found
    return {
        "name": target.name,
        "faces": len(faces),
        "references": [describe(one) for one in target.references],
        "left_out": {},
        "families": records,
        "costs": target.costs | {one.reference.name: sum(one.seconds.values()) for one in target.references},
    }, gates


def describe(loaded: LoadedReference) -> dict[str, Any]:
    """The reference and its seconds, for JSON."""
    reference = loaded.reference
    named = {"key": reference.key, "name": reference.name, "version": reference.version}
    return named | {"precision": reference.precision, **{f"{k}_seconds": v for k, v in loaded.seconds.items()}}


def _check(target: Target, rays: RayFamily, effort: HitEffort, limits: HitLimits) -> tuple[dict[str, Any], list[Gate]]:
    # Trace the rays and compare with every reference.
    hits = target.tracer.closest_hit(rays.origins, rays.directions)
    ours = HitArrays.told(hits.t, hits.face)
    found = _find(target, rays, ours, effort)

    # Count the rays on which we are wrong, or which rounding decides.
    wrong = frozenset[int]().union(*(comparison.wrong_rays for comparison in found.comparisons))
    disagreements = [*found.errors.disagreements, *(d for one in found.comparisons for d in one.disagreements)]
    near_edge = len({d.ray for d in disagreements if d.verdict == NEAR_EDGE})

    # Write the record.
    record = {
        "family": rays.name,
        "rays": len(rays),
        "hits": int(np.count_nonzero(ours.hit)),
        "ours_sha256": hashlib.sha256(ours.t.tobytes() + ours.face.tobytes()).hexdigest(),
        "wrong": len(wrong),
        "near_edge": near_edge,
        "any_hit_differs": found.any_hit_differs,
        "few_differ": found.few_differ,
        "exact": found.errors.record(),
        "references": [
            {"key": one.reference.key} | comparison.record() | {"sizes": asdict(sizes)}
            for one, comparison, sizes in zip(target.references, found.comparisons, found.sizes, strict=True)
        ],
    }

    # Make the gates; a family that is not aimed at edges must not come within rounding of one.
    judge = "exact arithmetic decides"
    quantities = [
        ("wrong hits", len(wrong), limits.wrong, judge),
        ("wrong hits in the exact sample", found.errors.wrong, limits.wrong, judge),
        (
            "any_hit differs from closest_hit",
            found.any_hit_differs,
            limits.any_hit_differs,
            "both queries share one definition of a hit",
        ),
        (
            "other hits in small batches",
            found.few_differ,
            limits.few_differ,
            "a ray's answer does not depend on its batch",
        ),
    ]
    flat = not np.ptp(target.mesh.vertices[target.mesh.faces].reshape(-1, 3), axis=0).all()
    if rays.name in UNAIMED and not (flat and rays.name in _IN_THE_BOX):
        reason = "no ray of this family aims at an edge"
        quantities.append(("rays within rounding of an edge", near_edge, limits.near_edge, reason))
    subject = f"{target.name}, {rays.name} rays"
    judged = target.judged
    return record, [Gate("hits", subject, q, float(v), "at most", most, why, judged) for q, v, most, why in quantities]


def _find(target: Target, rays: RayFamily, ours: HitArrays, effort: HitEffort) -> _Findings:
    """Compare with exact arithmetic and every reference.

    A slow reference gets the first rays of one seeded order, so that every smaller sample is part of every larger one.
    """
    vertices, faces = target.mesh.vertices, target.mesh.faces
    order = np.random.default_rng(SEED).permutation(len(rays))
    sample = np.sort(order[: effort.exact])
    picked = rays.select(sample)
    exactly = spending(target.costs, EXACT, exact.closest_hits)(vertices, faces, picked.origins, picked.directions)
    judged = spending(target.costs, EXACT, compare.exact_errors)
    errors = judged(ours.select(sample), exactly, vertices, faces, picked, _JUDGED, sample)
    known = truth(exactly)

    comparisons, sizes = [], []
    for one in target.references:
        rows = np.sort(order[: one.reference.most_rays])
        given, roundoff = rays.select(rows), _ROUNDOFF[one.reference.stored or one.reference.precision]
        theirs = one.closest_hit(given)
        comparisons.append(compare.compare(ours.select(rows), theirs, vertices, faces, given, roundoff, rows))
        _, here, there = np.intersect1d(rows, sample, assume_unique=True, return_indices=True)
        sizes.append(error_sizes(theirs.t[here], theirs.face[here], known.select(there)))
    comparisons = spending(target.costs, EXACT, compare.judge_all)(comparisons, vertices, faces, _JUDGED)
    occluded = target.tracer.any_hit(rays.origins, rays.directions)
    any_differs = int(np.count_nonzero(occluded != ours.hit))
    return _Findings(errors, comparisons, sizes, any_differs, _few_differ(target.tracer, picked, ours.select(sample)))


def _few_differ(tracer: Any, rays: RayFamily, ours: HitArrays) -> int:
    """Number of rays with another hit in calls of one ray, two, and so on up to a packet less one, and then again."""
    differ, begin, count = 0, 0, 1
    while begin < len(rays):
        rows = np.arange(begin, min(begin + count, len(rays)))
        few = rays.select(rows)
        hits = tracer.closest_hit(few.origins, few.directions)
        seen = tracer.any_hit(few.origins, few.directions)
        same = (hits.t == ours.t[rows]) & (hits.face == ours.face[rows]) & (seen == ours.hit[rows])
        differ += int(np.count_nonzero(~same))
        begin, count = begin + count, count % (WIDTH - 1) + 1
    return differ

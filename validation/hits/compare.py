"""Comparison of our closest hits with a reference's, ray by ray, with counts of the exact verdicts.

Faces are not compared where t agrees: at a tie any of them is right.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from validation.hits.errors import ErrorSizes, error_sizes, percentiles, truth
from validation.hits.rays import RayFamily
from validation.hits.verdicts import (
    NEAR_EDGE,
    OURS_WRONG,
    THEIRS_RIGHT,
    VERDICTS,
    Disagreement,
    Point,
    judged,
    judgements,
    listed,
    theirs_right,
    with_truth,
)
from validation.oracle import exact
from validation.oracle.exact import ExactHit
from validation.oracle.rounding import FLOAT32_ROUNDOFF

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Embree's robust mode against exact t for the same float32 input: at most 3e-7 head-on (five roundings of
# 6e-8) and 8e-8 / angle grazing; 2e-7 / |cos| leaves a factor of 2.5 on the latter.
RTOL = 3e-7
RTOL_GRAZING = 2e-7
# At a flatter angle the tolerance above is meaningless: exact arithmetic judges the ray as soon as t differs by 2e-4.
MIN_COSINE = 1e-3


@dataclass(frozen=True)
class HitArrays:
    """Closest hits of a batch: ``t`` float64 (n,), inf on a miss; ``face`` int64 (n,), -1 on a miss."""

    t: Floats
    face: Ints

    def __post_init__(self) -> None:
        if self.t.ndim != 1 or self.t.shape != self.face.shape:
            raise ValueError(f"t, face: expected two arrays (n,), got {self.t.shape} and {self.face.shape}")
        bad = np.flatnonzero((self.face >= 0) != np.isfinite(self.t))
        if len(bad):
            got = f"t = {self.t[bad[0]]}, face = {self.face[bad[0]]}"
            raise ValueError(f"t, face: expected a finite t exactly where face >= 0, got {got} in row {bad[0]}")

    @classmethod
    def told(cls, t: Floats, face: Ints) -> "HitArrays":
        """The hits of a renderer under test: one that contradicts itself is made a hit at t = -1.

        That is right for no ray, so it is judged wrong, where an exception would judge nothing.
        """
        bad = (face >= 0) != np.isfinite(t)
        return cls(np.where(bad, -1.0, t), np.where(bad, np.maximum(face, 0), face))

    @property
    def hit(self) -> NDArray[np.bool_]:
        return self.face >= 0

    def select(self, rows: Ints) -> "HitArrays":
        """The hits at ``rows``."""
        return HitArrays(self.t[rows], self.face[rows])


@dataclass(frozen=True)
class HitComparison:
    """Counts of one ray family, relative differences of t over rays that both hit, and every disagreement."""

    family: str
    roundoff: float  # of theirs
    rays: int
    both_hit: int
    both_miss: int
    only_ours: int
    only_theirs: int
    t_error_p50: float
    t_error_p99: float
    t_error_max: float
    disagreements: tuple[Disagreement, ...]

    @property
    def unjudged(self) -> int:
        return sum(d.verdict is None for d in self.disagreements)

    @property
    def verdicts(self) -> dict[str, int]:
        """Number of disagreements by verdict, for all verdicts."""
        counts = Counter(d.verdict for d in self.disagreements)
        return {verdict: counts[verdict] for verdict in VERDICTS}

    @property
    def wrong_rays(self) -> frozenset[int]:
        """Rays on which ours is wrong beyond rounding, and rays that were not judged."""
        return frozenset(d.ray for d in self.disagreements if d.verdict in OURS_WRONG)

    @property
    def ours_wrong(self) -> int:
        """Number of ``wrong_rays``; its gate requires 0."""
        return len(self.wrong_rays)

    def record(self) -> dict[str, object]:
        """Plain numbers, strings and tables, ready for JSON; the disagreements are those of ``listed``."""
        counts = {"disagreements": len(self.disagreements), "verdicts": self.verdicts, "unjudged": self.unjudged}
        rest = asdict(replace(self, disagreements=()))
        return rest | counts | {"ours_wrong": self.ours_wrong, "listed": listed(self.disagreements)}


@dataclass(frozen=True)
class ExactErrors:
    """Our hits against exact ones: rays that are wrong, rays within rounding of an edge, and errors of t."""

    family: str
    rays: int
    hits: int
    wrong: int
    near_edge: int
    near_edge_flipped: int  # of these, a hit where exact arithmetic misses or the reverse; the others hit a neighbour
    sizes: ErrorSizes
    disagreements: tuple[Disagreement, ...]  # every ray counted in wrong or near_edge

    @property
    def ulp_max(self) -> float:
        """The largest error of t in ulp."""
        return self.sizes.ulp_max

    def record(self) -> dict[str, object]:
        """Plain numbers, strings and tables, ready for JSON; the disagreements are those of ``listed``."""
        return asdict(replace(self, disagreements=())) | {
            "disagreements": len(self.disagreements),
            "listed": listed(self.disagreements),
        }


def compare(
    ours: HitArrays,
    theirs: HitArrays,
    vertices: ArrayLike,
    faces: ArrayLike,
    rays: RayFamily,
    roundoff: float = FLOAT32_ROUNDOFF,
    numbers: Ints | None = None,
) -> HitComparison:
    """Compare two sets of closest hits of ``rays`` on the mesh ``vertices`` (V, 3), ``faces`` (F, 3).

    ``theirs`` comes from a reference of unit roundoff ``roundoff`` with the same input numbers. Two hits agree when |t
    - t'| <= (RTOL + RTOL_GRAZING / |n.d|) max(|t|, |t'|), with n the unit normal of our face and d the unit direction;
    ``exact_errors`` finds smaller errors, also for a float64 reference. ``numbers`` (n,) names the rays in the
    disagreements; with None they are counted from 0.
    """
    if not len(ours.t) == len(theirs.t) == len(rays):
        got = f"{len(ours.t)}, {len(theirs.t)} and {len(rays)}"
        raise ValueError(f"ours, theirs, rays: expected equal numbers of rays, got {got}")

    # Compute the relative difference of t where both hit.
    corners = np.asarray(vertices, dtype=np.float64)[np.asarray(faces, dtype=np.int64)]
    both = np.flatnonzero(ours.hit & theirs.hit)
    t, other = ours.t[both], theirs.t[both]
    larger = np.maximum(np.abs(t), np.abs(other))
    error = np.divide(np.abs(t - other), larger, out=np.zeros(len(both)), where=larger > 0)

    # Collect the disagreements: "not within" rather than "beyond", so that a NaN is one.
    rtol = _relative_tolerance(corners[ours.face[both]], rays.directions[both])
    beyond = both[~(error <= rtol)]
    flipped = np.flatnonzero(ours.hit != theirs.hit)
    found = [_disagreement(ray, "hit or miss", ours, theirs, rays, numbers) for ray in flipped.tolist()]
    found += [_disagreement(ray, "t", ours, theirs, rays, numbers) for ray in beyond.tolist()]

    # Count.
    p50, p99, largest = percentiles(error)
    return HitComparison(
        family=rays.name,
        roundoff=roundoff,
        rays=len(rays),
        both_hit=len(both),
        both_miss=int(np.count_nonzero(~ours.hit & ~theirs.hit)),
        only_ours=int(np.count_nonzero(ours.hit & ~theirs.hit)),
        only_theirs=int(np.count_nonzero(~ours.hit & theirs.hit)),
        t_error_p50=p50,
        t_error_p99=p99,
        t_error_max=largest,
        disagreements=tuple(found),
    )


def judge(comparison: HitComparison, vertices: ArrayLike, faces: ArrayLike, most: int = 2000) -> HitComparison:
    """The comparison with an exact verdict on its disagreements; see ``judge_all``."""
    return judge_all([comparison], vertices, faces, most)[0]


def judge_all(
    comparisons: Sequence[HitComparison], vertices: ArrayLike, faces: ArrayLike, most: int = 2000
) -> list[HitComparison]:
    """Comparisons of the same answers of ours with an exact verdict on each disagreement; hits have t >= 0.

    A ray on which several references disagree with us is judged once. Of the rays on which ours is not plainly right
    only the first ``most`` are judged, and none once the verdict is settled (``verdicts.SETTLED``), so that a broken
    kernel ends in minutes; the others count as ``ours_wrong``.
    """
    points, triangles = np.asarray(vertices, dtype=np.float64), np.asarray(faces, dtype=np.int64)
    unique = {d.answered: d for c in comparisons for d in c.disagreements}
    if not unique:
        return list(comparisons)
    origins, directions, t, face = (list(column) for column in zip(*unique, strict=True))
    rays = RayFamily("disagreements", np.array(origins), np.array(directions))
    misses = [one is None for one in face]
    ours = HitArrays(np.where(misses, np.inf, t).astype(np.float64), np.where(misses, -1, face).astype(np.int64))
    exactly = exact.closest_hits(points, triangles, rays.origins, rays.directions)
    seen = judgements(ours.t, ours.face, exactly, points, triangles, rays, most)
    known = {ray: (hit, seen.get(row, "right")) for row, (ray, hit) in enumerate(zip(unique, exactly, strict=True))}
    judged_all = []
    for c in comparisons:
        found = [known[d.answered] for d in c.disagreements]
        right = theirs_right(c.disagreements, [hit for hit, _ in found], points[triangles], c.roundoff)
        rows = zip(c.disagreements, found, right, strict=True)
        judged_all.append(
            replace(c, disagreements=tuple(judged(d, hit, ours_is, one) for d, (hit, ours_is), one in rows))
        )
    return judged_all


def exact_errors(
    ours: HitArrays,
    exact_hits: list[ExactHit | None],
    vertices: ArrayLike,
    faces: ArrayLike,
    rays: RayFamily,
    most: int = 2000,
    numbers: Ints | None = None,
) -> ExactErrors:
    """Judge every ray of ``ours`` against ``exact_hits`` (of ``exact.closest_hits`` for the same rays).

    ``most`` and ``numbers`` as for ``judge_all`` and ``compare``.
    """
    if not len(ours.t) == len(exact_hits) == len(rays):
        got = f"{len(ours.t)}, {len(exact_hits)} and {len(rays)}"
        raise ValueError(f"ours, exact_hits, rays: expected equal numbers of rays, got {got}")

    # List the rays whose answer is not right, with the exact hit and a verdict.
    points, triangles = np.asarray(vertices, dtype=np.float64), np.asarray(faces, dtype=np.int64)
    found = []
    for row, judgement in judgements(ours.t, ours.face, exact_hits, points, triangles, rays, most).items():
        if judgement != "right":
            d = with_truth(_disagreement(row, "exact", ours, None, rays, numbers), exact_hits[row])
            verdict = {"near edge": NEAR_EDGE, "wrong": THEIRS_RIGHT, None: None}[judgement]
            found.append(replace(d, ours_right=None if judgement is None else False, verdict=verdict))

    # Count them, those within rounding of an edge apart.
    near_edge = [d for d in found if d.verdict == NEAR_EDGE]
    return ExactErrors(
        family=rays.name,
        rays=len(rays),
        hits=sum(hit is not None for hit in exact_hits),
        wrong=len(found) - len(near_edge),
        near_edge=len(near_edge),
        near_edge_flipped=sum((d.ours_t is None) != (d.exact_t is None) for d in near_edge),
        sizes=error_sizes(ours.t, ours.face, truth(exact_hits)),
        disagreements=tuple(found),
    )


def _relative_tolerance(corners: Floats, directions: Floats) -> Floats:
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normal, axis=1) * np.linalg.norm(directions, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        cosine = np.abs((normal * directions).sum(axis=1)) / lengths
    tolerance: Floats = RTOL + RTOL_GRAZING / np.maximum(cosine, MIN_COSINE)
    return tolerance


def _disagreement(
    row: int, kind: str, ours: HitArrays, theirs: HitArrays | None, rays: RayFamily, numbers: Ints | None
) -> Disagreement:
    ray = row if numbers is None else int(numbers[row])
    theirs_t, theirs_face = (None, None) if theirs is None else _answer(theirs, row)
    origin, direction = _row(rays.origins, row), _row(rays.directions, row)
    return Disagreement(ray, origin, direction, kind, *_answer(ours, row), theirs_t, theirs_face)


def _row(vectors: Floats, row: int) -> Point:
    x, y, z = vectors[row].tolist()
    return x, y, z


def _answer(hits: HitArrays, row: int) -> tuple[float | None, int | None]:
    return (float(hits.t[row]), int(hits.face[row])) if hits.face[row] >= 0 else (None, None)

"""Compare our closest hits with a float32 reference, ray by ray, and judge each disagreement exactly.

Faces are never compared where t agrees: at a tie any of them is right. A verdict needs no trust in either
side: an answer is *right* when exact arithmetic gives the same hit or miss and t lies within the derived
rounding bound of the exact distance of the face that it names. An answer that is not right can still be one
that rounding permits a watertight kernel (``rounding.RayView``): then exact arithmetic decides the ray by
less than float64 resolves, and it is counted apart.
"""

from collections import Counter
from dataclasses import asdict, dataclass, replace
from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike, NDArray

from validation import exact
from validation.exact import ExactHit
from validation.rays import RayBatch
from validation.rounding import FLOAT32_ROUNDOFF, FLOAT64_ROUNDOFF, RayView, t_bounds

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Embree's robust mode against exact t for the same float32 input: at most 3e-7 head-on (five roundings of
# 6e-8) and 8e-8 / angle grazing; 2e-7 / |cos| leaves a factor of 2.5 on the latter.
RTOL = 3e-7
RTOL_GRAZING = 2e-7
# Flatter than this the tolerance above says nothing: the ray is left to the exact judge as soon as t differs
# by 2e-4.
MIN_COSINE = 1e-3

OURS_RIGHT = "ours right"
THEIRS_RIGHT = "theirs right"
BOTH_RIGHT = "both right (within float32 rounding)"
NEAR_EDGE = "within float64 rounding of an edge"
BOTH_WRONG = "both wrong"
VERDICTS = (OURS_RIGHT, THEIRS_RIGHT, BOTH_RIGHT, NEAR_EDGE, BOTH_WRONG)


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

    @property
    def hit(self) -> NDArray[np.bool_]:
        return self.face >= 0


@dataclass(frozen=True)
class Disagreement:
    """One ray with different answers; t and face are None on a miss, the exact part is None until judged."""

    ray: int
    origin: tuple[float, float, float]
    direction: tuple[float, float, float]
    kind: str  # "hit or miss" or "t"
    ours_t: float | None
    ours_face: int | None
    theirs_t: float | None
    theirs_face: int | None
    exact_t: float | None = None
    exact_faces: tuple[int, ...] = ()
    ours_right: bool | None = None
    theirs_right: bool | None = None
    theirs_within_float32_rounding: bool | None = None
    verdict: str | None = None


@dataclass(frozen=True)
class HitComparison:
    """Counts of one ray family, relative errors of t over rays that both hit, and every disagreement."""

    family: str
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
        """How many disagreements each verdict has, all verdicts listed."""
        counts = Counter(d.verdict for d in self.disagreements)
        return {verdict: counts[verdict] for verdict in VERDICTS}

    @property
    def ours_wrong(self) -> int:
        """Rays on which ours is wrong beyond rounding, and those nobody judged: what a gate wants to be 0."""
        return self.verdicts[THEIRS_RIGHT] + self.verdicts[BOTH_WRONG] + self.unjudged

    def record(self) -> dict[str, object]:
        """Everything as plain dicts, lists, numbers and strings, ready for JSON."""
        counts = {"verdicts": self.verdicts, "unjudged": self.unjudged, "ours_wrong": self.ours_wrong}
        return asdict(self) | counts


@dataclass(frozen=True)
class ExactErrors:
    """Our hits against exact ones: rays that are wrong, rays within rounding of an edge, errors of t over
    right hits.
    """

    family: str
    rays: int
    hits: int
    wrong: int
    near_edge: int
    near_edge_flipped: int  # of these, hit where exact arithmetic misses or the reverse; the others are neighbours
    ulp_p50: float
    ulp_p99: float
    ulp_max: float
    relative_p50: float
    relative_max: float
    listed: tuple[Disagreement, ...]  # every ray counted in wrong or near_edge

    def record(self) -> dict[str, object]:
        """Everything as plain dicts, lists, numbers and strings, ready for JSON."""
        return asdict(self)


def compare(ours: HitArrays, theirs: HitArrays, vertices: ArrayLike, faces: ArrayLike, rays: RayBatch) -> HitComparison:
    """Compare two sets of closest hits of ``rays`` on the mesh ``vertices`` (V, 3), ``faces`` (F, 3).

    ``theirs`` comes from a float32 reference that was given the same, float32-exact numbers. Two hits agree
    when |t - t'| <= (RTOL + RTOL_GRAZING / |n.d|) max(|t|, |t'|), with n the unit normal of our face and d
    the unit direction.
    """
    if not len(ours.t) == len(theirs.t) == len(rays):
        got = f"{len(ours.t)}, {len(theirs.t)} and {len(rays)}"
        raise ValueError(f"ours, theirs, rays: expected equal numbers of rays, got {got}")
    corners = np.asarray(vertices, dtype=np.float64)[np.asarray(faces, dtype=np.int64)]
    both = np.flatnonzero(ours.hit & theirs.hit)
    t, other = ours.t[both], theirs.t[both]
    larger = np.maximum(np.abs(t), np.abs(other))
    error = np.divide(np.abs(t - other), larger, out=np.zeros(len(both)), where=larger > 0)

    # Write "not within" rather than "beyond", so that a nan is a disagreement.
    rtol = _relative_tolerance(corners[ours.face[both]], rays.directions[both])
    beyond = both[~(error <= rtol)]
    flipped = np.flatnonzero(ours.hit != theirs.hit)
    listed = [_disagreement(int(ray), "hit or miss", ours, theirs, rays) for ray in flipped]
    listed += [_disagreement(int(ray), "t", ours, theirs, rays) for ray in beyond]
    p50, p99, largest = _percentiles(error)
    return HitComparison(
        family=rays.name,
        rays=len(rays),
        both_hit=len(both),
        both_miss=int(np.count_nonzero(~ours.hit & ~theirs.hit)),
        only_ours=int(np.count_nonzero(ours.hit & ~theirs.hit)),
        only_theirs=int(np.count_nonzero(~ours.hit & theirs.hit)),
        t_error_p50=p50,
        t_error_p99=p99,
        t_error_max=largest,
        disagreements=tuple(listed),
    )


def judge(comparison: HitComparison, vertices: ArrayLike, faces: ArrayLike, most: int = 2000) -> HitComparison:
    """The comparison with an exact verdict on its disagreements; hits count at t >= 0.

    Only the first ``most`` are judged, so that a broken kernel ends in minutes; the others count as
    ``ours_wrong``.
    """
    points, triangles = np.asarray(vertices, dtype=np.float64), np.asarray(faces, dtype=np.int64)
    judged = [_judged(d, points, triangles) for d in comparison.disagreements[:most]]
    return replace(comparison, disagreements=(*judged, *comparison.disagreements[most:]))


def exact_errors(
    ours: HitArrays, exact_hits: list[ExactHit | None], vertices: ArrayLike, faces: ArrayLike, rays: RayBatch
) -> ExactErrors:
    """Judge every ray of ``ours`` against ``exact_hits`` (of ``exact.closest_hits`` for the same rays)."""
    if not len(ours.t) == len(exact_hits) == len(rays):
        got = f"{len(ours.t)}, {len(exact_hits)} and {len(rays)}"
        raise ValueError(f"ours, exact_hits, rays: expected equal numbers of rays, got {got}")
    points, triangles = np.asarray(vertices, dtype=np.float64), np.asarray(faces, dtype=np.int64)

    listed = []
    for ray in _rows_to_judge(ours, exact_hits, points[triangles], rays):
        verdict = _judged(_disagreement(ray, "exact", ours, None, rays), points, triangles)
        if not verdict.ours_right:
            listed.append(replace(verdict, theirs_right=None, theirs_within_float32_rounding=None))

    bad = {d.ray for d in listed}
    answers = enumerate(zip(ours.t.tolist(), exact_hits, strict=True))
    pairs = [(t, hit.t) for ray, (t, hit) in answers if hit is not None and ray not in bad]
    ulp = np.array([_ulp_error(t, true) for t, true in pairs])
    relative = np.array([_relative_error(t, true) for t, true in pairs])
    near_edge = sum(d.verdict == NEAR_EDGE for d in listed)
    ulp_p50, ulp_p99, ulp_max = _percentiles(ulp)
    relative_p50, _, relative_max = _percentiles(relative)
    return ExactErrors(
        family=rays.name,
        rays=len(rays),
        hits=sum(hit is not None for hit in exact_hits),
        wrong=len(listed) - near_edge,
        near_edge=near_edge,
        near_edge_flipped=sum(d.verdict == NEAR_EDGE and (d.ours_t is None) != (d.exact_t is None) for d in listed),
        ulp_p50=ulp_p50,
        ulp_p99=ulp_p99,
        ulp_max=ulp_max,
        relative_p50=relative_p50,
        relative_max=relative_max,
        listed=tuple(listed),
    )


def _judged(d: Disagreement, vertices: Floats, faces: Ints) -> Disagreement:
    in_float64 = RayView(vertices, faces, d.origin, d.direction, FLOAT64_ROUNDOFF)
    in_float32 = RayView(vertices, faces, d.origin, d.direction, FLOAT32_ROUNDOFF)
    ours_right = in_float64.is_right(d.ours_t, d.ours_face)
    theirs_right = in_float32.is_right(d.theirs_t, d.theirs_face)
    if ours_right:
        verdict = BOTH_RIGHT if theirs_right else OURS_RIGHT
    elif in_float64.is_permitted(d.ours_t, d.ours_face):
        verdict = NEAR_EDGE
    else:
        verdict = THEIRS_RIGHT if theirs_right else BOTH_WRONG
    return replace(
        d,
        exact_t=None if in_float64.closest is None else float(in_float64.closest),
        exact_faces=in_float64.closest_faces,
        ours_right=ours_right,
        theirs_right=theirs_right,
        theirs_within_float32_rounding=in_float32.is_permitted(d.theirs_t, d.theirs_face),
        verdict=verdict,
    )


def _relative_tolerance(corners: Floats, directions: Floats) -> Floats:
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normal, axis=1) * np.linalg.norm(directions, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        cosine = np.abs((normal * directions).sum(axis=1)) / lengths
    tolerance: Floats = RTOL + RTOL_GRAZING / np.maximum(cosine, MIN_COSINE)
    return tolerance


def _rows_to_judge(ours: HitArrays, exact_hits: list[ExactHit | None], corners: Floats, rays: RayBatch) -> list[int]:
    """Rays that are not plainly right, where right is a common miss, or a closest face and t in bounds."""
    rows, named, errors = [], [], []
    for ray, (t, face, hit) in enumerate(zip(ours.t.tolist(), ours.face.tolist(), exact_hits, strict=True)):
        if hit is None or face not in hit.faces_at_t:
            if hit is not None or face >= 0:
                rows.append(ray)
        # Every bound is at least 10 u |t|; look at the triangle only beyond 8 u (the rounding of hit.t takes
        # 1).
        elif not abs(t - float(hit.t)) <= 8 * FLOAT64_ROUNDOFF * abs(t):
            named.append(ray)
            errors.append(float(abs(Fraction(t) - hit.t)))
    if named:
        triangles, origins, directions = (
            corners[ours.face[named]],
            rays.origins[named],
            rays.directions[named],
        )
        triples = zip(triangles, origins, directions, strict=True)
        edges = np.array([[float(value) for value in exact.determinants(*triple)[:3]] for triple in triples])
        inside = np.array(errors) <= t_bounds(triangles, origins, directions, edges)
        rows += np.array(named)[~inside].tolist()
    return sorted(rows)


def _ulp_error(t: float, true: Fraction) -> float:
    return float(abs(Fraction(t) - true) / Fraction(float(np.spacing(abs(float(true))))))


def _relative_error(t: float, true: Fraction) -> float:
    """Relative error; where the exact distance is 0, 0 if t is and 1 if not."""
    return float(abs(Fraction(t) - true) / true) if true else float(t != 0)


def _disagreement(ray: int, kind: str, ours: HitArrays, theirs: HitArrays | None, rays: RayBatch) -> Disagreement:
    ox, oy, oz = rays.origins[ray].tolist()
    dx, dy, dz = rays.directions[ray].tolist()
    ours_t, ours_face = _answer(ours, ray)
    theirs_t, theirs_face = (None, None) if theirs is None else _answer(theirs, ray)
    return Disagreement(ray, (ox, oy, oz), (dx, dy, dz), kind, ours_t, ours_face, theirs_t, theirs_face)


def _answer(hits: HitArrays, ray: int) -> tuple[float | None, int | None]:
    return (float(hits.t[ray]), int(hits.face[ray])) if hits.face[ray] >= 0 else (None, None)


def _percentiles(values: Floats) -> tuple[float, float, float]:
    """Median, 99th percentile and maximum; 0 of nothing."""
    if not len(values):
        return 0.0, 0.0, 0.0
    p50, p99 = np.percentile(values, (50, 99))
    return float(p50), float(p99), float(values.max())

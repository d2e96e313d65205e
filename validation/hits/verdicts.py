"""The verdict of exact arithmetic on one ray on which we and a reference disagree.

It trusts neither side. An answer is *right* when exact arithmetic gives the same hit or miss and t lies within the
derived rounding bound of the exact distance of the named face. If an answer of ours is not right, rounding may still
permit it in a watertight kernel (``rounding.RayView``): then the exact decision rests on less than float64 resolves,
and the ray is counted apart.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from fractions import Fraction
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from validation.hits.rays import RayFamily
from validation.oracle import exact
from validation.oracle.distance import way_from
from validation.oracle.exact import ExactHit
from validation.oracle.rounding import FLOAT64_ROUNDOFF, RayView, t_bounds

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Point = tuple[float, float, float]
# The judgement of an answer of ours: "near edge" where rounding permits it, None where it was not judged.
Judgement = Literal["right", "near edge", "wrong"] | None

OURS_RIGHT = "ours right"
THEIRS_RIGHT = "theirs right"
BOTH_RIGHT = "both right (each within its rounding)"
# Or of t = 0, where a ray begins: the other boundary of a hit.
NEAR_EDGE = "within float64 rounding of an edge"
BOTH_WRONG = "both wrong"
VERDICTS = (OURS_RIGHT, THEIRS_RIGHT, BOTH_RIGHT, NEAR_EDGE, BOTH_WRONG)
OURS_WRONG: tuple[str | None, ...] = (THEIRS_RIGHT, BOTH_WRONG, None)

# Judging a ray takes milliseconds. After this many wrong ones the kernel is broken and the verdict settled: all rays
# that are not judged then count as wrong.
SETTLED = 30

# Disagreements that a record lists one by one; it counts all.
LISTED = 3


@dataclass(frozen=True)
class Disagreement:
    """One ray with different answers; t and face are None on a miss. The other fields are None until judged.

    ``verdict`` stays None where ours is not plainly right and the ray was not judged, see ``judgements``.
    """

    ray: int
    origin: Point
    direction: Point
    kind: str  # "hit or miss" or "t"
    ours_t: float | None
    ours_face: int | None
    theirs_t: float | None
    theirs_face: int | None
    exact_t: float | None = None
    exact_faces: tuple[int, ...] = ()
    ours_right: bool | None = None
    theirs_right: bool | None = None
    verdict: str | None = None

    @property
    def answered(self) -> tuple[Point, Point, float | None, int | None]:
        """The ray and our answer, as the key of a judgement.

        Both, because 0 and -0 in a direction are equal and could have different answers.
        """
        return self.origin, self.direction, self.ours_t, self.ours_face


def listed(disagreements: Sequence[Disagreement]) -> list[dict[str, object]]:
    """The first few as tables for JSON, those against us first."""
    order = (*OURS_WRONG, NEAR_EDGE, OURS_RIGHT, BOTH_RIGHT)
    return [asdict(d) for d in sorted(disagreements, key=lambda d: order.index(d.verdict))[:LISTED]]


def judgements(
    t: Floats,
    face: Ints,
    exact_hits: Sequence[ExactHit | None],
    vertices: Floats,
    faces: Ints,
    rays: RayFamily,
    most: int,
) -> dict[int, Judgement]:
    """Judgements of our answers ``t``, ``face`` (n,), by row, where they are not plainly right.

    None where the ray was not judged: beyond the first ``most`` rows, and after ``SETTLED`` wrong ones.
    """
    seen: dict[int, Judgement] = {}
    wrong = 0
    for row in _rows_to_judge(t, face, exact_hits, vertices[faces], rays):
        seen[row] = None
        if len(seen) <= most and wrong < SETTLED:
            answer = (float(t[row]), int(face[row])) if face[row] >= 0 else (None, None)
            ray = RayView(vertices, faces, tuple(rays.origins[row]), tuple(rays.directions[row]), FLOAT64_ROUNDOFF)
            seen[row] = "right" if ray.is_right(*answer) else "near edge" if ray.is_permitted(*answer) else "wrong"
            wrong += seen[row] == "wrong"
    return seen


def judged(d: Disagreement, hit: ExactHit | None, ours: Judgement, theirs_right: bool) -> Disagreement:
    """The disagreement with its verdict, from the exact hit, our answer's judgement and whether theirs is right."""
    verdict = {
        "right": BOTH_RIGHT if theirs_right else OURS_RIGHT,
        "near edge": NEAR_EDGE,
        "wrong": THEIRS_RIGHT if theirs_right else BOTH_WRONG,
        None: None,
    }[ours]
    ours_right = None if ours is None else ours == "right"
    return replace(with_truth(d, hit), ours_right=ours_right, theirs_right=theirs_right, verdict=verdict)


def theirs_right(
    disagreements: Sequence[Disagreement], exact_hits: Sequence[ExactHit | None], corners: Floats, roundoff: float
) -> list[bool]:
    """Whether answers in arithmetic of ``roundoff`` are right; ``corners`` (F, 3, 3) are those of all faces.

    Right means the same hit or miss, a face that is exactly hit, t within its bound, and t no farther from the closest
    face than the bounds of both.
    """
    pairs = list(zip(disagreements, exact_hits, strict=True))
    right = [hit is None and d.theirs_face is None for d, hit in pairs]
    both = [(row, d, hit) for row, (d, hit) in enumerate(pairs) if hit is not None and d.theirs_face is not None]
    named = _on_planes([(d, d.theirs_face or 0) for _, d, _ in both], corners, roundoff)
    farther = [(d, hit.face) for _, d, hit in both if d.theirs_face not in hit.faces_at_t]
    closest = iter(_on_planes(farther, corners, roundoff))
    for (row, d, hit), (t, bound) in zip(both, named, strict=True):
        slack = bound if d.theirs_face in hit.faces_at_t else bound + next(closest)[1]
        right[row] = t is not None and t >= 0 and way_from(d.theirs_t or 0.0, t) <= bound and t - hit.t <= slack
    return right


def _on_planes(
    rays: Sequence[tuple[Disagreement, int]], corners: Floats, roundoff: float
) -> list[tuple[Fraction | None, float]]:
    """Exact t where each ray hits its face, None where it does not, and the bound on t there."""
    if not rays:
        return []
    triangles = corners[[face for _, face in rays]]
    origins, directions = np.array([d.origin for d, _ in rays]), np.array([d.direction for d, _ in rays])
    exactly = [exact.determinants(*triple) for triple in zip(triangles, origins, directions, strict=True)]
    edges = np.array([[float(value) for value in one[:3]] for one in exactly])
    bounds = t_bounds(triangles, origins, directions, edges, roundoff).tolist()
    hit = [not min(u, v, w) < 0 < max(u, v, w) and u + v + w != 0 for u, v, w, _ in exactly]
    ts = [depth / (u + v + w) if met else None for met, (u, v, w, depth) in zip(hit, exactly, strict=True)]
    return list(zip(ts, bounds, strict=True))


def with_truth(d: Disagreement, hit: ExactHit | None) -> Disagreement:
    """The disagreement with the exact hit."""
    return d if hit is None else replace(d, exact_t=float(hit.t), exact_faces=hit.faces_at_t)


def _rows_to_judge(
    t: Floats, face: Ints, exact_hits: Sequence[ExactHit | None], corners: Floats, rays: RayFamily
) -> list[int]:
    """Rows that are not plainly right, where right is a common miss, or a closest face with t in bounds."""
    rows, named, errors = [], [], []
    for row, (ours, name, hit) in enumerate(zip(t.tolist(), face.tolist(), exact_hits, strict=True)):
        if hit is None or name not in hit.faces_at_t:
            if hit is not None or name >= 0:
                rows.append(row)
        # Every bound is at least 10 u |t|: compute the triangle's own only beyond 8 u (the rounding of hit.t takes 1).
        elif not abs(ours - float(hit.t)) <= 8 * FLOAT64_ROUNDOFF * abs(ours) < np.inf:
            named.append(row)
            errors.append(float(way_from(ours, hit.t)))
    if named:
        triangles, origins, directions = corners[face[named]], rays.origins[named], rays.directions[named]
        triples = zip(triangles, origins, directions, strict=True)
        edges = np.array([[float(value) for value in exact.determinants(*triple)[:3]] for triple in triples])
        inside = np.array(errors) <= t_bounds(triangles, origins, directions, edges)
        rows += np.array(named)[~inside].tolist()
    return sorted(rows)

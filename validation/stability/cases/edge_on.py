"""Row 50 of the extreme cases: rays within rounding of a face's plane, and at faces much thinner than they are long."""

from fractions import Fraction

import numpy as np
from numpy.random import Generator

from renderer import Octree
from validation.oracle.distance import squared_distance
from validation.oracle.vectors import cross, difference, dot, rational
from validation.stability.cases.case import ExtremeCase, Outcome
from validation.stability.cases.judgement import SEED, Floats

# Of the largest component of a corner relative to the origin. A determinant in no doubt is more than 2^-16 of its
# terms, so it blows a rounding of 2^-53 up to 2^-37 at most.
NEAR = Fraction(1, 2**37)
# A ray that passes all sides by more than this is no matter of rounding: 2^-53 for each of about 500 roundings.
SURE = Fraction(1, 2**44)


def thin_face(rng: Generator) -> Floats:
    """Corners (3, 3): any face, or one 1e-17 to 1e-3 of its length wide; flat in an axis at times, of any size."""
    corners = rng.normal(size=(3, 3))
    if rng.random() < 0.75:
        share = rng.choice([0.0, 1.0, 0.5, 1e-8, rng.random()])
        corners[2] = corners[0] + share * (corners[1] - corners[0]) + 10.0 ** rng.uniform(-17, -3) * corners[2]
    if rng.random() < 0.3:
        corners[:, rng.integers(3)] = rng.choice([0.0, 1.0, 0.1])
    return np.asarray(corners[rng.permutation(3)] * 10.0 ** rng.choice([0.0, rng.uniform(-5, 5)]))


def ray_at(rng: Generator, corners: Floats) -> tuple[Floats, Floats]:
    """Origin and direction (3,) of a ray at a face: from anywhere, near its plane, along a side, or beside it."""
    first, second = corners[1] - corners[0], corners[2] - corners[0]
    target, weights, way = rng.dirichlet([0.4] * 3) @ corners, rng.normal(size=2), rng.integers(5)
    direction = rng.normal(size=3)
    if way > 0 and first.any() and second.any():
        direction = first if way == 1 else weights[0] * first + weights[1] * second
        direction = direction / np.abs(direction).max() * rng.uniform(0.5, 2.0)
    if way >= 3:
        direction = direction + 10.0 ** rng.uniform(-18, -4) * rng.normal(size=3)
    if way == 4 and rng.random() < 0.5:
        target = target + 0.3 * rng.normal() * (weights[1] * first - weights[0] * second)
    away = np.abs(corners[1:] - corners[0]).max() * rng.choice([0.1, 1.0, 2.0, 10.0])
    return target - direction * away * rng.uniform(0.5, 1.0), direction


def rays_beside(rng: Generator, corners: Floats, count: int) -> tuple[Floats, Floats]:
    """Origins and directions (count, 3) in a face's plane, as rounded, that pass it at up to its size."""
    first, second = corners[1] - corners[0], corners[2] - corners[0]
    along = first / np.linalg.norm(first)
    across = second - (second @ along) * along
    across /= max(float(np.linalg.norm(across)), np.finfo(float).tiny)
    angle, size = rng.uniform(0, 2 * np.pi, (count, 1)), np.linalg.norm(first) + np.linalg.norm(second)
    directions = np.cos(angle) * along + np.sin(angle) * across
    sideways = -np.sin(angle) * along + np.cos(angle) * across
    origins = corners[0] + size * (sideways * rng.uniform(1.01, 2.0, (count, 1)) - 2.0 * directions)
    return origins, directions * rng.uniform(0.5, 2.0, (count, 1))


def judged(corners: Floats, origin: Floats, direction: Floats, t: float) -> tuple[bool, bool]:
    """Whether a ray with t finite is too far from its face there, and whether one without a hit surely has one."""
    face, (o, d) = rational(corners.tolist()), rational([origin.tolist(), direction.tolist()])
    relative = [difference(p, o) for p in face]
    reach = max(abs(x) for p in relative for x in p)
    if np.isfinite(t):
        point = [x + Fraction(t) * y for x, y in zip(o, d, strict=True)]
        return squared_distance(point, face) > (NEAR * reach) ** 2, False
    sides = [(relative[k], relative[(k + 1) % 3]) for k in range(3)]
    volumes = [dot(d, cross(p, q)) for p, q in sides]
    inside = min(volumes) > 0 or max(volumes) < 0
    # How far the ray's line passes a side: the volume over the area that the side and the direction span.
    spans = [cross(d, difference(q, p)) for p, q in sides]
    clear = all(v**2 > (SURE * reach) ** 2 * dot(s, s) for v, s in zip(volumes, spans, strict=True))
    ahead = sum(volumes) * dot(relative[0], cross(relative[1], relative[2])) > 0
    return False, inside and clear and ahead


def _edge_on(quick: bool) -> Outcome:
    rng, count = np.random.default_rng(SEED), 400 if quick else 10_000
    beside, lost, hit, again = 0, 0, 0, 0
    for _ in range(count):
        corners = thin_face(rng)
        origin, direction = ray_at(rng, corners)
        octree = Octree(corners, [[0, 1, 2]])
        t = octree.closest_hit(origin, direction).t
        off, missing = judged(corners, origin, direction, float(t))
        beside, lost, hit = beside + off, lost + missing, hit + bool(np.isfinite(t))
        again += bool(np.isfinite(t) and octree.closest_hit(origin, direction, t, t).t != t)
    for _ in range(50):
        corners = rng.normal(size=(3, 3))
        octree, rays = Octree(corners, [[0, 1, 2]]), rays_beside(rng, corners, 2000)
        found = zip(*rays, octree.closest_hit(*rays).t, strict=True)
        beside += sum(judged(corners, o, d, float(t))[0] for o, d, t in found if np.isfinite(t))
    said = f"{beside} beside, {lost} lost, {again} not hit again from their t, {hit:,} of {count:,} hit"
    # Half of the rays pass beside their faces, or in their planes.
    return Outcome(said, not (beside or lost or again) and hit > count // 3)


CASES: tuple[ExtremeCase, ...] = (
    ExtremeCase(
        50, "rays along a face's plane, at and beside it; rays at slivers 1e-17 to 1e-3 of their length wide",
        "no hit beside its face, none lost; with t_min = t_max = t the same hit", ("exact",),
        "2^-37 of the distance: a rounding, times the 2^16 that a determinant in no doubt may blow it up", _edge_on,
    ),
)  # fmt: skip

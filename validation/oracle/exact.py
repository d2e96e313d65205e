"""Ray/triangle intersection in exact rational arithmetic: the judge of every other kernel.

Every finite float64 is an integer times a power of two, so a ray and a triangle scale to integers, the three
edge determinants and the distance are integers too, and no verdict here rests on a tolerance. With a = p0 -
o, b = p1 - o, c = p2 - o:

    U = d . (b x c),  V = d . (c x a),  W = d . (a x b),  T = a . (b x c),  t = T / (U + V + W).

Semantics: a triangle is closed (its edges and vertices belong to it) and two-sided; a ray in the triangle's plane and a
triangle of zero area are missed; t counts in units of |direction|; t_min <= t <= t_max is closed; the closest hit is
the smallest exact t and, at equal t, the lowest face.

A float64 filter runs before the rational test; it discards only faces that it proves to be missed.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from validation.oracle.vectors import Whole, whole

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]
Ratio = tuple[int, int]

FLOAT64_ROUNDOFF = 2.0**-53

# A float64 determinant errs by at most gamma(7) |d|_inf |b|_1 |c|_1 when written out (differences, products
# and sums are at most 7 roundings deep, and the sum of |terms| is at most |d|_inf |b|_1 |c|_1), and by at
# most gamma(12) 2 |d|_inf |b|_1 |c|_1 by Woop's shear (division, reciprocal, product and difference for each
# of the two coordinates, then product and difference; the sheared coordinates are at most |b|_1 and |c|_1,
# and there are two products). 24 therefore covers both; the rest covers the rounding of the bound itself.
DETERMINANT_ROUNDINGS = 32.0

# A product that underflows errs by at most 2^-1075 and is then multiplied by at most one other number.
UNDERFLOW = 2.0**-1070

# (plane - o) / d has two roundings and the widened value a third: 3 u and a little, rounded up generously.
BOX_WIDENING = 8 * FLOAT64_ROUNDOFF

_LEAF_FACES = 4
_RAYS_AT_ONCE = 4096


@dataclass(frozen=True)
class ExactHit:
    """Closest hit of one ray: exact ``t``, the lowest ``face`` at that t, and all faces that attain it, ascending."""

    t: Fraction
    face: int
    faces_at_t: tuple[int, ...]


def intersect(triangle: ArrayLike, origin: ArrayLike, direction: ArrayLike) -> Fraction | None:
    """Exact t (of any sign) at which the line ``origin + t direction`` meets ``triangle`` (3, 3), or None on a miss.

    >>> intersect([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [0.25, 0.25, 1], [0, 0, -3])
    Fraction(1, 3)
    """
    u, v, w, t = determinants(triangle, origin, direction)
    if min(u, v, w) < 0 < max(u, v, w) or u + v + w == 0:
        return None
    return t / (u + v + w)


def determinants(
    triangle: ArrayLike, origin: ArrayLike, direction: ArrayLike
) -> tuple[Fraction, Fraction, Fraction, Fraction]:
    """Exact (U, V, W, T) as the module defines them: the three edge determinants and the numerator of t."""
    corners, origins, directions = (
        _finite(triangle, "triangle"),
        _rows(origin, "origin"),
        _rows(direction, "direction"),
    )
    # For one triangle ``_Scaled`` would spend most of its time on calls of numpy.
    (a, b, c, o), place = whole([*corners.tolist(), origins[0].tolist()])
    (d,), way = whole([directions[0].tolist()])
    u, v, w = (Fraction(value, place * place * way) for value in _edge_determinants(a, b, c, o, d))
    return u, v, w, Fraction(_depth(a, b, c, o), place**3)


def mesh_determinants(
    vertices: ArrayLike, faces: ArrayLike, origin: ArrayLike, direction: ArrayLike
) -> tuple[list[tuple[int, int, int, int]], Fraction]:
    """(U, V, W, T) of every face as integers, scaled alike, and the unit of t = T / (U + V + W)."""
    points, triangles = _mesh(vertices, faces)
    query = _Scaled(points, _rows(origin, "origin"), _rows(direction, "direction"))
    o, d, found = query.origins[0], query.directions[0], []
    for i, j, k in triangles.tolist():
        a, b, c = query.vertices[i], query.vertices[j], query.vertices[k]
        found.append((*_edge_determinants(a, b, c, o, d), _depth(a, b, c, o)))
    return found, query.t_unit


def closest_hit(
    vertices: ArrayLike,
    faces: ArrayLike,
    origin: ArrayLike,
    direction: ArrayLike,
    t_min: float = 0.0,
    t_max: float = math.inf,
    candidates: Iterable[int] | None = None,
) -> ExactHit | None:
    """Exact closest hit of one ray with t_min <= t <= t_max, or None; only ``candidates`` are tested where given."""
    points, triangles = _mesh(vertices, faces)
    query = _Scaled(points, _rows(origin, "origin"), _rows(direction, "direction"))
    tested = range(len(triangles)) if candidates is None else sorted(candidates)
    return query.closest(0, [(face, *triangles[face].tolist()) for face in tested], t_min, t_max)


def closest_hits(
    vertices: ArrayLike,
    faces: ArrayLike,
    origins: ArrayLike,
    directions: ArrayLike,
    t_min: float = 0.0,
    t_max: float = math.inf,
    filtered: bool = True,
) -> list[ExactHit | None]:
    """Exact closest hits of a batch, one entry a ray, None on a miss.

    ``vertices`` (V, 3) and ``faces`` (F, 3) are the mesh, ``origins`` and ``directions`` (n, 3) the rays, all
    finite. ``filtered=False`` judges every face for every ray rationally; the answer is the same. Raises
    ``ValueError`` for wrong shapes, numbers that are not finite and face indices out of range.
    """
    # Check the input.
    points, triangles = _mesh(vertices, faces)
    o, d = _rows(origins, "origins"), _rows(directions, "directions")
    if o.shape != d.shape:
        raise ValueError(f"directions: expected the shape of origins {o.shape}, got {d.shape}")

    # Scale to integers; without the filter test every face.
    query = _Scaled(points, o, d)
    named, boxes = _sorted_out(points.tobytes(), triangles.tobytes())
    if not filtered:
        return [query.closest(ray, named, t_min, t_max) for ray in range(len(o))]
    if boxes is None:
        return [None] * len(o)

    # Filter the faces for many rays at once, then test each ray's candidates exactly.
    hits: list[ExactHit | None] = []
    for start in range(0, len(o), _RAYS_AT_ONCE):
        rows = slice(start, start + _RAYS_AT_ONCE)
        ray, face = boxes.candidates(o[rows], d[rows], t_min, t_max)
        by_ray = np.lexsort((face, ray))
        ends = np.searchsorted(ray[by_ray], np.arange(len(o[rows]) + 1)).tolist()
        listed = face[by_ray].tolist()
        for i in range(len(o[rows])):
            hits.append(query.closest(start + i, [named[f] for f in listed[ends[i] : ends[i + 1]]], t_min, t_max))
    return hits


@lru_cache(maxsize=2)
def _sorted_out(vertices: bytes, faces: bytes) -> tuple[list[tuple[int, int, int, int]], "_BoxTree | None"]:
    """Each face with its number, and the boxes, None without faces; kept, as many families of rays meet one mesh."""
    points, triangles = np.frombuffer(vertices).reshape(-1, 3), np.frombuffer(faces, np.int64).reshape(-1, 3)
    named = [(face, i, j, k) for face, (i, j, k) in enumerate(triangles.tolist())]
    return named, _BoxTree(points[triangles]) if named else None


def possible_faces(
    vertices: ArrayLike,
    faces: ArrayLike,
    origin: ArrayLike,
    direction: ArrayLike,
    unit_roundoff: float = FLOAT64_ROUNDOFF,
) -> Ints:
    """All faces, ascending, that arithmetic with ``unit_roundoff`` might call hit by the line through the ray.

    Every face that is exactly hit is among them. There is no broad phase: where a ray passes a face within rounding, it
    may miss the face's box altogether.
    """
    points, triangles = _mesh(vertices, faces)
    o, d = _rows(origin, "origin"), _rows(direction, "direction")
    return np.flatnonzero(_possible(points[triangles], o, d, unit_roundoff))


def determinant_bounds(relative: Floats, directions: Floats, unit_roundoff: float = FLOAT64_ROUNDOFF) -> Floats:
    """Bounds (n, 3) on the error of U, V, W in arithmetic with ``unit_roundoff``; corners - origin are (n, 3, 3)."""
    size = np.abs(relative).sum(axis=2)
    longest = np.abs(directions).max(axis=1)[:, None]
    products = np.stack((size[:, 1] * size[:, 2], size[:, 2] * size[:, 0], size[:, 0] * size[:, 1]), axis=1)
    underflow = UNDERFLOW * (1.0 + 3.0 * longest)
    bounds: Floats = DETERMINANT_ROUNDINGS * unit_roundoff * longest * products + underflow
    return bounds


# ---------------------------------------------------------------------------------------------- rational test


class _Scaled:
    """Mesh and rays as integers: positions times 2^-position_exponent, directions times 2^-direction_exponent."""

    def __init__(self, vertices: Floats, origins: Floats, directions: Floats) -> None:
        self.position_exponent = _common_exponent(vertices, origins)
        self.direction_exponent = _common_exponent(directions)
        self.vertices = _integers(vertices, self.position_exponent)
        self.origins = _integers(origins, self.position_exponent)
        self.directions = _integers(directions, self.direction_exponent)
        # T / (U + V + W) of the integers is t times 2^(direction_exponent - position_exponent).
        self.t_unit = Fraction(2) ** (self.position_exponent - self.direction_exponent)

    def closest(
        self, ray: int, candidates: Iterable[tuple[int, int, int, int]], t_min: float, t_max: float
    ) -> ExactHit | None:
        """Closest hit of ``ray`` among ``candidates`` (face, i, j, k), given in ascending order of face."""
        first, last = self._limit(t_min), self._limit(t_max)
        o, d = self.origins[ray], self.directions[ray]
        best: Ratio = (1, 0)  # 1/0 is infinity: every fraction is smaller
        tied: list[int] = []
        for face, i, j, k in candidates:
            found = ratio(self.vertices[i], self.vertices[j], self.vertices[k], o, d)
            if found is None or not (_not_after(first, found) and _not_after(found, last)):
                continue
            difference = found[0] * best[1] - best[0] * found[1]
            if difference < 0:
                best, tied = found, [face]
            elif difference == 0:
                tied.append(face)
        return ExactHit(Fraction(*best) * self.t_unit, tied[0], tuple(tied)) if tied else None

    def _limit(self, t: float) -> Ratio:
        """``t`` in the integers' units; -1/0 and 1/0 are the infinities."""
        if math.isnan(t):
            raise ValueError("t_min, t_max: expected numbers, got nan")
        if math.isinf(t):
            return (1 if t > 0 else -1), 0
        return (Fraction(t) / self.t_unit).as_integer_ratio()


def _not_after(first: Ratio, second: Ratio) -> bool:
    return first[0] * second[1] <= second[0] * first[1]


def ratio(p0: Whole, p1: Whole, p2: Whole, o: Whole, d: Whole) -> Ratio | None:
    """T and U + V + W of one face, with a positive denominator, or None on a miss."""
    u, v, w = _edge_determinants(p0, p1, p2, o, d)
    if (u < 0 or v < 0 or w < 0) and (u > 0 or v > 0 or w > 0):
        return None
    det = u + v + w
    if det == 0:
        return None
    depth = _depth(p0, p1, p2, o)
    return (depth, det) if det > 0 else (-depth, -det)


def _edge_determinants(p0: Whole, p1: Whole, p2: Whole, o: Whole, d: Whole) -> Whole:
    """U, V, W: each the triple product of d and two corners relative to o."""
    ox, oy, oz = o
    dx, dy, dz = d
    ax, ay, az = p0[0] - ox, p0[1] - oy, p0[2] - oz
    bx, by, bz = p1[0] - ox, p1[1] - oy, p1[2] - oz
    cx, cy, cz = p2[0] - ox, p2[1] - oy, p2[2] - oz
    u = dx * (by * cz - bz * cy) + dy * (bz * cx - bx * cz) + dz * (bx * cy - by * cx)
    v = dx * (cy * az - cz * ay) + dy * (cz * ax - cx * az) + dz * (cx * ay - cy * ax)
    w = dx * (ay * bz - az * by) + dy * (az * bx - ax * bz) + dz * (ax * by - ay * bx)
    return u, v, w


def _depth(p0: Whole, p1: Whole, p2: Whole, o: Whole) -> int:
    """T = a . (b x c), which equals the triangle's area vector dotted with a."""
    ax, ay, az = p0[0] - o[0], p0[1] - o[1], p0[2] - o[2]
    bx, by, bz = p1[0] - o[0], p1[1] - o[1], p1[2] - o[2]
    cx, cy, cz = p2[0] - o[0], p2[1] - o[1], p2[2] - o[2]
    return ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)


def _common_exponent(*arrays: Floats) -> int:
    """Largest e for which every value is an integer times 2^e."""
    values = np.concatenate([array.ravel() for array in arrays])
    fraction, exponent = np.frexp(values[values != 0])
    if not len(fraction):
        return 0
    mantissa = (fraction * 2.0**53).astype(np.int64)
    _, lowest_bit = np.frexp((mantissa & -mantissa).astype(np.float64))
    return int((exponent - 54 + lowest_bit).min())


def _integers(values: Floats, exponent: int) -> list[Whole]:
    """Rows of ``values`` (n, 3) divided by 2^exponent, as Python integers."""
    fraction, power = np.frexp(values)
    mantissas = (fraction * 2.0**53).astype(np.int64).ravel().tolist()
    shifts = (power.astype(np.int64) - 53 - exponent).ravel().tolist()
    # A right shift only drops zero bits: 2^exponent divides every value.
    whole = [m << s if s >= 0 else m >> -s for m, s in zip(mantissas, shifts, strict=True)]
    return list(zip(whole[0::3], whole[1::3], whole[2::3], strict=True))


# ------------------------------------------------------------------------------------------------- the filter


def _possible(corners: Floats, origins: Floats, directions: Floats, unit_roundoff: float) -> Bools:
    """Mask (n,) of pairs not proved a miss: a miss has two determinants beyond their bounds with opposite signs.

    Overflow makes the bound infinite (it holds the same products without cancellation), so nothing is discarded. Where
    the library contracts a sum to fused multiply-adds there are fewer roundings, so the bound holds.
    """
    with np.errstate(over="ignore", invalid="ignore", under="ignore"):
        relative = corners - origins[:, None, :]
        directions = np.broadcast_to(directions, (len(relative), 3))
        values = _float_determinants(relative, directions)
        bounds = determinant_bounds(relative, directions, unit_roundoff)
        missed = (values > bounds).any(axis=1) & (values < -bounds).any(axis=1)
    return np.asarray(~missed)


def _float_determinants(relative: Floats, directions: Floats) -> Floats:
    """U, V, W (n, 3) in float64 from corners - origin (n, 3, 3); errors are within ``determinant_bounds``."""
    a, b, c = relative[:, 0].T, relative[:, 1].T, relative[:, 2].T
    d = directions.T
    return np.stack([_triple(d, b, c), _triple(d, c, a), _triple(d, a, b)], axis=1)


def _triple(d: Floats, p: Floats, q: Floats) -> Floats:
    x = p[1] * q[2] - p[2] * q[1]
    y = p[2] * q[0] - p[0] * q[2]
    z = p[0] * q[1] - p[1] * q[0]
    product: Floats = d[0] * x + d[1] * y + d[2] * z
    return product


class _BoxTree:
    """Complete binary tree of exact bounding boxes; node i of level L holds places (i F >> L) ... ((i + 1) F >> L)."""

    def __init__(self, corners: Floats) -> None:
        self.corners = corners
        count = len(corners)
        depth = max(0, (count // _LEAF_FACES).bit_length() - 1)
        # Halve before adding: the sum of two finite numbers may overflow.
        centres = corners.min(axis=1) / 2 + corners.max(axis=1) / 2

        # Sort each node's faces along the longest side of their centres, so that its halves are its children.
        self.order = np.arange(count)
        for level in range(depth):
            starts = _starts(level, count)
            node = np.repeat(np.arange(1 << level), np.diff(starts, append=count))
            placed = centres[self.order] / 2
            extent = np.maximum.reduceat(placed, starts) - np.minimum.reduceat(placed, starts)
            axis = extent.argmax(axis=1)[node]
            self.order = self.order[np.lexsort((placed[np.arange(count), axis], node))]

        lower, upper = corners.min(axis=1)[self.order], corners.max(axis=1)[self.order]
        self.levels = [
            (np.minimum.reduceat(lower, starts), np.maximum.reduceat(upper, starts))
            for starts in (_starts(level, count) for level in range(depth + 1))
        ]
        self.leaf_ends = np.append(_starts(depth, count), count)

    def candidates(self, origins: Floats, directions: Floats, t_min: float, t_max: float) -> tuple[Ints, Ints]:
        """Pairs (ray, face) that the filter cannot prove to be misses."""
        ray = np.arange(len(origins))
        node = np.zeros(len(origins), dtype=np.int64)
        for level, (lower, upper) in enumerate(self.levels):
            if level:
                ray, node = np.repeat(ray, 2), np.stack((2 * node, 2 * node + 1), axis=1).ravel()
            kept = _may_meet_box(lower[node], upper[node], origins[ray], directions[ray], (t_min, t_max))
            ray, node = ray[kept], node[kept]

        first, count = self.leaf_ends[node], self.leaf_ends[node + 1] - self.leaf_ends[node]
        ray = np.repeat(ray, count)
        place = np.arange(len(ray)) + np.repeat(first - (np.cumsum(count) - count), count)
        face = self.order[place]
        kept = _possible(self.corners[face], origins[ray], directions[ray], FLOAT64_ROUNDOFF)
        return ray[kept], face[kept]


def _starts(level: int, count: int) -> Ints:
    return (np.arange(1 << level) * count) >> level


def _may_meet_box(
    lower: Floats, upper: Floats, origins: Floats, directions: Floats, limits: tuple[float, float]
) -> Bools:
    """Mask (n,) of pairs whose ray is not proved to miss its box.

    Each distance to a plane is moved outwards by more than its rounding and underflow. Where a difference overflows,
    the axis proves nothing; where a quotient overflows, the true one is no smaller than the largest float64.
    """
    with np.errstate(all="ignore"):
        to_lower, to_upper = lower - origins, upper - origins
        first, second = to_lower / directions, to_upper / directions
        near, far = np.minimum(first, second), np.maximum(first, second)
        near = near * np.where(near > 0, 1 - BOX_WIDENING, 1 + BOX_WIDENING) - UNDERFLOW
        far = far * np.where(far > 0, 1 + BOX_WIDENING, 1 - BOX_WIDENING) + UNDERFLOW
    parallel = directions == 0
    unbounded = parallel | ~np.isfinite(to_lower) | ~np.isfinite(to_upper)
    enters = np.where(unbounded, -np.inf, near).max(axis=1)
    leaves = np.where(unbounded, np.inf, far).min(axis=1)
    beside = (parallel & ((lower > origins) | (upper < origins))).any(axis=1)
    met: Bools = ~beside & (enters <= leaves) & (enters <= limits[1]) & (leaves >= limits[0])
    return met


# ----------------------------------------------------------------------------------------------------- checks


def _finite(values: ArrayLike, name: str) -> Floats:
    array = np.asarray(values, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"{name}: expected shape (n, 3), got {array.shape}")
    bad = np.flatnonzero(~np.isfinite(array).all(axis=1))
    if len(bad):
        raise ValueError(f"{name}: expected finite numbers, got {array[bad[0]].tolist()} in row {bad[0]}")
    return array


def _rows(values: ArrayLike, name: str) -> Floats:
    return _finite(np.atleast_2d(np.asarray(values, dtype=np.float64)), name)


def _mesh(vertices: ArrayLike, faces: ArrayLike) -> tuple[Floats, Ints]:
    points = _finite(vertices, "vertices")
    triangles = np.asarray(faces, dtype=np.int64).reshape(-1, 3)
    bad = np.flatnonzero(((triangles < 0) | (triangles >= len(points))).any(axis=1))
    if len(bad):
        got = f"{triangles[bad[0]].tolist()} in row {bad[0]}"
        raise ValueError(f"faces: expected indices 0 ... {len(points) - 1}, got {got}")
    return points, triangles

"""Nearest points in rational arithmetic, for the few points whose products float64 cannot represent."""

import math
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from renderer.distance.nearest import measure_faces
from renderer.numerics.rational import Vector, corners_from, dot, less

# What the few roundings of the bounds below may change.
_MORE = 1.0 + 2.0**-48
# Bits of a root beyond those of float64, so that what is cut off never makes a tie.
_BITS = 130


def nearest_exactly(
    point: NDArray[np.float64], triangles: NDArray[np.float64], scale: float
) -> tuple[float, float, float, int]:
    """The distance of a point (3,) from triangles (F, 3 corners, 3), u, v and the face.

    Faces that float64 can decide get the distances of a search, with the tree's ``scale``, so that answers do not
    depend on the order of a search; the distances of the others are rounded once. At equal distances the lowest face
    wins.
    """
    faces, found = _candidates(point, triangles), list[tuple[float, int, float, float]]()
    measured = np.zeros((len(faces), 4))
    if (point * scale / scale == point).all():
        measure_faces(triangles[faces] * scale, point * scale, measured)
    for face, (distance, u, v, is_known) in zip(faces.tolist(), measured.tolist(), strict=True):
        if is_known:
            found.append((distance / scale, face, u, v))
        else:
            square, exact_u, exact_v = _nearest(*corners_from(point, triangles[face]))
            found.append((_root(square), face, float(exact_u), float(exact_v)))
    distance, face, u, v = min(found)
    return distance, u, v, face


def _candidates(point: NDArray[np.float64], triangles: NDArray[np.float64]) -> NDArray[np.int64]:
    """Faces that may be the nearest, by lower bounds from boxes and upper bounds from corners, without products."""
    away = triangles - point
    gap = np.maximum(away.min(axis=1), -away.max(axis=1)).max(axis=1)
    corner = np.abs(away).sum(axis=2).min()
    return np.flatnonzero(gap <= corner * _MORE)


def _nearest(a: Vector, b: Vector, c: Vector) -> tuple[Fraction, Fraction, Fraction]:
    """The squared distance of the origin from a face, and u and v of the face's nearest point."""
    ab, ac = less(b, a), less(c, a)
    bb, bc, cc, x, y = dot(ab, ab), dot(ab, ac), dot(ac, ac), -dot(a, ab), -dot(a, ac)
    area = bb * cc - bc * bc
    if area > 0:
        u, v = (cc * x - bc * y) / area, (bb * y - bc * x) / area
        if u >= 0 and v >= 0 and u + v <= 1:
            return _square(a, ab, ac, u, v), u, v
    none, one = Fraction(0), Fraction(1)
    s, t = _share(x, bb), _share(y, cc)
    r = _share(-dot(b, less(c, b)), bb - 2 * bc + cc)
    places = ((s, none), (none, t), (one - r, r))
    return min((_square(a, ab, ac, u, v), u, v) for u, v in places)


def _square(a: Vector, ab: Vector, ac: Vector, u: Fraction, v: Fraction) -> Fraction:
    """The square of a + u ab + v ac."""
    return sum(((x + u * y + v * z) ** 2 for x, y, z in zip(a, ab, ac, strict=True)), Fraction(0))


def _share(part: Fraction, whole: Fraction) -> Fraction:
    """part / whole from 0 to 1; 0 for a side of length 0."""
    return min(max(part / whole, Fraction(0)), Fraction(1)) if whole else Fraction(0)


def _root(square: Fraction) -> float:
    """The root of a rational number, rounded once."""
    n, d = square.numerator, square.denominator
    shift = max(0, _BITS - (n.bit_length() - d.bit_length()) // 2)
    whole, rest = divmod(n << 2 * shift, d)
    root = math.isqrt(whole)
    cut = rest != 0 or root * root != whole
    return (2 * root + cut) / (1 << (shift + 1))

"""Faces seen edge-on, whose plane holds the eye; decided exactly."""

import numpy as np
from numpy.typing import NDArray

from renderer.jit.decorators import kernel
from renderer.numerics.predicates import UNDECIDED, volume_sign
from renderer.numerics.rational import corners_from, volume
from renderer.numerics.simd import local_doubles, offset, pointer
from renderer.numerics.vec3 import row3

Floats = NDArray[np.float64]

# A volume of float64 errs by less than this share of its terms, 7 units of 2^-53 (Shewchuk, 1997), where these are
# within the range in which what vanishes is far less.
_SHARE, _LEAST, _FARTHEST = 2.0**-50, 2.0**-600, 2.0**200


def are_edge_on(corners: Floats, eye: Floats) -> NDArray[np.bool_]:
    """Whether the planes of faces with corners (n, 3, 3) hold an eye (3,), exactly: (n,) bool.

    The volume of face and eye is then 0. For almost all other faces float64 rules that out.
    """
    sides = np.ones(len(corners), np.int64)
    rows = np.flatnonzero(~_are_apart(corners, eye))
    if len(rows):
        some, signs = np.ascontiguousarray(corners[rows]), np.empty(len(rows), np.int64)
        _write_signs(some, eye, signs)
        for row in np.flatnonzero(signs == UNDECIDED):
            signs[row] = volume(*corners_from(eye, some[row])) != 0
        sides[rows] = signs
    return sides == 0


def _are_apart(corners: Floats, eye: Floats) -> NDArray[np.bool_]:
    """Whether float64 proves that the eye is off a face's plane."""
    with np.errstate(all="ignore"):  # what overflows or vanishes is not decided
        a, b, c = np.moveaxis(corners - eye, 1, 0)
        x, y = b[:, [1, 2, 0]] * c[:, [2, 0, 1]], b[:, [2, 0, 1]] * c[:, [1, 2, 0]]
        rounded, terms = (a * (x - y)).sum(axis=1), (np.abs(a) * (np.abs(x) + np.abs(y))).sum(axis=1)
    near = np.abs(corners - eye).max(axis=(1, 2), initial=0.0) <= _FARTHEST
    return near & (terms >= _LEAST) & (np.abs(rounded) > _SHARE * terms)


@kernel
def _write_signs(corners, eye, signs):
    """Write ``volume_sign`` of faces and an eye to ``signs``."""
    parts, p = local_doubles(), row3(pointer(eye), 0)
    for i in range(len(corners)):
        face = offset(pointer(corners), 9 * i)
        signs[i] = volume_sign(row3(face, 0), row3(face, 1), row3(face, 2), p, parts)

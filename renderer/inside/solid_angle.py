"""Solid angles of faces, four at a time, summed as the angle of a product.

Half the solid angle of a face is the angle of one complex number (van Oosterom and Strackee, The Solid Angle of a Plane
Triangle, IEEE Transactions on Biomedical Engineering 30, 1983). So the angle of their product is the sum of the angles,
up to whole turns, which are counted when a product passes the negative axis. One arctangent a lane is enough for all
faces.
"""

import math
from typing import Any, NamedTuple

from renderer.inside.careful_angle import careful_angle
from renderer.jit.decorators import inlined, kernel
from renderer.numerics.simd import (
    extract,
    fabs,
    lowest_bit,
    movemask,
    select,
    splat4,
    square_root,
)
from renderer.trace.edge_signs import corner
from renderer.trace.intersect import face_in, load_corners
from renderer.trace.layout import BLOCK_FACES, BLOCK_WORDS

# Both parts of a face's number, at most 4 in size, err by 2^-47: corners, lengths and directions by 2^-53 of themselves
# each, then six products of three. Its angle errs by the share of that in its size: by 2^-44 of a turn at most where
# the square of its size is at least LEAST_SQUARE. Nearer than 2^-5 of its length to an edge it may be less.
_LEAST_SQUARE = 2.0**-10
# A volume above it has its true sign, which says on which side of the face the point is.
_LEAST_VOLUME = 2.0**-46
# The sum of three inverse distances, of corners from the point, below which no square has lost digits to underflow.
_NEAREST = 2.0**450
_TURN = 2.0 * math.pi


class Turned(NamedTuple):
    """A sum of half solid angles: the product of numbers in four lanes, its whole turns, and separate angles."""

    real: Any
    imaginary: Any
    turns: Any
    apart: float


@inlined
def no_turn():
    """The empty sum."""
    return Turned(splat4(1.0), splat4(0.0), splat4(0.0), 0.0)


@kernel
def add_blocks(tree, first, count, point, total, parts):
    """``total`` plus the angles of the faces of some blocks, seen from ``point``; ``parts`` is memory for an expansion.

    A face that contains the point counts 0, the mean of its two sides. The sum is NaN if products leave float64's
    range, which takes coordinates as unlike as 1 and 2^-300.
    """
    apart = total.apart
    for block in range(first, first + count):
        base = block * BLOCK_WORDS
        rest, volume, sure = _see_block(tree, base, point)
        bits = 15 & ~movemask(sure)
        while bits != 0:
            i = lowest_bit(bits)
            bits &= bits - 1
            if face_in(tree, block * BLOCK_FACES + i) >= 0:
                apart += _careful_angle(tree, base + i, point, parts)
        total = _times(total, select(sure, rest, splat4(1.0)), select(sure, volume, splat4(0.0)))
    return Turned(total.real, total.imaginary, total.turns, apart)


@kernel
def turns_of(total):
    """A sum of half solid angles in whole turns: the winding number of its faces."""
    angle, turns = total.apart, 0.0
    for i in range(4):
        # + 0.0 turns -0.0, whose angle would be the other half turn, into 0.0.
        angle += math.atan2(extract(total.imaginary, i) + 0.0, extract(total.real, i))
        turns += extract(total.turns, i)
    return angle / _TURN + turns


@inlined
def _see_block(tree, base, point):
    """The real and imaginary parts of four faces' numbers, and the mask of the certain ones."""
    x0, x1, x2, y0, y1, y2, z0, z1, z2 = load_corners(tree, base, point)
    px, py, pz = splat4(point.x), splat4(point.y), splat4(point.z)
    x0, y0, z0, share0 = _direction(x0 - px, y0 - py, z0 - pz)
    x1, y1, z1, share1 = _direction(x1 - px, y1 - py, z1 - pz)
    x2, y2, z2, share2 = _direction(x2 - px, y2 - py, z2 - pz)
    volume = x0 * (y1 * z2 - z1 * y2) + y0 * (z1 * x2 - x1 * z2) + z0 * (x1 * y2 - y1 * x2)
    rest = (splat4(1.0) + (x0 * x1 + y0 * y1 + z0 * z1)) + (
        (x1 * x2 + y1 * y2 + z1 * z2) + (x2 * x0 + y2 * y0 + z2 * z0)
    )
    # Of an unused place all is NaN, and of a corner at the point, so neither is sure.
    away = volume * volume + rest * rest >= splat4(_LEAST_SQUARE)
    away = away & ((share0 + share1) + share2 <= splat4(_NEAREST))
    return rest, volume, away & ((rest > splat4(0.0)) | (fabs(volume) > splat4(_LEAST_VOLUME)))


@inlined
def _direction(x, y, z):
    share = splat4(1.0) / square_root(x * x + y * y + z * z)
    return x * share, y * share, z * share, share


@inlined
def _times(total, a, b):
    """``total`` times a + b i, scaled to size one; no a + b i lies on the negative axis."""
    zero, one = splat4(0.0), splat4(1.0)
    x, y = total.real * a - total.imaginary * b, total.real * b + total.imaginary * a
    # Angles go from -pi, without it, to pi. Two of one sign pass pi where the sign of their sum is the other.
    over = (total.imaginary >= zero) & (b >= zero) & (y < zero)
    under = (total.imaginary < zero) & (b < zero) & (y >= zero)
    turns = total.turns + select(over, one, zero) - select(under, one, zero)
    share = one / (fabs(x) + fabs(y))
    return Turned(x * share, y * share, turns, total.apart)


@kernel
def _careful_angle(tree, place, point, parts):
    """Half the solid angle of one face to float64 precision, however near its edges are."""
    p = point.x, point.y, point.z
    return careful_angle(corner(tree, place), corner(tree, place + 12), corner(tree, place + 24), p, parts)

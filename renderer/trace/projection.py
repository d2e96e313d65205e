"""Parallel rays: rays, boxes and faces projected along the rays onto a plane across their dominant axis w.

    y1  +--------.  h1        A point (u, v, w) is seen at x = u - a w and y = v - b w, where (a, b, 1) is along the
        |         '.          direction. A box is seen as a hexagon: the ranges of x, of y, and of h = b u - a v, which
        |           |         is the same for all w. A ray is a point. It may enter a box that is seen there and does
    h0   '.         |         not end before the ray starts.
           '--------+  y0
        x0         x1

Coordinates count from a center near the rays. All bounds are wider by what rounding may do, so no test finds a hit of
what is rejected here.
"""

from typing import Any, NamedTuple

import numpy as np

from renderer.jit.decorators import inlined
from renderer.numerics.simd import (
    fabs,
    gather8,
    load,
    load8,
    maximum,
    minimum,
    movemask,
    narrow,
    offset,
    select,
    splat4,
    splat8,
    store,
    widen,
)
from renderer.trace.intersect import load_corners

# Let n be 2^-24, the error of a float32 operation. A box's planes err by n once they count from the centre. Middles,
# halves, shears, products and sums follow: 13 n of all coordinates at most, and 2 n more where rays are compared.
_BOX_ERROR = np.float32(2.0**-20)
# A ray's x, y, h and place along are computed in float64 from u, v and w, which are at most twice as large, and rounded
# once. The middle and the half of a range err by n each, and so does what is compared.
_RAY_ERROR = np.float32(2.0**-21)
# The errors of the edge functions of ``intersect``, 9 * 2^-53 A D, and of those here. No coordinate of rays and faces
# exceeds the ``size`` of ``see_faces``, so A is at most 6 sizes and D at most 9: 2^-44 of its square, and room.
_EDGE_ERROR = 2.0**-42
# A face is hit from behind its plane where ``intersect.BESIDE`` allows it, by 2^-44 D^3.
_BESIDE = 2.0**-34
# A start that is off by its slack is off by twice as much in x, y or h; and slack is rounded to float32.
_MORE = np.float32(2.0 + 2.0**-8)
_TINY = np.float32(2.0**-126)


class Projection(NamedTuple):
    """The axes u, v and w, the center in these axes, a and b, and the sign of the direction along w."""

    u: int
    v: int
    w: int
    center_u: float
    center_v: float
    center_w: float
    a: float
    b: float
    sign: float


class Extent(NamedTuple):
    """The middles of ranges of x, y and h, half their lengths, and how far along the rays: for boxes the end, for rays
    the start. float32, one or eight.
    """

    x: Any
    y: Any
    h: Any
    half_x: Any
    half_y: Any
    half_h: Any
    along: Any


# Memory for the ``Extent`` of eight boxes.
EXTENT_WORDS = 7 * 8


class Faces(NamedTuple):
    """A block's four faces.

    a, b, c      of each edge; its edge function at (x, y) is ``c + x a + y b``, which errs by ``error``
    z            of each corner along the rays; the edge functions times z sum to the plane's distance along the rays
                 times ``determinant``, which is not negative; the sum errs by ``behind``
    """

    a0: Any
    a1: Any
    a2: Any
    b0: Any
    b1: Any
    b2: Any
    c0: Any
    c1: Any
    c2: Any
    error: Any
    z0: Any
    z1: Any
    z2: Any
    determinant: Any
    behind: Any


@inlined
def make_projection(rays, i, shear):
    """The projection along parallel rays with a ``Shear``, centered at the origin of ray ``i``."""
    u, v, w, o = shear.row_x >> 2, shear.row_y >> 2, shear.row_z >> 2, offset(rays.origins, i * rays.origin_step)
    sign = 1.0 if shear.direction_z > 0.0 else -1.0
    return Projection(
        u, v, w, _center(o, u, rays.scale), _center(o, v, rays.scale), _center(o, w, rays.scale),
        shear.shear_x, shear.shear_y, sign,
    )  # fmt: skip


@inlined
def _center(o, axis, scale):
    """A float32, so that float32 planes count from it with one rounding."""
    return widen(narrow(load(o, axis) * scale))


@inlined
def place_eight(projection, rays, numbers):
    """x, y and h, float32, of the origins of the eight rays numbered at ``numbers``, and how far along they start."""
    p, scale = projection, rays.scale
    u = gather8(rays.origins, numbers, rays.origin_step, p.u) * scale - p.center_u
    v = gather8(rays.origins, numbers, rays.origin_step, p.v) * scale - p.center_v
    w = gather8(rays.origins, numbers, rays.origin_step, p.w) * scale - p.center_w
    return narrow(u - w * p.a), narrow(v - w * p.b), narrow(u * p.b - v * p.a), narrow(w * p.sign)


@inlined
def error_of(reach, slack):
    """The error of the coordinates of rays: ``reach`` is the largest of these, ``slack`` of their slacks."""
    return reach * _RAY_ERROR + slack * _MORE + _TINY


@inlined
def see_boxes(projection, nodes, base, error):
    """The ``Extent`` of the octants of the node at word ``base``, wider by the ``error`` of rays. NaN if empty."""
    p = projection
    u, half_u = _middle(nodes, base + 16 * p.u, p.center_u)
    v, half_v = _middle(nodes, base + 16 * p.v, p.center_v)
    w, half_w = _middle(nodes, base + 16 * p.w, p.center_w)
    e = (fabs(u) + half_u + fabs(v) + half_v + fabs(w) + half_w) * _BOX_ERROR + error
    a, b, sign = narrow(p.a), narrow(p.b), narrow(p.sign)
    x, y, h = u - w * a, v - w * b, u * b - v * a
    a, b = abs(a), abs(b)
    # rule: projected-box
    half_x = half_u + half_w * a
    half_y, half_h = half_v + half_w * b, half_u * b + half_v * a
    return Extent(x, y, h, half_x + e, half_y + e, half_h + e, w * sign + half_w + e)


@inlined
def _middle(nodes, row, center):
    return middle_of(load8(nodes, row) - narrow(center), load8(nodes, row + 8) - narrow(center))


@inlined
def middle_of(low, high):
    """The middle of a range, and half its length."""
    return (low + high) * np.float32(0.5), (high - low) * np.float32(0.5)


@inlined
def put_boxes(floats, boxes):
    """Write the ``Extent`` of eight boxes to EXTENT_WORDS float32."""
    store(floats, 0, boxes.x)
    store(floats, 8, boxes.y)
    store(floats, 16, boxes.h)
    store(floats, 24, boxes.half_x)
    store(floats, 32, boxes.half_y)
    store(floats, 40, boxes.half_h)
    store(floats, 48, boxes.along)


@inlined
def box_at(floats, octant):
    """One of the boxes that ``put_boxes`` wrote."""
    at = offset(floats, octant)
    return Extent(load(at, 0), load(at, 8), load(at, 16), load(at, 24), load(at, 32), load(at, 40), load(at, 48))


@inlined
def overlap(boxes, rays):
    """The mask of the boxes that rays may enter; ``rays`` is the ``Extent`` of all."""
    inside = fabs(boxes.x - rays.x) <= boxes.half_x + rays.half_x
    inside = inside & (fabs(boxes.y - rays.y) <= boxes.half_y + rays.half_y)
    inside = inside & (fabs(boxes.h - rays.h) <= boxes.half_h + rays.half_h)
    return inside & (boxes.along >= rays.along)


@inlined
def enter(box, x, y, h, along):
    """The mask of the rays at (x, y, h), starting at ``along``, that may enter a box."""
    inside = (fabs(x - box.x) <= splat8(box.half_x)) & (fabs(y - box.y) <= splat8(box.half_y))
    return inside & (fabs(h - box.h) <= splat8(box.half_h)) & (along <= splat8(box.along))


@inlined
def see_faces(tree, base, shear, projection, reach, error):
    """The ``Faces`` of the block at ``base``, for rays within ``reach`` that err by ``error``."""
    p = projection
    x0, x1, x2, y0, y1, y2, z0, z1, z2 = load_corners(tree, base, shear)
    z0, z1, z2 = z0 - p.center_w, z1 - p.center_w, z2 - p.center_w
    x0, x1, x2 = x0 - p.center_u - z0 * p.a, x1 - p.center_u - z1 * p.a, x2 - p.center_u - z2 * p.a
    y0, y1, y2 = y0 - p.center_v - z0 * p.b, y1 - p.center_v - z1 * p.b, y2 - p.center_v - z2 * p.b
    across, along = _most(x0, x1, x2) + _most(y0, y1, y2), _most(z0, z1, z2)
    size = across + along + reach
    limit = across * (2.0 * error) + size * size * _EDGE_ERROR
    c0, c1, c2 = x2 * y1 - y2 * x1, x0 * y2 - y0 * x2, x1 * y0 - y1 * x0
    determinant = c0 + c1 + c2
    sign = select(determinant < splat4(0.0), splat4(-p.sign), splat4(p.sign))
    # Three edge functions times z, the determinant times what is wrong along the ray, and room.
    behind = limit * (along + reach) * 4.0 + fabs(determinant) * error + size * size * size * _BESIDE
    return Faces(
        y2 - y1, y0 - y2, y1 - y0, x1 - x2, x2 - x0, x0 - x1, c0, c1, c2, limit,
        z0 * sign, z1 * sign, z2 * sign, fabs(determinant), behind,
    )  # fmt: skip


@inlined
def _most(a, b, c):
    return maximum(fabs(a), maximum(fabs(b), fabs(c)))


@inlined
def may_hit(faces, x, y, along):
    """The bits of the faces that a ray from (x, y), ``along`` the rays, may hit; those of unused slots are set."""
    x, y, zero = splat4(widen(x)), splat4(widen(y)), splat4(0.0)
    e0 = faces.c0 + x * faces.a0 + y * faces.b0
    e1 = faces.c1 + x * faces.a1 + y * faces.b1
    e2 = faces.c2 + x * faces.a2 + y * faces.b2
    least, most = minimum(e0, minimum(e1, e2)), maximum(e0, maximum(e1, e2))
    ahead = e0 * faces.z0 + e1 * faces.z1 + e2 * faces.z2 - faces.determinant * widen(along)
    passes = (least < zero - faces.error) & (most > faces.error)
    return ~movemask(passes | (ahead < zero - faces.behind)) & 15

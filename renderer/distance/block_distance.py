"""Bounds of the distances of a point from the four faces of a block, in float64, four at a time.

Any point of a face bounds its distance from above. Projecting the corners on any direction bounds it from below. With
the nearest point and its direction both bounds equal the distance up to rounding. If rounding misses that point, they
are wider and still valid.
"""

import numpy as np

from renderer.jit.decorators import inlined
from renderer.numerics.simd import fabs, minimum, movemask, reduce_min, select, splat4, square_root
from renderer.trace.intersect import load_corners

# Corners less the point, u, v and the nearest point err by 2^-53 each, of a corner's reach; together by 20 such errors
# at most. The same holds for the products along the direction, as shares of the direction's length.
_ERROR = 2.0**-48
# What squares lose besides, where they vanish: 2^-1073, whose root is 2^-536.5, and quotients by such a root as much.
_VANISHED = 2.0**-530
_MORE = 1.0 + 2.0**-48


@inlined
def bound_distances(tree, base, point, limit):
    """The bits of a block's faces that may be within ``limit``, lower bounds of their distances, and the limit, lowered
    to the least upper bound.
    """
    x0, x1, x2, y0, y1, y2, z0, z1, z2 = load_corners(tree, base, point)
    px, py, pz = splat4(point.x), splat4(point.y), splat4(point.z)
    x0, x1, x2, y0, y1, y2, z0, z1, z2 = x0 - px, x1 - px, x2 - px, y0 - py, y1 - py, y2 - py, z0 - pz, z1 - pz, z2 - pz
    bx, by, bz, cx, cy, cz = x1 - x0, y1 - y0, z1 - z0, x2 - x0, y2 - y0, z2 - z0
    u, v = _nearest(
        _dot(bx, by, bz, bx, by, bz), _dot(bx, by, bz, cx, cy, cz), _dot(cx, cy, cz, cx, cy, cz),
        splat4(0.0) - _dot(x0, y0, z0, bx, by, bz), splat4(0.0) - _dot(x0, y0, z0, cx, cy, cz),
    )  # fmt: skip
    x, y, z = x0 + u * bx + v * cx, y0 + u * by + v * cy, z0 + u * bz + v * cz
    square = _dot(x, y, z, x, y, z)
    along = _smaller(
        _dot(x0, y0, z0, x, y, z), _smaller(_dot(x1, y1, z1, x, y, z), _dot(x2, y2, z2, x, y, z))
    )  # fmt: skip
    reach = _larger(_size(x0, y0, z0), _larger(_size(x1, y1, z1), _size(x2, y2, z2)))
    error = splat4(_ERROR) * reach + splat4(_VANISHED)
    distance, zero = square_root(square), splat4(0.0)
    low, high = select(distance <= zero, zero, along / distance - error), distance * splat4(_MORE) + error
    # Of an unused place all is NaN, which is not within any limit.
    within = low <= splat4(limit)
    # rule: bound-of-block
    limit = minimum(limit, reduce_min(select(within, high, splat4(np.inf))))
    return movemask(within & (low <= splat4(limit))), low, limit


@inlined
def _dot(ax, ay, az, bx, by, bz):
    return ax * bx + ay * by + az * bz


@inlined
def _size(x, y, z):
    return fabs(x) + fabs(y) + fabs(z)


@inlined
def _larger(a, b):
    return select(a > b, a, b)


@inlined
def _smaller(a, b):
    return select(a < b, a, b)


@inlined
def _share(part, whole):
    """part / whole, from 0 to 1; 0 for 0 / 0."""
    zero, one = splat4(0.0), splat4(1.0)
    share = select(part > zero, part / whole, zero)
    return select(share < one, share, one)


@inlined
def _nearest(bb, bc, cc, b, c):
    """u and v of the nearest points, from products of the sides with each other and with the vector to the point."""
    zero, one, two = splat4(0.0), splat4(1.0), splat4(2.0)
    # On the three edges, and how their squared distances differ from that of the first corner.
    sides, along = bb + cc - two * bc, c - b + bb - bc
    s, t, r = _share(b, bb), _share(c, cc), _share(along, sides)
    on_b, on_c = s * (s * bb - two * b), t * (t * cc - two * c)
    on_a = bb - two * b + r * (r * sides - two * along)
    first = on_b <= on_c
    u, v, square = select(first, s, zero), select(first, zero, t), select(first, on_b, on_c)
    second = on_a < square
    u, v = select(second, one - r, u), select(second, r, v)
    # In the plane, where that lies within the face.
    area, u_area, v_area = bb * cc - bc * bc, cc * b - bc * c, bb * c - bc * b
    inside = (u_area >= zero) & (v_area >= zero) & (u_area + v_area <= area) & (area > zero)
    return select(inside, u_area / area, u), select(inside, v_area / area, v)

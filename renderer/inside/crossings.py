"""Exact crossings of a half-line from a point along an axis: they decide whether the point is inside.

Each crossing counts 1 or -1. The sum is the winding number; it is odd if the number of crossings is odd.

Seen along the axis, the projected faces are a planar map. A point on an edge or corner of the map is moved by (e, e^2),
e infinitely small, across the axis, so that it lies in exactly one face of each sheet. All signs are exact, by a bound
of their rounding errors or by expansions, so the counts are those of real arithmetic along any axis.
"""

from typing import Any, NamedTuple

import numpy as np

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.expansions import PARTS
from renderer.numerics.predicates import UNDECIDED, area_sign, differ, lies_within, volume_sign
from renderer.numerics.simd import (
    count_bits,
    fabs,
    load,
    load8,
    local_doubles,
    lowest_bit,
    movemask,
    offset,
    pointer,
    splat4,
    splat8,
    store,
)
from renderer.trace.edge_signs import coordinate
from renderer.trace.intersect import face_in, load_corners, round_down, round_up
from renderer.trace.layout import BLOCK_FACES, BLOCK_WORDS
from renderer.trace.trees import tree_pointers
from renderer.trace.walk import boxes_of, walk

# In place of a winding number, which counts less than 2^31 faces: the point lies on a face, or float64 cannot decide.
ON_FACE, UNDECIDED_COUNT = -(2**31), -(2**31) + 1
_ROUNDOFF = 2.0**-53
# The blocks that a call tests, some milliseconds, and how many of them one exact test costs.
WORK, _EXACTLY = 1 << 16, 16.0
# Shewchuk's bounds of the rounding errors of both determinants, as shares of the sums of their terms without signs.
_AREA_ERROR = (3.0 + 16.0 * _ROUNDOFF) * _ROUNDOFF
_VOLUME_ERROR = (7.0 + 56.0 * _ROUNDOFF) * _ROUNDOFF
# What both lose besides where products vanish: an area four times 2^-1075; a volume that times a coordinate, which is
# 2^130 at most where the other terms are finite.
_AREA_LOSS, _VOLUME_LOSS = 2.0**-1070, 2.0**-930


class AxisRay(NamedTuple):
    """A point and the half-line from it along an axis; axes are turned so that it is z.

    row_x, row_y, row_z  where a block has the coordinates of each axis
    x, y, z              the point
    up                   whether the half-line leads to larger z
    """

    row_x: Any
    row_y: Any
    row_z: Any
    x: float
    y: float
    z: float
    up: bool


class _Query(NamedTuple):
    """A ray, and memory for an expansion; behind it the blocks tested are counted."""

    ray: AxisRay
    parts: Any


class _Crossings(NamedTuple):
    """The crossings so far: the winding number, and 1 if the point lies on a face, UNDECIDED or more if float64 cannot
    decide.
    """

    winding: int
    on: int


@kernel
def count_crossings(descriptor, points, axis, middle, rows, out, stack, begin):
    """Winding numbers (or ON_FACE, or UNDECIDED_COUNT) for ``points`` (n, 3), from row ``begin`` on, to
    ``out[rows[i]]``, int32.

    The half-lines follow ``axis``, upwards above ``middle`` (in the tree's units) and downwards below: the shorter way.
    ``stack`` is memory for ``walk.stack_size`` int64. Returns the row before which it ended, early after WORK, so that
    Ctrl-C need not wait.
    """
    tree, parts = tree_pointers(descriptor), local_doubles()
    scale, axis_x, axis_y = tree.scale, (axis + 1) % 3, (axis + 2) % 3
    # Behind the expansion's parts.
    work = offset(parts, PARTS)
    store(work, 0, 0.0)
    for i in range(begin, len(points)):
        row = offset(pointer(points), 3 * i)
        x, y, z = scale * load(row, axis_x), scale * load(row, axis_y), scale * load(row, axis)
        ray = AxisRay(4 * axis_x, 4 * axis_y, 4 * axis, x, y, z, z >= middle)
        if x / scale != load(row, axis_x) or y / scale != load(row, axis_y) or z / scale != load(row, axis):
            # The tree's units cannot hold it exactly.
            winding, on = np.int64(0), np.int64(UNDECIDED)
        else:
            winding, on = _search(tree, _Query(ray, parts), pointer(stack))
        out[rows[i]] = UNDECIDED_COUNT if on >= UNDECIDED else (ON_FACE if on else winding)
        if load(work, 0) > WORK:
            return i + 1
    return len(points)


@kernel
def _search(tree, query, stack):
    """The ``_Crossings`` of a ray with all faces."""
    return walk(tree, stack, query, _Crossings(np.int64(0), np.int64(0)), _enter, _visit)


@inlined
def _enter(tree, query, node, found):
    nodes, base = boxes_of(tree, node)
    return found, _meet_boxes(nodes, base, query.ray)


@inlined
def _visit(tree, query, first, count, found):
    return _cross_blocks(tree, query, first, count, found), False


@inlined
def _meet_boxes(nodes, base, ray):
    """The bits of the octants that a ray enters; boxes are only ever too large."""
    # A node's rows, lower and upper, are four times as long as a block's.
    x, y, z = base + 4 * ray.row_x, base + 4 * ray.row_y, base + 4 * ray.row_z
    meets = (load8(nodes, x) <= splat8(round_up(ray.x))) & (load8(nodes, x + 8) >= splat8(round_down(ray.x)))
    meets = meets & (load8(nodes, y) <= splat8(round_up(ray.y)))
    meets = meets & (load8(nodes, y + 8) >= splat8(round_down(ray.y)))
    if ray.up:
        return movemask(meets & (load8(nodes, z + 8) >= splat8(round_down(ray.z))))
    return movemask(meets & (load8(nodes, z) <= splat8(round_up(ray.z))))


@inlined
def _cross_blocks(tree, query, first, count, found):
    """``found`` plus the crossings with the faces of some blocks."""
    ray, parts, winding, on = query.ray, query.parts, found.winding, found.on
    store(parts, PARTS, load(parts, PARTS) + count)
    for block in range(first, first + count):
        base = block * BLOCK_WORDS
        sure, unsure, turns = _cross_block(tree, base, ray)
        winding += 2 * count_bits(sure & turns) - count_bits(sure)
        while unsure != 0:
            i = lowest_bit(unsure)
            unsure &= unsure - 1
            if face_in(tree, block * BLOCK_FACES + i) >= 0:
                store(parts, PARTS, load(parts, PARTS) + _EXACTLY)
                step, touches = _cross_exactly(tree, base + i, ray, parts)
                winding, on = winding + step, on | touches
    return _Crossings(winding, on)


@inlined
def _cross_block(tree, base, ray):
    """Bits of four faces: those certainly crossed, those that float64 cannot decide, and those where the winding number
    rises by one.
    """
    x0, x1, x2, y0, y1, y2, z0, z1, z2 = load_corners(tree, base, ray)
    x, y, z = splat4(ray.x), splat4(ray.y), splat4(ray.z)
    x0, x1, x2, y0, y1, y2, z0, z1, z2 = x0 - x, x1 - x, x2 - x, y0 - y, y1 - y, y2 - y, z0 - z, z1 - z, z2 - z

    # On which side of each edge the ray passes, as far as rounding decides.
    a, b, c, d, e, f = x1 * y2, y1 * x2, x2 * y0, y2 * x0, x0 * y1, y0 * x1
    e0, e1, e2 = a - b, c - d, e - f
    m0, m1, m2 = fabs(a) + fabs(b), fabs(c) + fabs(d), fabs(e) + fabs(f)
    zero, share, loss = splat4(0.0), splat4(_AREA_ERROR), splat4(_AREA_LOSS)
    r0, r1, r2 = m0 * share + loss, m1 * share + loss, m2 * share + loss
    above = (e0 > r0) | (e1 > r1) | (e2 > r2)
    below = (zero - e0 > r0) | (zero - e1 > r1) | (zero - e2 > r2)
    possible = 15 & ~movemask(above & below)
    if possible == 0:
        return possible, possible, possible
    left = (e0 > r0) & (e1 > r1) & (e2 > r2)
    right = (zero - e0 > r0) & (zero - e1 > r1) & (zero - e2 > r2)

    # Whether the plane there lies above or below the point.
    volume = e0 * z0 + e1 * z1 + e2 * z2
    terms = m0 * fabs(z0) + m1 * fabs(z1) + m2 * fabs(z2)
    error = terms * splat4(_VOLUME_ERROR) + splat4(_VOLUME_LOSS)
    over = movemask((left & (volume > error)) | (right & (zero - volume > error)))
    under = movemask((left & (zero - volume > error)) | (right & (volume > error)))
    sure, rising = (over, movemask(left)) if ray.up else (under, movemask(right))
    return possible & sure, possible & ~(over | under), rising


@inlined
def _corner(tree, place, ray):
    """A corner (x, y, z) of a face, exactly."""
    return (
        coordinate(tree, place + ray.row_x),
        coordinate(tree, place + ray.row_y),
        coordinate(tree, place + ray.row_z),
    )


@kernel
def _cross_exactly(tree, place, ray, parts):
    """The change of the winding number at one face, 0 if it is not crossed, and whether the point lies on it."""
    a, b, c = _corner(tree, place, ray), _corner(tree, place + 12, ray), _corner(tree, place + 24, ray)
    p = ray.x, ray.y, ray.z
    s0, s1, s2 = area_sign(b, c, p, parts), area_sign(c, a, p, parts), area_sign(a, b, p, parts)
    if s0 == UNDECIDED or s1 == UNDECIDED or s2 == UNDECIDED:
        return 0, UNDECIDED
    if differ(s0, s1, s2):
        return 0, 0
    side = volume_sign(a, b, c, p, parts)
    if side == UNDECIDED:
        return 0, UNDECIDED
    if side == 0 and (s0 != 0 or s1 != 0 or s2 != 0):
        return 0, 1
    if side == 0:
        # rule: on-upright-face
        return 0, lies_within(a, b, c, p, parts)
    # The point moves by (e, e^2), so an edge that it lies on passes it on one side.
    # rule: move-off-edge
    s0 = s0 if s0 != 0 else _moved_sign(b, c)
    s1 = s1 if s1 != 0 else _moved_sign(c, a)
    s2 = s2 if s2 != 0 else _moved_sign(a, b)
    if s0 == 0 or s0 != s1 or s0 != s2:
        return 0, 0
    # Over the point where the volume has the sign of the area.
    if (side == s0) != ray.up:
        return 0, 0
    return (s0 if ray.up else -s0), 0


@inlined
def _moved_sign(a, b):
    """The sign of (a - p) x (b - p) if it is 0 and p moves by (e, e^2)."""
    if a[1] != b[1]:
        return 1 if a[1] > b[1] else -1
    if a[0] != b[0]:
        return 1 if b[0] > a[0] else -1
    return 0

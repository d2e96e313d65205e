"""Crossings of a ray from a point along an axis, counted exactly: the answer to what lies inside.

Seen along the axis, the projected faces are a planar map. A point on an edge or corner of the map is moved by (e, e^2),
e infinitely small, across the axis, so that it lies in exactly one face of each sheet. All signs are exact, by a bound
of their rounding errors or by expansions, so the counts are those of real arithmetic, along whichever axis.
"""

from typing import Any, NamedTuple

import numpy as np

from renderer.kernels.jit import inlined, kernel
from renderer.kernels.simd import (
    at,
    get,
    load4,
    load8,
    local_doubles,
    local_words,
    lowest_bit,
    magnitude,
    movemask,
    pointer,
    put,
    splat4,
    splat8,
)
from renderer.points.signs import UNDECIDED, area_sign, volume_sign
from renderer.trace.intersect import round_down, round_up
from renderer.trace.layout import BLOCK_FACES, BLOCK_WORDS, CHILDREN, LEAF_BITS, MAX_LEAF_BLOCKS, NODE_WORDS
from renderer.trace.leaf import tree_pointers

# Columns of the answer: winding number, crossings, and whether the point lies on a face (or is UNDECIDED).
WINDING, CROSSINGS, ON = range(3)
COLUMNS = 3
_ROUNDOFF = 2.0**-53
# Shewchuk's bounds of the rounding errors of both determinants, as shares of the sums of their terms without signs.
_AREA_ERROR = (3.0 + 16.0 * _ROUNDOFF) * _ROUNDOFF
_VOLUME_ERROR = (7.0 + 56.0 * _ROUNDOFF) * _ROUNDOFF


class Column(NamedTuple):
    """A point and the half-line from it along an axis: its axes turned so that w is that axis.

    axis_u, axis_v, axis_w  0, 1, 2 for x, y, z
    u, v, w                 the point
    up                      whether the half-line goes to larger w
    """

    axis_u: Any
    axis_v: Any
    axis_w: Any
    u: float
    v: float
    w: float
    up: bool


@kernel
def count_crossings(words, points, scale, axis, middle, out, begin, end):
    """Fill rows begin:end of ``out`` (n, COLUMNS) int64 for ``points`` (n, 3) float64.

    The half-lines go along ``axis``, up from ``middle`` (in the tree's units) on and else down, which is the shorter
    way.
    """
    tree, stack, parts = tree_pointers(words), local_words(), local_doubles()
    axis_u, axis_v = (axis + 1) % 3, (axis + 2) % 3
    for i in range(begin, end):
        row = at(pointer(points), 3 * i)
        u, v, w = scale * get(row, axis_u), scale * get(row, axis_v), scale * get(row, axis)
        column = Column(axis_u, axis_v, axis, u, v, w, w >= middle)
        if u / scale != get(row, axis_u) or v / scale != get(row, axis_v) or w / scale != get(row, axis):
            # The tree's units cannot hold it exactly.
            winding, crossings, on = 0, 0, UNDECIDED
        elif tree.has_nodes:
            winding, crossings, on = _search_nodes(tree, column, stack, parts)
        else:
            winding, crossings, on = _cross_blocks(tree, 0, tree.count, column, parts, (0, 0, 0))
        result = at(pointer(out), COLUMNS * i)
        put(result, WINDING, winding)
        put(result, CROSSINGS, crossings)
        put(result, ON, on)


@kernel
def _search_nodes(tree, column, stack, parts):
    """Winding number, crossings and ``on`` of a column, through the nodes whose boxes it meets."""
    found, top = (0, 0, 0), 1
    put(stack, 0, 0)
    while top > 0:
        top -= 1
        child = get(stack, top)
        if child < 0:
            code = ~child
            found = _cross_blocks(tree, code >> LEAF_BITS, (code & (MAX_LEAF_BLOCKS - 1)) + 1, column, parts, found)
            continue
        bits = _meet_boxes(tree.nodes, child * NODE_WORDS, column)
        while bits != 0:
            put(stack, top, np.int64(get(tree.links, child * NODE_WORDS + CHILDREN + lowest_bit(bits))))
            bits &= bits - 1
            top += 1
    return found


@inlined
def _meet_boxes(nodes, base, column):
    """The bits of the octants that a column meets; boxes are only ever too large."""
    u, v, w = base + 16 * column.axis_u, base + 16 * column.axis_v, base + 16 * column.axis_w
    meets = (load8(nodes, u) <= splat8(round_up(column.u))) & (load8(nodes, u + 8) >= splat8(round_down(column.u)))
    meets = meets & (load8(nodes, v) <= splat8(round_up(column.v)))
    meets = meets & (load8(nodes, v + 8) >= splat8(round_down(column.v)))
    if column.up:
        return movemask(meets & (load8(nodes, w + 8) >= splat8(round_down(column.w))))
    return movemask(meets & (load8(nodes, w) <= splat8(round_up(column.w))))


@kernel
def _cross_blocks(tree, first, count, column, parts, found):
    """Add the crossings with the faces of some blocks to ``found``."""
    winding, crossings, on = found
    for block in range(first, first + count):
        base = block * BLOCK_WORDS
        sure, unsure, turns = _cross_block(tree, base, column)
        crossings += _count(sure)
        winding += 2 * _count(sure & turns) - _count(sure)
        while unsure != 0:
            i = lowest_bit(unsure)
            unsure &= unsure - 1
            if get(tree.faces, block * BLOCK_FACES + i) >= 0:
                step, touches = _cross_exactly(tree, base + i, column, parts)
                winding, crossings, on = winding + step, crossings + abs(step), on | touches
    return winding, crossings, on


@inlined
def _count(bits):
    """The number of bits set in four."""
    return (bits & 1) + ((bits >> 1) & 1) + ((bits >> 2) & 1) + ((bits >> 3) & 1)


@inlined
def _cross_block(tree, base, column):
    """Bits of four faces: those surely crossed, those that float64 cannot tell, and where the winding rises by one."""
    ru, rv, rw = base + 4 * column.axis_u, base + 4 * column.axis_v, base + 4 * column.axis_w
    u, v, w = splat4(column.u), splat4(column.v), splat4(column.w)
    if tree.wide != 0:
        u0, u1, u2 = load4(tree.wide_blocks, ru), load4(tree.wide_blocks, ru + 12), load4(tree.wide_blocks, ru + 24)
        v0, v1, v2 = load4(tree.wide_blocks, rv), load4(tree.wide_blocks, rv + 12), load4(tree.wide_blocks, rv + 24)
        w0, w1, w2 = load4(tree.wide_blocks, rw), load4(tree.wide_blocks, rw + 12), load4(tree.wide_blocks, rw + 24)
    else:
        u0, u1, u2 = load4(tree.blocks, ru), load4(tree.blocks, ru + 12), load4(tree.blocks, ru + 24)
        v0, v1, v2 = load4(tree.blocks, rv), load4(tree.blocks, rv + 12), load4(tree.blocks, rv + 24)
        w0, w1, w2 = load4(tree.blocks, rw), load4(tree.blocks, rw + 12), load4(tree.blocks, rw + 24)
    u0, u1, u2, v0, v1, v2, w0, w1, w2 = u0 - u, u1 - u, u2 - u, v0 - v, v1 - v, v2 - v, w0 - w, w1 - w, w2 - w

    # On which side of each edge the column passes, as far as rounding tells.
    a, b, c, d, e, f = u1 * v2, v1 * u2, u2 * v0, v2 * u0, u0 * v1, v0 * u1
    e0, e1, e2 = a - b, c - d, e - f
    m0, m1, m2 = magnitude(a) + magnitude(b), magnitude(c) + magnitude(d), magnitude(e) + magnitude(f)
    zero, bound = splat4(0.0), splat4(_AREA_ERROR)
    above = (e0 > m0 * bound) | (e1 > m1 * bound) | (e2 > m2 * bound)
    below = (zero - e0 > m0 * bound) | (zero - e1 > m1 * bound) | (zero - e2 > m2 * bound)
    possible = 15 & ~movemask(above & below)
    if possible == 0:
        return possible, possible, possible
    left = (e0 > m0 * bound) & (e1 > m1 * bound) & (e2 > m2 * bound)
    right = (zero - e0 > m0 * bound) & (zero - e1 > m1 * bound) & (zero - e2 > m2 * bound)

    # Whether the plane there lies above or below the point.
    volume = e0 * w0 + e1 * w1 + e2 * w2
    error = (m0 * magnitude(w0) + m1 * magnitude(w1) + m2 * magnitude(w2)) * splat4(_VOLUME_ERROR)
    over = movemask((left & (volume > error)) | (right & (zero - volume > error)))
    under = movemask((left & (zero - volume > error)) | (right & (volume > error)))
    sure, rising = (over, movemask(left)) if column.up else (under, movemask(right))
    return possible & sure, possible & ~(over | under), rising


@inlined
def _corner(tree, at_, column):
    """A corner (u, v, w) of a face, exactly."""
    if tree.wide != 0:
        return (
            get(tree.wide_blocks, at_ + 4 * column.axis_u),
            get(tree.wide_blocks, at_ + 4 * column.axis_v),
            get(tree.wide_blocks, at_ + 4 * column.axis_w),
        )
    return (
        np.float64(get(tree.blocks, at_ + 4 * column.axis_u)),
        np.float64(get(tree.blocks, at_ + 4 * column.axis_v)),
        np.float64(get(tree.blocks, at_ + 4 * column.axis_w)),
    )


@kernel
def _cross_exactly(tree, at_, column, parts):
    """The change of the winding number at one face, 0 where it is not crossed, and whether the point lies on it."""
    a, b, c = _corner(tree, at_, column), _corner(tree, at_ + 12, column), _corner(tree, at_ + 24, column)
    p = column.u, column.v, column.w
    s0, s1, s2 = area_sign(b, c, p, parts), area_sign(c, a, p, parts), area_sign(a, b, p, parts)
    if s0 == UNDECIDED or s1 == UNDECIDED or s2 == UNDECIDED:
        return 0, UNDECIDED
    if _differ(s0, s1, s2):
        return 0, 0
    side = volume_sign(a, b, c, p, parts)
    if side == UNDECIDED:
        return 0, UNDECIDED
    if side == 0 and (s0 != 0 or s1 != 0 or s2 != 0):
        return 0, 1
    if side == 0:
        return 0, _on_upright(a, b, c, p, parts)
    # The point moves by (e, e^2), so an edge that it lies on passes it on one side.
    s0 = s0 if s0 != 0 else _moved_sign(b, c)
    s1 = s1 if s1 != 0 else _moved_sign(c, a)
    s2 = s2 if s2 != 0 else _moved_sign(a, b)
    if s0 == 0 or s0 != s1 or s0 != s2:
        return 0, 0
    # Over the point where the volume has the sign of the area.
    if (side == s0) != column.up:
        return 0, 0
    return (s0 if column.up else -s0), 0


@inlined
def _differ(s0, s1, s2):
    """Whether signs contradict each other, 0 none."""
    return (s0 > 0 or s1 > 0 or s2 > 0) and (s0 < 0 or s1 < 0 or s2 < 0)


@inlined
def _moved_sign(a, b):
    """The sign of (a - p) x (b - p) where it is 0 and p moves by (e, e^2)."""
    if a[1] != b[1]:
        return 1 if a[1] > b[1] else -1
    if a[0] != b[0]:
        return 1 if b[0] > a[0] else -1
    return 0


@kernel
def _on_upright(a, b, c, p, parts):
    """Whether a point on the plane of a face that is seen as a line, or of one without area, lies on the face.

    The other two views tell, of which one shows an area if there is one; on a line all coordinates tell.
    """
    informed = False
    for _ in range(2):
        a, b, c, p = (a[1], a[2], a[0]), (b[1], b[2], b[0]), (c[1], c[2], c[0]), (p[1], p[2], p[0])
        s0, s1, s2 = area_sign(b, c, p, parts), area_sign(c, a, p, parts), area_sign(a, b, p, parts)
        if s0 == UNDECIDED or s1 == UNDECIDED or s2 == UNDECIDED:
            return UNDECIDED
        if _differ(s0, s1, s2):
            return 0
        informed = informed or s0 != 0 or s1 != 0 or s2 != 0
    if informed:
        return 1
    for k in range(3):
        if p[k] < min(a[k], b[k], c[k]) or p[k] > max(a[k], b[k], c[k]):
            return 0
    return 1

"""Winding numbers by a search through the tree: series of octants that are far enough, and single faces near by."""

import numpy as np

from renderer.arguments.limits import FARTHEST
from renderer.inside.multipoles import MOMENT_WORDS, ROUNDING, see_octants, sum_lanes
from renderer.inside.solid_angle import add_blocks, no_turn, turns_of
from renderer.jit.decorators import inlined, kernel
from renderer.numerics.simd import at, get, larger, local_doubles, pointer, put, smaller, splat4
from renderer.trace.leaf import blocks_of, push_children, tree_pointers
from renderer.trace.point import Point

# The nodes and blocks that a call sums, beside those of one point: some milliseconds, so that Ctrl-C need not wait for
# long.
_WORK = 1 << 16
# The share with which a search for a tolerance begins: the bounds add up to about the tolerance around a closed mesh.
_FIRST = 2.0
# The next share aims at so much of the tolerance, and is at most half of the last.
_AIM, _LESS = 0.8, 0.5
# The share with which the question on which side of 1/2 begins, and what the next is of the last.
_FIRST_SIDE, _NEXT_SIDE = 1.0, 2.0**-4


@kernel
def sum_windings(words, rows, points, tolerance, out, stack, begin, end):
    """Write the winding numbers around the points begin:end of ``points`` (n, 3) to ``out`` (n,), within ``tolerance``.

    They are NaN where float64's range does not hold what tells them, see ``add_blocks``. ``rows`` is what
    ``moments_of`` has for the tree, ``stack`` memory for ``singly.stack_size`` int64. Returns the row before which it
    ended: early after _WORK.
    """
    tree, rows, stack, parts = tree_pointers(words), pointer(rows), pointer(stack), local_doubles()
    work = np.int64(0)
    for i in range(begin, end):
        row = at(pointer(points), 3 * i)
        point = _point_at(tree, row)
        number, bound, share = 0.0, np.inf, _FIRST * tolerance
        if not _is_held(tree, row, point):
            number, bound = np.nan, 0.0
        while bound > tolerance and share > ROUNDING and tree.has_nodes:
            number, bound, steps = _search(tree, rows, point, share, stack, parts)
            work += steps
            share *= smaller(_LESS, _AIM * tolerance / bound)
        out[i] = number
        if bound > tolerance:
            out[i] = _all_faces(tree, point, parts)
            work += tree.count
        if work > _WORK:
            return i + 1
    return end


@kernel
def exceed_half(words, rows, points, out, stack, begin, end):
    """Write numbers above 1/2 where winding numbers are, and else others, to ``out`` (n,); all else as above."""
    tree, rows, stack, parts = tree_pointers(words), pointer(rows), pointer(stack), local_doubles()
    work = np.int64(0)
    for i in range(begin, end):
        row = at(pointer(points), 3 * i)
        point = _point_at(tree, row)
        number, bound, share = 0.5, 0.0, _FIRST_SIDE
        if not _is_held(tree, row, point):
            number = np.nan
        while abs(number - 0.5) <= bound and share > ROUNDING and tree.has_nodes:
            number, bound, steps = _search(tree, rows, point, share, stack, parts)
            work += steps
            share *= _NEXT_SIDE
        out[i] = number
        if abs(number - 0.5) <= bound:
            out[i] = _all_faces(tree, point, parts)
            work += tree.count
        if work > _WORK:
            return i + 1
    return end


@inlined
def _point_at(tree, row):
    x, y, z = tree.scale * get(row, 0), tree.scale * get(row, 1), tree.scale * get(row, 2)
    return Point(0, 4, 8, _within(x), _within(y), _within(z))


@inlined
def _is_held(tree, row, point):
    """Whether the tree's units hold a point exactly; far away they need not."""
    return _keeps(tree, get(row, 0), point.x) & _keeps(tree, get(row, 1), point.y) & _keeps(tree, get(row, 2), point.z)


@inlined
def _keeps(tree, x, scaled):
    return abs(scaled) >= 1.0 or scaled / tree.scale == x


@inlined
def _within(x):
    """No farther than products allow: so far away all winding numbers are 0 to 2^-100."""
    return larger(-FARTHEST, smaller(FARTHEST, x))


@kernel
def _search(tree, rows, point, share, stack, parts):
    """The winding number and a bound of its error, where ``share`` says how near a series is asked; and the number of
    nodes and blocks that it took.
    """
    total, values, bounds, top, steps = no_turn(), splat4(0.0), splat4(0.0), 1, np.int64(0)
    put(stack, 0, 0)
    while top > 0:
        top -= 1
        child = get(stack, top)
        if child < 0:
            first, count = blocks_of(child)
            total = add_blocks(tree, first, count, point, total, parts)
            steps += count
            continue
        bits, value, bound = see_octants(rows, child * MOMENT_WORDS, point, share)
        values, bounds = values + value, bounds + bound
        top = push_children(tree, child, bits, stack, top)
        steps += 1
    return sum_lanes(values) + turns_of(total), sum_lanes(bounds), steps


@kernel
def _all_faces(tree, point, parts):
    return turns_of(add_blocks(tree, 0, tree.count, point, no_turn(), parts))

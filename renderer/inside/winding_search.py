"""Winding numbers by a traversal of the tree: series for far octants, single faces near by."""

from typing import Any, NamedTuple

import numpy as np

from renderer.arguments.limits import FARTHEST
from renderer.inside.multipoles import MOMENT_WORDS, ROUNDING, see_octants, sum_lanes
from renderer.inside.solid_angle import Turned, add_blocks, no_turn, turns_of
from renderer.jit.decorators import inlined, kernel
from renderer.numerics.simd import load, local_doubles, maximum, minimum, offset, pointer, splat4
from renderer.trace.point import Point
from renderer.trace.trees import tree_pointers
from renderer.trace.walk import walk

# The nodes and blocks that a call sums, beside those of one point: some milliseconds, so that Ctrl-C need not wait for
# long.
_WORK = 1 << 16
# In place of a tolerance: only on which side of 1/2 the number lies.
SIDE_OF_HALF = -1.0
# The share with which a search for a tolerance begins: the bounds add up to about the tolerance around a closed mesh.
_FIRST = 2.0
# The next share aims at so much of the tolerance, and is at most half of the last.
_AIM, _LESS = 0.8, 0.5
# The share with which the question on which side of 1/2 begins, and what the next is of the last.
_FIRST_SIDE, _NEXT_SIDE = 1.0, 2.0**-4


@kernel
def find_windings(descriptor, rows, points, tolerance, out, stack, begin, end):
    """Write the winding numbers around the points begin:end of ``points`` (n, 3) to ``out`` (n,), within ``tolerance``;
    for SIDE_OF_HALF, numbers on the right side of 1/2.

    They are NaN if products leave float64's range, see ``add_blocks``. ``rows`` is ``moments_of`` the tree, ``stack``
    memory for ``walk.stack_size`` int64. Returns the row before which it ended, early after _WORK.
    """
    tree, rows, stack, parts = tree_pointers(descriptor), pointer(rows), pointer(stack), local_doubles()
    work, first_share = np.int64(0), _FIRST_SIDE if tolerance < 0.0 else _FIRST * tolerance
    for i in range(begin, end):
        row = offset(pointer(points), 3 * i)
        point = _point_at(tree, row)
        number, bound, share = 0.5, np.inf, first_share
        if not _is_held(tree, row, point):
            number, bound = np.nan, 0.0
        while _is_open(number, bound, tolerance) and share > ROUNDING and tree.has_nodes:
            number, bound, steps = _search(tree, _Query(rows, point, share, parts), stack)
            work += steps
            share *= _NEXT_SIDE if tolerance < 0.0 else minimum(_LESS, _AIM * tolerance / bound)
        if _is_open(number, bound, tolerance):
            number = _all_faces(tree, point, parts)
            work += tree.count
        out[i] = number
        if work > _WORK:
            return i + 1
    return end


@inlined
def _is_open(number, bound, tolerance):
    """Whether a number with a bound of its error leaves the answer undecided."""
    return abs(number - 0.5) <= bound if tolerance < 0.0 else bound > tolerance


@inlined
def _point_at(tree, row):
    x, y, z = tree.scale * load(row, 0), tree.scale * load(row, 1), tree.scale * load(row, 2)
    return Point(0, 4, 8, _within(x), _within(y), _within(z))


@inlined
def _is_held(tree, row, point):
    """Whether the tree's units represent a point exactly; far away they need not."""
    return (
        _keeps(tree, load(row, 0), point.x) & _keeps(tree, load(row, 1), point.y) & _keeps(tree, load(row, 2), point.z)
    )


@inlined
def _keeps(tree, x, scaled):
    return abs(scaled) >= 1.0 or scaled / tree.scale == x


@inlined
def _within(x):
    """The coordinate clamped to a range without overflow; beyond it all winding numbers are 0 to 2^-100."""
    return maximum(-FARTHEST, minimum(FARTHEST, x))


class _Query(NamedTuple):
    """A point, and ``share``, which limits how near to it a series is used.

    rows   pointer to ``moments_of`` the tree
    parts  memory for an expansion
    """

    rows: Any
    point: Point
    share: float
    parts: Any


class _Sums(NamedTuple):
    """Sums so far: of the solid angles of single faces, of series, and of the bounds of their errors, four lanes each;
    and the number of nodes and blocks visited.
    """

    angles: Turned
    values: Any
    bounds: Any
    steps: int


@kernel
def _search(tree, query, stack):
    """The winding number, a bound of its error, and the number of nodes and blocks visited."""
    sums = walk(tree, stack, query, _Sums(no_turn(), splat4(0.0), splat4(0.0), np.int64(0)), _add_series, _add_leaf)
    return sum_lanes(sums.values) + turns_of(sums.angles), sum_lanes(sums.bounds), sums.steps


@inlined
def _add_series(tree, query, node, sums):
    bits, value, bound = see_octants(query.rows, node * MOMENT_WORDS, query.point, query.share)
    return _Sums(sums.angles, sums.values + value, sums.bounds + bound, sums.steps + 1), bits


@inlined
def _add_leaf(tree, query, first, count, sums):
    angles = add_blocks(tree, first, count, query.point, sums.angles, query.parts)
    return _Sums(angles, sums.values, sums.bounds, sums.steps + count), False


@kernel
def _all_faces(tree, point, parts):
    return turns_of(add_blocks(tree, 0, tree.count, point, no_turn(), parts))

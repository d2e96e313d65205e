"""The face nearest to a point: a traversal of the tree, nearest boxes first.

The search keeps a bound of the distance and lists the faces that may be within it. ``distance_to_face`` measures only
those. So the result is the least of these distances over all faces, for any tree and order.
"""

from typing import Any, NamedTuple

import numpy as np

from renderer.distance.block_distance import bound_distances
from renderer.distance.face_distance import UNDECIDED_FLAG, distance_to_face
from renderer.jit.decorators import inlined, kernel
from renderer.numerics.simd import (
    extract,
    load,
    load4,
    local_doubles,
    lowest_bit,
    minimum,
    movemask,
    offset,
    pointer,
    select,
    splat4,
    store,
)
from renderer.numerics.vec3 import three
from renderer.trace.best import NO_FACE
from renderer.trace.edge_signs import corner
from renderer.trace.intersect import face_in
from renderer.trace.layout import BLOCK_FACES, BLOCK_WORDS
from renderer.trace.point import Point
from renderer.trace.rays import hit_pointers
from renderer.trace.trees import tree_pointers
from renderer.trace.walk import boxes_of, child_in, walk_nearest_first

# In place of a face: float64 cannot decide.
UNDECIDED_FACE = -2
# Faces that may be the nearest are measured together when so many are listed.
LISTED = 64
# The blocks that a call tests, some milliseconds, and how many of them the measure of one face costs.
WORK, _MEASURE = 1 << 16, 16
# No distance is larger: points keep to 2^126 and meshes to 2^60, in the tree's units.
_FARTHEST = 2.0**130
# More than squares and their sum lose, and what a bound's square needs above it.
_LESS, _MORE = 1.0 - 2.0**-48, 1.0 + 2.0**-48
# What they lose besides, where they vanish.
_VANISHED = 2.0**-1060


class Nearest(NamedTuple):
    """The nearest face so far: its distance, its number (NO_FACE for none), and u and v of its nearest point."""

    distance: float
    face: Any
    u: float
    v: float


class Scratch(NamedTuple):
    """Scratch as pointers.

    children, near  the waiting nodes and leaves, and the squared distances of their boxes
    places, least   the listed faces' places in the blocks, and lower bounds of their distances
    squares         eight squares
    work            the blocks tested so far; each face measured counts as several
    parts           memory for an expansion
    """

    children: Any
    near: Any
    places: Any
    least: Any
    squares: Any
    work: Any
    parts: Any


class _Query(NamedTuple):
    """A point, the mask of the instances that count or -1, and the scratch of its search."""

    point: Point
    mask: int
    scratch: Scratch


class _Found(NamedTuple):
    """The nearest face so far, the number of listed faces, and a bound of the distance."""

    best: Nearest
    listed: int
    limit: float


@kernel
def find_nearest(descriptor, points, rows, limits, mask, out, integers, doubles, begin):
    """Write distance, u, v and face (or UNDECIDED_FACE) of ``points``, from row ``begin`` on, to ``out[:, rows]``.

    out        (4, m) float64
    limits     (m,) or (1,), the largest distance that counts
    mask       in a scene, bits of which the instances that count have one; -1 for all instances
    integers   memory for ``walk.stack_size`` and LISTED int64; ``doubles``, for as many float64 and nine more

    Returns the row before which it ended, early after WORK, so that Ctrl-C need not wait.
    """
    tree, parts, count = tree_pointers(descriptor), local_doubles(), len(points)
    found, size = hit_pointers(out, out.shape[1]), len(integers) - LISTED
    children, near = pointer(integers), pointer(doubles)
    scratch = Scratch(
        children,
        near,
        offset(children, size),
        offset(near, size),
        offset(near, size + LISTED),
        offset(near, size + LISTED + 8),
        parts,
    )
    store(scratch.work, 0, 0.0)
    for i in range(begin, count):
        p, row = offset(pointer(points), 3 * i), rows[i]
        limit = limits[row if len(limits) > 1 else 0]
        point = Point(0, 4, 8, tree.scale * load(p, 0), tree.scale * load(p, 1), tree.scale * load(p, 2))
        store(parts, UNDECIDED_FLAG, 0.0)
        near = _search(tree, _Query(point, mask, scratch), minimum(limit * tree.scale * _MORE, _FARTHEST))
        # rule: distance-in-mesh-units
        distance = near.distance / tree.scale
        face = near.face
        # rule: reach-is-closed
        hit = face != NO_FACE and distance <= limit
        store(found.t, row, distance if hit else np.inf)
        # rule: lost-products
        is_known = load(parts, UNDECIDED_FLAG) == 0.0 and _is_scaled(point, p, tree.scale)
        store(found.face, row, np.int64((face if hit else -1) if is_known else UNDECIDED_FACE))
        store(found.u, row, near.u if hit else np.nan)
        store(found.v, row, near.v if hit else np.nan)
        if load(scratch.work, 0) > WORK:
            return i + 1
    return count


@kernel
def measure_faces(triangles, point, out):
    """Write distance, u and v of each face (k, 3 corners, 3) seen from a point (3,), and 1 if they are known, to
    ``out`` (k, 4).
    """
    parts, p = local_doubles(), three(pointer(point), 0)
    for i in range(len(triangles)):
        store(parts, UNDECIDED_FLAG, 0.0)
        base = offset(pointer(triangles), 9 * i)
        out[i, 0], out[i, 1], out[i, 2] = distance_to_face(three(base, 0), three(base, 3), three(base, 6), p, parts)
        out[i, 3] = 1.0 if load(parts, UNDECIDED_FLAG) == 0.0 else 0.0


@inlined
def _is_scaled(point, p, scale):
    """Whether the tree's units represent the coordinates at ``p`` exactly."""
    return point.x / scale == load(p, 0) and point.y / scale == load(p, 1) and point.z / scale == load(p, 2)


@kernel
def _search(tree, query, limit):
    """The ``Nearest`` face within ``limit``."""
    none, scratch = Nearest(np.inf, np.int32(NO_FACE), 0.0, 0.0), query.scratch
    store(scratch.near, 0, 0.0)
    found = walk_nearest_first(
        tree, scratch.children, query, _Found(none, np.int64(0), limit), _reaches, _enter, _visit
    )
    return _settle(tree, query, found)


@inlined
def _reaches(query, k, found):
    return load(query.scratch.near, k) <= _squared(found.limit)


@inlined
def _enter(tree, query, node, found, top):
    if query.mask >= 0 and not tree.ways.may_hit(tree, node, query.mask, -1):
        return found, top
    nodes, base = boxes_of(tree, node)
    bits = _bound_boxes(nodes, base, query.point, splat4(_squared(found.limit)), query.scratch.squares)
    return found, _push_nearest_last(tree, node, bits, query.scratch, top)


@inlined
def _visit(tree, query, first, count, found):
    return _list_faces(tree, query, first, count, found), False


@inlined
def _squared(limit):
    """An upper bound of the square of a box's distance that is within the limit."""
    return limit * limit * _MORE + _VANISHED


@inlined
def _push_nearest_last(tree, node, bits, scratch, top):
    """Push the octants ``bits`` of a node, the nearest on top.

    The others are unsorted: most are out of reach once the nearest is searched, and sorting takes longer.
    """
    if bits == 0:
        return top
    least, nearest = np.inf, top
    while bits != 0:
        i = lowest_bit(bits)
        bits &= bits - 1
        square = load(scratch.squares, i)
        store(scratch.near, top, square)
        store(scratch.children, top, child_in(tree, node, i))
        nearest, least = (top, square) if square < least else (nearest, least)
        top += 1
    last = top - 1
    square, child = load(scratch.near, nearest), load(scratch.children, nearest)
    store(scratch.near, nearest, load(scratch.near, last))
    store(scratch.children, nearest, load(scratch.children, last))
    store(scratch.near, last, square)
    store(scratch.children, last, child)
    return top


@inlined
def _bound_boxes(nodes, base, point, limit, squares):
    """Write lower bounds of the squared distances of eight boxes. Returns the bits of those within the limit."""
    low, high = _bound_four(nodes, base, point), _bound_four(nodes, base + 4, point)
    store(squares, 0, low)
    store(squares, 4, high)
    return movemask(low <= limit) | (movemask(high <= limit) << 4)


@inlined
def _bound_four(nodes, base, point):
    x, y, z = _gap(nodes, base, point.x), _gap(nodes, base + 16, point.y), _gap(nodes, base + 32, point.z)
    return (x * x + y * y + z * z) * splat4(_LESS)


@inlined
def _gap(nodes, row, x):
    """The distance of a coordinate from each of four intervals, 0 inside; inf for empty octants."""
    zero, below, above = splat4(0.0), load4(nodes, row) - splat4(x), splat4(x) - load4(nodes, row + 8)
    gap = select(below > above, below, above)
    return select(gap > zero, gap, zero)


@kernel
def _list_faces(tree, query, first, count, found):
    """List the faces of some blocks that may be within the limit, and lower the limit to their least upper bound."""
    scratch, best, listed, limit = query.scratch, found.best, found.listed, found.limit
    store(scratch.work, 0, load(scratch.work, 0) + count)
    for block in range(first, first + count):
        bits, low, limit = bound_distances(tree, block * BLOCK_WORDS, query.point, limit)
        while bits != 0:
            i = lowest_bit(bits)
            bits &= bits - 1
            store(scratch.places, listed, block * BLOCK_FACES + i)
            store(scratch.least, listed, extract(low, i))
            listed += 1
            if listed == LISTED:
                best = _settle(tree, query, _Found(best, listed, limit))
                limit, listed = minimum(limit, best.distance * _MORE), np.int64(0)
    return _Found(best, listed, limit)


@kernel
def _settle(tree, query, found):
    """The better of the best face and the listed ones still within the limit: least distance, then lowest face."""
    best, scratch, p = found.best, query.scratch, (query.point.x, query.point.y, query.point.z)
    for k in range(found.listed):
        if load(scratch.least, k) > found.limit:
            continue
        place = load(scratch.places, k)
        store(scratch.work, 0, load(scratch.work, 0) + _MEASURE)
        base = (place // BLOCK_FACES) * BLOCK_WORDS + place % BLOCK_FACES
        f = face_in(tree, place)
        a, b, c = corner(tree, base), corner(tree, base + 12), corner(tree, base + 24)
        d, u, v = distance_to_face(a, b, c, p, scratch.parts)
        # rule: equally-near
        if d < best.distance or (d == best.distance and f < best.face):
            best = Nearest(d, f, u, v)
    return best

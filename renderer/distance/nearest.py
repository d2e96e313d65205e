"""The face that is nearest to a point: a search through the tree, the nearest boxes first.

The search keeps a bound of the distance and lists the faces that may be within it; only those are told apart by
``distance_to_face``. So the answer is the least of those distances over all faces, whatever the tree and the order.
"""

from typing import Any, NamedTuple

import numpy as np

from renderer.distance.block_distance import bound_distances
from renderer.distance.face_distance import UNTOLD, distance_to_face
from renderer.jit.decorators import inlined, kernel
from renderer.numerics.simd import (
    at,
    extract,
    get,
    load4,
    local_doubles,
    lowest_bit,
    movemask,
    pointer,
    put,
    select,
    smaller,
    splat4,
    store,
)
from renderer.numerics.vec3 import three
from renderer.trace.best import NO_FACE
from renderer.trace.edge_signs import corner
from renderer.trace.layout import BLOCK_FACES, BLOCK_WORDS, CHILDREN, NODE_WORDS
from renderer.trace.leaf import tree_pointers
from renderer.trace.point import Point
from renderer.trace.rays import hit_pointers
from renderer.trace.walk import blocks_of

# In place of a face: float64 cannot tell.
UNTOLD_FACE = -2
# Faces that may be the nearest are told apart at once when so many are listed.
LISTED = 64
# The blocks that a call tests, some milliseconds, and how many of them one face costs that is told apart.
WORK, _APART = 1 << 16, 16
# No distance is larger: points keep to 2^126 and meshes to 2^60, in the tree's units.
_FARTHEST = 2.0**130
# More than squares and their sum lose, and what a bound's square needs above it.
_LESS, _MORE = 1.0 - 2.0**-48, 1.0 + 2.0**-48
# What they lose besides, where they vanish.
_VANISHED = 2.0**-1060


class Search(NamedTuple):
    """Memory of a search, as pointers.

    children, near  the nodes and leaves that wait, and the squares of their boxes' distances
    places, least   the listed faces' places in the blocks, and the least distances that they may have
    squares         eight squares
    work            the blocks tested so far, and, as more of them, the faces told apart
    parts           memory for an expansion
    """

    children: Any
    near: Any
    places: Any
    least: Any
    squares: Any
    work: Any
    parts: Any


@kernel
def find_nearest(words, points, rows, limits, out, integers, doubles, begin):
    """Write distance, u, v and face (or UNTOLD_FACE) of ``points``, from row ``begin`` on, to ``out[:, rows]``, (4, m).

    limits     (m,) or (1,), the largest distance that counts
    integers   memory for ``walk.stack_size`` and LISTED int64; ``doubles``, for as many float64 and nine more

    Returns the row before which it ended: early after WORK, so that Ctrl-C need not wait for long.
    """
    tree, parts, count = tree_pointers(words), local_doubles(), len(points)
    found, size = hit_pointers(out, out.shape[1]), len(integers) - LISTED
    children, near = pointer(integers), pointer(doubles)
    search = Search(
        children, near, at(children, size), at(near, size), at(near, size + LISTED), at(near, size + LISTED + 8), parts
    )
    put(search.work, 0, 0.0)
    for i in range(begin, count):
        p, row = at(pointer(points), 3 * i), rows[i]
        limit = limits[row if len(limits) > 1 else 0]
        # rule: point-in-tree-units
        point = Point(0, 4, 8, tree.scale * get(p, 0), tree.scale * get(p, 1), tree.scale * get(p, 2))
        put(parts, UNTOLD, 0.0)
        distance, face, u, v = _search(tree, point, smaller(limit * tree.scale * _MORE, _FARTHEST), search)
        distance /= tree.scale
        # rule: reach-is-closed
        hit = face != NO_FACE and distance <= limit
        put(found.t, row, distance if hit else np.inf)
        # rule: lost-products
        told = get(parts, UNTOLD) == 0.0 and _is_scaled(point, p, tree.scale)
        put(found.face, row, np.int64((face if hit else -1) if told else UNTOLD_FACE))
        put(found.u, row, u if hit else np.nan)
        put(found.v, row, v if hit else np.nan)
        if get(search.work, 0) > WORK:
            return i + 1
    return count


@kernel
def tell_faces(triangles, point, told):
    """Write distance, u and v of each face (k, 3 corners, 3) seen from a point (3,), and 1 where they are told.

    ``told`` has the shape (k, 4).
    """
    parts, p = local_doubles(), three(pointer(point), 0)
    for i in range(len(triangles)):
        put(parts, UNTOLD, 0.0)
        base = at(pointer(triangles), 9 * i)
        told[i, 0], told[i, 1], told[i, 2] = distance_to_face(three(base, 0), three(base, 3), three(base, 6), p, parts)
        told[i, 3] = 1.0 if get(parts, UNTOLD) == 0.0 else 0.0


@inlined
def _is_scaled(point, p, scale):
    """Whether the tree's units hold the coordinates at ``p`` exactly."""
    return point.x / scale == get(p, 0) and point.y / scale == get(p, 1) and point.z / scale == get(p, 2)


@kernel
def _search(tree, point, limit, search):
    """The nearest face within ``limit``: distance, face (NO_FACE for none), u and v."""
    best, listed = (np.inf, np.int32(NO_FACE), 0.0, 0.0), np.int64(0)
    if not tree.has_nodes:
        best, listed, limit = _search_blocks(tree, 0, tree.count, point, search, best, listed, limit)
        return _settle(tree, point, search, best, listed, limit)
    top = 1
    put(search.children, 0, 0)
    put(search.near, 0, 0.0)
    while top > 0:
        top -= 1
        if get(search.near, top) > _squared(limit):
            continue
        child = get(search.children, top)
        if child < 0:
            first, count = blocks_of(child)
            best, listed, limit = _search_blocks(tree, first, count, point, search, best, listed, limit)
            continue
        base = child * NODE_WORDS
        bits = _bound_boxes(tree.nodes, base, point, splat4(_squared(limit)), search.squares)
        top = _push_nearest_last(tree.links, base + CHILDREN, bits, search, top)
    return _settle(tree, point, search, best, listed, limit)


@inlined
def _squared(limit):
    """At least as much as the square of a box's distance that is within the limit."""
    return limit * limit * _MORE + _VANISHED


@inlined
def _push_nearest_last(links, base, bits, search, top):
    """Let the octants ``bits`` wait, the nearest on top; ``base`` is where the node's links begin.

    The others are in no order: most are out of reach once the nearest is searched, and sorting takes longer.
    """
    if bits == 0:
        return top
    least, nearest = np.inf, top
    while bits != 0:
        i = lowest_bit(bits)
        bits &= bits - 1
        square = get(search.squares, i)
        put(search.near, top, square)
        put(search.children, top, np.int64(get(links, base + i)))
        nearest, least = (top, square) if square < least else (nearest, least)
        top += 1
    last = top - 1
    square, child = get(search.near, nearest), get(search.children, nearest)
    put(search.near, nearest, get(search.near, last))
    put(search.children, nearest, get(search.children, last))
    put(search.near, last, square)
    put(search.children, last, child)
    return top


@inlined
def _bound_boxes(nodes, base, point, limit, squares):
    """Write lower bounds of the squared distances of eight boxes; returns the bits of those within the limit."""
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
    """The way of a coordinate to each of four intervals, 0 within; inf for those of empty octants."""
    zero, below, above = splat4(0.0), load4(nodes, row) - splat4(x), splat4(x) - load4(nodes, row + 8)
    gap = select(below > above, below, above)
    return select(gap > zero, gap, zero)


@kernel
def _search_blocks(tree, first, count, point, search, best, listed, limit):
    """List the faces of some blocks that may be within ``limit``, and lower that to what they bound."""
    put(search.work, 0, get(search.work, 0) + count)
    for block in range(first, first + count):
        bits, low, limit = bound_distances(tree, block * BLOCK_WORDS, point, limit)
        while bits != 0:
            i = lowest_bit(bits)
            bits &= bits - 1
            put(search.places, listed, block * BLOCK_FACES + i)
            put(search.least, listed, extract(low, i))
            listed += 1
            if listed == LISTED:
                best = _settle(tree, point, search, best, listed, limit)
                limit, listed = smaller(limit, best[0] * _MORE), np.int64(0)
    return best, listed, limit


@kernel
def _settle(tree, point, search, best, listed, limit):
    """The better of ``best`` and the listed faces that are still within the limit: least distance, then lowest face."""
    distance, face, u, v = best
    p = point.x, point.y, point.z
    for k in range(listed):
        if get(search.least, k) > limit:
            continue
        place = get(search.places, k)
        put(search.work, 0, get(search.work, 0) + _APART)
        base = (place // BLOCK_FACES) * BLOCK_WORDS + place % BLOCK_FACES
        f = get(tree.faces, place)
        d, du, dv = distance_to_face(corner(tree, base), corner(tree, base + 12), corner(tree, base + 24), p,
                                     search.parts)  # fmt: skip
        # rule: equally-near
        if d < distance or (d == distance and f < face):
            distance, face, u, v = d, f, du, dv
    return distance, face, u, v

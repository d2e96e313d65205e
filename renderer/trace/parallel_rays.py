"""Any hits of parallel rays from a small region, such as those of a study's points in one direction.

One walk through the tree serves all rays. It enters a node where the rays together may enter it, as ``projection`` sees
them. At a leaf it finds the rays that enter the leaf's box, eight at a time, and tests those against the faces that
they may hit.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.simd import (
    add_each,
    address,
    count_bits,
    equal4,
    float32_pointer,
    int32_pointer,
    load,
    load8,
    lowest_bit,
    maximum,
    minimum,
    movemask,
    narrow,
    offset,
    pointer,
    reduce_max,
    reduce_min,
    set_first,
    store,
    widen,
)
from renderer.trace.best import NO_FACE
from renderer.trace.intersect import Shear, make_shear
from renderer.trace.layout import BLOCK_FACES, BLOCK_WORDS, CHILDREN, NODE_WORDS, WORD_BYTES, cache_aligned
from renderer.trace.leaf import any_in_blocks
from renderer.trace.projection import (
    EXTENT_WORDS,
    Extent,
    Projection,
    box_at,
    enter,
    error_of,
    make_projection,
    may_hit,
    middle_of,
    overlap,
    place_eight,
    put_boxes,
    see_boxes,
    see_faces,
)
from renderer.trace.rays import ray_at, starts8
from renderer.trace.single import search_carefully
from renderer.trace.starts.record import EDGE
from renderer.trace.starts.record import FACE as START_FACE
from renderer.trace.starts.record import SLACK as START_SLACK
from renderer.trace.stream import prefetch_node
from renderer.trace.walk import blocks_of, stack_size

# The walk gives up after it entered so many nodes for each ray: in a city and on a terrain with a point for each face
# it enters 0.3 to 0.6.
_MOST_NODES = 4
# The rows of a group of eight rays, float32.
_X, _Y, _H, _ALONG, _SLACK, _GROUP = 0, 8, 16, 24, 32, 40
# Coordinates of rays that err by more could overflow; those that err by less are finite, and so is each middle.
_TOO_FAR = np.float32(2.0**80)
_NOWHERE = np.float32(np.inf)


class ParallelScratch(NamedTuple):
    """Memory in which a thread traces parallel rays: the arrays behind ``ParallelPointers``."""

    floats: NDArray[np.float32]
    integers: NDArray[np.int64]
    rays: int


class ParallelPointers(NamedTuple):
    """Pointers into a ``ParallelScratch``.

    places    where the live rays are seen, in groups of eight
    boxes     the extents of the octants of a node
    live      the numbers of the rays that have hit nothing yet, and some that have
    in_doubt  for each ray whether a hit must be resolved, 1 or 0
    entered   the places among the live rays of those that enter a leaf, int32
    waiting   the nodes that wait
    """

    places: Any
    boxes: Any
    live: Any
    in_doubt: Any
    entered: Any
    waiting: Any


def new_parallel_scratch(depth: int, rays: int) -> ParallelScratch:
    """Memory for up to ``rays`` rays, a multiple of eight, against a tree of ``depth`` levels."""
    floats = cache_aligned(rays // 8 * _GROUP + EXTENT_WORDS, np.float32)
    return ParallelScratch(floats, cache_aligned(stack_size(depth) + 3 * (rays + 8), np.int64), rays)


@inlined
def parallel_pointers(scratch):
    """The ``ParallelPointers`` into a ``ParallelScratch``."""
    floats, integers, rays = float32_pointer(address(scratch.floats)), pointer(scratch.integers), scratch.rays
    in_doubt, waiting = offset(integers, rays + 8), offset(integers, 3 * (rays + 8))
    entered = int32_pointer(address(scratch.integers) + 2 * WORD_BYTES * (rays + 8))
    return ParallelPointers(floats, offset(floats, rays // 8 * _GROUP), integers, in_doubt, entered, waiting)


class _Seen(NamedTuple):
    """Parallel rays: their projection and shear, the ``Extent`` of all, their largest coordinate, the error of these,
    the number of groups, and the t_max that they share.
    """

    projection: Projection
    shear: Shear
    extent: Extent
    reach: Any
    error: Any
    groups: int
    t_max: float


@kernel
def _place_rays(rays, parallel, shear, count, t_max):
    """Project the first ``count`` live rays."""
    live, places, groups = parallel.live, parallel.places, (count + 7) // 8
    projection, last = make_projection(rays, load(live, 0), shear), load(live, count - 1)
    # The last ray also takes the places that are left.
    for k in range(count, 8 * groups):
        store(live, k, last)
    for group in range(groups):
        numbers, at = offset(live, 8 * group), offset(places, group * _GROUP)
        x, y, h, along = place_eight(projection, rays, numbers)
        store(at, _X, x)
        store(at, _Y, y)
        store(at, _H, h)
        store(at, _ALONG, along)
        store(at, _SLACK, narrow(starts8(rays.starts, numbers)[0]))
    x, half_x = middle_of(*_range_of(places, _X, groups))
    y, half_y = middle_of(*_range_of(places, _Y, groups))
    h, half_h = middle_of(*_range_of(places, _H, groups))
    start, end = _range_of(places, _ALONG, groups)
    reach = maximum(maximum(abs(x) + half_x, abs(y) + half_y), maximum(abs(h) + half_h, maximum(abs(start), abs(end))))
    error = error_of(reach, _range_of(places, _SLACK, groups)[1])
    return _Seen(projection, shear, Extent(x, y, h, half_x, half_y, half_h, start), reach, error, groups, t_max)


@inlined
def _range_of(places, row, groups):
    """The least and the largest number in a row of all groups."""
    least = most = load8(places, row)
    for group in range(1, groups):
        some = load8(places, group * _GROUP + row)
        least, most = minimum(least, some), maximum(most, some)
    return reduce_min(least), reduce_max(most)


@inlined
def _find_rays(parallel, seen, box):
    """List the places of the rays that enter a box. Returns how many."""
    found = np.int64(0)
    for group in range(seen.groups):
        at = offset(parallel.places, group * _GROUP)
        mask = enter(box, load8(at, _X), load8(at, _Y), load8(at, _H), load8(at, _ALONG))
        bits = movemask(mask)
        if bits != 0:
            store(parallel.entered, found, add_each(set_first(bits), 8 * group))
            found += count_bits(bits)
    return found


@kernel
def _test_leaf(tree, rays, found, parallel, seen, leaf, some):
    """Test the first ``some`` rays that entered a leaf against its faces. Returns how many it hides."""
    (first, blocks), hidden, rows = blocks_of(leaf), np.int64(0), rays.starts
    for block in range(first, first + blocks):
        faces = see_faces(tree, block * BLOCK_WORDS, seen.shear, seen.projection, widen(seen.reach), widen(seen.error))
        used = ~equal4(tree.faces, block * BLOCK_FACES, np.int64(-1))
        for k in range(some):
            place = np.int64(load(parallel.entered, k))
            at, i = offset(parallel.places, (place >> 3) * _GROUP + (place & 7)), load(parallel.live, place)
            bits = may_hit(faces, load(at, _X), load(at, _Y), load(at, _ALONG)) & used
            # A ray does not hit the face that it leaves.
            own = np.int64(load(rows.rows, i * rows.step + START_FACE))
            if bits & ~equal4(tree.faces, block * BLOCK_FACES, own) != 0 and not load(found.hit, i):
                hides = _hides(tree, rays, found, parallel, seen, block, i)
                if hides:
                    store(at, _X, _NOWHERE)
                hidden += np.int64(hides)
    return hidden


@inlined
def _hides(tree, rays, found, parallel, seen, block, i):
    """Whether a block hides ray ``i``."""
    hit, unresolved = any_in_blocks(tree, block, 1, 0.0, seen.t_max, _shear_from(rays, i, seen.shear))
    if unresolved:
        store(parallel.in_doubt, i, 1)
    store(found.hit, i, hit)
    return hit


@inlined
def _is_hidden(tree, rays, scratch, i):
    """Whether ray ``i`` hits anything, by a careful search."""
    return search_carefully(tree, rays, i, scratch.packet_stack, scratch.holders, True).best.face != NO_FACE


@kernel
def _list_live(tree, rays, found, scratch, parallel, count):
    """List the rays that have hit nothing yet: all but those that start on an edge of the surface, which are searched
    for hits at once. Returns how many.
    """
    live = np.int64(0)
    for i in range(count):
        is_on_edge = load(rays.starts.rows, i * rays.starts.step + START_SLACK) == EDGE
        store(found.hit, i, is_on_edge and _is_hidden(tree, rays, scratch, i))
        store(parallel.in_doubt, i, 0)
        store(parallel.live, live, i)
        live += np.int64(not is_on_edge)
    return live


@inlined
def _shear_from(rays, i, shear):
    """The ``Shear`` of ray ``i``, which shares the direction of another ray."""
    o, row = offset(rays.origins, i * rays.origin_step), offset(rays.starts.rows, i * rays.starts.step)
    w = shear.row_z >> 2
    x, y, z = load(o, (w + 1) % 3) * rays.scale, load(o, (w + 2) % 3) * rays.scale, load(o, w) * rays.scale
    return Shear(
        shear.row_x, shear.row_y, shear.row_z, x, y, z, shear.shear_x, shear.shear_y, shear.direction_z,
        load(row, START_SLACK), load(row, START_FACE),
    )  # fmt: skip


@kernel
def _resolve(tree, rays, found, scratch, parallel, count):
    """Decide by a careful search what hits that had to be resolved left open."""
    for i in range(count):
        if load(parallel.in_doubt, i) != 0 and not load(found.hit, i):
            store(found.hit, i, _is_hidden(tree, rays, scratch, i))


@inlined
def _visit_node(tree, rays, found, parallel, seen, node, top):
    """Test the leaves of a node that rays may enter, and put its nodes on the stack. Returns its top, and how many rays
    the leaves hide.
    """
    base, hidden = node * NODE_WORDS, np.int64(0)
    boxes = see_boxes(seen.projection, tree.nodes, base, seen.error)
    bits = movemask(overlap(boxes, seen.extent))
    if bits != 0:
        put_boxes(parallel.boxes, boxes)
    while bits != 0:
        octant = lowest_bit(bits)
        bits &= bits - 1
        child = np.int64(load(tree.links, base + CHILDREN + octant))
        if child >= 0:
            store(parallel.waiting, top, child)
            top += 1
            prefetch_node(tree.nodes, child)
        else:
            some = _find_rays(parallel, seen, box_at(parallel.boxes, octant))
            if some != 0:
                hidden += _test_leaf(tree, rays, found, parallel, seen, child, some)
    return top, hidden


@inlined
def _keep_live(found, parallel, placed):
    """Drop the rays that are hidden from the ``placed`` live ones."""
    kept = np.int64(0)
    for k in range(placed):
        i = load(parallel.live, k)
        store(parallel.live, kept, i)
        kept += np.int64(not load(found.hit, i))


@kernel
def trace_parallel(tree, rays, found, count, scratch, parallel):
    """Whether each of the first ``count`` rays, which all have the direction and the bounds of the first, hits
    anything.

    Returns False if it gave up because the rays are too far apart.
    """
    ray, t_max = ray_at(rays, 0)
    shear = make_shear(ray)
    left = _list_live(tree, rays, found, scratch, parallel, count)
    if left == 0:
        return True
    seen = _place_rays(rays, parallel, shear, left, t_max)
    if not seen.error < _TOO_FAR:
        return False
    store(parallel.waiting, 0, 0)
    top, entered, placed = np.int64(1), np.int64(0), left
    while top > 0 and left > 0:
        if entered > _MOST_NODES * count:
            return False
        entered += 1
        top, hidden = _visit_node(tree, rays, found, parallel, seen, load(parallel.waiting, top - 1), top - 1)
        left -= hidden
        if 4 * left <= 3 * placed and left > 0:
            _keep_live(found, parallel, placed)
            placed = left
            seen = _place_rays(rays, parallel, shear, left, t_max)
    _resolve(tree, rays, found, scratch, parallel, count)
    return True

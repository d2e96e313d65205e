"""Any hits of parallel rays from a small region, such as those of a study's points in one direction.

One beam around all rays traverses the tree and lists the leaves that it enters, with boxes laid out like those of
nodes. Sixteen rays at a time then test that list, which fits the nearest cache, instead of the tree. The beam around
all contains the beam around any sixteen, so the list has every leaf that a ray would visit alone.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.simd import (
    address,
    broadcast_like,
    float32_pointer,
    gather8,
    int32_pointer,
    load,
    lowest_bit,
    maximum,
    minimum,
    movemask,
    offset,
    pointer,
    prefetch,
    splat8,
    store,
)
from renderer.trace.best import NO_FACE, no_hit
from renderer.trace.intersect import Shear, box_limit, largest_of, room_of, round_both
from renderer.trace.layout import CACHE_LINE, CHILDREN, NODE_WORDS, UNUSED, cache_aligned
from renderer.trace.leaf import nearest_in_blocks
from renderer.trace.packet import Beam, enter_beam, highest_origin, lowest_origin, make_beam, meet_octant, test_leaf
from renderer.trace.ray_lanes import (
    BLOCK_ROW,
    CHILD,
    FACE,
    FAR_ORIGIN,
    LEAVING,
    LIMIT,
    NEAR_INVERSE,
    NEAR_ORIGIN,
    NUMBER,
    ORIGIN,
    SLACK,
    WIDTH,
    T,
    prepare_eight,
    shear_of,
)
from renderer.trace.rays import ray_at, starts8
from renderer.trace.single import search_carefully
from renderer.trace.starts.record import EDGE
from renderer.trace.starts.record import FACE as START_FACE
from renderer.trace.starts.record import SLACK as START_SLACK
from renderer.trace.walk import blocks_of, stack_size

# The leaves of a list: 128 kB with the rays. Half as many take as long, twice as many 5 % longer.
LISTED = 256
# The beam around n rays gives up after it entered n times as many nodes. In a city and on a terrain with a point for
# each face it enters 0.3 to 1.4 nodes a ray, where sixteen rays alone enter about 20.
_MOST_NODES = 2
_LINE = CACHE_LINE // 4


class ParallelScratch(NamedTuple):
    """Memory in which a thread traces parallel rays: the arrays behind ``ParallelPointers``."""

    nodes: NDArray[np.float32]
    integers: NDArray[np.int64]
    rays: int


class ParallelPointers(NamedTuple):
    """Pointers into a ``ParallelScratch``.

    nodes, links  the listed leaves, as nodes
    waiting       the nodes that wait
    live          the numbers of the rays that have hit nothing yet
    hiders        for each ray a leaf that may hide it, or 0
    """

    nodes: Any
    links: Any
    waiting: Any
    live: Any
    hiders: Any


def new_parallel_scratch(depth: int, rays: int) -> ParallelScratch:
    """Memory for up to ``rays`` rays against a tree of ``depth`` levels."""
    nodes = cache_aligned(LISTED // 8 * NODE_WORDS, np.float32)
    return ParallelScratch(nodes, cache_aligned(stack_size(depth) + 2 * rays, np.int64), rays)


@inlined
def parallel_pointers(scratch):
    """The ``ParallelPointers`` into a ``ParallelScratch``."""
    nodes, integers, rays = address(scratch.nodes), pointer(scratch.integers), scratch.rays
    return ParallelPointers(
        float32_pointer(nodes), int32_pointer(nodes), offset(integers, 2 * rays), integers, offset(integers, rays)
    )


@inlined
def _prepare_direction(rays, prepared):
    """Prepare the first ray sixteen times; all rays share everything but the origin. Returns the rays' beam."""
    numbers = offset(prepared.integers, NUMBER)
    for r in range(WIDTH):
        store(numbers, r, 0)
    for half in range(0, WIDTH, 8):
        prepare_eight(rays, prepared, half, numbers)
    return make_beam(prepared)


@inlined
def _prepare_origins(rays, prepared, live, first, count, t_max, limit):
    """Prepare sixteen of the ``count`` live rays, from ``first`` on; if there are fewer, the last one is repeated.
    ``t_max`` and ``limit`` are T and LIMIT of a ray without a hit.
    """
    floats, doubles, integers = prepared.floats, prepared.doubles, prepared.integers
    w = load(integers, BLOCK_ROW + 2 * WIDTH) >> 2
    for r in range(WIDTH):
        store(integers, NUMBER + r, load(live, minimum(first + r, count - 1)))
    for half in range(0, WIDTH, 8):
        numbers = offset(integers, NUMBER + half)
        slack, leaving = starts8(rays.starts, numbers)
        room = room_of(slack)
        for axis in range(3):
            o = gather8(rays.origins, numbers, rays.origin_step, axis) * rays.scale
            far, near = round_both(o, room)
            if load(floats, NEAR_INVERSE + axis * WIDTH) < 0.0:
                near, far = far, near
            store(floats, NEAR_ORIGIN + axis * WIDTH + half, near)
            store(floats, FAR_ORIGIN + axis * WIDTH + half, far)
            store(doubles, ORIGIN + (axis + 2 - w) % 3 * WIDTH + half, o)
        store(doubles, SLACK + half, slack)
        store(doubles, LEAVING + half, leaving)
        store(doubles, T + half, broadcast_like(t_max, o))
        store(floats, LIMIT + half, splat8(limit))
        store(integers, FACE + half, broadcast_like(np.int64(NO_FACE), o))


@inlined
def _beam_between(beam, low, high):
    """A beam with other origins, from ``low`` to ``high``, in the order w, u, v."""
    near, far = (high[0], low[0]) if beam.sign > 0.0 else (low[0], high[0])
    return Beam(
        beam.near_row, beam.far_row, beam.row_u, beam.row_v, near, far, low[1], high[1], low[2], high[2],
        beam.least_u, beam.most_u, beam.least_v, beam.most_v, beam.sign, beam.lower, beam.order,
    )  # fmt: skip


@inlined
def _bounds(rays, live, count, axis):
    """The range of the origins of the rays ``live``, float32 and rounded outwards: rounding is monotone."""
    low, high = np.inf, -np.inf
    for j in range(count):
        i = load(live, j)
        o = load(rays.origins, i * rays.origin_step + axis) * rays.scale
        slack = load(rays.starts.rows, i * rays.starts.step + START_SLACK)
        low, high = minimum(low, o - slack), maximum(high, o + slack)
    return round_both(low, room_of(0.0))[0], round_both(high, room_of(0.0))[1]


@inlined
def _beam_around(rays, beam, live, count):
    """The beam around all rays that are ``live``."""
    low_w, high_w = _bounds(rays, live, count, beam.near_row >> 4)
    low_u, high_u = _bounds(rays, live, count, beam.row_u >> 4)
    low_v, high_v = _bounds(rays, live, count, beam.row_v >> 4)
    return _beam_between(beam, (low_w, low_u, low_v), (high_w, high_u, high_v))


@inlined
def _beam_of_sixteen(floats, beam):
    """The beam around the prepared rays."""
    w, u, v = beam.near_row >> 4, beam.row_u >> 4, beam.row_v >> 4
    low = lowest_origin(floats, w), lowest_origin(floats, u), lowest_origin(floats, v)
    return _beam_between(beam, low, (highest_origin(floats, w), highest_origin(floats, u), highest_origin(floats, v)))


@inlined
def _list_leaf(tree, parallel, place, octant, child):
    """Copy the box whose first word is ``octant`` to the list, with its leaf."""
    base = (place >> 3) * NODE_WORDS + (place & 7)
    for row in range(6):
        store(parallel.nodes, base + 8 * row, load(tree.nodes, octant + 8 * row))
    store(parallel.links, base + CHILDREN, np.int32(child))


@inlined
def _end_list(parallel, listed):
    """Fill the last node of the list with boxes that no beam enters."""
    place = listed
    while place & 7 != 0:
        base = (place >> 3) * NODE_WORDS + (place & 7)
        for row in range(6):
            store(parallel.nodes, base + 8 * row, np.float32(-np.inf) if row & 1 else np.float32(np.inf))
        store(parallel.links, base + CHILDREN, np.int32(UNUSED))
        place += 1


@kernel
def _list_leaves(tree, beam, limit, parallel, top):
    """List leaves that a beam enters, until the list is full or no node waits. Returns the number of nodes that wait,
    the length of the list, and the number of nodes entered.
    """
    listed, entered = np.int64(0), np.int64(0)
    while top > 0 and listed + 8 <= LISTED:
        top -= 1
        entered += 1
        base = load(parallel.waiting, top) * NODE_WORDS
        bits = movemask(enter_beam(tree.nodes, base, beam, limit)[1])
        while bits != 0:
            octant = base + lowest_bit(bits)
            bits &= bits - 1
            child = np.int64(load(tree.links, octant + CHILDREN))
            if child < 0:
                _list_leaf(tree, parallel, listed, octant, child)
                listed += 1
            else:
                store(parallel.waiting, top, child)
                top += 1
                for line in range(0, NODE_WORDS, _LINE):
                    prefetch(tree.nodes, child * NODE_WORDS + line)
    # rule: end-of-leaf-list
    _end_list(parallel, listed)
    return top, listed, entered


@kernel
def _test_list(tree, prepared, parallel, listed, beam):
    """Test sixteen prepared rays against the listed leaves. Returns the bits of those with hits to resolve."""
    beam, floats, unresolved = _beam_of_sixteen(prepared.floats, beam), prepared.floats, np.int64(0)
    limit = load(floats, LIMIT)
    for base in range(0, (listed + 7) // 8 * NODE_WORDS, NODE_WORDS):
        bits = movemask(enter_beam(parallel.nodes, base, beam, limit)[1])
        while bits != 0:
            octant = base + lowest_bit(bits)
            bits &= bits - 1
            meeting = meet_octant(parallel.nodes, prepared, octant)
            if meeting != 0:
                leaf = np.int64(load(parallel.links, octant + CHILDREN))
                unresolved |= test_leaf(tree, prepared, meeting, leaf, True)
    return unresolved


@inlined
def _keep_live(tree, rays, found, scratch, parallel, some, unresolved, kept):
    """Note which of the first ``some`` prepared rays are hidden, and append the others to the ``kept`` live ones.
    Returns the new number of these.
    """
    integers = scratch.prepared.integers
    for r in range(some):
        i = load(integers, NUMBER + r)
        hidden, sure = load(integers, FACE + r) != NO_FACE, False
        if hidden:
            store(parallel.hiders, i, load(integers, CHILD + r))
        elif (unresolved >> r) & 1 != 0:
            hidden, sure = _is_hidden(tree, rays, scratch, i), True
        store(found.hit, i, hidden)
        store(parallel.live, kept, i)
        kept += np.int64(not (hidden or sure))
    return kept


@inlined
def _is_hidden(tree, rays, scratch, i):
    """Whether ray ``i`` hits anything, by a careful search."""
    return search_carefully(tree, rays, i, scratch.packet_stack, scratch.holders, True).best.face != NO_FACE


@kernel
def _test_rays(tree, rays, found, scratch, parallel, count, listed, beam, t_max, limit):
    """Test the live rays against the list, sixteen at a time. Returns how many remain."""
    prepared, kept = scratch.prepared, np.int64(0)
    for first in range(0, count, WIDTH):
        _prepare_origins(rays, prepared, parallel.live, first, count, t_max, limit)
        unresolved, some = _test_list(tree, prepared, parallel, listed, beam), minimum(count - first, np.int64(WIDTH))
        kept = _keep_live(tree, rays, found, scratch, parallel, some, unresolved, kept)
    return kept


@kernel
def _try_hiders(tree, rays, found, scratch, parallel, count, t_max):
    """Test each ray against the leaf that hid a similar one, and search for hits of those that start on an edge of the
    surface. Returns how many are not hidden.
    """
    shear, kept = shear_of(scratch.prepared, 0), np.int64(0)
    for i in range(count):
        leaf, hidden = load(parallel.hiders, i), False
        if load(rays.starts.rows, i * rays.starts.step + START_SLACK) == EDGE:
            store(found.hit, i, _is_hidden(tree, rays, scratch, i))
            continue
        if leaf < 0:
            first, blocks = blocks_of(leaf)
            best, _ = nearest_in_blocks(tree, first, blocks, 0.0, _shear_from(rays, i, shear), no_hit(t_max))
            # rule: hider-is-tested
            hidden = best.face != NO_FACE
        # Asked once more only where it hid the last ray: elsewhere that would cost open rays more than it saves.
        store(parallel.hiders, i, leaf if hidden else np.int64(0))
        store(found.hit, i, hidden)
        store(parallel.live, kept, i)
        kept += np.int64(not hidden)
    return kept


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
def trace_parallel(tree, rays, found, count, scratch, parallel):
    """Whether each of the first ``count`` rays, which all have the direction and the bounds of the first, hits
    anything.

    ``parallel.hiders`` has a leaf for each ray that is tested first, or 0; afterwards the leaf that hid it, or 0.
    Returns False if it gave up because the rays are too far apart.
    """
    beam = _prepare_direction(rays, scratch.prepared)
    ray, t_max = ray_at(rays, 0)
    limit = box_limit(t_max, largest_of(ray))
    left = _try_hiders(tree, rays, found, scratch, parallel, count, t_max)
    # As long as nodes wait: list the next leaves, and test the rays that are left against them.
    store(parallel.waiting, 0, 0)
    top, entered = np.int64(1), np.int64(0)
    while top > 0 and left > 0:
        if entered > _MOST_NODES * count:
            return False
        around = _beam_around(rays, beam, parallel.live, left)
        top, listed, more = _list_leaves(tree, around, limit, parallel, top)
        entered += more
        left = _test_rays(tree, rays, found, scratch, parallel, left, listed, beam, t_max, limit)
    return True

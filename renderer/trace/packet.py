"""Sixteen coherent rays traverse the tree together: one test of a node's octants for all of them.

The test finds the octants that a beam around the rays enters: the range of origins, swept along the dominant axis
within the range of slopes. Each ray's own test implies it, so a packet visits every leaf that its rays would visit
alone. Only rays that enter a leaf's own box are tested against its triangles. Hits have the same bits.
"""

from typing import Any, NamedTuple

import numpy as np

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.kinds import of_none
from renderer.numerics.simd import (
    add_each,
    count_bits,
    joined,
    load,
    load8,
    lowest_bit,
    maximum,
    minimum,
    movemask,
    offset,
    permuted,
    reduce_max,
    reduce_min,
    select,
    splat8,
    store,
)
from renderer.trace.intersect import FAR_PADDING, order_of_octants
from renderer.trace.layout import CHILDREN, NODE_WORDS
from renderer.trace.ray_lanes import (
    BLOCK_ROW,
    CHILD,
    DIRECTION_Z,
    FAR_INVERSE,
    FAR_ORIGIN,
    LIMIT,
    LOWER,
    NEAR_INVERSE,
    NEAR_ORIGIN,
    NEAR_ROW,
    SLOPE_U,
    SLOPE_V,
    WIDTH,
    any_in_leaf,
    nearest_in_leaf,
)
from renderer.trace.stack_entry import distance_of, octant_of
from renderer.trace.walk import entered_in_order

# A beam's slopes widen by 2^-18 of their size, four times the padding of a single ray's boxes, which covers that and
# the five roundings between the two forms of the test; and by more than a slope loses below the normal float32. That is
# itself far above them: processors take a hundred cycles for each product with a number below.
_WIDER = np.float32(2.0**-18)
_LEAST_SLOPE = np.float32(2.0**-60)
# A packet gives up after this many octants, and its rays go on as lanes. Most packets of a dense picture end after 40;
# where faces are smaller than the distance of neighbouring rays, they share the upper levels only. Of 16 to 512, 48 was
# within 5 % of the best on meshes of 1e5, 1e6 and 5e6 faces.
BUDGET = 48


# Sixteen rays are no packet when a slope against their dominant axis differs by more than this from the first ray's.
# The bound only spares scattered rays the attempt; a packet whose rays part later ends by its BUDGET.
_SPREAD = 0.125


@kernel
def are_coherent(rays, begin):
    """Whether the sixteen rays from ``begin`` on share their dominant axis, its sign and nearly their slopes."""
    d, step = offset(rays.directions, begin * rays.direction_step), rays.direction_step
    ax, ay, az = abs(load(d, 0)), abs(load(d, 1)), abs(load(d, 2))
    w = 2 if az >= ax and az >= ay else (1 if ay >= ax else 0)
    u, v = (w + 1) % 3, (w + 2) % 3
    first = load(d, w)
    slope_u, slope_v = load(d, u) / first, load(d, v) / first
    for r in range(1, WIDTH):
        dw, du, dv = load(d, step * r + w), load(d, step * r + u), load(d, step * r + v)
        size = abs(dw)
        # Strictly larger: between equal components the choice of ``make_shear`` depends on which they are.
        dominant = size > abs(du) and size > abs(dv) and dw * first > 0.0
        if not (dominant and abs(du - slope_u * dw) <= _SPREAD * size and abs(dv - slope_v * dw) <= _SPREAD * size):
            return False
    size = abs(first)
    return size > abs(load(d, u)) and size > abs(load(d, v))


class Beam(NamedTuple):
    """The bounds of sixteen rays that share their dominant axis w and the sign along it.

        u                                     .  '
        |                               .  '         high_u + most_u t
        |    high_u  +------+     .  '
        |            |      |  '    +-----+
        |            |      |       | box |          t: how far along w, from near_origin for where a box is
        |     low_u  +------+  .    +-----+             entered, from far_origin for where it is left
        |                         '  .
        |           far    near         '  .         low_u + least_u t
        +------------------------------------------> w, in the direction of ``sign``

    The beam enters a box that lies within these lines somewhere between its entry and its exit, and likewise along v.

    Rows of a node, then ranges of float32: near and far origins along w, origins along u and v, slopes along u and v;
    the sign, the least distance that counts, and the word of a node that has the order of its octants.
    """

    near_row: Any
    far_row: Any
    row_u: Any
    row_v: Any
    near_origin: Any
    far_origin: Any
    low_u: Any
    high_u: Any
    low_v: Any
    high_v: Any
    least_u: Any
    most_u: Any
    least_v: Any
    most_v: Any
    sign: Any
    lower: Any
    order: Any


@inlined
def _least(floats, row):
    a, b = load8(floats, row), load8(floats, row + 8)
    return reduce_min(select(a < b, a, b))


@inlined
def most_of(floats, row):
    a, b = load8(floats, row), load8(floats, row + 8)
    return reduce_max(select(a > b, a, b))


@inlined
def lowest_origin(floats, axis):
    row = axis * WIDTH
    return minimum(_least(floats, NEAR_ORIGIN + row), _least(floats, FAR_ORIGIN + row))


@inlined
def highest_origin(floats, axis):
    row = axis * WIDTH
    return maximum(most_of(floats, NEAR_ORIGIN + row), most_of(floats, FAR_ORIGIN + row))


@inlined
def make_beam(rays):
    """The beam around sixteen rays; the first one gives its axis."""
    floats = rays.floats
    w = load(rays.integers, BLOCK_ROW + 2 * WIDTH) >> 2
    u, v = (w + 1) % 3, (w + 2) % 3
    forward = load(rays.doubles, DIRECTION_Z) > 0.0
    flip = 0 if forward else 8
    low_w, high_w = lowest_origin(floats, w), highest_origin(floats, w)
    least_u, most_u = _least(floats, SLOPE_U), most_of(floats, SLOPE_U)
    least_v, most_v = _least(floats, SLOPE_V), most_of(floats, SLOPE_V)
    return Beam(
        16 * w + flip,
        16 * w + 8 - flip,
        16 * u,
        16 * v,
        high_w if forward else low_w,
        low_w if forward else high_w,
        lowest_origin(floats, u),
        highest_origin(floats, u),
        lowest_origin(floats, v),
        highest_origin(floats, v),
        least_u - (abs(least_u) * _WIDER + _LEAST_SLOPE),
        most_u + (abs(most_u) * _WIDER + _LEAST_SLOPE),
        least_v - (abs(least_v) * _WIDER + _LEAST_SLOPE),
        most_v + (abs(most_v) * _WIDER + _LEAST_SLOPE),
        np.float32(1.0) if forward else np.float32(-1.0),
        _least(floats, LOWER),
        _order_of(rays.integers),
    )


@inlined
def _order_of(integers):
    """``order_of_octants`` of a ray in the middle."""
    row = NEAR_ROW + WIDTH // 2
    return order_of_octants(load(integers, row), load(integers, row + WIDTH), load(integers, row + 2 * WIDTH))


@inlined
def enter_beam(nodes, base, beam, limit):
    """The distances along its axis at which the beam enters the octants of the node at word ``base``, and the mask of
    those that it enters.
    """
    sign, lower, upper = splat8(beam.sign), splat8(beam.lower), splat8(limit)
    n = (load8(nodes, base + beam.near_row) - splat8(beam.near_origin)) * sign
    t0 = select(n > lower, n, lower)
    f = (load8(nodes, base + beam.far_row) - splat8(beam.far_origin)) * sign
    t1 = select(f < upper, f, upper)
    meets = t0 <= t1 * splat8(FAR_PADDING)
    a, b = splat8(beam.most_u) * t0, splat8(beam.most_u) * t1
    meets = meets & (load8(nodes, base + beam.row_u) - splat8(beam.high_u) <= select(a > b, a, b))
    a, b = splat8(beam.least_u) * t0, splat8(beam.least_u) * t1
    meets = meets & (load8(nodes, base + beam.row_u + 8) - splat8(beam.low_u) >= select(a < b, a, b))
    a, b = splat8(beam.most_v) * t0, splat8(beam.most_v) * t1
    meets = meets & (load8(nodes, base + beam.row_v) - splat8(beam.high_v) <= select(a > b, a, b))
    a, b = splat8(beam.least_v) * t0, splat8(beam.least_v) * t1
    meets = meets & (load8(nodes, base + beam.row_v + 8) - splat8(beam.low_v) >= select(a < b, a, b))
    return t0, meets


@inlined
def meet_box(nodes, at, floats, half):
    """The bits of the eight rays from ``half`` on that enter the octant whose first word is ``at``."""
    t0, t1 = load8(floats, LOWER + half), load8(floats, LIMIT + half)
    for axis in range(3):
        low, high = splat8(load(nodes, at + 16 * axis)), splat8(load(nodes, at + 16 * axis + 8))
        row = axis * WIDTH + half
        inverse = load8(floats, NEAR_INVERSE + row)
        forward = inverse > splat8(np.float32(0.0))
        n = (select(forward, low, high) - load8(floats, NEAR_ORIGIN + row)) * inverse
        t0 = select(n > t0, n, t0)
        f = (select(forward, high, low) - load8(floats, FAR_ORIGIN + row)) * load8(floats, FAR_INVERSE + row)
        t1 = select(f < t1, f, t1)
    return movemask(t0 <= t1 * splat8(FAR_PADDING))


@inlined
def push_nearest_last(tree, node, meets, t0, order, stack, top):
    """Push the octants of a node in ``meets``, in the order at the word ``order`` of nodes; an entry has t0 above the
    octant's number. Returns the new top.
    """
    octants, bits = entered_in_order(meets, load(tree.links, node * NODE_WORDS + order))
    store(stack, top, joined(add_each(octants, node * 8), permuted(t0, octants)))
    return top + count_bits(bits)


@inlined
def _push_unsorted(tree, node, meets, t0, order, stack, top):
    bits = movemask(meets)
    while bits != 0:
        store(stack, top, node * 8 + lowest_bit(bits))
        bits &= bits - 1
        top += 1
    return top


@inlined
def next_octant(stack, top, limit):
    """The topmost octant of the stack that is not beyond the limit, or -1, and the top below it."""
    while top > 0:
        top -= 1
        entry = load(stack, top)
        if distance_of(entry) <= limit:
            return octant_of(entry), top
    return -1, top


@inlined
def child_of(tree, octant):
    """The node or leaf of the octant with number 8 * node + place, and the octant's first word."""
    base, place = (octant >> 3) * NODE_WORDS, octant & 7
    return np.int64(load(tree.links, base + CHILDREN + place)), base + place


@inlined
def meet_octant(nodes, rays, at):
    """The bits of the rays that enter the octant whose first word is ``at``."""
    return meet_box(nodes, at, rays.floats, 0) | (meet_box(nodes, at, rays.floats, 8) << 8)


@kernel
def trace_packet(tree, rays, stack, any_hit):
    """Search for hits of sixteen prepared rays with one dominant axis and sign; the results stay in ``rays``.

    With ``any_hit`` a ray ends at its first hit, and octants come in any order. Returns the number of octants left on
    the stack (0 unless the packet gave up) and the bits of the rays with hits to resolve. ``stack`` has
    ``walk.stack_size`` entries.
    """
    beam, floats, nodes = make_beam(rays), rays.floats, tree.nodes
    limit, unresolved, top, node, left = most_of(floats, LIMIT), np.int64(0), np.int64(0), np.int64(0), BUDGET
    while True:
        # Push the octants of the node that the beam meets.
        t0, meets = enter_beam(nodes, node * NODE_WORDS, beam, limit)
        push = of_none(any_hit, push_nearest_last, _push_unsorted)
        # rule: packet-stack
        top = push(tree, node, meets, t0, beam.order, stack, top)
        # Take octants off the stack and test their leaves, until one leads to a node.
        while True:
            if left == 0:
                return top, unresolved
            left -= 1
            octant, top = next_octant(stack, top, limit)
            if octant < 0:
                return top, unresolved
            node, at = child_of(tree, octant)
            if node >= 0:
                break
            meeting = meet_octant(nodes, rays, at)
            if meeting != 0:
                unresolved |= test_leaf(tree, rays, meeting, node, any_hit)
                # rule: packet-limit
                limit = most_of(floats, LIMIT)


@inlined
def test_leaf(tree, rays, meeting, leaf, any_hit):
    """Test the rays in ``meeting`` against a leaf. With ``any_hit`` a hit ends the ray, and the leaf becomes its CHILD.

    Returns the bits of those with hits to resolve.
    """
    unresolved = np.int64(0)
    while meeting != 0:
        r = lowest_bit(meeting)
        meeting &= meeting - 1
        hit, must_resolve = of_none(any_hit, nearest_in_leaf, any_in_leaf)(tree, rays, r, leaf)
        unresolved |= np.int64(must_resolve) << r
        if any_hit is not None and hit:
            # A limit that no box lies within: the ray meets no further one.
            store(rays.floats, LIMIT + r, np.float32(-np.inf))
            store(rays.integers, CHILD + r, leaf)
    return unresolved

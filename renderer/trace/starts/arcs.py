"""Cuts the cones at a start into arcs that meet only at their ends, where others touch or cross them.

The foot of a wall on a floor is an example. Arcs are holders too, listed behind those of the cones.
"""

import numpy as np

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.double_double import cross_pairs, heads, negative, power_below
from renderer.numerics.simd import offset
from renderer.numerics.vec3 import largest_component
from renderer.trace.starts.cone import (
    FIRST_NODE,
    FIRST_WAY,
    HOLDER_WORDS,
    MOST_HOLDERS,
    NODE_PLACE,
    SECOND_NODE,
    SECOND_WAY,
    Holders,
    cone_of,
    is_one_way,
    name_nodes,
    node,
    put_arc,
    put_holder,
    put_node,
    put_way,
    way_of,
    within_cone,
)
from renderer.trace.starts.meeting import lean_sign

# Directions of largest component 1 to 2 are one where they differ by less: a crossing errs by 2^-94 of both faces'
# sides, over the sine of the angle between them.
_ONE = 2.0**-80
# Planes whose normals' product is less than this share of the faces' sides are one.
_LEVEL = 2.0**-90
# The places where a cone may touch or cross another: its two ends, and the two directions of both planes.
_PLACES = 4


@kernel
def arcs_of(tree, anchor, holders, count):
    """The arcs of some cones as ``Holders``, their number, and that of their nodes; the cones themselves if they
    already meet only at their ends.
    """
    number = _cut(tree, anchor, holders, count)
    if number == 0:
        return holders, count, name_nodes(tree, anchor, holders, count)
    arcs = Holders(offset(holders.holders, count * HOLDER_WORDS), holders.nodes)
    return arcs, number, _name_ends(arcs, number)


@kernel
def _cut(tree, anchor, holders, count):
    """List the arcs behind the cones. Returns their number, 0 if none is cut or there is no room for all."""
    # rule: foot-of-wall
    if not _are_cut(tree, anchor, holders, count):
        return 0
    end = count
    for i in range(count):
        begin = end
        end = _add_whole(tree, anchor, holders, i, end)
        for j in range(count):
            if j != i and end > 0:
                end = _cut_by(tree, anchor, holders, i, j, begin, end)
        if end == 0:
            return 0
    return end - count


@kernel
def _are_cut(tree, anchor, holders, count):
    """Whether any cone is touched or crossed between its ends."""
    for i in range(count):
        own = cone_of(tree, anchor, holders, i)
        for j in range(count):
            if j != i:
                other = cone_of(tree, anchor, holders, j)
                for k in range(_PLACES):
                    touches, x = _touch(own, other, k)
                    if touches and within_cone(own, x) > 0:
                        return True
    return False


@kernel
def _touch(own, other, k):
    """Whether the k-th place of a cone lies in the plane of another cone, and that direction."""
    second = other.second if other.kind == 2 else negative(other.first)
    ends = lean_sign(own.face, other.first), lean_sign(own.face, second)
    if k < 2:
        return other.kind > 0 and ends[k] == 0, other.first if k == 0 else second
    across = cross_pairs(own.face.normal, other.face.normal)
    size = largest_component(heads(across))
    # What ends in the plane, or has both ends on one side of it, does not cross it.
    apart = other.kind == 0 or (ends[0] != 0 and ends[1] != 0 and ends[0] != ends[1])
    if not apart or size <= own.face.sides * other.face.sides * _LEVEL:
        return False, other.first
    x = _scaled(across, (1.0 if k == 2 else -1.0) / power_below(size))
    return within_cone(other, x) > 0, x


@inlined
def _scaled(a, factor):
    """A vector of pairs times a power of two."""
    return (
        (a[0][0] * factor, a[0][1] * factor),
        (a[1][0] * factor, a[1][1] * factor),
        (a[2][0] * factor, a[2][1] * factor),
    )


@kernel
def _add_whole(tree, anchor, holders, i, end):
    """Add the arcs of the i-th cone, each less than half a turn. Returns the end of the list, 0 without room."""
    if end + 4 > MOST_HOLDERS:
        return 0
    own = cone_of(tree, anchor, holders, i)
    if own.kind == 2:
        put_arc(holders, end, i, own.first, own.second)
        return end + 1
    back = negative(own.first)
    if own.kind == 1:
        put_arc(holders, end, i, own.first, own.second)
        put_arc(holders, end + 1, i, own.second, back)
        return end + 2
    across = cross_pairs(own.face.normal, own.first)
    left = _scaled(across, 1.0 / power_below(largest_component(heads(across))))
    right = negative(left)
    put_arc(holders, end, i, own.first, left)
    put_arc(holders, end + 1, i, left, back)
    put_arc(holders, end + 2, i, back, right)
    put_arc(holders, end + 3, i, right, own.first)
    return end + 4


@kernel
def _cut_by(tree, anchor, holders, i, j, begin, end):
    """Cut the arcs begin:end of the i-th cone where the j-th one touches or crosses them. Returns their end, 0 without
    room.
    """
    own, other = cone_of(tree, anchor, holders, i), cone_of(tree, anchor, holders, j)
    for k in range(_PLACES):
        touches, x = _touch(own, other, k)
        if not touches:
            continue
        if end + 1 > MOST_HOLDERS:
            return 0
        for arc in range(begin, end):
            if within_cone(cone_of(tree, anchor, holders, arc), x) > 0:
                put_arc(holders, end, i, x, way_of(holders, arc, SECOND_WAY))
                put_way(holders, arc, SECOND_WAY, x)
                end += 1
                break
    return end


@kernel
def _name_ends(arcs, count):
    """Name the ends of all arcs; two ends in one direction are one node. Returns the number of nodes."""
    nodes = 0
    for k in range(count):
        for end in range(2):
            x, named = way_of(arcs, k, SECOND_WAY if end else FIRST_WAY), np.int64(-1)
            for i in range(nodes):
                place = node(arcs, i, NODE_PLACE)
                other = way_of(arcs, place >> 1, SECOND_WAY if place & 1 else FIRST_WAY)
                if named < 0 and is_one_way(x, other, _ONE):
                    named = i
            if named < 0:
                put_node(arcs, nodes, NODE_PLACE, 2 * k + end)
                named, nodes = nodes, nodes + 1
            put_holder(arcs, k, SECOND_NODE if end else FIRST_NODE, named)
    return nodes

"""The faces that contain a start, as cones of directions, and the parities of the paths that cross them.

Seen from the start, a face is a plane, a half-plane or a sector: the start is inside it, on an edge or on a corner. On
the sphere of directions its cone is an arc of a great circle. A path is two further such arcs: from a reference to a
direction in general position, the hub, and from there to the target.
"""

from typing import Any, NamedTuple

import numpy as np

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.double_double import cross_pairs, dot_pairs, heads, plus, power_below, product, scaled_difference
from renderer.numerics.simd import load, offset, store
from renderer.numerics.vec3 import largest_component, sub
from renderer.trace.edge_signs import corner
from renderer.trace.starts.anchor import from_anchor
from renderer.trace.starts.meeting import lean_sign, seen_from, turn_sign

# The most faces that may hold a start, with the arcs that they are cut into; of more, those beyond are left out. Memory
# that is not used is not taken.
MOST_HOLDERS = 1 << 14
# The words of a holder: its place in the blocks, its face, the bits of the corners of weight 0, its two nodes, the
# parities of two paths, and that of the second where it is FREE; whether it is an arc of its cone, and then the two
# ways from which to which it goes, in order of the normal, as pairs.
PLACE, NUMBER, ZEROS, FIRST_NODE, SECOND_NODE, PATH, OTHER_PATH, FREE_PATH, _IS_ARC, FIRST_WAY = range(10)
SECOND_WAY, HOLDER_WORDS = FIRST_WAY + 6, FIRST_WAY + 12
# Then for each node: the place of a corner in that direction, its parent in the forest, and the parity to it.
NODE_PLACE, PARENT, PARITY, _NODE_WORDS = 0, 1, 2, 3
HOLDERS_WORDS = MOST_HOLDERS * (HOLDER_WORDS + 2 * _NODE_WORDS)
NO_NODE = -1
# Parities: crossed or not; FREE where the path ends on the cone itself; and no answer.
FREE, UNKNOWN = 2, -1


class Holders(NamedTuple):
    """Pointers to the words of holders and nodes."""

    holders: Any
    nodes: Any


@inlined
def make_holders(words):
    """``Holders`` in HOLDERS_WORDS int64."""
    return Holders(words, offset(words, MOST_HOLDERS * HOLDER_WORDS))


@inlined
def holder(holders, k, word):
    return load(holders.holders, k * HOLDER_WORDS + word)


@inlined
def put_holder(holders, k, word, value):
    store(holders.holders, k * HOLDER_WORDS + word, np.int64(value))


@inlined
def node(holders, k, word):
    return load(holders.nodes, k * _NODE_WORDS + word)


@inlined
def put_node(holders, k, word, value):
    store(holders.nodes, k * _NODE_WORDS + word, np.int64(value))


@kernel
def add_holder(holders, count, place, face, zeros):
    """Insert a face into the holders by its number, if there is room. Returns how many there are.

    In the order of the numbers, no answer depends on the order in which a tree lists them.
    """
    if count >= MOST_HOLDERS:
        return count
    k = count
    while k > 0 and holder(holders, k - 1, NUMBER) > face:
        for word in (PLACE, NUMBER, ZEROS):
            put_holder(holders, k, word, holder(holders, k - 1, word))
        k -= 1
    put_holder(holders, k, PLACE, place)
    put_holder(holders, k, NUMBER, face)
    put_holder(holders, k, ZEROS, zeros)
    put_holder(holders, count, _IS_ARC, 0)
    return count + 1


@inlined
def put_way(holders, k, word, a):
    """Write a vector of pairs to a holder."""
    for i in range(3):
        store(holders.holders, k * HOLDER_WORDS + word + 2 * i, np.float64(a[i][0]).view(np.int64))
        store(holders.holders, k * HOLDER_WORDS + word + 2 * i + 1, np.float64(a[i][1]).view(np.int64))


@inlined
def _number(holders, k, word):
    return np.int64(holder(holders, k, word)).view(np.float64)


@inlined
def way_of(holders, k, word):
    """A vector of pairs of a holder."""
    return (
        (_number(holders, k, word), _number(holders, k, word + 1)),
        (_number(holders, k, word + 2), _number(holders, k, word + 3)),
        (_number(holders, k, word + 4), _number(holders, k, word + 5)),
    )


@kernel
def put_arc(holders, k, i, first, second):
    """Make the k-th holder an arc of the i-th one's cone."""
    for word in (PLACE, NUMBER, ZEROS):
        put_holder(holders, k, word, holder(holders, i, word))
    put_holder(holders, k, _IS_ARC, 1)
    put_way(holders, k, FIRST_WAY, first)
    put_way(holders, k, SECOND_WAY, second)


@inlined
def _corner_of(zeros):
    """For a start on a corner, that corner: the one whose weight is not 0."""
    return 0 if zeros & 1 == 0 else (1 if zeros & 2 == 0 else 2)


@inlined
def _opposite(zeros):
    """For a start on an edge, the corner opposite to it: the one whose weight is 0."""
    return 0 if zeros & 1 != 0 else (1 if zeros & 2 != 0 else 2)


@inlined
def count_zeros(zeros):
    return (zeros & 1) + ((zeros >> 1) & 1) + ((zeros >> 2) & 1)


@inlined
def _after(k):
    return k + 1 if k < 2 else 0


@kernel
def name_nodes(tree, anchor, holders, count):
    """Name the ends of all cones. Two ends are one node if they are one corner, or if no other cone has them and they
    lie in one direction. Returns the number of nodes.
    """
    nodes = 0
    for k in range(count):
        zeros, place = holder(holders, k, ZEROS), holder(holders, k, PLACE)
        put_holder(holders, k, FIRST_NODE, NO_NODE)
        put_holder(holders, k, SECOND_NODE, NO_NODE)
        if zeros != 0:
            own = _corner_of(zeros) if count_zeros(zeros) == 2 else _opposite(zeros)
            first, second = _after(own), _after(_after(own))
            one, nodes = _named(tree, holders, nodes, place + 12 * first)
            put_holder(holders, k, FIRST_NODE, one)
            other, nodes = _named(tree, holders, nodes, place + 12 * second)
            put_holder(holders, k, SECOND_NODE, other)
    _join_ends(tree, anchor, holders, count, nodes)
    return nodes


@kernel
def _named(tree, holders, nodes, place):
    """The node of a corner, a new one if there is none, and the number of nodes. PARITY counts the ends there."""
    p = corner(tree, place)
    for k in range(nodes):
        q = corner(tree, node(holders, k, NODE_PLACE))
        if p[0] == q[0] and p[1] == q[1] and p[2] == q[2]:
            put_node(holders, k, PARITY, node(holders, k, PARITY) + 1)
            return k, nodes
    put_node(holders, nodes, NODE_PLACE, place)
    put_node(holders, nodes, PARITY, 1)
    return nodes, nodes + 1


@kernel
def _join_ends(tree, anchor, holders, count, nodes):
    """Join ends that only one cone has, if they lie in one direction, as where edges touch an edge."""
    for i in range(nodes):
        for j in range(i):
            alone = node(holders, i, PARITY) == 1 and node(holders, j, PARITY) == 1
            if alone and _one_direction(anchor, _node_corner(tree, holders, i), _node_corner(tree, holders, j)):
                for k in range(count):
                    for word in (FIRST_NODE, SECOND_NODE):
                        if holder(holders, k, word) == i:
                            put_holder(holders, k, word, j)


@inlined
def _node_corner(tree, holders, k):
    return corner(tree, node(holders, k, NODE_PLACE))


@kernel
def _one_direction(anchor, p, q):
    """Whether two points lie in one direction from the anchor."""
    a, b = _unit_way(anchor, p), _unit_way(anchor, q)
    return is_one_way(a, b, 2.0**-86 + 2.0**-94 * anchor.unit * (1.0 / _size(anchor, p) + 1.0 / _size(anchor, q)))


@inlined
def is_one_way(a, b, error):
    """Whether two vectors, of largest component 1 to 2, have one direction up to rounding."""
    return largest_component(heads(cross_pairs(a, b))) <= error and dot_pairs(a, b)[0] > 0.0


@inlined
def _size(anchor, p):
    return power_below(largest_component(heads(from_anchor(anchor, p, 1.0))))


@inlined
def _unit_way(anchor, p):
    """The vector to a point other than the anchor, scaled to a largest component from 1 to 2."""
    return from_anchor(anchor, p, 1.0 / _size(anchor, p))


class Cone(NamedTuple):
    """A holder as a cone: its face seen from the anchor, and two vectors in its plane, exact differences of corners.

    A plane contains all its directions x, a half-plane those with normal . (first x x) >= 0, and a sector only those of
    these with normal . (x x second) >= 0.

    kind  the number of corners of weight 0: 0 a plane, 1 a half-plane, 2 a sector
    """

    face: Any
    first: Any
    second: Any
    kind: int


@kernel
def cone_of(tree, anchor, holders, k):
    """The cone of the k-th holder."""
    place, zeros = holder(holders, k, PLACE), holder(holders, k, ZEROS)
    if holder(holders, k, _IS_ARC) != 0:
        return Cone(seen_from(tree, place, anchor), way_of(holders, k, FIRST_WAY), way_of(holders, k, SECOND_WAY), 2)
    kind = count_zeros(zeros)
    own = _corner_of(zeros) if kind == 2 else _opposite(zeros)
    p, q = corner(tree, place + 12 * own), corner(tree, place + 12 * _after(own))
    r = corner(tree, place + 12 * _after(_after(own)))
    if kind == 1:
        # Along the edge with the face to the left, and the way to the opposite corner.
        return Cone(seen_from(tree, place, anchor), _unit(r, q), _unit(p, q), kind)
    return Cone(seen_from(tree, place, anchor), _unit(q, p), _unit(r, p), kind)


@inlined
def _unit(a, b):
    """a - b of two corners as pairs, scaled by a power of two."""
    return scaled_difference(a, b, 1.0 / power_below(largest_component(sub(a, b))))


@kernel
def middle_of(cone, attempt):
    """A direction inside a cone, as pairs; a different one for each attempt."""
    share, other = 1.0 + (attempt & 3), 1.0 + (attempt >> 2)
    if cone.kind == 1:
        return _mixed(cone.first, cone.second, share - 2.5, other)
    return _mixed(cone.first, cone.second, share, other)


@kernel
def _mixed(a, b, s, t):
    """s a + t b."""
    s, t = (s, 0.0), (t, 0.0)
    return (
        plus(product(a[0], s), product(b[0], t)),
        plus(product(a[1], s), product(b[1], t)),
        plus(product(a[2], s), product(b[2], t)),
    )


@kernel
def within_cone(cone, x):
    """The place of a direction in the plane of a cone: 1 inside, 0 on its outline, -1 outside."""
    if cone.kind == 0:
        return 1
    s = turn_sign(cone.face, cone.first, x)
    if cone.kind == 1:
        return s
    e = turn_sign(cone.face, x, cone.second)
    if s < 0 or e < 0:
        return -1
    return 0 if s == 0 or e == 0 else 1


@kernel
def crosses(cone, x, y, side):
    """The parity of the path from x to y, both pairs: UNKNOWN if it touches the outline or x is in the cone's plane;
    FREE if y is on the cone. ``side`` is the sign of normal . y.
    """
    start = lean_sign(cone.face, x)
    if start == 0:
        return UNKNOWN
    if side == 0:
        return FREE if within_cone(cone, y) >= 0 else 0
    if start == side:
        return 0
    g, h = dot_pairs(cone.face.normal, x)[0], dot_pairs(cone.face.normal, y)[0]
    inside = _passes(cone, x, y, abs(g), abs(h))
    return UNKNOWN if inside == 0 else int(inside > 0)


@kernel
def _passes(cone, x, y, g, h):
    """``within_cone`` of h x + g y, where the path crosses the plane."""
    if cone.kind == 0:
        return 1
    s = _mixed_sign(cone.face, cone.first, x, y, g, h)
    if cone.kind == 1:
        return s
    e = -_mixed_sign(cone.face, cone.second, x, y, g, h)
    if s < 0 or e < 0:
        return -1
    return 0 if s == 0 or e == 0 else 1


@kernel
def _mixed_sign(face, a, x, y, g, h):
    """The sign of normal . (a x (h x + g y)), 0 where it is within rounding."""
    one, other = dot_pairs(face.normal, cross_pairs(a, x))[0], dot_pairs(face.normal, cross_pairs(a, y))[0]
    value = h * one + g * other
    size = (h * largest_component(heads(x)) + g * largest_component(heads(y))) * face.sides
    size *= largest_component(heads(a))
    # g and h are exact to 2^-53 of themselves, and so is each term.
    rounding = 2.0**-50 * (abs(h * one) + abs(g * other)) + size * 2.0**-90
    return 0 if abs(value) <= rounding else (1 if value > 0.0 else -1)

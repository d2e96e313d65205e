"""Whether a ray from the surface stays in the region in which it starts, and otherwise the face that stops it.

The cones of the faces that contain a start divide the sphere of directions into regions. Two directions are in one
region if no closed curve of arcs separates them, that is, if a path between them crosses every closed curve an even
number of times. This holds if the parities of its crossings are differences of one bit for each node (the cohomology of
the arcs, by Alexander's duality). A forest of the nodes with the parities to their parents decides it in one pass over
the arcs.
"""

from typing import Any, NamedTuple

import numpy as np

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.double_double import as_pairs, dot_pairs, heads
from renderer.numerics.vec3 import dot, normalized
from renderer.trace.starts.cone import (
    FIRST_NODE,
    FREE,
    FREE_PATH,
    NO_NODE,
    NUMBER,
    OTHER_PATH,
    PARENT,
    PARITY,
    PATH,
    SECOND_NODE,
    UNKNOWN,
    ZEROS,
    cone_of,
    crosses,
    holder,
    middle_of,
    node,
    put_holder,
    put_node,
    within_cone,
)
from renderer.trace.starts.meeting import lean_sign, slope_of

NOT_STOPPED = -1
# Hubs that are tried until none of the paths meets an outline.
ATTEMPTS = 16


@inlined
def hub_of(attempt):
    """A direction in general position, as pairs."""
    turn = 2.399963229728653 * (attempt + 1)
    height = 0.9428090415820634 - 0.1178511301977579 * attempt
    level = np.sqrt(1.0 - height * height)
    return as_pairs((level * np.cos(turn), height, level * np.sin(turn)))


@kernel
def path_to_cone(tree, anchor, holders, count, k, side, attempt, word):
    """Write the parities of the path from the hub to the k-th cone, on one side of its face. Returns whether it touches
    no outline.
    """
    hub, own = hub_of(attempt), cone_of(tree, anchor, holders, k)
    middle = middle_of(own, attempt)
    if lean_sign(own.face, hub) == 0:
        return False
    for j in range(count):
        cone = cone_of(tree, anchor, holders, j)
        if j == k:
            parity = int(lean_sign(own.face, hub) != side)
        elif lean_sign(cone.face, middle) != 0:
            parity = crosses(cone, hub, middle, lean_sign(cone.face, middle))
        else:
            parity = _parity_beside(cone, own, hub, middle, side)
        if parity == UNKNOWN:
            return False
        put_holder(holders, j, word, parity)
    return True


@kernel
def _parity_beside(cone, own, hub, middle, side):
    """The parity of the path from the hub to a direction in the plane of two cones."""
    where = within_cone(cone, middle)
    if where < 0:
        return 0
    faced = lean_sign(cone.face, hub)
    if where == 0 or not _lies_in_plane(cone.face, own) or faced == 0:
        return UNKNOWN
    return int(faced != (-side if _is_turned(cone.face, own) else side))


@inlined
def _lies_in_plane(face, cone):
    """Whether a face lies in the plane of a cone."""
    return lean_sign(face, cone.first) == 0 and lean_sign(face, cone.second) == 0


@inlined
def _is_turned(face, cone):
    """Whether the normals of a face and a cone in one plane are opposite."""
    return dot_pairs(face.normal, cone.face.normal)[0] < 0.0


@kernel
def _path_to_direction(tree, anchor, holders, count, d, attempt, word):
    """Write the parities of the path from the hub to a direction. Returns whether it touches no outline."""
    for j in range(count):
        cone = cone_of(tree, anchor, holders, j)
        parity = crosses(cone, hub_of(attempt), as_pairs(d), slope_of(cone.face, d))
        if parity == UNKNOWN:
            return False
        put_holder(holders, j, word, parity)
    return True


@kernel
def _root(holders, k):
    """The root of a node, and the parity to it."""
    parity = np.int64(0)
    while node(holders, k, PARENT) != k:
        parity ^= node(holders, k, PARITY)
        k = node(holders, k, PARENT)
    return k, parity


@kernel
def are_even(holders, count, nodes):
    """Whether the two paths together cross every closed curve of arcs an even number of times."""
    for k in range(nodes):
        put_node(holders, k, PARENT, k)
        put_node(holders, k, PARITY, 0)
    for j in range(count):
        end = holder(holders, j, OTHER_PATH)
        parity = holder(holders, j, PATH) ^ (holder(holders, j, FREE_PATH) if end == FREE else end)
        if holder(holders, j, FIRST_NODE) == NO_NODE:
            # A great circle.
            if parity != 0:
                return False
            continue
        one, first = _root(holders, holder(holders, j, FIRST_NODE))
        other, second = _root(holders, holder(holders, j, SECOND_NODE))
        odd = parity ^ first ^ second
        if one != other:
            put_node(holders, one, PARENT, other)
            put_node(holders, one, PARITY, odd)
        elif odd != 0:
            return False
    return True


@kernel
def _is_connected(tree, anchor, holders, count, nodes):
    """Whether the ends of both paths are in one region, or the second end is on its outline.

    A path that ends on an arc crosses it or not, depending on the side from which it comes. This includes arcs that
    coincide with it, but not others that touch it there.
    """
    for j in range(count):
        put_holder(holders, j, FREE_PATH, 0)
    if are_even(holders, count, nodes):
        return True
    for j in range(count):
        if holder(holders, j, OTHER_PATH) == FREE:
            for k in range(count):
                put_holder(holders, k, FREE_PATH, k == j or coincide(tree, anchor, holders, j, k))
            if are_even(holders, count, nodes):
                return True
    return False


@kernel
def _is_open(tree, anchor, holders, count, nodes, k, side, d):
    """Whether a direction is in the region beside the k-th cone."""
    for attempt in range(ATTEMPTS):
        if path_to_cone(tree, anchor, holders, count, k, side, attempt, PATH) and _path_to_direction(
            tree, anchor, holders, count, d, attempt, OTHER_PATH
        ):
            return _is_connected(tree, anchor, holders, count, nodes)
    # No path avoids all outlines: nothing is known to separate the two.
    return True


@kernel
def _bounds_region(tree, anchor, holders, count, nodes, k, side, j, facing):
    """Whether the region beside the k-th cone touches the j-th one on the side ``facing``."""
    for attempt in range(ATTEMPTS):
        if path_to_cone(tree, anchor, holders, count, k, side, attempt, PATH) and path_to_cone(
            tree, anchor, holders, count, j, facing, attempt, OTHER_PATH
        ):
            return _is_connected(tree, anchor, holders, count, nodes)
    return False


class Behind(NamedTuple):
    """The face behind a ray at its start: its number, the side of it that the ray is on, whether the ray came through
    it, and the pile of ``_arc_ahead``. If the side is known from a direction, that is ``back``.
    """

    face: int
    side: int
    through: bool
    pile: int
    has_back: bool
    back: Any


@kernel
def are_one_plane(tree, anchor, holders, count, face, d, slope):
    """Whether a start is inside all faces that contain it, ``face`` among them, and all lie in one plane and see the
    direction d on one side of it; ``slope`` is that of ``face``. Then the ray is stopped, by the lowest of them, where
    it leads to the side on which it does not start.
    """
    own = holder_of(holders, count, face)
    if own == NOT_STOPPED or holder(holders, own, ZEROS) != 0:
        return False
    if count == 1:
        return True
    cone, same = cone_of(tree, anchor, holders, own), True
    for k in range(count):
        same = same and (k == own or _is_same_plane(tree, anchor, holders, k, cone, d, slope))
    return same


@kernel
def _is_same_plane(tree, anchor, holders, k, cone, d, slope):
    """Whether the k-th face has the start inside it, lies in the plane of a cone, and sees d on the same side of it."""
    if holder(holders, k, ZEROS) != 0:
        return False
    face = cone_of(tree, anchor, holders, k).face
    return _lies_in_plane(face, cone) and slope_of(face, d) == (-slope if _is_turned(face, cone) else slope)


@kernel
def stopping_holder(tree, anchor, arcs, count, nodes, behind, d):
    """The arc that stops a ray at its start, or NOT_STOPPED; and whether it is the next of a pile.

    The ray starts in the region beside the arcs of a face, on one side of it. If these bound several regions, it is the
    one that contains ``back``, else any of them. If its direction d leads out of that region, the ray is stopped by the
    lowest face that bounds the region on one side only and has d behind it.
    """
    own, is_open = _own_arc(tree, anchor, arcs, count, nodes, behind, d, behind.has_back)
    if own == NOT_STOPPED:
        own, is_open = _own_arc(tree, anchor, arcs, count, nodes, behind, d, False)
    if own == NOT_STOPPED:
        return NOT_STOPPED, False
    if behind.through:
        ahead = _arc_ahead(tree, anchor, arcs, count, own, behind, d)
        if ahead != NOT_STOPPED:
            return ahead, True
    if is_open:
        return NOT_STOPPED, False
    last = np.int64(-1)
    while True:
        j = _next_face(arcs, count, last)
        if j == NOT_STOPPED:
            return NOT_STOPPED, False
        last = holder(arcs, j, NUMBER)
        facing = -slope_of(cone_of(tree, anchor, arcs, j).face, d)
        for k in range(count):
            # rule: bounds-one-side
            if (
                facing != 0
                and holder(arcs, k, NUMBER) == last
                and _bounds_region(tree, anchor, arcs, count, nodes, own, behind.side, k, facing)
                and not _bounds_region(tree, anchor, arcs, count, nodes, own, behind.side, k, -facing)
            ):
                return k, False


@kernel
def _own_arc(tree, anchor, arcs, count, nodes, behind, d, has_back):
    """An arc of the face behind a ray, beside which the ray is, and whether d is in a region beside one of them. With
    ``has_back`` only arcs beside which ``back`` is count; NOT_STOPPED for none.
    """
    own = NOT_STOPPED
    for k in range(count):
        if holder(arcs, k, NUMBER) == behind.face and (
            not has_back or _is_open(tree, anchor, arcs, count, nodes, k, behind.side, behind.back)
        ):
            if _is_open(tree, anchor, arcs, count, nodes, k, behind.side, d):
                return k, True
            own = k if own == NOT_STOPPED else own
    return own, False


@kernel
def _arc_ahead(tree, anchor, arcs, count, own, behind, d):
    """The next arc that coincides with the one behind a ray, which has just gone through it, or NOT_STOPPED.

    The ray reached the pile of coinciding faces at the face ``pile``. From there it crosses them in the order of their
    numbers, the lowest after the highest, if it leads to that side.
    """
    best = NOT_STOPPED
    if slope_of(cone_of(tree, anchor, arcs, own).face, d) != behind.side:
        return NOT_STOPPED
    for j in range(count):
        number = holder(arcs, j, NUMBER)
        sooner = best == NOT_STOPPED or _is_after(holder(arcs, best, NUMBER), number, behind.pile)
        # rule: coincident-order
        if _is_after(number, behind.face, behind.pile) and sooner and coincide(tree, anchor, arcs, own, j):
            best = j
    return best


@inlined
def _is_after(face, other, pile):
    """Whether a face comes after another one in the order of a pile."""
    turned, other_turned = face < pile, other < pile
    return face > other if turned == other_turned else turned


@inlined
def holder_of(holders, count, face):
    """The holder with the number ``face``."""
    own = NOT_STOPPED
    for k in range(count):
        if holder(holders, k, NUMBER) == face:
            own = k
    return own


@inlined
def _next_face(holders, count, last):
    """The holder of the lowest face after ``last``."""
    found = NOT_STOPPED
    for j in range(count):
        if holder(holders, j, NUMBER) > last:
            found = _lower(holders, found, j)
    return found


@inlined
def _lower(holders, k, j):
    """The one of two holders whose face has the lower number; k may be NOT_STOPPED."""
    return j if k == NOT_STOPPED or holder(holders, j, NUMBER) < holder(holders, k, NUMBER) else k


@kernel
def coincide(tree, anchor, holders, k, j):
    """Whether the j-th holder's cone lies in the plane of the k-th one and the k-th one contains its middle."""
    own, cone = cone_of(tree, anchor, holders, k), cone_of(tree, anchor, holders, j)
    if not _lies_in_plane(cone.face, own):
        return False
    for attempt in range(ATTEMPTS):
        where = within_cone(cone, middle_of(own, attempt))
        if where != 0:
            return where > 0
    return False


@kernel
def bounding_holder(tree, anchor, arcs, count, nodes, n, face):
    """The arc that bounds the region with direction n, and its side: an arc of ``face`` if one does, else the one that
    n crosses most steeply, lower ones first. NOT_STOPPED for none. If n lies along faces, it is on the side of the
    normal of the lowest.
    """
    along = _arc_along(tree, anchor, arcs, count, n)
    if along != NOT_STOPPED:
        return _of_face(tree, anchor, arcs, count, nodes, along, 1, face)
    most, last = np.inf, NOT_STOPPED
    for _ in range(count):
        most, last = _next_across(tree, anchor, arcs, count, n, most, last)
        own = slope_of(cone_of(tree, anchor, arcs, last).face, n)
        for side in (own, -own) if own != 0 else (1, -1):
            if _is_open(tree, anchor, arcs, count, nodes, last, side, n):
                return _of_face(tree, anchor, arcs, count, nodes, last, side, face)
    return NOT_STOPPED, 0


@kernel
def _arc_along(tree, anchor, arcs, count, n):
    """The arc of the lowest face on which a direction lies, or NOT_STOPPED."""
    found = NOT_STOPPED
    for k in range(count):
        cone = cone_of(tree, anchor, arcs, k)
        if slope_of(cone.face, n) == 0 and within_cone(cone, as_pairs(n)) >= 0:
            found = _lower(arcs, found, k)
    return found


@kernel
def _of_face(tree, anchor, arcs, count, nodes, k, side, face):
    """An arc of a face beside the region of another arc, and its side; that other arc if there is none."""
    for j in range(count):
        if holder(arcs, j, NUMBER) == face:
            for facing in (1, -1):
                if _bounds_region(tree, anchor, arcs, count, nodes, k, side, j, facing):
                    return j, facing
    return k, side


@kernel
def _next_across(tree, anchor, arcs, count, n, most, last):
    """The arc that n crosses most steeply after the arc ``last``, whose product is ``most``; and its product."""
    best, found = -1.0, NOT_STOPPED
    for k in range(count):
        across = abs(dot(normalized(heads(cone_of(tree, anchor, arcs, k).face.normal)), n))
        after = across < most or (across == most and _comes_after(arcs, k, last))
        if after and (across > best or (across == best and _comes_after(arcs, found, k))):
            best, found = across, k
    return best, found


@inlined
def _comes_after(arcs, k, j):
    """Whether an arc is of a higher face than another, or later in the list."""
    number, other = holder(arcs, k, NUMBER), holder(arcs, j, NUMBER)
    return number > other or (number == other and k > j)

"""A proof that no face of a mesh enters the open convex hull of two convex polygons, so that they see each other whole.

Haines and Wallace, Shaft culling for efficient ray-traced radiosity, 1991, have planes around two boxes. Here the
planes are around both polygons, and a face that no plane keeps out is tried by its own plane and by the cross products
of its edges with those of the hull: two convex bodies that do not overlap are parted along one of these directions.

Along any direction, all corners of the hull lie below the farthest, so no choice of planes makes the proof wrong.

Corners are known to some roundings of the largest coordinate only, for instance those of a room that was turned. So a
face may enter by as much: by moves of that size the corners come to where the proof is right. Where a plane leans on a
short base, it may tilt by more, and the face may enter by more. A face beside a polygon, in its plane, could hide all
of it by such an entry; it must lie beside it, see ``_covers``.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.simd import (
    load,
    load8,
    maximum,
    minimum,
    movemask,
    offset,
    splat4,
    store,
    widen,
)
from renderer.numerics.vec3 import cross, dot, largest_of_three, put3, row3, scale, sub
from renderer.trace.edge_signs import corners_at
from renderer.trace.intersect import face_in, load_corners
from renderer.trace.layout import BLOCK_FACES, BLOCK_WORDS
from renderer.trace.walk import boxes_of, walk

# Errors of coordinates, as shares of the largest: a turned corner has three products and two sums; a difference, its
# product with a normal and their sum have some more.
ROUNDING = 16.0 * 2.0**-53
# The most that a face may enter, as a share of the polygons' least width, whatever the base of the plane.
_DEEPEST = 2.0**-24
# How much wider than that a hull must be along a direction, to be parted from a face along it.
_WIDTH = 2.0**16
# A face whose corners are all so near a polygon's plane, as a share of the hull, might hide all of the polygon. Others
# lean over it, and of what enters by rounding, no more than that by this share lies over it.
_BESIDE = 2.0**-10
# The squared sine of the angle of edges that give no direction.
_PARALLEL = 2.0**-80
# The numbers of a plane: the normal, how far the hull reaches along it, and how far a face may enter.
PLANE = 5
# All planes of two quadrilaterals: two of their own, 32 through an edge and a corner, six of the box.
MOST_PLANES = 40


class Shaft(NamedTuple):
    """Two polygons and the planes around their hull, in the tree's units and relative to ``origin``.

    corners        ``pointer`` to the n corners of the first polygon and the m of the second, in one row
    normals        ``pointer`` to the unit normals of both
    planes         ``pointer`` to ``count`` rows of PLANE numbers; those of both polygons come first
    size           the largest distance of corners along an axis
    width          the least width of both polygons
    largest        the largest coordinate of the corners, not relative to the origin
    strict         how far beyond a plane a box lies for certain
    face_a, face_b the faces of the polygons
    """

    corners: Any
    n: int
    m: int
    normals: Any
    planes: Any
    count: int  # type: ignore[assignment]  # tuples have a method of that name
    origin: tuple[float, float, float]
    size: float
    width: float
    largest: float
    strict: float
    face_a: int
    face_b: int


class Triangle(NamedTuple):
    """A face's corners relative to the origin, and how much coarser they are than the polygons' for their size."""

    a: tuple[float, float, float]
    b: tuple[float, float, float]
    c: tuple[float, float, float]
    coarser: float


class _Axis(NamedTuple):
    """A unit direction, and how far faces may enter along it; 0 where it is none."""

    way: tuple[float, float, float]
    room: float


class _Rows(NamedTuple):
    """The order of the axes in a block, for ``load_corners``."""

    row_x: Any
    row_y: Any
    row_z: Any


# --- planes -------------------------------------------------------------------------------------------------------


@kernel
def with_planes(shaft):
    """The ``Shaft`` with its planes, of which it had none; with none if the polygons' own planes part nothing."""
    corners, n, total = shaft.corners, shaft.n, shaft.n + shaft.m
    count = np.int64(0)
    for k in range(2):
        # The hull lies before both.
        normal = scale(row3(shaft.normals, k), -1.0)
        count = _add(shaft, count, _Axis(normal, _room(shaft, shaft.size / shaft.width)))
    if count < 2:
        return _counted(shaft, np.int64(0))
    for axis in range(3):
        for sign in (1.0, -1.0):
            way = (sign if axis == 0 else 0.0, sign if axis == 1 else 0.0, sign if axis == 2 else 0.0)
            count = _add(shaft, count, _Axis(way, _room(shaft, 0.0)))
    for k in range(total):
        begin, end = (0, n) if k < n else (n, total)
        p, q = row3(corners, k), row3(corners, k + 1 if k + 1 < end else begin)
        for other in range(n if k < n else 0, total if k < n else n):
            axis = _axis(shaft, sub(q, p), sub(row3(corners, other), p))
            count = _add_facet(shaft, count, axis, p)
    return _counted(shaft, count)


@inlined
def _counted(shaft, count):
    return Shaft(
        shaft.corners, shaft.n, shaft.m, shaft.normals, shaft.planes, count, shaft.origin, shaft.size, shaft.width,
        shaft.largest, shaft.strict, shaft.face_a, shaft.face_b,
    )  # fmt: skip


@inlined
def _room(shaft, lever):
    """The depth to which a face may enter through a plane whose base is so many times shorter than the hull."""
    return minimum(ROUNDING * shaft.largest * (1.0 + lever), _DEEPEST * shaft.width)


@kernel
def _axis(shaft, a, b):
    """The direction across two vectors."""
    normal, squares = cross(a, b), dot(a, a) * dot(b, b)
    square = dot(normal, normal)
    if not square > _PARALLEL * squares:
        return _Axis(normal, 0.0)
    length = math.sqrt(square)
    lever = shaft.size * (math.sqrt(dot(a, a)) + math.sqrt(dot(b, b))) / length
    return _Axis(scale(normal, 1.0 / length), _room(shaft, lever))


@kernel
def _reach(corners, count, way):
    """The largest coordinate of the first ``count`` corners along a direction."""
    most = -np.inf
    for k in range(count):
        most = maximum(most, dot(row3(corners, k), way))
    return most


@kernel
def _add_facet(shaft, count, axis, p):
    """Add the plane through a point if all corners lie on one side of it."""
    if axis.room == 0.0:
        return count
    total, height, back = shaft.n + shaft.m, dot(axis.way, p), scale(axis.way, -1.0)
    if _reach(shaft.corners, total, axis.way) <= height + axis.room:
        return _add(shaft, count, axis)
    if _reach(shaft.corners, total, back) <= axis.room - height:
        return _add(shaft, count, _Axis(back, axis.room))
    return count


@kernel
def _add(shaft, count, axis):
    """Add the plane at which the hull ends along a direction, if the hull is wide along it. Returns the new count."""
    total = shaft.n + shaft.m
    high, low = _reach(shaft.corners, total, axis.way), -_reach(shaft.corners, total, scale(axis.way, -1.0))
    if not high - low >= _WIDTH * axis.room:
        return count
    plane = offset(shaft.planes, PLANE * count)
    put3(plane, 0, axis.way)
    store(plane, 3, high)
    store(plane, 4, axis.room)
    return count + 1


# --- the search ---------------------------------------------------------------------------------------------------


@kernel
def is_clear(tree, stack, shaft):
    """Whether it is proven that no face but the two enters the hull."""
    return shaft.count > 0 and walk(tree, stack, shaft, np.int64(0), _enter, _visit) == 0


@inlined
def _enter(tree, shaft, node, found):
    nodes, base = boxes_of(tree, node)
    return found, _boxes_within(nodes, base, shaft)


@inlined
def _boxes_within(nodes, base, shaft):
    """The bits of the octants of a node that no plane keeps wholly out."""
    within = np.int64(0)
    for axis in range(3):
        # Empty octants, from inf to -inf.
        within |= movemask(load8(nodes, base + 16 * axis) <= load8(nodes, base + 16 * axis + 8))
    for k in range(shaft.count):
        plane = offset(shaft.planes, PLANE * k)
        x, y, z = row3(plane, 0)
        # The corner of each box that lies deepest.
        low_x = widen(load8(nodes, base + (0 if x > 0.0 else 8))) - shaft.origin[0]
        low_y = widen(load8(nodes, base + (16 if y > 0.0 else 24))) - shaft.origin[1]
        low_z = widen(load8(nodes, base + (32 if z > 0.0 else 40))) - shaft.origin[2]
        beyond = load(plane, 3) + load(plane, 4) + shaft.strict
        within &= ~movemask(low_x * x + low_y * y + low_z * z > beyond)
        if within == 0:
            break
    return within


@inlined
def _visit(tree, shaft, first, count, found):
    for block in range(first, first + count):
        bits = _faces_within(tree, block * BLOCK_WORDS, shaft)
        if bits != 0 and _some_enter(tree, block, bits, shaft):
            return np.int64(1), True
    return found, False


@inlined
def _faces_within(tree, base, shaft):
    """The bits of a block's faces that no plane keeps out for certain; also those of its unused places."""
    x0, x1, x2, y0, y1, y2, z0, z1, z2 = load_corners(tree, base, _Rows(0, 4, 8))
    ox, oy, oz = shaft.origin
    x0, x1, x2, y0, y1, y2, z0, z1, z2 = x0 - ox, x1 - ox, x2 - ox, y0 - oy, y1 - oy, y2 - oy, z0 - oz, z1 - oz, z2 - oz
    within = np.int64(15)
    for k in range(shaft.count):
        plane = offset(shaft.planes, PLANE * k)
        x, y, z = row3(plane, 0)
        beyond = splat4(load(plane, 3) + load(plane, 4) + shaft.strict)
        out = (x0 * x + y0 * y + z0 * z > beyond) & (x1 * x + y1 * y + z1 * z > beyond)
        within &= ~movemask(out & (x2 * x + y2 * y + z2 * z > beyond))
        if within == 0:
            break
    return within


@kernel
def _some_enter(tree, block, bits, shaft):
    """Whether one of four faces, of those in ``bits``, is not proven to stay outside."""
    for i in range(BLOCK_FACES):
        face = face_in(tree, block * BLOCK_FACES + i)
        if (bits >> i) & 1 == 0 or face < 0 or face == shaft.face_a or face == shaft.face_b:
            continue
        a, b, c = corners_at(tree, block * BLOCK_WORDS + i)
        coarser = maximum(1.0, largest_of_three(a, b, c) / shaft.largest)
        o = shaft.origin
        if not _is_outside(shaft, Triangle(sub(a, o), sub(b, o), sub(c, o), coarser)):
            return True
    return False


# --- one face -----------------------------------------------------------------------------------------------------


@kernel
def _is_outside(shaft, face):
    """Whether a face is proven to stay outside the hull."""
    if _covers(shaft, face, 0) or _covers(shaft, face, 1):
        return False
    for k in range(shaft.count):
        plane = offset(shaft.planes, PLANE * k)
        if _least(face, row3(plane, 0)) >= load(plane, 3) - _room_for(shaft, load(plane, 4), face):
            return True
    edge, other = sub(face.b, face.a), sub(face.c, face.a)
    if _parts(shaft, face, _axis(shaft, edge, other)):
        return True
    return _is_parted(shaft, face, edge) or _is_parted(shaft, face, other) or _is_parted(shaft, face, sub(edge, other))


@kernel
def _is_parted(shaft, face, edge):
    """Whether a direction across one of the face's edges and one of the hull's parts them."""
    total = shaft.n + shaft.m
    for k in range(total):
        p = row3(shaft.corners, k)
        for other in range(k + 1, total):
            if _parts(shaft, face, _axis(shaft, edge, sub(row3(shaft.corners, other), p))):
                return True
    return False


@kernel
def _parts(shaft, face, axis):
    """Whether the hull, wide along a direction, and the face lie apart along it."""
    if axis.room == 0.0:
        return False
    room = _room_for(shaft, axis.room, face)
    return _lie_apart(shaft.corners, shaft.n + shaft.m, face, axis.way, room)


@kernel
def _lie_apart(corners, count, face, way, room):
    """Whether corners and a face lie apart along a direction, along which the corners are wide."""
    back = scale(way, -1.0)
    high, low = _reach(corners, count, way), -_reach(corners, count, back)
    return high - low >= _WIDTH * room and (_least(face, way) >= high - room or -_least(face, back) <= low + room)


@inlined
def _room_for(shaft, room, face):
    """The depth to which a face may enter that is coarser than the polygons."""
    return minimum(room * face.coarser, _DEEPEST * shaft.width)


@inlined
def _least(face, way):
    """The least coordinate of a face's corners along a direction."""
    return minimum(dot(face.a, way), minimum(dot(face.b, way), dot(face.c, way)))


@kernel
def _covers(shaft, face, which):
    """Whether a face touches one polygon's plane, is near it, not behind it, and may lie over the polygon."""
    first = shaft.n if which == 1 else 0
    polygon, count = offset(shaft.corners, 3 * first), shaft.m if which == 1 else shaft.n
    normal = row3(shaft.normals, which)
    height = dot(normal, row3(polygon, 0))
    low, high = _least(face, normal) - height, -_least(face, scale(normal, -1.0)) - height
    # More than a face may enter along any direction.
    room, near = _DEEPEST * shaft.width, _BESIDE * shaft.size
    if high < -room or high > near or low < -near or low > room:
        return False
    # In the plane, the edges of both give all directions that part them.
    for k in range(count):
        edge = sub(row3(polygon, k + 1 if k + 1 < count else 0), row3(polygon, k))
        if _lies_beside(shaft, polygon, count, face, edge, normal):
            return False
    edge, other = sub(face.b, face.a), sub(face.c, face.a)
    return not (
        _lies_beside(shaft, polygon, count, face, edge, normal)
        or _lies_beside(shaft, polygon, count, face, other, normal)
        or _lies_beside(shaft, polygon, count, face, sub(edge, other), normal)
    )


@kernel
def _lies_beside(shaft, polygon, count, face, edge, normal):
    """Whether a polygon and a face lie on either side of an edge, seen along a normal."""
    axis = _axis(shaft, edge, scale(normal, shaft.size))
    return axis.room > 0.0 and _lie_apart(polygon, count, face, axis.way, _room_for(shaft, axis.room, face))

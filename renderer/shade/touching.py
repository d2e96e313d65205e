"""Marks the faces that may coincide with one that transmits light; kernels look closer only at those.

They are found once for a scene. Marking too many costs only time.
"""

from typing import Any, NamedTuple

import numpy as np

from renderer.jit.decorators import inlined, kernel
from renderer.materials.registry import lets_through
from renderer.numerics.simd import (
    fabs,
    lowest_bit,
    maximum,
    minimum,
    movemask,
    pointer,
    splat4,
    store,
)
from renderer.numerics.vec3 import largest_of_three, length, sub
from renderer.shade.surface import material_of, scene_pointers
from renderer.trace.edge_signs import corner
from renderer.trace.intersect import face_in, load_corners
from renderer.trace.layout import BLOCK_FACES, BLOCK_WORDS
from renderer.trace.leaf import octants_around
from renderer.trace.starts.level import CORNER_ERROR, plane_of
from renderer.trace.trees import tree_pointers
from renderer.trace.walk import walk

# The share of a face's coordinates by which its box grows.
_ROOM = 2.0**-45
# Of the product of two vectors in the plane, only rounding.
_EDGE_ERROR = 2.0**-50


@kernel
def mark_touching(descriptor, arrays, begin, end, every, stack, touching):
    """Mark the faces in some places of blocks that transmit light, or all, and that may coincide with another face;
    mark that face too.
    """
    tree, scene = tree_pointers(descriptor), scene_pointers(arrays)
    for slot in range(begin, end):
        face = face_in(tree, slot)
        if face >= 0 and (every or lets_through(scene.materials, material_of(scene, face))):
            _mark_touched(tree, scene, slot, face, pointer(stack), pointer(touching))


@inlined
def _corners(tree, slot):
    """The corners of the face in a place of a block."""
    place = slot // BLOCK_FACES * BLOCK_WORDS + slot % BLOCK_FACES
    return corner(tree, place), corner(tree, place + 12), corner(tree, place + 24)


@inlined
def _range(corners, k):
    """The least and largest coordinate of a face along an axis."""
    a, b, c = corners[0][k], corners[1][k], corners[2][k]
    return minimum(a, minimum(b, c)), maximum(a, maximum(b, c))


class _Flat(NamedTuple):
    """A face: its corners, its normal and the length of that, twice its longest side, its largest coordinate, and the
    room by which its box grows.
    """

    corners: Any
    normal: Any
    size: float
    side: float
    largest: float
    room: float


@inlined
def _flat_at(tree, slot):
    """The ``_Flat`` in a place of a block."""
    p0, p1, p2 = corners = _corners(tree, slot)
    n, side = plane_of(corners)
    largest = largest_of_three(p0, p1, p2)
    return _Flat(corners, n, length(n), side, largest, _ROOM * largest)


@inlined
def _box_of(flat):
    """The lowest and the highest corner of a face's box, grown by its room."""
    (x0, x1), (y0, y1), (z0, z1) = _range(flat.corners, 0), _range(flat.corners, 1), _range(flat.corners, 2)
    room = flat.room
    return (x0 - room, y0 - room, z0 - room), (x1 + room, y1 + room, z1 + room)


class _Query(NamedTuple):
    """The search for faces that coincide with one: its ``_Flat``, its number, the corners of its grown box, the scene,
    and a pointer to the marks.
    """

    flat: Any
    face: int
    low: tuple
    high: tuple
    scene: Any
    touching: Any


@kernel
def _mark_touched(tree, scene, slot, face, stack, touching):
    """Mark the face in a place and those that may coincide with it."""
    flat = _flat_at(tree, slot)
    low, high = _box_of(flat)
    walk(tree, stack, _Query(flat, face, low, high, scene, touching), np.int64(0), _enter, _mark_touched_in)


@inlined
def _enter(tree, query, node, found):
    return found, octants_around(tree, node, query.low, query.high)


@inlined
def _mark_touched_in(tree, query, first, blocks, found):
    """Mark the face and the faces of some blocks that may coincide with it; the search continues."""
    for block in range(first, first + blocks):
        bits = _level_bits(tree, block * BLOCK_WORDS, query.flat)
        while bits != 0:
            slot = block * BLOCK_FACES + lowest_bit(bits)
            bits &= bits - 1
            other = face_in(tree, slot)
            if other >= 0 and other != query.face and _may_coincide(query.flat, _corners(tree, slot)):
                _mark(query, query.face)
                _mark(query, other)
    return found, False


@inlined
def _mark(query, face):
    ways = query.scene.ways
    store(query.touching, ways.row(query.scene, ways.at(query.scene, face)), np.uint8(1))


class _Axes(NamedTuple):
    """The order of axes in which ``load_corners`` gives coordinates, as rows of a block's corner."""

    row_x: int
    row_y: int
    row_z: int


@inlined
def _level_bits(tree, base, flat):
    """The bits of the faces of a block that lie in the plane of a face, or nearly so."""
    x0, x1, x2, y0, y1, y2, z0, z1, z2 = load_corners(tree, base, _Axes(0, 4, 8))
    return _level_corners(flat, x0, y0, z0) & _level_corners(flat, x1, y1, z1) & _level_corners(flat, x2, y2, z2)


@inlined
def _level_corners(flat, x, y, z):
    """The bits of four corners that lie in the plane of a face, or nearly so."""
    p, n = flat.corners[0], flat.normal
    x, y, z = x - splat4(p[0]), y - splat4(p[1]), z - splat4(p[2])
    height = x * splat4(n[0]) + y * splat4(n[1]) + z * splat4(n[2])
    # As ``level.are_level`` has it, with room to spare.
    way = maximum(fabs(x), maximum(fabs(y), fabs(z)))
    error = splat4(2.0 * CORNER_ERROR) * (splat4(flat.largest) + way)
    return movemask(fabs(height) <= error * (splat4(flat.size) + splat4(flat.side) * way))


@kernel
def _may_coincide(flat, q):
    """Whether a face in the plane of another overlaps its box, and no side of either separates them."""
    p, (x, y, z) = flat.corners, flat.normal
    for k in range(3):
        (low, high), (least, most) = _range(p, k), _range(q, k)
        if least > high + flat.room or low > most + flat.room:
            return False
    x, y, z = abs(x), abs(y), abs(z)
    axis = 0 if x >= y and x >= z else (1 if y >= z else 2)
    return not (_has_beyond(p, q, axis) or _has_beyond(q, p, axis))


@inlined
def _flat(a, axis):
    """The two components of a vector beside an axis."""
    return (a[1], a[2]) if axis == 0 else ((a[2], a[0]) if axis == 1 else (a[0], a[1]))


@kernel
def _turn(a, b, c, axis):
    """Twice the area of a triangle seen along an axis, and the bound of its rounding."""
    (x, y), (s, t) = _flat(sub(b, a), axis), _flat(sub(c, a), axis)
    return x * t - y * s, _EDGE_ERROR * (abs(x * t) + abs(y * s))


@kernel
def _has_beyond(p, q, axis):
    """Whether a face has a side with all of the other face beyond it."""
    around = _turn(p[0], p[1], p[2], axis)[0]
    for k in range(3):
        a, b = (p[0], p[1]) if k == 0 else ((p[1], p[2]) if k == 1 else (p[2], p[0]))
        beyond = True
        for c in q:
            turn, error = _turn(a, b, c, axis)
            beyond = beyond and (turn <= error if around >= 0.0 else turn >= -error)
        if beyond:
            return True
    return False

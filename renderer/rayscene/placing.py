"""Places meshes: the record of each instance that ``trace.instances`` reads, and the boxes around what is placed."""

import numpy as np

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.double_double import power_below
from renderer.numerics.simd import (
    double_of,
    float64_pointer,
    int64_pointer,
    load,
    load8,
    local_floats,
    maximum,
    offset,
    pointer,
    reduce_max,
    reduce_min,
    store,
)
from renderer.numerics.vec3 import cross, dot
from renderer.octree import LARGEST
from renderer.trace.instances import (
    DISTANCE_ROOM,
    FIRST_FACE,
    FLAGS,
    HALF,
    INSTANCE_WORDS,
    INVERSE,
    MATRIX,
    MIDDLE,
    MIRRORS,
    OBJECT,
    PLACE,
    ROOM,
    column_of,
    corners_of_scene_face,
    instance_with,
    place_boxes,
    scene_pointers,
)
from renderer.trace.layout import SCALE
from renderer.tree.bounds import BOX, FACE

# The most that the product of a matrix and its inverse may differ from 1. Beyond that a ray turned into the mesh's
# frame would miss its boxes by more than the width of a face.
SINGULAR = 2.0**-20
# The largest component of a matrix and of its inverse, in units in which the mesh's coordinates are near 1: boxes, and
# rays turned into the mesh's frame, are float32 and neither overflow nor lose digits.
STEEPEST = 2.0**120
# Roundings of a placed corner, of the placed middle and of the inverse, eight each and room.
_ROUNDED = 2.0**-48


@kernel
def place(matrices, instances, words, begin, end):
    """Write matrix, inverse, place, room and the flag of mirrors of the instances begin:end, whose objects are written.

    ``matrices`` (k, 3, 4) float64; ``instances`` (k, INSTANCE_WORDS) float64 and ``words`` are the same memory. Returns
    the first one whose matrix is singular or nearly so, whose coordinates are too large, or whose factors are too large
    or too small; or -1.
    """
    for i in range(begin, end):
        record, flags = offset(pointer(instances), i * INSTANCE_WORDS), offset(pointer(words), i * INSTANCE_WORDS)
        if not _place_one(offset(pointer(matrices), 12 * i), record, flags):
            return i
    return -1


@kernel
def _place_one(matrix, record, words):
    address = load(words, OBJECT)
    numbers, own = int64_pointer(address), float64_pointer(address)
    unit = 1.0 / double_of(load(numbers, SCALE))
    largest = 0.0
    for k in range(3):
        for j in range(3):
            number = load(matrix, 4 * k + j) * unit
            largest = maximum(largest, abs(number))
            store(record, MATRIX + 4 * k + j, number)
        store(record, MATRIX + 4 * k + 3, load(matrix, 4 * k + 3))
    if not 0.0 < largest < np.inf:
        return False
    shrink = 1.0 / power_below(largest)
    x, y, z = column_of(record, 0, shrink), column_of(record, 1, shrink), column_of(record, 2, shrink)
    a, b, c = cross(y, z), cross(z, x), cross(x, y)
    determinant = dot(x, a)
    if determinant == 0.0:
        return False
    _put_row(record, 0, a, shrink / determinant)
    _put_row(record, 1, b, shrink / determinant)
    _put_row(record, 2, c, shrink / determinant)
    mirrors = np.int64(MIRRORS) if determinant < 0.0 else np.int64(0)
    store(words, FLAGS, (load(words, FLAGS) & ~np.int64(MIRRORS)) | mirrors)
    return _put_room(record, own)


@inlined
def _put_row(record, k, row, factor):
    for j in range(3):
        store(record, INVERSE + 3 * j + k, row[j] * factor)


@kernel
def _put_room(record, own):
    """Write the placed middle, and how far rounding may move what is placed, in the mesh's units.

    A point p of the mesh, placed at x, comes back at p + E (p - middle) + inverse times the rounding of x, where E is
    the inverse times the matrix, less 1. Beside that, a hit may be DISTANCE_ROOM of its distance beside its face: that
    of the middle counts with the ray, that of the face from the middle here. Returns whether E, all coordinates and all
    factors are small enough.
    """
    far, matrix, inverse = 0.0, offset(record, MATRIX), offset(record, INVERSE)
    for k in range(3):
        place, reach = load(matrix, 4 * k + 3), 0.0
        for j in range(3):
            place += load(matrix, 4 * k + j) * load(own, MIDDLE + j)
            reach += abs(load(matrix, 4 * k + j)) * load(own, HALF + j)
        store(record, PLACE + k, place)
        far = maximum(far, reach)
        # False for NaN too.
        if not (abs(place) + reach <= LARGEST and _size(matrix, own, k) <= STEEPEST):
            return False
    worst = 0.0
    for k in range(3):
        room = 0.0
        for j in range(3):
            if not maximum(abs(load(matrix, 4 * k + j)), abs(load(inverse, 3 * j + k))) <= STEEPEST:
                return False
            off, size = -1.0 if j == k else 0.0, 0.0
            for n in range(3):
                off += load(inverse, 3 * n + k) * load(matrix, 4 * n + j)
                size += abs(load(inverse, 3 * n + k) * load(matrix, 4 * n + j))
            worst = maximum(worst, abs(off))
            room += (abs(off) + size * _ROUNDED) * load(own, HALF + j)
            room += abs(load(inverse, 3 * j + k)) * (far * DISTANCE_ROOM + _size(matrix, own, j) * _ROUNDED)
        store(record, ROOM + k, room)
    return worst <= SINGULAR


@inlined
def _size(matrix, own, k):
    """The largest sum of which a placed coordinate is made, without signs."""
    size = abs(load(matrix, 4 * k + 3))
    for j in range(3):
        size += abs(load(matrix, 4 * k + j)) * (abs(load(own, MIDDLE + j)) + load(own, HALF + j))
    return size


@kernel
def box_all(instances, words, numbers, boxes, box_numbers):
    """Write the boxes around the instances with these numbers, and their numbers, as ``bounds`` has those of faces."""
    rows = local_floats()
    for i in range(len(numbers)):
        at, base = numbers[i] * INSTANCE_WORDS, i * BOX
        place_boxes(offset(pointer(instances), at), offset(pointer(words), at), np.int64(0), rows)
        for k in range(3):
            boxes[base + k] = reduce_min(load8(rows, 16 * k))
            boxes[base + 4 + k] = -reduce_max(load8(rows, 16 * k + 8))
        box_numbers[base + FACE] = i
        boxes[base + 7] = 0.0


@kernel
def locate(words, members, faces, weights, located, swapped, begin, end):
    """Write object, instance and face of the faces begin:end of a scene to ``located`` (3, k) int64, -1 for -1.

    words     (n, INSTANCE_WORDS) int64, the instances
    members   (m, 2) int64, the first instance of each object and its number, and the number of instances last
    weights   (2, k) float64, u and v on the placed face; ``swapped`` gets them on the face of the object's mesh, of
              which a matrix that mirrors has swapped the second and third corner
    """
    for i in range(begin, end):
        u, v = weights[0, i], weights[1, i]
        located[0, i], located[1, i], located[2, i] = -1, -1, -1
        if faces[i] >= 0:
            k = instance_with(pointer(words), len(words), faces[i]) - 1
            m = _member_with(members, k)
            located[0, i], located[1, i], located[2, i] = (
                members[m, 1],
                k - members[m, 0],
                faces[i] - words[k, FIRST_FACE],
            )
            if words[k, FLAGS] & MIRRORS != 0:
                u, v = v, u
        swapped[0, i], swapped[1, i] = u, v


@kernel
def _member_with(members, instance):
    low, high = 0, len(members) - 2
    while low < high:
        middle = (low + high + 1) // 2
        if members[middle, 0] <= instance:
            low = middle
        else:
            high = middle - 1
    return low


@kernel
def corners_of_faces(descriptor, faces, corners):
    """Write the placed corners (k, 3, 3) of faces of a scene."""
    scene = scene_pointers(descriptor)
    for i in range(len(faces)):
        p0, p1, p2 = corners_of_scene_face(scene, faces[i])
        for k in range(3):
            corners[i, 0, k], corners[i, 1, k], corners[i, 2, k] = p0[k], p1[k], p2[k]

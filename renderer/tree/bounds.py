"""The boxes of faces that the build sorts, and operations on boxes."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.simd import extract, load8, select, splat8, store
from renderer.trace.intersect import face_range

# A box is eight 32-bit words: lower x, y, z, a face, and the negated upper x, y, z, and an unused one. The upper corner
# is negated so that one vector minimum is the union of two boxes. The face is the int32 number of the face whose box it
# is; in a union of boxes it means nothing.
BOX = 8
FACE = 3


class Faces(NamedTuple):
    """The faces being sorted.

    boxes    (F * BOX,) float32, one box per face, which moves with it
    numbers  the same memory as int32
    spare    (F * BOX,) float32, scratch for sorting
    """

    boxes: NDArray[np.float32]
    numbers: NDArray[np.int32]
    spare: NDArray[np.float32]


@kernel
def face_boxes(vertices, faces, boxes, numbers, begin, end):
    """The box of each face in ``begin:end``, by ``face_range``."""
    for f in range(begin, end):
        a, b, c = faces[f]
        base = f * BOX
        for k in range(3):
            low, high = face_range(vertices[a, k], vertices[b, k], vertices[c, k])
            boxes[base + k], boxes[base + 4 + k] = low, -high
        numbers[base + FACE] = f
        boxes[base + 7] = 0.0


@inlined
def empty_box():
    """The empty box, the neutral element of ``united``."""
    return splat8(np.float32(np.inf))


@inlined
def united(a, b):
    """The union of two boxes as vectors."""
    return select(a < b, a, b)


@inlined
def half_area(box):
    """Half the area of a box as a vector."""
    x, y, z = -extract(box, 4) - extract(box, 0), -extract(box, 5) - extract(box, 1), -extract(box, 6) - extract(box, 2)
    return x * y + y * z + z * x


@inlined
def double_centre(boxes, base, axis):
    """Lower plus upper of the box at word ``base``."""
    return boxes[base + axis] - boxes[base + 4 + axis]


@kernel
def fit(boxes, begin, end, box, at):
    """Write the union of the boxes ``begin:end`` to word ``at`` of ``box``."""
    union = empty_box()
    for i in range(begin, end):
        union = united(union, load8(boxes, i * BOX))
    store(box, at, union)

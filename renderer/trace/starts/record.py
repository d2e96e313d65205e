"""The starts of a batch of rays on the surface, as kernels read them: one row for each ray."""

from typing import Any, NamedTuple

import numpy as np

from renderer.jit.decorators import inlined
from renderer.numerics.kinds import of_kind, of_none
from renderer.numerics.simd import address, float64_pointer, int32_pointer, load, offset, pointer
from renderer.numerics.vec3 import row3, scale, three
from renderer.trace.layout import MASK_BITS

# The head of an array of starts, int64: the float64 of a row that each ray is after the one before, 0 where no ray
# starts on the surface; and the addresses of the mesh's vertices and faces.
ROW_STEP, VERTICES, FACES, HEAD = 0, 1, 2, 8
# The columns of a row, float64: the slack of ``intersect.Ray``, EDGE where the start is on an edge, or stopped at once;
# the face, -1 for none; the code; the anchor: the point as given, or the barycentrics u and v and, of a ray that came
# through the face, PILE: the first of the faces that coincide there; and the way back, a direction that
# is on the side where the ray starts. Then mask and instance ignored, as of ``intersect.Ray``.
SLACK, FACE, CODE, ANCHOR, PILE, WAY, MASK, IGNORED, ROW = 0, 1, 2, 3, 5, 6, 9, 10, 11
# The mask of a ray that may hit every instance.
ALL = float(MASK_BITS)
# The slack of a ray that no search takes as it is: ``search.search_from`` decides.
EDGE = np.inf
# The bits of a code: the side of the face that the ray starts on is known, and is that of its normal; the ray came
# through the face; the anchor has barycentrics; there is a way back.
KNOWN, ABOVE, THROUGH, BARYCENTRIC, BACK = 1, 2, 4, 8, 16


class StartPointers(NamedTuple):
    """Pointers to the rows of starts and to the mesh, and the step of ``ROW_STEP``."""

    rows: Any
    step: int
    vertices: Any
    faces: Any


class Start(NamedTuple):
    """The start of one ray on the surface.

    corners  those of the face, in the tree's units
    anchor   the given point, in the tree's units, or u, v and the pile
    """

    corners: Any
    anchor: Any
    face: int
    code: int


# For the type of ``ray_lanes.Prepared.starts``: rays may start on the surface.
ON_SURFACE = 0


@inlined
def start_pointers(starts):
    """``StartPointers`` of an array of starts, HEAD int64 and rows of ROW float64; None of one of uint64, for rays that
    do not start on the surface and may hit every instance.
    """
    return of_kind(starts, _pointers, _none)(starts)


@inlined
def _none(starts):
    return None


@inlined
def _pointers(starts):
    head = pointer(starts)
    return StartPointers(
        float64_pointer(address(starts) + 8 * HEAD),
        load(head, ROW_STEP),
        float64_pointer(load(head, VERTICES)),
        int32_pointer(load(head, FACES)),
    )


@inlined
def no_start(source, i):
    """Slack and face of a ray that starts on no surface."""
    return 0.0, -1.0


@inlined
def start_row(starts, i):
    """Slack, face, mask and ignored instance of ray ``i``."""
    return of_none(starts, _usual_row, _own_row)(starts, i)


@inlined
def _usual_row(starts, i):
    return *no_start(starts, i), ALL, -1.0


@inlined
def _own_row(starts, i):
    row = offset(starts.rows, i * starts.step)
    return load(row, SLACK), load(row, FACE), load(row, MASK), load(row, IGNORED)


@inlined
def start_at(tree, starts, i):
    """The ``Start`` of ray ``i``, whose face is not -1."""
    row = offset(starts.rows, i * starts.step)
    face, code = np.int64(load(row, FACE)), np.int64(load(row, CODE))
    anchor = (load(row, ANCHOR), load(row, ANCHOR + 1), load(row, ANCHOR + 2))
    if code & BARYCENTRIC == 0:
        anchor = scale(anchor, tree.scale)
    return Start(corners_in(tree, starts, face), anchor, face, code)


@inlined
def way_back(starts, i):
    """The vector back of ray ``i``, whose code has BACK."""
    return three(starts.rows, i * starts.step + WAY)


@inlined
def corners_in(tree, starts, face):
    """The corners of a face of the mesh that rays start on, as tuples, in the tree's units."""
    return tree.ways.corners_of_face(tree, starts, face)


@inlined
def corners_of_mesh(tree, starts, face):
    """``corners_in`` of a mesh."""
    return corners_of(starts.vertices, starts.faces, face, tree.scale)


@inlined
def corners_of(vertices, faces, face, unit):
    """The corners of a face, as tuples, in units in which no product overflows or vanishes."""
    a, b, c = row3(faces, face)
    return scale(row3(vertices, a), unit), scale(row3(vertices, b), unit), scale(row3(vertices, c), unit)

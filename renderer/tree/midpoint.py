"""The midpoint rule: octants about the middle of a box, as binary cuts; eight if the box is nearly a cube."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.simd import load8, maximum, minimum, store
from renderer.tree.bounds import BOX, double_centre, empty_box, fit, united
from renderer.tree.hierarchy import add_part


class OctantScratch(NamedTuple):
    """Scratch of ``cut_octants``: the start of each octant's faces, the octants' boxes, and parts to be cut."""

    starts: NDArray[np.int64]
    boxes: NDArray[np.float32]
    waiting: NDArray[np.int64]


def octant_scratch() -> OctantScratch:
    return OctantScratch(np.empty(9, np.int64), np.empty(8 * BOX, np.float32), np.empty((8, 3), np.int64))


@kernel
def cut_octants(faces, tree, part, whole, count, scratch):
    """Cut a part into octants about the middle of its box. Returns the number of parts, which was ``count`` before.

    The part is cut in two along the longest axis first, and halves of at most ``whole`` faces are not cut further. If
    all faces lie in one octant, the middle of their centres is used instead; if that separates none, nothing is cut.
    """
    # Sort the faces by octant.
    begin, end = tree.ranges[part]
    axes, middle = _box_middle(tree.boxes, part * BOX)
    if _sort_octants(faces, begin, end, axes, middle, scratch):
        middle = _centres_middle(faces.boxes, begin, end, axes)
        if _sort_octants(faces, begin, end, axes, middle, scratch):
            return count
    # Cut in two, from all eight octants down. A waiting entry is a part, its first octant and its number of octants.
    waiting, starts = scratch.waiting, scratch.starts
    waiting[0, 0], waiting[0, 1], waiting[0, 2] = part, 0, 8
    top = 1
    while top > 0:
        top -= 1
        cut, first, width = waiting[top]
        # Leave a part whole whose faces lie in one octant.
        first, width = _without_empty_halves(starts, first, width)
        if width == 1:
            continue
        # Cut the others in two, and let large halves wait.
        half = width // 2
        tree.halves[cut] = count
        for at in range(first, first + width, half):
            add_part(tree, count, begin + starts[at], begin + starts[at + half])
            fit(scratch.boxes, at, at + half, tree.boxes, count * BOX)
            if half > 1 and starts[at + half] - starts[at] > whole:
                waiting[top, 0], waiting[top, 1], waiting[top, 2] = count, at, half
                top += 1
            count += 1
    return count


@kernel
def _without_empty_halves(starts, first, width):
    """The octants left of ``width`` octants from ``first`` on when empty halves are skipped: the first, and their
    number.
    """
    while width > 1:
        half = width // 2
        if starts[first + half] == starts[first]:
            first, width = first + half, half
        elif starts[first + half] == starts[first + width]:
            width = half
        else:
            break
    return first, width


@inlined
def _box_middle(boxes, base):
    """The axes of the box at word ``base``, longest first, and the doubled middle along each.

    Along an axis less than half as long as the longest it is infinite, so that nothing is cut: in an octree of cubes
    the box is one layer of cells. Cutting such boxes costs rays a fifth more nodes on terrains.
    """
    x = -boxes[base + 4] - boxes[base]
    y = -boxes[base + 5] - boxes[base + 1]
    z = -boxes[base + 6] - boxes[base + 2]
    a, b, c = 0, 1, 2
    if y > x:
        a, b, x, y = 1, 0, y, x
    if z > y:
        b, c, y, z = 2, b, z, y
        if y > x:
            a, b, x, y = b, a, y, x
    half, none = x * np.float32(0.5), np.float32(np.inf)
    second = double_centre(boxes, base, b) if y >= half else none
    third = double_centre(boxes, base, c) if z >= half else none
    return (a, b, c), (double_centre(boxes, base, a), second, third)


@kernel
def _centres_middle(boxes, begin, end, axes):
    """The middle of the bounds of the doubled centres along each axis; the lower end when nothing lies between."""
    a, b, c = _centres_middle_along(boxes, begin, end, axes[0]), 0, 0
    b = _centres_middle_along(boxes, begin, end, axes[1])
    c = _centres_middle_along(boxes, begin, end, axes[2])
    return a, b, c


@kernel
def _centres_middle_along(boxes, begin, end, axis):
    low, high = np.float32(np.inf), np.float32(-np.inf)
    for i in range(begin, end):
        centre = double_centre(boxes, i * BOX, axis)
        low, high = minimum(low, centre), maximum(high, centre)
    return low + (high - low) * np.float32(0.5)


@inlined
def _octant(boxes, base, axes, middle):
    """The octant of the centre of the box at word ``base``; the first axis weighs most."""
    a = np.int64(double_centre(boxes, base, axes[0]) > middle[0])
    b = np.int64(double_centre(boxes, base, axes[1]) > middle[1])
    c = np.int64(double_centre(boxes, base, axes[2]) > middle[2])
    return 4 * a + 2 * b + c


@kernel
def _sort_octants(faces, begin, end, axes, middle, scratch):
    """Sort faces by octant, stably by counting, and fill ``scratch``.

    Returns whether all are in one octant; then none moves.
    """
    boxes, spare, starts = faces.boxes, faces.spare, scratch.starts
    for k in range(9):
        starts[k] = 0
    for k in range(8):
        store(scratch.boxes, k * BOX, empty_box())
    for i in range(begin, end):
        k = _octant(boxes, i * BOX, axes, middle)
        starts[k + 1] += 1
        store(scratch.boxes, k * BOX, united(load8(scratch.boxes, k * BOX), load8(boxes, i * BOX)))
    for k in range(8):
        if starts[k + 1] == end - begin:
            return True
        starts[k + 1] += starts[k]
    for i in range(begin, end):
        store(spare, i * BOX, load8(boxes, i * BOX))
    for i in range(begin, end):
        k = _octant(spare, i * BOX, axes, middle)
        store(boxes, (begin + starts[k]) * BOX, load8(spare, i * BOX))
        starts[k] += 1
    for k in range(8, 0, -1):
        starts[k] = starts[k - 1]
    starts[0] = 0
    return False

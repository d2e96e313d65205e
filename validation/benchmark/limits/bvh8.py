"""A model of Embree's BVH8 for triangles: binned surface area heuristic, up to eight children, leaves of four.

Written from what Embree 4's builder of medium quality does (kernels/builders/bvh_builder_sah.h and heuristic_binning.h,
called from kernels/bvh/bvh_builder_sah.cpp with blocks of four, leaves of four to 28, and costs of 1): its numbers of
nodes and blocks, not its code.
"""

import numpy as np
from numpy.typing import NDArray

from renderer.jit.decorators import kernel

Floats = NDArray[np.float64]
_CHILDREN, _BLOCK = 8, 4
# A part of at most LEAST faces is a leaf; one of at most MOST is one where the heuristic says so.
_LEAST, _MOST = 4, 28
_BINS = 32


def build(lower: Floats, upper: Floats) -> tuple[NDArray[np.float32], NDArray[np.int64], NDArray[np.int32]]:
    """Boxes, children and faces as in ``trees.PlainTree``, of the boxes (F, 3) of faces."""
    count = len(lower)
    order, parts = np.arange(count, dtype=np.int64), np.empty((count + _CHILDREN, 4), np.int64)
    boxes = np.empty((count, 6, _CHILDREN), np.float32)
    children, faces = np.empty((count, _CHILDREN), np.int64), np.empty((count, _BLOCK), np.int32)
    bins, counts = np.empty((_BINS, 3, 6)), np.empty((_BINS, 3), np.int64)
    few = np.empty((_CHILDREN, 2), np.int64)
    nodes, blocks = _build((lower, upper, order), (boxes, children, faces), parts, (bins, counts, few))
    return boxes[:nodes].copy(), children[:nodes].copy(), faces[:blocks].copy()


@kernel
def _build(mesh, tree, parts, scratch):
    """Fill ``tree``, node after node; ``parts`` is a stack of begin, end, parent and place."""
    (lower, _, order), (boxes, children, faces), few = mesh, tree, scratch[2]
    parts[0, 0], parts[0, 1], parts[0, 2], parts[0, 3] = 0, len(lower), -1, 0
    waiting, nodes, blocks = 1, 0, 0
    while waiting > 0:
        waiting -= 1
        begin, end, parent, place = parts[waiting, 0], parts[waiting, 1], parts[waiting, 2], parts[waiting, 3]
        # A tree has a node even where all faces fit into a leaf: its first child.
        if parent >= 0 and _is_leaf(mesh, begin, end, scratch):
            children[parent, place] = ~(8 * blocks + (end - begin + _BLOCK - 1) // _BLOCK - 1)
            blocks = _fill(faces, order, begin, end, blocks)
            continue
        if parent >= 0:
            children[parent, place] = nodes
        found = _open(mesh, begin, end, scratch)
        for i in range(_CHILDREN):
            _put_box(boxes, nodes, i, mesh, few[i, 0] if i < found else 0, few[i, 1] if i < found else 0)
            children[nodes, i] = -1
        for i in range(found):
            parts[waiting, 0], parts[waiting, 1], parts[waiting, 2], parts[waiting, 3] = few[i, 0], few[i, 1], nodes, i
            waiting += 1
        nodes += 1
    return nodes, blocks


@kernel
def _fill(faces, order, begin, end, blocks):
    for first in range(begin, end, _BLOCK):
        for k in range(_BLOCK):
            faces[blocks, k] = order[first + k] if first + k < end else -1
        blocks += 1
    return blocks


@kernel
def _is_leaf(mesh, begin, end, scratch):
    count = end - begin
    if count <= _LEAST:
        return True
    if count > _MOST:
        return False
    area = _half_area(_bounds(mesh, begin, end))
    return area * _blocks_of(count) <= area + _best_split(mesh, begin, end, scratch)[0]


@kernel
def _open(mesh, begin, end, scratch):
    """Cut the part of the largest area until there are eight; they are left in ``few``. Returns how many."""
    few, found = scratch[2], 1
    few[0, 0], few[0, 1] = begin, end
    while found < _CHILDREN:
        largest, chosen = -1.0, -1
        for i in range(found):
            if few[i, 1] - few[i, 0] > _LEAST:
                area = _half_area(_bounds(mesh, few[i, 0], few[i, 1]))
                if area > largest:
                    largest, chosen = area, i
        if chosen < 0:
            break
        middle = _cut(mesh, few[chosen, 0], few[chosen, 1], scratch)
        few[found, 0], few[found, 1], few[chosen, 1] = middle, few[chosen, 1], middle
        found += 1
    return found


@kernel
def _cut(mesh, begin, end, scratch):
    """Order the faces of a part by the side of its best split; returns where the second side begins."""
    lower, upper, order = mesh
    _, axis, position, start, scale = _best_split(mesh, begin, end, scratch)
    if axis < 0:
        return (begin + end) // 2
    i, j = begin, end - 1
    while i <= j:
        face = order[i]
        if int((lower[face, axis] + upper[face, axis] - start) * scale) < position:
            i += 1
        else:
            order[i], order[j] = order[j], face
            j -= 1
    return i


@kernel
def _best_split(mesh, begin, end, scratch):
    """The least cost of both sides together, its axis (-1: no centres differ) and first bin of the second side, and
    the least centre and the bins a length on that axis.
    """
    lower, upper, order = mesh
    bins, counts = scratch[0], scratch[1]
    number = min(_BINS, int(4.0 + 0.05 * (end - begin)))
    best, axis, position, best_start, best_scale = np.inf, -1, 0, 0.0, 0.0
    for a in range(3):
        start, last = np.inf, -np.inf
        for k in range(begin, end):
            centre = lower[order[k], a] + upper[order[k], a]
            start, last = min(start, centre), max(last, centre)
        if not last > start:
            continue
        scale = 0.99 * number / (last - start)
        for i in range(number):
            counts[i, a] = 0
            for c in range(3):
                bins[i, a, c], bins[i, a, 3 + c] = np.inf, -np.inf
        for k in range(begin, end):
            face = order[k]
            i = int((lower[face, a] + upper[face, a] - start) * scale)
            counts[i, a] += 1
            for c in range(3):
                bins[i, a, c] = min(bins[i, a, c], lower[face, c])
                bins[i, a, 3 + c] = max(bins[i, a, 3 + c], upper[face, c])
        for i in range(1, number):
            cost = _side_cost(bins, counts, a, 0, i) + _side_cost(bins, counts, a, i, number)
            if cost < best:
                best, axis, position, best_start, best_scale = cost, a, i, start, scale
    return best, axis, position, best_start, best_scale


@kernel
def _side_cost(bins, counts, axis, first, last):
    low_x, low_y, low_z, high_x, high_y, high_z = np.inf, np.inf, np.inf, -np.inf, -np.inf, -np.inf
    count = 0
    for i in range(first, last):
        count += counts[i, axis]
        low_x, high_x = min(low_x, bins[i, axis, 0]), max(high_x, bins[i, axis, 3])
        low_y, high_y = min(low_y, bins[i, axis, 1]), max(high_y, bins[i, axis, 4])
        low_z, high_z = min(low_z, bins[i, axis, 2]), max(high_z, bins[i, axis, 5])
    # A side without faces is no split.
    return _half_area((low_x, low_y, low_z, high_x, high_y, high_z)) * _blocks_of(count) if count else np.inf


@kernel
def _blocks_of(count):
    return (count + _BLOCK - 1) // _BLOCK


@kernel
def _bounds(mesh, begin, end):
    lower, upper, order = mesh
    low_x, low_y, low_z, high_x, high_y, high_z = np.inf, np.inf, np.inf, -np.inf, -np.inf, -np.inf
    for k in range(begin, end):
        face = order[k]
        low_x, high_x = min(low_x, lower[face, 0]), max(high_x, upper[face, 0])
        low_y, high_y = min(low_y, lower[face, 1]), max(high_y, upper[face, 1])
        low_z, high_z = min(low_z, lower[face, 2]), max(high_z, upper[face, 2])
    return low_x, low_y, low_z, high_x, high_y, high_z


@kernel
def _half_area(box):
    x, y, z = box[3] - box[0], box[4] - box[1], box[5] - box[2]
    return x * y + y * z + z * x


@kernel
def _put_box(boxes, node, place, mesh, begin, end):
    """Write the box of a part, which no ray enters where it has no faces."""
    box = _bounds(mesh, begin, end)
    for a in range(3):
        boxes[node, 2 * a, place], boxes[node, 2 * a + 1, place] = np.float32(box[a]), np.float32(box[3 + a])

"""The SAH rule: two halves at the binned plane of least cost by the surface area heuristic (Wald 2007)."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.simd import larger, load8, smaller, store
from renderer.trace.layout import BLOCK_FACES
from renderer.tree.bounds import BOX, double_centre, empty_box, half_area, united
from renderer.tree.hierarchy import add_part

_MOST_BINS = 16


class BinRoom(NamedTuple):
    """Scratch of ``cut_sah``: the number and bounds of the faces in each bin, and the cost beyond each."""

    counts: NDArray[np.int64]
    boxes: NDArray[np.float32]
    beyond: NDArray[np.float32]


def bin_room() -> BinRoom:
    bins = 3 * _MOST_BINS
    return BinRoom(np.empty(bins, np.int64), np.empty(bins * BOX, np.float32), np.empty(_MOST_BINS, np.float32))


@kernel
def cut_sah(faces, tree, part, count, room):
    """Cut a part in two at the cheapest plane, cost counted in blocks. Returns the number of parts, which was ``count``
    before and stays so where no plane separates the centres.
    """
    begin, end = tree.ranges[part]
    bins = _MOST_BINS if end - begin > 32 else 6
    low, scale = _spread_bins(faces.boxes, begin, end, bins)
    _fill_bins(faces.boxes, begin, end, (low, scale, bins), room)
    best, axis, last = np.float32(np.inf), -1, 0
    for k in range(3):
        cost, at = _best_plane(room, k * bins, bins)
        if at >= 0 and (axis < 0 or cost < best):
            best, axis, last = cost, k, at
    if axis < 0:
        return count
    middle = _partition(faces, begin, end, (axis, low[axis], scale[axis], bins, last))
    tree.halves[part] = count
    add_part(tree, count, begin, middle)
    add_part(tree, count + 1, middle, end)
    first = axis * bins
    store(tree.boxes, count * BOX, _union_of_bins(room.boxes, first, first + last + 1))
    store(tree.boxes, (count + 1) * BOX, _union_of_bins(room.boxes, first + last + 1, first + bins))
    return count + 2


@kernel
def _spread_bins(boxes, begin, end, bins):
    """The start of the bins on each axis, and the bins per unit of length, 0 where the centres do not differ."""
    x0 = y0 = z0 = np.float32(np.inf)
    x1 = y1 = z1 = np.float32(-np.inf)
    for i in range(begin, end):
        base = i * BOX
        x, y, z = double_centre(boxes, base, 0), double_centre(boxes, base, 1), double_centre(boxes, base, 2)
        x0, y0, z0 = smaller(x0, x), smaller(y0, y), smaller(z0, z)
        x1, y1, z1 = larger(x1, x), larger(y1, y), larger(z1, z)
    return (x0, y0, z0), (_scale(x1 - x0, bins), _scale(y1 - y0, bins), _scale(z1 - z0, bins))


@inlined
def _scale(extent, bins):
    return np.float32(bins) / extent if extent > 0.0 else np.float32(0.0)


@inlined
def _bin(centre, low, scale, bins):
    return smaller(bins - 1, larger(0, np.int64((centre - low) * scale)))


@kernel
def _fill_bins(boxes, begin, end, spread, room):
    """Counts and bounds of the faces whose centres fall into each bin."""
    low, scale, bins = spread
    for k in range(3 * bins):
        room.counts[k] = 0
        store(room.boxes, k * BOX, empty_box())
    for i in range(begin, end):
        box = load8(boxes, i * BOX)
        for axis in range(3):
            k = axis * bins + _bin(double_centre(boxes, i * BOX, axis), low[axis], scale[axis], bins)
            room.counts[k] += 1
            store(room.boxes, k * BOX, united(load8(room.boxes, k * BOX), box))


@kernel
def _best_plane(room, first, bins):
    """The least sum of half area times blocks on both sides of a plane, and the bin before the plane; -1 for none."""
    counts, beyond = room.counts, room.beyond
    box, n = empty_box(), np.int64(0)
    for k in range(bins - 1, 0, -1):
        if counts[first + k] > 0:
            box = united(box, load8(room.boxes, (first + k) * BOX))
            n += counts[first + k]
        beyond[k] = half_area(box) * np.float32((n + BLOCK_FACES - 1) // BLOCK_FACES) if n > 0 else np.float32(-1.0)
    best, at = np.float32(np.inf), -1
    box, n = empty_box(), np.int64(0)
    for k in range(bins - 1):
        if beyond[k + 1] < 0.0:
            break
        if counts[first + k] > 0:
            box = united(box, load8(room.boxes, (first + k) * BOX))
            n += counts[first + k]
            cost = half_area(box) * np.float32((n + BLOCK_FACES - 1) // BLOCK_FACES) + beyond[k + 1]
            if at < 0 or cost < best:
                best, at = cost, k
    return best, at


@kernel
def _union_of_bins(boxes, begin, end):
    box = empty_box()
    for k in range(begin, end):
        box = united(box, load8(boxes, k * BOX))
    return box


@kernel
def _partition(faces, begin, end, plane):
    """Stable partition: faces up to the last bin before the plane first. Returns where those beyond it begin."""
    boxes, spare = faces.boxes, faces.spare
    axis, low, scale, bins, last = plane
    left, right = begin, begin
    for i in range(begin, end):
        beyond = _bin(double_centre(boxes, i * BOX, axis), low, scale, bins) > last
        box = load8(boxes, i * BOX)
        store(boxes, left * BOX, box)
        store(spare, right * BOX, box)
        left += 1 - beyond
        right += beyond
    for i in range(right - begin):
        store(boxes, (left + i) * BOX, load8(spare, (begin + i) * BOX))
    return left

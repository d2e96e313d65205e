"""The SAH rule: two halves at the binned plane of least cost by the surface area heuristic (Wald 2007)."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.simd import load8, maximum, minimum, store
from renderer.trace.layout import BLOCK_FACES
from renderer.tree.bounds import BOX, double_centre, empty_box, fit, half_area, united
from renderer.tree.hierarchy import add_part

_MOST_BINS = 16


class Bins(NamedTuple):
    """The start of the bins of each axis, their number for each unit of length, and their number on each axis."""

    low: tuple
    scale: tuple
    count: int  # type: ignore[assignment]  # tuples have a method of that name


class BinScratch(NamedTuple):
    """Scratch of ``cut_sah``: the number and bounds of the faces in each bin, and the cost beyond each."""

    counts: NDArray[np.int64]
    boxes: NDArray[np.float32]
    beyond: NDArray[np.float32]


def bin_scratch() -> BinScratch:
    bins = 3 * _MOST_BINS
    return BinScratch(np.empty(bins, np.int64), np.empty(bins * BOX, np.float32), np.empty(_MOST_BINS, np.float32))


@kernel
def cut_sah(faces, tree, part, count, scratch):
    """Cut a part in two at the cheapest plane, with cost counted in blocks. Returns the number of parts; it stays
    ``count`` if no plane separates the centres.
    """
    begin, end = tree.ranges[part]
    # Sort the faces into bins.
    bins = _spread_bins(faces.boxes, begin, end, _MOST_BINS if end - begin > 32 else 6)
    _fill_bins(faces.boxes, begin, end, bins, scratch)
    # Take the cheapest plane between bins.
    best, axis, last = np.float32(np.inf), -1, 0
    for k in range(3):
        cost, at = _best_plane(scratch, k * bins.count, bins.count)
        if at >= 0 and (axis < 0 or cost < best):
            best, axis, last = cost, k, at
    if axis < 0:
        return count
    # Cut there.
    middle = _partition(faces, begin, end, bins, axis, last)
    tree.halves[part] = count
    add_part(tree, count, begin, middle)
    add_part(tree, count + 1, middle, end)
    first = axis * bins.count
    fit(scratch.boxes, first, first + last + 1, tree.boxes, count * BOX)
    fit(scratch.boxes, first + last + 1, first + bins.count, tree.boxes, (count + 1) * BOX)
    return count + 2


@kernel
def _spread_bins(boxes, begin, end, count):
    """The ``Bins`` between the centres of some faces; none along an axis on which these are equal."""
    x0 = y0 = z0 = np.float32(np.inf)
    x1 = y1 = z1 = np.float32(-np.inf)
    for i in range(begin, end):
        base = i * BOX
        x, y, z = double_centre(boxes, base, 0), double_centre(boxes, base, 1), double_centre(boxes, base, 2)
        x0, y0, z0 = minimum(x0, x), minimum(y0, y), minimum(z0, z)
        x1, y1, z1 = maximum(x1, x), maximum(y1, y), maximum(z1, z)
    return Bins((x0, y0, z0), (_scale(x1 - x0, count), _scale(y1 - y0, count), _scale(z1 - z0, count)), count)


@inlined
def _scale(extent, count):
    return np.float32(count) / extent if extent > 0.0 else np.float32(0.0)


@inlined
def _bin(centre, bins, axis):
    return minimum(bins.count - 1, maximum(0, np.int64((centre - bins.low[axis]) * bins.scale[axis])))


@kernel
def _fill_bins(boxes, begin, end, bins, scratch):
    """Counts and bounds of the faces whose centres fall into each bin."""
    for k in range(3 * bins.count):
        scratch.counts[k] = 0
        store(scratch.boxes, k * BOX, empty_box())
    for i in range(begin, end):
        box = load8(boxes, i * BOX)
        for axis in range(3):
            k = axis * bins.count + _bin(double_centre(boxes, i * BOX, axis), bins, axis)
            scratch.counts[k] += 1
            store(scratch.boxes, k * BOX, united(load8(scratch.boxes, k * BOX), box))


@kernel
def _best_plane(scratch, first, bins):
    """The least sum of half area times blocks on both sides of a plane, and the bin before the plane; -1 for none."""
    counts, beyond = scratch.counts, scratch.beyond
    box, n = empty_box(), np.int64(0)
    for k in range(bins - 1, 0, -1):
        if counts[first + k] > 0:
            box = united(box, load8(scratch.boxes, (first + k) * BOX))
            n += counts[first + k]
        beyond[k] = half_area(box) * np.float32((n + BLOCK_FACES - 1) // BLOCK_FACES) if n > 0 else np.float32(-1.0)
    best, at = np.float32(np.inf), -1
    box, n = empty_box(), np.int64(0)
    for k in range(bins - 1):
        if beyond[k + 1] < 0.0:
            break
        if counts[first + k] > 0:
            box = united(box, load8(scratch.boxes, (first + k) * BOX))
            n += counts[first + k]
            cost = half_area(box) * np.float32((n + BLOCK_FACES - 1) // BLOCK_FACES) + beyond[k + 1]
            if at < 0 or cost < best:
                best, at = cost, k
    return best, at


@kernel
def _partition(faces, begin, end, bins, axis, last):
    """Stable partition: faces up to the ``last`` bin before the plane come first. Returns the start of the others."""
    boxes, spare = faces.boxes, faces.spare
    left, right = begin, begin
    for i in range(begin, end):
        beyond = _bin(double_centre(boxes, i * BOX, axis), bins, axis) > last
        box = load8(boxes, i * BOX)
        store(boxes, left * BOX, box)
        store(spare, right * BOX, box)
        left += 1 - beyond
        right += beyond
    for i in range(right - begin):
        store(boxes, (left + i) * BOX, load8(spare, (begin + i) * BOX))
    return left

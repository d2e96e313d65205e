"""The SAH rule: two halves at the binned plane of least cost by the surface area heuristic (Wald 2007)."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.simd import extract, load, load8, maximum, minimum, pointer, select, splat8, store, swap_halves
from renderer.trace.layout import BLOCK_FACES
from renderer.tree.bounds import BOX, empty_box, fit, half_area, united
from renderer.tree.hierarchy import add_part

_MOST_BINS = 16
# Of large parts only a sample of at least so many faces is sorted into bins: each third, fifth or so on, at most each
# fifteenth. The steps are odd because faces come in pairs. Trees are as good by counted steps.
_SAMPLE, _MOST_APART = 1024, 15


class Bins(NamedTuple):
    """The start of the bins of each axis, their number for each unit of length, and their number on each axis."""

    low: Any
    scale: Any
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
    apart = minimum(_MOST_APART, maximum(1, (end - begin) // _SAMPLE - 1 | 1))
    bins = _spread_bins(faces.boxes, begin, end, apart, _MOST_BINS if end - begin > 32 else 6)
    _fill_bins(faces.boxes, begin, end, apart, bins, scratch)
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
    if apart > 1:
        fit(faces.boxes, begin, middle, tree.boxes, count * BOX)
        fit(faces.boxes, middle, end, tree.boxes, (count + 1) * BOX)
        return count + 2
    first = axis * bins.count
    fit(scratch.boxes, first, first + last + 1, tree.boxes, count * BOX)
    fit(scratch.boxes, first + last + 1, first + bins.count, tree.boxes, (count + 1) * BOX)
    return count + 2


@inlined
def _centres(boxes, i):
    """Lower plus upper of the i-th box along each axis, in the first three lanes; the other lanes mean nothing."""
    box = load8(boxes, i * BOX)
    return box - swap_halves(box)


@kernel
def _spread_bins(boxes, begin, end, apart, count):
    """The ``Bins`` between the centres of each ``apart``-th face; none along an axis on which these are equal."""
    low, high = splat8(np.float32(np.inf)), splat8(np.float32(-np.inf))
    for i in range(begin, end, apart):
        centres = _centres(boxes, i)
        low, high = minimum(low, centres), maximum(high, centres)
    # Infinite along an axis on which all centres are one, or closer together than float32 can tell.
    scale = np.float32(count) / (high - low)
    return Bins(low, select(scale < np.float32(np.inf), scale, np.float32(0.0)), np.int64(count))


@inlined
def _bins_of(centres, bins):
    """The bin of a face on each axis, by its ``_centres``, which may lie before those of a sample or beyond them."""
    places = minimum((centres - bins.low) * bins.scale, np.float32(bins.count - 1))
    return maximum(splat8(np.float32(0.0)), places)


@kernel
def _fill_bins(boxes, begin, end, apart, bins, scratch):
    """Counts and bounds of those of each ``apart``-th face whose centres fall into each bin."""
    for k in range(3 * bins.count):
        scratch.counts[k] = 0
        store(scratch.boxes, k * BOX, empty_box())
    counts, sums = pointer(scratch.counts), pointer(scratch.boxes)
    for i in range(begin, end, apart):
        box, places = load8(boxes, i * BOX), _bins_of(_centres(boxes, i), bins)
        _add(counts, sums, np.int64(extract(places, 0)), box)
        _add(counts, sums, bins.count + np.int64(extract(places, 1)), box)
        _add(counts, sums, 2 * bins.count + np.int64(extract(places, 2)), box)


@inlined
def _add(counts, boxes, k, box):
    """Add a face to the k-th bin."""
    store(counts, k, load(counts, k) + 1)
    store(boxes, k * BOX, united(load8(boxes, k * BOX), box))


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
        beyond = np.int64(extract(_bins_of(_centres(boxes, i), bins), axis)) > last
        box = load8(boxes, i * BOX)
        store(boxes, left * BOX, box)
        store(spare, right * BOX, box)
        left += 1 - beyond
        right += beyond
    for i in range(right - begin):
        store(boxes, (left + i) * BOX, load8(spare, (begin + i) * BOX))
    return left

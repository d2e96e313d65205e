"""Bundles of up to 64 rays of neighbouring pixels with the same number of bounces, traced together."""

from typing import Any, NamedTuple

import numpy as np

from renderer.jit.decorators import inlined
from renderer.numerics.simd import load, offset, store
from renderer.trace.starts.record import ROW

# The side in pixels of the block that a bundle of camera rays covers, and the most rays of a bundle.
SIDE = 8
SIZE = SIDE * SIDE
# Columns of float64: origin, direction, weight and width of each ray, and its row of ``starts.record``. Columns of
# int64: the number of rays and their depth; for each ray its pixel, the number of media that it is in, and room for
# ``limit`` of them, as the rows of their materials, outermost first.
_ORIGIN, _DIRECTION, _WEIGHT, _WIDTH, _START, BUNDLE_DOUBLES = (
    0, 3 * SIZE, 6 * SIZE, 9 * SIZE, 10 * SIZE, (10 + ROW) * SIZE
)  # fmt: skip
_PIXEL, _COUNT, BUNDLE_INTEGERS = 2, 2 + SIZE, 2 + 2 * SIZE


class Bundle(NamedTuple):
    """Pointers to one bundle's columns, and the largest number of media of a ray."""

    origins: Any
    directions: Any
    weights: Any
    widths: Any
    starts: Any
    header: Any
    pixels: Any
    media_counts: Any
    media: Any
    limit: int


@inlined
def bundle_at(doubles, integers, limit, slot):
    """The bundle in place ``slot`` of two arrays of bundles."""
    doubles, integers = (
        offset(doubles, slot * BUNDLE_DOUBLES),
        offset(integers, slot * (BUNDLE_INTEGERS + SIZE * limit)),
    )
    return Bundle(
        offset(doubles, _ORIGIN), offset(doubles, _DIRECTION), offset(doubles, _WEIGHT), offset(doubles, _WIDTH),
        offset(doubles, _START),
        integers, offset(integers, _PIXEL), offset(integers, _COUNT), offset(integers, BUNDLE_INTEGERS), limit,
    )  # fmt: skip


@inlined
def clear(bundle, depth):
    """Empty a bundle, for rays of ``depth`` bounces."""
    store(bundle.header, 0, 0)
    store(bundle.header, 1, np.int64(depth))


@inlined
def count_of(bundle):
    """The number of rays in a bundle."""
    return load(bundle.header, 0)


@inlined
def depth_of(bundle):
    """The number of bounces before its rays."""
    return load(bundle.header, 1)


@inlined
def append(bundle, o, d, weight, width, pixel, media, count):
    """Add a ray inside the first ``count`` of ``media``. Returns its row of starts, to be written."""
    i = load(bundle.header, 0)
    store(bundle.header, 0, i + 1)
    for k in range(3):
        store(bundle.origins, 3 * i + k, o[k])
        store(bundle.directions, 3 * i + k, d[k])
        store(bundle.weights, 3 * i + k, weight[k])
    store(bundle.widths, i, width)
    store(bundle.pixels, i, pixel)
    store(bundle.media_counts, i, count)
    for k in range(count):
        store(bundle.media, i * bundle.limit + k, load(media, k))
    return offset(bundle.starts, i * ROW)

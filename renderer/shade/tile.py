"""A tile of the picture: camera rays in blocks of 8 x 8 pixels, one bundle per sample, and the sums of their light.

Depth, normal and face are those of rays through the pixels' centres. If one of them is kept and no sample is such a
ray, an extra bundle is traced for them, neither lit nor counted.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.simd import load, maximum, minimum, offset, pointer, store
from renderer.numerics.vec3 import add, normalized, put3, row3, scale, three
from renderer.shade.bundle import SIDE, SIZE, append, clear, count_of
from renderer.shade.direct import INSIDE, NORMAL, SURFACE_DOUBLES
from renderer.shade.surface import scene_pointers
from renderer.shade.whitted import (
    Settings,
    begin_bundles,
    bundle_scratch,
    meet,
    push_children,
    scratch_lengths,
    slot,
    trace_bundle,
)
from renderer.trace.layout import cache_aligned
from renderer.trace.spawn import put_no_start
from renderer.trace.starts.record import ON_SURFACE
from renderer.trace.traverse import new_scratch, scratch_pointers
from renderer.trace.trees import tree_pointers

_BRIGHTEST = float(np.finfo(np.float32).max)
# The most that a sample adds, which no number of them adds up to infinity.
_FINITE = 2.0**1000
# The side in pixels of the squares whose rays become packets.
_SQUARE = 4


class Film(NamedTuple):
    """The arrays that tiles are written to: radiance and normal (h, w, 3), depth, face and rays (h, w). Radiance is
    always kept; h and w are 0 for arrays that are not.
    """

    radiance: NDArray[np.float32]
    depth: NDArray[np.float64]
    normal: NDArray[np.float32]
    face: NDArray[np.int32]
    rays: NDArray[np.int32]


class Rectangle(NamedTuple):
    """A rectangle of pixels: columns x0 to x1 and rows y0 to y1, the last ones excluded."""

    x0: int
    y0: int
    x1: int
    y1: int


class CameraRays(NamedTuple):
    """The camera rays of a tile.

    rays    the rows (6, 3) of the camera's affine map; or a row (n, 6) for each ray, its origin and unit direction:
            pixel by pixel of the tile for one place after the other; NaN where there is no ray
    places  positions from the pixel's corner (p, 2): those of the samples, and then the centre if none of them is there
    weights those of the samples (count,), of mean 1
    count   the number of samples
    centre  the number of the place whose first hits are kept: one at the pixel's centre
    """

    rays: NDArray[np.float64]
    places: NDArray[np.float64]
    weights: NDArray[np.float64]
    count: int  # type: ignore[assignment]  # tuples have a method of that name
    centre: int


class CameraMap(NamedTuple):
    """``CameraRays`` as kernels read them: pointers, and whether ``rays`` has a row for each ray of ``tile``."""

    rays: Any
    listed: Any
    places: Any
    weights: Any
    count: Any
    centre: Any
    tile: Any


@inlined
def _place(k):
    """Column and row of a block's k-th pixel: square by square, so that a packet covers a square."""
    square, rest = k // (_SQUARE * _SQUARE), k % (_SQUARE * _SQUARE)
    across = SIDE // _SQUARE
    return square % across * _SQUARE + rest % _SQUARE, square // across * _SQUARE + rest // _SQUARE


@inlined
def _listed_ray(camera, place, x, y):
    """Origin and direction of the ray through a pixel's place, where ``camera`` lists its rays."""
    tile = camera.tile
    row = (place * (tile.y1 - tile.y0) + y - tile.y0) * (tile.x1 - tile.x0) + x - tile.x0
    return row3(camera.rays, 2 * row), row3(camera.rays, 2 * row + 1)


@inlined
def _affine_ray(rows, x, y):
    """Origin and direction of the ray through a place on the film, by the rows of an affine map."""
    o = add(row3(rows, 0), add(scale(row3(rows, 1), x), scale(row3(rows, 2), y)))
    d = add(row3(rows, 3), add(scale(row3(rows, 4), x), scale(row3(rows, 5), y)))
    return o, normalized(d)


@inlined
def _shoot(camera, scene, bundle, place, block):
    """Fill a bundle with the camera rays of a block, all through one of the places in their pixels.

    Pixels count row by row, SIDE per row.
    """
    clear(bundle, 0)
    put_no_start(bundle.starts)
    across, down = load(camera.places, 2 * place), load(camera.places, 2 * place + 1)
    for k in range(SIZE):
        i, j = _place(k)
        x, y = block.x0 + i, block.y0 + j
        if x < block.x1 and y < block.y1:
            # rule: place-in-pixel
            px, py = x + across, y + down
            o, d = _listed_ray(camera, place, x, y) if camera.listed else _affine_ray(camera.rays, px, py)
            if d[0] == d[0]:
                append(bundle, o, d, (1.0, 1.0, 1.0), scene.pixel, j * SIDE + i, scene.media, scene.media_count)


@inlined
def _write_first_hits(film, bundle, scratch, block):
    """Write depth, face and shading normal of the camera rays just traced for a block."""
    for i in range(count_of(bundle)):
        pixel, surface = load(bundle.pixels, i), offset(scratch.surfaces, i * SURFACE_DOUBLES)
        x, y, face = block.x0 + pixel % SIDE, block.y0 + pixel // SIDE, load(scratch.found.face, i)
        if len(film.depth) > 0:
            film.depth[y, x] = load(scratch.found.t, i)
        if len(film.face) > 0:
            film.face[y, x] = face
        if face >= 0 and len(film.normal) > 0:
            n = three(surface, NORMAL)
            n = scale(n, -1.0) if load(surface, INSIDE) != 0.0 else n
            for k in range(3):
                film.normal[y, x, k] = n[k]


@kernel
def _look(tree, scene, settings, camera, film, scratch, block):
    """Write the first hits of extra rays through the pixels' centres. Colours, ray counts and surfaces in ``scratch``
    are overwritten.
    """
    bundle = slot(scratch, settings, 0)
    _shoot(camera, scene, bundle, camera.centre, block)
    meet(tree, scene, settings, bundle, scratch)
    _write_first_hits(film, bundle, scratch, block)


@inlined
def _shows_first_hits(film):
    return len(film.depth) > 0 or len(film.face) > 0 or len(film.normal) > 0


@kernel
def _end_sample(film, block, scratch, total, weight):
    """Add the colours of a sample, by its weight, and its ray counts to the sums of its block."""
    for y in range(block.y0, block.y1):
        for x in range(block.x0, block.x1):
            pixel = (y - block.y0) * SIDE + x - block.x0
            color = row3(scratch.color, pixel)
            # Infinities of either sign would be no number together.
            color = minimum(color[0], _FINITE), minimum(color[1], _FINITE), minimum(color[2], _FINITE)
            put3(total, 3 * pixel, add(row3(total, pixel), scale(color, weight)))
            if len(film.rays) > 0:
                film.rays[y, x] += load(scratch.traced, pixel)


@kernel
def _end_block(film, block, scratch, total, count):
    """Write the radiance of a block. Returns the number of pixels cut by ``max_rays``."""
    cut = 0
    for y in range(block.y0, block.y1):
        for x in range(block.x0, block.x1):
            pixel = (y - block.y0) * SIDE + x - block.x0
            cut += load(scratch.cut, pixel)
            # The largest float32 stands for anything brighter, as from a light within 1e-15 of a surface.
            for k in range(3):
                film.radiance[y, x, k] = maximum(minimum(load(total, 3 * pixel + k) / count, _BRIGHTEST), -_BRIGHTEST)
    return cut


@inlined
def _clear_block(scratch, total):
    for k in range(SIZE):
        store(scratch.cut, k, 0)
        put3(total, 3 * k, (0.0, 0.0, 0.0))


@inlined
def _block_of(tile, k):
    """The k-th block of a tile, row by row; for k beyond the last, one below the tile."""
    across = (tile.x1 - tile.x0 + SIDE - 1) // SIDE
    x, y = tile.x0 + k % across * SIDE, tile.y0 + k // across * SIDE
    return Rectangle(x, y, minimum(x + SIDE, tile.x1), minimum(y + SIDE, tile.y1))


# The progress of a tile, int64: its block, the number of the block's samples that were begun, the number of bundles
# that wait, whether the next one holds camera rays, and the number of pixels that were cut.
_BLOCK, _BEGUN, _WAITING, _FROM_CAMERA, CUT, _STATE = range(6)


@kernel
def _next_sample(tree, scene, settings, camera, film, tile, scratch, total, state):
    """End the current sample and begin the next one, in the next block after the last sample of a block. Returns
    whether there is one.
    """
    block, begun = _block_of(tile, load(state, _BLOCK)), load(state, _BEGUN)
    if begun > 0:
        _end_sample(film, block, scratch, total, load(camera.weights, begun - 1))
    if begun == camera.count:
        store(state, CUT, load(state, CUT) + _end_block(film, block, scratch, total, camera.count))
        store(state, _BLOCK, load(state, _BLOCK) + 1)
        block, begun = _block_of(tile, load(state, _BLOCK)), 0
    if block.y0 >= tile.y1:
        return False
    if begun == 0:
        _clear_block(scratch, total)
        if _shows_first_hits(film) and camera.centre == camera.count:
            _look(tree, scene, settings, camera, film, scratch, block)
    for k in range(SIZE):
        store(scratch.traced, k, 0)
        put3(scratch.color, 3 * k, (0.0, 0.0, 0.0))
    _shoot(camera, scene, slot(scratch, settings, 0), begun, block)
    store(state, _BEGUN, begun + 1)
    store(state, _WAITING, 1)
    store(state, _FROM_CAMERA, 1)
    return True


class TileScratch(NamedTuple):
    """Scratch for a tile: for tracing, for its ``BundleScratch``, for the sums of a block and for its progress; and the
    number of bundles traced in a call.
    """

    trace: NDArray[np.int64]
    doubles: NDArray[np.float64]
    integers: NDArray[np.int64]
    hits: NDArray[np.bool_]
    total: NDArray[np.float64]
    state: NDArray[np.int64]
    bundles: int


def tile_scratch(depth: int, settings: Settings, bundles: int = 1 << 62) -> TileScratch:
    """The scratch of ``render_tile`` for one tile and a tree of ``depth`` levels."""
    doubles, integers = scratch_lengths(settings)
    trace, hits = new_scratch(depth, SIZE), np.empty(SIZE, np.bool_)
    return TileScratch(
        trace, cache_aligned(doubles, np.float64), cache_aligned(integers, np.int64), hits, np.empty(3 * SIZE),
        np.zeros(_STATE, np.int64), bundles,
    )  # fmt: skip


@inlined
def _trace_next(tree, scene, settings, camera, film, tile, scratch, state):
    """Trace the bundle spawned last, and spawn its bundles."""
    top = load(state, _WAITING) - 1
    bundle = slot(scratch, settings, top)
    trace_bundle(tree, scene, settings, bundle, scratch)
    if load(state, _FROM_CAMERA) != 0:
        store(state, _FROM_CAMERA, 0)
        if load(state, _BEGUN) == camera.centre + 1:
            _write_first_hits(film, bundle, scratch, _block_of(tile, load(state, _BLOCK)))
    store(state, _WAITING, push_children(scene, settings, scratch, bundle, top))


@kernel
def render_tile(descriptor, scene, settings, camera, film, tile, arrays):
    """Fill the pixels of a ``Rectangle``, the tile, by its ``CameraRays``.

    ``descriptor`` is the tree's. Depth, face and normal are those of the pixel's centre, radiance is the weighted mean
    of the samples, and rays are summed. Returns whether the tile is done. If not, ``arrays.bundles`` bundles were
    traced and the caller can react to Ctrl-C; the next call with the same ``arrays``, a ``TileScratch``, continues.
    """
    doubles, integers, hits = pointer(arrays.doubles), pointer(arrays.integers), pointer(arrays.hits)
    state, total = pointer(arrays.state), pointer(arrays.total)
    scratch = bundle_scratch(doubles, integers, hits, settings, scratch_pointers(arrays.trace, ON_SURFACE))
    tree, seen = tree_pointers(descriptor), scene_pointers(scene)
    listed = camera.rays.shape[1] == 6
    places, weights = pointer(camera.places), pointer(camera.weights)
    shooting = CameraMap(pointer(camera.rays), listed, places, weights, camera.count, camera.centre, tile)
    if load(state, _BLOCK) == 0 and load(state, _BEGUN) == 0:
        begin_bundles(scratch, settings)
    for _ in range(arrays.bundles):
        if load(state, _WAITING) == 0 and not _next_sample(
            tree, seen, settings, shooting, film, tile, scratch, total, state
        ):
            return True
        _trace_next(tree, seen, settings, shooting, film, tile, scratch, state)
    return False

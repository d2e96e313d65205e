"""The series of all octants of a tree, computed once: leaves from their faces, then nodes from their children."""

import math
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from renderer.inside.multipoles import (
    MOMENT_WORDS,
    ORDER,
    RADIUS,
    SIZE,
    SPREAD,
    X,
    Y,
    Z,
    add_face,
    add_shifted,
    get_series,
    put_series,
    sum_lanes,
)
from renderer.jit.decorators import inlined, kernel
from renderer.numerics.simd import extract, load, maximum, pointer, select, splat4, square_root, store
from renderer.system.threads import for_chunks
from renderer.trace.edge_signs import corner
from renderer.trace.intersect import face_in, load_corners
from renderer.trace.layout import BLOCK_FACES, BLOCK_WORDS, CHILDREN, NODE_WORDS, Tree, cache_aligned
from renderer.trace.trees import tree_pointers
from renderer.trace.walk import blocks_of, child_in, stack_size

# Nodes per chunk: some milliseconds, but for the first chunk, whose nodes hold all faces.
_NODES = 256
# An empty octant is so far away that no point ever comes near it, and its numbers are 0.
_FAR = 2.0**200
# The least radius, that of an octant whose corners coincide.
_LEAST = 2.0**-400
# More than rounding takes from a radius and from a spread.
_MORE = 1.0 + 2.0**-30
# More than an area errs by, as a share of half the product of two sides.
_AREA_ERROR = 2.0**-48


class Scratch(NamedTuple):
    """Memory of one thread.

    total, other, work  (ORDER + 1, ORDER + 2) complex, series
    stack, leaves       int64: the waiting nodes, and the leaves below an octant
    """

    total: NDArray[np.complex128]
    other: NDArray[np.complex128]
    work: NDArray[np.complex128]
    stack: NDArray[np.int64]
    leaves: NDArray[np.int64]


class _Axes(NamedTuple):
    """The rows of a block for each axis, as ``load_corners`` takes them."""

    row_x: int
    row_y: int
    row_z: int


def moments_of(tree: Tree, threads: int) -> NDArray[np.float64]:
    """(nodes * MOMENT_WORDS,) float64: the rows of ``multipoles`` of each node, kept with the tree."""
    kept = _KEPT.get(tree)
    return kept if kept is not None else _KEPT.setdefault(tree, _computed(tree, threads))


_KEPT: WeakKeyDictionary[Tree, NDArray[np.float64]] = WeakKeyDictionary()


def _computed(tree: Tree, threads: int) -> NDArray[np.float64]:
    count = len(tree.nodes) // NODE_WORDS
    rows, leaves = cache_aligned(count * MOMENT_WORDS, np.float64), _leaf_count(tree)

    def measure(begin: int, end: int) -> None:
        _measure_octants(tree.descriptor, rows, _scratch(tree, leaves), begin, end)

    for_chunks(measure, count, _NODES, threads)
    scratch = _scratch(tree, leaves)
    for end in range(count, 0, -_NODES):
        _join_octants(tree.descriptor, rows, scratch, max(0, end - _NODES), end)
    return rows


def _leaf_count(tree: Tree) -> int:
    """The number of leaves, counted, because a forged file may have more leaves than blocks."""
    links = tree.links.reshape(-1, NODE_WORDS)[:, CHILDREN : CHILDREN + 8]
    return int((links < 0).sum())


def _scratch(tree: Tree, leaves: int) -> Scratch:
    total, other, work = np.zeros((3, ORDER + 1, ORDER + 2), np.complex128)
    stack = np.empty(stack_size(tree.depth), np.int64)
    return Scratch(total, other, work, stack, np.empty(max(1, leaves), np.int64))


@kernel
def _measure_octants(descriptor, rows, scratch, begin, end):
    """Write the centres, radii, sizes and spreads of the octants of some nodes, and the coefficients of leaves."""
    tree, rows = tree_pointers(descriptor), pointer(rows)
    for node in range(begin, end):
        for place in range(8):
            base, link = node * MOMENT_WORDS + place, child_in(tree, node, place)
            scratch.total[:] = 0.0
            if not _is_used(tree, node, place):
                store(rows, base + 8 * X, _FAR)
                store(rows, base + 8 * Y, _FAR)
                store(rows, base + 8 * Z, _FAR)
                store(rows, base + 8 * RADIUS, 0.0)
                store(rows, base + 8 * SIZE, 0.0)
                store(rows, base + 8 * SPREAD, 0.0)
                put_series(rows, base, scratch.total)
                continue
            count = _list_leaves(tree, link, scratch)
            centre, radius = _measure(tree, scratch, count, rows, base)
            if link < 0:
                _add_faces(tree, link, centre, radius, scratch)
                put_series(rows, base, scratch.total)


@inlined
def _is_used(tree, node, place):
    """Whether an octant is not empty, by its box."""
    return load(tree.nodes, node * NODE_WORDS + place) <= load(tree.nodes, node * NODE_WORDS + place + 8)


@kernel
def _list_leaves(tree, link, scratch):
    """List the leaves behind a link; returns their number."""
    top, count = 1, 0
    scratch.stack[0] = link
    while top > 0:
        top -= 1
        child = scratch.stack[top]
        if child < 0:
            scratch.leaves[count] = child
            count += 1
            continue
        for place in range(8):
            if _is_used(tree, child, place):
                scratch.stack[top] = child_in(tree, child, place)
                top += 1
    return count


@kernel
def _measure(tree, scratch, count, rows, base):
    """Write an octant's size and spread. Returns the centre and radius of its faces."""
    first, _ = blocks_of(scratch.leaves[0])
    centre, size = _centre(tree, scratch, count, corner(tree, first * BLOCK_WORDS))
    radius = maximum(np.sqrt(_farthest(tree, scratch, count, centre)) * _MORE, _LEAST)
    spread = _spread(tree, scratch, count, centre, 1.0 / (radius * radius))
    store(rows, base + 8 * X, centre[0])
    store(rows, base + 8 * Y, centre[1])
    store(rows, base + 8 * Z, centre[2])
    store(rows, base + 8 * RADIUS, radius)
    store(rows, base + 8 * SIZE, size / (radius * radius) / (4.0 * math.pi))
    store(rows, base + 8 * SPREAD, spread / size * _MORE if size > 0.0 else 0.0)
    return centre, radius


@kernel
def _centre(tree, scratch, count, near):
    """The mean of the faces weighted by size, and their total size; ``near`` is one of their corners."""
    zero = splat4(0.0)
    x, y, z, total = zero, zero, zero, zero
    for k in range(count):
        first, blocks = blocks_of(scratch.leaves[k])
        for block in range(first, first + blocks):
            a, b, c = _faces(tree, block, near)
            size, _ = _sizes(a, b, c)
            x, y, z = x + size * (a[0] + b[0] + c[0]), y + size * (a[1] + b[1] + c[1]), z + size * (a[2] + b[2] + c[2])
            total = total + size
    size = sum_lanes(total)
    share = 1.0 / (3.0 * size) if size > 0.0 else 0.0
    return (near[0] + share * sum_lanes(x), near[1] + share * sum_lanes(y), near[2] + share * sum_lanes(z)), size


@kernel
def _farthest(tree, scratch, count, centre):
    """The largest squared distance of a corner from the centre."""
    most = splat4(0.0)
    for k in range(count):
        first, blocks = blocks_of(scratch.leaves[k])
        for block in range(first, first + blocks):
            for vertex in _faces(tree, block, centre):
                square = _square(vertex)
                most = select(square > most, square, most)
    return maximum(maximum(extract(most, 0), extract(most, 1)), maximum(extract(most, 2), extract(most, 3)))


@kernel
def _spread(tree, scratch, count, centre, unit):
    """The integral over the faces of their distance from the centre to the power ORDER; ``unit`` times its square is 1
    at the radius.

    That power is convex, so its mean over a face is at most that of its corners.
    """
    total = splat4(0.0)
    for k in range(count):
        first, blocks = blocks_of(scratch.leaves[k])
        for block in range(first, first + blocks):
            a, b, c = _faces(tree, block, centre)
            _, area = _sizes(a, b, c)
            for vertex in (a, b, c):
                power, square = area, _square(vertex) * splat4(unit)
                for _ in range(ORDER // 2):
                    power = power * square
                total = total + power
    return sum_lanes(total) / 3.0


@inlined
def _faces(tree, block, centre):
    """The corners of a block's faces less the centre, 0 in unused places."""
    x0, x1, x2, y0, y1, y2, z0, z1, z2 = load_corners(tree, block * BLOCK_WORDS, _Axes(0, 4, 8))
    # Unused places hold NaN, which equals nothing.
    zero, used = splat4(0.0), x0 == x0
    x, y, z = splat4(centre[0]), splat4(centre[1]), splat4(centre[2])
    return (
        (select(used, x0 - x, zero), select(used, y0 - y, zero), select(used, z0 - z, zero)),
        (select(used, x1 - x, zero), select(used, y1 - y, zero), select(used, z1 - z, zero)),
        (select(used, x2 - x, zero), select(used, y2 - y, zero), select(used, z2 - z, zero)),
    )


@inlined
def _sizes(a, b, c):
    """Half the products of two sides of four faces, and upper bounds of their areas."""
    zero, one = splat4(0.0), splat4(1.0)
    b, c = (b[0] - a[0], b[1] - a[1], b[2] - a[2]), (c[0] - a[0], c[1] - a[1], c[2] - a[2])
    long_b, long_c = square_root(_square(b)), square_root(_square(c))
    size = splat4(0.5) * long_b * long_c
    # By the sine of their angle from directions, because the square of a product may vanish.
    share_b, share_c = one / long_b, one / long_c
    bx, by, bz, cx, cy, cz = (
        b[0] * share_b, b[1] * share_b, b[2] * share_b, c[0] * share_c, c[1] * share_c, c[2] * share_c
    )  # fmt: skip
    sine = square_root(_square((by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx)))
    return size, select(size > zero, size * (sine + splat4(_AREA_ERROR)), zero)


@inlined
def _square(a):
    return a[0] * a[0] + a[1] * a[1] + a[2] * a[2]


@kernel
def _add_faces(tree, link, centre, radius, scratch):
    """Add the series of a leaf's faces to ``scratch.total``."""
    first, count = blocks_of(link)
    unit = 1.0 / radius
    for place in range(first * BLOCK_FACES, (first + count) * BLOCK_FACES):
        if face_in(tree, place) >= 0:
            at = (place // BLOCK_FACES) * BLOCK_WORDS + place % BLOCK_FACES
            a, b, c = corner(tree, at), corner(tree, at + 12), corner(tree, at + 24)
            d, e = _scaled(b, a, unit), _scaled(c, a, unit)
            area = (
                0.5 * (d[1] * e[2] - d[2] * e[1]), 0.5 * (d[2] * e[0] - d[0] * e[2]), 0.5 * (d[0] * e[1] - d[1] * e[0])
            )  # fmt: skip
            a, b, c = _scaled(a, centre, unit), _scaled(b, centre, unit), _scaled(c, centre, unit)
            add_face(scratch.total, a, b, c, area, scratch.work)


@inlined
def _scaled(a, b, unit):
    return (a[0] - b[0]) * unit, (a[1] - b[1]) * unit, (a[2] - b[2]) * unit


@kernel
def _join_octants(descriptor, rows, scratch, begin, end):
    """Write the coefficients of octants that are nodes themselves, last to first: a child comes after its parent."""
    tree, rows = tree_pointers(descriptor), pointer(rows)
    for node in range(end - 1, begin - 1, -1):
        for place in range(8):
            child = child_in(tree, node, place)
            if child < 0:
                continue
            base = node * MOMENT_WORDS + place
            centre, radius = (
                (load(rows, base), load(rows, base + 8), load(rows, base + 16)),
                load(rows, base + 8 * RADIUS),
            )
            scratch.total[:] = 0.0
            for k in range(8):
                if _is_used(tree, child, k):
                    at = child * MOMENT_WORDS + k
                    get_series(rows, at, load(rows, at + 8 * RADIUS) / radius, scratch.other)
                    shift = _scaled((load(rows, at), load(rows, at + 8), load(rows, at + 16)), centre, 1.0 / radius)
                    add_shifted(scratch.total, scratch.other, shift, scratch.work)
            put_series(rows, base, scratch.total)

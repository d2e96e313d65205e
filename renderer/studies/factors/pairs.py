"""Pairs of faces whose exchange is known without rays: those that see each other whole, or not at all."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.simd import load, local_doubles, maximum, minimum, offset, pointer
from renderer.numerics.vec3 import add, cross, dot, largest_component, put3, row3, scale, sub
from renderer.queryable import Built
from renderer.studies.factors.contour import RULES, exchange_of
from renderer.studies.factors.shaft import MOST_PLANES, PLANE, ROUNDING, Shaft, is_clear, with_planes
from renderer.system.threads import for_chunks
from renderer.trace.closest import rays_against_blocks
from renderer.trace.layout import Tree
from renderer.trace.trees import tree_pointers
from renderer.trace.walk import stack_size

# Pairs of a chunk, and of a call, so that Ctrl-C need not wait: most pairs take some microseconds, but milliseconds if
# thousands of faces touch their hull.
_CHUNK, _CALL = 512, 32
# Where a kernel keeps both polygons, their normals and their planes; a triangle cut by one plane has four corners.
_CORNERS, _CUT, _NORMALS, _PLANES = 0, 24, 48, 54
assert _PLANES + PLANE * MOST_PLANES <= 500
# A triangle that is narrower than so many roundings of its coordinates has no plane.
_NO_PLANE = 2.0**10
# No corner is taken to be in a plane that is farther off than so, as a share of the size of both triangles.
_IN_PLANE = 2.0**-24
# An exchange is known if its error is at most this share of itself, or this share of the area of each face, so that it
# is lost in their rows. Needles and what is seen edge-on lose digits.
_RELATIVE, _OF_AREAS = 1e-7, 1e-11
# The sides of a plane on which a triangle's corners are: behind or in it, before or in it, in it, on both.
_BEHIND, _BEFORE, _IN, _ACROSS = range(4)


class _Plane(NamedTuple):
    """A triangle's plane: its unit normal, its height, and how far from it rounding may put a corner of the other."""

    normal: tuple[float, float, float]
    height: float
    room: float


class _Known(NamedTuple):
    """The exchange of a pair, and whether it is known."""

    exchange: float
    known: bool


def exact_pairs(
    built: Built,
    pairs: NDArray[np.int64],
    threads: int,
    update: Callable[[int], object] | None = None,
    *,
    both: bool = False,
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """The exchange of pairs of faces, and which of them are known.

    Parameters
    ----------
    built : Built
        The mesh and its tree.
    pairs : ndarray of int64, shape (k, 2)
        Numbers of two faces, the lower first.
    threads : int
    update : callable, optional
        Is called with the number of pairs done since the last call, which may be 0, by one thread at a time.
    both : bool, default False
        Faces send and receive on both sides.

    Returns
    -------
    exchange : ndarray of float64, shape (k,)
        A_i F_ij in the unit of the vertices squared, A_i the area of one side; 0 where it is not known.
    known : ndarray of bool, shape (k,)
        Whether it is proven that the faces see each other whole as far as one lies before the other, or not at all.

    Notes
    -----
    The proof moves vertices by some roundings of their largest coordinate, see ``shaft``. The exchange errs by 1e-11 of
    itself at most where faces are far apart, else by 4e-15 of the product of their sizes. Of needles and of faces seen
    edge-on that may be much: a pair is known only if it is at most 1e-7 of the exchange or 1e-11 of the area of each.

    Examples
    --------
    >>> import numpy as np
    >>> from renderer import Octree
    >>> from renderer.studies.factors.pairs import exact_pairs
    >>> corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 1, 1], [1, 0, 1]]
    >>> exchange, known = exact_pairs(Octree(corners, [[0, 1, 2], [3, 4, 5]])._built, np.array([[0, 1]]), 1)
    >>> known.tolist(), exchange.round(6).tolist()
    ([True], [0.057525])
    """
    mesh, tree = built
    exchange, known = np.zeros(len(pairs)), np.zeros(len(pairs), np.bool_)
    if len(pairs) == 0:
        return exchange, known
    lower, upper = mesh.bounds
    farthest = float(np.maximum(-lower, upper).max()) * tree.scale
    pairs = np.array(pairs, np.int64)

    def find(begin: int, end: int) -> Iterator[None]:
        stack = np.empty(stack_size(tree.depth), np.int64)
        mine = (tree.descriptor, mesh.vertices, mesh.faces, pairs, both, farthest, RULES, exchange, known, stack)
        for first in range(begin, end, _CALL):
            find_pairs(*mine, first, min(first + _CALL, end))
            yield

    for_chunks(find, len(pairs), _chunk(tree), threads, update)
    return exchange, known


def _chunk(tree: Tree) -> int:
    return _CHUNK if tree.has_nodes else min(_CHUNK, rays_against_blocks(tree))


@kernel
def find_pairs(descriptor, vertices, faces, pairs, both, farthest, rules, exchange, known, stack, begin, end):
    """Write the exchange of the pairs begin:end, and whether it is known.

    farthest  the largest coordinate of the mesh, in the tree's units
    stack     memory for ``walk.stack_size`` int64
    """
    tree = tree_pointers(descriptor)
    strict, memory = ROUNDING * farthest, local_doubles()
    for row in range(begin, end):
        a, b = pairs[row, 0], pairs[row, 1]
        origin = _vertex(vertices, faces, a, 0, tree.scale)
        for k in range(3):
            put3(memory, _CORNERS + 3 * k, sub(_vertex(vertices, faces, a, k, tree.scale), origin))
            put3(memory, _CORNERS + 9 + 3 * k, sub(_vertex(vertices, faces, b, k, tree.scale), origin))
        found = _exchange(tree, pointer(stack), memory, _Pair(a, b, origin, strict, both), pointer(rules))
        exchange[row], known[row] = found.exchange / (tree.scale * tree.scale), found.known


class _Pair(NamedTuple):
    """Two faces, the corner that their coordinates are relative to, and ``Shaft.strict``."""

    a: int
    b: int
    origin: tuple[float, float, float]
    strict: float
    both: bool


@inlined
def _vertex(vertices, faces, face, k, unit):
    """A face's k-th corner in the tree's units."""
    row = np.int64(faces[face, k])
    return unit * vertices[row, 0], unit * vertices[row, 1], unit * vertices[row, 2]


@kernel
def _exchange(tree, stack, memory, pair, rules):
    """The ``_Known`` of the two triangles at ``memory``."""
    unknown, none = _Known(0.0, False), _Known(0.0, True)
    size, largest = _size(memory), _largest(memory, pair.origin)
    width_a, width_b = _width(memory, 3), _width(offset(memory, 9), 3)
    if width_a == 0.0 or width_b == 0.0:
        return none
    if minimum(width_a, width_b) < _NO_PLANE * ROUNDING * largest:
        return unknown
    error, most = ROUNDING * largest, _IN_PLANE * size
    plane_a = _plane(memory, minimum(error * (1.0 + size / width_a), most))
    plane_b = _plane(offset(memory, 9), minimum(error * (1.0 + size / width_b), most))
    side_a, side_b = _side(plane_b, memory), _side(plane_a, offset(memory, 9))
    if side_a == _IN or side_b == _IN:
        # Faces that lie on each other, front to front, may see each other whole or not at all.
        alike = not pair.both and dot(plane_a.normal, plane_b.normal) > 0.0
        return none if alike or _lie_side_by_side(memory, plane_a, plane_b) else unknown
    if pair.both and (side_a == _ACROSS or side_b == _ACROSS):
        return unknown
    if not pair.both and (side_a == _BEHIND or side_b == _BEHIND):
        return none
    # Keep what each sees of the other.
    corners = offset(memory, _CUT)
    n = _cut(memory, plane_b, side_a, corners)
    m = _cut(offset(memory, 9), plane_a, side_b, offset(corners, 3 * n))
    width = minimum(_width(corners, n), _width(offset(corners, 3 * n), m))
    if width == 0.0:
        return unknown
    put3(memory, _NORMALS, plane_a.normal if side_b != _BEHIND else scale(plane_a.normal, -1.0))
    put3(memory, _NORMALS + 3, plane_b.normal if side_a != _BEHIND else scale(plane_b.normal, -1.0))
    shaft = with_planes(
        Shaft(
            corners, n, m, offset(memory, _NORMALS), offset(memory, _PLANES), np.int64(0), pair.origin, size,
            width, largest, pair.strict, pair.a, pair.b,
        )
    )  # fmt: skip
    if not is_clear(tree, stack, shaft):
        return unknown
    found = exchange_of(corners, n, offset(corners, 3 * n), m, rules)
    area = abs(found.area) if pair.both else found.area
    limit = maximum(_RELATIVE * area, _OF_AREAS * minimum(_area(memory), _area(offset(memory, 9))))
    return _Known(area, True) if found.error <= limit and found.error < area else unknown


@kernel
def _size(corners):
    """The largest distance along an axis of six corners."""
    most = 0.0
    for axis in range(3):
        low, high = np.inf, -np.inf
        for k in range(6):
            x = load(corners, 3 * k + axis)
            low, high = minimum(low, x), maximum(high, x)
        most = maximum(most, high - low)
    return most


@kernel
def _largest(corners, origin):
    """The largest coordinate of six corners."""
    most = 0.0
    for k in range(6):
        most = maximum(most, largest_component(add(row3(corners, k), origin)))
    return most


@kernel
def _width(corners, n):
    """Twice the area of a polygon by its longest distance from the first corner; at most twice the least width."""
    double, longest, p = (0.0, 0.0, 0.0), 0.0, row3(corners, 0)
    for k in range(1, n):
        way = sub(row3(corners, k), p)
        longest = maximum(longest, dot(way, way))
        if k + 1 < n:
            double = add(double, cross(way, sub(row3(corners, k + 1), p)))
    return math.sqrt(dot(double, double) / longest) if longest > 0.0 else 0.0


@kernel
def _area(corners):
    """The area of a triangle."""
    p = row3(corners, 0)
    double = cross(sub(row3(corners, 1), p), sub(row3(corners, 2), p))
    return 0.5 * math.sqrt(dot(double, double))


@kernel
def _plane(corners, room):
    """The ``_Plane`` of a triangle."""
    p = row3(corners, 0)
    normal = cross(sub(row3(corners, 1), p), sub(row3(corners, 2), p))
    normal = scale(normal, 1.0 / math.sqrt(dot(normal, normal)))
    return _Plane(normal, dot(normal, p), room)


@kernel
def _side(plane, corners):
    """On which side of a plane a triangle lies."""
    low, high = np.inf, -np.inf
    for k in range(3):
        height = dot(plane.normal, row3(corners, k)) - plane.height
        low, high = minimum(low, height), maximum(high, height)
    if low >= -plane.room:
        return _IN if high <= plane.room else _BEFORE
    return _BEHIND if high <= plane.room else _ACROSS


@kernel
def _lie_side_by_side(corners, plane_a, plane_b):
    """Whether an edge of one of two triangles in one plane parts them."""
    for first in range(2):
        own, other = offset(corners, 9 * first), offset(corners, 9 - 9 * first)
        plane = plane_b if first == 1 else plane_a
        for k in range(3):
            p = row3(own, k)
            edge = sub(row3(own, k + 1 if k < 2 else 0), p)
            out, least = cross(edge, plane.normal), np.inf
            for corner in range(3):
                least = minimum(least, dot(out, sub(row3(other, corner), p)))
            if least >= -plane.room * math.sqrt(dot(edge, edge)):
                return True
    return False


@kernel
def _cut(corners, plane, side, out):
    """Write the part of a triangle before a plane to ``out``, or all of one that it does not cross. Returns the number
    of corners.
    """
    count = np.int64(0)
    for k in range(3):
        p, q = row3(corners, k), row3(corners, k + 1 if k < 2 else 0)
        height, next_height = dot(plane.normal, p) - plane.height, dot(plane.normal, q) - plane.height
        if side != _ACROSS or height >= 0.0:
            put3(out, 3 * count, p)
            count += 1
        if side == _ACROSS and (height < 0.0) != (next_height < 0.0):
            put3(out, 3 * count, add(p, scale(sub(q, p), height / (height - next_height))))
            count += 1
    return count

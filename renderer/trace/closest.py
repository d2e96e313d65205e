"""Closest and any hits of a batch of rays: in chunks, on threads."""

import threading
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.jit.decorators import entry_of
from renderer.mesh.mesh import Mesh
from renderer.results.hits import Hits
from renderer.system.spare import recycled
from renderer.system.threads import for_chunks
from renderer.trace.batch import ALONE, CHUNK, INFINITY, NO_STARTS, ZERO, RayBatch, count_rays, reject
from renderer.trace.layout import BLOCK_FACES, Tree
from renderer.trace.ray_lanes import WIDTH
from renderer.trace.rays import HitArrays
from renderer.trace.single import FEW_DEPTH, UNRESOLVED, trace_carefully, trace_few
from renderer.trace.traverse import holders_in, is_deep_enough, new_scratch, search_chunk, trace_chunk

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Flags = NDArray[np.bool_]

# Few rays go in smaller chunks, sixteen per thread, so that no thread has much more to do than another.
_LEAST_CHUNK = 1024
# A chunk of brute force is so many tests of a ray against a block, at some nanoseconds per test.
_BLOCK_TESTS = 1 << 22
# Fewer rays than a packet holds go one by one, by a kernel that compiles in a fraction of the time.
FEW = WIDTH - 1
# In place of arrays that a query does not write.
_NO_T, _NO_FACE, _NO_HIT = np.empty(0), np.empty(0, np.int64), np.empty(0, np.bool_)
_INT = np.dtype(np.int64)


def closest_hits(
    tree: Tree, mesh: Mesh, threads: int, origins: Floats, directions: Floats,
    t_min: Floats = ZERO, t_max: Floats = INFINITY, starts: Integers = NO_STARTS,
) -> Hits:  # fmt: skip
    """Closest hits of the rays in the arrays of a ``RayBatch``; few rays notice how long it takes to make one."""
    count = count_rays(origins, directions)
    # Arrays of their own take less time to make than rows of one.
    new = np.empty if count <= _LEAST_CHUNK else recycled
    t, u, v = new(count), new(count), new(count)
    face, side = new(count, _INT), new(count, _INT)
    # Rays that start on no surface come upon the face that they hit.
    pile = None if starts is NO_STARTS else new(count, _INT)
    unread = side if pile is None else pile
    if count <= FEW and 0 < tree.depth <= FEW_DEPTH:
        row = _trace_few(tree, origins, directions, t_min, t_max, starts, t, face, u, v, side, unread)
    else:
        own = ALONE if starts is NO_STARTS else starts
        row = _trace(
            tree, threads, count,
            (tree.descriptor, origins, directions, t_min, t_max, own, t, face, u, v, side, unread, _NO_HIT, None),
        )  # fmt: skip
    if row >= 0:
        reject(RayBatch(origins, directions, t_min, t_max), row, tree.scale)
    return Hits(t, face, u, v, mesh, None, side, pile)


def any_hits(
    tree: Tree, threads: int, origins: Floats, directions: Floats,
    t_min: Floats = ZERO, t_max: Floats = INFINITY, starts: Integers = NO_STARTS,
) -> Flags:  # fmt: skip
    """Whether each of the rays in the arrays of a ``RayBatch`` hits anything."""
    count = count_rays(origins, directions)
    if count <= FEW and 0 < tree.depth <= FEW_DEPTH:
        unread, face, others = np.empty(count), np.empty(count, _INT), np.empty(count, _INT)
        row = _trace_few(tree, origins, directions, t_min, t_max, starts, unread, face, unread, unread, others, others)
        hit = face >= 0
    else:
        own, hit = ALONE if starts is NO_STARTS else starts, recycled(count, np.bool_)
        row = _trace(
            tree, threads, count,
            (tree.descriptor, origins, directions, t_min, t_max, own,
             _NO_T, _NO_FACE, _NO_T, _NO_T, _NO_FACE, _NO_FACE, hit, True),
        )  # fmt: skip
    if row >= 0:
        reject(RayBatch(origins, directions, t_min, t_max), row, tree.scale)
    return hit


def _trace_few(
    tree: Tree, origins: Floats, directions: Floats, t_min: Floats, t_max: Floats, starts: Integers,
    t: Floats, face: Integers, u: Floats, v: Floats, side: Integers, pile: Integers,
) -> int:  # fmt: skip
    """Write the closest hits of a few rays, on the caller's thread; returns the row of the first out of range, or less
    than 0.
    """
    row: int = UNRESOLVED
    if starts is NO_STARTS:
        row = entry_of(trace_few)(tree.descriptor, origins, directions, t_min, t_max, t, face, u, v, side)
    if row == UNRESOLVED:
        scratch, own = _take_scratch(tree.depth), ALONE if starts is NO_STARTS else starts
        row = trace_carefully(
            tree.descriptor, origins, directions, t_min, t_max, own, t, face, u, v, side, pile, _NO_HIT,
            holders_in(scratch),
        )  # fmt: skip
        _local.scratch = scratch
    return row


def rays_against_blocks(tree: Tree) -> int:
    """The number of rays in a chunk of brute force: some 10 ms of work, so that Ctrl-C need not wait."""
    return max(1, _BLOCK_TESTS * BLOCK_FACES // max(1, len(tree.faces)))


def _trace(tree: Tree, threads: int, count: int, arrays: tuple[Any, ...]) -> int:
    """Trace rays, in chunks on threads if they are many; returns the row of the first out of range, or -1.

    ``arrays`` are the arguments of ``trace_chunk`` up to ``any_hit``.
    """
    bad: list[int] = []
    if count <= _LEAST_CHUNK and tree.has_nodes:
        for _ in _rounds(tree, arrays, 0, count, bad):
            pass
        return bad[0] if bad else -1
    size = min(CHUNK, max(_LEAST_CHUNK, count // (16 * threads)))
    if not tree.has_nodes:
        size = min(size, rays_against_blocks(tree))

    def trace(begin: int, end: int) -> Iterator[None]:
        # Only chunks after a bad ray are left out, so the first bad ray is always found.
        return iter(()) if bad and bad[0] < begin else _rounds(tree, arrays, begin, end, bad)

    for_chunks(trace, count, size, threads)
    return min(bad, default=-1)


def find_range(
    tree: Tree, rays: RayBatch, found: HitArrays, any_hit: bool | None, begin: int, end: int, bad: list[int]
) -> Iterator[None]:
    """Trace up to CHUNK rays begin:end of a batch on the caller's thread, and yield where this can be stopped.

    If a ray is out of range, append the row of the first to ``bad``.
    """
    own = ALONE if rays.starts is NO_STARTS else rays.starts
    return _rounds(tree, (tree.descriptor, *rays[:4], own, *found, any_hit), begin, end, bad)


def _rounds(tree: Tree, arrays: tuple[Any, ...], begin: int, end: int, bad: list[int]) -> Iterator[None]:
    """``find_range``, by the ``arrays`` of ``_trace``."""
    scratch, row = _take_scratch(tree.depth), -1
    if tree.has_nodes:
        chunk, reached, following, waiting = entry_of(trace_chunk), begin, 0, 0
        while row < 0 and (reached < end or following < waiting):
            reached, following, waiting, row = chunk(*arrays, scratch, reached, following, waiting, end)
            yield
    else:
        row = search_chunk(*arrays, holders_in(scratch), begin, end)
    _local.scratch = scratch
    if row >= 0:
        bad.append(int(row))


class _Local(threading.local):
    """The scratch of a thread, kept from one chunk to the next: 4 MB, of which most rays touch 100 kB."""

    scratch: Integers | None = None


_local = _Local()


def _take_scratch(depth: int) -> Integers:
    """The thread's scratch, or a new one. It is taken away, because a signal handler may trace rays during a chunk."""
    scratch, _local.scratch = _local.scratch, None
    if scratch is None or not is_deep_enough(scratch, depth):
        scratch = new_scratch(depth, CHUNK)
    return scratch

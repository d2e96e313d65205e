"""Closest and any hits of a batch of rays: in chunks, on threads."""

import threading
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.results.hits import Hits
from renderer.system.threads import for_chunks
from renderer.trace.batch import ALONE, CHUNK, NO_STARTS, RayBatch, reject
from renderer.trace.layout import BLOCK_FACES, Tree
from renderer.trace.ray_lanes import WIDTH
from renderer.trace.rays import HIT_ROWS
from renderer.trace.single import FEW_DEPTH, trace_few
from renderer.trace.traverse import Progress, Scratch, new_scratch, search_chunk, trace_chunk
from renderer.trace.walk import stack_size

# Few rays go in smaller chunks, sixteen per thread, so that no thread has much more to do than another.
_LEAST_CHUNK = 1024
# A chunk of brute force is so many tests of a ray against a block, at some nanoseconds per test.
_BLOCK_TESTS = 1 << 22
# Fewer rays than a packet holds go one by one, by a kernel that compiles in a fraction of the time.
FEW = WIDTH - 1
# The scratch for the faces that hold a start, where no ray starts on the surface.
_NO_HOLDERS = np.empty(1, np.int64)


def closest_hits(tree: Tree, rays: RayBatch, mesh: Mesh, threads: int) -> Hits:
    """Closest hits of a batch."""
    count = rays.number
    if count <= FEW and 0 < tree.depth <= FEW_DEPTH:
        return _trace_few(tree, rays, count, mesh)
    out = np.empty((HIT_ROWS, count))
    _run(tree, rays, out, threads, any_hit=False)
    t, u, v, face, side, pile = out
    return Hits(t, face.view(np.int64), u, v, mesh, None, side.view(np.int64), pile.view(np.int64))


def any_hits(tree: Tree, rays: RayBatch, mesh: Mesh, threads: int) -> NDArray[np.bool_]:
    """Whether each ray of a batch hits anything."""
    count = rays.number
    if count <= FEW and 0 < tree.depth <= FEW_DEPTH:
        return _trace_few(tree, rays, count, mesh).face >= 0
    # In whole words, so that kernels are compiled for one kind of output.
    out = np.empty((1, -(-count // 8)))
    _run(tree, rays, out, threads, any_hit=True)
    return out.view(np.bool_)[0, :count]


def _trace_few(tree: Tree, rays: RayBatch, count: int, mesh: Mesh) -> Hits:
    """Closest hits of a few rays on the caller's thread, in arrays of their own: rows of one would take longer."""
    t, u, v = np.empty(count), np.empty(count), np.empty(count)
    face, side, pile = np.empty(count, np.int64), np.empty(count, np.int64), np.empty(count, np.int64)
    origins, directions, t_min, t_max, starts = rays
    alone = starts is NO_STARTS
    scratch = None if alone else _take_scratch(tree.depth)
    row = trace_few(
        tree.descriptor, origins, directions, t_min, t_max, ALONE if alone else starts, t, face, u, v, side, pile,
        _NO_HOLDERS if scratch is None else scratch.holders,
    )  # fmt: skip
    if scratch is not None:
        _local.scratch = scratch
    if row >= 0:
        reject(rays, row, tree.scale)
    return Hits(t, face, u, v, mesh, None, side, pile)


def rays_against_blocks(tree: Tree) -> int:
    """The number of rays in a chunk of brute force: some 10 ms of work, so that Ctrl-C need not wait."""
    return max(1, _BLOCK_TESTS * BLOCK_FACES // max(1, len(tree.faces)))


def _run(tree: Tree, rays: RayBatch, out: NDArray[np.float64], threads: int, any_hit: bool) -> None:
    count = rays.number
    size = min(CHUNK, max(_LEAST_CHUNK, count // (16 * threads)))
    if not tree.has_nodes:
        size = min(size, rays_against_blocks(tree))
    bad, starts = list[int](), ALONE if rays.starts is NO_STARTS else rays.starts
    given = (*rays[:-1], starts)

    def trace(begin: int, end: int) -> Iterator[None]:
        # Only chunks after a bad ray are left out, so the first bad ray is always found.
        if bad and bad[0] < begin:
            return
        if not tree.has_nodes:
            scratch = _take_scratch(tree.depth)
            row = search_chunk(tree.descriptor, *given, out, begin, end, any_hit, scratch.holders)
            _local.scratch = scratch
            if row >= 0:
                bad.append(row)
            return
        scratch, progress = _take_scratch(tree.depth), Progress(begin, 0, 0)
        while progress.begin < end or progress.following < progress.count:
            *reached, row = trace_chunk(tree.descriptor, *given, out, progress, end, any_hit, scratch)
            progress = Progress(*reached)
            if row >= 0:
                bad.append(row)
                break
            yield
        _local.scratch = scratch

    if count <= size:
        for _ in trace(0, count):
            pass
    else:
        for_chunks(trace, count, size, threads)
    if bad:
        reject(rays, min(bad), tree.scale)


class _Local(threading.local):
    """The scratch of a thread, kept from one chunk to the next: 100 kB."""

    scratch: Scratch | None = None


_local = _Local()


def _take_scratch(depth: int) -> Scratch:
    """The thread's scratch, or a new one. It is taken away, because a signal handler may trace rays during a chunk."""
    scratch, _local.scratch = _local.scratch, None
    if scratch is None or scratch.stack_size < stack_size(depth):
        scratch = new_scratch(depth, CHUNK)
    return scratch

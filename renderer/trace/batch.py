"""Queries of a batch of rays, as Python calls them: a check of the rays, and their hits row by row."""

import numpy as np

from renderer.kernels.jit import inlined, kernel
from renderer.kernels.simd import LOCAL_WORDS, get, larger, local_words, pointer
from renderer.limits import FARTHEST, LONGEST, SHORTEST
from renderer.trace.leaf import NO_FACE, tree_pointers
from renderer.trace.traverse import (
    HitPointers,
    RayPointers,
    depth_of_stack,
    make_scratch,
    ray_at,
    search_blocks,
    search_singly,
    trace,
)

# The deepest tree whose stack fits into a kernel's own frame.
FEW_DEPTH = depth_of_stack(LOCAL_WORDS)


@kernel
def _first_bad_ray(rays, begin, end):
    """Row of the first ray of a range that is out of bounds, or -1. NaN fails every comparison, so it is too.

    In range: components of ``scale`` times the origin up to FARTHEST, the largest component of the direction from
    SHORTEST to LONGEST.
    """
    for i in range(begin, end):
        far, largest, odd = 0.0, 0.0, 0.0
        for k in range(3):
            o, d = get(rays.origins, i * rays.origin_step + k), get(rays.directions, 3 * i + k)
            far, largest = larger(far, abs(o)), larger(largest, abs(d))
            # A NaN is never larger, but x - x is NaN for NaN and inf, and 0 otherwise.
            odd += (o - o) + (d - d)
        if not (odd == 0.0 and far * rays.scale <= FARTHEST and SHORTEST <= largest <= LONGEST):
            return i
    return -1


@inlined
def _ray_pointers(rays, scale):
    """``RayPointers`` of a batch (origins, directions, t_min, t_max); all but directions may have one row for all."""
    origins, directions, t_min, t_max = rays
    return RayPointers(
        pointer(origins), pointer(directions), pointer(t_min), pointer(t_max),
        3 * np.int64(len(origins) > 1), np.int64(len(t_min) > 1), np.int64(len(t_max) > 1), scale,
    )  # fmt: skip


@inlined
def _found_pointers(out):
    """``HitPointers`` of the arrays (t, face, u, v, hit)."""
    t, face, u, v, hit = out
    return HitPointers(pointer(t), pointer(face), pointer(u), pointer(v), pointer(hit))


@kernel
def trace_chunk(words, rays, out, begin, end, any_hit, memory):
    """Hits of the rays begin:end into the arrays of ``out``: t, face, u, v, or with ``any_hit`` only the fifth, hit.

    ``words`` are the tree's, which must have nodes. Returns the row of the first ray out of bounds, for which nothing
    is traced, or -1.
    """
    tree = tree_pointers(words)
    source = _ray_pointers(rays, tree.scale)
    bad = _first_bad_ray(source, begin, end)
    if bad < 0:
        trace(tree, source, _found_pointers(out), begin, end, make_scratch(memory), any_hit)
    return bad


@kernel
def search_chunk(words, rays, out, begin, end, any_hit):
    """``trace_chunk`` for a tree without nodes."""
    tree = tree_pointers(words)
    source = _ray_pointers(rays, tree.scale)
    bad = _first_bad_ray(source, begin, end)
    if bad < 0:
        search_blocks(tree, source, _found_pointers(out), begin, end, any_hit)
    return bad


@kernel
def trace_few(words, origins, directions, t_min, t_max, out):
    """Closest hits of so few rays that each goes alone: (4, n) ``out`` has rows t, u, v and the bits of face as int64.

    Bounds and return value as of ``trace_chunk``. The tree has at most FEW_DEPTH levels.
    """
    tree, count = tree_pointers(words), len(directions)
    source = _ray_pointers((origins, directions, t_min, t_max), tree.scale)
    bad = _first_bad_ray(source, 0, count)
    if bad >= 0:
        return bad
    stack = local_words()
    for i in range(count):
        ray, limit = ray_at(source, i)
        t, face, u, v, w = search_singly(tree, ray, limit, stack)
        hit = face != NO_FACE
        out[0, i] = t / tree.scale + 0.0 if hit else np.inf
        out[1, i] = u / w + 0.0 if hit else np.nan
        out[2, i] = v / w + 0.0 if hit else np.nan
        out[3, i] = np.int64(face if hit else -1).view(np.float64)
    return -1

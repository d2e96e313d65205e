"""Loops over a batch of rays, for kernels: a check of the input, and the one-ray queries row by row."""

import numpy as np

from renderer.jit import kernel
from renderer.leaf import view
from renderer.simd import keep, pointer
from renderer.traverse import Found, Rays, make_memory, make_scratch, trace

# Origins as far as float32 boxes can tell from infinity, and directions whose product with a determinant, at most
# 2^254 there, stays a normal float64 number, as does one of 2^-300 with the shortest.
FARTHEST = 2.0**126
SHORTEST, LONGEST = 2.0**-600, 2.0**700


@kernel
def _first_bad_ray(origins, directions, scale, begin, end):
    """Row of the first ray of a range that is out of bounds, or -1. NaN fails every comparison, so it is too.

    In range: components of ``scale`` times the origin up to FARTHEST, the largest component of the direction from
    SHORTEST to LONGEST.
    """
    step = np.int64(len(origins) > 1)
    for i in range(begin, end):
        o = i * step
        far = max(abs(origins[o, 0]), max(abs(origins[o, 1]), abs(origins[o, 2]))) * scale
        largest = max(abs(directions[i, 0]), max(abs(directions[i, 1]), abs(directions[i, 2])))
        # max drops a NaN in some places; x - x is NaN for NaN and inf and 0 otherwise.
        odd = 0.0
        for k in range(3):
            odd += (origins[o, k] - origins[o, k]) + (directions[i, k] - directions[i, k])
        if not (odd == 0.0 and far <= FARTHEST and SHORTEST <= largest <= LONGEST):
            return i
    return -1


@kernel
def trace_chunk(tree, depth, scale, rays, out, begin, end, any_hit):
    """Hits of rays[begin:end] into the arrays of ``out``: t, face, u, v, or with ``any_hit`` only the fifth, hit.

    ``scale``, a power of two, is what the tree's vertices were multiplied by; ``depth`` 0 tests every block. Origins,
    t_min and t_max have one row a ray or one for all. Returns the row of the first ray out of bounds, after which
    nothing is traced, or -1.
    """
    origins, directions, t_min, t_max = rays
    t, face, u, v, hit = out
    bad = _first_bad_ray(origins, directions, scale, begin, end)
    if bad >= 0:
        return bad
    memory = make_memory(depth, end - begin)
    source = Rays(
        pointer(origins), pointer(directions), pointer(t_min), pointer(t_max),
        3 * np.int64(len(origins) > 1), np.int64(len(t_min) > 1), np.int64(len(t_max) > 1), scale,
    )  # fmt: skip
    found = Found(pointer(t), pointer(face), pointer(u), pointer(v), pointer(hit))
    trace(view(tree), depth, source, found, begin, end, make_scratch(memory, depth), any_hit)
    keep(memory.floats)
    keep(memory.doubles)
    keep(memory.integers)
    return -1

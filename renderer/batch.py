"""Loops over a batch of rays, for kernels: a check of the input, and the one-ray queries row by row."""

import numpy as np

from renderer.intersect import Ray
from renderer.jit import kernel
from renderer.simd import keep, pointer
from renderer.traverse import NO_FACE, any_hit, any_hit_brute, closest_hit, closest_hit_brute, view

# Origins as far as float32 boxes can tell from infinity, and directions whose product with a determinant, at most
# 2^254 there, stays a normal float64 number, as does one of 2^-300 with the shortest.
FARTHEST = 2.0**126
SHORTEST, LONGEST = 2.0**-600, 2.0**700


@kernel
def first_bad_ray(origins, directions, scale):
    """Row of the first ray out of range, or -1. NaN fails every comparison, so it is out of range too.

    In range: components of ``scale`` times the origin up to FARTHEST, the largest component of the direction from
    SHORTEST to LONGEST.
    """
    for i in range(len(origins)):
        far = max(abs(origins[i, 0]), max(abs(origins[i, 1]), abs(origins[i, 2]))) * scale
        largest = max(abs(directions[i, 0]), max(abs(directions[i, 1]), abs(directions[i, 2])))
        # max drops a NaN in some places; x - x is NaN for NaN and inf and 0 otherwise.
        odd = 0.0
        for k in range(3):
            odd += (origins[i, k] - origins[i, k]) + (directions[i, k] - directions[i, k])
        if not (odd == 0.0 and far <= FARTHEST and SHORTEST <= largest <= LONGEST):
            return i
    return -1


@kernel
def closest_chunk(tree, depth, scale, rays, out, begin, end):
    """Closest hits of rays[begin:end] into the four arrays of ``out``; depth 0 tests every block.

    ``scale``, a power of two, is what the tree's vertices were multiplied by; it goes in and out of t exactly.
    """
    origins, directions, t_min, t_max = rays
    t_out, face_out, u_out, v_out = out
    scratch = np.empty(7 * depth + 8, np.int64)
    stack, seen = pointer(scratch), view(tree)
    for i in range(begin, end):
        low = scale * t_min[i if len(t_min) > 1 else 0]
        high = scale * t_max[i if len(t_max) > 1 else 0]
        ox, oy, oz = scale * origins[i, 0], scale * origins[i, 1], scale * origins[i, 2]
        ray = Ray(ox, oy, oz, directions[i, 0], directions[i, 1], directions[i, 2], low)
        if depth == 0:
            t, face, u, v = closest_hit_brute(seen, ray, high, stack)
        else:
            t, face, u, v = closest_hit(seen, ray, high, stack)
        if face == NO_FACE:
            t_out[i], face_out[i], u_out[i], v_out[i] = np.inf, -1, np.nan, np.nan
        else:
            t_out[i], face_out[i], u_out[i], v_out[i] = t / scale, face, u, v
    keep(scratch)


@kernel
def any_chunk(tree, depth, scale, rays, out, begin, end):
    """Whether anything is hit by each of rays[begin:end], into ``out``; arguments as for ``closest_chunk``."""
    origins, directions, t_min, t_max = rays
    scratch = np.empty(7 * depth + 8, np.int64)
    stack, seen = pointer(scratch), view(tree)
    for i in range(begin, end):
        low = scale * t_min[i if len(t_min) > 1 else 0]
        high = scale * t_max[i if len(t_max) > 1 else 0]
        ox, oy, oz = scale * origins[i, 0], scale * origins[i, 1], scale * origins[i, 2]
        ray = Ray(ox, oy, oz, directions[i, 0], directions[i, 1], directions[i, 2], low)
        if depth == 0:
            out[i] = any_hit_brute(seen, ray, high, stack)
        else:
            out[i] = any_hit(seen, ray, high, stack)
    keep(scratch)

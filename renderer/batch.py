"""Loops over a batch of rays, for kernels: a check of the input, and the one-ray queries row by row."""

import numpy as np

from renderer.jit import kernel
from renderer.traverse import NO_FACE, any_hit, any_hit_brute, closest_hit, closest_hit_brute


@kernel
def first_bad_ray(origins, directions):
    """Row of the first ray that is not finite or has a zero direction, or -1."""
    for i in range(len(origins)):
        total = 0.0
        for k in range(3):
            # x - x is 0 for a finite x and NaN for NaN and inf.
            total += (origins[i, k] - origins[i, k]) + (directions[i, k] - directions[i, k])
        zero = directions[i, 0] == 0.0 and directions[i, 1] == 0.0 and directions[i, 2] == 0.0
        if zero or total != 0.0:
            return i
    return -1


@kernel
def closest_chunk(tree, depth, brute, rays, out, begin, end):
    """Closest hits of rays[begin:end] into the four arrays of ``out``."""
    origins, directions, t_min, t_max = rays
    t_out, face_out, u_out, v_out = out
    stack = np.empty(7 * depth + 8, np.int64)
    for i in range(begin, end):
        ox, oy, oz = origins[i, 0], origins[i, 1], origins[i, 2]
        dx, dy, dz = directions[i, 0], directions[i, 1], directions[i, 2]
        low, high = t_min[i if len(t_min) > 1 else 0], t_max[i if len(t_max) > 1 else 0]
        if brute:
            t, face, u, v = closest_hit_brute(tree, ox, oy, oz, dx, dy, dz, low, high, stack)
        else:
            t, face, u, v = closest_hit(tree, ox, oy, oz, dx, dy, dz, low, high, stack)
        if face == NO_FACE:
            t_out[i], face_out[i], u_out[i], v_out[i] = np.inf, -1, np.nan, np.nan
        else:
            t_out[i], face_out[i], u_out[i], v_out[i] = t, face, u, v


@kernel
def any_chunk(tree, depth, brute, rays, out, begin, end):
    """Whether anything is hit by each of rays[begin:end], into ``out``."""
    origins, directions, t_min, t_max = rays
    stack = np.empty(7 * depth + 8, np.int64)
    for i in range(begin, end):
        ox, oy, oz = origins[i, 0], origins[i, 1], origins[i, 2]
        dx, dy, dz = directions[i, 0], directions[i, 1], directions[i, 2]
        low, high = t_min[i if len(t_min) > 1 else 0], t_max[i if len(t_max) > 1 else 0]
        if brute:
            out[i] = any_hit_brute(tree, ox, oy, oz, dx, dy, dz, low, high, stack)
        else:
            out[i] = any_hit(tree, ox, oy, oz, dx, dy, dz, low, high, stack)

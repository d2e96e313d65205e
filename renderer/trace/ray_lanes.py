"""Sixteen prepared rays side by side in memory: packets read whole rows, streams single lanes."""

from typing import Any, NamedTuple

import numpy as np

from renderer.jit.decorators import inlined
from renderer.numerics.kinds import of_none
from renderer.numerics.simd import broadcast_like, load, narrow, select, store
from renderer.trace.best import NO_FACE, Best
from renderer.trace.intersect import Shear, Slabs, box_limit, largest_of, make_shear, make_slabs, round_down
from renderer.trace.leaf import any_in_blocks, nearest_in_blocks
from renderer.trace.rays import eight_rays_at
from renderer.trace.starts.record import EDGE, no_start
from renderer.trace.walk import blocks_of

WIDTH = 16

# Rays are prepared in groups of sixteen lanes. In each of three arrays a group is GROUP_STRIDE values: sixteen rows, of
# which each has one value a lane. So what is the same of neighbouring rays is side by side, as vectors want it.
#
#              row 0           row 1 (WIDTH)              row 15
#           +----------------+----------------+--   --+----------------+
#   group 0 | lane 0 ... 15  | lane 0 ... 15  |  ...  | lane 0 ... 15  |
#           +----------------+----------------+--   --+----------------+
#   group 1 | lane 256 ..271 | ...               from GROUP_STRIDE on
#           +----------------+--
#
# A lane r is named by the place of its value in row 0: GROUP_STRIDE times its group and 0 to 15 in it. So the value of
# any row is at row + r. ``lane_index`` counts lanes without the gaps.
GROUP_STRIDE = 16 * WIDTH

# Rows of float32: the origins and reciprocals of ``Slabs``, three axes each; the least and the farthest distance that
# count, in units in which the largest component of the direction is 1; and the slopes along the two other axes in these
# units.
NEAR_ORIGIN, FAR_ORIGIN, NEAR_INVERSE, FAR_INVERSE = 0, 3 * WIDTH, 6 * WIDTH, 9 * WIDTH
LOWER, LIMIT, SLOPE_U, SLOPE_V = 12 * WIDTH, 13 * WIDTH, 14 * WIDTH, 15 * WIDTH
# Rows of float64: origin, shear and direction of ``Shear``; t_min, and the t of the best hit, at first t_max; the
# largest component of the direction; that hit's barycentric numerators and their denominator; and for a ray that leaves
# the surface its slack and its face.
ORIGIN, SHEAR, DIRECTION_Z, T_MIN, T = 0, 3 * WIDTH, 5 * WIDTH, 6 * WIDTH, 7 * WIDTH
LARGEST, U, V, W = 8 * WIDTH, 9 * WIDTH, 10 * WIDTH, 11 * WIDTH
SLACK, LEAVING = 12 * WIDTH, 13 * WIDTH
# Rows of int64: the near rows of a node and the rows of a block, three axes each; the best hit's face; the ray's next
# child, or the leaf that it hit; for a stream the top of its stack; its number; and whether an uncertain hit must be
# resolved.
NEAR_ROW, BLOCK_ROW, FACE = 0, 3 * WIDTH, 6 * WIDTH
CHILD, TOP, NUMBER, UNRESOLVED = 7 * WIDTH, 8 * WIDTH, 9 * WIDTH, 10 * WIDTH


class Prepared(NamedTuple):
    """Pointers to groups of rays: float32, float64 and int64. ``starts`` is None where no ray starts on the surface."""

    floats: Any
    doubles: Any
    integers: Any
    starts: Any


@inlined
def lane_of(group, k):
    """The k-th lane of a group."""
    return group * GROUP_STRIDE + k


@inlined
def lane_index(r):
    """The number of lanes before lane ``r``."""
    return (r // GROUP_STRIDE) * WIDTH + r % WIDTH


@inlined
def prepare_ray(rays, r, ray, t_max):
    """Write ``ray``, without a hit, to lane ``r``; or eight rays, as vectors, to the lanes from ``r`` on."""
    floats, doubles, integers = rays.floats, rays.doubles, rays.integers
    largest = largest_of(ray)
    slabs, shear = make_slabs(ray, largest), make_shear(ray)
    put_slabs(rays, r, slabs)
    store(floats, LOWER + r, round_down(ray.t_min * largest))
    store(floats, LIMIT + r, box_limit(t_max, largest))
    # The shear divides by a component that may be negative, the slopes divide by its absolute value.
    sign = select(shear.direction_z > 0.0, 1.0, -1.0)
    store(floats, SLOPE_U + r, narrow(shear.shear_x * sign))
    store(floats, SLOPE_V + r, narrow(shear.shear_y * sign))
    _put_axes(doubles, ORIGIN + r, shear.origin_x, shear.origin_y, shear.origin_z)
    store(doubles, SHEAR + r, shear.shear_x)
    store(doubles, SHEAR + WIDTH + r, shear.shear_y)
    store(doubles, DIRECTION_Z + r, shear.direction_z)
    store(doubles, T_MIN + r, ray.t_min)
    store(doubles, LARGEST + r, largest)
    of_none(rays.starts, _put_no_start, _put_start)(doubles, r, ray)
    _put_axes(integers, BLOCK_ROW + r, shear.row_x, shear.row_y, shear.row_z)
    store(doubles, T + r, t_max)
    store(integers, FACE + r, broadcast_like(np.int64(NO_FACE), t_max))


@inlined
def _put_no_start(doubles, r, ray):
    pass


@inlined
def _put_start(doubles, r, ray):
    store(doubles, SLACK + r, ray.slack)
    store(doubles, LEAVING + r, ray.leaving)


@inlined
def start_of(rays, r):
    """The ray's slack, and the face that it starts on."""
    return of_none(rays.starts, no_start, _start_in_lane)(rays.doubles, r)


@inlined
def _start_in_lane(doubles, r):
    return load(doubles, SLACK + r), load(doubles, LEAVING + r)


@inlined
def put_slabs(rays, r, slabs):
    """Write ``Slabs`` to lane ``r``, or those of eight rays to the lanes from ``r`` on."""
    floats = rays.floats
    _put_axes(floats, NEAR_ORIGIN + r, slabs.near_origin_x, slabs.near_origin_y, slabs.near_origin_z)
    _put_axes(floats, FAR_ORIGIN + r, slabs.far_origin_x, slabs.far_origin_y, slabs.far_origin_z)
    _put_axes(floats, NEAR_INVERSE + r, slabs.near_inverse_x, slabs.near_inverse_y, slabs.near_inverse_z)
    _put_axes(floats, FAR_INVERSE + r, slabs.far_inverse_x, slabs.far_inverse_y, slabs.far_inverse_z)
    _put_axes(rays.integers, NEAR_ROW + r, slabs.near_x, slabs.near_y, slabs.near_z)


@inlined
def prepare_eight(rays, prepared, r, numbers):
    """Write the eight rays numbered at ``numbers`` to the lanes from ``r`` on."""
    ray, t_max = eight_rays_at(rays, numbers)
    # A ray from an edge goes through no box here.
    t_max = select(ray.slack == EDGE, -1.0, t_max)
    prepare_ray(prepared, r, ray, t_max)


@inlined
def _put_axes(base, first, x, y, z):
    store(base, first, x)
    store(base, first + WIDTH, y)
    store(base, first + 2 * WIDTH, z)


@inlined
def slabs_of(rays, r):
    """The ray's ``Slabs``."""
    floats, integers = rays.floats, rays.integers
    row = NEAR_ROW + r
    nx, ny, nz = load(integers, row), load(integers, row + WIDTH), load(integers, row + 2 * WIDTH)
    return Slabs(
        nx, ny, nz, 8 - nx, 40 - ny, 72 - nz,
        load(floats, NEAR_ORIGIN + r), load(floats, NEAR_ORIGIN + WIDTH + r), load(floats, NEAR_ORIGIN + 2 * WIDTH + r),
        load(floats, FAR_ORIGIN + r), load(floats, FAR_ORIGIN + WIDTH + r), load(floats, FAR_ORIGIN + 2 * WIDTH + r),
        load(floats, NEAR_INVERSE + r), load(floats, NEAR_INVERSE + WIDTH + r),
        load(floats, NEAR_INVERSE + 2 * WIDTH + r),
        load(floats, FAR_INVERSE + r), load(floats, FAR_INVERSE + WIDTH + r), load(floats, FAR_INVERSE + 2 * WIDTH + r),
    )  # fmt: skip


@inlined
def shear_of(rays, r):
    doubles, integers = rays.doubles, rays.integers
    return Shear(
        load(integers, BLOCK_ROW + r), load(integers, BLOCK_ROW + WIDTH + r), load(integers, BLOCK_ROW + 2 * WIDTH + r),
        load(doubles, ORIGIN + r), load(doubles, ORIGIN + WIDTH + r), load(doubles, ORIGIN + 2 * WIDTH + r),
        load(doubles, SHEAR + r), load(doubles, SHEAR + WIDTH + r), load(doubles, DIRECTION_Z + r),
        *start_of(rays, r),
    )  # fmt: skip


@inlined
def best_of(rays, r):
    """The ``Best`` hit so far."""
    doubles, face = rays.doubles, np.int32(load(rays.integers, FACE + r))
    return Best(load(doubles, T + r), face, load(doubles, U + r), load(doubles, V + r), load(doubles, W + r))


@inlined
def put_best(rays, r, best):
    store(rays.doubles, T + r, best.t)
    store(rays.integers, FACE + r, np.int64(best.face))
    store(rays.doubles, U + r, best.u)
    store(rays.doubles, V + r, best.v)
    store(rays.doubles, W + r, best.w)


@inlined
def put_any(rays, r):
    """Note that ray ``r`` has a hit: a face that is not NO_FACE. Reading the right one would take time."""
    store(rays.integers, FACE + r, 0)


@inlined
def nearest_in_leaf(tree, rays, r, leaf):
    """Test a leaf, a negative child, for a better hit of ray ``r``.

    Returns whether the ray has a hit now, and whether an uncertain one must be resolved.
    """
    first, count = blocks_of(leaf)
    t_min = load(rays.doubles, T_MIN + r)
    best, unresolved = nearest_in_blocks(tree, first, count, t_min, shear_of(rays, r), best_of(rays, r))
    # rule: weights-of-hit
    put_best(rays, r, best)
    store(rays.floats, LIMIT + r, box_limit(best.t, load(rays.doubles, LARGEST + r)))
    return best.face != NO_FACE, unresolved


@inlined
def any_in_leaf(tree, rays, r, leaf):
    """``nearest_in_leaf`` for any hit, of which only that there is one is kept."""
    first, count = blocks_of(leaf)
    t_min, t_max = load(rays.doubles, T_MIN + r), load(rays.doubles, T + r)
    hit, unresolved = any_in_blocks(tree, first, count, t_min, t_max, shear_of(rays, r))
    if hit:
        put_any(rays, r)
    return hit, unresolved

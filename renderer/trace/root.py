"""Which of eight prepared rays enter the root: for each octant eight rays at once, where ``meet_boxes`` tests eight
octants for one ray.
"""

from typing import Any, NamedTuple

import numpy as np

from renderer.jit.decorators import inlined
from renderer.numerics.simd import load, load8, movemask, reduce_max, reduce_min, select, splat8
from renderer.trace.intersect import meet_interval
from renderer.trace.ray_lanes import FAR_INVERSE, FAR_ORIGIN, LIMIT, LOWER, NEAR_INVERSE, NEAR_ORIGIN, WIDTH
from renderer.trace.walk import boxes_of


class _Axis(NamedTuple):
    """The ``Slabs`` of eight rays along one axis, and the mask of those that go backwards."""

    back: Any
    near_origin: Any
    near_inverse: Any
    far_origin: Any
    far_inverse: Any


@inlined
def _axis_of(floats, lane):
    """The ``_Axis`` whose rows have the eight rays from ``lane`` on."""
    near_inverse = load8(floats, NEAR_INVERSE + lane)
    return _Axis(
        near_inverse < splat8(np.float32(0.0)), load8(floats, NEAR_ORIGIN + lane), near_inverse,
        load8(floats, FAR_ORIGIN + lane), load8(floats, FAR_INVERSE + lane),
    )  # fmt: skip


class Box(NamedTuple):
    """The planes of a box."""

    low_x: Any
    high_x: Any
    low_y: Any
    high_y: Any
    low_z: Any
    high_z: Any


@inlined
def root_box(tree):
    """The ``Box`` around the octants of the root."""
    nodes, base = boxes_of(tree, 0)
    return Box(
        reduce_min(load8(nodes, base)), reduce_max(load8(nodes, base + 8)),
        reduce_min(load8(nodes, base + 16)), reduce_max(load8(nodes, base + 24)),
        reduce_min(load8(nodes, base + 32)), reduce_max(load8(nodes, base + 40)),
    )  # fmt: skip


@inlined
def enter_root(tree, box, rays, r):
    """The bits of those of eight rays, prepared in the lanes from ``r`` on, that enter an octant of the root; of all
    eight if all enter its ``box``.
    """
    floats = rays.floats
    x, y, z = _axis_of(floats, r), _axis_of(floats, WIDTH + r), _axis_of(floats, 2 * WIDTH + r)
    lower, upper = load8(floats, LOWER + r), load8(floats, LIMIT + r)
    bits = movemask(_meet_box(box, x, y, z, lower, upper))
    if bits == 0xFF or bits == 0:
        return bits
    nodes, base = boxes_of(tree, 0)
    entered = _meet_box(_octant(nodes, base), x, y, z, lower, upper)
    for k in range(base + 1, base + 8):
        entered = entered | _meet_box(_octant(nodes, k), x, y, z, lower, upper)
    return movemask(entered)


@inlined
def _octant(nodes, k):
    return Box(
        load(nodes, k), load(nodes, k + 8), load(nodes, k + 16), load(nodes, k + 24), load(nodes, k + 32),
        load(nodes, k + 40),
    )  # fmt: skip


@inlined
def _meet_box(box, x, y, z, lower, upper):
    """The mask of the rays that enter a box within [lower, upper]."""
    n_x, f_x = _distances(box.low_x, box.high_x, x)
    n_y, f_y = _distances(box.low_y, box.high_y, y)
    n_z, f_z = _distances(box.low_z, box.high_z, z)
    return meet_interval(n_x, n_y, n_z, f_x, f_y, f_z, lower, upper)[1]


@inlined
def _distances(low, high, axis):
    """Where rays enter and leave a slab between two planes of an axis."""
    low, high = splat8(low), splat8(high)
    near, far = select(axis.back, high, low), select(axis.back, low, high)
    return (near - axis.near_origin) * axis.near_inverse, (far - axis.far_origin) * axis.far_inverse

"""The way of rays through a tree, recorded: which nodes and blocks each reads, in order.

A plain model in float64 of what traversals of this kind do: nearest boxes first, alone, or sixteen rays together that
read a node once. It finds the hits too, by which ``tests`` see that it goes where a ray must go.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.jit.decorators import kernel
from renderer.trace.batch import RayBatch
from renderer.trace.packet import BUDGET
from renderer.trace.ray_lanes import WIDTH
from renderer.trace.rays import ray_pointers
from renderer.trace.traverse import are_coherent
from validation.benchmark.limits.trees import PlainTree
from validation.benchmark.peers.contender import Family

# Octants that wait on one stack: 7 a level, of trees deeper than any that either builder makes.
_STACK = 7 * 256 + 8
_MOST_BLOCKS = 8
# Records a ray at first; where they are too few, the walk is made again with twice as many.
_RECORDS = 64
# What a row of ``Walk.sums`` counts.
NODES, BLOCKS, TRIANGLES, BEAM_NODES, LEAF_BOXES, PACKETS = range(6)


class Walk(NamedTuple):
    """What some rays read.

    records  (R,) int64 in order: 2 * node, or 2 * block + 1. Sixteen rays that travel together read once
    ends     (n,) int64: the number of records when each ray, or the sixteen it travels with, had ended
    sums     nodes and blocks that rays were tested against alone, triangles in these blocks; of packets, nodes, leaf
             boxes that were tested against all sixteen, and how many packets there were
    t        (n,) float64: where each ray hits, inf where it does not
    """

    records: NDArray[np.int64]
    ends: NDArray[np.int64]
    sums: NDArray[np.int64]
    t: NDArray[np.float64]


def walk(tree: PlainTree, corners: NDArray[np.float64], rays: Family, together: bool) -> Walk:
    """The walk of all rays, one after the other; with ``together``, coherent sixteens as packets.

    corners : (F, 3, 3), the triangles of the mesh.
    """
    count, room = len(rays), _RECORDS
    scratch = np.empty((2, _STACK), np.int64), np.empty((2, _STACK))
    packed = (tree.boxes, tree.children, tree.faces, corners)
    batch = RayBatch(rays.origins, rays.directions, np.zeros(1), np.full(1, rays.t_max))
    while True:
        t, sums, ends = np.full(count, rays.t_max), np.zeros(6, np.int64), np.empty(count, np.int64)
        records, found = np.empty(room * count, np.int64), np.zeros(count, np.bool_)
        used = _walk(packed, batch, together, (records, ends, sums, t, found), scratch)
        if used >= 0:
            return Walk(records[:used].copy(), ends, sums, np.where(found, t, np.inf))
        room *= 2


@kernel
def _walk(tree, batch, together, out, scratch):
    """Walk all rays; returns the number of records, or -1 where there is no room for them.

    A stack has octants, 8 * node + place, and the distances at which a ray enters them; -8 stands for the root.
    """
    ends, t = out[1], out[3]
    (octants, near), pointers, used, i = scratch, ray_pointers(batch, 1.0), np.int64(0), 0
    while i < len(t):
        octants[0, 0], near[0, 0], top, rays = -8, -np.inf, 1, 1
        if together and i + WIDTH <= len(t) and are_coherent(pointers, i):
            rays = WIDTH
            used, top = _walk_packet(tree, batch, i, out, used, (octants[0], near[0]))
        for r in range(i, i + rays):
            for k in range(top):
                octants[1, k], near[1, k] = octants[0, k], near[0, k]
            if used >= 0:
                used = _walk_singly(tree, batch, r, out, used, (octants[1], near[1], top))
        if used < 0:
            return used
        ends[i : i + rays] = used
        i += rays
    return used


@kernel
def _walk_singly(tree, batch, i, out, used, waiting):
    """Walk a ray from the octants that wait on; returns the number of records, or -1 without room."""
    records, _, sums, t, _ = out
    octants, near, top = waiting
    while top > 0:
        top -= 1
        if near[top] > t[i]:
            continue
        child = _child_of(tree, octants[top])
        if used + _MOST_BLOCKS > len(records):
            return np.int64(-1)
        if child < 0:
            _meet_leaf(tree, batch, i, child, out)
            used = _record_leaf(records, child, used)
            continue
        records[used], used = 2 * child, used + 1
        sums[NODES] += 1
        first = top
        for place in range(8):
            entry = _enter(tree[0], child, place, batch, i, t[i])
            if entry < np.inf:
                top = _wait(octants, near, (first, top), 8 * child + place, entry)
    return used


@kernel
def _walk_packet(tree, batch, first, out, used, scratch):
    """Walk sixteen rays together until BUDGET octants; returns the records (-1 without room), and what still waits."""
    records, _, sums, t, _ = out
    (octants, near), top, left = scratch, 1, BUDGET + 1
    sums[PACKETS] += 1
    while top > 0 and left > 0:
        top, left = top - 1, left - 1
        octant, child = octants[top], _child_of(tree, octants[top])
        if used + _MOST_BLOCKS > len(records):
            return np.int64(-1), top
        if child < 0:
            sums[LEAF_BOXES] += 1
            read = False
            for r in range(first, first + WIDTH):
                if _enter(tree[0], octant >> 3, octant & 7, batch, r, t[r]) < np.inf:
                    _meet_leaf(tree, batch, r, child, out)
                    read = True
            used = _record_leaf(records, child, used) if read else used
            continue
        records[used], used = 2 * child, used + 1
        sums[BEAM_NODES] += 1
        below = top
        for place in range(8):
            nearest = np.inf
            for r in range(first, first + WIDTH):
                nearest = min(nearest, _enter(tree[0], child, place, batch, r, t[r]))
            if nearest < np.inf:
                top = _wait(octants, near, (below, top), 8 * child + place, nearest)
    return used, top


@kernel
def _child_of(tree, octant):
    return tree[1][octant >> 3, octant & 7] if octant >= 0 else np.int64(0)


@kernel
def _wait(octants, near, span, octant, entry):
    """Insert an octant above ``span[0]``, the nearest on top; returns the new top."""
    first, k = span
    while k > first and near[k - 1] < entry:
        near[k], octants[k] = near[k - 1], octants[k - 1]
        k -= 1
    near[k], octants[k] = entry, octant
    return span[1] + 1


@kernel
def _record_leaf(records, child, used):
    first, count = ~child >> 3, (~child & 7) + 1
    for block in range(first, first + count):
        records[used], used = 2 * block + 1, used + 1
    return used


@kernel
def _enter(boxes, node, place, batch, i, limit):
    """Where ray ``i`` enters a box, inf where it does not up to ``limit``."""
    origins, directions = batch[0], batch[1]
    t0, t1 = 0.0, limit
    for a in range(3):
        low, high = boxes[node, 2 * a, place], boxes[node, 2 * a + 1, place]
        if not low <= high:
            return np.inf
        o, d = origins[i, a], directions[i, a]
        if d == 0.0:
            if not low <= o <= high:
                return np.inf
            continue
        near, far = (low - o) / d, (high - o) / d
        t0, t1 = max(t0, min(near, far)), min(t1, max(near, far))
    return t0 if t0 <= t1 else np.inf


@kernel
def _meet_leaf(tree, batch, i, child, out):
    """Test a ray against a leaf's triangles and keep its nearest hit."""
    _, _, sums, t, found = out
    first, count = ~child >> 3, (~child & 7) + 1
    for block in range(first, first + count):
        sums[BLOCKS] += 1
        for k in range(4):
            face = tree[2][block, k]
            if face >= 0:
                sums[TRIANGLES] += 1
                hit = _meet_triangle(tree[3], face, batch, i)
                if hit <= t[i]:
                    t[i], found[i] = hit, True


@kernel
def _meet_triangle(corners, face, batch, i):
    """Where a ray meets a triangle's plane inside of it, inf where it does not: by the signs of three volumes."""
    o, d = batch[0][i], batch[1][i]
    ax, ay, az = corners[face, 0, 0] - o[0], corners[face, 0, 1] - o[1], corners[face, 0, 2] - o[2]
    bx, by, bz = corners[face, 1, 0] - o[0], corners[face, 1, 1] - o[1], corners[face, 1, 2] - o[2]
    cx, cy, cz = corners[face, 2, 0] - o[0], corners[face, 2, 1] - o[1], corners[face, 2, 2] - o[2]
    u = d[0] * (by * cz - bz * cy) + d[1] * (bz * cx - bx * cz) + d[2] * (bx * cy - by * cx)
    v = d[0] * (cy * az - cz * ay) + d[1] * (cz * ax - cx * az) + d[2] * (cx * ay - cy * ax)
    w = d[0] * (ay * bz - az * by) + d[1] * (az * bx - ax * bz) + d[2] * (ax * by - ay * bx)
    whole = u + v + w
    if whole == 0.0 or ((u < 0.0 or v < 0.0 or w < 0.0) and (u > 0.0 or v > 0.0 or w > 0.0)):
        return np.inf
    for a in range(3):
        if abs(d[a]) >= max(abs(d[0]), max(abs(d[1]), abs(d[2]))):
            at = (u * corners[face, 0, a] + v * corners[face, 1, a] + w * corners[face, 2, a]) / whole
            hit = (at - o[a]) / d[a]
            return hit if hit >= 0.0 else np.inf
    return np.inf

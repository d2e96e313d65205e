"""What this machine does: how long the steps of a traversal take from the nearest cache, and what memory gives.

Each rate is the best of several runs: whatever else runs can only make it slower, and a bound must not be too high.
"""

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from renderer.jit.decorators import kernel
from renderer.numerics.simd import (
    at,
    count_bits,
    farthest_first,
    movemask,
    pointer,
    splat8,
    store,
)
from renderer.octree import Octree
from renderer.system.threads import for_chunks
from renderer.trace.batch import RayBatch
from renderer.trace.intersect import largest_of, make_shear, make_slabs, meet_boxes, meet_planes, see_triangles
from renderer.trace.layout import BLOCK_WORDS, CHILDREN, NODE_WORDS
from renderer.trace.leaf import tree_pointers
from renderer.trace.packet import enter_beam, make_beam, meet_octant
from renderer.trace.ray_lanes import NUMBER, Prepared, prepare_eight
from renderer.trace.rays import ray_at, ray_pointers
from validation.benchmark.limits.caches import LINE, Caches
from validation.benchmark.measures.meshes import displaced_spheres

_RUNS = 7
# A mesh whose tree fits into the nearest cache with its blocks, and so many rounds that a run takes milliseconds.
_FACES, _ROUNDS = 96, 100_000
# Chains of loads that do not wait for each other: as many as rays under way in a stream.
_CHAINS = 32
_RAYS = 1 << 18


def rates(caches: Caches) -> dict[str, Any]:
    """Nanoseconds: ``node``, ``block``, ``beam`` (a packet's node), ``octant`` (of sixteen rays), ``ray`` and
    ``packet_ray`` (a ray that only meets the root); ``wait`` and ``overlapped``, of a line from each level beyond the
    nearest cache, where one load or 32 are under way; ``bandwidth`` in bytes a nanosecond of one thread and of two.
    """
    octree = Octree.from_mesh(displaced_spheres(_FACES), threads=1)
    found: dict[str, Any] = _steps(octree)
    found["ray"] = max(0.0, _past(octree, scattered=True) - found["node"])
    found["packet_ray"] = max(0.0, _past(octree, scattered=False) - found["beam"] / 16.0)
    # Of each level half, so that what else is in it leaves room; of memory eight times the last cache.
    sizes = [size // 2 for size, _ in caches.levels[1:]] + [8 * caches.levels[-1][0]]
    found["wait"] = [_chase(size, 1) for size in sizes]
    found["overlapped"] = [_chase(size, _CHAINS) for size in sizes]
    found["bandwidth"] = [_bandwidth(8 * caches.levels[-1][0], threads) for threads in (1, 2)]
    return found


def _best(run: Callable[[], Any], each: float) -> float:
    """Nanoseconds of the fastest of several runs, over ``each``; the first run, which may compile, does not count."""
    times = []
    for _ in range(_RUNS + 1):
        began = time.perf_counter_ns()
        run()
        times.append(time.perf_counter_ns() - began)
    return min(times[1:]) / each


def _steps(octree: Octree) -> dict[str, Any]:
    """The steps of a traversal, each in a loop that waits for no result of the last one."""
    words, out = octree.tree.words, np.zeros(64, np.int64)
    nodes, blocks = len(octree.tree.nodes) // NODE_WORDS, len(octree.tree.faces) // 4
    rays = RayBatch(np.array([[0.1, 0.2, -5.0]]), np.array([[0.11, 0.07, 1.0]]), np.zeros(1), np.full(1, np.inf))
    memory = np.empty(256, np.float32), np.empty(256), np.zeros(256, np.int64)
    return {
        "node": _best(lambda: _time_nodes(words, rays, out, nodes, _ROUNDS), _ROUNDS),
        "block": _best(lambda: _time_blocks(words, rays, blocks, _ROUNDS), _ROUNDS),
        "beam": _best(lambda: _time_beams(words, rays, memory, nodes, _ROUNDS), _ROUNDS),
        "octant": _best(lambda: _time_octants(words, rays, memory, nodes, _ROUNDS), _ROUNDS),
    }


@kernel
def _time_nodes(words, rays, out, nodes, rounds):
    """The boxes of a node, sorted and stored, as a stream does it."""
    tree = tree_pointers(words)
    ray, _ = ray_at(ray_pointers(rays, tree.scale), 0)
    slabs, stack, top = make_slabs(ray, largest_of(ray)), pointer(out), np.int64(0)
    lower, upper = splat8(np.float32(0.0)), splat8(np.float32(np.inf))
    for k in range(rounds):
        node = k % nodes
        t0, meets = meet_boxes(tree.nodes, node, slabs, lower, upper)
        store(stack, top & 7, farthest_first(meets, t0, tree.links, node * NODE_WORDS + CHILDREN))
        top += count_bits(movemask(meets))
    return top


@kernel
def _time_blocks(words, rays, blocks, rounds):
    """Four triangles and their planes, as a stream tests them."""
    tree = tree_pointers(words)
    ray, _ = ray_at(ray_pointers(rays, tree.scale), 0)
    shear, found = make_shear(ray), np.int64(0)
    for k in range(rounds):
        base = (k % blocks) * BLOCK_WORDS
        edges, seen = see_triangles(tree, base, shear)
        t, doubts, _, dues = meet_planes(tree, base, edges, seen, shear, 0.0, 1e9)
        found += (seen & movemask(t >= edges.e1)) + doubts + dues
    return found


@kernel
def _prepared(words, rays, memory):
    tree = tree_pointers(words)
    prepared = Prepared(pointer(memory[0]), pointer(memory[1]), pointer(memory[2]))
    for half in range(0, 16, 8):
        prepare_eight(ray_pointers(rays, tree.scale), prepared, half, at(prepared.integers, NUMBER))
    return tree, prepared


@kernel
def _time_beams(words, rays, memory, nodes, rounds):
    """The boxes of a node against the beam of sixteen rays."""
    tree, prepared = _prepared(words, rays, memory)
    beam, found = make_beam(prepared), np.int64(0)
    for k in range(rounds):
        t0, bits = enter_beam(tree.nodes, (k % nodes) * NODE_WORDS, beam, np.float32(np.inf))
        found += bits + count_bits(movemask(t0 > splat8(np.float32(1.0))))
    return found


@kernel
def _time_octants(words, rays, memory, nodes, rounds):
    """One box against sixteen rays."""
    tree, prepared = _prepared(words, rays, memory)
    found = np.int64(0)
    for k in range(rounds):
        found += meet_octant(tree, prepared, (k % nodes) * NODE_WORDS + (k & 7))
    return found


def _past(octree: Octree, scattered: bool) -> float:
    """Nanoseconds of a ray that passes the root's box, in a batch, on one thread: what every ray costs."""
    origins, directions = np.zeros((_RAYS, 3)), np.zeros((_RAYS, 3))
    origins[:, 0] = 1e3
    directions[:, 0], directions[:, 1] = 1.0, np.linspace(-0.1, 0.1, _RAYS)
    if scattered:
        directions[::2] = directions[::2, [1, 0, 2]]
    return _best(lambda: octree.closest_hit(origins, directions), _RAYS)


def _chase(size: int, chains: int) -> float:
    """Nanoseconds a load from ``size`` bytes of memory, ``chains`` loads at a time that each wait for the last."""
    lines = size // LINE
    order = np.random.default_rng(0).permutation(lines)
    following = np.zeros(lines * (LINE // 8), np.int64)
    following[order * (LINE // 8)] = np.roll(order, -1) * (LINE // 8)
    starts = order[np.arange(chains) * lines // chains] * (LINE // 8)
    loads = min(lines, 1 << 18) // chains * chains
    return _best(lambda: _follow(following, starts.copy(), loads // chains), loads)


@kernel
def _follow(following, places, loads):
    for _ in range(loads):
        for k in range(len(places)):
            places[k] = following[places[k]]


def _bandwidth(size: int, threads: int) -> float:
    """Bytes a nanosecond that so many threads read from ``size`` bytes of memory."""
    memory = np.ones(size // 8)
    out = np.zeros(64)

    def read(begin: int, end: int) -> None:
        out[begin * 64 // len(memory)] += _sum(memory, begin, end)

    return size / _best(lambda: for_chunks(read, len(memory), len(memory) // 16, threads), 1.0)


@kernel
def _sum(memory, begin, end):
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    # Four sums, which do not wait for each other.
    for i in range(begin, end - 31, 32):
        a, b, c, d = a + memory[i], b + memory[i + 8], c + memory[i + 16], d + memory[i + 24]
    return a + b + c + d

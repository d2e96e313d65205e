"""All hits of each ray of a range, in compressed rows: found through the tree in any order, merged, then sorted.

A contact is the hits of one ray at one edge or corner of the surface, told apart by position, or one hit between them.
It counts as its first hit, so the first contact is the closest hit.
"""

from typing import Any, NamedTuple

import numpy as np

from renderer.all_hits.candidates import LISTED, TOGETHER, find_blocks, make_candidates
from renderer.jit.decorators import inlined, kernel
from renderer.numerics.simd import at, extract, get, is_negative, lowest_bit, pointer, put, smaller, splat8
from renderer.trace.edge_signs import coordinate, exact_sides
from renderer.trace.intersect import (
    box_limit,
    enter_boxes,
    hit_triangles,
    largest_of,
    make_shear,
    make_slabs,
    round_down,
)
from renderer.trace.layout import BLOCK_FACES, BLOCK_WORDS
from renderer.trace.leaf import NO_FACE, blocks_of, push_children, tree_pointers
from renderer.trace.rays import HitPointers, first_bad_ray, ray_at, ray_pointers, write_hit
from renderer.trace.resolve import settled
from renderer.trace.starts.record import PILE
from renderer.trace.starts.search import counted_from_start, depart, meet_near, near_bits, stopped_again
from renderer.trace.traverse import make_scratch

# Rows of a chunk's memory, each of its capacity. Of the hits of the ray under way: t, u, v, w as float64; face, the
# place of the face in its block, the edges passed as bits, and the order as int64. Of the hits of the rays before it:
# t, u, v, face, and the side of the face that the ray came from.
_T, _U, _V, _W, OUT_T, OUT_U, OUT_V, DOUBLE_ROWS = range(8)
_FACE, _AT, _EDGES, _ORDER, OUT_FACE, OUT_SIDE, INTEGER_ROWS = range(7)
_MERGED = -1
# The place of the first hit at a ray's start, which is in no block; those after it follow. They are in the order in
# which the ray passes them, before all others.
_FIRST = -(1 << 40)
# The hits and rounds of rays in a call, some 10 ms, so that Ctrl-C need not wait for long.
_WORK = 1 << 16


class Found(NamedTuple):
    """Pointers to the memory's rows, and their length."""

    doubles: Any
    integers: Any
    capacity: int


@inlined
def _row(found, row, i):
    return found.capacity * row + i


@kernel
def gather_chunk(words, rays, bounds, choice, counts, doubles, integers, memory):
    """Gather the hits of the rays from bounds[0] to bounds[1]; what they have goes to ``counts``, one int64 a ray.

    choice    (merge, most, keep): whether hits become contacts, the most of them of a ray, whether they are kept or
              counted only
    doubles   (DOUBLE_ROWS, capacity) float64, integers (INTEGER_ROWS, capacity) int64: memory, and what is kept
    memory    a ``traverse.Memory`` for CANDIDATE_WORDS rays

    Returns the ray before which it ended, because the memory was full or after _WORK, or bounds[1]; and the row of a
    ray out of range, for which nothing is gathered, or -1.
    """
    tree = tree_pointers(words)
    source, found = ray_pointers(rays, tree.scale), Found(pointer(doubles), pointer(integers), doubles.shape[1])
    bad, kept = first_bad_ray(source, bounds[0], bounds[1]), np.int64(0)
    if bad >= 0:
        return bounds[0], bad
    merge, most, keep = choice
    scratch = make_scratch(memory)
    candidates = make_candidates(scratch.waiting)
    begin, hits, rounds = bounds[0], np.int64(0), np.int64(0)
    # Where the candidates of rays were found, they are used: only hits end it between such rays.
    while begin < bounds[1] and hits + rounds <= _WORK:
        end, taken = smaller(begin + TOGETHER, bounds[1]), np.int64(0)
        if tree.has_nodes:
            end, taken = find_blocks(tree, source, begin, end, scratch, candidates)
        rounds += taken
        for i in range(begin, end):
            count = _list_all(tree, source, i, candidates, i - begin, found, scratch)
            if kept + count > found.capacity or hits > _WORK:
                return i, -1
            hits += count
            # rule: max-hits
            counts[i] = smaller(_ordered(tree, found, count, merge, keep), most)
            if keep:
                _keep(found, kept, counts[i], tree.scale, make_shear(ray_at(source, i)[0]).direction_z)
                kept += counts[i]
        begin = end
    return begin, -1


@kernel
def _list_all(tree, rays, i, candidates, k, found, scratch):
    """List all hits of ray ``i``, the k-th candidate; returns their number, of which the capacity is listed."""
    ray, t_max = ray_at(rays, i)
    if ray.leaving >= 0.0:
        return _list_from(tree, rays, i, ray, t_max, found, scratch)
    shear, count = make_shear(ray), np.int64(0)
    if not tree.has_nodes:
        return _list_hits(tree, (0, tree.count), ray, shear, t_max, found, count)
    listed = get(candidates.counts, k)
    if listed > LISTED:
        return _search(tree, ray, shear, t_max, found, scratch.packet_stack)
    for place in range(k * LISTED, k * LISTED + listed):
        count = _list_hits(tree, (get(candidates.blocks, place), 1), ray, shear, t_max, found, count)
    return count


@kernel
def _search(tree, ray, shear, t_max, found, stack):
    """``_list_all`` by a search for the ray alone."""
    largest = largest_of(ray)
    slabs = make_slabs(ray, largest)
    lower, upper = splat8(round_down(ray.t_min * largest)), splat8(box_limit(t_max, largest))
    count, top = np.int64(0), 1
    put(stack, 0, 0)
    while top > 0:
        top -= 1
        child = get(stack, top)
        if child < 0:
            count = _list_hits(tree, blocks_of(child), ray, shear, t_max, found, count)
            continue
        _, bits = enter_boxes(tree.nodes, child, slabs, lower, upper)
        top = push_children(tree, child, bits, stack, top)
    return count


@kernel
def _list_hits(tree, blocks, ray, shear, t_max, found, count):
    """Add the hits in some blocks (first, number) to the list."""
    for block in range(blocks[0], blocks[0] + blocks[1]):
        base = block * BLOCK_WORDS
        bits, doubts, blurred, _, t4, u4, v4, w4 = hit_triangles(tree, base, shear, ray.t_min, t_max)
        while bits != 0:
            i = lowest_bit(bits)
            bits &= bits - 1
            hit, edges = (extract(t4, i), extract(u4, i), extract(v4, i), extract(w4, i)), np.int64(0)
            if (doubts >> i) & 1 != 0 or hit[1] == 0.0 or hit[2] == 0.0 or hit[1] + hit[2] == hit[3]:
                edges = _edges_passed(exact_sides(tree, base + i, shear))
            if (doubts >> i) & 1 != 0:
                hit = settled(tree, base + i, ray, shear, hit, (blurred >> i) & 1 != 0)
            count = _add_hit(tree, found, count, ray, t_max, hit, block * BLOCK_FACES + i, base + i, edges)
    return count


@inlined
def _add_hit(tree, found, count, ray, t_max, hit, number, place, edges):
    """Add a hit to the list if it is in the ray's interval; returns the number of hits."""
    if not ray.t_min <= hit[0] <= t_max:
        return count
    if count < found.capacity:
        _list_hit(found, count, hit, get(tree.faces, number), place, edges)
    return count + 1


@kernel
def _list_from(tree, rays, i, ray, t_max, found, scratch):
    """``_list_all`` for a ray that leaves the surface. What stops it at its start are its first hits."""
    stack = scratch.packet_stack
    departure, stopped = depart(tree, rays.starts, i, ray, stack, scratch.holders)
    ray, count, pile = departure.ray, np.int64(0), np.int64(get(at(rays.starts.rows, i * rays.starts.step), PILE))
    for _ in range(departure.holders):
        if stopped[1] == NO_FACE or t_max < 0.0:
            break
        if count < found.capacity:
            hit = stopped[0], stopped[2], stopped[3], stopped[4]
            _list_hit(found, count, hit, stopped[1], _FIRST + count, np.int64(0))
        count += 1
        # The sign of 0 tells the next face of the pile from one that begins another.
        pile = pile if is_negative(stopped[0]) else np.int64(stopped[1])
        stopped = stopped_again(tree, departure, np.int64(stopped[1]), pile, scratch.holders)
    shear, largest = make_shear(ray), largest_of(ray)
    if not tree.has_nodes:
        return _list_hits_from(tree, rays.starts, i, (0, tree.count), departure, shear, t_max, found, count)
    slabs, top = make_slabs(ray, largest), 1
    lower, upper = splat8(round_down(ray.t_min * largest)), splat8(box_limit(t_max, largest))
    put(stack, 0, 0)
    while top > 0:
        top -= 1
        child = get(stack, top)
        if child < 0:
            count = _list_hits_from(tree, rays.starts, i, blocks_of(child), departure, shear, t_max, found, count)
            continue
        _, bits = enter_boxes(tree.nodes, child, slabs, lower, upper)
        top = push_children(tree, child, bits, stack, top)
    return count


@kernel
def _list_hits_from(tree, starts, row, blocks, departure, shear, t_max, found, count):
    """``_list_hits`` for ray ``row``, which leaves the surface."""
    ray = departure.ray
    largest = largest_of(ray)
    for block in range(blocks[0], blocks[0] + blocks[1]):
        base = block * BLOCK_WORDS
        bits, doubts, blurred, _, t4, u4, v4, w4 = hit_triangles(tree, base, shear, ray.t_min, t_max)
        near = near_bits(tree, block, departure, shear, bits)
        bits |= near
        while bits != 0:
            i = lowest_bit(bits)
            bits &= bits - 1
            if np.float64(get(tree.faces, block * BLOCK_FACES + i)) == ray.leaving:
                continue
            hit, edges = (extract(t4, i), extract(u4, i), extract(v4, i), extract(w4, i)), np.int64(0)
            if (near >> i) & 1 != 0:
                hit, edges = meet_near(tree, base + i, departure, shear.direction_z)
            else:
                if (doubts >> i) & 1 != 0 or hit[1] == 0.0 or hit[2] == 0.0 or hit[1] + hit[2] == hit[3]:
                    edges = _edges_passed(exact_sides(tree, base + i, shear))
                if (doubts >> i) & 1 != 0:
                    hit = settled(tree, base + i, ray, shear, hit, (blurred >> i) & 1 != 0)
                if ray.t_min <= hit[0] <= t_max:
                    face = np.int64(get(tree.faces, block * BLOCK_FACES + i))
                    hit = counted_from_start(tree, starts, row, ray, largest, hit, face)
            count = _add_hit(tree, found, count, ray, t_max, hit, block * BLOCK_FACES + i, base + i, edges)
    return count


@inlined
def _edges_passed(sides):
    """The edges that a ray passes, as bits: 1 for the edge opposite to the first corner, 2 and 4 for the others."""
    return np.int64(sides[0] == 0) | (np.int64(sides[1] == 0) << 1) | (np.int64(sides[2] == 0) << 2)


@inlined
def _list_hit(found, i, hit, face, place, edges):
    put(found.doubles, _row(found, _T, i), hit[0])
    put(found.doubles, _row(found, _U, i), hit[1])
    put(found.doubles, _row(found, _V, i), hit[2])
    put(found.doubles, _row(found, _W, i), hit[3])
    put(found.integers, _row(found, _FACE, i), np.int64(face))
    put(found.integers, _row(found, _AT, i), place)
    put(found.integers, _row(found, _EDGES, i), edges)


@kernel
def _ordered(tree, found, count, merge, sort):
    """Write the order of the listed hits, or of the contacts that they make, by t, then face; returns their number."""
    order = at(found.integers, _row(found, _ORDER, 0))
    if merge:
        _merge(tree, found, count, order)
    kept = 0
    for i in range(count):
        put(order, kept, i)
        kept += np.int64(get(found.integers, _row(found, _FACE, i)) != _MERGED)
    if sort:
        _sort(tree, found, order, kept, False)
    return kept


@kernel
def _merge(tree, found, count, order):
    """Mark, of the hits at one edge or corner, all but the first as merged."""
    on_edges = 0
    for i in range(count):
        put(order, on_edges, i)
        on_edges += np.int64(get(found.integers, _row(found, _EDGES, i)) != 0)
    _sort(tree, found, order, on_edges, True)
    for k in range(1, on_edges):
        # Those of one place follow each other. The first one's place stands for all, merged or not.
        # rule: merge-at-edge
        if _compare_places(tree, found, get(order, k - 1), get(order, k)) == 0:
            put(found.integers, _row(found, _FACE, get(order, k)), np.int64(_MERGED))


@kernel
def _sort(tree, found, order, count, by_place):
    """Sort ``order`` by t, then face, of the hits it names; or by their places first. A heap, as rays may hit much."""
    for start in range(count // 2 - 1, -1, -1):
        _sift(tree, found, order, start, count, by_place)
    for end in range(count - 1, 0, -1):
        first = get(order, 0)
        put(order, 0, get(order, end))
        put(order, end, first)
        _sift(tree, found, order, 0, end, by_place)


@kernel
def _sift(tree, found, order, parent, count, by_place):
    """Let an entry of a heap sink to its place."""
    sinking = get(order, parent)
    while 2 * parent + 1 < count:
        child = 2 * parent + 1
        if child + 1 < count and _precedes(tree, found, get(order, child), get(order, child + 1), by_place):
            child += 1
        if not _precedes(tree, found, sinking, get(order, child), by_place):
            break
        put(order, parent, get(order, child))
        parent = child
    put(order, parent, sinking)


@kernel
def _precedes(tree, found, i, j, by_place):
    """Whether hit i comes before hit j."""
    if by_place:
        compared = _compare_places(tree, found, i, j)
        if compared != 0:
            return compared < 0
    ti, tj = get(found.doubles, _row(found, _T, i)), get(found.doubles, _row(found, _T, j))
    place, other = get(found.integers, _row(found, _AT, i)), get(found.integers, _row(found, _AT, j))
    if place < 0 or other < 0:
        return place < other
    face, other = get(found.integers, _row(found, _FACE, i)), get(found.integers, _row(found, _FACE, j))
    # rule: order-at-t
    return ti < tj or (ti == tj and face < other)


@kernel
def _compare_places(tree, found, i, j):
    """The order, -1, 0 or 1, of the edges or corners that two hits lie at, by their ends' coordinates."""
    a, b = _ends(tree, found, i)
    c, d = _ends(tree, found, j)
    first = _compare_corners(tree, a, c)
    return first if first != 0 else _compare_corners(tree, b, d)


@kernel
def _ends(tree, found, i):
    """The places in its block of the ends of a hit's edge, the lower first; of a corner, that twice."""
    place = get(found.integers, _row(found, _AT, i))
    edges = get(found.integers, _row(found, _EDGES, i))
    # rule: corner-of-edges
    if edges & (edges - 1) != 0:
        # Two edges meet in the corner that is opposite to the third.
        corner = place + 12 * lowest_bit(~edges & 7)
        return corner, corner
    opposite = lowest_bit(edges)
    a, b = place + 12 * ((opposite + 1) % 3), place + 12 * ((opposite + 2) % 3)
    return (a, b) if _compare_corners(tree, a, b) <= 0 else (b, a)


@kernel
def _compare_corners(tree, a, b):
    """The order of two corners, -1, 0 or 1, by x, then y, then z."""
    for row in range(0, 12, 4):
        x, y = coordinate(tree, a + row), coordinate(tree, b + row)
        if x != y:
            return -1 if x < y else 1
    return 0


@kernel
def _keep(found, kept, count, scale, dz):
    """Append the first ``count`` hits in order to those kept, as ``write_hit`` writes a closest hit."""
    t, u, v = (at(found.doubles, _row(found, OUT_T, kept)), at(found.doubles, _row(found, OUT_U, kept)),
               at(found.doubles, _row(found, OUT_V, kept)))  # fmt: skip
    face, side = at(found.integers, _row(found, OUT_FACE, kept)), at(found.integers, _row(found, OUT_SIDE, kept))
    for k in range(count):
        i = get(found.integers, _row(found, _ORDER, k))
        hit = (
            get(found.doubles, _row(found, _T, i)),
            get(found.integers, _row(found, _FACE, i)),
            get(found.doubles, _row(found, _U, i)),
            get(found.doubles, _row(found, _V, i)),
            get(found.doubles, _row(found, _W, i)),
        )
        write_hit(HitPointers(t, face, u, v, side, side, t), k, scale, hit, dz, False)

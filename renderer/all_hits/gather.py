"""All hits of each ray of a range, in compressed rows: found in any order, merged, then sorted.

A contact is all hits of a ray at one edge or corner of the surface, compared by position, or one hit inside a face. It
is reported as its first hit, so the first contact is the closest hit.
"""

from typing import Any, NamedTuple

import numpy as np

from renderer.all_hits.candidates import LISTED, TOGETHER, find_blocks, make_candidates
from renderer.jit.decorators import inlined, kernel
from renderer.numerics.simd import is_negative, load, lowest_bit, minimum, offset, pointer, store
from renderer.trace.best import NO_FACE, Best
from renderer.trace.edge_signs import coordinate, exact_sides
from renderer.trace.intersect import face_in, hit_in, hit_triangles, make_shear
from renderer.trace.layout import BLOCK_FACES, BLOCK_WORDS
from renderer.trace.leaf import resolved_hit
from renderer.trace.rays import HitPointers, batch_pointers, first_bad_ray, ray_at, write_hit
from renderer.trace.single_ray import SingleRay, enter_node, prepare_single
from renderer.trace.starts.record import PILE, StartPointers
from renderer.trace.starts.search import Departure, counted_from_start, depart, meet_near, near_bits, stopped_again
from renderer.trace.traverse import scratch_pointers
from renderer.trace.trees import tree_pointers
from renderer.trace.walk import walk

# Rows of a chunk's memory, each of its capacity. Of the hits of the ray under way: t, u, v, w as float64; face, the
# place of the face in its block, the edges passed as bits, and the order as int64. Of the hits of the rays before it:
# t, u, v, face, and the side of the face that the ray came from.
_T, _U, _V, _W, OUT_T, OUT_U, OUT_V, DOUBLE_ROWS = range(8)
_FACE, _AT, _EDGES, _ORDER, OUT_FACE, OUT_SIDE, INTEGER_ROWS = range(7)
_MERGED = -1
_ALL_EDGES = 7
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


class Choice(NamedTuple):
    """Whether hits are merged to contacts, the most for each ray, and whether they are kept or only counted."""

    contacts: bool
    most: int
    keep: bool


@kernel
def gather_chunk(descriptor, rays, begin, end, choice, counts, doubles, integers, scratch):
    """Gather the hits of the rays begin:end, and write their numbers to ``counts``, one int64 for each ray.

    doubles   (DOUBLE_ROWS, capacity) float64, integers (INTEGER_ROWS, capacity) int64: memory, and what is kept
    scratch   that of ``traverse.new_scratch`` for CANDIDATE_WORDS rays

    Returns the ray before which it ended, because the memory was full or after _WORK, or ``end``; and the row of a ray
    out of range, for which nothing is gathered, or -1.
    """
    tree = tree_pointers(descriptor)
    source, found = batch_pointers(rays, tree.scale), Found(pointer(doubles), pointer(integers), doubles.shape[1])
    bad = first_bad_ray(source, begin, end)
    if bad >= 0:
        return begin, bad
    return gather_rays(tree, source, begin, end, choice, counts, found, scratch_pointers(scratch, source.starts)), -1


@kernel
def gather_rays(tree, source, begin, end, choice, counts, found, memory):
    """``gather_chunk`` for rays in bounds. Returns the ray before which it ended.

    source  ``RayPointers``
    found   ``Found``, whose first hits are those of the ray ``begin``
    memory  ``ScratchPointers`` with room for CANDIDATE_WORDS rays
    """
    candidates = make_candidates(memory.waiting)
    hits, rounds, kept = np.int64(0), np.int64(0), np.int64(0)
    # Where the candidates of rays were found, they are used: only hits end it between such rays.
    while begin < end and hits + rounds <= _WORK:
        reached, taken = minimum(begin + TOGETHER, end), np.int64(0)
        if tree.has_nodes:
            reached, taken = find_blocks(tree, source, begin, reached, memory, candidates)
        rounds += taken
        for i in range(begin, reached):
            count = _list_all(tree, source, i, candidates, i - begin, found, memory)
            if kept + count > found.capacity or hits > _WORK:
                return i
            hits += count
            # rule: max-hits
            counts[i] = minimum(_ordered(tree, found, count, choice.contacts, choice.keep), choice.most)
            if choice.keep:
                _keep(found, kept, counts[i], tree.scale, make_shear(ray_at(source, i)[0]).direction_z)
                kept += counts[i]
        begin = reached
    return begin


class _Query(NamedTuple):
    """A ray, its t_max, and the list of its hits."""

    single: SingleRay
    t_max: float
    found: Found


@kernel
def _list_all(tree, rays, i, candidates, k, found, scratch):
    """List all hits of ray ``i``, the k-th candidate. Returns their number, of which at most the capacity is listed."""
    ray, t_max = ray_at(rays, i)
    if ray.leaving >= 0.0:
        return _list_from(tree, rays, i, ray, t_max, found, scratch)
    query, listed = _Query(prepare_single(ray), t_max, found), load(candidates.counts, k)
    if not tree.has_nodes or listed > LISTED:
        return walk(tree, scratch.packet_stack, query, np.int64(0), _enter, _list_hits)
    count = np.int64(0)
    for place in range(k * LISTED, k * LISTED + listed):
        count, _ = _list_hits(tree, query, load(candidates.blocks, place), 1, count)
    return count


@inlined
def _enter(tree, query, node, count):
    """Enter the octants that the ray of a ``_Query`` or ``_QueryFrom`` enters."""
    return count, enter_node(tree, node, query.single, query.t_max)[1]


@kernel
def _list_hits(tree, query, first, blocks, count):
    """Add the hits in some blocks to the list."""
    ray, shear, t_max = query.single.ray, query.single.shear, query.t_max
    for block in range(first, first + blocks):
        hits = hit_triangles(tree, block * BLOCK_WORDS, shear, ray.t_min, t_max)
        bits = hits.bits
        while bits != 0:
            i = lowest_bit(bits)
            bits &= bits - 1
            hit = resolved_hit(tree, block, hits, i, ray, shear)
            edges = _edges_at(tree, block, hits, i, shear, hit)
            if tree.ways.admits(tree, hit.w, shear.direction_z):
                count = _add_hit(tree, query, count, hit, block, i, edges)
    return count, False


@inlined
def _edges_at(tree, block, hits, i, shear, resolved):
    """The edges that a ray passes, as bits, of the i-th of the ``BlockHits`` of a block; ``resolved`` is that hit."""
    hit, edges = hit_in(hits, i), np.int64(0)
    if (hits.uncertain >> i) & 1 != 0 or hit.u == 0.0 or hit.v == 0.0 or hit.u + hit.v == hit.w:
        edges = _edges_passed(exact_sides(tree, block * BLOCK_WORDS + i, shear))
        if edges == _ALL_EDGES:
            # A ray in the face's plane hits it where it begins alone, and the weights there say on which edges.
            u, v = resolved.u == 0.0, resolved.v == 0.0
            edges = np.int64(resolved.u + resolved.v == resolved.w) | (np.int64(u) << 1) | (np.int64(v) << 2)
    return edges


@inlined
def _add_hit(tree, query, count, hit, block, i, edges):
    """Add a hit on the i-th face of a block to the list if it is in the ray's interval. Returns the number of hits."""
    found = query.found
    if not query.single.ray.t_min <= hit.t <= query.t_max:
        return count
    if count < found.capacity:
        face = np.int64(face_in(tree, block * BLOCK_FACES + i))
        _list_hit(found, count, face, hit, block * BLOCK_WORDS + i, edges)
    return count + 1


@kernel
def _list_from(tree, rays, i, ray, t_max, found, scratch):
    """``_list_all`` for a ray that leaves the surface; hits that stop it at its start come first."""
    stack = scratch.packet_stack
    departure, stopped = depart(tree, rays.starts, i, ray, stack, scratch.holders)
    ray, count, pile = departure.ray, np.int64(0), np.int64(load(offset(rays.starts.rows, i * rays.starts.step), PILE))
    for _ in range(departure.holders):
        if stopped.face == NO_FACE or t_max < 0.0:
            break
        face = np.int64(stopped.face)
        if count < found.capacity:
            _list_hit(found, count, face, stopped, _FIRST + count, np.int64(0))
        count += 1
        # -0.0 marks the next face of the pile, 0.0 the first face of another.
        pile = pile if is_negative(stopped.t) else face
        stopped = stopped_again(tree, departure, face, pile, scratch.holders)
    query = _QueryFrom(departure, prepare_single(ray), t_max, found, rays.starts, i)
    return walk(tree, stack, query, count, _enter, _list_hits_from)


class _QueryFrom(NamedTuple):
    """``_Query`` for a ray that leaves the surface, and its number among those."""

    departure: Departure
    single: SingleRay
    t_max: float
    found: Found
    starts: StartPointers
    row: int


@kernel
def _list_hits_from(tree, query, first, blocks, count):
    """``_list_hits`` for a ray that leaves the surface."""
    departure, ray, shear, t_max = query.departure, query.single.ray, query.single.shear, query.t_max
    for block in range(first, first + blocks):
        hits = hit_triangles(tree, block * BLOCK_WORDS, shear, ray.t_min, t_max)
        near = near_bits(tree, block, departure, shear, hits.bits)
        bits = hits.bits | near
        while bits != 0:
            i = lowest_bit(bits)
            bits &= bits - 1
            face = face_in(tree, block * BLOCK_FACES + i)
            if np.float64(face) == ray.leaving:
                continue
            if (near >> i) & 1 != 0:
                hit, edges = meet_near(tree, block * BLOCK_WORDS + i, departure, shear.direction_z)
            else:
                hit = resolved_hit(tree, block, hits, i, ray, shear)
                edges = _edges_at(tree, block, hits, i, shear, hit)
                if ray.t_min <= hit.t <= t_max:
                    largest = query.single.largest
                    hit = counted_from_start(tree, query.starts, query.row, ray, largest, hit, np.int64(face))
            count = _add_hit(tree, query, count, hit, block, i, edges)
    return count, False


@inlined
def _edges_passed(sides):
    """The edges that a ray passes, as bits: 1 for the edge opposite to the first corner, 2 and 4 for the others."""
    first, second, third = sides.opposite0 == 0, sides.opposite1 == 0, sides.opposite2 == 0
    return np.int64(first) | (np.int64(second) << 1) | (np.int64(third) << 2)


@inlined
def _list_hit(found, i, face, hit, place, edges):
    store(found.doubles, _row(found, _T, i), hit.t)
    store(found.doubles, _row(found, _U, i), hit.u)
    store(found.doubles, _row(found, _V, i), hit.v)
    store(found.doubles, _row(found, _W, i), hit.w)
    store(found.integers, _row(found, _FACE, i), face)
    store(found.integers, _row(found, _AT, i), place)
    store(found.integers, _row(found, _EDGES, i), edges)


@kernel
def _ordered(tree, found, count, merge, sort):
    """Write the order of the listed hits, or of their contacts, by t, then face. Returns their number."""
    order = offset(found.integers, _row(found, _ORDER, 0))
    if merge:
        _merge(tree, found, count, order)
    kept = 0
    for i in range(count):
        store(order, kept, i)
        kept += np.int64(load(found.integers, _row(found, _FACE, i)) != _MERGED)
    if sort:
        _sort(tree, found, order, kept, False)
    return kept


@kernel
def _merge(tree, found, count, order):
    """Mark all but the first of the hits at one edge or corner as merged."""
    on_edges = 0
    for i in range(count):
        store(order, on_edges, i)
        on_edges += np.int64(load(found.integers, _row(found, _EDGES, i)) != 0)
    _sort(tree, found, order, on_edges, True)
    for k in range(1, on_edges):
        # Those of one place follow each other. The first one's place stands for all, merged or not.
        # rule: merge-at-edge
        if _compare_places(tree, found, load(order, k - 1), load(order, k)) == 0:
            store(found.integers, _row(found, _FACE, load(order, k)), np.int64(_MERGED))


@kernel
def _sort(tree, found, order, count, by_place):
    """Sort ``order`` by t, then face, of its hits; or first by their places. A heap sort, for rays with many hits."""
    for start in range(count // 2 - 1, -1, -1):
        _sift(tree, found, order, start, count, by_place)
    for end in range(count - 1, 0, -1):
        first = load(order, 0)
        store(order, 0, load(order, end))
        store(order, end, first)
        _sift(tree, found, order, 0, end, by_place)


@kernel
def _sift(tree, found, order, parent, count, by_place):
    """Move an entry of a heap down to its place."""
    sinking = load(order, parent)
    while 2 * parent + 1 < count:
        child = 2 * parent + 1
        if child + 1 < count and _precedes(tree, found, load(order, child), load(order, child + 1), by_place):
            child += 1
        if not _precedes(tree, found, sinking, load(order, child), by_place):
            break
        store(order, parent, load(order, child))
        parent = child
    store(order, parent, sinking)


@kernel
def _precedes(tree, found, i, j, by_place):
    """Whether hit i comes before hit j."""
    if by_place:
        compared = _compare_places(tree, found, i, j)
        if compared != 0:
            return compared < 0
    ti, tj = load(found.doubles, _row(found, _T, i)), load(found.doubles, _row(found, _T, j))
    place, other = load(found.integers, _row(found, _AT, i)), load(found.integers, _row(found, _AT, j))
    if place < 0 or other < 0:
        return place < other
    face, other = load(found.integers, _row(found, _FACE, i)), load(found.integers, _row(found, _FACE, j))
    # rule: order-at-t
    return ti < tj or (ti == tj and face < other)


@kernel
def _compare_places(tree, found, i, j):
    """The order, -1, 0 or 1, of the edges or corners of two hits, by the coordinates of their ends."""
    a, b = _ends(tree, found, i)
    c, d = _ends(tree, found, j)
    first = _compare_corners(tree, a, c)
    return first if first != 0 else _compare_corners(tree, b, d)


@kernel
def _ends(tree, found, i):
    """The places in a block of the ends of a hit's edge, the lower first; for a corner, that twice."""
    place = load(found.integers, _row(found, _AT, i))
    edges = load(found.integers, _row(found, _EDGES, i))
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
    t, u, v = (offset(found.doubles, _row(found, OUT_T, kept)), offset(found.doubles, _row(found, OUT_U, kept)),
               offset(found.doubles, _row(found, OUT_V, kept)))  # fmt: skip
    face, side = (
        offset(found.integers, _row(found, OUT_FACE, kept)),
        offset(found.integers, _row(found, OUT_SIDE, kept)),
    )
    for k in range(count):
        i = load(found.integers, _row(found, _ORDER, k))
        hit = Best(
            load(found.doubles, _row(found, _T, i)),
            load(found.integers, _row(found, _FACE, i)),
            load(found.doubles, _row(found, _U, i)),
            load(found.doubles, _row(found, _V, i)),
            load(found.doubles, _row(found, _W, i)),
        )
        write_hit(HitPointers(t, face, u, v, side, side, t), k, scale, hit, dz, False)

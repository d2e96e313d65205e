"""Building the tree: octants at the midpoint with fitted boxes and merged leaves, or binary SAH splits.

A node starts as one group of faces. Groups are opened, largest first, until its eight places are used; then small
neighbours are merged. What still holds more than a leaf's faces becomes a node of its own.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.intersect import round_down, round_up
from renderer.jit import kernel
from renderer.layout import BLOCK_WORDS, CHILDREN, LANES, LEAF_BITS, NODE_WORDS, Tree

MIDPOINT, SAH = 0, 1
SPLITS = {"midpoint": MIDPOINT, "sah": SAH}

# Seven groups, and the eight that opening one more makes of it.
_GROUPS = 16
_BINS = 16


class Rule(NamedTuple):
    """How to build: the split rule, the most faces of a leaf, and the deepest level that the rule may split."""

    split: int
    leaf_size: int
    max_depth: int


class FaceOrder(NamedTuple):
    """The faces being sorted: ``order`` (F,) int32, the boxes it points into, and scratch for a counting sort."""

    boxes: NDArray[np.float32]
    order: NDArray[np.int32]
    scratch: NDArray[np.int32]
    codes: NDArray[np.uint8]
    start: NDArray[np.int64]


class Groups(NamedTuple):
    """The groups of one node: ranges of ``order``, their boxes, and what merging needs."""

    begin: NDArray[np.int64]
    end: NDArray[np.int64]
    box: NDArray[np.float32]
    owner: NDArray[np.int64]
    size: NDArray[np.int64]
    cost: NDArray[np.float32]
    ends: NDArray[np.int64]


def _new_groups() -> Groups:
    begin, end, owner, size = np.zeros((4, _GROUPS), np.int64)
    box, cost = np.zeros((_GROUPS, 6), np.float32), np.zeros((_GROUPS, _GROUPS), np.float32)
    return Groups(begin, end, box, owner, size, cost, np.zeros(8, np.int64))


@kernel
def face_boxes(vertices, faces, boxes):
    """Bounds of each face, (F, 6) float32: lower x, y, z, upper x, y, z, rounded outwards."""
    for f in range(len(faces)):
        a, b, c = faces[f]
        for k in range(3):
            x, y, z = vertices[a, k], vertices[b, k], vertices[c, k]
            boxes[f, k] = round_down(min(x, min(y, z)))
            boxes[f, 3 + k] = round_up(max(x, max(y, z)))


@kernel
def _fit(boxes, order, begin, end, box):
    """The union of the boxes of ``order[begin:end]``."""
    x0 = y0 = z0 = np.float32(np.inf)
    x1 = y1 = z1 = np.float32(-np.inf)
    for i in range(begin, end):
        b = boxes[order[i]]
        x0, y0, z0 = min(x0, b[0]), min(y0, b[1]), min(z0, b[2])
        x1, y1, z1 = max(x1, b[3]), max(y1, b[4]), max(z1, b[5])
    box[0], box[1], box[2], box[3], box[4], box[5] = x0, y0, z0, x1, y1, z1


@kernel
def _half_area(box):
    x, y, z = box[3] - box[0], box[4] - box[1], box[5] - box[2]
    return x * y + y * z + z * x


@kernel
def _union_half_area(a, b):
    x = max(a[3], b[3]) - min(a[0], b[0])
    y = max(a[4], b[4]) - min(a[1], b[1])
    z = max(a[5], b[5]) - min(a[2], b[2])
    return x * y + y * z + z * x


@kernel
def _centre_bounds(boxes, order, begin, end):
    """Bounds of the doubled centres lower + upper, as six float32."""
    x0 = y0 = z0 = np.float32(np.inf)
    x1 = y1 = z1 = np.float32(-np.inf)
    for i in range(begin, end):
        b = boxes[order[i]]
        x, y, z = b[0] + b[3], b[1] + b[4], b[2] + b[5]
        x0, y0, z0 = min(x0, x), min(y0, y), min(z0, z)
        x1, y1, z1 = max(x1, x), max(y1, y), max(z1, z)
    return x0, y0, z0, x1, y1, z1


@kernel
def _middle(low, high):
    """The midpoint, formed without overflow; ``low`` itself when nothing lies between."""
    return low + (high - low) * np.float32(0.5)


@kernel
def _open_octants(faces, begin, end, ends):
    """Sort ``order[begin:end]`` into octants about the middle of its centres. Returns how many are not empty.

    Their ends go to ``ends``. 1 means that the centres do not separate. The sort is stable.
    """
    x0, y0, z0, x1, y1, z1 = _centre_bounds(faces.boxes, faces.order, begin, end)
    mx, my, mz = _middle(x0, x1), _middle(y0, y1), _middle(z0, z1)
    start = faces.start
    start[:] = 0
    for i in range(begin, end):
        b = faces.boxes[faces.order[i]]
        code = np.int64(b[0] + b[3] > mx) + 2 * np.int64(b[1] + b[4] > my) + 4 * np.int64(b[2] + b[5] > mz)
        faces.codes[i] = code
        start[code + 1] += 1
    opened = 0
    for k in range(8):
        if start[k + 1] > 0:
            start[k + 1] += start[k]
            ends[opened] = begin + start[k + 1]
            opened += 1
        else:
            start[k + 1] = start[k]
    if opened > 1:
        _scatter(faces, begin, end)
    return opened


@kernel
def _scatter(faces, begin, end):
    """Stable counting sort of ``order[begin:end]`` by ``codes``; ``start`` holds each code's offset."""
    for i in range(begin, end):
        code = faces.codes[i]
        faces.scratch[begin + faces.start[code]] = faces.order[i]
        faces.start[code] += 1
    faces.order[begin:end] = faces.scratch[begin:end]


@kernel
def _open_evenly(begin, end, parts, ends):
    """Cut a range whose faces do not separate into equal parts, so that the build ends."""
    for k in range(parts):
        ends[k] = begin + (end - begin) * (k + 1) // parts
    return parts


@kernel
def _open_sah(faces, begin, end, ends):
    """Two groups by the binned surface area heuristic, cost counted in blocks of four. 1: no plane separates."""
    bounds = _centre_bounds(faces.boxes, faces.order, begin, end)
    best, best_axis, best_bin = np.float32(np.inf), -1, 0
    counts, bins, right = np.empty(_BINS, np.int64), np.empty((_BINS, 6), np.float32), np.empty(_BINS, np.float32)
    for axis in range(3):
        low, extent = bounds[axis], bounds[3 + axis] - bounds[axis]
        if extent > 0.0:
            _fill_bins(faces, begin, end, axis, (low, np.float32(_BINS) / extent), (counts, bins))
            cost, at = _best_plane(counts, bins, right)
            if cost < best:
                best, best_axis, best_bin = cost, axis, at
    if best_axis < 0:
        return 1
    low = bounds[best_axis]
    scale = np.float32(_BINS) / (bounds[3 + best_axis] - low)
    start = faces.start
    start[:] = 0
    for i in range(begin, end):
        b = faces.boxes[faces.order[i]]
        code = 0 if _bin(b[best_axis] + b[3 + best_axis], low, scale) <= best_bin else 1
        faces.codes[i] = code
        start[code + 1] += 1
    start[2] += start[1]
    ends[0], ends[1] = begin + start[1], end
    _scatter(faces, begin, end)
    return 2


@kernel
def _bin(centre, low, scale):
    return min(_BINS - 1, max(0, int((centre - low) * scale)))


@kernel
def _fill_bins(faces, begin, end, axis, to_bin, result):
    """Counts and bounds of the faces whose centres fall into each bin of an axis."""
    low, scale = to_bin
    counts, bins = result
    counts[:] = 0
    bins[:, :3] = np.inf
    bins[:, 3:] = -np.inf
    for i in range(begin, end):
        b = faces.boxes[faces.order[i]]
        k = _bin(b[axis] + b[3 + axis], low, scale)
        counts[k] += 1
        for j in range(3):
            bins[k, j] = min(bins[k, j], b[j])
            bins[k, 3 + j] = max(bins[k, 3 + j], b[3 + j])


@kernel
def _grow(box, other):
    for j in range(3):
        box[j] = min(box[j], other[j])
        box[3 + j] = max(box[3 + j], other[3 + j])


@kernel
def _best_plane(counts, bins, right):
    """The cheapest plane between two bins: sum of half area times blocks on both sides."""
    box = bins[_BINS - 1].copy()
    n = np.int64(0)
    for k in range(_BINS - 1, 0, -1):
        _grow(box, bins[k])
        n += counts[k]
        right[k] = _half_area(box) * ((n + LANES - 1) // LANES) if n > 0 else np.float32(np.inf)
    best, at = np.float32(np.inf), -1
    box[:] = bins[0]
    n = np.int64(0)
    for k in range(_BINS - 1):
        _grow(box, bins[k])
        n += counts[k]
        if n > 0:
            cost = _half_area(box) * ((n + LANES - 1) // LANES) + right[k + 1]
            if cost < best:
                best, at = cost, k
    return best, at


@kernel
def _open(rule, deep, faces, begin, end, ends):
    """Open one group by the split rule, or evenly where the rule cannot or the tree is as deep as allowed."""
    opened = 1
    if not deep:
        opened = _open_sah(faces, begin, end, ends) if rule.split == SAH else _open_octants(faces, begin, end, ends)
    if opened == 1:
        opened = _open_evenly(begin, end, min(2 if rule.split == SAH else 8, end - begin), ends)
    return opened


@kernel
def _make_groups(rule, deep, faces, groups, begin, end):
    """Open groups of ``order[begin:end]``, the one of largest area first, until eight places are used."""
    ends = groups.ends
    groups.begin[0], groups.end[0] = begin, end
    _fit(faces.boxes, faces.order, begin, end, groups.box[0])
    count = 1
    while count < 8:
        most, chosen = np.float32(-1.0), -1
        for g in range(count):
            area = _half_area(groups.box[g])
            # "not <=" also takes an area that overflowed to NaN, so that the build always goes on.
            if groups.end[g] - groups.begin[g] > rule.leaf_size and not area <= most:
                most, chosen = area, g
        if chosen < 0:
            break
        begin = groups.begin[chosen]
        opened = _open(rule, deep, faces, begin, groups.end[chosen], ends)
        for k in range(opened):
            g = chosen if k == 0 else count + k - 1
            groups.begin[g], groups.end[g] = begin, ends[k]
            _fit(faces.boxes, faces.order, begin, ends[k], groups.box[g])
            begin = ends[k]
        count += opened - 1
    return count


@kernel
def _merge(rule, groups, count):
    """Merge pairs of groups while they fit one leaf, or while there are more than eight.

    Each time the pair that adds least area times faces. ``owner[g]`` becomes the group that g belongs to, and
    ``size`` and ``box`` of an owner those of all its groups.
    """
    owner, size, cost = groups.owner, groups.size, groups.cost
    for g in range(count):
        owner[g], size[g] = g, groups.end[g] - groups.begin[g]
    for a in range(count):
        for b in range(a + 1, count):
            cost[a, b] = _merge_cost(groups, a, b)
    left = count
    while left > 1:
        least, a, b = np.float32(np.inf), -1, -1
        for i in range(count):
            if owner[i] != i:
                continue
            for j in range(i + 1, count):
                if owner[j] == j and cost[i, j] < least and (left > 8 or size[i] + size[j] <= rule.leaf_size):
                    least, a, b = cost[i, j], i, j
        if a < 0:
            break
        _grow(groups.box[a], groups.box[b])
        size[a] += size[b]
        for g in range(count):
            if owner[g] == b:
                owner[g] = a
        for g in range(count):
            if owner[g] == g and g != a:
                cost[min(a, g), max(a, g)] = _merge_cost(groups, min(a, g), max(a, g))
        left -= 1


@kernel
def _merge_cost(groups, a, b):
    """What one box for both costs more than two: added half area times faces; finite, so that any pair can win."""
    added = _union_half_area(groups.box[a], groups.box[b]) * (groups.size[a] + groups.size[b])
    added -= _half_area(groups.box[a]) * groups.size[a] + _half_area(groups.box[b]) * groups.size[b]
    largest = np.float32(3.0e38)
    return min(np.float32(added), largest) if added == added else largest


@kernel
def _gather(faces, groups, count):
    """Move merged groups' faces side by side and set each owner's ``begin`` and ``end`` to the whole."""
    first = groups.begin[0]
    for g in range(count):
        first = min(first, groups.begin[g])
    at = first
    for a in range(count):
        for g in range(a, count):
            if groups.owner[a] == a and groups.owner[g] == a:
                for i in range(groups.begin[g], groups.end[g]):
                    faces.scratch[at] = faces.order[i]
                    at += 1
    faces.order[first:at] = faces.scratch[first:at]
    for a in range(count):
        if groups.owner[a] == a:
            groups.begin[a], groups.end[a] = first, first + groups.size[a]
            first += groups.size[a]


@kernel
def _longer(array, length):
    """``array``, or a copy of at least twice its length when it holds fewer than ``length``."""
    if length <= len(array):
        return array
    longer = np.empty(max(length, 2 * len(array)), array.dtype)
    longer[: len(array)] = array
    return longer


@kernel
def _emit_leaf(order, begin, end, block_faces, blocks):
    """Write a leaf's faces into blocks; returns the child's code, the grown array and the number of blocks."""
    count = (end - begin + LANES - 1) // LANES
    block_faces = _longer(block_faces, (blocks + count) * LANES)
    for i in range(count * LANES):
        block_faces[blocks * LANES + i] = order[begin + i] if begin + i < end else -1
    return ~((blocks << LEAF_BITS) | (count - 1)), block_faces, blocks + count


@kernel
def _clear_node(nodes, links, base):
    for k in range(8):
        for axis in range(3):
            nodes[base + 16 * axis + k] = np.inf
            nodes[base + 16 * axis + 8 + k] = -np.inf
        links[base + CHILDREN + k] = 0


@kernel
def _set_bounds(nodes, base, place, box):
    for axis in range(3):
        nodes[base + 16 * axis + place] = box[axis]
        nodes[base + 16 * axis + 8 + place] = box[3 + axis]


@kernel
def build_nodes(faces, groups, rule, pending):
    """Nodes and leaves over all faces: (node words float32, block faces int32, levels of nodes).

    Children are written in the order of their groups and nodes in depth-first order, so the result depends on
    nothing but the input. ``pending`` (n, 4) int64 is the stack: begin, end, level, the parent's link.
    """
    count = len(faces.order)
    nodes = np.empty(max(1, count // 8) * NODE_WORDS, np.float32)
    block_faces = np.empty(max(1, count // 3) * LANES, np.int32)
    pending[0, 0], pending[0, 1], pending[0, 2], pending[0, 3] = 0, count, 1, -1
    top, used, blocks, depth = 1, 0, 0, 0
    while top > 0:
        # Make the node and hang it below its parent.
        top -= 1
        begin, end, level, parent = pending[top, 0], pending[top, 1], pending[top, 2], pending[top, 3]
        depth = max(depth, level)
        base = used * NODE_WORDS
        nodes = _longer(nodes, base + NODE_WORDS)
        links = nodes.view(np.int32)
        _clear_node(nodes, links, base)
        if parent >= 0:
            links[parent] = used
        used += 1
        # Cut its faces into at most eight groups.
        made = _make_groups(rule, level > rule.max_depth, faces, groups, begin, end)
        _merge(rule, groups, made)
        _gather(faces, groups, made)
        # Each group becomes a leaf or waits to become a node.
        place = 0
        for g in range(made):
            if groups.owner[g] != g or groups.size[g] == 0:
                continue
            _set_bounds(nodes, base, place, groups.box[g])
            link = base + CHILDREN + place
            if groups.size[g] <= rule.leaf_size:
                code, block_faces, blocks = _emit_leaf(
                    faces.order, groups.begin[g], groups.end[g], block_faces, blocks
                )
                links[link] = code
            else:
                pending[top, 0], pending[top, 1] = groups.begin[g], groups.end[g]
                pending[top, 2], pending[top, 3] = level + 1, link
                top += 1
            place += 1
    return nodes[: used * NODE_WORDS].copy(), block_faces[: blocks * LANES].copy(), depth


@kernel
def fill_blocks(vertices, faces, block_faces, blocks):
    """Copy the vertices of each block's faces into its rows; unused places repeat the block's first vertex."""
    for place in range(len(block_faces)):
        face = block_faces[place]
        first = faces[block_faces[place // LANES * LANES], 0]
        base = place // LANES * BLOCK_WORDS + place % LANES
        for corner in range(3):
            vertex = first if face < 0 else faces[face, corner]
            for axis in range(3):
                blocks[base + LANES * (3 * corner + axis)] = vertices[vertex, axis]


def _blocks(vertices: NDArray[np.float64], faces: NDArray[np.int32], block_faces: NDArray[np.int32]) -> Any:
    """The blocks, in float32 when that holds every vertex exactly."""
    with np.errstate(over="ignore"):
        exact = bool((vertices.astype(np.float32) == vertices).all())
    blocks = np.empty(len(block_faces) // LANES * BLOCK_WORDS, np.float32 if exact else np.float64)
    fill_blocks(vertices, faces, block_faces, blocks)
    return blocks


def build_tree(vertices: NDArray[np.float64], faces: NDArray[np.int32], rule: Rule) -> tuple[Tree, int]:
    """Build the tree over all faces; returns it with the number of levels of nodes."""
    count = len(faces)
    boxes = np.empty((count, 6), np.float32)
    face_boxes(vertices, faces, boxes)
    scratch, codes = np.empty(count, np.int32), np.empty(count, np.uint8)
    order = FaceOrder(boxes, np.arange(count, dtype=np.int32), scratch, codes, np.zeros(9, np.int64))
    # Depth-first with at most eight children waiting a level; even cuts end within 64 levels of any count.
    pending = np.empty((8 * (rule.max_depth + 64), 4), np.int64)
    nodes, block_faces, depth = build_nodes(order, _new_groups(), rule, pending)
    return Tree(nodes, nodes.view(np.int32), _blocks(vertices, faces, block_faces), block_faces), depth


def build_blocks(vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> Tree:
    """The blocks alone, in the order of the faces, for a search without a tree."""
    block_faces = np.full(-(-len(faces) // LANES) * LANES, -1, np.int32)
    block_faces[: len(faces)] = np.arange(len(faces))
    nodes = np.empty(0, np.float32)
    return Tree(nodes, nodes.view(np.int32), _blocks(vertices, faces, block_faces), block_faces)

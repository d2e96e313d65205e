"""Reading a scene in kernels: meshes with many instances, each placed by a matrix.

    top's nodes --+-- instance 1 -- nodes of its mesh -- blocks, placed when they are read
                  +-- instance 2 -- nodes of the same mesh ...

A scene answers bit for bit like the one mesh that its placed meshes make together. Corners are placed on the fly, as
``Mesh.transformed`` places them, and tested in the world by the tests of any mesh. Only boxes are entered in the mesh's
own frame, by a ray that is turned into it. Boxes grow by what the rounding of that, and of the corners, may cost.

A node, or a block, of a scene is one number: the instance above the NUMBER_BITS of its number in the mesh. Instance 0
is the top, whose leaves are instances.
"""

from typing import Any, NamedTuple

import numpy as np

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.simd import (
    broadcast_like,
    double_of,
    extract,
    fabs,
    float32_pointer,
    float64_pointer,
    int32_pointer,
    int64_pointer,
    is_negative,
    load,
    load4,
    load8,
    local_floats,
    local_words,
    maximum,
    movemask,
    narrow,
    offset,
    pointer,
    select,
    splat8,
    store,
)
from renderer.numerics.vec3 import row3, scale
from renderer.trace.best import side_of
from renderer.trace.intersect import Slabs, enter_in_order, largest_of, make_slab, make_slabs, room_of
from renderer.trace.layout import (
    BLOCK_WORDS,
    BLOCKS,
    CHILDREN,
    FACES,
    LEAF_BITS,
    MASK_BITS,
    NODE_WORDS,
    NODES,
    SCALE,
    TREE_WORDS,
    WIDE,
)
from renderer.trace.packet import child_of, enter_beam, make_beam, meet_octant, most_of, push_nearest_last
from renderer.trace.ray_lanes import (
    CHILD,
    LIMIT,
    NUMBER,
    TOP,
    WIDTH,
    put_slabs,
)
from renderer.trace.rays import ray_at
from renderer.trace.stack_entry import octant_of
from renderer.trace.starts.record import start_row
from renderer.trace.stream import END, NO_DISTANCE, prefetch_block, prefetch_node, topmost_within
from renderer.trace.ways import Ways

# An object, int64: a tree as in ``layout``; the addresses of its mesh's vertices and faces; and, as float64 in the
# tree's units, the middle and the half of its mesh's box. Eight words may be read from the middle on.
VERTICES, MESH_FACES, MIDDLE, HALF, OBJECT_WORDS = (TREE_WORDS + k for k in (0, 1, 2, 5, 10))
# An instance, float64: the matrix that places a block's corners, three rows of four; the inverse of its linear part, by
# columns; how far, in the mesh's units, rounding may move what is placed; the placed middle of the mesh; and as int64
# the address of its object, the number of the first of its faces, and its flags.
MATRIX, INVERSE, ROOM, PLACE, OBJECT, FIRST_FACE, FLAGS, INSTANCE_WORDS = 0, 12, 21, 24, 27, 28, 29, 30
# The bits of flags: the mask below, whether the matrix mirrors, and whether no ray sees the instance.
MIRRORS, HIDDEN = 1 << 32, 1 << 33
# A scene, as kernels get it, uint64: addresses of the top's nodes and of the instances; their number; and the sides of
# faces that rays hit: 0 both, 1 that of the normal, 2 the other.
TOP_NODES, INSTANCES, INSTANCE_COUNT, FACING, SCENE_WORDS = range(5)

# An instance in the number of a node or block, and of a slot, four times as large.
NUMBER_BITS = 32
_NUMBER = (1 << NUMBER_BITS) - 1
SLOT_BITS = NUMBER_BITS + 2
# The child on a ray's stack where it leaves an instance; its distance is NO_DISTANCE, so that no limit passes over it.
_LEAVE = END + 1
# A hit that is uncertain, once resolved, is within 2^-22 of its distance of its face (``intersect.DOUBT``). Boxes grow
# by four times as much, as the distance counts along each axis alone.
DISTANCE_ROOM = 2.0**-20

# The most instances that a packet finds for its rays, so few that any stack holds them.
_SHARED = 24

# The rows of lanes that meshes do not use.
_INSTANCE, _NODES_AT, _BLOCKS_AT, _MASK, _IGNORED = (row * WIDTH for row in range(11, 16))
# What the roundings of a placed box may cost, eight of float32: as a share of all that is added, and of its least
# number.
_BOX_ROOM, _TINY = np.float32(2.0**-20), np.float32(2.0**-146)


class ScenePointers(NamedTuple):
    """A scene as the traversal reads it.

    nodes, links, top          the nodes of its top, the same as links, and their address
    instances, words           the instances as float64 and as int64
    instance_count             their number
    facing                     the sides of faces that rays hit
    boxes                      room for a node's boxes
    count, has_nodes, scale, ways  as of ``trees.TreePointers``
    """

    nodes: Any
    links: Any
    top: int
    instances: Any
    words: Any
    instance_count: int
    facing: int
    boxes: Any
    count: int  # type: ignore[assignment]  # tuples have a method of that name
    has_nodes: bool
    scale: float
    ways: Ways


@inlined
def _may_hit(tree, place, mask, ignored):
    number = place >> NUMBER_BITS
    return number == 0 or _meets(_instance(tree, number)[1], number, mask, ignored)


@inlined
def _admits(tree, w, dz):
    # rule: facing
    return tree.facing == 0 or (tree.facing == 1) == (side_of(w, dz) > 0)


@kernel
def _trace_packet(tree, rays, stack, any_hit):
    """Sixteen rays share the way through the top. The instances that they meet stay on the stack, the nearest last, and
    the rays go on from there as lanes; from the root if there are more than _SHARED.
    """
    beam, floats, nodes, listed = make_beam(rays), rays.floats, tree.nodes, local_words()
    limit, top, node, count = most_of(floats, LIMIT), np.int64(0), np.int64(0), np.int64(0)
    while node >= 0:
        t0, meets = enter_beam(nodes, node * NODE_WORDS, beam, limit)
        top = push_nearest_last(tree, node, meets, t0, beam.order, stack, top)
        node = np.int64(-1)
        while node < 0 and top > 0:
            top -= 1
            entry = load(stack, top)
            child, at_ = child_of(tree, octant_of(entry))
            if child >= 0:
                node = child
            elif count < _SHARED and meet_octant(nodes, rays, at_) != 0:
                store(listed, count, entry)
                count += 1
            elif count == _SHARED:
                for octant in range(8):
                    store(stack, octant, octant)
                return 8, np.int64(0)
    for k in range(count):
        store(stack, k, load(listed, count - 1 - k))
    return count, np.int64(0)


@inlined
def _instance(tree, number):
    """Pointers to an instance, from 1 on, as float64 and as int64."""
    at = (number - 1) * INSTANCE_WORDS
    return offset(tree.instances, at), offset(tree.words, at)


@inlined
def _object(words):
    """Pointer to the object of an instance, int64."""
    return int64_pointer(load(words, OBJECT))


@inlined
def _middle(words):
    """Pointer to the middle of the mesh of an instance."""
    return offset(float64_pointer(load(words, OBJECT)), MIDDLE)


@inlined
def _nodes(object_):
    """The address of an object's nodes."""
    return load(object_, NODES)


@inlined
def _swapped(words):
    """12 if the instance's matrix mirrors, else 0."""
    return 12 * np.int64(load(words, FLAGS) & MIRRORS != 0)


@inlined
def column_of(instance, j, factor):
    """The j-th column of the linear part of an instance's matrix, times a factor."""
    m = offset(instance, MATRIX + j)
    return scale((load(m, 0), load(m, 4), load(m, 8)), factor)


@inlined
def _along(matrix, row, x, y, z):
    """A placed coordinate, in the order of sums of ``Mesh.transformed``."""
    m = offset(matrix, row)
    # rule: placed-corner
    return ((x * load(m, 0) + y * load(m, 1)) + z * load(m, 2)) + load(m, 3)


@inlined
def _corners(tree, base, rows):
    number = (base // BLOCK_WORDS) >> NUMBER_BITS
    local = base - number * (BLOCK_WORDS << NUMBER_BITS)
    matrix, words = _instance(tree, number)
    object_ = _object(words)
    blocks = load(object_, BLOCKS)
    swap = _swapped(words)
    # rule: mirrored-corners
    rows = _PlacedRows(matrix, rows.row_x, rows.row_y, rows.row_z, 12 + swap, 24 - swap)
    if load(object_, WIDE) != 0:
        return _placed_rows(float64_pointer(blocks), local, rows)
    return _placed_rows(float32_pointer(blocks), local, rows)


class _PlacedRows(NamedTuple):
    """The matrix of an instance; its rows in the order of a ray's axes; and where the second and the third corner begin
    in a block, which a matrix that mirrors swaps.
    """

    matrix: Any
    row_x: int
    row_y: int
    row_z: int
    second: int
    third: int


@inlined
def _placed_rows(blocks, base, rows):
    x0, y0, z0 = _placed_four(blocks, base, rows)
    x1, y1, z1 = _placed_four(blocks, base + rows.second, rows)
    x2, y2, z2 = _placed_four(blocks, base + rows.third, rows)
    return x0, x1, x2, y0, y1, y2, z0, z1, z2


@inlined
def _placed_four(blocks, at, rows):
    x, y, z = load4(blocks, at), load4(blocks, at + 4), load4(blocks, at + 8)
    matrix = rows.matrix
    return _along(matrix, rows.row_x, x, y, z), _along(matrix, rows.row_y, x, y, z), _along(matrix, rows.row_z, x, y, z)


@inlined
def _coordinate(tree, at):
    number = (at // BLOCK_WORDS) >> NUMBER_BITS
    local = at - number * (BLOCK_WORDS << NUMBER_BITS)
    matrix, words = _instance(tree, number)
    object_ = _object(words)
    within = local % BLOCK_WORDS
    corner, row, slot = within // 12, within % 12 // 4 * 4, within % 4
    if corner > 0 and _swapped(words) != 0:
        corner = 3 - corner
    x, y, z = _block_corner(object_, local - within + 12 * corner + slot)
    return _along(matrix, row, x, y, z)


@inlined
def _block_corner(object_, at):
    blocks = load(object_, BLOCKS)
    if load(object_, WIDE) != 0:
        wide = float64_pointer(blocks)
        return load(wide, at), load(wide, at + 4), load(wide, at + 8)
    narrow_ = float32_pointer(blocks)
    return np.float64(load(narrow_, at)), np.float64(load(narrow_, at + 4)), np.float64(load(narrow_, at + 8))


@inlined
def _face(tree, slot):
    number = slot >> SLOT_BITS
    _, words = _instance(tree, number)
    face = load(int32_pointer(load(_object(words), FACES)), slot & ((1 << SLOT_BITS) - 1))
    # rule: faces-of-scene
    return np.int32(load(words, FIRST_FACE) + face) if face >= 0 else np.int32(-1)


@inlined
def _corners_of_face(tree, starts, face):
    return corners_of_scene_face(tree, face)


@kernel
def corners_of_scene_face(tree, face):
    """The placed corners of a face of the scene, as tuples."""
    number = instance_with(tree.words, tree.instance_count, face)
    return placed_corners(tree, number, face - load(_instance(tree, number)[1], FIRST_FACE))


class PlacedFace(NamedTuple):
    """A face of an instance: the instance's matrix and its object, the numbers of the face's vertices in the mesh, in
    the order of the placed corners, and whether the matrix mirrors.
    """

    matrix: Any
    object_: Any
    a: int
    b: int
    c: int
    mirrors: bool


@inlined
def placed_face(tree, number, face):
    """The ``PlacedFace`` of an instance, from 1 on, and the number of a face in its mesh."""
    matrix, words = _instance(tree, number)
    object_, mirrors = _object(words), _swapped(words) != 0
    a, b, c = row3(int32_pointer(load(object_, MESH_FACES)), face)
    return PlacedFace(matrix, object_, a, c if mirrors else b, b if mirrors else c, mirrors)


@kernel
def placed_corners(tree, number, face):
    """The placed corners of a face of an instance, from 1 on, as tuples."""
    of = placed_face(tree, number, face)
    matrix, vertices, unit = of.matrix, float64_pointer(load(of.object_, VERTICES)), double_of(load(of.object_, SCALE))
    return (
        _placed(matrix, vertices, of.a, unit), _placed(matrix, vertices, of.b, unit),
        _placed(matrix, vertices, of.c, unit),
    )  # fmt: skip


@inlined
def _placed(matrix, vertices, vertex, unit):
    x, y, z = scale(row3(vertices, vertex), unit)
    return _along(matrix, 0, x, y, z), _along(matrix, 4, x, y, z), _along(matrix, 8, x, y, z)


@kernel
def instance_with(words, count, face):
    """The instance, from 1 on, that has a face of the scene: the last whose first face is not above it."""
    low, high = np.int64(1), np.int64(count)
    while low < high:
        middle = (low + high + 1) // 2
        if load(words, (middle - 1) * INSTANCE_WORDS + FIRST_FACE) <= face:
            low = middle
        else:
            high = middle - 1
    return low


@inlined
def _child(tree, node, octant):
    number, local = node >> NUMBER_BITS, node & _NUMBER
    if number == 0:
        link = np.int64(load(tree.links, local * NODE_WORDS + CHILDREN + octant))
        return link if link >= 0 else (~link + 1) << NUMBER_BITS
    links = int32_pointer(_nodes(_object(_instance(tree, number)[1])))
    return _in_scene(number, np.int64(load(links, local * NODE_WORDS + CHILDREN + octant)))


@inlined
def _in_scene(number, child):
    """A child of a mesh's node as one of the scene."""
    if child >= 0:
        return (number << NUMBER_BITS) | child
    return ~((number << (NUMBER_BITS + LEAF_BITS)) | ~child)


@inlined
def _boxes(tree, node):
    number, local = node >> NUMBER_BITS, node & _NUMBER
    if number == 0:
        return tree.nodes, local * NODE_WORDS
    matrix, words = _instance(tree, number)
    place_boxes(matrix, words, local * NODE_WORDS, tree.boxes)
    return tree.boxes, np.int64(0)


@kernel
def place_boxes(instance, words, base, boxes):
    """Write boxes, as six rows of eight, around the placed boxes of a node of an instance's mesh."""
    nodes, middle = float32_pointer(_nodes(_object(words))), _middle(words)
    x, y, z = _extent(nodes, base, middle, 0), _extent(nodes, base, middle, 1), _extent(nodes, base, middle, 2)
    none = load8(nodes, base) > load8(nodes, base + 8)
    for k in range(3):
        row = offset(instance, MATRIX + 4 * k)
        a, b, c = narrow(load(row, 0)), narrow(load(row, 1)), narrow(load(row, 2))
        place = splat8(narrow(load(instance, PLACE + k)))
        centre = place + ((x.centre * splat8(a) + y.centre * splat8(b)) + z.centre * splat8(c))
        half = (x.half * splat8(abs(a)) + y.half * splat8(abs(b))) + z.half * splat8(abs(c))
        size = (x.size * splat8(abs(a)) + y.size * splat8(abs(b))) + z.size * splat8(abs(c)) + fabs(place)
        half = half + size * splat8(_BOX_ROOM) + splat8(_TINY)
        store(boxes, 16 * k, select(none, splat8(np.float32(np.inf)), centre - half))
        store(boxes, 16 * k + 8, select(none, splat8(np.float32(-np.inf)), centre + half))


class _Extent(NamedTuple):
    """Eight boxes on one axis: their middles from that of the mesh, their halves, and a bound of all that is added."""

    centre: Any
    half: Any
    size: Any


@inlined
def _extent(nodes, base, middle, axis):
    low, high = load8(nodes, base + 16 * axis), load8(nodes, base + 16 * axis + 8)
    m, two = splat8(narrow(load(middle, axis))), splat8(np.float32(0.5))
    centre, half = (low + high) * two - m, (high - low) * two
    return _Extent(centre, half, fabs(centre) + half + fabs(m))


@inlined
def _enter(tree, node, single, upper):
    number, local, lower = node >> NUMBER_BITS, node & _NUMBER, single.lower
    if number == 0:
        return enter_in_order(tree.nodes, tree.links, local * NODE_WORDS, single.slabs, lower, upper)
    matrix, words = _instance(tree, number)
    at = _nodes(_object(words))
    nodes, links, base = float32_pointer(at), int32_pointer(at), local * NODE_WORDS
    slabs = slabs_within(matrix, words, single.ray, single.largest)
    distances, bits, order = enter_in_order(nodes, links, base, slabs, lower, upper)
    return distances, bits if _meets(words, number, single.ray.mask, single.ray.ignored) else bits & 0, order


@inlined
def _meets(words, number, mask, ignored):
    """Whether a ray with that mask, which ignores one instance, may hit another."""
    # rule: mask-of-ray
    return np.int64(mask) & load(words, FLAGS) & MASK_BITS != 0 and np.int64(ignored) != number


@inlined
def slabs_within(instance, words, ray, largest):
    """The ``Slabs`` of a ray in the frame of an instance's mesh; distances count as in the world."""
    px, py, pz = (
        ray.ox - load(instance, PLACE), ray.oy - load(instance, PLACE + 1), ray.oz - load(instance, PLACE + 2)
    )  # fmt: skip
    middle, slack = _middle(words), ray.slack if ray.slack < np.inf else 0.0
    reach = maximum(maximum(abs(px), abs(py)), abs(pz)) * DISTANCE_ROOM + slack
    # A lane for each axis, and five that nobody reads.
    a, b, c = load8(instance, INVERSE), load8(instance, INVERSE + 3), load8(instance, INVERSE + 6)
    o = load8(middle, 0) + ((a * broadcast_like(px, a) + b * broadcast_like(py, a)) + c * broadcast_like(pz, a))
    dx, dy, dz = broadcast_like(ray.dx, a), broadcast_like(ray.dy, a), broadcast_like(ray.dz, a)
    d = (a * dx + b * dy) + c * dz
    # rule: room-of-instance
    room = load8(instance, ROOM) + ((fabs(a) + fabs(b)) + fabs(c)) * broadcast_like(reach, a)
    _, _, near, far, near_inverse, far_inverse = make_slab(0, o, d, broadcast_like(largest, a), room_of(room))
    near_rows, far_rows = _rows_of(movemask(is_negative(d)))
    return Slabs(
        *near_rows, *far_rows, *_three(near), *_three(far), *_three(near_inverse), *_three(far_inverse)
    )  # fmt: skip


@inlined
def _three(vector):
    """The lanes of the three axes."""
    return extract(vector, 0), extract(vector, 1), extract(vector, 2)


@inlined
def _rows_of(signs):
    """``make_slab``'s near and far rows of the three axes, from the bits of those where a direction is negative."""
    x, y, z = 8 * (signs & 1), 16 + 4 * (signs & 2), 32 + 2 * (signs & 4)
    return (x, y, z), (x ^ 8, y ^ 8, z ^ 8)


@inlined
def _begin(tree, rays, prepared, r, number):
    _, _, mask, ignored = start_row(rays.starts, number)
    store(prepared.integers, _INSTANCE + r, 0)
    store(prepared.integers, _NODES_AT + r, tree.top)
    store(prepared.integers, _MASK + r, np.int64(mask))
    store(prepared.integers, _IGNORED + r, np.int64(ignored))


@inlined
def _node_of(tree, prepared, r):
    nodes, node = load(prepared.integers, _NODES_AT + r), load(prepared.integers, CHILD + r) & _NUMBER
    return float32_pointer(nodes), int32_pointer(nodes), node * NODE_WORDS


@inlined
def _resume(tree, rays, prepared, lanes, r, any_hit):
    # rule: resume-in-scene
    integers, limit = prepared.integers, load(prepared.floats, LIMIT + r)
    number, top = load(integers, _INSTANCE + r), topmost_within(lanes, load(integers, TOP + r), limit, any_hit)
    child = np.int64(load(lanes.children, top))
    if child == _LEAVE or (number == 0 and _LEAVE < child < 0):
        number, top, child = _change_frame(tree, rays, prepared, lanes, r, any_hit, top, limit)
    if number > 0:
        child = _in_scene(number, child)
    store(integers, CHILD + r, child)
    store(integers, TOP + r, top)
    if child != END:
        _prefetch(tree, prepared, r, child)
    return child


@kernel
def _change_frame(tree, rays, prepared, lanes, r, any_hit, top, limit):
    """Leave and enter instances, from the entry at ``top`` of a ray's stack on, to the next node or to END.

    Returns the instance, the new top, and the child there.
    """
    while True:
        child = np.int64(load(lanes.children, top))
        if child == END:
            break
        if _LEAVE < child < 0 and _may_enter(tree, prepared, r, ~child + 1):
            number = ~child + 1
            store(lanes.distances, top, NO_DISTANCE)
            store(lanes.children, top, np.int32(_LEAVE))
            _enter_instance(tree, rays, prepared, r, number)
            return number, top + 1, np.int64(0)
        if child >= 0:
            if load(prepared.integers, _INSTANCE + r) != 0:
                _return_to_top(tree, rays, prepared, r)
            break
        top = topmost_within(lanes, top, limit, any_hit)
    store(prepared.integers, _INSTANCE + r, 0)
    return np.int64(0), top, child


@inlined
def _may_enter(tree, prepared, r, number):
    _, words = _instance(tree, number)
    return _meets(words, number, load(prepared.integers, _MASK + r), load(prepared.integers, _IGNORED + r))


@inlined
def _enter_instance(tree, rays, prepared, r, number):
    """Turn the ray in lane ``r`` into the frame of an instance's mesh."""
    ray, _ = ray_at(rays, load(prepared.integers, NUMBER + r))
    instance, words = _instance(tree, number)
    object_ = _object(words)
    store(prepared.integers, _INSTANCE + r, number)
    put_slabs(prepared, r, slabs_within(instance, words, ray, largest_of(ray)))
    store(prepared.integers, _NODES_AT + r, _nodes(object_))
    # The address is even: its lowest bit has room for WIDE.
    store(prepared.integers, _BLOCKS_AT + r, load(object_, BLOCKS) | load(object_, WIDE))


@inlined
def _return_to_top(tree, rays, prepared, r):
    """Turn the ray in lane ``r`` back into the frame of the scene."""
    ray, _ = ray_at(rays, load(prepared.integers, NUMBER + r))
    put_slabs(prepared, r, make_slabs(ray, largest_of(ray)))
    store(prepared.integers, _NODES_AT + r, tree.top)


@inlined
def _prefetch(tree, prepared, r, child):
    """Prefetch the record of a ray's next step."""
    if child >= 0:
        prefetch_node(float32_pointer(load(prepared.integers, _NODES_AT + r)), child & _NUMBER)
    else:
        at = load(prepared.integers, _BLOCKS_AT + r)
        prefetch_block(float32_pointer(at & ~1), (~child >> LEAF_BITS) & _NUMBER, at & 1)


@inlined
def scene_pointers(descriptor):
    """The pointers in a scene's descriptor, whose arrays the caller must keep alive."""
    at = pointer(descriptor)
    nodes, instances = np.int64(load(at, TOP_NODES)), np.int64(load(at, INSTANCES))
    return ScenePointers(
        float32_pointer(nodes), int32_pointer(nodes), nodes, float64_pointer(instances), int64_pointer(instances),
        np.int64(load(at, INSTANCE_COUNT)), np.int64(load(at, FACING)), local_floats(), np.int64(0), True, 1.0,
        Ways(
            _corners, _coordinate, _face, _corners_of_face, _child, _boxes, _enter, _begin, _node_of, _resume,
            _may_hit, _admits, _trace_packet,
        ),
    )  # fmt: skip

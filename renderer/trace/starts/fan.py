"""The faces around a start as a table of float64: whether one stops a ray, for many directions.

As in ``region``, the paths to the start's own region and to the directions share their hub. Crossings are found from
scalar products; if rounding could decide one, ``region`` decides.
"""

import numpy as np

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.double_double import heads
from renderer.numerics.simd import load, offset, store
from renderer.numerics.vec3 import cross, dot, largest_component, normalized, put3, three
from renderer.trace.starts.cone import (
    FIRST_NODE,
    FREE_PATH,
    NO_NODE,
    OTHER_PATH,
    PATH,
    SECOND_NODE,
    cone_of,
    holder,
    put_holder,
)
from renderer.trace.starts.region import ATTEMPTS, are_even, hub_of, path_to_cone

# The head of a table: the number of faces, 0 where there is no table; whether they are one closed fan; and the parity
# of the path to the start's region. Then for each face: the unit normal n, n x a and n x b of the outline's directions
# a and b, the products of these three with the hub, the parity of the path, and the two nodes.
_COUNT, _CLOSED, _PARITY, FAN_HEAD = range(4)
_NORMAL, _FIRST, _SECOND, _HUB, _PATH, _NODES, _ROW = 0, 3, 6, 9, 12, 13, 15
OPEN, STOPPED, UNSURE = range(3)
# What rounding may have made of a product of unit vectors.
_ROUNDED = 2.0**-40
# The least product of a normal with the hub, so that its own rounding does not matter.
_LEAST = 2.0**-12


@inlined
def fan_doubles(count):
    """The number of float64 in a table of ``count`` faces."""
    return FAN_HEAD + _ROW * count


@inlined
def size_of_fan(table):
    """The number of float64 in a table."""
    return fan_doubles(np.int64(load(table, _COUNT)))


@inlined
def clear_fan(table):
    """Mark the table as absent."""
    store(table, _COUNT, 0.0)


@inlined
def has_fan(table):
    return load(table, _COUNT) > 0.0


@kernel
def write_fan(tree, anchor, holders, count, nodes, k, side, table, room):
    """Write the table of a start in the region beside the k-th of its holders, on one side of it, if it fits in
    ``room`` float64.
    """
    clear_fan(table)
    if fan_doubles(count) > room:
        return
    for attempt in range(ATTEMPTS):
        sound = path_to_cone(tree, anchor, holders, count, k, side, attempt, PATH)
        if sound and _write_rows(tree, anchor, holders, count, heads(hub_of(attempt)), table):
            # rule: closed-fan
            store(table, _CLOSED, np.float64(_are_closed(holders, count, nodes)))
            store(table, _COUNT, np.float64(count))
            return


@kernel
def _write_rows(tree, anchor, holders, count, hub, table):
    """Write the rows of all faces. Returns whether the hub is far from their planes."""
    parity = np.int64(0)
    for j in range(count):
        cone, row = cone_of(tree, anchor, holders, j), offset(table, FAN_HEAD + _ROW * j)
        n = normalized(heads(cone.face.normal))
        first, second = cross(n, normalized(heads(cone.first))), cross(n, normalized(heads(cone.second)))
        if abs(dot(n, hub)) < _LEAST:
            return False
        put3(row, _NORMAL, n)
        put3(row, _FIRST, first if cone.kind > 0 else (0.0, 0.0, 0.0))
        put3(row, _SECOND, second if cone.kind > 1 else (0.0, 0.0, 0.0))
        # What has no outline holds every place of its plane.
        products = dot(n, hub), dot(first, hub) if cone.kind > 0 else 1.0, dot(second, hub) if cone.kind > 1 else -1.0
        put3(row, _HUB, products)
        store(row, _PATH, np.float64(holder(holders, j, PATH)))
        store(row, _NODES, np.float64(holder(holders, j, FIRST_NODE)))
        store(row, _NODES + 1, np.float64(holder(holders, j, SECOND_NODE)))
        parity ^= holder(holders, j, PATH)
    store(table, _PARITY, np.float64(parity))
    return True


@kernel
def _are_closed(holders, count, nodes):
    """Whether the cones are one closed fan: two at each node, and no subset of them is one."""
    for j in range(count):
        if holder(holders, j, FIRST_NODE) == NO_NODE:
            return False
        put_holder(holders, j, OTHER_PATH, 0)
        put_holder(holders, j, FREE_PATH, 0)
    for node in range(nodes):
        ends = 0
        for j in range(count):
            ends += int(holder(holders, j, FIRST_NODE) == node) + int(holder(holders, j, SECOND_NODE) == node)
        if ends != 2:
            return False
    # One fan: walked around from the first cone it has all of them.
    node, came, walked = holder(holders, 0, SECOND_NODE), 0, 1
    while node != holder(holders, 0, FIRST_NODE) and walked < count:
        for j in range(count):
            one, other = holder(holders, j, FIRST_NODE), holder(holders, j, SECOND_NODE)
            if j != came and (one == node or other == node):
                node, came, walked = other if one == node else one, j, walked + 1
                break
    return walked == count and node == holder(holders, 0, FIRST_NODE)


@inlined
def _crosses(row, d, size):
    """The parity of the path from the hub to d, of largest component ``size``; -1 if rounding could decide it."""
    g, h = load(row, _HUB), dot(three(row, _NORMAL), d)
    if abs(h) <= _ROUNDED * size:
        return -1
    if (g > 0.0) == (h > 0.0):
        return 0
    g, h = abs(g), abs(h)
    first = h * load(row, _HUB + 1) + g * dot(three(row, _FIRST), d)
    second = -(h * load(row, _HUB + 2) + g * dot(three(row, _SECOND), d))
    rounded = _ROUNDED * size
    if first < -rounded or second < -rounded:
        return 0
    return 1 if first > rounded and second > rounded else -1


@kernel
def stop_of(table, d, holders):
    """Whether the faces of a table stop a ray in direction d: OPEN, STOPPED, or UNSURE by rounding."""
    count, size, parity = np.int64(load(table, _COUNT)), largest_component(d), np.int64(load(table, _PARITY))
    closed = load(table, _CLOSED) != 0.0
    for j in range(count):
        row = offset(table, FAN_HEAD + _ROW * j)
        crossed = _crosses(row, d, size)
        if crossed < 0:
            return UNSURE
        parity ^= crossed
        if not closed:
            put_holder(holders, j, FIRST_NODE, load(row, _NODES))
            put_holder(holders, j, SECOND_NODE, load(row, _NODES + 1))
            put_holder(holders, j, PATH, load(row, _PATH))
            put_holder(holders, j, OTHER_PATH, crossed)
    if closed:
        return OPEN if parity == 0 else STOPPED
    return OPEN if are_even(holders, count, 2 * count) else STOPPED

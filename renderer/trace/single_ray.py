"""One ray that traverses a tree alone."""

from typing import Any, NamedTuple

from renderer.jit.decorators import inlined
from renderer.numerics.simd import splat8
from renderer.trace.best import Best
from renderer.trace.intersect import (
    Ray,
    Shear,
    Slabs,
    box_limit,
    enter_in_order,
    largest_of,
    make_shear,
    make_slabs,
    round_down,
)
from renderer.trace.layout import NODE_WORDS
from renderer.trace.walk import push_in_order


class SingleRay(NamedTuple):
    """A ray prepared for triangle and box tests.

    lower    the distance of t_min, eight times
    largest  the largest component of the direction
    """

    ray: Ray
    shear: Shear
    slabs: Slabs
    lower: Any
    largest: float


class Found(NamedTuple):
    """The best hit so far, and the number of nodes and blocks visited."""

    best: Best
    steps: int


@inlined
def prepare_single(ray):
    """The ``SingleRay`` of a ray."""
    largest = largest_of(ray)
    return SingleRay(ray, make_shear(ray), make_slabs(ray, largest), splat8(round_down(ray.t_min * largest)), largest)


@inlined
def enter_node(tree, node, single, t_max):
    """The entry distances of a node's octants, the bits of those that a ray enters up to ``t_max``, and their order."""
    return tree.ways.enter(tree, node, single, splat8(box_limit(t_max, single.largest)))


@inlined
def enter_node_of_tree(tree, node, single, upper):
    """``enter_node`` of a mesh, up to the distance ``upper``."""
    return enter_in_order(tree.nodes, tree.links, node * NODE_WORDS, single.slabs, single.lower, upper)


@inlined
def enter_counted(tree, query, node, found, top):
    """Push what the ``single`` ray of a query enters up to its best hit onto the query's ``stack``, for
    ``walk_nearest_first``; the node counts as a step.
    """
    top = push_entered(tree, query.single, node, found.best.t, query.stack, top)
    return Found(found.best, found.steps + 1), top


@inlined
def push_entered(tree, single, node, t_max, stack, top):
    """Push the octants that a ray enters up to ``t_max``, the nearest last. Returns the new top."""
    _, bits, order = enter_node(tree, node, single, t_max)
    return push_in_order(tree, node, bits, order, stack, top)

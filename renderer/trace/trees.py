"""Opens trees and scenes for kernels: pointers, and the ways in which each of the two is read."""

from typing import Any, NamedTuple

from renderer.jit.decorators import inlined
from renderer.numerics.kinds import of_kind
from renderer.numerics.simd import double_of, float32_pointer, float64_pointer, int32_pointer, load, pointer
from renderer.trace.best import admits_all, may_hit_all
from renderer.trace.edge_signs import coordinate_of_block
from renderer.trace.instances import scene_pointers
from renderer.trace.intersect import corners_of_block, face_of_block
from renderer.trace.layout import BLOCK_COUNT, BLOCKS, DEPTH, FACES, NODES, SCALE, WIDE
from renderer.trace.packet import trace_packet
from renderer.trace.rays import HitPointers, RayPointers, found_pointers, ray_pointers
from renderer.trace.single_ray import enter_node_of_tree
from renderer.trace.starts.record import corners_of_mesh, start_pointers
from renderer.trace.stream import begin_in_tree, node_in_tree, resume_in_tree
from renderer.trace.walk import boxes_of_node, child_of_node
from renderer.trace.ways import Ways


class TreePointers(NamedTuple):
    """A ``Tree`` as the traversal reads it.

    ``blocks`` and ``wide_blocks`` point to the same memory: float64 where ``wide`` is 1, float32 where it is 0.
    """

    nodes: Any
    links: Any
    blocks: Any
    wide_blocks: Any
    wide: Any
    faces: Any
    count: int  # type: ignore[assignment]  # tuples have a method of that name
    has_nodes: bool
    scale: float
    ways: Ways


@inlined
def _mesh_pointers(descriptor):
    at = pointer(descriptor)
    nodes, blocks = load(at, NODES), load(at, BLOCKS)
    return TreePointers(
        float32_pointer(nodes),
        int32_pointer(nodes),
        float32_pointer(blocks),
        float64_pointer(blocks),
        load(at, WIDE),
        int32_pointer(load(at, FACES)),
        load(at, BLOCK_COUNT),
        load(at, DEPTH) > 0,
        double_of(load(at, SCALE)),
        Ways(
            corners_of_block, coordinate_of_block, face_of_block, corners_of_mesh, child_of_node, boxes_of_node,
            enter_node_of_tree, begin_in_tree, node_in_tree, resume_in_tree, may_hit_all, admits_all, trace_packet,
        ),
    )  # fmt: skip


class Call(NamedTuple):
    """The records of one call: the tree, the ``RayPointers`` and the ``HitPointers``."""

    tree: TreePointers
    rays: RayPointers
    found: HitPointers


@inlined
def call_pointers(descriptor, origins, directions, t_min, t_max, starts, t, face, u, v, side, pile, hit):
    """The ``Call`` with the arrays of a ``RayBatch`` and those of a ``HitArrays``."""
    tree = tree_pointers(descriptor)
    rays = ray_pointers(origins, directions, t_min, t_max, start_pointers(starts), tree.scale)
    return Call(tree, rays, found_pointers(t, face, u, v, side, pile, hit))


@inlined
def tree_pointers(descriptor):
    """The pointers in ``Tree.descriptor``, int64, or that of a scene, uint64, whose arrays the caller must keep
    alive.
    """
    return of_kind(descriptor, _mesh_pointers, scene_pointers)(descriptor)

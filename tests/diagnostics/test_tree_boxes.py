"""Boxes of an octree, level by level, and the visits of one ray, against a walk of its own and float64 slabs."""

from typing import Any, NamedTuple

import numpy as np
import pytest
from cases import cases
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderer.diagnostics.tree_boxes import boxes_at, levels, visited
from renderer.mesh.shapes import icosphere, torus
from renderer.octree import BruteForce, Octree
from renderer.trace.intersect import ROOM
from renderer.trace.layout import BLOCK_FACES, CHILDREN, NODE_WORDS
from tests.meshes import KINDS, make_mesh, rays_at


class Place(NamedTuple):
    """A node or leaf: its level, its box in scene units, the place of its parent, and a leaf's faces."""

    level: int
    box: NDArray[np.float64]
    parent: int
    faces: NDArray[np.int32] | None


def places(octree: Octree) -> list[Place]:
    """All nodes and leaves below the root, read from the words one by one."""
    tree = octree.tree
    found: list[Place] = []
    pending = [(0, 0, -1)]
    while pending:
        node, level, parent = pending.pop()
        words = tree.nodes[node * NODE_WORDS :]
        for octant in range(8):
            lower, upper = ([float(words[16 * axis + side + octant]) for axis in range(3)] for side in (0, 8))
            if lower[0] > upper[0]:
                continue
            child = int(tree.links[node * NODE_WORDS + CHILDREN + octant])
            box, faces = np.array(lower + upper) / octree.tree.scale, None
            if child < 0:
                first, count = ~child // 8, ~child % 8 + 1
                faces = tree.faces[BLOCK_FACES * first : BLOCK_FACES * (first + count)]
            else:
                pending.append((child, level + 1, len(found)))
            found.append(Place(level + 1, box, parent, faces))
    return found


def sorted_rows(boxes: Any) -> NDArray[np.float64]:
    rows = np.array(boxes).reshape(-1, 6)
    return rows[np.lexsort(rows.T)]


def key(box: Any) -> bytes:
    return (np.asarray(box, np.float64) + 0.0).tobytes()  # -0.0 becomes 0.0


def octrees() -> list[Any]:
    flat = Octree(*make_mesh("flat", 3, 60))
    tiny = Octree(2.0**-90 * icosphere(2).vertices, icosphere(2).faces)
    assert tiny.tree.scale != 1.0
    return [Octree.from_mesh(torus(), split="sah"), Octree(*make_mesh("sizes", 1, 90)), flat, tiny]


@pytest.mark.parametrize("octree", octrees())
class TestLevels:
    def test_the_boxes_are_those_of_each_level(self, octree: Octree) -> None:
        found = places(octree)
        assert levels(octree) == max(p.level for p in found) + 1 == octree.tree.depth + 1
        for level in range(1, levels(octree) + 1):
            expected = [p.box for p in found if p.level == level]
            got = boxes_at(octree, level)
            assert got.dtype == np.float64 and got.shape == (len(expected), 6)
            np.testing.assert_array_equal(sorted_rows(got), sorted_rows(expected))

    def test_the_root_is_the_mesh_and_children_lie_within_parents(self, octree: Octree) -> None:
        found = places(octree)
        (root,) = boxes_at(octree, 0)
        used = octree.mesh.vertices[octree.mesh.faces].reshape(-1, 3)
        # Wider by ROOM of the faces' widths, and rounded outwards to float32: less than two of its ulp, 2^-23 each.
        slack = (2.0**-22 + 2.0 * ROOM) * np.abs(used).max()
        assert (root[:3] <= used.min(axis=0)).all() and (root[3:] >= used.max(axis=0)).all()
        assert (root[:3] >= used.min(axis=0) - slack).all() and (root[3:] <= used.max(axis=0) + slack).all()
        for place in found:
            around = root if place.parent < 0 else found[place.parent].box
            assert (place.box[:3] >= around[:3]).all() and (place.box[3:] <= around[3:]).all()


def entry(box: NDArray[np.float64], origin: Any, direction: Any) -> float:
    """Where the ray enters the box by exact-minded float64 slabs, inf for never; a zero direction must lie within."""
    near, far = 0.0, np.inf
    for k in range(3):
        if direction[k] == 0.0:
            if not box[k] <= origin[k] <= box[k + 3]:
                return np.inf
            continue
        a, b = sorted(((box[k] - origin[k]) / direction[k], (box[k + 3] - origin[k]) / direction[k]))
        near, far = max(near, a), min(far, b)
    return near if near <= far else np.inf


def check_visits(octree: Octree, origin: Any, direction: Any, t_max: float) -> None:
    hits = octree.closest_hit([origin], [direction], t_max=t_max)
    visits = visited(octree, origin, direction, t_max)
    boxes = [key([*v.lower, *v.upper]) for v in visits]
    told = {(v.level, box, v.is_leaf) for v, box in zip(visits, boxes, strict=True)}
    # Nodes may share a box, when a node has one octant; they differ in level, then.
    opened = {(v.level, box) for v, box in zip(visits, boxes, strict=True)}
    end = min(float(hits.t[0]), t_max)
    (root,) = boxes_at(octree, 0)
    found = places(octree)
    if entry(root, origin, direction) < end:
        assert (0, key(root)) == (visits[0].level, boxes[0])
    for place in found:
        if entry(place.box, origin, direction) < end:
            assert (place.level, key(place.box)) in opened
        if hits.hit[0] and place.faces is not None and hits.face[0] in place.faces:
            assert (place.level, key(place.box), True) in told
    known = {(p.level, key(p.box), p.faces is not None) for p in found} | {(0, key(root), False)}
    assert told <= known


@pytest.mark.judges("Octree.count_steps")
@settings(max_examples=20)
@given(st.sampled_from(sorted(KINDS)), st.integers(0, 999))
def test_visits_of_any_mesh(kind: str, seed: int) -> None:
    vertices, faces = make_mesh(kind, seed, 50)
    octree = Octree(vertices, faces, threads=1)
    for origin, direction in zip(*rays_at(vertices, faces, seed, count=1), strict=True):
        t = float(octree.closest_hit([origin], [direction]).t[0])
        for t_max in (np.inf, t, 0.5 * t):
            check_visits(octree, origin, direction, t_max)


@pytest.mark.judges("Octree.count_steps", "Steps")
def test_octants_are_opened_nearest_first_and_not_behind_the_hit() -> None:
    """Along x through an icosphere: what lies in front is opened by its entry, and the far half is left alone."""
    octree = Octree.from_mesh(icosphere(4), leaf_size=4)
    origin, direction = (3.0, 0.11, 0.07), (-1.0, 0.0, 0.0)
    visits = visited(octree, origin, direction)
    t = float(octree.closest_hit([origin], [direction]).t[0])
    assert visits[0].level == 0 and not visits[0].is_leaf
    for visit in visits:
        assert entry(np.concatenate([visit.lower, visit.upper]), origin, direction) <= t
    leaves = [entry(np.concatenate([v.lower, v.upper]), origin, direction) for v in visits if v.is_leaf]
    assert leaves == sorted(leaves)
    through = visited(octree, origin, direction, t_max=0.5)
    assert through == []  # the sphere begins at t = 2
    inside = visited(octree, (0.0, 0.0, 0.0), direction)
    assert 1 < len(visits) < sum(len(boxes_at(octree, k)) for k in range(levels(octree))) / 20
    assert all(v.lower[0] <= 0.0 for v in inside)


def test_a_ray_that_misses_the_root_visits_nothing() -> None:
    octree = Octree.from_mesh(icosphere(3))
    assert visited(octree, (0, 1.5, 9), (0, 0, -1)) == []
    assert visited(octree, (0, 0, 9), (0, 0, 1)) == []
    # Between the boxes of a tree in two parts: the root's box is met, nothing in it.
    vertices = np.concatenate([icosphere(2).vertices - 5.0, icosphere(2).vertices + 5.0])
    faces = np.concatenate([icosphere(2).faces, icosphere(2).faces + len(icosphere(2).vertices)])
    (root,) = visited(Octree(vertices, faces), (0, 5, 9), (0, 0, -1))
    assert root.level == 0
    np.testing.assert_allclose([root.lower, root.upper], [[-6.0] * 3, [6.0] * 3], rtol=2.0**-22 + ROOM)


def test_without_a_tree_there_is_nothing_to_show() -> None:
    empty = Octree(np.zeros((0, 3)), np.zeros((0, 3), np.int32))
    for target in (BruteForce.from_mesh(icosphere(1)), empty):
        assert levels(target) == 0
        assert boxes_at(target, 0).shape == boxes_at(target, 3).shape == (0, 6)
        assert visited(target, (0, 0, 9), (0, 0, -1)) == []


@cases("level", [-1, 1.0, True, None])
def test_a_bad_level_is_refused(level: Any) -> None:
    with pytest.raises(ValueError, match="level: expected an integer >= 0"):
        boxes_at(Octree.from_mesh(icosphere(0)), level)


@cases(
    ("origin", "direction", "t_max", "named"),
    [
        ((0, 0, np.nan), (0, 0, 1), 1.0, "origins"),
        ((0, 0, 1), (0, 0, 0), 1.0, "directions"),
        ((0, 0, 1), (0, 0, 1), -1.0, "t_max"),
        ((0, 0), (0, 0, 1), 1.0, "origins"),
    ],
)
def test_a_bad_ray_is_refused(origin: Any, direction: Any, t_max: float, named: str) -> None:
    with pytest.raises(ValueError, match=named):
        visited(Octree.from_mesh(icosphere(0)), origin, direction, t_max)

"""What parallel rays see: a ray is refused no box that it enters and no face that it hits, but most of the others."""

import numpy as np
from cases import cases

from renderer.jit.decorators import kernel
from renderer.numerics.simd import load, movemask, offset, pointer, store, widen
from renderer.octree import Octree
from renderer.trace.batch import RayBatch
from renderer.trace.intersect import make_shear
from renderer.trace.layout import CHILDREN
from renderer.trace.projection import (
    EXTENT_WORDS,
    box_at,
    enter,
    error_of,
    make_projection,
    may_hit,
    place_eight,
    put_boxes,
    see_boxes,
    see_faces,
)
from renderer.trace.rays import batch_pointers, ray_at
from renderer.trace.trees import tree_pointers

# Each axis dominates once; ties, zeros, and numbers that float32 rounds.
WAYS = [(0.3, -0.7, 1.0), (1.0, 0.1, 0.1), (-0.2, -1.0, 0.9), (0.0, 0.0, -1.0), (1.0, -1.0, 1.0), (1e-9, 1.0, -1 / 3)]
# Sizes of a scene, and how far it lies from the origin.
PLACES = [(1.0, 0.0), (2.0**-40, 0.0), (2.0**50, 0.0), (1.0, 1e6), (1e-3, 777.7)]
RAYS = 800


@kernel
def _see(descriptor, rays, numbers, reach, slack, room, entered, hit):
    """Which rays enter the octants of the root, and which may hit the faces of the first block."""
    tree, source = tree_pointers(descriptor), batch_pointers(rays, 1.0)
    shear = make_shear(ray_at(source, 0)[0])
    projection, error = make_projection(source, 0, shear), error_of(np.float32(reach), np.float32(slack))
    at, boxes = pointer(room), offset(pointer(room), 24)
    put_boxes(boxes, see_boxes(projection, tree.nodes, 0, error))
    faces = see_faces(tree, 0, shear, projection, reach, widen(error))
    for first in range(0, len(numbers), 8):
        x, y, h, along = place_eight(projection, source, offset(pointer(numbers), first))
        store(at, 0, x)
        store(at, 8, y)
        store(at, 16, along)
        for k in range(8):
            entered[first >> 3, k] = movemask(enter(box_at(boxes, k), x, y, h, along))
            hit[first + k] = may_hit(faces, load(at, k), load(at, 8 + k), load(at, 16 + k))


def seen(octree, origins, way, slack=0.0):
    """(n, 8) and (n, 4) bools: the boxes that rays enter, the faces that they may hit, which start within ``slack``."""
    rays = RayBatch(origins, np.tile(way, (len(origins), 1)), np.zeros(1), np.full(1, np.inf))
    entered, hit = np.zeros((len(origins) // 8, 8), np.int64), np.zeros(len(origins), np.int64)
    room = np.empty(24 + EXTENT_WORDS, np.float32)
    reach = 4.0 * float(np.abs(origins - origins[0]).max())
    _see(octree.tree.descriptor, rays, np.arange(len(origins)), reach, slack, room, entered, hit)
    bits = entered[:, None, :] >> np.arange(8)[None, :, None] & 1
    return bits.reshape(-1, 8).astype(bool), (hit[:, None] >> np.arange(4) & 1).astype(bool)


def scene_at(size, away, seed):
    """A soup in a cube, and its corners in float64."""
    rng = np.random.default_rng(seed)
    corners = size * (rng.uniform(-1, 1, (32, 1, 3)) + 0.2 * rng.normal(size=(32, 3, 3))) + away
    return Octree(corners.reshape(-1, 3), np.arange(96).reshape(-1, 3), leaf_size=4), rng


def starts(points, way, size, rng):
    """Origins of rays that come to points from up to two sizes away; some start there."""
    return points - size * rng.choice([0.0, 0.01, 2.0], (len(points), 1)) * np.array(way)


@cases("way", WAYS)
@cases("place", PLACES)
def test_a_ray_enters_the_boxes_through_which_it_goes(way, place):
    octree, rng = scene_at(*place, 1)
    low, high = np.moveaxis(octree.tree.nodes[:CHILDREN].reshape(3, 2, 8).astype(float), 1, 0)
    used = np.flatnonzero((low <= high).all(axis=0))
    k = rng.choice(used, RAYS)
    # In corners, on edges, on sides, and inside.
    share = rng.choice([0.0, 1.0, rng.random()], (RAYS, 3))
    points = low.T[k] + share * (high - low).T[k]
    entered, _ = seen(octree, starts(points, way, place[0], rng), way)
    assert entered[np.arange(RAYS), k].all()
    # Rays that pass a box by a thousandth of the scene do not enter it: the twin in float64, from its corners.
    origins = octree.mesh.vertices.mean(axis=0) + place[0] * rng.normal(size=(RAYS, 3))
    entered, _ = seen(octree, origins, way)
    far = np.zeros((RAYS, 8), bool)
    for octant in used:
        corners = np.array(np.meshgrid(*zip(low[:, octant], high[:, octant], strict=True))).reshape(3, 8).T
        far[:, octant] = passes(origins, corners, np.array(way), 1e-3 * place[0])
    assert not entered[far].any() and far[:, used].mean() > 0.2


def passes(origins, corners, way, room):
    """Whether rays pass the box with these corners by ``room``, or start behind it along their dominant axis."""
    away, sizes = corners[None] - origins[:, None], np.abs(way)
    w = max((2, 1, 0), key=lambda axis: sizes[axis])
    missed = (away[..., w] * np.sign(way[w])).max(axis=1) < -room
    for axis in np.eye(3):
        across = np.cross(axis, way)
        if across.any():
            seen_at = away @ (across / np.linalg.norm(across))
            missed |= (seen_at.min(axis=1) > room) | (seen_at.max(axis=1) < -room)
    return missed


@cases("way", WAYS)
@cases("place", PLACES)
def test_rays_from_one_place_far_away_see_corners_within_rounding(way, place):
    """Then the error of their own coordinates is nothing, and only those of boxes and faces remain."""
    octree, rng = scene_at(*place, 3)
    boxes, faces = octree.tree.nodes[:CHILDREN].reshape(3, 2, 8).astype(float), octree.tree.faces[:4]
    for octant in np.flatnonzero((boxes[:, 0] <= boxes[:, 1]).all(axis=0)):
        corner = boxes[np.arange(3), rng.integers(0, 2, 3), octant]
        assert seen(octree, np.tile(corner - 100.0 * place[0] * np.array(way), (8, 1)), way)[0][:, octant].all()
    for k, corners in enumerate(octree.mesh.triangles[faces]):
        for point in (*corners, *(0.5 * (corners + corners[[1, 2, 0]]))):
            assert seen(octree, np.tile(point - 100.0 * place[0] * np.array(way), (8, 1)), way)[1][:, k].all()


@cases("way", WAYS)
@cases("place", PLACES)
def test_rays_that_are_off_by_their_slack_are_not_refused_what_they_meet_from_their_start(way, place):
    octree, rng = scene_at(*place, 4)
    boxes, faces = octree.tree.nodes[:CHILDREN].reshape(3, 2, 8).astype(float), octree.tree.faces[:4]
    slack, back = 1e-3 * place[0], place[0] * np.array(way)
    for octant in np.flatnonzero((boxes[:, 0] <= boxes[:, 1]).all(axis=0)):
        corner = boxes[np.arange(3), rng.integers(0, 2, 3), octant]
        origins = corner - back + slack * rng.choice([-1.0, 1.0], (8, 3))
        assert seen(octree, origins, way, slack)[0][:, octant].all()
    for k, corners in enumerate(octree.mesh.triangles[faces]):
        for corner in corners:
            origins = corner - back + slack * rng.choice([-1.0, 1.0], (8, 3))
            assert seen(octree, origins, way, slack)[1][:, k].all()


@cases("way", WAYS)
@cases("place", PLACES)
def test_a_ray_may_hit_the_faces_at_which_it_aims(way, place):
    octree, rng = scene_at(*place, 2)
    corners = octree.mesh.triangles[octree.tree.faces[:4]]
    k = rng.integers(0, 4, RAYS)
    # At corners, edges and inside.
    weights = rng.dirichlet(np.ones(3), RAYS) * (rng.random((RAYS, 3)) < 0.7)
    weights[~weights.any(axis=1), 0] = 1.0
    points = np.einsum("nk,nkx->nx", weights / weights.sum(axis=1, keepdims=True), corners[k])
    _, hit = seen(octree, starts(points, way, place[0], rng), way)
    assert hit[np.arange(RAYS), k].all()
    # Of other rays the bits are those of what is hit, but within a thousandth of an edge.
    origins = corners.mean(axis=(0, 1)) + place[0] * rng.normal(size=(RAYS, 3))
    _, hit = seen(octree, origins, way)
    for face in range(4):
        edges = np.stack([np.cross(a - origins, b - origins) @ np.array(way) for a, b in pairs(corners[face])], 1)
        edges /= np.abs(edges.sum(axis=1, keepdims=True)).clip(1e-300)
        t = (np.stack([corners[face][i] for i in (2, 0, 1)], 0)[None] - origins[:, None]) @ np.array(way)
        height = (edges * t).sum(axis=1) / edges.sum(axis=1)
        inside = (np.abs(np.sign(edges).sum(axis=1)) == 3) & (height > 0.0)
        clear = (np.abs(edges) > 1e-3).all(axis=1) & (np.abs(height) > 1e-3 * place[0])
        np.testing.assert_array_equal(hit[clear, face], inside[clear])


def test_a_thin_face_within_rounding_behind_a_ray_is_one_that_it_may_hit():
    height = -3.0 - 2.0**-38
    needle = [[-1024.0, -(2.0**-31), height], [1024.0, -(2.0**-31), height], [0.0, 2.0**-31, height]]
    octree, origins, way = Octree(np.array(needle), [[0, 1, 2]]), np.tile([0.0, 0.0, -3.0], (8, 1)), (0.0, 0.0, 1.0)
    assert octree.any_hit(origins, way).all() and seen(octree, origins, way)[1][:, 0].all()


def pairs(face):
    """The edges of a face, each before the corner that it lies opposite to."""
    return (face[0], face[1]), (face[1], face[2]), (face[2], face[0])

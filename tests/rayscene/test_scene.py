"""Scenes answer like the one mesh that their placed meshes make together, and know what was hit."""

import copy
import threading

import numpy as np
import pytest
from cases import cases
from hypothesis import given, settings
from hypothesis import strategies as st
from meshes import KINDS, assert_same_hits, make_mesh, rays_at

from renderer import Mesh, MeshError, Octree, RayScene
from renderer.mesh.shapes import box, icosphere
from renderer.trace.batch import check_rays

pytestmark = pytest.mark.judges(
    "RayScene", "RayScene.add", "RayScene.add_instances", "RayScene.add_scene", "RayScene.all_hits", "RayScene.any_hit",
    "RayScene.closest_hit", "RayScene.closest_point", "RayScene.contains", "RayScene.count_hits",
    "RayScene.count_steps", "RayScene.mask", "RayScene.masks", "RayScene.merged", "RayScene.mesh", "RayScene.move",
    "RayScene.name", "RayScene.objects", "RayScene.refit", "RayScene.remove", "RayScene.show", "RayScene.shown",
    "RayScene.signed_distance", "RayScene.transforms", "RayScene.visible", "RayScene.winding_number",
    "SceneHits.moment",
)  # fmt: skip


def rotation(rng):
    return np.linalg.qr(rng.normal(size=(3, 3)))[0]


def step(rng):
    return rng.integers(-3, 4, 3)


# Linear part and translation. Integer steps make instances share edges, corners and planes.
PLACINGS = {
    "steps": lambda rng: (np.eye(3), step(rng)),
    "axes": lambda rng: (np.eye(3)[rng.permutation(3)] * rng.choice([-1, 1], 3), step(rng)),
    "turned": lambda rng: (rotation(rng), rng.normal(size=3)),
    "mirrored": lambda rng: (np.diag([-1.0, 1.0, 1.0]), step(rng)),
    "sheared": lambda rng: (np.eye(3) + np.triu(rng.normal(size=(3, 3)), 1) * 3, rng.normal(size=3)),
    "tiny": lambda rng: (rotation(rng) * 1e-6, rng.normal(size=3) * 1e-6),
    "huge": lambda rng: (rotation(rng) * 1e6, rng.normal(size=3) * 1e6),
    "squashed": lambda rng: (rotation(rng) @ np.diag([1.0, 1.0, 1e-5]) @ rotation(rng), rng.normal(size=3)),
    "on a map": lambda rng: (rotation(rng), np.array([5e5, 5.4e6, 100.0]) + step(rng)),
}


def placed(rng, kind, count):
    """Transforms (count, 3, 4) of one kind, or of all."""
    matrices = np.empty((count, 3, 4))
    for k in range(count):
        linear, translation = PLACINGS[kind if kind in PLACINGS else rng.choice(sorted(PLACINGS))](rng)
        matrices[k, :, :3], matrices[k, :, 3] = linear, translation
    return matrices


def make_scene(seed, threads=1):
    rng, scene = np.random.default_rng(seed), RayScene(threads=threads)
    for _ in range(rng.integers(1, 4)):
        vertices, faces = make_mesh(rng.choice(sorted(KINDS)), int(rng.integers(1 << 20)), int(rng.integers(1, 60)))
        scene.add(Mesh(vertices, faces), placed(rng, rng.choice([*PLACINGS, "all"]), int(rng.integers(1, 8))))
    return scene


def camera_rays(mesh, seed):
    """Rays from one place through a film, sixteen and more of which travel together."""
    rng, (lower, upper) = np.random.default_rng(seed), mesh.bounds
    across = np.linspace(-0.3, 0.3, 20)
    x, y = np.meshgrid(across, across)
    directions = np.stack([x.ravel(), y.ravel(), -np.ones(x.size)], axis=1) @ rotation(rng)
    away = directions.mean(axis=0) * np.linalg.norm(upper - lower) * rng.uniform(0.2, 1.5)
    return (lower + upper) / 2 - away, directions


def assert_like_merged(scene, seed):
    """Every query has the bits of the merged mesh."""
    merged = Octree(scene.merged, threads=1)
    origins, directions = rays_at(merged.mesh.vertices, merged.mesh.faces, seed)
    hits, expected = scene.closest_hit(origins, directions), merged.closest_hit(origins, directions)
    assert_same_hits(hits._found, expected)
    np.testing.assert_array_equal(hits.side, expected.side)
    np.testing.assert_array_equal(hits.points, expected.points)
    np.testing.assert_array_equal(hits.normals, expected.normals)
    few, alike = (one.closest_hit(origins[:9], directions[:9]) for one in (scene, merged))
    assert_same_hits(few._found, alike)
    np.testing.assert_array_equal(scene.any_hit(origins, directions), expected.hit)

    camera = camera_rays(merged.mesh, seed)
    assert_same_hits(scene.closest_hit(*camera)._found, merged.closest_hit(*camera))
    np.testing.assert_array_equal(scene.any_hit(*camera), merged.any_hit(*camera))

    several, others = (one.all_hits(origins, directions, t_error=True) for one in (scene, merged))
    for name in ("t", "t_error", "side", "offsets"):
        np.testing.assert_array_equal(getattr(several, name), getattr(others, name))
    np.testing.assert_array_equal(several._found.face, others.face)
    np.testing.assert_array_equal(scene.count_hits(origins, directions), others.counts)

    hit = expected.hit
    start, same = (one.closest_hit(origins[hit], directions[hit]) for one in (scene, merged))
    away = np.random.default_rng(seed).normal(size=start.points.shape)
    for leaving, also in ((start, same), (start.through(), same.through())):
        assert_same_hits(
            scene.closest_hit(start.points, away, leaving=leaving)._found,
            merged.closest_hit(same.points, away, leaving=also),
        )

    points = np.concatenate([origins[:50], merged.mesh.triangles[:20].mean(axis=1), merged.mesh.vertices[:20]])
    near, nearest = scene.closest_point(points), merged.closest_point(points)
    np.testing.assert_array_equal(near.distance, nearest.distance)
    np.testing.assert_array_equal(near._found.face, nearest.face)
    np.testing.assert_array_equal(near.points, nearest.points)


@given(st.integers(0, 2**20))
def test_a_scene_has_the_bits_of_its_merged_mesh(seed):
    assert_like_merged(make_scene(seed), seed)


@settings(max_examples=30)  # each is compared four times
@given(st.integers(0, 2**20))
def test_it_has_them_after_every_change(seed):
    rng, scene = np.random.default_rng(seed), make_scene(seed)
    first = scene.objects[0]
    scene.closest_point([0.0, 0.0, 0.0])  # what was queried before is forgotten
    count = len(scene.transforms(first))
    scene.move(first, placed(rng, "all", count))
    assert_like_merged(scene, seed)
    scene.refit(first, scene.mesh(first).vertices * [1.0, -2.0, 0.5])
    assert_like_merged(scene, seed)
    scene.move(first, placed(rng, "turned", 1), instances=[count - 1])
    added = scene.add(icosphere(1), placed(rng, "all", 3))
    assert_like_merged(scene, seed)
    scene.remove(first)
    assert_like_merged(scene, seed)
    assert scene.objects[-1] == added and first not in scene.objects


def test_a_thousand_instances_in_a_lattice_and_any_threads():
    rng = np.random.default_rng(1)
    corners = np.stack(np.meshgrid(*[np.arange(10.0)] * 3), axis=-1).reshape(-1, 3)
    matrices = np.concatenate([np.broadcast_to(np.eye(3), (1000, 3, 3)), corners[:, :, None]], axis=2)
    scenes = [RayScene(threads=threads) for threads in (1, 2, 7)]
    for scene in scenes:
        scene.add(box(), matrices)
    origins = rng.uniform(-5, 15, (20_000, 3))
    directions = rng.integers(0, 11, origins.shape) - origins
    expected = Octree(scenes[0].merged).closest_hit(origins, directions)
    for scene in scenes:
        assert_same_hits(scene.closest_hit(origins, directions)._found, expected)
    # Walls of neighbours coincide: the lowest instance has the hit.
    inside = scenes[0].closest_hit([0.25, 0.5, 0.5], [1.0, 0.0, 0.0])
    assert inside.t == 0.75 and (scenes[0].transforms(0)[inside.instance, :, 3] == [0, 0, 0]).all()


def test_no_ray_passes_between_two_placed_parts_that_share_an_edge():
    """Each half of a square is an instance of a triangle, turned so that corners, once placed, are no round numbers."""
    rng, triangle = np.random.default_rng(2), Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    linear = rotation(rng) * 1.7
    # The second is the first turned half round about the middle of the long side, so that the ends change places.
    scene, other = RayScene(), Mesh([[1, 1, 0], [0, 1, 0], [1, 0, 0]], [[0, 1, 2]])
    place = np.column_stack([linear, rng.normal(size=3)])
    scene.add(triangle, place)
    scene.add(other, place)
    share = rng.random((100_000, 1))
    ends = scene.merged.vertices[[1, 2]]
    targets = ends[0] * share + ends[1] * (1 - share)
    origins = targets + rng.normal(size=targets.shape) * 3
    assert scene.any_hit(origins, targets - origins).all()


def test_what_was_hit_is_known():
    scene = RayScene()
    ground = scene.add(box((-9, -9, -1), (9, 9, 0)), name="ground")
    cubes = scene.add(box(), [[[-2, 0, 0, x], [0, 1, 0, 0], [0, 0, 1, 0]] for x in (3, 7)])
    hits = scene.closest_hit([[2.5, 0.25, 9], [6, 0.5, 9], [-5, 0, 9], [50, 0, 9]], [0, 0, -1])
    assert hits.object.tolist() == [cubes, cubes, ground, -1] and hits.instance.tolist() == [0, 1, 0, -1]
    assert hits.t.tolist() == [8, 8, 9, np.inf] and hits.hit.tolist() == [True, True, True, False]
    # On the mesh as it was added, also where the matrix mirrors: x = 3 - 2 x of the mesh.
    np.testing.assert_allclose(hits.interpolate({cubes: box().vertices})[:2], [[0.25, 0.25, 1], [0.5, 0.5, 1]])
    own = scene.mesh(cubes).vertices[scene.mesh(cubes).faces[hits.face[0]]]
    u, v = hits.u[0], hits.v[0]
    np.testing.assert_allclose((1 - u - v) * own[0] + u * own[1] + v * own[2], [0.25, 0.25, 1])
    assert scene.name(ground) == "ground" and scene.objects == [ground, cubes]


def test_colours_and_texture_coordinates_are_those_of_the_object_and_nan_elsewhere():
    corners, faces = [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]
    plain, scene = Mesh(corners, faces), RayScene()
    scene.add(Mesh(corners, faces, colors=np.eye(3), texcoords=[[0, 0], [1, 0], [0, 1]]))
    scene.add(plain, [[1, 0, 0, 5], [0, 1, 0, 0], [0, 0, 1, 0]])
    hits = scene.closest_hit([[0.25, 0.5, 1], [5.25, 0.5, 1], [9, 9, 9]], [0, 0, -1])
    np.testing.assert_array_equal(hits.colors, [[0.25, 0.25, 0.5], [np.nan] * 3, [np.nan] * 3])
    np.testing.assert_array_equal(hits.texcoords, [[0.25, 0.5], [np.nan] * 2, [np.nan] * 2])
    np.testing.assert_array_equal(hits.take({0: [[7.0, 8.0]]}), [[7, 8], [np.nan] * 2, [np.nan] * 2])


def test_masks_choose_what_each_ray_may_hit():
    scene = RayScene()
    scene.add(box(), [[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 2 * k]] for k in range(32)], mask=1 << np.arange(32))
    masks = np.array([1, 2, 1 << 31, 0b1010, (1 << 32) - 1, 0, 6])
    expected = [0, 1, 31, 3, 31, -1, 2]
    down, aim = [[0.3, 0.4, 99.0]], [0.0, 0.0, -1.0]
    assert scene.closest_hit(down, aim, mask=masks).instance.tolist() == expected
    # The same in a stream of many.
    many = scene.closest_hit(down, aim, mask=np.repeat(masks, 10))
    assert many.instance.tolist() == np.repeat(expected, 10).tolist()
    assert scene.any_hit(down, aim, mask=masks).tolist() == [found >= 0 for found in expected]
    assert scene.all_hits(down, aim, mask=0b1010).instance.tolist() == [3, 3, 1, 1]
    assert scene.closest_hit(down, aim, mask=4).instance.tolist() == [2]
    scene.mask(0, [8, 16], instances=[31, 30])
    assert scene.masks(0)[-2:].tolist() == [16, 8] and scene.masks(0)[0] == 1
    assert scene.closest_hit(down, aim, mask=[8, 16, 1 << 31]).instance.tolist() == [31, 30, -1]
    scene.mask(0, 1)
    assert scene.closest_hit(down, aim, mask=1).instance.tolist() == [31]


@cases("repeats", [1, 10])
def test_a_ray_passes_through_the_instance_that_it_ignores(repeats):
    scene = RayScene()
    scene.add(box(), [[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 2 * k]] for k in range(3)])
    origins = np.repeat([[0.3, 0.4, 9.0], [0.3, 0.4, -9.0], [5.0, 5.0, 9.0]], repeats, axis=0)
    aims = np.repeat([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]], repeats, axis=0)
    first = scene.closest_hit(origins, aims)
    second = scene.closest_hit(origins, aims, ignore=first)
    assert first.instance.tolist() == np.repeat([2, 0, -1], repeats).tolist()
    assert second.instance.tolist() == np.repeat([1, 1, -1], repeats).tolist()
    # From the body itself: a ray into it comes out on the other side unhindered.
    inward = scene.closest_hit(first.points[first.hit], aims[first.hit], leaving=first[first.hit])
    assert (inward.t == 0).all() or inward.hit.all()
    free = scene.closest_hit(origins[first.hit], aims[first.hit], ignore=first[first.hit])
    assert (free.instance == 1).all()


@cases("repeats", [1, 10])
def test_rays_hit_the_sides_of_faces_that_they_are_asked_to(repeats):
    """A box has fronts outside; mirrored it has them outside too, and a box inside out has them inside."""
    scene, mirrored = RayScene(), [[-1, 0, 0, 6], [0, 1, 0, 0], [0, 0, 1, 0]]
    scene.add(box(), [np.eye(4)[:3], mirrored])
    inside_out = Mesh(box().vertices, box().faces[:, ::-1])
    scene.add(inside_out, [[1, 0, 0, 9], [0, 1, 0, 0], [0, 0, 1, 0]])
    origins = np.repeat([[0.3, 0.4, 9.0], [5.3, 0.4, 9.0], [9.3, 0.4, 9.0]], repeats, axis=0)
    found = {side: scene.closest_hit(origins, [0, 0, -1], faces=side) for side in ("both", "front", "back")}
    assert {side: hits.t[::repeats].round(9).tolist() for side, hits in found.items()} == {
        "both": [8, 8, 8], "front": [8, 8, 9], "back": [9, 9, 8],
    }  # fmt: skip
    assert (found["front"].side == 1).all() and (found["back"].side == -1).all()
    assert (
        scene.any_hit(origins, [0, 0, -1], t_max=8.5, faces="back").tolist()
        == np.repeat([False, False, True], repeats).tolist()
    )
    assert scene.all_hits(origins, [0, 0, -1], faces="front").t.round(9).tolist() == [8] * 2 * repeats + [9] * repeats
    assert (scene.count_hits(origins, [0, 0, -1], faces="back") == 1).all()


@cases("repeats", [1, 20])
def test_of_two_faces_in_one_place_each_is_hit_on_its_own_side(repeats):
    """The first may be one that the ray is not to hit."""
    for faces in ([[0, 1, 2], [0, 2, 1]], [[0, 2, 1], [0, 1, 2]]):
        scene = RayScene()
        scene.add(Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], faces))
        for side in ("front", "back", "both"):
            assert scene.any_hit([[0.2, 0.3, 1.0]] * repeats, [0, 0, -1], faces=side).all(), (faces, side)


def test_a_mesh_that_stands_alone_has_the_hits_of_its_octree():
    octree, scene, rng = Octree(icosphere(3)), RayScene(), np.random.default_rng(5)
    scene.add(octree)
    origins, directions = rng.normal(size=(2, 500, 3))
    assert scene._built.tree_for(check_rays(origins, directions, 0.0, np.inf)[0], "both") is octree.tree
    hits, expected = (one.closest_hit(origins, directions) for one in (scene, octree))
    assert_same_hits(hits._found, expected)
    np.testing.assert_array_equal(hits.face, expected.face)
    # Where it is moved, or hidden, it is no longer itself.
    scene.move(0, [[1, 0, 0, 4], [0, 1, 0, 0], [0, 0, 1, 0]])
    moved = scene.closest_hit(origins + np.array([4.0, 0.0, 0.0]), directions)
    np.testing.assert_array_equal(moved.hit, expected.hit)
    scene.show(0, False)
    assert not scene.any_hit(origins, directions).any()


def test_a_scene_within_a_scene_stands_at_the_product_of_both_matrices():
    """Against points that are transformed twice; turned by quarters, so that nothing is rounded."""
    rng, inner, outer = np.random.default_rng(6), RayScene(), RayScene()
    own, places = placed(rng, "axes", 3), placed(rng, "axes", 4)
    inner.add(box(), own, mask=[1, 2, 4])
    inner.add(icosphere(1), name="ball")
    inner.show(1, False)
    outer.add(icosphere(2))
    assert outer.add_scene(inner, places) == {0: 1, 1: 2} and outer.name(2) == "ball"
    corners = np.einsum("kij,vj->kvi", own[:, :, :3], box().vertices) + own[:, None, :, 3]
    corners = np.einsum("kij,nvj->knvi", places[:, :, :3], corners) + places[:, None, None, :, 3]
    for k, matrix in enumerate(outer.transforms(1)):
        moved = box().transformed(np.vstack([matrix, [0, 0, 0, 1]])).vertices
        np.testing.assert_array_equal(moved, corners[k // 3, k % 3])
    assert_like_merged(outer, 7)
    target = corners[2, 1].mean(axis=0)
    masked = outer.closest_hit(target + np.array([0, 0, 0.1]), [0, 0, 1], mask=2)
    assert masked.object == 1 and masked.instance % 3 == 1
    with pytest.raises(ValueError, match="matrices that can be inverted"):
        outer.add_scene(inner, np.zeros((3, 4)))
    assert outer.objects == [0, 1, 2]


def test_hidden_instances_are_hit_by_nothing_and_keep_their_numbers():
    scene = RayScene()
    cubes = scene.add(box(), [[[1, 0, 0, 2 * k], [0, 1, 0, 0], [0, 0, 1, 0]] for k in range(3)])
    origins = [[2 * k + 0.3, 0.4, 9.0] for k in range(3)]
    scene.show(cubes, np.array([True, False, True]))
    assert scene.closest_hit(origins, [0, 0, -1]).instance.tolist() == [0, -1, 2]
    assert scene.contains([[0.5, 0.5, 0.5], [2.5, 0.5, 0.5]]).tolist() == [True, False]
    assert len(scene.merged.faces) == 24
    assert scene.shown(cubes).tolist() == [True, False, True]
    scene.show(cubes, False, instances=[0])
    assert scene.closest_hit(origins, [0, 0, -1]).instance.tolist() == [-1, -1, 2]
    scene.show(cubes, False)
    assert not scene.any_hit(origins, [0, 0, -1]).any()
    # Nothing that is shown is as nothing at all.
    for query in (scene.contains, scene.closest_point, scene.signed_distance):
        with pytest.raises(ValueError, match="mesh: expected faces"):
            query([0, 0, 0])
    scene.show(cubes)
    assert scene.closest_hit(origins, [0, 0, -1]).instance.tolist() == [0, 1, 2]


def test_an_empty_scene_is_hit_by_nothing():
    scene = RayScene()
    assert not scene.any_hit([0, 0, 0], [1, 0, 0]) and scene.closest_hit([0, 0, 0], [1, 0, 0]).object == -1
    missed = scene.closest_hit([0, 0, 0], [1, 0, 0])
    assert not scene.any_hit([0, 0, 0], [1, 0, 0], leaving=missed, mask=1, ignore=missed)
    scene.add(Mesh(np.empty((0, 3)), np.empty((0, 3), int)))
    scene.add(box())
    hits = scene.closest_hit([0.5, 0.25, 9], [0, 0, -1])
    assert hits.object == 1 and hits.t == 8
    with pytest.raises(ValueError, match="mesh: expected faces"):
        RayScene().contains([0, 0, 0])


def test_objects_come_and_go_in_any_order():
    """Records of those that are gone stay for a while among the others."""
    rng, scene, octree, places = np.random.default_rng(10), RayScene(), Octree(box()), {}
    for _ in range(300):
        if places and rng.random() < 0.45:
            gone = rng.choice(list(places))
            del places[gone]
            scene.remove(gone)
        else:
            own = placed(rng, "steps", int(rng.integers(0, 4)))
            places[scene.add(octree, own)] = own
        if places and rng.random() < 0.3:
            moved = int(rng.choice(list(places)))
            places[moved] = placed(rng, "steps", len(places[moved]))
            scene.move(moved, places[moved])
        if places and rng.random() < 0.3:
            grown = int(rng.choice(list(places)))
            own = placed(rng, "steps", int(rng.integers(0, 3)))
            numbers = scene.add_instances(grown, own, mask=1 << 31)
            assert numbers.tolist() == list(range(len(places[grown]), len(places[grown]) + len(own)))
            assert (scene.masks(grown)[numbers] == 1 << 31).all()
            places[grown] = np.concatenate([places[grown], own])
        if rng.random() < 0.1:
            scene.any_hit(HERE, DOWN)
    assert scene.objects == list(places)
    for object_, own in places.items():
        np.testing.assert_array_equal(scene.transforms(object_), own)
    assert_like_merged(scene, 3)


def test_an_octree_is_shared_and_a_refit_of_one_object_changes_no_other():
    octree, scene = Octree(box()), RayScene()
    one, other = scene.add(octree), scene.add(octree, [[1, 0, 0, 5], [0, 1, 0, 0], [0, 0, 1, 0]])
    assert scene.mesh(one) is octree.mesh is scene.mesh(other)
    scene.refit(one, box().vertices * 2)
    hits = scene.closest_hit([[0.5, 0.25, 9], [5.5, 0.25, 9]], [0, 0, -1])
    assert hits.t.tolist() == [7, 8] and octree.mesh.extent.tolist() == [1, 1, 1]


def test_queries_see_the_scene_before_or_after_a_move():
    scene = RayScene()
    cubes = scene.add(box(), [[[1, 0, 0, 2 * k], [0, 1, 0, 0], [0, 0, 1, 0]] for k in range(50)])
    low = scene.transforms(cubes)
    high = low + np.array([[0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 4]])
    origins = np.array([[2 * k + 0.3, 0.4, 9.0] for k in range(50)])
    seen, ends = [], threading.Event()

    def query():
        while not ends.is_set():
            seen.append(set(scene.closest_hit(origins, [0, 0, -1]).t.tolist()))

    threads = [threading.Thread(target=query) for _ in range(3)]
    for thread in threads:
        thread.start()
    for k in range(200):
        scene.move(cubes, high if k % 2 else low)
    ends.set()
    for thread in threads:
        thread.join()
    assert seen and all(found in ({8.0}, {4.0}) for found in seen)


def test_several_objects_move_at_once():
    """Queries see both where they were, or both where they are; refused, none has moved."""
    scene = RayScene()
    cubes = [scene.add(box((x, 0, 0), (x + 1, 1, 1))) for x in (0, 3)]
    origins, ends, seen = [[0.3, 0.4, 9.0], [3.3, 0.4, 9.0]], threading.Event(), set()
    low, high = np.eye(4), np.eye(4) + np.outer([0, 0, 1, 0], [0, 0, 0, 4])

    def query():
        while not ends.is_set():
            seen.add(tuple(scene.closest_hit(origins, [0, 0, -1]).t.tolist()))

    thread = threading.Thread(target=query)
    thread.start()
    for k in range(200):
        scene.move(dict.fromkeys(cubes, high if k % 2 else low))
    ends.set()
    thread.join()
    assert seen <= {(8.0, 8.0), (4.0, 4.0)}
    with pytest.raises(ValueError, match="transforms: expected 1 matrices, got 2"):
        scene.move({cubes[0]: low, cubes[1]: [low, low]})
    assert scene.closest_hit(origins, [0, 0, -1]).t.tolist() == [4, 4]


def test_inside_and_distance_of_closed_parts_that_overlap():
    scene = RayScene()
    scene.add(box(), [[[2, 0, 0, 0], [0, 2, 0, 0], [0, 0, -2, 2]], [[1, 0, 0, 1], [0, 1, 0, 1], [0, 0, 1, 1]]])
    points = [[1.5, 1.5, 1.5], [0.5, 0.5, 0.5], [2.0, 2.0, 2.0], [3.0, 1.0, 1.0]]
    assert scene.contains(points).tolist() == [True, True, True, False]
    np.testing.assert_allclose(scene.winding_number(points[:2], 1e-9), [2, 1], atol=1e-8)
    assert scene.signed_distance(points).tolist() == [-0.5, -0.5, 0.0, 1.0]
    assert scene.visible([5, 1, 1], [[2, 1, 1], [-1, 1, 1]]).tolist() == [True, False]
    assert (scene.count_steps([[1, 1, 9]], [0, 0, -1]).nodes > 0).all()


@cases("factors", [[1, 1, 2.0**119], [2.0**-119] * 3, [1.0, 2.0**-119, 1.0]])
def test_factors_that_float32_holds_have_the_bits_of_the_merged_mesh_and_others_are_refused(factors):
    """Boxes were NaN beyond it, and small ones were passed: queries missed what is there."""
    flat, scene = Mesh(box().vertices[:4] * [1, 1, 0], [[0, 1, 2], [1, 3, 2], [0, 2, 1]]), RayScene()
    places = np.zeros((20, 3, 4))
    places[:, :, :3], places[:, :, 3] = np.diag(factors), np.random.default_rng(4).uniform(-4, 4, (20, 3))
    places[:, :, 3] *= np.minimum(factors, 1)
    scene.add(flat, places)
    assert_like_merged(scene, 1)
    places[7, :, :3] = np.diag(np.square(factors))
    with pytest.raises(ValueError, match=r"transforms: .* factors of the mesh's lengths from .* for instance 7"):
        scene.move(0, places)


@cases(
    ("meshes", "inside"),
    [
        ([box(), Mesh(box().vertices, box().faces[:, ::-1])], None),
        ([box(), Mesh(box().vertices * 2, box().faces[:, ::-1])], False),
        ([Mesh(box().vertices, box().faces[:, ::-1])], True),
        ([box(), Mesh(np.empty((0, 3)), np.empty((0, 3), int))], True),
    ],
)
def test_closed_parts_have_an_inside_unless_they_cancel(meshes, inside):
    """As of the merged mesh, which counts only what is shown."""
    scene = RayScene()
    for mesh in meshes:
        scene.add(mesh)
    scene.show(scene.add(box()), False)
    merged, point = Octree(scene.merged), [0.25, 0.25, 0.25]
    if inside is None:
        for query in (merged.contains, scene.contains, scene.signed_distance):
            with pytest.raises(ValueError, match="got 24 faces, each as often one way round as the other"):
                query(point)
    else:
        assert scene.contains(point) == merged.contains(point) == inside
        assert scene.signed_distance(point) == merged.signed_distance(point)


@cases("mask", [None, 1, 2, 6, 8])
def test_the_nearest_point_is_that_of_what_a_mask_chooses(mask):
    """As of a scene of those alone, from many points, and from one whose products float64 loses."""
    rng, scene, alone, masks = np.random.default_rng(9), RayScene(), RayScene(), np.arange(12) % 4
    places = np.concatenate([placed(rng, "turned", 8), np.tile(np.eye(4)[:3], (4, 1, 1))])
    scene.add(box(), places, mask=masks)
    scene.show(0, False, instances=[0, 5])
    chosen = np.flatnonzero([scene.shown(0)[k] and (mask is None or masks[k] & mask) for k in range(12)])
    alone.add(box(), places[chosen])
    for points in (rng.normal(size=(2000, 3)) * 3, [[0.5, 0.25, 1e-300]]):
        ours = scene.closest_point(points, mask=mask)
        if not len(chosen):
            assert (ours.distance == np.inf).all() and (ours.object == -1).all() and np.isnan(ours.u).all()
            continue
        theirs = alone.closest_point(points)
        np.testing.assert_array_equal(ours.distance, theirs.distance)
        np.testing.assert_array_equal(ours.instance, chosen[theirs.instance])
        np.testing.assert_array_equal(ours.face, theirs.face)


def crushed():
    turned = rotation(np.random.default_rng(3))
    return np.column_stack([turned @ np.diag([1.0, 1.0, 1e-14]) @ turned.T, np.zeros(3)])


def before_a_move(scene):
    hits = scene.closest_hit([0.5, 0.5, 9], [0, 0, -1])
    scene.move(0, np.eye(4))
    return hits


def another():
    scene = RayScene()
    scene.add(box())
    return scene


HERE, DOWN = [0.5, 0.25, 9], [0, 0, -1]
FAULTS = {
    "transforms: expected matrices that can be inverted.* for instance 1": lambda s: s.add(
        box(), [np.eye(4), np.diag([1.0, 1.0, 0.0, 1.0])]
    ),
    "transforms: expected matrices that can be inverted": lambda s: s.add(box(), crushed()),
    "transforms: expected finite matrices.* in row 0": lambda s: s.add(box(), np.full((3, 4), np.nan)),
    r"transforms: expected shape \(3, 4\)": lambda s: s.add(box(), np.eye(3)),
    "transforms: expected 1 matrices, got 2": lambda s: s.move(0, [np.eye(4), np.eye(4)]),
    "transforms: .* coordinates up to": lambda s: s.move(0, np.eye(4)[:3] * 1e30),
    "object: expected one of": lambda s: s.move(7, np.eye(4)),
    "instances: expected different integers": lambda s: s.move(0, [np.eye(4)], instances=[1]),
    "mask: expected 32 bits": lambda s: s.add(box(), mask=1 << 32),
    "mask: expected 32 bits, got -1 in row 1": lambda s: s.any_hit(HERE, DOWN, mask=[1, -1]),
    "mask: expected an integer": lambda s: s.closest_hit(HERE, DOWN, mask=0.5),
    "shown: expected a bool": lambda s: s.show(0, 1),
    "leaving: expected hits of a scene": lambda s: s.closest_hit(HERE, DOWN, leaving=[0]),
    "ignore: expected hits of this scene": lambda s: s.closest_hit(
        HERE, DOWN, ignore=another().closest_hit(HERE, DOWN)
    ),
    "scene: expected a RayScene": lambda s: s.add_scene(box()),
    "mask: expected an integer or 1 integers": lambda s: s.mask(0, [1, 2]),
    "object: expected one of .0., got '0'": lambda s: s.remove("0"),
    "ignore: expected hits of a scene": lambda s: s.closest_hit(HERE, DOWN, ignore=3),
    "leaving: expected hits on the scene as it is": lambda s: s.any_hit(HERE, DOWN, leaving=before_a_move(s)),
    "leaving: expected hits on the scene as it": lambda s: s.any_hit(HERE, DOWN, leaving=before_a_move(s).through()),
    "leaving: .* another scene": lambda s: s.any_hit(HERE, DOWN, leaving=another().closest_hit(HERE, DOWN)),
    "faces: expected one of": lambda s: s.any_hit(HERE, DOWN, faces="inside"),
    "faces: expected 'both' with leaving": lambda s: s.any_hit(
        HERE, DOWN, leaving=s.closest_hit(HERE, DOWN), faces="front"
    ),
    "instances: expected 1 bools, or integers, got bools of shape .2,.": lambda s: s.show(0, instances=[True, False]),
    "shown: expected an array, got rows of different lengths": lambda s: s.show(0, [[True], [True, False]]),
    "mask: expected an array, got rows of different lengths": lambda s: s.any_hit(HERE, DOWN, mask=[[1], [1, 2]]),
    "transforms: expected None beside a dict": lambda s: s.move({0: np.eye(4)}, np.eye(4)),
    "object: expected one of .0., got 5": lambda s: s.move({0: np.eye(4) * [2, 2, 2, 1], 5: np.eye(4)}),
    "transforms: expected matrices that can be inverted.* for instance 0": lambda s: s.add_instances(
        0, np.zeros((3, 4))
    ),
    "mask: expected an integer from 0 to 4294967295 or None, got .1.": lambda s: s.closest_point(HERE, mask=[1]),
    "transforms: expected matrices, got None": lambda s: s.move(0, None),
    "vertices: expected positions that every instance can place": lambda s: s.refit(0, box().vertices * 1e30),
    "values: expected objects of the scene": lambda s: s.closest_hit(HERE, DOWN).interpolate({5: range(12)}),
}


@cases("fault", FAULTS)
def test_bad_arguments_are_named_and_change_nothing(fault):
    scene = RayScene()
    scene.add(box())
    with pytest.raises(ValueError, match=fault):
        FAULTS[fault](scene)
    assert scene.objects == [0] and scene.closest_hit(HERE, DOWN).t == 8


def test_values_of_one_object_are_not_taken_for_those_of_others():
    scene = RayScene()
    scene.add(box())
    assert scene.closest_hit(HERE, DOWN).take(range(12)) == 10
    scene.add(box())
    with pytest.raises(ValueError, match="values: expected a dict of object"):
        scene.closest_hit(HERE, DOWN).take(range(12))


def test_instances_are_chosen_by_number_or_by_a_bool_for_each():
    scene, lifted = RayScene(), np.eye(4) + np.outer([0, 0, 1, 0], [0, 0, 0, 5])
    scene.add(box(), [np.eye(4)] * 3)
    scene.move(0, [lifted, lifted], instances=np.array([True, False, True]))
    assert scene.transforms(0)[:, 2, 3].tolist() == [5, 0, 5]
    scene.show(0, False, instances=[False, True, False])
    assert scene.shown(0).tolist() == [True, False, True]


def test_hits_print_as_what_they_are():
    """Not as an object at an address."""
    scene = another()
    assert repr(scene.closest_hit(HERE, DOWN)) == (
        "SceneHits(t=array(8.), side=array(1), t_error=None, object=array(0), instance=array(0), face=array(10), "
        "u=array(0.25), v=array(0.25))"
    )
    assert repr(scene.all_hits(HERE, DOWN)).startswith("SceneAllHits(offsets=array([0, 2]), t=array([8., 9.]), ")
    assert repr(scene.closest_point(HERE)).startswith("SceneClosestPoints(distance=array(8.), object=array(0), ")


def test_a_mesh_that_cannot_be_used_is_refused():
    with pytest.raises(MeshError):
        RayScene().add([[0, 0, 0]])


@cases("repeats", [1, 10])
def test_what_a_ray_does_not_see_is_not_there_where_it_starts(repeats):
    """Two sheets share an edge; a cube stands on a plate."""
    scene = RayScene()
    sheet = Mesh([[-1, -1, 0], [0, -1, 0], [0, 1, 0], [-1, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    wall = Mesh([[0, -1, 0], [0, -1, 2], [0, 1, 2], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    scene.add(sheet, mask=1)
    scene.add(wall, mask=2)
    down = np.repeat([[0.0, 0.0, -1.0]], repeats, axis=0)
    edge = scene.closest_hit(np.repeat([[0.0, 0.3, 1.0]], repeats, axis=0), down, mask=1)
    across = [1.0, 0.0, 1.0]
    assert (scene.closest_hit(edge.points, across, leaving=edge).t == 0).all()
    assert not scene.any_hit(edge.points, across, leaving=edge, mask=1).any()

    scene = RayScene()
    plate = scene.add(box((-9, -9, -1), (9, 9, 0)))
    cube = scene.add(box())
    roof = scene.closest_hit(np.repeat([[0.3, 0.4, 9.0]], repeats, axis=0), down)
    assert (roof.object == cube).all()
    # Into its own body, which it does not see, down to the plate.
    below = scene.closest_hit(roof.points, down, leaving=roof, ignore=roof)
    assert (below.object == plate).all() and (below.t == 1).all()
    assert (scene.closest_hit(roof.points, down, leaving=roof).t == 0).all()

    # A roof in the plane of the plate: without the cube the ray starts on the plate.
    scene = RayScene()
    plate, cube = scene.add(box((-9, -9, -1), (9, 9, 0)), mask=1), scene.add(box((-1, -1, -1), (1, 1, 0)), mask=2)
    roof = scene.closest_hit(np.repeat([[0.3, 0.4, 9.0]], repeats, axis=0), down, mask=2)
    assert (roof.object == cube).all()
    for aim in (down, -down):
        at_once = scene.closest_hit(roof.points, aim, leaving=roof, ignore=roof)
        assert (at_once.object == plate).all() and (at_once.t == 0).all()


def test_hits_of_a_copy_are_those_of_the_scene_until_one_of_them_changes():
    scene = another()
    hits, copied = scene.closest_hit(HERE, DOWN), copy.deepcopy(scene)
    assert copied.any_hit(hits.points, [0, 0, 1], leaving=hits) == scene.any_hit(hits.points, [0, 0, 1], leaving=hits)
    copied.move(0, np.eye(4))
    with pytest.raises(ValueError, match="leaving: expected hits on the scene as it is"):
        copied.any_hit(hits.points, [0, 0, 1], leaving=hits)
    assert copied.closest_hit(HERE, DOWN, ignore=hits).object == -1


def test_a_vertex_that_no_face_has_costs_nothing():
    """As many nodes and triangles are tested as without it."""
    ball = icosphere(3)
    far, steps = Mesh(np.vstack([ball.vertices, [[1e30, 0, 0]]]), ball.faces), []
    for mesh in (ball, far):
        scene = RayScene()
        scene.add(mesh, [[[1, 0, 0, 3 * k], [0, 1, 0, 0], [0, 0, 1, 0]] for k in range(9)])
        origins = np.random.default_rng(8).uniform(-1, 25, (99, 3))
        steps.append(scene.count_steps(origins, [0.1, 0.2, -1.0]))
    assert (steps[0].nodes == steps[1].nodes).all() and (steps[0].triangles == steps[1].triangles).all()

"""The drop-in's contract with trimesh and its users: shapes, types, empty answers, edits, copies, laziness."""

import copy
import gc
import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from cases import cases
from trimesh.ray import ray_triangle

import renderer.trimesh_ray
from renderer.trimesh_ray import RayMeshIntersector, install, installed, trees, uninstall
from renderer.trimesh_ray.solid import _parts

pytestmark = pytest.mark.judges(
    "trimesh_ray.RayMeshIntersector", "trimesh_ray.RayMeshIntersector.contains_points",
    "trimesh_ray.RayMeshIntersector.intersects_any", "trimesh_ray.RayMeshIntersector.intersects_first",
    "trimesh_ray.RayMeshIntersector.intersects_id", "trimesh_ray.RayMeshIntersector.intersects_location",
    "trimesh_ray.install", "trimesh_ray.installed", "trimesh_ray.uninstall",
)  # fmt: skip


ROOT = Path(__file__).parents[2]
DOWN = [[0.0, 0.0, -1.0]]
# Two points inside of a unit ball, and one outside.
POINTS = [[0, 0, 0], [0.5, 0.2, 0.1], [0.9, 0.9, 0.9]]


def asked(mesh: Any) -> RayMeshIntersector:
    return RayMeshIntersector(mesh)


def test_shapes_and_types_are_trimeshs() -> None:
    mesh = trimesh.creation.box()
    ours, theirs = asked(mesh), ray_triangle.RayMeshIntersector(mesh)
    rays = [[0.1, 0.2, 5.0], [9.0, 9.0, 9.0]], DOWN * 2
    for several in (True, False):
        for call in ("intersects_location", "intersects_id"):
            found, expected = (getattr(ray, call)(*rays, multiple_hits=several) for ray in (ours, theirs))
            assert [(a.dtype, a.shape) for a in found] == [(b.dtype, b.shape) for b in expected]
    for call in ("intersects_first", "intersects_any"):
        np.testing.assert_array_equal(getattr(ours, call)(*rays), getattr(theirs, call)(*rays))
        assert getattr(ours, call)(*rays).dtype == getattr(theirs, call)(*rays).dtype
    assert ours.contains_points([[0.0, 0.0, 0.0]]).tolist() == [True]
    assert ours.mesh is mesh


@cases("mesh", [trimesh.creation.box(), trimesh.Trimesh()])
@cases("rays", [([], []), (np.empty((0, 3)), np.empty((0, 3))), ([[0, 9, 9]], DOWN)])
def test_nothing_found_is_empty_arrays_of_the_usual_kinds(mesh: Any, rays: Any) -> None:
    places, which, faces = asked(mesh).intersects_location(*rays)
    assert (places.shape, which.shape, faces.shape) == ((0, 3), (0,), (0,))
    assert (places.dtype, which.dtype, faces.dtype) == (np.float64, np.int64, np.int64)
    assert asked(mesh).intersects_first(*rays).tolist() == [-1] * len(rays[0])
    assert asked(mesh).intersects_any(*rays).tolist() == [False] * len(rays[0])
    assert asked(mesh).contains_points(rays[0]).tolist() == [False] * len(rays[0])


@cases(
    ("origins", "directions", "named"),
    [
        ([[0, 0, 1], [0, 0, 2]], [[0, 0, 1]], "ray_directions"),
        ([[0, 0, 1]], [], "ray_origins|ray_directions"),
        ([0, 0, 1], [0, 0, 1], "ray_origins"),
        ([[0, 0]], [[0, 0]], "ray_origins"),
    ],
)
def test_rays_of_other_shapes_are_refused(origins: Any, directions: Any, named: str) -> None:
    for call in ("intersects_id", "intersects_location", "intersects_first", "intersects_any"):
        with pytest.raises(ValueError, match=rf"^({named}): expected .*, got shape"):
            getattr(asked(trimesh.creation.box()), call)(origins, directions)
    with pytest.raises(ValueError, match=r"^points: expected shape \(n, 3\), got"):
        asked(trimesh.creation.box()).contains_points([0, 0, 1])


class TestContent:
    """The tree follows the mesh's content."""

    def test_a_primitive_that_is_moved_is_seen(self) -> None:
        ball = trimesh.primitives.Sphere(radius=1.0)
        assert asked(ball).contains_points([[0, 0, 0], [3, 0, 0]]).tolist() == [True, False]
        ball.primitive.center = [3.0, 0.0, 0.0]
        assert asked(ball).contains_points([[0, 0, 0], [3, 0, 0]]).tolist() == [False, True]

    def test_an_edit_does_not_reach_the_tree_that_a_copy_has(self) -> None:
        mesh = trimesh.creation.box()
        twin = mesh.copy()
        assert trees.traced(mesh) is trees.traced(twin)
        mesh.vertices[:, 2] += 1.0
        assert asked(twin).intersects_location([[0, 0, 9]], DOWN)[0][:, 2].tolist() == [0.5, -0.5]
        assert asked(mesh).intersects_location([[0, 0, 9]], DOWN)[0][:, 2].tolist() == [1.5, 0.5]

    def test_a_tree_is_built_once_for_a_content(self, monkeypatch: pytest.MonkeyPatch) -> None:
        built, shared = list[int](), trees._shared
        monkeypatch.setattr(trees, "_shared", lambda mesh, digest: built.append(digest) or shared(mesh, digest))
        mesh = trimesh.creation.box()
        for _ in range(3):
            asked(mesh).intersects_any([[0, 0, 9]], DOWN)
        assert len(built) == 1

    def test_a_tree_goes_with_its_mesh(self) -> None:
        mesh = trimesh.creation.box(extents=[1, 2, 3.25])
        asked(mesh).intersects_any([[0, 0, 9]], DOWN)
        key, digest = id(mesh), hash(mesh)
        assert key in trees._kept and digest in trees._by_digest
        del mesh
        gc.collect()
        assert key not in trees._kept and digest not in trees._by_digest

    def test_two_meshes_of_one_digest_have_their_own_trees(self, monkeypatch: pytest.MonkeyPatch) -> None:
        small, large = trimesh.creation.box(), trimesh.creation.box(extents=[4, 4, 4])
        monkeypatch.setattr(trimesh.Trimesh, "__hash__", lambda self: 7)
        assert asked(small).contains_points([[1, 1, 1]]).tolist() == [False]
        assert asked(large).contains_points([[1, 1, 1]]).tolist() == [True]


class TestCopies:
    def test_pickles_and_copies_answer_and_carry_no_tree(self) -> None:
        mesh = trimesh.creation.icosphere(subdivisions=4)
        empty = len(pickle.dumps(mesh.copy()))
        mesh.ray = RayMeshIntersector(mesh)
        mesh.ray.intersects_any([[0, 0, 9]], DOWN)
        pickled = pickle.dumps(mesh)
        # 5,120 faces: the tree alone is larger than the mesh.
        assert len(pickled) < 1.5 * empty
        for again in (pickle.loads(pickled), copy.deepcopy(mesh), copy.copy(mesh), mesh.copy()):
            assert again.ray.mesh is again
            assert again.ray.intersects_any([[0, 0, 9]], DOWN).tolist() == [True]


class TestInstall:
    def test_new_meshes_have_it_until_uninstalled(self) -> None:
        before = type(trimesh.creation.box().ray), trimesh.proximity.closest_point, trimesh.ray.ray_pyembree
        early = trimesh.creation.box()
        install()
        install(proximity=True)
        install()
        try:
            assert type(trimesh.creation.box().ray) is RayMeshIntersector is not before[0]
            assert type(trimesh.creation.box().copy().ray) is RayMeshIntersector
            assert type(early.ray) is before[0]
            from trimesh.ray.ray_pyembree import RayMeshIntersector as Imported

            assert Imported is RayMeshIntersector
            assert trimesh.proximity.closest_point is renderer.trimesh_ray.distances.closest_point
        finally:
            uninstall()
        after = type(trimesh.creation.box().ray), trimesh.proximity.closest_point, trimesh.ray.ray_pyembree
        assert after == before
        uninstall()

    def test_the_context_gives_back_what_was_there_before_it(self) -> None:
        before = trimesh.proximity.signed_distance
        with installed():
            assert trimesh.proximity.signed_distance is before
            with installed(proximity=True):
                assert trimesh.proximity.signed_distance is not before
            assert trimesh.proximity.signed_distance is before
            assert type(trimesh.creation.box().ray) is RayMeshIntersector
        assert type(trimesh.creation.box().ray) is not RayMeshIntersector

    def test_without_embreex_too(self) -> None:
        """trimesh then has no class to replace."""
        script = """
import sys
sys.modules["embreex"] = None
import trimesh
assert not trimesh.ray.has_embree
from renderer.trimesh_ray import RayMeshIntersector, installed
with installed():
    assert type(trimesh.creation.box().ray) is RayMeshIntersector
    from trimesh.ray.ray_pyembree import RayMeshIntersector as there
    assert there is RayMeshIntersector
assert type(trimesh.creation.box().ray) is trimesh.ray.ray_triangle.RayMeshIntersector and not trimesh.ray.has_embree
assert "trimesh.ray.ray_pyembree" not in sys.modules
"""
        done = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, timeout=100)
        assert done.returncode == 0, done.stderr


def test_constructing_imports_no_compiler() -> None:
    script = """
import sys
from renderer.trimesh_ray import install
install(proximity=True)
import trimesh
for mesh in (trimesh.creation.box(), trimesh.Trimesh()):
    mesh.copy()
assert "numba" not in sys.modules and "renderer.octree" not in sys.modules
"""
    done = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, timeout=100)
    assert done.returncode == 0, done.stderr


def twice(mesh: Any, turned: bool) -> Any:
    """A body whose faces are there twice; the second ones from the other side, if asked."""
    again = mesh.copy()
    if turned:
        again.invert()
    return trimesh.util.concatenate([mesh, again])


def box(low: list[float], high: list[float]) -> trimesh.Trimesh:
    return trimesh.creation.box(bounds=[low, high])


class TestWhatTrimeshForgives:
    """An attacker found these answered otherwise than trimesh does, and worse."""

    @pytest.mark.parametrize("inward", [False, True])
    def test_an_open_body_has_an_inside_whichever_way_its_faces_are_turned(self, inward: bool) -> None:
        mesh = trimesh.creation.icosphere(subdivisions=3)
        if inward:
            mesh.invert()
        mesh.update_faces(np.arange(len(mesh.faces)) != 7)
        assert asked(mesh).contains_points(POINTS).tolist() == [
            True,
            True,
            False,
        ]

    def test_an_open_body_of_faces_turned_any_way_is_voted_on_as_by_trimesh(self) -> None:
        mesh = trimesh.creation.icosphere(subdivisions=3)
        faces = mesh.faces.copy()[:-1]
        faces[::2] = faces[::2, ::-1]
        mixed = trimesh.Trimesh(mesh.vertices, faces, process=False)
        assert asked(mixed).contains_points(POINTS).tolist() == [
            True,
            True,
            False,
        ]

    def test_bodies_far_away_that_share_a_wall_change_no_answer(self) -> None:
        """Faces at one place counted once, and an edge of three faces made the whole mesh one that is open."""
        pair, far = [box([0, 0, 0], [2, 2, 2]), box([1, 1, 1], [3, 3, 3])], [box([9, 0, 0], [11, 2, 1])]
        base = box([9, 0, 0], [11, 2, 2])
        points = [[0.5, 0.5, 0.5], [1.5, 1.4, 1.3], [2.5, 2.4, 2.3], [3.5, 0.4, 0.3]]
        for parts in (
            pair,
            [*pair, *far],
            [*pair, *far, base],
            [*pair, *far, base, twice(box([20] * 3, [21] * 3), False)],
        ):
            whole = trimesh.util.concatenate(parts)
            assert asked(whole).contains_points(points).tolist() == [True, False, True, False], len(parts)
        assert asked(whole).contains_points([[10, 1, 0.5], [10, 1, 1.5], [20.5, 20.5, 20.5]]).tolist() == [
            False,
            True,
            True,
        ]
        # On the base, which both bodies have.
        assert asked(whole).contains_points([[10.2, 1, 0], [9, 1, 0.5]]).all()

    def test_an_open_body_that_is_there_twice_has_an_inside_too(self) -> None:
        """Its rim has two faces then, as if it were closed."""
        mesh = trimesh.creation.icosphere(subdivisions=2)
        faces = mesh.faces.copy()[:-1]
        faces[::2] = faces[::2, ::-1]
        for several in (faces, np.concatenate([faces, faces]), np.concatenate([faces, faces[:, ::-1], faces])):
            whole = trimesh.Trimesh(mesh.vertices, several, process=False)
            assert asked(whole).contains_points([[0.01, 0.02, 0.03], [2, 0, 0]]).tolist() == [True, False]

    def test_bodies_that_share_a_wall_and_are_there_twice_have_an_inside(self) -> None:
        a, b = box([0, 0, 0], [1, 1, 1]), box([1, 0, 0], [2, 1, 1])
        points = [[0.5, 0.5, 0.5], [1.5, 0.5, 0.5], [0.99, 0.4, 0.3], [1.01, 0.4, 0.3], [2.5, 0.5, 0.5]]
        for parts in ([a, b], [a, b, a, b], [a, b, a, b, a, b]):
            whole = trimesh.util.concatenate(parts)
            assert asked(whole).contains_points(points).tolist() == [True, True, True, True, False]

    def test_cells_that_share_walls_have_an_inside(self) -> None:
        rng = np.random.default_rng(6)
        for _ in range(20):
            cells = np.argwhere(rng.random((3, 3, 3)) < 0.5)
            whole = trimesh.util.concatenate([box(cell.tolist(), (cell + 1).tolist()) for cell in cells])
            around = np.argwhere(np.ones((5, 5, 5))) - 1
            walled = [
                sum((cells == cell + step).all(axis=1).any() for step in [*np.eye(3), *-np.eye(3)]) for cell in cells
            ]
            free = cells[np.array(walled) < 6]  # see docs/guides/trimesh.md on a body whose whole surface others share
            expected = (around[:, None] == cells).all(axis=2).any(axis=1)
            asked_for = (around[:, None] == free).all(axis=2).any(axis=1) | ~expected
            found = asked(whole).contains_points(np.add(around, [0.3, 0.4, 0.6]))
            assert np.array_equal(found[asked_for], expected[asked_for])

    def test_parts_of_any_shape_and_numbering_are_found_in_few_rounds(self) -> None:
        """A strip of 200,000 faces, numbered at random; its rounds grew with its length, to hours."""
        count = 200_000
        order = np.random.default_rng(1).permutation(count)
        edges = np.stack([np.arange(count), np.arange(count) + 1, count + 1 + np.arange(count)], axis=1)[order]
        part = _parts(edges, np.ones_like(edges, bool))
        assert (part == 0).all()
        apart = edges.copy()
        apart[order == 999, 1] = 2 * count + 1
        part = _parts(apart, np.ones_like(edges, bool))
        assert np.array_equal(part[order <= 999], np.full(1000, np.flatnonzero(order <= 999)[0]))
        assert np.array_equal(part[order > 999], np.full(count - 1000, np.flatnonzero(order > 999)[0]))

    def test_a_face_from_a_place_to_itself_opens_nothing(self) -> None:
        pair = trimesh.util.concatenate([box([0, 0, 0], [2, 2, 1]), box([0, 0, 0], [2, 2, 2])])
        faces = np.concatenate([pair.faces, [[0, 0, 1], [3, 3, 3]]])
        points = [[1.1, 0.9, 0.5], [1.1, 0.9, 1.5]]
        whole = trimesh.Trimesh(pair.vertices, faces, process=False, validate=False)
        assert asked(whole).contains_points(points).tolist() == [False, True]

    def test_a_face_without_a_place_widens_no_box(self) -> None:
        """Three nested bowls, around which the surface winds by more than a half above their rims."""
        ball = trimesh.creation.icosphere(3)
        lower = ball.faces[ball.triangles_center[:, 2] < 0]
        vertices = np.concatenate([ball.vertices * k - [0, 0, 0.2] for k in (1, 1.1, 1.2)])
        faces = np.concatenate([lower + k * len(ball.vertices) for k in range(3)])
        point = [[0, 0, vertices[np.unique(faces), 2].max() + 0.01]]
        with_nan = np.r_[vertices, [[0, 0, np.nan]]], np.r_[faces, [[0, 1, len(vertices)]]]
        for corners, some in ((vertices, faces), with_nan):
            mesh = trimesh.Trimesh(corners, some, process=False, validate=False)
            assert not asked(mesh).contains_points(point)[0]

    def test_a_tiny_direction_is_one_beside_a_ray_without_direction_too(self) -> None:
        ray, origins = asked(trimesh.creation.box()), [[0.1, 0.2, 5], [0, 0, 5]]
        for tiny in 10.0 ** -np.arange(1, 80, 6):
            directions = [[0, 0, -tiny], [0, 0, 0]]
            alone = ray.intersects_first(origins[:1], directions[:1]).tolist()
            assert ray.intersects_first(origins, directions).tolist() == [*alone, -1]
            assert ray.intersects_any(origins, directions).tolist() == [True, False]

    def test_all_hits_are_located_however_many(self) -> None:
        """A hundred of 160, as over embreex."""
        boxes = trimesh.util.concatenate([trimesh.creation.box(extents=[k, k, k]) for k in range(1, 81)])
        assert len(asked(boxes).intersects_location([[0.1, 0.2, 99]], DOWN)[0]) == 160
        assert len(asked(boxes).intersects_id([[0.1, 0.2, 99]], DOWN)[0]) == 100

    def test_an_open_soup_is_judged_as_the_mesh_of_its_faces(self) -> None:
        """Which way faces are turned was told by the vertices' numbers, by which a soup has no common edge."""
        mesh = trimesh.creation.icosphere(subdivisions=3)
        faces = mesh.faces.copy()[1:]
        turn = np.random.default_rng(0).random(len(faces)) < 0.5
        faces[turn] = faces[turn, ::-1]
        points = np.random.default_rng(1).uniform(-0.5, 0.5, (200, 3))
        soup = trimesh.Trimesh(
            mesh.vertices[faces].reshape(-1, 3), np.arange(3 * len(faces)).reshape(-1, 3), process=False
        )
        assert asked(soup).contains_points(points).all()
        assert asked(trimesh.Trimesh(mesh.vertices, faces, process=False)).contains_points(points).all()

    def test_votes_are_the_same_each_time_and_in_each_batch(self) -> None:
        """trimesh's own, which were taken, draw a direction at random where two rays differ."""
        rng = np.random.default_rng(4)
        mesh = trimesh.Trimesh(rng.uniform(-1, 1, (30, 3)), rng.integers(0, 30, (60, 3)), process=False)
        points = rng.uniform(-1, 1, (300, 3))
        first = asked(mesh).contains_points(points)
        assert first.any() and not first.all()
        for _ in range(3):
            assert np.array_equal(asked(mesh).contains_points(points), first)
        alone = [asked(mesh).contains_points(point[None])[0] for point in points]
        assert np.array_equal(alone, first)

    def test_points_on_an_open_mesh_turned_both_ways_are_inside(self) -> None:
        body = box([0, 0, 0], [2, 2, 2])
        faces = body.faces[~(body.vertices[body.faces][:, :, 2] == 2).all(axis=1)].copy()
        faces[0] = faces[0, ::-1]
        mesh = trimesh.Trimesh(body.vertices, faces, process=False)
        assert asked(mesh).contains_points([[1, 1, 0], [0, 1, 0.5], [0.5, 0, 1], [2, 0.5, 0.25], [0, 0, 0]]).all()

    def test_a_vertex_that_no_face_has_changes_no_answer(self) -> None:
        parts = [box([0, 0, 0], [2, 2, 2]), box([0.1, 0.1, 0.1], [1.9, 1.9, 2])]
        lidless = [part.faces[~(part.vertices[part.faces][:, :, 2] == 2).all(axis=1)] for part in parts]
        two = trimesh.util.concatenate([trimesh.Trimesh(p.vertices, f) for p, f in zip(parts, lidless, strict=True)])
        far = trimesh.Trimesh(np.vstack([two.vertices, [[0, 0, 9]], [[np.nan, 0, 0]]]), two.faces, process=False)
        points = [[1, 1, 2.01], [1, 1, 0.5]]
        assert (
            asked(two).contains_points(points).tolist() == asked(far).contains_points(points).tolist() == [False, True]
        )

    def test_a_row_that_is_refused_has_its_own_number(self) -> None:
        with pytest.raises(ValueError, match=r"in row 1$"):
            asked(trimesh.creation.box()).intersects_any([[np.nan, 0, 0], [1e300, 0, 0]], DOWN * 2)


def test_uninstall_in_a_block_leaves_the_block() -> None:
    install()
    with installed():
        uninstall()
        assert isinstance(trimesh.creation.box().ray, RayMeshIntersector)
    assert not isinstance(trimesh.creation.box().ray, RayMeshIntersector)


def test_blocks_may_overlap_and_meshes_made_before_still_travel() -> None:
    first, second = installed(proximity=True), installed()
    early = trimesh.creation.box()
    first.__enter__()
    second.__enter__()
    first.__exit__(None, None, None)
    assert type(trimesh.creation.box().ray) is RayMeshIntersector
    assert trimesh.proximity.closest_point is not renderer.trimesh_ray.distances.closest_point
    again = pickle.loads(pickle.dumps(early))
    assert type(again.ray) is type(early.ray) and again.ray.mesh is again
    second.__exit__(None, None, None)
    assert type(trimesh.creation.box().ray) is type(early.ray) is not RayMeshIntersector
    assert copy.deepcopy(RayMeshIntersector(early)).mesh is early

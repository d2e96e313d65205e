"""What users reported to trimesh about its rays, by the number of the issue: each case holds with the drop-in.

Written anew from the descriptions; ``make conformance`` runs trimesh's own tests.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import trimesh

from renderer.trimesh_ray import RayMeshIntersector, installed


@pytest.fixture(autouse=True)
def drop_in() -> Iterator[None]:
    with installed(proximity=True):
        yield


def box(*extents: float) -> Any:
    return trimesh.creation.box(extents=extents or (1.0, 1.0, 1.0))


def test_2504_a_tiny_box_seen_from_far_away_is_passed_twice() -> None:
    mesh = box(1e-3, 1e-3, 1e-3)
    mesh.ray = RayMeshIntersector(mesh, scale_to_box=False)
    faces, rays, places = mesh.ray.intersects_id([[0, 0, 1e4]], [[0, 0, -1]], return_locations=True)
    assert rays.tolist() == [0, 0] and len(faces) == 2
    np.testing.assert_array_equal(places[:, 2], [5e-4, -5e-4])


def test_1496_any_and_id_agree_at_corners_and_edges() -> None:
    inner, outer = box(40, 40, 40).subdivide_to_size(20), box(60, 60, 60).subdivide_to_size(20)
    directions = np.asarray(outer.vertices)
    origins = np.zeros_like(directions)
    _, first = inner.ray.intersects_id(origins, directions, multiple_hits=False)
    _, every = inner.ray.intersects_id(origins, directions)
    assert inner.ray.intersects_any(origins, directions).all()
    # From within a convex solid each ray leaves it once.
    assert first.tolist() == every.tolist() == list(range(len(origins)))


def test_1362_a_batch_answers_as_its_rays_one_by_one() -> None:
    mesh = trimesh.creation.torus(2, 0.5)
    origins, directions = mesh.vertices + mesh.vertex_normals * 0.01, -mesh.vertex_normals
    batch = mesh.ray.intersects_id(origins, directions, return_locations=True)
    alone = [mesh.ray.intersects_id([o], [d], return_locations=True) for o, d in zip(origins, directions, strict=True)]
    assert mesh.ray.intersects_any(origins, directions).all()
    np.testing.assert_array_equal(batch[0], np.concatenate([faces for faces, _, _ in alone]))
    np.testing.assert_array_equal(batch[2], np.concatenate([places for _, _, places in alone]))
    np.testing.assert_array_equal(batch[1], np.repeat(np.arange(len(origins)), [len(faces) for faces, _, _ in alone]))


def test_1898_places_lie_on_their_rays() -> None:
    mesh = trimesh.creation.icosphere()
    directions = trimesh.unitize(np.add([0, 0, 1], np.random.default_rng(1).uniform(-0.05, 0.05, (50, 3))))
    origins = np.tile([0.0, 0.0, -5.0], (50, 1))
    places, rays, _ = mesh.ray.intersects_location(origins, directions)
    assert np.bincount(rays).tolist() == [2] * 50
    # A few ulp of the coordinates, 5 at most.
    assert np.abs(np.cross(places - origins[rays], directions[rays])).max() < 5 * 2.0**-50


@pytest.mark.parametrize("number", [242, 545])
def test_242_545_inside_a_sphere_is_told_of_every_point(number: int) -> None:
    """Issues 242 and 545: by the planes of a convex mesh, so also in the shell where it is no sphere."""
    mesh = trimesh.creation.icosphere(subdivisions=3) if number == 242 else trimesh.creation.uv_sphere(count=[32, 32])
    points = np.random.default_rng(number).uniform(-1, 1, (4000, 3))
    sides = np.einsum("fj,nfj->nf", mesh.face_normals, points[:, None] - mesh.triangles[:, 0])
    # Nothing is so near to a plane that rounding could turn it over.
    assert (np.abs(sides.max(axis=1)) > 1e-12).all()
    np.testing.assert_array_equal(mesh.contains(points), sides.max(axis=1) < 0)


def test_48_a_ray_that_leaves_a_wall_at_large_coordinates_misses_it() -> None:
    """trimesh's own test only logs this case, as float32 cannot tell it."""
    wall = trimesh.Trimesh(
        [[528980.85, 183526.1, 0], [528980.85, 183526.1, 3], [528982.3, 183523.55, 0], [528982.3, 183523.55, 3]],
        [[1, 0, 2], [1, 2, 3]],
        process=False,
    )
    normal = trimesh.unitize(np.cross(wall.vertices[1] - wall.vertices[0], wall.vertices[2] - wall.vertices[0]))
    for distance in (0.01, 1e-6, 1e-9):
        start = wall.vertices[[0, 2]].mean(axis=0) + [0, 0, 1] + distance * normal
        assert wall.ray.intersects_any([start, start], [normal, -normal]).tolist() == [False, True]


def test_331_a_ray_from_a_little_off_the_surface_misses_what_it_leaves() -> None:
    mesh = box()
    points, faces = trimesh.sample.sample_surface(mesh, 64, seed=0)
    normals = mesh.face_normals[faces]
    # One ulp of the coordinates off the axis-aligned faces is enough, and the other way meets the surface at once.
    off = np.where(normals != 0, np.nextafter(points, 9 * normals), points)
    assert not mesh.ray.intersects_any(off, normals).any()
    assert mesh.ray.intersects_any(off, -normals).all()


def test_2462_a_ray_in_the_plane_of_a_sheet_misses_it() -> None:
    sheet = trimesh.Trimesh([[0, 0, 0], [0.1, 0, 0], [0.1, 0.3, 0], [0, 0.3, 0]], [[0, 1, 2], [0, 2, 3]], process=False)
    for several in (False, True):
        places, rays, faces = sheet.ray.intersects_location([[-0.5, 0.1, 0]], [[1, 0, 0]], multiple_hits=several)
        assert places.shape == (0, 3) and rays.shape == faces.shape == (0,)


def test_2534_the_hollow_of_a_solid_is_outside() -> None:
    hollow = box(0.1, 0.1, 0.1)
    hollow.invert()
    mesh = trimesh.util.concatenate([box(), hollow])
    assert mesh.contains([[0, 0, 0], [0.2, 0, 0], [2, 0, 0]]).tolist() == [False, True, False]
    inside = trimesh.sample.volume_mesh(mesh, 5000)
    assert len(inside) > 4000 and not (np.abs(inside) < 0.05).all(axis=1).any()


def test_1416_points_level_with_corners_and_edges_are_told() -> None:
    """A question of inside or outside, as the survey lists it: on a grid that has all corners of a stepped solid."""
    steps = [box(4 - k, 4 - k, 1).apply_translation([0, 0, k]) for k in range(3)]
    mesh = trimesh.util.concatenate(steps)
    grid = np.stack(np.meshgrid(*[np.arange(-10, 14) / 4] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    halves = (4 - np.clip(np.floor(grid[:, 2] + 0.5), 0, 2)) / 2
    level = (np.abs(grid[:, 2] - np.round(grid[:, 2])) != 0.5) & (np.abs(grid[:, :2]) != halves[:, None]).all(axis=1)
    inside = (np.abs(grid[:, :2]) < halves[:, None]).all(axis=1) & (grid[:, 2] > -0.5) & (grid[:, 2] < 2.5)
    np.testing.assert_array_equal(mesh.contains(grid[level]), inside[level])

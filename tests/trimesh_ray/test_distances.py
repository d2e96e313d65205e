"""Nearest points, signed distances and thickness of trimesh by the octree: exact, and signed as trimesh signs."""

import sys
from collections.abc import Iterator
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
import trimesh

from renderer.trimesh_ray import installed
from renderer.trimesh_ray.distances import closest_point, signed_distance
from renderer.trimesh_ray.trees import Traced
from renderer.trimesh_ray.within import _VOTES, points_within
from validation.oracle.distance import nearest

# A tetrahedron with an acute edge from (-1, 0.5, 0) to (1, 0.5, 0).
ACUTE = trimesh.Trimesh(
    [[-1, 0.5, 0], [1, 0.5, 0], [0, -1, -0.5], [0, -1, 0.5]], [[0, 1, 2], [0, 2, 3], [0, 3, 1], [3, 2, 1]]
)


@pytest.fixture
def drop_in() -> Iterator[None]:
    with installed(proximity=True):
        yield


def test_shapes_types_and_the_lists_that_trimesh_takes(drop_in: None) -> None:
    mesh = trimesh.creation.box()
    places, distances, faces = mesh.nearest.on_surface([[0, 0, 2], [3, 0, 0]])
    assert places.tolist() == [[0, 0, 0.5], [0.5, 0, 0]] and distances.tolist() == [1.5, 2.5]
    assert (places.dtype, distances.dtype, faces.dtype) == (np.float64, np.float64, np.int64)
    assert mesh.nearest.signed_distance([[0, 0, 2], [0, 0, 0.25], [0.5, 0.5, 0.5]]).tolist() == [-1.5, 0.25, 0.0]
    for call in (closest_point, signed_distance):
        with pytest.raises(ValueError, match=r"^points: expected shape \(n, 3\), got"):
            call(mesh, [0, 0, 2])


def test_distances_are_the_exact_ones() -> None:
    """At the scale of a hundredth of trimesh's tolerance too, where its own are off."""
    rng = np.random.default_rng(15)
    for scale in (1.0, 1e-10, 1e6):
        mesh = trimesh.creation.icosphere(subdivisions=1, radius=scale)
        points = rng.uniform(-2, 2, (8, 3)) * scale
        _, distances, _ = closest_point(mesh, points)
        triangles = [[tuple(map(Fraction, corner)) for corner in face] for face in np.asarray(mesh.triangles).tolist()]
        for point, distance in zip(points.tolist(), distances.tolist(), strict=True):
            square = nearest(tuple(map(Fraction, point)), triangles)[0]
            assert abs(Fraction(distance) ** 2 / square - 1) < Fraction(1, 2**50)


@pytest.mark.parametrize("soup", [False, True])
def test_the_face_named_has_its_front_to_points_outside_a_convex_body(soup: bool) -> None:
    """Corners are told apart by position: of soup the face that was found had its back to a third of the points."""
    mesh, rng = trimesh.creation.cone(1.0, 2.0, sections=7), np.random.default_rng(8)
    if soup:
        mesh.unmerge_vertices()
    points = rng.uniform(-3, 3, (2000, 3))
    points = points[~mesh.contains(points)]
    places, _, faces = closest_point(mesh, points)
    assert (np.einsum("ij,ij->i", mesh.face_normals[faces], points - places) > -1e-12).all()


def test_the_sign_is_right_where_the_nearest_normal_is_not() -> None:
    """Above the acute edge, in the plane of a face, and far from the surface."""
    solid = ACUTE.copy()
    points = [[0, 2, z] for z in np.linspace(-3, 3, 31)] + [[0, 0.5 + 1e-12, 0], [0, 0.4, 0], [100, -0.5, 0]]
    signed = signed_distance(solid, points)
    assert (signed[:-2] < 0).all() and signed[-2] > 0 > signed[-1]
    assert signed_distance(trimesh.creation.box(), [[100.5, -0.5, -0.5]]).tolist() == [-100.0]


def test_an_open_mesh_is_signed_by_its_winding_number() -> None:
    open_box: Any = trimesh.creation.box()
    open_box.update_faces(open_box.face_normals[:, 2] < 0.5)
    signed = signed_distance(open_box, [[0, 0, -0.4], [0, 0, -3]])
    assert signed[0] == pytest.approx(0.1, abs=1e-15) and signed[1] == -2.5


def test_thickness_and_reach_of_a_box(drop_in: None) -> None:
    mesh = trimesh.creation.box(extents=[1, 2, 3])
    points, faces = mesh.sample(300, return_index=True, seed=1)
    normals = mesh.face_normals[faces]
    for method in ("ray", "max_sphere"):
        assert np.isinf(trimesh.proximity.thickness(mesh, points, exterior=True, normals=normals, method=method)).all()
        within = trimesh.proximity.thickness(mesh, points, normals=normals, method=method)
        assert (within >= 0).all() and within.max() <= 3
        assert trimesh.proximity.thickness(mesh, [[0.5, 0, 0]], method=method) == pytest.approx(1.0)
    along = np.abs(normals).argmax(axis=1)
    by_rays = trimesh.proximity.thickness(mesh, points, normals=normals, method="ray")
    np.testing.assert_allclose(by_rays, np.array([1, 2, 3])[along])


def test_voxels_by_rays_have_no_holes(drop_in: None) -> None:
    mesh = trimesh.creation.icosphere(subdivisions=4)
    voxels = trimesh.voxel.creation.voxelize_ray(mesh, 0.05)
    # No ray that passes within its circle misses the sphere.
    columns = np.round(voxels.points[:, :2] / 0.05)
    centres = np.unique(columns, axis=0) * 0.05
    grid = np.stack(np.meshgrid(np.arange(-17, 18), np.arange(-17, 18)), axis=-1).reshape(-1, 2) * 0.05
    within = grid[np.hypot(*grid.T) < 0.9]
    assert {tuple(np.round(c / 0.05)) for c in within} <= {tuple(np.round(c / 0.05)) for c in centres}


def test_a_nearest_point_never_has_a_face_without_a_place() -> None:
    """The face with a NaN corner, which shares an edge with the nearest, was taken to end at 0."""
    vertices = [[1, 0, 1], [1, 1, 1], [2, 0, 0], [np.nan, 0, 0]]
    mesh = trimesh.Trimesh(vertices, [[0, 1, 3], [0, 1, 2]], process=False)
    _, distance, face = closest_point(mesh, [[0, 0.5, 2.0]])
    assert face.tolist() == [1] and np.isclose(distance, np.sqrt(2.0))


def test_at_slanted_edges_it_is_the_face_turned_to_the_point() -> None:
    """There 1 - u - v of a point on the edge is not 0 but what rounding leaves of it."""
    rng = np.random.default_rng(1)
    mesh = trimesh.creation.box(transform=trimesh.transformations.random_rotation_matrix(rng.random(3)))
    normals = mesh.face_normals
    for (i, j), ends in zip(mesh.face_adjacency, mesh.vertices[mesh.face_adjacency_edges], strict=True):
        if abs(normals[i] @ normals[j]) < 0.5:
            t = rng.random((200, 1))
            for a, b, facing in ((0.1, 1, j), (1, 0.1, i)):
                points = ends[0] * t + ends[1] * (1 - t) + a * normals[i] + b * normals[j]
                assert (normals[closest_point(mesh, points)[2]] @ normals[facing] > 0.9).all()


def test_a_ray_that_leaves_a_torn_mesh_ends_the_vote() -> None:
    """Behind the point the first direction passes one face, ahead none; the second would pass one either way."""
    first, second = _VOTES
    corners = np.array([-first, second, -second])[:, None] + 0.1 * (np.eye(3) - 1.0 / 3.0)
    # Two faces that pass an edge the same way: the mesh is turned neither one way nor the other.
    torn = np.array([[(4.0, 0.0, 0.0), (4.0, 1.0, 0.0), (4.0, 0.0, side)] for side in (1.0, -1.0)])
    vertices = np.concatenate([corners, torn]).reshape(-1, 3)
    traced = Traced(vertices, np.arange(len(vertices)).reshape(-1, 3))
    assert not points_within(traced, np.zeros((1, 3))).any()


@pytest.mark.judges("trimesh_ray.install", "trimesh_ray.installed")
@pytest.mark.parametrize("missing", ["rtree", "scipy"])
def test_thickness_needs_no_rtree(monkeypatch: pytest.MonkeyPatch, missing: str) -> None:
    """trimesh's own nearest points need it, so that rays alone were not enough."""
    with installed():
        own = trimesh.proximity.closest_point
    assert own is not closest_point
    monkeypatch.setitem(sys.modules, missing, None)
    with installed():
        assert trimesh.proximity.closest_point is closest_point
        found = trimesh.proximity.thickness(trimesh.creation.box(), [[0.1, 0.2, 0.5]], method="ray")
    assert found.tolist() == [1.0]
    assert trimesh.proximity.closest_point is own

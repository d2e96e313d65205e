"""Points of a grid and points drawn on a surface."""

import numpy as np
import pytest
from cases import cases

from renderer import BruteForce, Mesh, Octree
from renderer.mesh.shapes import box, icosphere
from renderer.studies import FacePoints, grid_points, sample_points, sky_view_factor

# A sloping roof over level ground, both of corners that are no float32.
ROOF = Mesh(
    [[0.1, 0.1, 2.3], [3.1, 0.1, 3.1], [0.1, 3.1, 2.7], [-2.3, -1.9, 0], [5.1, -1.9, 0], [5.1, 4.7, 0], [-2.3, 4.7, 0]],
    [[0, 1, 2], [3, 4, 5], [3, 5, 6]],
)


@pytest.mark.judges("studies.grid_points")
class TestGridPoints:
    @cases("kind", [Octree, BruteForce])
    @cases("spacing", [0.3, 0.7, 1.1])
    def test_a_row_and_a_column_share_one_coordinate_and_heights_are_the_planes(self, kind, spacing):
        """Coordinates came from the hits, so that one column had two that differ by a rounding."""
        points, normals, faces = grid_points(kind.from_mesh(ROOF), spacing)
        for a, low, high in ((0, -2.3, 5.1), (1, -1.9, 4.7)):
            along = low + spacing * (np.arange(200) + 0.5)
            np.testing.assert_array_equal(np.unique(points[:, a]), along[along <= high])
        on_roof = (points[:, 0] > 0.1) & (points[:, 1] > 0.1) & (points[:, :2].sum(axis=1) < 3.2)
        np.testing.assert_array_equal(faces == 0, on_roof)
        slope = 2.3 + 0.8 * (points[:, 0] - 0.1) / 3.0 + 0.4 * (points[:, 1] - 0.1) / 3.0
        np.testing.assert_allclose(points[:, 2], np.where(on_roof, slope, 0.0), rtol=0, atol=1e-14)
        np.testing.assert_array_equal(normals, ROOF.face_normals()[faces])
        order = np.lexsort((points[:, 0], points[:, 1]))
        np.testing.assert_array_equal(order, np.arange(len(points)))

    def test_a_region_is_that_of_its_bounds(self):
        octree = Octree.from_mesh(ROOF)
        points = grid_points(octree, 0.5, bounds=[[-1, 0, 99], [1, 1, 0]]).points
        np.testing.assert_array_equal(points[:, 0], np.tile([-0.75, -0.25, 0.25, 0.75], 2))
        np.testing.assert_array_equal(points[:, 1], np.repeat([0.25, 0.75], 4))
        whole = grid_points(octree, 0.5)
        for same, other in zip(grid_points(octree, 0.5, bounds=ROOF.bounds), whole, strict=True):
            np.testing.assert_array_equal(same, other)
        assert all(len(part) == 0 for part in grid_points(octree, 1.0, bounds=[[90, 90, 0], [99, 99, 0]]))

    @cases("up, axis", [("x", 0), ("y", 1), ("z", 2)])
    def test_any_axis_points_up(self, up, axis):
        """The mesh with its heights along another axis gives the same grid, with them there."""
        order = [*(a for a in range(3) if a != axis), axis]
        turned = Octree(ROOF.vertices[:, np.argsort(order)], ROOF.faces)
        for more in ({}, {"height": 1.25}):
            found, known = grid_points(turned, 0.7, up=up, **more), grid_points(Octree.from_mesh(ROOF), 0.7, **more)
            np.testing.assert_allclose(found.points, known.points[:, np.argsort(order)], rtol=0, atol=1e-14)
            np.testing.assert_allclose(found.normals, known.normals[:, np.argsort(order)], rtol=0, atol=1e-15)
            np.testing.assert_array_equal(found.faces, known.faces)

    def test_at_a_height_points_are_level_and_also_where_no_mesh_is_below(self):
        ball = Octree.from_mesh(icosphere(2))
        points, normals, faces = grid_points(ball, 0.5, height=-3)
        assert len(points) == 16 and (points[:, 2] == -3.0).all() and len(grid_points(ball, 0.5).points) == 12
        assert (normals == (0.0, 0.0, 1.0)).all() and (faces == -1).all()
        assert points.dtype == normals.dtype == np.float64 and faces.dtype == np.int64

    def test_dropped_points_lie_on_their_faces_as_studies_take_them(self):
        octree = Octree.from_mesh(ROOF)
        points, normals, faces = grid_points(octree, 0.31)
        named = sky_view_factor(octree, points, normals, leaving=faces)
        np.testing.assert_array_equal(sky_view_factor(octree, points, normals), named)
        assert named[faces == 0].min() > 0.9 and (named[faces > 0] < 0.9).any()

    @cases(
        "given, said",
        [
            ({"spacing": 0}, "spacing: expected a number > 0, in the mesh's units, got 0"),
            ({"spacing": np.nan}, "spacing: expected a number > 0, in the mesh's units, got nan"),
            ({"spacing": [1, 2]}, "spacing: expected a number > 0"),
            ({"spacing": 1e-9}, "spacing: expected a spacing with at most 268,435,456 points, got "),
            ({"spacing": 1, "height": np.inf}, "height: expected a finite number, got inf"),
            ({"spacing": 1, "height": [1]}, "height: expected a finite number, got "),
            ({"spacing": 1, "bounds": [0, 0, 0]}, r"bounds: expected shape \(2, 3\), got shape \(3,\)"),
            ({"spacing": 1, "bounds": [[0, 0, 0], [1, -1, 0]]}, "bounds: expected the least corner, then the greatest"),
            ({"spacing": 1, "up": "w"}, "up: expected 'x', 'y' or 'z', got 'w'"),
            ({"spacing": 1, "octree": box()}, "octree: expected an Octree, a BruteForce or a RayScene, got Mesh"),
        ],
    )
    def test_bad_arguments_are_named(self, given, said):
        with pytest.raises(ValueError, match=f"^{said}"):
            grid_points(**{"octree": Octree.from_mesh(ROOF)} | given)


@pytest.mark.judges("studies.sample_points")
class TestSamplePoints:
    def test_numbers_of_points_are_binomial_by_area_and_places_uniform_within_a_face(self):
        """Faces of the areas 1, 8 and 0, and 15; six standard deviations off is less than 1 in 10^8."""
        corners = [[0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 5], [4, 0, 5], [0, 4, 5], [0, 0, 9], [6, 0, 9], [0, 5, 9]]
        mesh = Mesh(corners, [[0, 1, 2], [3, 4, 5], [3, 3, 4], [6, 7, 8]])
        n = 40_000
        points, normals, faces = sample_points(mesh, n, seed=3)
        share = np.array([1, 8, 0, 15]) / 24.0
        counts = np.bincount(faces, minlength=4)
        assert (np.abs(counts - n * share) <= 6.0 * np.sqrt(n * share * (1.0 - share))).all() and counts[2] == 0
        np.testing.assert_array_equal(normals, mesh.face_normals()[faces])
        # In coordinates of the face: uniform in the triangle u, v >= 0, u + v <= 1, of which each quarter is alike.
        first, size = mesh.vertices[mesh.faces[faces, 0]], np.array([[1, 2], [4, 4], [1, 1], [6, 5]])[faces]
        u, v = ((points - first)[:, :2] / size).T
        assert (u >= 0).all() and (v >= 0).all() and (u + v <= 1 + 1e-12).all()
        assert np.abs(points[:, 2] - first[:, 2]).max() == 0.0
        for quarter in (u > 0.5, v > 0.5, u + v < 0.5):
            assert abs(quarter.sum() - n / 4) <= 6.0 * np.sqrt(n * 3.0) / 4.0

    def test_a_seed_fixes_the_points(self):
        for part, other in zip(sample_points(icosphere(2), 99), sample_points(icosphere(2), 99, seed=0), strict=True):
            np.testing.assert_array_equal(part, other)
        assert (sample_points(icosphere(2), 99, seed=1).points != sample_points(icosphere(2), 99).points).any()

    def test_they_are_points_as_studies_take_them(self):
        for move, size in ((0.0, 1.0), (4e6, 50.0), (0.0, 1e-200), (0.0, 1e150)):
            mesh = Mesh(icosphere(2).vertices * size + move, icosphere(2).faces)
            places = sample_points(mesh, 500)
            assert isinstance(places, FacePoints) and places.faces.dtype == np.int64
            assert len(np.unique(places.faces)) > 200
        assert [len(part) for part in sample_points(icosphere(1), 0)] == [0, 0, 0]
        sphere = Octree.from_mesh(icosphere(3))
        points, normals, faces = sample_points(sphere.mesh, 2000)
        seen = sky_view_factor(sphere, points, normals, leaving=faces)
        # (1 + cos b) / 2 at all tilts b, but for the sky's 145 patches.
        np.testing.assert_allclose(seen, (1.0 + normals[:, 2]) / 2.0, atol=0.03)

    @cases(
        "given, said",
        [
            ({"mesh": Mesh([[0, 0, 0]], [[0, 0, 0]])}, "mesh: expected a face that has an area, got none"),
            ({"mesh": Mesh([], [])}, "mesh: expected a face that has an area, got none"),
            ({"mesh": Octree.from_mesh(box())}, "mesh: expected a renderer.Mesh, got Octree"),
            ({"count": -1}, "count: expected an integer >= 0, got -1"),
            ({"count": 1.5}, "count: expected an integer >= 0, got 1.5"),
            ({"seed": -1}, "seed: expected an integer >= 0, got -1"),
            ({"seed": None}, "seed: expected an integer >= 0, got None"),
        ],
    )
    def test_bad_arguments_are_named(self, given, said):
        with pytest.raises(ValueError, match=f"^{said}"):
            sample_points(**{"mesh": box(), "count": 3} | given)

"""The references for hits against analytic hits and against exact arithmetic."""

import numpy as np
import pytest

from renderer.shapes import icosphere
from validation import exact
from validation.rays import camera_rays, random_rays

pytest.importorskip("igl")
from validation.igl import Igl

TRIANGLE = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])


def test_igl_hits_a_triangle_where_geometry_says():
    t, face = Igl(TRIANGLE, [[0, 1, 2]]).closest_hit(
        [[0.25, 0.25, 1], [0.25, 0.25, -3], [2, 2, 1], [0.25, 0.25, 1]], [[0, 0, -2], [0, 0, 1], [0, 0, -2], [0, 0, 1]]
    )
    np.testing.assert_array_equal(t, [0.5, 3, np.inf, np.inf])
    np.testing.assert_array_equal(face, [0, 0, -1, -1])


def test_igl_takes_the_closest_of_two_faces():
    vertices = np.concatenate([TRIANGLE, TRIANGLE + np.array([0, 0, 0.5])])
    t, face = Igl(vertices, [[0, 1, 2], [3, 4, 5]]).closest_hit([[0.25, 0.25, 1]] * 2, [[0, 0, -1], [0, 0, -0.5]])
    np.testing.assert_array_equal(t, [0.5, 1.0])
    np.testing.assert_array_equal(face, [1, 1])


def test_igl_of_nothing_misses():
    t, face = Igl(np.empty((0, 3)), np.empty((0, 3))).closest_hit([[0, 0, 1]], [[0, 0, -1]])
    assert t.tolist() == [np.inf] and face.tolist() == [-1]


def test_igl_agrees_with_exact_arithmetic():
    mesh = icosphere(2)
    corners = mesh.vertices[mesh.faces]
    for rays in (camera_rays(mesh.vertices, 200), random_rays(corners, 200, np.random.default_rng(7))):
        t, face = Igl(mesh.vertices, mesh.faces).closest_hit(rays.origins, rays.directions)
        hits = exact.closest_hits(mesh.vertices, mesh.faces, rays.origins, rays.directions)
        assert [f >= 0 for f in face] == [hit is not None for hit in hits]
        assert sum(hit is not None for hit in hits) > 50
        for distance, name, hit in zip(t, face, hits, strict=True):
            if hit is not None:
                # One rounding to float32, and some ten of float64 enlarged by 1 / cos: 1e-12 allows cos = 1e-3.
                assert name in hit.faces_at_t and abs(distance - float(hit.t)) <= (2**-24 + 1e-12) * float(hit.t)

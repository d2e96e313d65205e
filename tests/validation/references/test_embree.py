"""The Embree adapter: units, miss values, casts, and that the robust flag reaches Embree."""

import numpy as np
import trimesh

from validation.hits import rays
from validation.references import embree

SQUARE = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 4.0, 0.0], [0.0, 4.0, 0.0]])
FACES = np.array([[0, 1, 2], [0, 2, 3]])


def test_any_hit_is_whether_there_is_a_closest_hit():
    rng = np.random.default_rng(2)
    vertices, faces = rng.random((90, 3)), np.arange(90).reshape(30, 3)
    scene = embree.Embree(vertices, faces)
    origins, directions = rng.random((500, 3)), rng.standard_normal((500, 3))
    hit = scene.any_hit(origins, directions)
    assert hit.dtype == np.bool_ and 0 < np.count_nonzero(hit) < 500
    assert np.array_equal(hit, scene.closest_hit(origins, directions)[1] >= 0)


def test_caller_may_change_its_arrays_afterwards():
    vertices = SQUARE.astype(np.float32)
    scene = embree.Embree(vertices, FACES.astype(np.int32))
    vertices += 100
    assert scene.any_hit([[3, 1, 2]], [[0, 0, -1]]).tolist() == [True]


def test_robust_mode_reaches_embree():
    ball = trimesh.creation.icosphere(3)
    vertices = rays.float32_exact(ball.vertices)
    batch = rays.vertex_rays(vertices[ball.faces], 4000, np.random.default_rng(4))
    inside = batch.select(np.linalg.norm(batch.origins, axis=1) < 0.5)
    leaks = {
        robust: np.count_nonzero(
            ~embree.Embree(vertices, ball.faces, robust).any_hit(inside.origins, inside.directions)
        )
        for robust in (True, False)
    }
    # Measured on 20,480 faces: 0.4 % of the rays leak in robust mode and 17 % without.
    assert leaks[False] > 5 * max(leaks[True], 1)

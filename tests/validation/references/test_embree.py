"""The Embree adapter: units, miss values, casts, and that the robust flag reaches Embree."""

import numpy as np
import trimesh

from validation.hits import rays
from validation.oracle import exact
from validation.references import embree

SQUARE = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 4.0, 0.0], [0.0, 4.0, 0.0]])
FACES = np.array([[0, 1, 2], [0, 2, 3]])


def test_t_counts_directions_and_a_miss_is_inf():
    t, face = embree.Embree(SQUARE, FACES).closest_hit(
        [[3, 1, 2], [1, 3, 2], [9, 9, 2], [3, 1, -2]], [[0, 0, -4], [0, 0, -0.5], [0, 0, -1], [0, 0, -1]]
    )
    assert t.dtype == np.float64 and face.dtype == np.int64
    # Embree divides by the processor's approximate reciprocal, of an error up to 1.5 x 2^-12, and one step of Newton's
    # method: its square, 2.25 x 2^-24, and at most three roundings of 2^-24. Some processors give 0.49999997.
    np.testing.assert_allclose(t, [0.5, 4.0, np.inf, np.inf], rtol=6 * 2.0**-24, atol=0)
    assert face.tolist() == [0, 1, -1, -1]


def test_any_hit_is_whether_there_is_a_closest_hit():
    rng = np.random.default_rng(2)
    vertices, faces = rng.random((90, 3)), np.arange(90).reshape(30, 3)
    scene = embree.Embree(vertices, faces)
    origins, directions = rng.random((500, 3)), rng.standard_normal((500, 3))
    hit = scene.any_hit(origins, directions)
    assert hit.dtype == np.bool_ and 0 < np.count_nonzero(hit) < 500
    assert np.array_equal(hit, scene.closest_hit(origins, directions)[1] >= 0)


def test_faces_and_t_are_those_of_exact_arithmetic():
    rng = np.random.default_rng(3)
    vertices, faces = rays.float32_exact(rng.random((60, 3))), np.arange(60).reshape(20, 3)
    batch = rays.random_rays(vertices[faces], 300, rng)
    t, face = embree.Embree(vertices, faces).closest_hit(batch.origins, batch.directions)
    expected = exact.closest_hits(vertices, faces, batch.origins, batch.directions)
    assert [-1 if hit is None else hit.face for hit in expected] == face.tolist()
    assert np.count_nonzero(face >= 0) > 150
    for found, hit in zip(t, expected, strict=True):
        # A thousand float32 roundings: random triangles and rays are seldom flatter than 1e-2.
        assert hit is None or abs(found - float(hit.t)) <= 1000 * 2.0**-24 * float(hit.t)


def test_input_is_rounded_to_float32():
    beyond = np.array([[4.0 + 1e-9, 1.0, 1.0]])
    assert exact.closest_hits(SQUARE, FACES, beyond, [[0, 0, -1]]) == [None]
    assert embree.Embree(SQUARE, FACES).any_hit(beyond, [[0, 0, -1]]).tolist() == [True]


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


def test_empty_mesh_and_empty_batch():
    empty = embree.Embree(SQUARE, np.empty((0, 3), int))
    assert empty.any_hit([[0, 0, 1]], [[0, 0, -1]]).tolist() == [False]
    t, face = empty.closest_hit([[0, 0, 1]], [[0, 0, -1]])
    assert t.tolist() == [np.inf] and face.tolist() == [-1]
    assert len(embree.Embree(SQUARE, FACES).closest_hit(np.empty((0, 3)), np.empty((0, 3)))[0]) == 0


def test_version_is_a_number():
    assert int(embree.version().split(".")[0]) >= 2

"""The references for hits, each behind one interface, against analytic hits and against exact arithmetic."""

import numpy as np
import pytest

from renderer.mesh.shapes import icosphere
from validation.hits.rays import float32_exact, random_rays
from validation.oracle import exact
from validation.references.table import REFERENCES, HitReference

TRIANGLE = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
FACE = np.array([[0, 1, 2]])
EACH = pytest.mark.parametrize("reference", REFERENCES, ids=lambda reference: reference.key)

# What an answer's t may lack of the exact one. Embree and Mitsuba: five float32 roundings enlarged by 1 / cos, which
# 1e-5 allows down to cos = 0.03. libigl: one rounding to float32. trimesh and ours: some ten of float64, 1e-13 / cos.
STORED = {"embree_robust": 1e-5, "embree_default": 1e-5, "igl": 1e-7, "mitsuba": 1e-5, "trimesh": 1e-11,
          "brute_force": 1e-11}  # fmt: skip

# The same where every number on the way is a short binary fraction and no angle enlarges anything. Embree, and Mitsuba
# by it, divide by the processor's approximate reciprocal, of an error up to 1.5 x 2^-12, and one step of Newton's
# method: its square, 2.25 x 2^-24, and at most three roundings of 2^-24. Some processors give 0.49999997 for 0.5.
SHORT = dict.fromkeys(STORED, 0.0) | dict.fromkeys(("embree_robust", "embree_default", "mitsuba"), 6 * 2.0**-24)


def test_every_reference_is_in_the_table_once() -> None:
    assert [reference.key for reference in REFERENCES] == list(STORED)
    assert len({reference.name for reference in REFERENCES}) == len(REFERENCES)
    assert all(reference.version[0].isdigit() for reference in REFERENCES)
    # Mitsuba answers as Embree does, so that no answer could tell them apart.
    made = [type(reference.make(TRIANGLE, FACE)).__name__ for reference in REFERENCES]
    assert made == ["Embree", "Embree", "Igl", "MitsubaHits", "TrimeshRays", "Brute"]


@EACH
def test_a_triangle_is_hit_where_geometry_says(reference: HitReference) -> None:
    origins = np.array([[0.25, 0.25, 1], [0.25, 0.25, -3], [2, 2, 1], [0.25, 0.25, 1]])
    directions = np.array([[0.0, 0, -2], [0, 0, 1], [0, 0, -2], [0, 0, 1]])
    t, face = reference.make(TRIANGLE, FACE).closest_hit(origins, directions)
    assert (t.dtype, face.dtype) == (np.float64, np.int64)
    np.testing.assert_allclose(t, [0.5, 3, np.inf, np.inf], rtol=SHORT[reference.key], atol=0)
    np.testing.assert_array_equal(face, [0, 0, -1, -1])


@EACH
def test_the_closest_of_two_faces_is_taken(reference: HitReference) -> None:
    vertices = np.concatenate([TRIANGLE, TRIANGLE + np.array([0, 0, 0.5])])
    caster = reference.make(vertices, np.array([[0, 1, 2], [3, 4, 5]]))
    t, face = caster.closest_hit(np.array([[0.25, 0.25, 1]] * 2), np.array([[0.0, 0, -1], [0, 0, -0.5]]))
    np.testing.assert_allclose(t, [0.5, 1.0], rtol=SHORT[reference.key], atol=0)
    np.testing.assert_array_equal(face, [1, 1])


@EACH
def test_nothing_is_missed_and_no_ray_is_no_answer(reference: HitReference) -> None:
    nothing = reference.make(np.empty((0, 3)), np.empty((0, 3), dtype=np.int64))
    t, face = nothing.closest_hit(np.array([[0.0, 0, 1]]), np.array([[0.0, 0, -1]]))
    assert t.tolist() == [np.inf] and face.tolist() == [-1]
    t, face = reference.make(TRIANGLE, FACE).closest_hit(np.empty((0, 3)), np.empty((0, 3)))
    assert t.shape == face.shape == (0,)


@EACH
def test_a_batch_that_meets_nothing_is_all_misses(reference: HitReference) -> None:
    """trimesh then returned points of no dimension, and its adapter failed."""
    t, face = reference.make(TRIANGLE, FACE).closest_hit(np.array([[5.0, 5, 1]] * 2), np.array([[0.0, 0, -1]] * 2))
    assert t.tolist() == [np.inf] * 2 and face.tolist() == [-1] * 2


@EACH
def test_it_agrees_with_exact_arithmetic(reference: HitReference) -> None:
    mesh = icosphere(2)
    vertices = float32_exact(mesh.vertices)
    rays = random_rays(vertices[mesh.faces], 200, np.random.default_rng(7))
    t, face = reference.make(vertices, mesh.faces).closest_hit(rays.origins, rays.directions)
    hits = exact.closest_hits(vertices, mesh.faces, rays.origins, rays.directions)
    assert [f >= 0 for f in face] == [hit is not None for hit in hits]
    found = [(distance, name, hit) for distance, name, hit in zip(t, face, hits, strict=True) if hit is not None]
    assert len(found) > 160
    for distance, name, hit in found:
        assert name in hit.faces_at_t and abs(distance - float(hit.t)) <= STORED[reference.key] * float(hit.t)


@EACH
def test_float32_references_round_the_mesh_and_no_other_does(reference: HitReference) -> None:
    mesh = icosphere(2)
    vertices = np.pi * mesh.vertices
    rays = random_rays(vertices[mesh.faces], 200, np.random.default_rng(8))
    t, _ = reference.make(vertices, mesh.faces).closest_hit(rays.origins, rays.directions)
    rounded, _ = reference.make(float32_exact(vertices), mesh.faces).closest_hit(rays.origins, rays.directions)
    assert np.array_equal(t, rounded) == (reference.precision == "float32")

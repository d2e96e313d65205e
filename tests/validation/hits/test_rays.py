"""Ray families: seeded, float32-exact, and aimed at what their names say."""

import numpy as np
import pytest
import trimesh
from cases import cases

from validation.hits import rays
from validation.oracle import exact

BALL = trimesh.creation.icosphere(2)
VERTICES = rays.float32_exact(BALL.vertices * [1.0, 2.0, 3.0] + [5.0, -1.0, 0.5])
FACES = BALL.faces.astype(np.int64)
CORNERS = VERTICES[FACES]
COUNT = 600
FAMILIES = {batch.name: batch for batch in rays.families(VERTICES, FACES, COUNT, seed=7)}


@cases("name", FAMILIES)
def test_float32_exact_finite_and_never_zero(name):
    batch = FAMILIES[name]
    for array in (batch.origins, batch.directions):
        assert array.shape == (COUNT // 4 if name == "on_surface" else COUNT, 3) and array.dtype == np.float64
        assert np.array_equal(array, array.astype(np.float32).astype(np.float64))
        assert np.isfinite(array).all()
    assert batch.directions.any(axis=1).all()


def test_a_seed_is_all_that_decides():
    again = rays.families(VERTICES, FACES, COUNT, seed=7)
    other = rays.families(VERTICES, FACES, COUNT, seed=8)
    for batch, same, different in zip(FAMILIES.values(), again, other, strict=True):
        assert np.array_equal(batch.origins, same.origins)
        assert np.array_equal(batch.directions, same.directions)
        if batch.name not in ("camera", "camera_squares"):
            assert not np.array_equal(batch.origins, different.origins)


def test_on_surface_rays_begin_on_a_face_and_half_run_along_it():
    batch = FAMILIES["on_surface"]
    at_vertex = (batch.origins[:, None] == VERTICES).all(axis=2).any(axis=1)
    assert (np.flatnonzero(at_vertex) == np.arange(0, len(batch), 3)).all()
    normals = np.cross(CORNERS[:, 1] - CORNERS[:, 0], CORNERS[:, 2] - CORNERS[:, 0])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    above = np.abs(((batch.origins[:, None] - CORNERS[:, 0]) * normals).sum(axis=2))
    # Half an ulp of float32 in each component, at lengths below 8.
    assert above.min(axis=1).max() < 8 * 2.0**-24 * np.sqrt(3)
    flat = np.abs(batch.directions @ normals.T).min(axis=1) < 1e-6
    assert flat[1::2].all() and flat[::2].mean() < 0.1
    hits = exact.closest_hits(VERTICES, FACES, batch.origins, batch.directions)
    assert all(hit is not None and hit.t == 0 for hit, begins in zip(hits, at_vertex, strict=True) if begins)


def line_distance(points, batch):
    """Distance of ``points`` (..., n, 3) from the n rays' lines."""
    return np.linalg.norm(np.cross(points - batch.origins, batch.directions), axis=-1) / np.linalg.norm(
        batch.directions, axis=-1
    )


def test_vertex_rays_pass_vertices_within_float32():
    batch = FAMILIES["vertex"]
    nearest = line_distance(VERTICES[:, None, :], batch).min(axis=0)
    # Half an ulp of float32 in each component, at lengths below 16.
    assert nearest.max() < 16 * 2.0**-24 * np.sqrt(3)
    assert line_distance(VERTICES[:, None, :], FAMILIES["edge"]).min(axis=0).max() > 1e-3


def test_no_ray_from_inside_leaves_a_closed_mesh():
    batch = FAMILIES["from_inside"]
    assert None not in exact.closest_hits(VERTICES, FACES, batch.origins, batch.directions)


def test_every_family_hits_and_some_miss():
    for name, batch in FAMILIES.items():
        hits = [hit is not None for hit in exact.closest_hits(VERTICES, FACES, batch.origins, batch.directions)]
        assert np.mean(hits) > 0.25, name
        assert name in ("from_inside", "edge", "vertex", "grazing", "on_surface") or not all(hits), name


@pytest.mark.parametrize("vertices", [np.ones((3, 3)), np.eye(3), np.eye(3) * 1e-30])
def test_tiny_meshes_give_usable_rays(vertices):
    for batch in rays.families(vertices, np.array([[0, 1, 2]]), 50, seed=1):
        assert np.isfinite(batch.origins).all() and np.isfinite(batch.directions).all()
        assert batch.directions.any(axis=1).all()


def test_leak_rays_meet_edges_and_vertices_as_well_as_float64_can():
    """Float32 directions would pass them at 1e-8 or more, where no float64 kernel ever leaks."""
    edge, vertex = rays.leak_rays(VERTICES, FACES, COUNT, seed=2)
    assert (edge.name, vertex.name) == ("edge_leak", "vertex_leak")
    # A few roundings at lengths below 16.
    assert line_distance(VERTICES[:, None, :], vertex).min(axis=0).max() < 16 * 8 * 2.0**-53
    start, stop = CORNERS.reshape(-1, 3), np.roll(CORNERS, -1, axis=1).reshape(-1, 3)
    normal = np.cross(start[:, None] - edge.origins, stop[:, None] - edge.origins)
    beside = np.abs((normal * edge.directions).sum(axis=2)) / np.linalg.norm(normal, axis=2)
    assert beside.min(axis=0).max() < 16 * 8 * 2.0**-53
    hits = exact.closest_hits(VERTICES, FACES, edge.origins, edge.directions)
    assert None not in hits

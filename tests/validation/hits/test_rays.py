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


def test_names():
    assert list(FAMILIES) == [
        "camera", "camera_squares", "random", "axis_parallel", "edge", "vertex", "grazing", "from_inside",
        "on_surface", "far_away",
    ]  # fmt: skip


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


def test_camera_sees_all_of_the_mesh_line_by_line():
    eye = FAMILIES["camera"].origins[0]
    assert (FAMILIES["camera"].origins == eye).all()
    directions = rays.camera_rays(VERTICES, 100 * 100).directions.reshape(100, 100, 3)
    # One pixel is (2 tan asin 1/3) / 100 = 7.1e-3 wide; neighbours in a line are at most that far apart.
    assert np.linalg.norm(np.diff(directions, axis=1), axis=2).max() < 7.2e-3
    forward = directions.mean(axis=(0, 1)) / np.linalg.norm(directions.mean(axis=(0, 1)))
    up = directions[0].mean(axis=0) - directions[-1].mean(axis=0)
    assert up[1] > 0

    def height(d):
        return d @ up / np.linalg.norm(up) / (d @ forward)

    assert height(VERTICES - eye).max() <= height(directions).max() + 7.1e-3
    assert height(VERTICES - eye).min() >= height(directions).min() - 7.1e-3


def test_camera_squares_are_the_camera_in_packets_of_16():
    eye = FAMILIES["camera"].origins[0]
    whole, lines = rays.camera_square_rays(VERTICES, 40 * 40), rays.camera_rays(VERTICES, 40 * 40)
    assert (whole.origins == eye).all()
    assert {tuple(d) for d in whole.directions.tolist()} == {tuple(d) for d in lines.directions.tolist()}
    squares = whole.directions.reshape(-1, 16, 3)
    # A pixel is (2 tan asin 1/3) / 40 = 1.77e-2 wide; the corners of a square are 3 of them apart each way.
    assert np.ptp(squares, axis=1).max() < 3 * 1.78e-2 * np.sqrt(2)
    assert np.ptp(lines.directions.reshape(-1, 16, 3), axis=1).max() > 0.15


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


def test_far_away_rays_cross_1e3_to_1e5_radii():
    batch = FAMILIES["far_away"]
    middle = (VERTICES.min(axis=0) + VERTICES.max(axis=0)) / 2
    radius = np.linalg.norm(VERTICES - middle, axis=1).max()
    radii = np.linalg.norm(batch.origins - middle, axis=1) / radius
    assert 0.99e3 < radii.min() < 2e3 and 5e4 < radii.max() < 1.01e5
    # They aim within the box; float32 turns them by 2^-24, which 1e5 radii away is 6e-3 radii.
    assert line_distance(middle, batch).max() < np.linalg.norm(np.ptp(VERTICES, axis=0)) / 2 + 1e-2 * radius


def test_axis_parallel_has_all_directions_and_zeros_of_both_signs():
    batch = FAMILIES["axis_parallel"]
    assert len({tuple(d) for d in batch.directions.tolist()}) == 6
    zeros = batch.directions == 0
    assert (zeros.sum(axis=1) == 2).all()
    assert 0.3 < np.signbit(batch.directions[zeros]).mean() < 0.7
    through = [
        ((o == VERTICES) | (d != 0)).all(axis=1).any() for o, d in zip(batch.origins, batch.directions, strict=True)
    ]
    assert 0.3 < np.mean(through) < 0.7


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


def test_edge_rays_end_on_edges():
    batch = FAMILIES["edge"]
    ends = batch.origins + batch.directions
    start, stop = CORNERS.reshape(-1, 3), np.roll(CORNERS, -1, axis=1).reshape(-1, 3)
    # A point of the edge splits its length in two parts.
    parts = np.linalg.norm(ends[:, None] - start, axis=2) + np.linalg.norm(ends[:, None] - stop, axis=2)
    assert (parts - np.linalg.norm(stop - start, axis=1)).min(axis=1).max() < 1e-5


def test_grazing_rays_are_flat_over_a_face():
    batch = FAMILIES["grazing"]
    normals = np.cross(CORNERS[:, 1] - CORNERS[:, 0], CORNERS[:, 2] - CORNERS[:, 0])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    hits = exact.closest_hits(VERTICES, FACES, batch.origins, batch.directions)
    faces = np.array([-1 if hit is None else hit.face for hit in hits])
    sine = np.abs((batch.directions * normals[faces]).sum(axis=1))[faces >= 0]
    assert (faces >= 0).mean() > 0.9
    assert np.median(sine) < 0.2


def test_no_ray_from_inside_leaves_a_closed_mesh():
    batch = FAMILIES["from_inside"]
    assert None not in exact.closest_hits(VERTICES, FACES, batch.origins, batch.directions)


def test_every_family_hits_and_some_miss():
    for name, batch in FAMILIES.items():
        hits = [hit is not None for hit in exact.closest_hits(VERTICES, FACES, batch.origins, batch.directions)]
        assert np.mean(hits) > 0.25, name
        assert name in ("from_inside", "edge", "vertex", "grazing", "on_surface") or not all(hits), name


def test_select():
    batch = FAMILIES["random"].select([3, 1])
    assert len(batch) == 2 and batch.name == "random"
    assert np.array_equal(batch.origins[1], FAMILIES["random"].origins[1])


@pytest.mark.parametrize("vertices", [np.ones((3, 3)), np.eye(3), np.eye(3) * 1e-30])
def test_tiny_meshes_give_usable_rays(vertices):
    for batch in rays.families(vertices, np.array([[0, 1, 2]]), 50, seed=1):
        assert np.isfinite(batch.origins).all() and np.isfinite(batch.directions).all()
        assert batch.directions.any(axis=1).all()


def test_a_mesh_without_faces_is_refused():
    with pytest.raises(ValueError, match="faces: expected at least one face"):
        rays.families(VERTICES, np.empty((0, 3), int), 10, seed=1)


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

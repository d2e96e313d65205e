"""Bounds of the errors of t: they hold against exact arithmetic, and are not far above what happens."""

from fractions import Fraction

import numpy as np
import pytest
from meshes import make_mesh, rays_at

from renderer import BruteForce, Mesh, Octree
from renderer.mesh.shapes import icosphere
from renderer.trace.batch import check_rays, moved_off
from validation.oracle import exact


def true_t(corners, origin, direction):
    """Where a ray meets a face's plane, None where it is parallel."""
    u, v, w, t = exact.determinants(corners, origin, direction)
    return t / (u + v + w) if u + v + w else None


def shares(octree, origins, directions, hits, rows):
    """The error of each hit as a share of its bound."""
    found = []
    for row, t, face, error in zip(rows, hits.t[hits.face >= 0], hits.face[hits.face >= 0],
                                   hits.t_error[hits.face >= 0], strict=True):  # fmt: skip
        true = true_t(octree.mesh.triangles[face], origins[row], directions[row])
        if true is not None:
            found.append(float(abs(Fraction(float(t)) - true)) / error)
    return np.array(found)


@pytest.mark.parametrize("scale", [1.0, 1e-3, 1e6])
@pytest.mark.parametrize("offset", [0.0, 1e5])
@pytest.mark.parametrize("kind", ["soup", "lattice", "slivers"])
def test_no_error_is_above_its_bound(kind, offset, scale):
    if kind == "slivers":
        ball = icosphere(2)
        vertices, faces = ball.vertices * [1.0, 1.0, 1e-7], ball.faces
    else:
        vertices, faces = make_mesh(kind, 3, 200)
    vertices = np.asarray(vertices) * scale + offset * scale
    origins, directions = rays_at(vertices, faces, 5, 120)
    octree = Octree(vertices, faces)
    hits = octree.closest_hit(origins, directions, t_error=True)
    got = shares(octree, origins, directions, hits, np.flatnonzero(hits.hit))
    assert len(got) > 40 and got.max() <= 1.0
    assert np.isnan(hits.t_error[~hits.hit]).all()
    every = octree.all_hits(origins, directions, t_error=True)
    assert shares(octree, origins, directions, every, every.ray).max() <= 1.0


def test_the_bound_is_close_enough_to_be_of_use():
    ball, rng = icosphere(3), np.random.default_rng(1)
    octree, directions = Octree.from_mesh(ball), rng.normal(size=(2000, 3))
    origins = rng.uniform(-0.5, 0.5, (2000, 3))
    hits = octree.closest_hit(origins, directions, t_error=True)
    got = shares(octree, origins, directions, hits, np.flatnonzero(hits.hit))
    # Roundings rarely all go one way: of some tens of them the root of that many.
    assert 1.0 >= got.max() > 1e-2 and np.median(hits.t_error / hits.t) < 1e-13


def test_rays_along_faces_have_bounds_as_long_as_the_face():
    octree = Octree([[0, 0, 0], [1, 0, 1e-17], [0, 1, 0]], [[0, 1, 2]])
    origins, directions = np.tile([-1.0, 0.25, 0.0], (50, 1)), np.tile([1.0, 0.0, 0.0], (50, 1))
    directions[:, 2] = np.linspace(-1e-17, 1e-17, 50)
    hits = octree.closest_hit(origins, directions, t_error=True)
    got = shares(octree, origins, directions, hits, np.flatnonzero(hits.hit))
    assert len(got) and got.max() <= 1.0
    assert (hits.t_error[hits.hit] < 1.001).all()


def test_dimensions_scales_and_brute_force():
    for scale in (1e-200, 1e200):
        mesh = Mesh(icosphere(1).vertices * scale, icosphere(1).faces)
        rays = np.zeros((2, 6, 3)), np.random.default_rng(0).normal(size=(2, 6, 3))
        hits, brute = (kind.from_mesh(mesh).closest_hit(*rays, t_error=True) for kind in (Octree, BruteForce))
        assert hits.t_error.shape == (2, 6) and (hits.t_error < 1e-13 * hits.t).all()
        np.testing.assert_array_equal(hits.t_error, brute.t_error)
    assert Octree.from_mesh(icosphere(1)).closest_hit([0, 0, 3], [0, 0, -1]).t_error is None
    with pytest.raises(ValueError, match="t_error: expected True or False, got 1"):
        Octree.from_mesh(icosphere(1)).closest_hit([0, 0, 3], [0, 0, -1], t_error=1)


def test_the_first_of_all_hits_has_the_bound_of_the_closest():
    octree, rng = Octree.from_mesh(icosphere(3)), np.random.default_rng(2)
    rays = 3 * rng.normal(size=(300, 3)), rng.normal(size=(300, 3))
    hits, every = octree.closest_hit(*rays, t_error=True), octree.all_hits(*rays, t_error=True)
    np.testing.assert_array_equal(every.t_error[every.offsets[:-1][hits.hit]], hits.t_error[hits.hit])


def test_of_rays_that_leave_faces_the_bound_is_that_of_the_moved_rays():
    octree = Octree.from_mesh(icosphere(3))
    starts, inward = octree.mesh.triangles.mean(axis=1), -octree.mesh.face_normals()
    faces = np.arange(len(starts))
    moved = moved_off(check_rays(starts, inward, 0.0, np.inf)[0], faces, octree.mesh, octree.tree.scale, 1)
    hits = octree.closest_hit(starts, inward, leaving=faces, t_error=True)
    again = octree.closest_hit(moved.origins, inward, t_error=True)
    assert hits.hit.all()
    np.testing.assert_array_equal(hits.t, again.t)
    np.testing.assert_array_equal(hits.t_error, again.t_error)


def test_rays_nearly_in_the_plane_of_a_face_that_they_meet_keep_their_bound():
    """Others, which only rounding makes hit, may meet the plane anywhere: they are not asked."""
    rng, met = np.random.default_rng(0), 0
    for _ in range(4):
        corners = rng.normal(size=(3, 3))
        sides = rng.normal(size=(100, 2)) @ (corners[1:] - corners[0])
        origins = rng.dirichlet([1, 1, 1], 100) @ corners - sides * rng.uniform(0.5, 3, (100, 1))
        hits = Octree(corners, [[0, 1, 2]]).closest_hit(origins, sides, t_error=True)
        for row in np.flatnonzero(hits.hit):
            u, v, w, t = exact.determinants(corners, origins[row], sides[row])
            if u + v + w and (min(u, v, w) >= 0 or max(u, v, w) <= 0):
                met += 1
                assert abs(Fraction(float(hits.t[row])) - t / (u + v + w)) <= hits.t_error[row]
    assert met > 10

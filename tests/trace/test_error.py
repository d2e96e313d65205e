"""Bounds of the errors of t: they hold against exact arithmetic, and are not far above what happens."""

from fractions import Fraction

import numpy as np
import pytest
from cases import cases
from meshes import make_mesh, rays_at

from renderer import BruteForce, Mesh, Octree
from renderer.mesh.shapes import icosphere
from validation.oracle import exact
from validation.oracle.starts import start_near
from validation.oracle.vectors import cross, difference, dot, whole

pytestmark = pytest.mark.judges("AllHits", "Hits", "Octree.closest_hit")


def true_t(corners, origin, direction):
    """Where a ray meets a face's plane, None where it is parallel."""
    (o, a, b, c), place = whole([origin, *corners])
    (d,), way = whole([direction])
    normal = cross(difference(b, a), difference(c, a))
    slope = dot(normal, d) * place
    return Fraction(dot(normal, difference(a, o)) * way, slope) if slope else None


def shares(octree, origins, directions, hits, rows):
    """The error of each hit as a share of its bound."""
    found, hit = [], hits.face >= 0
    columns = octree.mesh.triangles[hits.face[hit]], origins[rows], directions[rows], hits.t[hit], hits.t_error[hit]
    for corners, origin, direction, t, error in zip(*(column.tolist() for column in columns), strict=True):
        true = true_t(corners, origin, direction)
        if true is not None:
            found.append(float(abs(Fraction(t) - true)) / error)
    return np.array(found)


@cases("scale", [1.0, 1e-3, 1e6])
@cases("offset", [0.0, 1e5])
@cases("kind", ["soup", "lattice", "slivers"])
def test_no_error_is_above_its_bound(kind, offset, scale):
    if kind == "slivers":
        ball = icosphere(2)
        vertices, faces = ball.vertices * [1.0, 1.0, 1e-7], ball.faces
    else:
        vertices, faces = make_mesh(kind, 3, 200)
    vertices = np.asarray(vertices) * scale + offset * scale
    origins, directions = rays_at(vertices, faces, 5, 50)
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
    assert 1.0 >= got.max() > 1e-2
    assert np.median(hits.t_error / hits.t) < 2.0**-53 and (hits.t_error / hits.t).max() < 1e-13


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


def test_of_rays_that_leave_faces_the_bound_holds_for_t_from_the_exact_start():
    octree = Octree.from_mesh(icosphere(3))
    starts, inward = octree.mesh.triangles.mean(axis=1), -octree.mesh.face_normals()
    hits = octree.closest_hit(starts, inward, leaving=np.arange(len(starts)), t_error=True)
    assert hits.hit.all() and (hits.t_error < 1e-12).all()
    for row in range(0, len(starts), 7):
        place, way = start_near(octree.mesh.triangles[row], starts[row]), [Fraction(x) for x in inward[row].tolist()]
        a, b, c = ([Fraction(x) for x in corner] for corner in octree.mesh.triangles[hits.face[row]].tolist())
        normal = cross(difference(b, a), difference(c, a))
        t = dot(normal, difference(a, place)) / dot(normal, way)
        assert abs(Fraction(float(hits.t[row])) - t) <= Fraction(float(hits.t_error[row]))


def beyond(corners, origins, directions, hits):
    """The hits of one face that the rays truly meet, how many, and those whose error is above its bound."""
    true, bad = 0, []
    for row in np.flatnonzero(hits.hit):
        u, v, w, t = exact.determinants(corners, origins[row], directions[row])
        if u + v + w and (min(u, v, w) >= 0 or max(u, v, w) <= 0):
            true += 1
            if abs(Fraction(float(hits.t[row])) - t / (u + v + w)) > Fraction(float(hits.t_error[row])):
                bad.append(row)
    return true, bad


def test_a_thin_face_beside_the_origin_keeps_its_bound():
    """Its corners lie nearly on a line: t is where the ray passes that."""
    x = 2.0 - 2.0**-52
    corners = np.array([[x, 1.0, 1.7718420639801147e-16], [x, -3.0, 1.9856703294737333e-16],
                        [x, 3.0000000000000004, 1.1442054575516365e-16]])  # fmt: skip
    origins = np.array([[2.0, 0.08225127259094289, 1.795271539908219e-16]])
    directions = np.array([[-1.0, 0.04995784811157619, -4.221545383335261e-17]])
    hits = Octree(corners, [[0, 1, 2]]).closest_hit(origins, directions, t_error=True)
    assert beyond(corners, origins, directions, hits) == (1, [])
    assert hits.t_error[0] < 1e-17


@pytest.mark.parametrize("seed", range(3))
def test_of_thin_faces_that_rays_meet_no_error_is_above_its_bound(seed):
    rng, met = np.random.default_rng(seed), 0
    for _ in range(60):
        lattice = rng.integers(-3, 4, 3) + rng.integers(-4, 5, (3, 3)) * np.array([0, 1, 0])
        corners = lattice + rng.normal(size=(3, 3)) * 10.0 ** rng.uniform(-18, -9, 3)
        corners = corners[:, rng.permutation(3)]
        directions = rng.normal(size=(24, 3))
        directions[::2] = np.sign(directions[::2]) * 10.0 ** rng.uniform(-17, 0, (12, 3))
        origins = rng.dirichlet([1, 1, 1], 24) @ corners - directions * 10.0 ** rng.uniform(-17, 0, (24, 1))
        hits = Octree(corners, [[0, 1, 2]]).closest_hit(origins, directions, t_error=True)
        true, bad = beyond(corners, origins, directions, hits)
        met += true
        assert not bad, (corners.tolist(), origins[bad[0]].tolist(), directions[bad[0]].tolist())
    assert met > 400


@pytest.mark.parametrize("power", [0, 20, 400])
def test_flat_faces_at_the_origin_keep_their_bound(power):
    """Flat to 1e-42 and 1e-88: the products that make t are as small as what rounding leaves of others."""
    corners = [["0x1.6445eb5cda050p-292", "0x1.e547c881b97dap-1", "-0x1.7063d37fb7f76p-141"],
               ["-0x1.4a6856c538834p-292", "-0x1.e23380eeac032p-1", "0x1.bcbb596088c98p-141"],
               ["-0x1.7b4f5c433b52ap-291", "-0x1.b025b2e181240p-3", "-0x1.fa655b377b3d4p-142"]]  # fmt: skip
    origin = ["0x1.5c8d64d57cf04p-291", "0x1.544b8d1014f76p-1", "-0x1.bf26df3ee6f3ep-141"]
    direction = ["-0x1.e4f393d8ed082p-291", "-0x1.1c0ac6de7a641p-1", "0x1.0884a5488af7cp-142"]
    rows = np.array([[float.fromhex(x) for x in row] for row in (*corners, origin, direction)])
    corners, origins, directions = rows[:3] * 2.0**power, rows[3:4] * 2.0**power, rows[4:]
    hits = Octree(corners, [[0, 1, 2]]).closest_hit(origins, directions, t_error=True)
    assert beyond(corners, origins, directions, hits) == (1, [])


@cases("scale", [2.0**-500, 1.0, 2.0**500])
@cases("height", [5e-324, 3e-320, 4.5e-309])
@cases("length", [1.0, 3.0, 7e199, 1e-9])
def test_a_denormal_t_has_a_bound(scale, height, length):
    octree = Octree(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]) * scale, [[0, 1, 2]])
    hits = octree.closest_hit([0.25 * scale, 0.25 * scale, height], [0.0, 0.0, -length], t_error=True)
    assert hits.hit
    assert hits.t_error >= abs(Fraction(float(hits.t)) - Fraction(height) / Fraction(length))
    assert hits.t_error > 0.0


def test_threads_and_rows_for_all_change_no_bound():
    ball, rng = icosphere(2), np.random.default_rng(4)
    one, two = Octree.from_mesh(ball, threads=1), Octree.from_mesh(ball, threads=2)
    directions = rng.normal(size=(20_000, 3))
    eyes = np.tile([0.1, 0.2, 0.3], (20_000, 1))
    bounds = one.closest_hit(eyes, directions, t_error=True).t_error
    np.testing.assert_array_equal(two.closest_hit(eyes, directions, t_error=True).t_error, bounds)
    np.testing.assert_array_equal(two.closest_hit(eyes[0], directions, t_error=True).t_error, bounds)
    np.testing.assert_array_equal(two.all_hits(eyes[0], directions, t_error=True).t_error, bounds)
    alone = one.closest_hit(eyes, directions[0], t_error=True).t_error
    assert (alone == bounds[0]).all()


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

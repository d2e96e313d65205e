"""Faces of no area, or hardly any: a closed mesh that has them does not leak, and what is hit there is finite."""

import warnings

import numpy as np
import pytest
from cases import cases

from renderer import (
    BruteForce,
    Dielectric,
    Mesh,
    Mirror,
    Octree,
    PerspectiveCamera,
    Phong,
    PointLight,
    Scene,
    SceneObject,
    render,
)
from renderer.mesh.shapes import icosphere
from validation.stability.cases.thin import BESIDE, SHORT, at_the_needle, at_the_side, needle, split_side


@cases("beside", BESIDE)
@cases("turned", [False, True])
def test_no_ray_from_within_is_lost_at_a_split_side(beside, turned):
    mesh, rays = split_side(beside), at_the_side(20_000)
    origins, directions = rays.origins, rays.directions
    if turned:  # no coordinate is 0, and the corner lies beside its side by rounding alone
        turn, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))
        mesh = Mesh(mesh.vertices @ turn.T + 10.0, mesh.faces)
        origins, directions = origins @ turn.T + 10.0, directions @ turn.T
    assert mesh.is_closed()
    for accelerator in (Octree.from_mesh(mesh), BruteForce.from_mesh(mesh), Octree.from_mesh(mesh, split="sah")):
        hits = accelerator.closest_hit(origins, directions)
        assert hits.hit.all() and accelerator.any_hit(origins, directions).all()
        np.testing.assert_allclose(hits.t, 1.0, rtol=0, atol=1e-8)
        np.testing.assert_allclose(hits.points, origins + hits.t[:, None] * directions, rtol=0, atol=1e-8)
        few = [accelerator.closest_hit(origins[i : i + 5], directions[i : i + 5]).t for i in range(0, 500, 5)]
        np.testing.assert_array_equal(np.concatenate(few), hits.t[:500])


@cases("short", SHORT)
@cases("turned", [False, True])
def test_no_ray_from_within_is_lost_at_the_short_side_of_a_needle(short, turned):
    """A needle that is taken for a line was met where the line passes, not where its end does."""
    mesh, rays = needle(short), at_the_needle(short, 20_000)
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0] if turned else np.eye(3)
    mesh, origins, directions = (
        Mesh(mesh.vertices @ turn.T, mesh.faces),
        rays.origins @ turn.T,
        rays.directions @ turn.T,
    )
    for accelerator in (Octree.from_mesh(mesh), BruteForce.from_mesh(mesh)):
        assert accelerator.closest_hit(origins, directions).hit.all()
        assert accelerator.any_hit(origins, directions).all()


def test_the_barycentrics_of_a_needle_name_the_place_at_its_short_side():
    """Of the ends of its long sides rounding had made any corner: 0.8 off at a width of 2^-26."""
    rng = np.random.default_rng(2)
    for width in (2.0**-22, 2.0**-26, 2.0**-30):
        turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        corners = np.array([[0.0, 0.0, 0.0], [width, 0.0, 0.0], [0.0, 1.0, 0.0]]) @ turn.T
        shares = np.array([0.9, 0.05, 0.05]) + rng.uniform(-0.04, 0.04, (500, 1)) * [1.0, -1.0, 0.0]
        shares[:, 2], shares[:, 0] = 2.0**-45, shares[:, 0] + 0.05 - 2.0**-45
        directions = rng.normal(size=(500, 3))
        hits = Octree(corners, [[0, 1, 2]]).closest_hit(shares @ corners - directions, directions)
        u = shares[hits.hit, 1]
        assert len(u) > 400
        np.testing.assert_allclose(hits.u[hits.hit], u, rtol=0, atol=1e-2)


@cases("seed", range(6))
def test_spheres_rounded_until_faces_collapse_do_not_leak(seed):
    rng = np.random.default_rng(seed)
    centre = rng.normal(size=3) * 2.0**17
    ball = icosphere(3)
    vertices = (ball.vertices * rng.uniform(0.5, 2.0, 3) + centre).astype(np.float32).astype(np.float64)
    mesh = Mesh(vertices, ball.faces)
    corners = mesh.triangles
    # At edges and corners, where rounding may open a slit; the origin is within by far.
    share = rng.random((len(mesh.faces), 3, 1))
    targets = np.concatenate([(corners * share + np.roll(corners, 1, 1) * (1 - share)).reshape(-1, 3), mesh.vertices])
    origins = np.broadcast_to(mesh.vertices.mean(axis=0), targets.shape)
    octree = Octree.from_mesh(mesh)
    hits = octree.closest_hit(origins, targets - origins)
    assert hits.hit.all()
    brute = BruteForce.from_mesh(mesh).closest_hit(origins, targets - origins)
    np.testing.assert_array_equal(hits.t, brute.t)
    np.testing.assert_array_equal(hits.face, brute.face)


def test_a_ray_leaves_a_face_of_no_area():
    mesh, rays = split_side(0.0), at_the_side(20_000)
    octree = Octree.from_mesh(mesh)
    hits = octree.closest_hit(rays.origins, rays.directions)
    thin = hits.face == 5
    assert thin.sum() > 1000
    # Outwards, away from all faces.
    outwards = np.random.default_rng(1).normal(size=(len(rays), 3)) * 0.1 + [1.0, -1.0, 1.0]
    assert not octree.any_hit(hits.points[thin], outwards[thin], leaving=hits.face[thin]).any()


@cases("beside", [0.0, 1e-17, 1e-16, 1e-15, 3e-15, 1e-14, 5e-14, 1e-12, 1e-9, 1e-6])
def test_a_ray_leaves_a_face_however_thin_in_whatever_direction(beside):
    """The start had stayed within rounding of the face, because the normal pointed along it."""
    rng = np.random.default_rng(4)
    for size in 10.0 ** rng.uniform(-30, 30, 10):
        turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [rng.random(), beside, 0.0]]) @ turn.T * size
        starts = np.concatenate([rng.dirichlet([0.4] * 3, 900), np.repeat(np.eye(3), 34, axis=0)]) @ corners
        directions = rng.normal(size=starts.shape)
        # Half of them nearly along the face.
        directions[::2] = directions[::2] * 10.0 ** rng.uniform(-14, 0, (501, 1)) + (corners[1] - corners[0]) / size
        octree = Octree(corners, [[0, 1, 2]])
        assert not octree.any_hit(starts, directions, leaving=0).any()


@pytest.mark.parametrize("material", [Phong(diffuse=0.5, specular=0.3), Mirror(), Dielectric(ior=1.5)])
def test_a_picture_of_a_face_of_no_area_is_finite_and_has_no_hole(material):
    """Tiny fields of view, because wider ones would need luck to meet it."""
    scene = Scene(
        camera=PerspectiveCamera(eye=(4.0, -2.0, 4.0), target=(2.5, 0.0, 1.5)),
        materials={"its": material},
        lights=[PointLight(position=(5.0, -5.0, 5.0), intensity=100.0)],
        objects=[SceneObject(mesh=split_side(0.0), material="its")],
        background=(0.25, 0.5, 1.0),
    )
    met, rng = 0, np.random.default_rng(5)
    for share in rng.random(30):
        target = (4.0 * share, 0.0, 4.0 * (1.0 - share))
        camera = PerspectiveCamera(eye=tuple(rng.uniform((4, -3, 4), (6, -2, 6))), target=target, fov=1e-13)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            image = render(scene, camera=camera, resolution=(16, 16), max_depth=4)
        met += int((image.face == 5).sum())
        assert (image.face >= 0).all()
        assert np.isfinite(image.radiance).all() and np.isfinite(image.normal).all()
        np.testing.assert_allclose(np.linalg.norm(image.normal, axis=-1), 1.0, atol=1e-6)
    assert met > 0

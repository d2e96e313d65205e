"""Points to pixels and back, for every kind of camera."""

from typing import Any

import numpy as np
import pytest
from cases import cases

from renderer import (
    EquirectangularCamera,
    FisheyeCamera,
    Octree,
    OpenCVCamera,
    OpenCVFisheyeCamera,
    OrthographicCamera,
    PerspectiveCamera,
    PinholeCamera,
    ThinLensCamera,
    shapes,
)
from renderer.studies import depth_map

pytestmark = pytest.mark.judges(
    "EquirectangularCamera.film_size", "EquirectangularCamera.frame", "EquirectangularCamera.primary_rays",
    "EquirectangularCamera.project", "EquirectangularCamera.rays", "FisheyeCamera.film_size", "FisheyeCamera.frame",
    "FisheyeCamera.primary_rays", "FisheyeCamera.project", "FisheyeCamera.rays", "OpenCVCamera.film_size",
    "OpenCVCamera.frame", "OpenCVCamera.primary_rays", "OpenCVCamera.project", "OpenCVCamera.rays",
    "OpenCVFisheyeCamera.film_size",
    "OpenCVFisheyeCamera.frame", "OpenCVFisheyeCamera.primary_rays", "OpenCVFisheyeCamera.project",
    "OpenCVFisheyeCamera.rays", "OrthographicCamera.film_size", "OrthographicCamera.frame",
    "OrthographicCamera.primary_rays", "OrthographicCamera.project", "OrthographicCamera.rays",
    "PerspectiveCamera.film_size", "PerspectiveCamera.frame", "PerspectiveCamera.primary_rays",
    "PerspectiveCamera.project", "PerspectiveCamera.rays", "PinholeCamera.film_size", "PinholeCamera.frame",
    "PinholeCamera.primary_rays", "PinholeCamera.project", "PinholeCamera.rays", "ThinLensCamera.film_size",
    "ThinLensCamera.frame", "ThinLensCamera.primary_rays", "ThinLensCamera.project", "ThinLensCamera.rays",
    "ThinLensCamera.rows",
)  # fmt: skip

SIZE = (64, 48)
PLACE: dict[str, Any] = {"eye": (1.0, 2.0, 4.0), "target": (0.3, 0.1, -0.2), "up": (0.1, 1.0, 0.2)}
CAMERAS = [
    PerspectiveCamera(**PLACE, fov=60),
    OrthographicCamera(**PLACE, height=3.0),
    PinholeCamera(**PLACE, width=64, height=48, fx=50.0, fy=45.0, cx=20.5, cy=30.0, skew=4.0),
    ThinLensCamera(**PLACE, fov=60, aperture=0.5),
    EquirectangularCamera(**PLACE),
    FisheyeCamera(**PLACE, fov=330),
    OpenCVCamera(
        **PLACE, width=64, height=48, fx=50.0, fy=45.0, cx=20.5, skew=4.0, k1=-0.2, k2=0.05, p1=0.01, p2=-0.02
    ),
    OpenCVFisheyeCamera(**PLACE, width=64, height=48, fx=25.0, fy=22.0, cx=30.5, skew=1.0, k1=0.05, k2=-0.002),
]
AROUND = [camera for camera in CAMERAS if camera.type in ("equirectangular", "fisheye", "opencv_fisheye")]


@cases("camera", CAMERAS)
def test_a_point_on_a_ray_falls_on_its_pixel(camera: Any) -> None:
    rng = np.random.default_rng(5)
    pixels, away = rng.uniform(0, SIZE, (40, 5, 2)), rng.uniform(0.5, 9.0, (40, 5))
    origins, directions = camera.rays(pixels, SIZE)
    shown = ~np.isnan(directions).any(axis=-1)
    assert shown.mean() > 0.5
    np.testing.assert_array_equal(shown, ~np.isnan(directions[..., 0]))
    pixels, away, origins, directions = pixels[shown], away[shown], origins[shown], directions[shown]
    np.testing.assert_allclose(np.linalg.norm(directions, axis=-1), 1.0, rtol=1e-15)
    points = origins + away[..., None] * directions
    found, distance = camera.project(points, SIZE)
    # Roundings of coordinates up to 8, seen from half a unit away.
    np.testing.assert_allclose(found, pixels, atol=1e-11)
    np.testing.assert_allclose(distance, away, rtol=1e-13)
    z = camera.project(points, SIZE, depth="z")[1]
    np.testing.assert_allclose(z, (points - camera.eye) @ camera.frame()[2], atol=1e-13)


def test_pixels_and_depths_have_the_dimensions_of_the_points() -> None:
    for shape in ((), (4,), (2, 0), (3, 1, 2)):
        pixels, depths = CAMERAS[0].project(np.zeros((*shape, 3)), SIZE)
        assert pixels.shape == (*shape, 2) and depths.shape == shape


@cases("camera", AROUND)
def test_the_eye_and_what_the_film_does_not_show_have_no_pixel(camera: Any) -> None:
    right, _, forward = camera.frame()
    pixels, depths = camera.project([camera.eye, camera.eye - forward + 0.1 * right, camera.eye + forward], SIZE)
    assert np.isnan(pixels[0]).all() and np.isnan(depths[0])
    # Six degrees from straight behind, which a fish-eye of 330 degrees does not see.
    assert np.isnan(pixels[1]).all() == (camera.type == "fisheye")
    middle = (30.5, 24.0) if camera.type == "opencv_fisheye" else (32.0, 24.0)
    np.testing.assert_allclose(pixels[2], middle, atol=1e-12)
    assert depths[2] == pytest.approx(1.0)


@cases("camera", [camera for camera in CAMERAS if camera not in AROUND])
def test_what_is_behind_has_no_pixel_and_what_is_outside_has_one(camera: Any) -> None:
    right, _, forward = camera.frame()
    behind, outside = np.asarray(camera.eye) - forward, np.asarray(camera.eye) + forward + 9.0 * right
    pixels, depths = camera.project([behind, outside], SIZE)
    assert np.isnan(pixels[0]).all() and np.isnan(depths[0])
    assert pixels[1, 0] > SIZE[0] and depths[1] > 0


@cases("camera", CAMERAS)
def test_vertices_that_are_seen_lie_at_the_depth_of_their_pixels(camera: Any) -> None:
    ball = shapes.icosphere(4)
    # Where a picture is of nearly all around, the ball is small in it.
    octree, size = Octree.from_mesh(ball), (1024, 768) if camera.type in ("equirectangular", "fisheye") else (512, 384)
    pixels, depths = camera.project(ball.vertices, size)
    column, row = pixels.astype(int).T
    inside = (pixels >= 0).all(axis=1) & (column < size[0]) & (row < size[1])
    assert inside.mean() > 0.9
    origins, _ = camera.rays(pixels, size)
    facing = ((ball.vertices - origins) * ball.vertices).sum(axis=1) / depths < -0.5
    seen = depth_map(octree, camera, *size)[row[inside], column[inside]]
    near = np.abs(seen - depths[inside]) < 0.05
    np.testing.assert_array_equal(near[facing[inside]], True)
    assert not near[~facing[inside] & (seen < depths[inside] - 0.1)].any()


@cases(
    ("ask", "said"),
    [
        (lambda c: c.project([0, 0], SIZE), r"points: expected shape \(..., 3\), got shape \(2,\)"),
        (lambda c: c.project([0, 0, np.nan], SIZE), "points: expected finite numbers"),
        (lambda c: c.project([0, 0, 0]), "resolution: expected one or two integers above 0, got None"),
        (lambda c: c.project([0, 0, 0], (4, 0)), "resolution: expected one or two integers above 0"),
        (lambda c: c.project([0, 0, 0], SIZE, depth="t"), "depth: expected 'distance' or 'z', got 't'"),
        (lambda c: c.rays([0, 0, 0], SIZE), r"pixels: expected shape \(..., 2\), got shape \(3,\)"),
        (lambda c: c.rays([0, np.inf], SIZE), "pixels: expected finite numbers"),
    ],
)
def test_bad_arguments_are_named(ask: Any, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        ask(CAMERAS[0])

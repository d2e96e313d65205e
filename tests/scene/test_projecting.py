"""Points to pixels and back, for every kind of camera."""

from typing import Any

import numpy as np
import pytest
from cases import cases

from renderer import Octree, OrthographicCamera, PerspectiveCamera, PinholeCamera, shapes
from renderer.studies import depth_map

KINDS = ("OrthographicCamera", "PerspectiveCamera", "PinholeCamera")
pytestmark = pytest.mark.judges(
    *(f"{kind}.{member}" for kind in KINDS for member in ("project", "rays")),
    "OrthographicCamera.film_size", "PerspectiveCamera.film_size",
)  # fmt: skip

SIZE = (64, 48)
PLACE: dict[str, Any] = {"eye": (1.0, 2.0, 4.0), "target": (0.3, 0.1, -0.2), "up": (0.1, 1.0, 0.2)}
CAMERAS = [
    PerspectiveCamera(**PLACE, fov=60),
    OrthographicCamera(**PLACE, height=3.0),
    PinholeCamera(**PLACE, width=64, height=48, fx=50.0, fy=45.0, cx=20.5, cy=30.0, skew=4.0),
]


@cases("camera", CAMERAS)
def test_a_point_on_a_ray_falls_on_its_pixel(camera: Any) -> None:
    rng = np.random.default_rng(5)
    pixels, away = rng.uniform(0, SIZE, (40, 5, 2)), rng.uniform(0.5, 9.0, (40, 5))
    origins, directions = camera.rays(pixels, SIZE)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=-1), 1.0, rtol=1e-15)
    points = origins + away[..., None] * directions
    found, distance = camera.project(points, SIZE)
    assert found.shape == (40, 5, 2) and distance.shape == (40, 5)
    # Roundings of coordinates up to 8, seen from half a unit away.
    np.testing.assert_allclose(found, pixels, atol=1e-11)
    np.testing.assert_allclose(distance, away, rtol=1e-13)
    z = camera.project(points, SIZE, depth="z")[1]
    np.testing.assert_allclose(z, (points - camera.eye) @ camera.frame()[2], atol=1e-13)


@cases("camera", CAMERAS)
def test_what_is_behind_has_no_pixel_and_what_is_outside_has_one(camera: Any) -> None:
    right, _, forward = camera.frame()
    behind, outside = np.asarray(camera.eye) - forward, np.asarray(camera.eye) + forward + 9.0 * right
    pixels, depths = camera.project([behind, outside], SIZE)
    assert np.isnan(pixels[0]).all() and np.isnan(depths[0])
    assert pixels[1, 0] > SIZE[0] and depths[1] > 0


@cases("camera", CAMERAS)
def test_vertices_that_are_seen_lie_at_the_depth_of_their_pixels(camera: Any) -> None:
    ball = shapes.icosphere(4)
    octree, size = Octree.from_mesh(ball), (1024, 768)
    pixels, depths = camera.project(ball.vertices, size)
    column, row = pixels.astype(int).T
    inside = (pixels >= 0).all(axis=1) & (column < size[0]) & (row < size[1])
    assert inside.mean() > 0.9
    origins, _ = camera.rays(pixels, size)
    facing = ((ball.vertices - origins) * ball.vertices).sum(axis=1) / depths < -0.5
    seen = depth_map(octree, camera, *size)[row[inside], column[inside]]
    near = np.abs(seen - depths[inside]) < 0.02
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

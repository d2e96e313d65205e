"""Calibrated pinhole cameras against the projection of OpenCV's documentation in rational arithmetic."""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from cases import cases

from renderer import PerspectiveCamera, Phong, PinholeCamera, Scene, SceneObject, render, shapes

pytestmark = pytest.mark.judges(
    "PinholeCamera", "PinholeCamera.film_size", "PinholeCamera.frame", "PinholeCamera.from_opencv",
    "PinholeCamera.primary_rays", "PinholeCamera.rows", "scene.camera.pinhole.cx", "scene.camera.pinhole.cy",
    "scene.camera.pinhole.eye", "scene.camera.pinhole.fx", "scene.camera.pinhole.fy", "scene.camera.pinhole.height",
    "scene.camera.pinhole.skew", "scene.camera.pinhole.target", "scene.camera.pinhole.type", "scene.camera.pinhole.up",
    "scene.camera.pinhole.width",
)  # fmt: skip

FILM: dict[str, Any] = {"width": 640, "height": 480, "fx": 500.0, "fy": 520.0}
PLACE: dict[str, Any] = {"eye": (0, 0, 5), "target": (0, 0, 0)}
# Some sixty roundings of numbers up to 4096.
ROUNDED = 2.0**-53 * 2.0**12 * 2.0**6


def turn_of(a: int, b: int, c: int, d: int) -> list[list[Fraction]]:
    """The rotation of an integer quaternion, exactly."""
    n = a * a + b * b + c * c + d * d
    rows = [
        [a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)],
        [2 * (b * c + a * d), a * a - b * b + c * c - d * d, 2 * (c * d - a * b)],
        [2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d],
    ]
    return [[Fraction(x, n) for x in row] for row in rows]


def projected(K: Any, R: Any, t: Any, point: Any) -> tuple[float, float, float]:
    """s [u v 1] = K [R|t] [X Y Z 1]: u, v and the depth s, with s <= 0 behind the camera."""
    x, y, s = (sum(r * p for r, p in zip(row, point, strict=True)) + move for row, move in zip(R, t, strict=True))
    if s <= 0:
        return np.nan, np.nan, float(s)
    return float(K[0][0] * x / s + K[0][1] * y / s + K[0][2]), float(K[1][1] * y / s + K[1][2]), float(s)


@cases("seed", range(20))
def test_points_fall_where_opencvs_formula_has_them(seed: int) -> None:
    rng = np.random.default_rng(seed)
    R, t = turn_of(*rng.integers(-5, 6, 3).tolist(), 2), rng.integers(-9, 10, 3).tolist()
    fx, fy = (Fraction(int(f), 8) for f in rng.integers(2000, 8000, 2))
    K = [[fx, Fraction(int(rng.integers(-80, 80)), 16), Fraction(5001, 16)], [0, fy, Fraction(3777, 16)], [0, 0, 1]]
    points = rng.integers(-20, 21, (200, 3))
    floats = (np.array([[float(x) for x in row] for row in matrix]) for matrix in (K, R))
    pixels, z = PinholeCamera.from_opencv(*floats, t, width=640, height=480).project(points, depth="z")
    expected = np.array([projected(K, R, t, point) for point in points.tolist()])
    # Others lie so far outside the film, or so near the plane of the eye, that roundings grow.
    near = ~(np.abs(expected[:, :2]) > 4096).any(axis=1) & (np.abs(expected[:, 2]) >= 1)
    assert near.sum() > 100
    np.testing.assert_array_equal(np.isnan(z[near]), expected[near, 2] < 0)
    near &= expected[:, 2] > 0
    # OpenCV counts from the centre of the first pixel.
    np.testing.assert_allclose(pixels[near] - 0.5, expected[near, :2], rtol=0, atol=ROUNDED)
    np.testing.assert_allclose(z[near], expected[near, 2], rtol=1e-14, atol=1e-14)


def test_a_rotation_vector_turns_by_its_length_about_itself() -> None:
    K, film = [[500, 0, 319.5], [0, 500, 239.5], [0, 0, 1]], {"width": 640, "height": 480}
    quarter = PinholeCamera.from_opencv(K, np.array([[0], [0], [np.pi / 2]]), [[0], [0], [5]], **film)
    whole = PinholeCamera.from_opencv(K, [[0, -1, 0], [1, 0, 0], [0, 0, 1]], [0, 0, 5], **film)
    np.testing.assert_allclose(quarter.frame(), whole.frame(), atol=4e-16)
    # x of the world points down in the picture.
    np.testing.assert_allclose(quarter.project([1, 0, 0])[0], [320, 340], atol=ROUNDED)


def test_far_from_the_origin_no_digit_of_the_rotation_is_lost() -> None:
    R = np.array([[float(x) for x in row] for row in turn_of(3, -1, 4, 2)])
    eye = np.array([4.5e6, -5.5e6, 120.0])
    camera = PinholeCamera(**FILM, extrinsics=np.column_stack([R, -R @ eye]))
    np.testing.assert_allclose(camera.eye, eye, rtol=1e-15, atol=1e-8)
    np.testing.assert_allclose(camera.frame(), [R[0], -R[1], R[2]], atol=4e-16)


def test_another_size_of_the_same_shape_scales_the_intrinsics() -> None:
    camera = PinholeCamera(**FILM, **PLACE, cx=300.0, cy=250.0, skew=3.0)
    points = np.random.default_rng(1).uniform(-1, 1, (50, 3))
    whole = camera.project(points)[0]
    np.testing.assert_allclose(camera.project(points, (1280, 960))[0], 2 * whole, atol=ROUNDED)
    # Half of an odd size is rounded to whole pixels, and each side is scaled by itself.
    tall = PinholeCamera(**{**FILM, "height": 481}, **PLACE, cx=300.0, cy=250.0, skew=3.0)
    np.testing.assert_allclose(
        tall.project(points, (320, 240))[0], tall.project(points)[0] * [320 / 640, 240 / 481], atol=ROUNDED
    )
    odd = PinholeCamera(**{**FILM, "width": 641}, **PLACE)
    np.testing.assert_allclose(odd.project([0, 0, 0], (320, 240))[0], [160, 120], atol=ROUNDED)


def test_square_pixels_about_the_middle_are_a_perspective_camera() -> None:
    place = {"eye": (1, 2, 5), "target": (0.2, 0, 0), "up": (0.1, 1, 0)}
    focal = 24 / np.tan(np.radians(20))
    pinhole = PinholeCamera(width=64, height=48, fx=focal, fy=focal, **place)
    other = PerspectiveCamera(**place, fov=40)
    for ours, theirs in zip(pinhole.primary_rays(), other.primary_rays((64, 48)), strict=True):
        np.testing.assert_allclose(ours, theirs, atol=1e-15)


def test_a_picture_has_the_cameras_own_size_unless_another_is_stated() -> None:
    camera = PinholeCamera(width=np.int64(32), height=np.uint8(24), fx=40, fy=np.float32(40), **PLACE)
    ball = SceneObject(mesh=shapes.icosphere(2), material="m")
    scene = Scene(camera=camera, materials={"m": Phong()}, objects=[ball], render={"samples": 4})
    assert render(scene).radiance.shape == (24, 32, 3)
    assert render(scene, resolution=(16, 12)).radiance.shape == (12, 16, 3)
    other = scene.altered(camera=PerspectiveCamera(**PLACE), render={"resolution": (8, 6)})
    assert render(other, camera=camera).radiance.shape == (6, 8, 3)


def test_a_scene_file_places_a_camera_by_its_extrinsics() -> None:
    table = {**FILM, "type": "pinhole", "extrinsics": [[1, 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, 5]]}
    for up in ("y", "z"):
        camera = Scene(camera=table, materials={}, up=up).camera
        assert (camera.eye, camera.up) == ((0, 0, 5), (0, 1, 0)) and camera.frame()[2].tolist() == [0, 0, -1]


@cases(
    ("changes", "said"),
    [
        ({"fx": np.nan}, "fx: expected a finite number, got nan"),
        ({"fx": 0.0}, "fx: expected a number greater than or equal to 0.000000001, got 0"),
        ({"fy": -2.0}, "fy: expected a number greater than or equal to 0.000000001, got -2"),
        ({"cx": np.inf}, "cx: expected a finite number, got inf"),
        ({"skew": "1"}, "skew: expected a number, got '1'"),
        ({"width": 0}, "width: expected a number greater than or equal to 1, got 0"),
        ({"height": 4.5}, "height: expected an integer, got 4.5"),
        ({"extrinsics": np.eye(4)}, "extrinsics: expected none beside eye, target and up, got eye and target, too"),
        ({"extrinsics": 2 * np.eye(3, 4)}, "extrinsics: expected a rotation R"),
        ({"extrinsics": np.diag([1.0, 1.0, -1.0, 1.0])}, "extrinsics: expected a rotation R"),
        ({"extrinsics": np.full((3, 4), np.nan)}, "extrinsics: expected finite numbers"),
        ({"extrinsics": np.eye(3)}, r"extrinsics: expected shape \(3, 4\) or \(4, 4\), got shape \(3, 3\)"),
        ({"extrinsics": np.eye(4) + np.eye(4, k=-1)}, "extrinsics: expected a last row of 0, 0, 0, 1"),
        ({"eye": None}, "eye: expected a value, got none"),
    ],
)
def test_bad_intrinsics_and_extrinsics_are_named(changes: dict[str, Any], said: str) -> None:
    alone = "extrinsics" in changes and "beside" not in said
    with pytest.raises(ValueError, match=said):
        PinholeCamera(**{**FILM, **({} if alone else PLACE), **changes})


@cases(
    ("changes", "said"),
    [
        ({"K": np.eye(4)}, r"K: expected \[\[fx, skew, cx\]"),
        ({"K": [[1, 0, 0], [1, 1, 0], [0, 0, 1]]}, r"K: expected \[\[fx, skew, cx\]"),
        ({"R": np.eye(2)}, r"R: expected shape \(3, 3\) or \(3,\), got shape \(2, 2\)"),
        ({"t": [1, 2]}, r"t: expected shape \(3,\), got shape \(2,\)"),
        ({"t": "far"}, "t: expected real numbers"),
    ],
)
def test_bad_matrices_of_opencv_are_named(changes: dict[str, Any], said: str) -> None:
    sound = {"K": np.eye(3), "R": np.eye(3), "t": [0, 0, 1]}
    with pytest.raises(ValueError, match=said):
        PinholeCamera.from_opencv(**{**sound, **changes}, width=4, height=3)

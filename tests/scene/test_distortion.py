"""Pinhole cameras with distortion against the formula of OpenCV's documentation in rational arithmetic."""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from cases import cases

from renderer import OpenCVCamera, Phong, PinholeCamera, Scene, SceneObject, render, shapes
from renderer.scene.cameras.distortion import Distortion

pytestmark = pytest.mark.judges(
    "OpenCVCamera", "OpenCVCamera.from_opencv", "OpenCVCamera.project", "OpenCVCamera.rays", "scene.camera.opencv.k1",
    "scene.camera.opencv.k2", "scene.camera.opencv.k3", "scene.camera.opencv.p1", "scene.camera.opencv.p2",
)  # fmt: skip

# Corners of the film are about two focal lengths from the principal point.
FILM: dict[str, Any] = {"width": 640, "height": 480}
K = [[200.0, 2.0, 299.5], [0.0, 210.0, 249.5], [0.0, 0.0, 1.0]]
# k1, k2, p1, p2, k3 of lenses with barrels, pincushions, both, and an oblique sensor.
LENSES = [
    (-0.3, 0.1, 0.001, -0.002, 0.0), (0.2, 0.1, 0.0, 0.0, 0.05), (-0.25, 0.125, 0.01, 0.01, -0.01),
    (0.0, 0.0, 0.02, -0.01, 0.0), (3.0, -1.0, 0.0, 0.03, 2.0),
]  # fmt: skip


def camera_of(D: Any) -> OpenCVCamera:
    return OpenCVCamera.from_opencv(K, D, np.eye(3), [0, 0, 0], **FILM)


def distorted(D: Any, x: Fraction, y: Fraction) -> tuple[Fraction, Fraction]:
    """x'' and y'' of OpenCV's documentation, exactly."""
    k1, k2, p1, p2, k3 = map(Fraction, D)
    r2 = x * x + y * y
    radial = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    return x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x), y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y


def pixel(D: Any, point: Any) -> list[float]:
    """u and v of OpenCV's documentation, counted from the film's corner."""
    X, Y, Z = map(Fraction, point)
    x, y = distorted(D, X / Z, Y / Z)
    (fx, skew, cx), (_, fy, cy), _ = ([Fraction(value) for value in row] for row in K)
    return [float(fx * x + skew * y + cx + Fraction(1, 2)), float(fy * y + cy + Fraction(1, 2))]


@cases("D", LENSES)
def test_points_fall_where_opencvs_formula_has_them(D: Any) -> None:
    points = np.random.default_rng(4).integers((-16, -16, 17), (17, 17, 50), (200, 3))
    pixels, z = camera_of(D).project(points, depth="z")
    shown = ~np.isnan(pixels[:, 0])
    assert shown.mean() > 0.95
    expected = [pixel(D, point) for point in points[shown].tolist()]
    np.testing.assert_allclose(pixels[shown], expected, rtol=1e-14, atol=1e-12)
    np.testing.assert_array_equal(z[shown], points[shown, 2])


@cases("D", LENSES)
def test_rays_are_the_inverse_of_the_formula(D: Any) -> None:
    """Exactly where the ray goes, the formula leads back to the pixel within 1e-14 focal lengths."""
    places = np.random.default_rng(7).uniform(0, (640, 480), (200, 2))
    directions = camera_of(D).rays(places)[1]
    shown = ~np.isnan(directions[:, 0])
    assert shown.mean() > 0.5
    found = [pixel(D, direction) for direction in directions[shown].tolist()]
    np.testing.assert_allclose(found, places[shown], rtol=0, atol=1e-14 * 200)


def test_a_ray_has_the_same_bits_alone_and_among_others() -> None:
    camera = camera_of(LENSES[2])
    whole = camera.primary_rays()[1]
    for row, column in ((0, 0), (100, 639), (240, 300), (479, 17)):
        assert camera.rays((column + 0.5, row + 0.5))[1].tobytes() == whole[row, column].tobytes()


@cases(("name", "power"), [("k1", 3), ("k2", 5), ("k3", 7)])
def test_a_distortion_that_turns_back_has_an_edge(name: str, power: int) -> None:
    """r - r^n grows up to r = n^(-1 / (n - 1)), where it is (n - 1) / n of that."""
    camera = OpenCVCamera(**FILM, fx=400, fy=400, **{name: -1.0}, eye=(0, 0, 0), target=(0, 0, -1))
    edge = power ** (-1 / (power - 1))
    film = 400 * edge * (power - 1) / power
    inside, outside = ([320 + film * (1 + off), 240] for off in (-1e-9, 1e-9))
    directions = camera.rays([inside, outside])[1]
    assert -directions[0, 0] / directions[0, 2] == pytest.approx(edge, abs=1e-4)
    assert np.isnan(directions[1]).all()
    pixels = camera.project([[edge * (1 + off), 0, -1] for off in (-1e-9, 1e-9)])[0]
    assert pixels[0, 0] == pytest.approx(320 + film) and np.isnan(pixels[1]).all()
    ball = SceneObject(mesh=shapes.icosphere(1), material="m")
    scene = Scene(camera=camera, materials={"m": Phong()}, objects=[ball], ambient=1.0)
    x, y = np.meshgrid(np.arange(64) + 0.5, np.arange(48) + 0.5)
    shown = np.hypot(x - 32, y - 24) < film / 10
    np.testing.assert_array_equal(render(scene, resolution=(64, 48)).radiance[..., 0] > 0, shown)


@cases("D", [(0.0, 0.0, 0.02, -0.01, 0.0), (-0.2, 0.01, 0.03, 0.04, -0.01), (-0.5, 0.3, 0.0, -0.1, -0.1)])
def test_within_its_reach_no_two_places_fall_together(D: Any) -> None:
    """On a disc a map is one to one where its Jacobian is positive definite; it is so a third beyond at most."""
    lens = Distortion(*D)

    def least(radius: float) -> float:
        """The least eigenvalue of the Jacobian on a circle, by central differences."""
        turn, h = np.linspace(0, 2 * np.pi, 721), 1e-6
        x, y = radius * np.cos(turn), radius * np.sin(turn)
        ways = [np.subtract(lens.bent(x + a, y + b), lens.bent(x - a, y - b)) / (2 * h) for a, b in ((h, 0), (0, h))]
        jacobian = np.moveaxis(np.array(ways), -1, 0)
        np.testing.assert_allclose(jacobian, np.swapaxes(jacobian, 1, 2), atol=1e-8)
        return float(np.linalg.eigvalsh(jacobian).min())

    assert min(least(share * lens.reach()) for share in (0.1, 0.5, 0.9, 1.0)) > 0
    assert least(1.34 * lens.reach()) < 0


def test_without_distortion_it_is_the_pinhole_camera() -> None:
    place = {"eye": (1, 2, 5), "target": (0.2, 0, 0), "up": (0.1, 1, 0)}
    film = {**FILM, "fx": 500.0, "fy": 520.0, "cx": 300.0, "skew": 3.0}
    ours, theirs = OpenCVCamera(**film, **place), PinholeCamera(**film, **place)
    points = np.random.default_rng(1).uniform(-1, 1, (50, 3))
    np.testing.assert_allclose(ours.project(points)[0], theirs.project(points)[0], rtol=1e-14)
    np.testing.assert_allclose(ours.primary_rays()[1], theirs.primary_rays()[1], atol=1e-15)


def test_four_coefficients_are_five_without_k3_in_a_row_or_a_column() -> None:
    D = [-0.2, 0.05, 0.001, -0.002]
    expected = OpenCVCamera.from_opencv(K, [*D, 0], np.eye(3), [0, 0, 0], **FILM)
    assert (expected.k1, expected.k2, expected.p1, expected.p2, expected.k3) == (*D, 0.0)
    for given in (D, np.array([D]), np.array([D]).T, np.array([[*D, 0]]).T):
        assert camera_of(given) == expected


@cases("D", [np.zeros(8), np.zeros((14, 1)), np.zeros(3), np.zeros((2, 2)), 0.0])
def test_other_coefficients_are_refused(D: Any) -> None:
    with pytest.raises(
        ValueError, match="D: expected 4 or 5 numbers k1, k2, p1, p2, k3, of no model with more, got shape"
    ):
        camera_of(D)

"""Fish-eyes, panoramas and lenses against closed forms."""

import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from cases import cases

from renderer import (
    EquirectangularCamera,
    FisheyeCamera,
    Mesh,
    OpenCVFisheyeCamera,
    PerspectiveCamera,
    Phong,
    Scene,
    SceneObject,
    SceneWarning,
    ThinLensCamera,
    prepare,
    render,
    shapes,
)
from renderer.picture.camera_rays import rays_of_tiles, tile_side
from renderer.scene.cameras.thin_lens import lens_places
from renderer.shade.tile import Rectangle

pytestmark = pytest.mark.judges(
    "EquirectangularCamera", "FisheyeCamera", "OpenCVFisheyeCamera", "OpenCVFisheyeCamera.from_opencv",
    "ThinLensCamera", "scene.camera.fisheye.fov", "scene.camera.opencv_fisheye.k1", "scene.camera.opencv_fisheye.k2",
    "scene.camera.opencv_fisheye.k3", "scene.camera.opencv_fisheye.k4", "scene.camera.thin_lens.aperture",
    "scene.camera.thin_lens.focus",
)  # fmt: skip

# Looks along -z, with x to the right and y up.
LEVEL: dict[str, Any] = {"eye": (0, 0, 0), "target": (0, 0, -1)}
FILM: dict[str, Any] = {"width": 640, "height": 480, "fx": 200.0, "fy": 210.0, "cx": 300.0, "cy": 250.0, "skew": 2.0}
BALL = SceneObject(mesh=shapes.icosphere(3), material="m")


def scene_of(camera: Any, **more: Any) -> Scene:
    return Scene(camera=camera, materials={"m": Phong()}, objects=[BALL], **more)


def test_a_panorama_has_longitude_across_and_latitude_down() -> None:
    camera = EquirectangularCamera(**LEVEL)
    s, c = math.sqrt(0.5), math.sqrt(0.75)
    expected = {(180, 90): (0, 0, -1), (225, 90): (s, 0, -s), (45, 90): (-s, 0, s), (180, 30): (0, c, -0.5),
                (270, 120): (c, -0.5, 0), (17, 0): (0, 1, 0), (200, 180): (0, -1, 0)}  # fmt: skip
    np.testing.assert_allclose(camera.rays(list(expected), (360, 180))[1], list(expected.values()), atol=1e-15)


@cases("fov", [40.0, 180.0, 360.0])
def test_a_fisheyes_angle_is_proportional_to_the_distance_from_the_middle(fov: float) -> None:
    camera = FisheyeCamera(**LEVEL, fov=fov)
    x, y = np.meshgrid(np.arange(50) + 0.5, np.arange(40) + 0.5)
    directions = camera.primary_rays((50, 40))[1]
    distance = np.hypot(x - 25, y - 20)
    shown = ~np.isnan(directions).any(axis=-1)
    np.testing.assert_array_equal(shown, distance <= 20)
    cosines = np.cos(np.radians(fov / 2) * distance / 20)
    np.testing.assert_allclose(-directions[shown][:, 2], cosines[shown], atol=1e-15)
    for axis, aside in ((0, x - 25), (1, 20 - y)):
        assert (directions[shown][:, axis] * aside[shown] >= 0).all()


def test_a_fisheye_is_black_outside_its_circle_and_empty_blocks_change_nothing() -> None:
    camera = FisheyeCamera(eye=(0, 0, 3), target=(0, 0, 0))
    for samples in (1, 4):
        image = render(scene_of(camera, background=1.0), resolution=(80, 40), samples=samples)
        outside = np.isnan(camera.primary_rays((80, 40))[1][..., 0])
        assert (image.radiance[:, [0, 19, 60, 79]] == 0).all() and (image.face[outside] == -1).all()
        assert np.isinf(image.depth[outside]).all() and (image.radiance[2:12, 39] == 1).all()
        assert samples > 1 or (image.rays[outside].max() == 0 and image.rays[~outside].min() == 1)


@cases("seed", range(5))
def test_a_calibrated_fisheye_follows_opencvs_polynomial(seed: int) -> None:
    """Points at angles whose tangents are rational: the angle is their arctangent, all else is exact."""
    rng = np.random.default_rng(seed)
    k = [Fraction(int(n), 1 << 10) for n in rng.integers(-20, 60, 4)]
    D, K = np.array([[float(x)] for x in k]), [[200.0, 2.0, 299.5], [0.0, 210.0, 249.5], [0.0, 0.0, 1.0]]
    camera = OpenCVFisheyeCamera.from_opencv(K, D, np.eye(3), [0, 0, 0], width=640, height=480)
    assert camera == OpenCVFisheyeCamera(**FILM, **LEVEL | {"target": (0, 0, 1), "up": (0, -1, 0)}, **dict(
        zip(("k1", "k2", "k3", "k4"), D.ravel().tolist(), strict=True)
    ))  # fmt: skip
    for x, y, length in ((3, 4, 5), (-5, 12, 13), (0, -7, 7), (8, 15, 17)):
        theta = Fraction(math.atan2(length, 20))
        bent = theta * (1 + sum(c * theta ** (2 * n + 2) for n, c in enumerate(k)))
        right, down = bent * x / length, bent * y / length
        expected = [float(200 * right + 2 * down + 300), float(210 * down + 250)]
        np.testing.assert_allclose(camera.project([x, y, 20])[0], expected, rtol=0, atol=1e-12)


@cases("number", [1, 2, 3, 4])
def test_a_distortion_that_turns_back_has_an_edge(number: int) -> None:
    """t - t^n grows up to t = n^(-1 / (n - 1)), where it is (n - 1) / n of that."""
    camera = OpenCVFisheyeCamera(width=640, height=480, fx=500, fy=500, **{f"k{number}": -1.0}, **LEVEL)
    power = 2 * number + 1
    edge = power ** (-1 / (power - 1))
    inside, outside = ([320 + 500 * edge * (power - 1) / power * (1 + off), 240] for off in (-1e-9, 1e-9))
    directions = camera.rays([inside, outside])[1]
    assert math.acos(-directions[0, 2]) == pytest.approx(edge, abs=1e-4) and np.isnan(directions[1]).all()
    assert np.isnan(camera.project([math.tan(edge + 0.01), 0, -1])[0]).all()


@pytest.mark.filterwarnings("error")
def test_angles_in_radians_are_a_slip() -> None:
    with pytest.raises(SceneWarning, match=r"fov: expected degrees, got 3.14159. If these are radians, write fov=180"):
        FisheyeCamera(**LEVEL, fov=math.pi)


def test_matrices_of_a_fisheye_are_checked() -> None:
    with pytest.raises(ValueError, match=r"D: expected shape \(4,\), got shape \(5,\)"):
        OpenCVFisheyeCamera.from_opencv(np.eye(3), np.zeros(5), np.eye(3), [0, 0, 0], width=4, height=3)


LENS = ThinLensCamera(eye=(1, 2, 5), target=(0.2, 0.5, 0), up=(0.1, 1, 0), fov=40, aperture=0.5, focus=3.0)


def lens_rays(samples: int, window: tuple[int, int, int, int] = (0, 0, 40, 30)) -> Any:
    """Origins and directions of all rays, (places, h, w, 3)."""
    left, top, right, bottom = window
    rays = rays_of_tiles(LENS, (40, 30), samples)(Rectangle(*window)).rays
    listed = rays.reshape(-1, bottom - top, right - left, 6)
    return listed[..., :3], listed[..., 3:]


def test_all_rays_of_a_place_cross_the_plane_in_focus_at_its_point() -> None:
    forward = LENS.frame()[2]
    origins, directions = lens_rays(9)
    away = origins - LENS.eye
    np.testing.assert_allclose(away @ forward, 0, atol=1e-15)
    t = 3.0 / (directions @ forward)
    places = origins + t[..., None] * directions
    x, y = np.meshgrid(np.arange(40), np.arange(30))
    pinhole = PerspectiveCamera(eye=LENS.eye, target=LENS.target, up=LENS.up, fov=40)
    for number in range(9):
        at = np.stack([x + (number % 3 + 0.5) / 3, y + (number // 3 + 0.5) / 3], axis=-1)
        o, d = pinhole.rays(at, (40, 30))
        np.testing.assert_allclose(places[number], o + (3.0 / (d @ forward))[..., None] * d, atol=1e-14)
    # The last is the middle of the lens, for depth, normal and face.
    assert (away[9] == 0).all() and np.linalg.norm(away[:9], axis=-1).max() <= 0.5


def test_points_fill_the_lens_evenly() -> None:
    """Of discs within the lens, and of halves, the share of points is that of areas."""
    right, up, _ = LENS.frame()
    away = (lens_rays(64)[0][:64] - LENS.eye) / 0.5
    x, y = away @ right, away @ up
    for radius in (0.3, 0.7):
        assert (np.hypot(x, y) < radius).mean() == pytest.approx(radius**2, abs=0.005)
    for part in (x > 0, y > 0, x > y):
        assert part.mean() == pytest.approx(0.5, abs=0.005)
    # One pixel's own are spread: 64 points are within 4 of what a part's area is of theirs.
    each = (x > 0).sum(axis=0)
    assert np.abs(each - 32).max() <= 4
    # Neighbours differ.
    u, v = lens_places(*np.meshgrid(np.arange(64) + 0.5, np.arange(64) + 0.5), 0)
    assert len(np.unique(u)) == len(np.unique(v)) == 64 * 64


def test_rays_are_the_same_in_every_window() -> None:
    whole, part = lens_rays(4), lens_rays(4, (7, 5, 29, 30))
    for all_, some in zip(whole, part, strict=True):
        assert all_[:, 5:30, 7:29].tobytes() == some.tobytes()


def test_one_sample_or_no_aperture_is_the_perspective_camera() -> None:
    place = {"eye": (0, 0, 5), "target": (0, 0, 0), "fov": 40}
    ready = prepare(scene_of(PerspectiveCamera(**place), ambient=1.0))
    for aperture, samples in ((0.5, 1), (0.0, 4)):
        lens = ThinLensCamera(**place, aperture=aperture)
        ours, theirs = (render(ready, camera=c, resolution=33, samples=samples) for c in (lens, ready.scene.camera))
        assert ours.radiance.tobytes() == theirs.radiance.tobytes() and ours.depth.tobytes() == theirs.depth.tobytes()


def test_a_picture_is_the_mean_of_the_pictures_of_its_rays() -> None:
    """With an odd number of samples too, of which none is at the lens's middle."""
    sphere, lens = scene_of(LENS, ambient=1.0, background=0.25), lens_rays(9)
    image = render(sphere, resolution=(40, 30), samples=9)
    octree = prepare(sphere).octree
    hit = octree.closest_hit(lens[0][:9], lens[1][:9]).hit
    expected = np.where(hit, np.float32(0.8), 0.25).mean(axis=0)
    np.testing.assert_allclose(image.radiance[..., 0], expected, rtol=1e-6)
    assert (0.05 < hit.mean() < 0.95) and ((hit.mean(axis=0) > 0) & (hit.mean(axis=0) < 1)).mean() > 0.1
    pinhole = PerspectiveCamera(eye=LENS.eye, target=LENS.target, up=LENS.up, fov=40)
    sharp = render(sphere, camera=pinhole, resolution=(40, 30), samples=9)
    assert image.face.tobytes() == sharp.face.tobytes() and image.depth.tobytes() == sharp.depth.tobytes()


def test_many_samples_take_smaller_tiles_and_give_the_same_picture() -> None:
    """The rays of a tile of 32 x 32 would take 3 GB with 65,536 samples."""
    assert tile_side(LENS, (40, 30), 256) == 32 and tile_side(LENS, (40, 30), 289) == 8
    assert tile_side(PerspectiveCamera(**LEVEL), (40, 30), 65536) == 32
    image = render(scene_of(LENS, ambient=1.0), resolution=(40, 30), samples=289, window=(3, 4, 22, 21))
    origins, directions = lens_rays(289, (3, 4, 22, 21))
    hit = prepare(scene_of(LENS)).octree.closest_hit(origins[:289], directions[:289]).hit
    np.testing.assert_allclose(image.radiance[..., 0], 0.8 * hit.mean(axis=0), rtol=1e-5)


@cases("distance", [1.5, 3.0, 8.0])
def test_an_edge_is_as_soft_as_its_circle_of_confusion(distance: float) -> None:
    """Half of the view is white, so a pixel shows the share of that circle, of the lens seen from it, on the one side.

    Its radius on the film is f A |1 / focus - 1 / distance| for a focal length of f pixels and a lens of radius A.
    """
    focal, focus, aperture, side = 200.0, 3.0, 0.1, 60
    camera = ThinLensCamera(**LEVEL, fov=2 * math.degrees(math.atan(side / 2 / focal)), aperture=aperture, focus=focus)
    far = 10.0 * distance
    corners = [[0, -far, -distance], [far, -far, -distance], [far, far, -distance], [0, far, -distance]]
    wall = SceneObject(mesh=Mesh(corners, [[0, 1, 2], [0, 2, 3]]), material="m")
    scene = Scene(camera=camera, materials={"m": Phong(diffuse=0, ambient=1)}, objects=[wall], ambient=1.0)
    shares = render(scene, resolution=side, samples=256, window=(0, 15, side, 45)).radiance[..., 0].mean(axis=0)
    radius = focal * aperture * abs(1 / focus - 1 / distance)
    # The share of a disc on one side of a chord, and its mean over each pixel.
    places = (np.arange(side * 64) + 0.5) / 64 - side / 2
    chord = np.clip(places / max(radius, 1e-9), -1, 1)
    expected = 0.5 + (np.arcsin(chord) + chord * np.sqrt(1 - chord**2)) / math.pi
    np.testing.assert_allclose(shares, expected.reshape(side, 64).mean(axis=1), atol=3e-3)
    assert (radius > 2) == (distance != focus)

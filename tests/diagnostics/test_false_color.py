"""AOVs as colours: what the ends of each scale are, what a miss shows, and colours of faces that stay what they are."""

from typing import Any

import numpy as np
import pytest
from cases import cases
from numpy.typing import NDArray

from renderer.diagnostics.false_color import AOVS, VIRIDIS, false_color, limits_of, limits_of_counts
from renderer.materials.phong import Phong
from renderer.mesh.shapes import icosphere
from renderer.picture.image import Image, srgb
from renderer.picture.render import render
from renderer.scene.camera import PerspectiveCamera
from renderer.scene.light import DirectionalLight
from renderer.scene.scene import Scene, SceneObject

BACKGROUND = (0.1, 0.2, 0.4)


def ball(threads: int = 1) -> Image:
    scene = Scene(
        camera=PerspectiveCamera(eye=(0.3, 0.2, 4), target=(0, 0, 0)),
        materials={"m": Phong(reflectance=0.5)},
        objects=(SceneObject(mesh=icosphere(2), material="m"),),
        lights=(DirectionalLight(direction=(-1, -1, -1)),),
        background=BACKGROUND,
    )
    return render(scene, resolution=(40, 30), threads=threads)


def row(**changed: Any) -> Image:
    """A picture of one row: three surfaces and a miss."""
    values: dict[str, Any] = {
        "radiance": np.array([[[0, 0, 0], [0.5, 0.5, 0.5], [2, 2, 2], BACKGROUND]], np.float32),
        "depth": np.array([[2.0, 3.0, 4.0, np.inf]]),
        "normal": np.array([[[0, 0, 1], [-1, 0, 0], [0, -0.6, 0.8], [0, 0, 0]]], np.float32),
        "face": np.array([[7, 8, 7, -1]], np.int32),
        "rays": np.array([[1, 3, 5, 1]], np.int32),
        "build_seconds": 0.0,
        "render_seconds": 0.0,
    }
    return Image(**{**values, **changed})


@pytest.mark.parametrize("aov", AOVS)
class TestAll:
    def test_a_miss_shows_the_background(self, aov: str) -> None:
        image = ball()
        missed = false_color(image, aov)[image.face < 0]
        assert len(missed) > 900
        # A miss has its cost too: the camera ray.
        expected = VIRIDIS[0] if aov == "cost" else srgb(BACKGROUND)
        np.testing.assert_array_equal(missed, np.broadcast_to(expected, missed.shape))

    def test_a_picture_of_nothing(self, aov: str) -> None:
        nothing = row(face=np.full((1, 4), -1, np.int32), depth=np.full((1, 4), np.inf))
        colors = false_color(nothing, aov)
        assert colors.shape == (1, 4, 3)
        if aov != "cost":
            np.testing.assert_array_equal(colors, srgb(nothing.radiance))


class TestDepth:
    def test_the_nearest_is_the_brightest(self) -> None:
        near, middle, far = false_color(row(), "depth")[0, :3].tolist()
        assert near == [240] * 3 and far == [30] * 3 and middle == [135] * 3
        assert limits_of(row(), "depth") == (2.0, 4.0)

    def test_limits_hold_still_what_would_change_with_the_view(self) -> None:
        shades = false_color(row(), "depth", (2.5, 3.5))[0, :3, 0].tolist()
        assert shades == [240, 135, 30]
        assert false_color(row(), "depth", (0.0, 8.0))[0, :3, 0].tolist() == [187, 161, 135]

    def test_one_depth(self) -> None:
        flat = row(depth=np.array([[3.0, 3.0, 3.0, np.inf]]))
        assert false_color(flat, "depth")[0, :3, 0].tolist() == [240] * 3


class TestFacesOfLargeMeshes:
    def test_of_few_faces_each_has_a_colour_of_its_own(self) -> None:
        image = ball()
        np.testing.assert_array_equal(false_color(image, "face", faces=512), false_color(image, "face"))

    def test_of_many_neighbours_share_a_colour_and_differ_in_shade(self) -> None:
        """A million faces showed noise."""
        count = 1_000_000
        faces = np.arange(0, count, 7, dtype=np.int32)[None]
        flat = np.ones(faces.shape)
        image = row(face=faces, depth=flat, rays=flat, radiance=np.zeros((*faces.shape, 3), np.float32))
        colors = false_color(image, "face", faces=count)[0].astype(float)
        group = faces[0] // -(-count // 512)
        for number in range(0, group.max() + 1, 50):
            of_group = colors[group == number]
            brightest = of_group.max(axis=0)
            # Each face has its group's colour, at 0.7 to all of its strength, rounded.
            assert (of_group >= 0.7 * brightest - 1.0).all() and len(np.unique(of_group, axis=0)) > 10
            np.testing.assert_allclose(
                of_group / brightest, (of_group / brightest).mean(axis=1)[:, None] + [0] * 3, atol=0.03
            )
        tops = np.array([colors[group == number].max(axis=0) for number in range(group.max() + 1)])
        assert 500 <= len(np.unique(tops, axis=0)) <= 512
        assert np.abs(np.diff(tops, axis=0)).max(axis=1).mean() > 60  # neighbouring groups are unlike


def test_normals_are_half_and_half() -> None:
    facing, left, tilted = false_color(row(), "normal")[0, :3].tolist()
    # 255 (0.5 + 0.5 n), rounded.
    assert facing == [128, 128, 255] and left == [0, 128, 128] and tilted == [128, 51, 230]


def lowbias32(x: int) -> int:
    """The published C code, in integers of any size."""
    x ^= x >> 16
    x = x * 0x7FEB352D & 0xFFFFFFFF
    x ^= x >> 15
    x = x * 0x846CA68B & 0xFFFFFFFF
    return x ^ x >> 16


class TestFaces:
    @staticmethod
    def colors(faces: Any) -> NDArray[np.int64]:
        """The colours of face numbers (n,)."""
        count = len(faces)
        image = Image(
            np.zeros((1, count, 3), np.float32),
            np.ones((1, count)),
            np.ones((1, count, 3), np.float32),
            np.asarray([faces], np.int32),
            np.ones((1, count), np.int32),
            0.0,
            0.0,
        )
        return false_color(image, "face")[0].astype(np.int64)

    def test_a_face_keeps_its_colour(self) -> None:
        a, b, c, _ = false_color(row(), "face")[0].tolist()
        assert a == c != b
        assert self.colors([3, 7, 2**31 - 1])[1].tolist() == a

    def test_the_hash_is_the_published_one(self) -> None:
        faces = [0, 1, 2, 99_999, 2**31 - 1]
        expected = [[48 + (lowbias32(f) >> shift & 255) * 207 // 255 for shift in (0, 8, 16)] for f in faces]
        assert self.colors(faces).tolist() == expected


class TestCost:
    def test_from_few_to_many(self) -> None:
        few, middle, many, miss = false_color(row(), "cost")[0]
        np.testing.assert_array_equal(few, VIRIDIS[0])
        np.testing.assert_array_equal(many, VIRIDIS[-1])
        np.testing.assert_array_equal(miss, VIRIDIS[0])
        # Viridis at one half, of 256 colours the 128th: (33, 145, 140).
        assert np.abs(middle.astype(int) - [33, 145, 140]).max() <= 2
        assert limits_of(row(), "cost") == (1.0, 5.0)
        # Of 200 pixels one is beyond the scale.
        assert limits_of_counts(np.array([*range(1, 198), 1000, 2000, 3000])) == (1.0, 2000.0)

    def test_lightness_rises_evenly(self) -> None:
        costs = np.arange(64, dtype=np.int32)[None]
        picture = row(
            radiance=np.zeros((1, 64, 3), np.float32),
            rays=costs,
            face=np.zeros((1, 64), np.int32),
            depth=np.ones((1, 64)),
        )
        linear = (false_color(picture, "cost")[0] / 255.0) ** 2.2
        lightness = np.cbrt(linear @ [0.2126, 0.7152, 0.0722])
        steps = np.diff(lightness)
        # CIE L* of viridis is a straight line; the gamma of 2.2 and roundings to 8 bits bend it a little.
        assert steps.min() > 0.3 * steps.mean() and steps.max() < 2.0 * steps.mean()

    def test_limits_of_its_own(self) -> None:
        colors = false_color(row(), "cost", (3.0, 4.0))[0]
        np.testing.assert_array_equal(colors[[0, 1, 2]], VIRIDIS[[0, 0, -1]])


def test_other_pictures_have_no_limits() -> None:
    for aov in ("color", "normal", "face"):
        assert limits_of(row(), aov) == (0.0, 0.0)
    nothing = row(face=np.full((1, 4), -1, np.int32))
    assert limits_of(nothing, "depth") == (0.0, 0.0)


@cases(
    ("aov", "limits", "message"),
    [
        ("colour", None, "aov: expected one of .*'cost'.*, got 'colour'"),
        ("depth", (2.0, 1.0), "limits: expected finite low <= high"),
        ("cost", (0.0, np.inf), "limits: expected finite low <= high"),
        ("depth", (np.nan, 1.0), "limits: expected finite low <= high"),
    ],
)
def test_bad_arguments_are_named(aov: str, limits: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        false_color(row(), aov, limits)

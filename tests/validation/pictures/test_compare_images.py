"""The picture metrics on drawn pictures: perfect for equal ones, and over a threshold for every defect."""

import numpy as np
import pytest
from cases import cases
from numpy.typing import NDArray
from skimage.metrics import structural_similarity

from validation.pictures.compare import ImageComparison, compare, fragile_pixels, srgb

SIZE = 128

# What two correct renderers with different offsets of spawned rays keep to on a scene of floor, mirror and
# glass (measured .9987, .14 %, 7e-5, .0018), with a margin of about 2.
SSIM, PIXEL_SHARE, MEAN_ERROR, MAX_ERROR = 0.998, 0.003, 3e-4, 0.005


def picture(
    shift: float = 0.0, key: float = 1.0, fill: float = 1.0, radius: float = 0.5, flat: bool = False
) -> NDArray[np.float64]:
    """A shaded ball before a tiled wall, linear; ``shift`` in pixels, ``key`` and ``fill`` its two lights'
    strengths.
    """
    y, x = np.meshgrid(*[(np.arange(SIZE) + 0.5) / SIZE * 2.0 - 1.0] * 2, indexing="ij")
    x = x + shift * 2.0 / SIZE
    distance = np.hypot(x, y)
    z = np.sqrt(np.maximum(radius**2 - distance**2, 0.0))
    normals = np.stack([x, y, z], axis=-1) / radius
    if flat:
        normals = np.round(normals * 6.0) / 6.0
    shading = key * np.maximum(normals @ [-0.6, -0.6, 0.53], 0.0) + 0.3 * fill * np.maximum(
        normals @ [0.8, 0.0, 0.6], 0.0
    )
    tiles = 0.1 + 0.3 * ((np.floor(4.0 * x) + np.floor(4.0 * y)) % 2.0)
    grey = np.where(distance < radius, 0.7 * shading, tiles * (0.7 * key + 0.3 * fill))
    return grey[..., None] * np.array([1.0, 0.8, 0.5])


def over_threshold(result: ImageComparison) -> set[str]:
    return {
        name
        for name, bad in {
            "ssim": not result.ssim >= SSIM,
            "pixels": not result.pixel_share <= PIXEL_SHARE,
            "mean": not result.mean_error <= MEAN_ERROR,
            "max": not result.max_error <= MAX_ERROR,
        }.items()
        if bad
    }


def test_equal_pictures_are_perfect() -> None:
    mask = np.zeros((SIZE, SIZE), dtype=bool)
    mask[40:90, 40:90] = True
    result = compare(picture(), picture(), foreground=mask)
    assert (result.ssim, result.ssim_foreground) == (1.0, 1.0)
    assert (result.pixel_share, result.mean_error, result.max_error, result.fragile_share) == (
        0.0,
        0.0,
        0.0,
        0.0,
    )
    assert result.difference.shape == (SIZE, SIZE) and not result.difference.any()


@cases(
    ("defect", "caught_by"),
    [
        ({"shift": 0.5}, {"ssim", "pixels", "mean", "max"}),
        ({"shift": 0.1}, {"ssim", "pixels", "max"}),
        ({"key": 1.1, "fill": 1.1}, {"pixels", "mean", "max"}),
        ({"key": 1.05}, {"pixels", "mean", "max"}),
        ({"fill": 0.0}, {"ssim", "pixels", "mean", "max"}),
        ({"flat": True}, {"ssim", "pixels", "mean", "max"}),
        ({"radius": 0.51}, {"ssim", "pixels", "mean", "max"}),
    ],
)
def test_every_defect_is_over_a_threshold(defect: dict[str, float], caught_by: set[str]) -> None:
    assert caught_by <= over_threshold(compare(picture(**defect), picture()))


def test_a_hole_of_some_pixels_is_seen_by_the_maximum_and_the_foreground() -> None:
    holed = picture()
    holed[60:62, 50:53] = 0.0
    foreground = np.hypot(*np.mgrid[-63.5:64, -63.5:64]) < 32.0
    result = compare(holed, picture(), foreground=foreground)
    assert "max" in over_threshold(result)
    assert result.ssim_foreground is not None and result.ssim_foreground < result.ssim < 1.0
    assert np.count_nonzero(result.difference) == 6 and result.pixel_share == 6 / SIZE**2


def test_values_by_hand() -> None:
    reference = np.full((16, 16, 3), 0.5)
    ours = reference.copy()
    ours[3, 4] = 0.6, 0.5, 0.5
    ours[7, 8] = 0.5, 0.5, 0.51
    ours[9, 9] = 0.501
    fragile = np.zeros((16, 16), dtype=bool)
    fragile[3, 4] = True
    result = compare(ours, reference, fragile)
    assert result.mean_error == pytest.approx((0.1 + 0.01 + 3 * 0.001) / (3 * 256), rel=1e-12)
    assert result.pixel_share == 2 / 256
    assert result.max_error == pytest.approx(float(srgb(0.51 * np.ones(1))[0] - srgb(0.5 * np.ones(1))[0]), rel=1e-12)
    assert result.fragile_share == 1 / 256
    assert result.difference[3, 4] == result.difference.max() > result.max_error
    assert compare(ours, reference).max_error == result.difference.max()


def test_ssim_is_the_published_one() -> None:
    ours, reference = srgb(picture(shift=0.3)), srgb(picture())
    options = {"gaussian_weights": True, "sigma": 1.5, "use_sample_covariance": False, "data_range": 1.0}
    channels = [structural_similarity(ours[..., c], reference[..., c], **options) for c in range(3)]
    assert compare(picture(shift=0.3), picture()).ssim == pytest.approx(np.mean(channels), rel=1e-12)


def test_srgb_transfer() -> None:
    """Points of IEC 61966-2-1; 0.2140 is the linear value of a middle grey of 0.5."""
    got = srgb(np.array([-1.0, 0.0, 0.001, 0.21404114, 1.0, 7.0]))
    np.testing.assert_allclose(got, [0.0, 0.0, 0.01292, 0.5, 1.0, 1.0], atol=1e-7)
    # The two pieces meet to the seven digits in which the standard gives their constants.
    below, above = srgb(np.array([0.0031308, np.nextafter(0.0031308, 1.0)]))
    assert abs(above - below) < 1e-7


def test_fragile_pixels_are_those_that_a_tiny_change_moves() -> None:
    calls: list[tuple[float, tuple[float, float]]] = []

    def render(offset: float, shift: tuple[float, float]) -> NDArray[np.float64]:
        calls.append((offset, shift))
        image = np.full((16, 16, 3), 0.5)
        image[2, 3] = float(offset > 2e-4)  # a shadow ray from a narrow gap
        image[5, 6] = float(shift[0] > 0.001)  # a silhouette
        image[7, 8] = float(shift[1] < -0.001)
        image[9, 9] += 0.001 * (offset > 5e-5)  # less than half of what is visible
        image[11, 11] = 0.0  # wrong, but steady
        return image

    assert np.argwhere(fragile_pixels(render)).tolist() == [[2, 3], [5, 6], [7, 8]]
    offsets = sorted({offset for offset, shift in calls if shift == (0.0, 0.0)})
    assert offsets == [1e-7, 1e-5, 3e-5, 6e-5, 9e-5, 1e-4, 3e-4]
    assert {offset for offset, shift in calls if shift != (0.0, 0.0)} == {1e-7}
    assert sorted(shift for _, shift in calls if shift != (0.0, 0.0)) == [
        (-0.002, 0),
        (0, -0.002),
        (0, 0.002),
        (0.002, 0),
    ]

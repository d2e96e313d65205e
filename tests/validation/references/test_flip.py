"""FLIP: 0 for equal pictures, 1 for the most different, the same bits in every run, and colour that the mean misses."""

import numpy as np

from validation.pictures.compare import compare, srgb
from validation.references.flip import flip_map
from validation.thresholds import Pictures

RNG = np.random.default_rng(5)
PICTURE = np.clip(RNG.random((8, 8, 1)).repeat(8, 0).repeat(8, 1) * [0.6, 0.5, 0.4], 0.0, 1.0)


def test_equal_pictures_and_opposite_ones() -> None:
    same = flip_map(PICTURE, PICTURE)
    assert same.shape == (64, 64) and same.dtype == np.float32 and not same.any()
    # Black and white leave FLIP's largest error but for the part that its colour metric keeps for chroma.
    assert flip_map(np.zeros((32, 32, 3)), np.ones((32, 32, 3))).min() > 0.9


def test_the_map_has_the_same_bits_again() -> None:
    ours = srgb(PICTURE * 1.03)
    first = flip_map(ours, srgb(PICTURE))
    assert all(np.array_equal(first, flip_map(ours, srgb(PICTURE))) for _ in range(3))
    assert first.any()


def test_an_error_is_seen_where_it_is() -> None:
    spotted = PICTURE.copy()
    spotted[10:14, 40:44] = [1.0, 0.0, 0.0]
    error = flip_map(spotted, PICTURE)
    row, column = np.unravel_index(error.argmax(), error.shape)
    assert 8 <= row < 16 and 38 <= column < 46
    assert error[40:, :20].max() == 0.0


def test_a_cast_of_colour_is_seen_by_flip_alone() -> None:
    """Red up and blue down by 0.15 %: less than our own rule's mean allows, and its sign cancels in brightness."""
    limits = Pictures().own
    result = compare(PICTURE * [1.0015, 1.0, 0.9985], PICTURE)
    assert result.mean_error < limits.mean_error and result.pixel_share == 0.0 and result.ssim > limits.ssim
    assert result.flip > limits.flip

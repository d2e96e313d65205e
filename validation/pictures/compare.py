"""Comparison of one picture of ours with a reference: the numbers of its gates, and the fragile pixels.

SSIM measures structure: an edge out of place, a wrong normal, a missing bounce. It is nearly blind to brightness (a
gain of 1.10 leaves .998), so it is never used alone: the share of pixels that differ visibly, the mean error, the
largest error and FLIP complement it. sRGB is what people see; linear radiance is what a renderer computes.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from skimage.metrics import structural_similarity

from validation.references.flip import flip_map

Picture = NDArray[np.floating[Any]]

# The smallest visible difference of 8-bit pictures.
VISIBLE = 1.0 / 255.0

# A pixel is fragile when one of these small changes moves it by half of what is visible. The offsets are those by which
# renderers lift spawned rays off a surface: 1e-7 of the scene is the smallest sensible offset in double precision, 3e-4
# is more than Mitsuba's. The steps around Mitsuba's 8.94e-5 are small, because a ray that starts just within reach of a
# facet hits it at some offsets and not at others. Rounding rays and vertices to float32 moves a silhouette by 0.002
# pixel.
BASE_OFFSET = 1e-7
OFFSETS = (1e-5, 3e-5, 6e-5, 9e-5, 1e-4, 3e-4)
SHIFT = 0.002
FRAGILE = 0.5 * VISIBLE

# Wang et al. 2004: a Gaussian window with sigma 1.5 and population covariances. skimage cuts it at 3.5 sigma,
# 11 pixels wide.
_SIGMA = 1.5
_WINDOW = 11


@dataclass(frozen=True)
class ImageComparison:
    """The differences between our picture and the reference.

    ssim : mean structural similarity of the sRGB pictures, 1 when they are the same.
    ssim_foreground : its mean over the foreground's pixels, which a wide background cannot raise; None
        without a mask.
    ssim_linear : the same of linear radiance clipped to [0, 1], which weighs the bright parts.
    pixel_share : share of pixels of which a channel is off by more than 1/255 in sRGB.
    mean_error, rmse : mean absolute and root mean square difference of linear radiance, not clipped.
    max_error, max_error_linear : largest difference in sRGB, and of linear radiance that is not clipped, outside
        the fragile pixels, over all channels.
    flip : mean of ``flip_map``.
    fragile_share : share of the pixels that the largest errors left out; bound it too: at 1 nothing was judged.
    difference : (h, w) float64, largest difference in sRGB over the channels of each pixel.
    flip_map : (h, w) float32, FLIP of the sRGB pictures, see ``flip.flip_map``.
    """

    ssim: float
    ssim_foreground: float | None
    ssim_linear: float
    pixel_share: float
    mean_error: float
    rmse: float
    max_error: float
    max_error_linear: float
    flip: float
    fragile_share: float
    difference: NDArray[np.float64]
    flip_map: NDArray[np.float32]


def srgb(linear: Picture) -> NDArray[np.float64]:
    """Linear radiance clipped to [0, 1] and encoded as IEC 61966-2-1 does, the same shape, float64."""
    clipped = np.clip(np.asarray(linear, dtype=np.float64), 0.0, 1.0)
    return np.where(clipped <= 0.0031308, 12.92 * clipped, 1.055 * clipped ** (1.0 / 2.4) - 0.055)


def compare(
    ours: Picture,
    reference: Picture,
    fragile: NDArray[np.bool_] | None = None,
    foreground: NDArray[np.bool_] | None = None,
) -> ImageComparison:
    """Compare two pictures of linear radiance, both (h, w, 3) with h, w >= 11.

    fragile, foreground : (h, w) masks; none is fragile without the first.

    Raises ``ValueError`` for shapes that differ or are too small, for an empty foreground and for a radiance
    that is not finite.
    """
    _check(ours, reference, fragile, foreground)

    # Compute the differences of each pixel.
    encoded, expected = srgb(ours), srgb(reference)
    similarity = _similarity(encoded, expected)
    difference = np.abs(encoded - expected).max(axis=2)
    error = np.abs(np.subtract(ours, reference, dtype=np.float64))
    judged = np.ones(difference.shape, dtype=bool) if fragile is None else ~fragile
    visible = flip_map(encoded, expected)

    # Reduce them to numbers.
    return ImageComparison(
        ssim=_inner_mean(similarity),
        ssim_foreground=None if foreground is None else float(similarity[foreground].mean()),
        ssim_linear=_inner_mean(_similarity(np.clip(ours, 0.0, 1.0), np.clip(reference, 0.0, 1.0))),
        pixel_share=float((difference > VISIBLE).mean()),
        mean_error=float(error.mean()),
        rmse=float(np.sqrt(np.mean(error**2))),
        max_error=float(difference[judged].max(initial=0.0)),
        max_error_linear=float(error[judged].max(initial=0.0)),
        flip=float(visible.mean(dtype=np.float64)),
        fragile_share=float((~judged).mean()),
        difference=difference,
        flip_map=visible,
    )


def _similarity(ours: Picture, reference: Picture) -> NDArray[np.float64]:
    """SSIM around each pixel, (h, w, 3)."""
    _, similarity = structural_similarity(
        ours.astype(np.float64),
        reference.astype(np.float64),
        data_range=1.0,
        channel_axis=2,
        gaussian_weights=True,
        sigma=_SIGMA,
        use_sample_covariance=False,
        full=True,
    )
    return similarity


def _inner_mean(similarity: NDArray[np.float64]) -> float:
    """Mean SSIM as published: without the rim, where the window reaches beyond the picture."""
    rim = _WINDOW // 2
    return float(similarity[rim:-rim, rim:-rim].mean())


def fragile_pixels(render: Callable[[float, tuple[float, float]], Picture]) -> NDArray[np.bool_]:
    """Mask (h, w) of the pixels that a rounding error may decide.

    render(offset, shift) : our picture, linear (h, w, 3), with spawned rays lifted off the surface by
        ``offset`` and primary rays moved by ``shift`` pixels in x and y.

    Where a ray passes an edge by less than two renderers' roundings, or a spawned ray starts so near another
    surface that the offset decides its hit, both of their pictures are right. The mask depends on our own picture
    alone, so a difference from the reference excuses no error of ours: a pixel that is wrong but steady is not
    fragile.
    """
    base = srgb(render(BASE_OFFSET, (0.0, 0.0)))
    changes = [(offset, (0.0, 0.0)) for offset in OFFSETS]
    changes += [(BASE_OFFSET, shift) for shift in ((SHIFT, 0.0), (-SHIFT, 0.0), (0.0, SHIFT), (0.0, -SHIFT))]
    result = np.zeros(base.shape[:2], dtype=bool)
    for offset, shift in changes:
        result |= np.abs(srgb(render(offset, shift)) - base).max(axis=2) > FRAGILE
    return result


def _check(ours: Picture, reference: Picture, *masks: NDArray[np.bool_] | None) -> None:
    shape = np.shape(ours)
    if len(shape) != 3 or shape[2] != 3 or min(shape[:2]) < _WINDOW:
        raise ValueError(f"ours: expected shape (h, w, 3) with h, w >= {_WINDOW}, got {shape}")
    if np.shape(reference) != shape:
        raise ValueError(f"reference: expected shape {shape} as ours, got {np.shape(reference)}")
    for name, picture in (("ours", ours), ("reference", reference)):
        bad = np.argwhere(~np.isfinite(picture))
        if len(bad):
            row, column, _ = bad[0].tolist()
            raise ValueError(
                f"{name}: expected finite radiance, got {picture[row, column]} in row {row}, column {column}"
            )
    for name, mask in zip(("fragile", "foreground"), masks, strict=True):
        if mask is not None and (mask.shape != shape[:2] or mask.dtype != np.bool_):
            raise ValueError(f"{name}: expected a bool mask of shape {shape[:2]}, got {mask.dtype} {mask.shape}")
    if masks[1] is not None and not masks[1].any():
        raise ValueError("foreground: expected at least one pixel, got none")

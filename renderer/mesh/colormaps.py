"""Colour maps, and values as colours."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.errors import expect

# Every seventeenth colour of matplotlib's maps. Straight lines between them stay within 8 of 255 of each channel.
# viridis and magma (Smith and van der Walt, matplotlib 1.5, CC0) have a lightness that rises evenly; coolwarm
# (Moreland, Diverging Color Maps for Scientific Visualization, 2009) is grey in the middle.
VIRIDIS = np.array([
    [68, 1, 84], [72, 26, 108], [71, 47, 125], [65, 68, 135], [57, 86, 140], [49, 104, 142], [42, 120, 142],
    [35, 136, 142], [31, 152, 139], [34, 168, 132], [53, 183, 121], [84, 197, 104], [122, 209, 81], [165, 219, 54],
    [210, 226, 27], [253, 231, 37],
], np.uint8)  # fmt: skip
_MAGMA = np.array([
    [0, 0, 4], [11, 9, 36], [32, 17, 75], [59, 15, 112], [87, 21, 126], [114, 31, 129], [140, 41, 129], [168, 50, 125],
    [196, 60, 117], [222, 73, 104], [241, 96, 93], [250, 127, 94], [254, 159, 109], [254, 191, 132], [253, 222, 160],
    [252, 253, 191],
], np.uint8)  # fmt: skip
_COOLWARM = np.array([
    [59, 76, 192], [79, 105, 217], [100, 133, 236], [123, 159, 249], [147, 181, 254], [170, 199, 253], [192, 212, 245],
    [212, 219, 230], [229, 216, 209], [242, 203, 183], [247, 184, 156], [245, 160, 129], [238, 132, 104],
    [224, 101, 79], [204, 64, 58], [180, 4, 38],
], np.uint8)  # fmt: skip
_GRAY = np.array([[0] * 3, [255] * 3], np.uint8)
COLORMAPS = {"viridis": VIRIDIS, "magma": _MAGMA, "coolwarm": _COOLWARM, "gray": _GRAY}
_STEPS = 256
# What has no value.
_GREY = 128


def scale_of(values: NDArray[np.float64]) -> tuple[float, float]:
    """Least and greatest of the values that are finite; (0, 0) without any."""
    known = values[np.isfinite(values)]
    return (float(known.min()), float(known.max())) if known.size else (0.0, 0.0)


def colors_of(values: NDArray[np.float64], scale: tuple[float, float], cmap: str = "viridis") -> NDArray[np.uint8]:
    """(..., 3) sRGB colours of a map from the scale's low end to its high one; grey where a value is not finite."""
    colors = np.full((*values.shape, 3), _GREY, np.uint8)
    known = np.isfinite(values)
    colors[known] = shades_of(values[known], *scale, cmap)
    return colors


def shades_of(values: NDArray[Any], low: float, high: float, cmap: str = "viridis") -> NDArray[np.uint8]:
    """The colours (..., 3) of values on a scale; beyond its ends they stay."""
    expect(isinstance(cmap, str) and cmap in COLORMAPS, "cmap", f"one of {list(COLORMAPS)}", repr(cmap))
    return _steps_of(COLORMAPS[cmap])[step_of(values, low, high)]


def step_of(values: NDArray[Any], low: float, high: float) -> NDArray[np.intp]:
    """The step of each value on a scale of 256; the first step where the scale has no length."""
    share = (values - low) / (high - low) if high > low else np.zeros(values.shape)
    return ((_STEPS - 1) * np.clip(share, 0.0, 1.0) + 0.5).astype(np.intp)


def _steps_of(colors: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """256 colours from one end of a map to the other, (256, 3)."""
    places = np.linspace(0.0, len(colors) - 1.0, _STEPS)
    channels = [np.interp(places, np.arange(len(colors)), colors[:, k]) for k in range(3)]
    return np.rint(np.stack(channels, axis=1)).astype(np.uint8)

"""Tone curves: linear radiance of any brightness as linear colours from 0 to 1, which are then encoded."""

from collections.abc import Callable
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

ToneName = Literal["srgb", "reinhard", "aces"]
TONES: tuple[str, ...] = get_args(ToneName)
# The luminance of linear sRGB, of ITU-R BT.709.
_LUMINANCE = 0.2126, 0.7152, 0.0722
# Radiance is clipped to this, whose square is a number.
_MOST = 1e100


def _reinhard(x: NDArray[np.float64]) -> NDArray[np.float64]:
    red, green, blue = (weight * x[..., k] for k, weight in enumerate(_LUMINANCE))
    # rule: tone-by-luminance
    luminance = red + green + blue
    return x / (1.0 + luminance)[..., None]


def _aces(x: NDArray[np.float64]) -> NDArray[np.float64]:
    # rule: aces-fit
    curve = x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14)
    return np.minimum(curve, 1.0)


_CURVES: dict[str, Callable[[NDArray[np.float64]], NDArray[np.float64]]] = {"reinhard": _reinhard, "aces": _aces}


def toned(radiance: NDArray[Any], tone: str) -> NDArray[Any]:
    """Linear radiance (..., 3) by one of ``TONES``; "srgb" changes no bit."""
    if tone == "srgb":
        return radiance
    x = np.clip(radiance, 0.0, _MOST, dtype=np.float64)
    return _CURVES[tone](x).astype(radiance.dtype)

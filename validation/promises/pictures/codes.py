"""The 8-bit codes of sRGB: each begins at the least number that the standard's formula rounds to it. Tone curves."""

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.picture.image import srgb
from renderer.picture.tone import toned
from validation.promises.row import row

# Rounding of a power in float64, in units of the last place of the number: how far a code's start may be off.
_ULPS = 16


def check_codes() -> list[dict[str, Any]]:
    """The numbers at each start, below and above it, in float64 and in float32."""
    starts = np.array([float(_start(code)) for code in range(1, 256)])
    codes = np.arange(1, 256)
    off = _ULPS * np.spacing(starts)
    below, above = starts - off, starts + off
    wide = (srgb(above) == codes) & (srgb(below) == codes - 1)
    # The float32 numbers at and beside each start have the codes of the same float64.
    single = np.concatenate([starts.astype(np.float32) + k * np.spacing(starts.astype(np.float32)) for k in (-1, 0, 1)])
    first = np.array([_first(below[i], above[i], codes[i]) for i in range(255)])
    expected = np.tile(codes - 1, 3) + (single.astype(np.float64) >= np.tile(first, 3))
    return [
        row("sRGB codes begin where the standard's formula says", "integer arithmetic", wide),
        row("float32 numbers get the codes of the same float64", "known answer",
            srgb(single.astype(np.float32)) == expected),
        row("tone curves are those of their authors", "rational arithmetic", _tones()),
    ]  # fmt: skip


def _tones() -> NDArray[np.bool_]:
    """Colours of all brightness, within the rounding of float32."""
    channels = [Fraction(0), *(Fraction(2) ** power for power in range(-12, 15, 2))]
    colors = [(a, b, c) for a in channels for b in channels for c in channels]
    radiance = np.array(colors, np.float32)
    kept = []
    for tone, curve in (("reinhard", _reinhard), ("aces", _aces)):
        expected = np.array([curve(color) for color in colors], np.float64)
        kept.append(np.abs(toned(radiance, tone) - expected) <= 2.0**-24 * expected)
    return np.concatenate(kept)


def _reinhard(color: Sequence[Fraction]) -> list[Fraction]:
    weights = Fraction("0.2126"), Fraction("0.7152"), Fraction("0.0722")
    luminance = sum(weight * x for weight, x in zip(weights, color, strict=True))
    return [x / (1 + luminance) for x in color]


def _aces(color: Sequence[Fraction]) -> list[Fraction]:
    a, b, c, d, e = map(Fraction, ("2.51", "0.03", "2.43", "0.59", "0.14"))
    return [min(Fraction(1), x * (a * x + b) / (x * (c * x + d) + e)) for x in color]


def _start(code: int) -> Fraction:
    """The least linear value that is encoded as ``code``, within 2^-80: bisection of y^5 = x^12, without a power."""
    encoded = (Fraction(code) - Fraction(1, 2)) / 255
    if encoded <= Fraction("12.92") * Fraction("0.0031308"):
        return encoded / Fraction("12.92")
    base = ((encoded + Fraction("0.055")) / Fraction("1.055")) ** 12
    low, high = 0, 1 << 80
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if Fraction(middle, 1 << 80) ** 5 <= base else (low, middle)
    return Fraction(low, 1 << 80)


def _first(below: float, above: float, code: int) -> float:
    """The first float64 of a code, between two numbers of which the upper has it."""
    while np.nextafter(below, above) < above:
        middle = below + (above - below) / 2
        below, above = (below, middle) if srgb(middle) >= code else (middle, above)
    return above

"""Values of textures: an image at texture coordinates, between its pixels and beyond its edges."""

import math
from typing import NamedTuple

import numpy as np

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.double_double import power_below
from renderer.numerics.simd import load, load4, maximum, minimum, splat4
from renderer.shade.records import (
    ACROSS,
    DOWN,
    FILTER,
    LEVELS,
    MIPMAP,
    MIRRORED,
    NEAREST,
    REPEAT,
    TEXEL,
    TEXTURE_COLUMNS,
    TRANSFORM,
    WRAP,
)

# Texels have red, green, blue and alpha.
CHANNELS = 4
# Coordinates beyond this, in images, are as there: whole numbers of texels end there.
_FARTHEST = 2.0**31
# The most means that a MIPMAP takes along an ellipse; one that is longer still blurs the texture.
_MOST_MEANS = 16
# An ellipse of more texels shows the mean of the whole image.
_LONGEST = 2.0**40


class Patch(NamedTuple):
    """Texture coordinates at a point, and around it the axes of an ellipse that a ray sees, in these coordinates."""

    u: float
    v: float
    along_u: float
    along_v: float
    across_u: float
    across_v: float


class _Level(NamedTuple):
    """An image or a smaller one of its pyramid: the place of the first texel, and the size."""

    first: int
    wide: int
    high: int


@kernel
def texture_at(textures, texels, texture, patch):
    """Four lanes, red, green, blue and alpha: a texture at the middle of a ``Patch``, a MIPMAP about its mean there."""
    row = texture * TEXTURE_COLUMNS
    x, y = _moved(textures, row, patch.u, patch.v)
    image = _Level(
        np.int64(load(textures, row + TEXEL)),
        np.int64(load(textures, row + ACROSS)),
        np.int64(load(textures, row + DOWN)),
    )
    filter_, wraps = load(textures, row + FILTER), (load(textures, row + WRAP), load(textures, row + WRAP + 1))
    if filter_ == NEAREST:
        return _nearest(texels, wraps, image, x, y)
    if filter_ == MIPMAP:
        along, longer, area = _ellipse(
            _turned(textures, row, image, patch.along_u, patch.along_v),
            _turned(textures, row, image, patch.across_u, patch.across_v),
        )
        if longer > 1.0:
            return _mean(texels, wraps, np.int64(load(textures, row + LEVELS)), image, (x, y), along, longer, area)
    return _between_four(texels, wraps, image, x, y)


@inlined
def _moved(textures, row, u, v):
    at = row + TRANSFORM
    # rule: moved-texture
    x = (load(textures, at) * u + load(textures, at + 1) * v) + load(textures, at + 2)
    y = (load(textures, at + 3) * u + load(textures, at + 4) * v) + load(textures, at + 5)
    return _within(x), _within(y)


@inlined
def _within(x):
    """The number or, if it is beyond, that at the end; 0 for NaN."""
    if abs(x) < _FARTHEST:
        return x
    return _FARTHEST if x > 0.0 else -_FARTHEST if x < 0.0 else 0.0


@inlined
def _turned(textures, row, image, u, v):
    """A vector of coordinates in texels."""
    at = row + TRANSFORM
    return (
        (load(textures, at) * u + load(textures, at + 1) * v) * image.wide,
        (load(textures, at + 3) * u + load(textures, at + 4) * v) * image.high,
    )


@inlined
def _ellipse(a, b):
    """The longer axis of the ellipse to which two vectors make a circle's radii, its length, and the product of both.

    The vectors are perpendicular before they are turned into texels, and seldom after that.
    """
    xx, yy, xy = a[0] * a[0] + b[0] * b[0], a[1] * a[1] + b[1] * b[1], a[0] * a[1] + b[0] * b[1]
    half = 0.5 * (xx - yy)
    root = math.sqrt(half * half + xy * xy)
    longer = math.sqrt(0.5 * (xx + yy) + root)
    x, y = (half + root, xy) if half >= 0.0 else (xy, root - half)
    size = math.sqrt(x * x + y * y)
    axis = (x * (longer / size), y * (longer / size)) if size > 0.0 else (longer, 0.0)
    return axis, longer, abs(a[0] * b[1] - a[1] * b[0])


@kernel
def _mean(texels, wraps, levels, image, middle, along, longer, area):
    """About the mean over an ellipse: that of several circles on its longer axis, which is above one texel.

    ``longer`` is the length of that axis, and ``area`` that of the ellipse times 4 / pi, in texels.
    """
    whole = not longer < _LONGEST
    # Fewer circles than would fill the ellipse are wider.
    # rule: mips-along-ellipse
    count = 1 if whole else np.int64(minimum(longer * longer / maximum(area, longer), _MOST_MEANS) + 0.5)
    # rule: mip-level
    number, share = _level_of(_LONGEST if whole else longer / count, levels)
    wide, high = image.wide, image.high
    # Of several circles each from one level, as their mean is smooth without blending.
    if count > 1:
        number, share = (number + 1, 0.0) if share > 0.5 else (number, 0.0)
    for _ in range(number):
        image = _half(image)
    total, x_step, y_step = splat4(0.0), along[0] / wide, along[1] / high
    for k in range(count):
        step = (k + 0.5) / count - 0.5
        x, y = middle[0] + (0.0 if whole else x_step * step), middle[1] + (0.0 if whole else y_step * step)
        found = _between_four(texels, wraps, image, x, y)
        if share > 0.0:
            found = _mixed(found, _between_four(texels, wraps, _half(image), x, y), share)
        total = total + found
    return total * (1.0 / count)


@inlined
def _half(image):
    """The next level of a pyramid."""
    return _Level(image.first + image.wide * image.high, maximum(image.wide // 2, 1), maximum(image.high // 2, 1))


@inlined
def _level_of(width, levels):
    """The finer of two levels whose texels have a width of so many, and the share of the coarser."""
    if width <= 1.0:
        return np.int64(0), 0.0
    power, level = power_below(width), np.int64(0)
    size = power
    while level < levels - 1 and size >= 2.0:
        size *= 0.5
        level += 1
    # Between two powers of two the nearer alone, but for the middle half of the way, where one gives way to the other.
    share = minimum(maximum(2.0 * (width / power) - 2.5, 0.0), 1.0) if level < levels - 1 else 0.0
    return (level + 1, 0.0) if share == 1.0 else (level, share)


@inlined
def _folded(rule, x):
    """A coordinate in images, moved into the first by what is beyond its edges."""
    if rule == REPEAT:
        return x - np.floor(x)
    if rule == MIRRORED:
        x -= 2.0 * np.floor(0.5 * x)
        # rule: mirrored-texture
        return 2.0 - x if x > 1.0 else x
    return x


@inlined
def _wrapped(rule, i, count):
    """The number of the texel that stands for the i-th of a row of ``count``, which is at most one beyond an end."""
    if rule == REPEAT:
        # rule: repeated-texture
        return i + count if i < 0 else i - count if i >= count else i
    return minimum(maximum(i, np.int64(0)), count - 1)


@inlined
def _column(wraps, image, i):
    return image.first + _wrapped(wraps[0], i, image.wide)


@inlined
def _line(wraps, image, j):
    # The first row is the upper one; v points up.
    # rule: row-of-texels
    return (image.high - 1 - _wrapped(wraps[1], j, image.high)) * image.wide


@inlined
def _place(wraps, image, x, y):
    """A place in texels."""
    x, y = _folded(wraps[0], x), _folded(wraps[1], y)
    return x * image.wide, y * image.high


@inlined
def _nearest(texels, wraps, image, x, y):
    x, y = _place(wraps, image, x, y)
    at = _column(wraps, image, np.int64(np.floor(x))) + _line(wraps, image, np.int64(np.floor(y)))
    return load4(texels, CHANNELS * at)


@kernel
def _between_four(texels, wraps, image, x, y):
    """The value at a place from the four texels around it."""
    # rule: texels-around
    x, y = _place(wraps, image, x, y)
    left, low = np.floor(x - 0.5), np.floor(y - 0.5)
    s, t, i, j = x - 0.5 - left, y - 0.5 - low, np.int64(left), np.int64(low)
    left, right = _column(wraps, image, i), _column(wraps, image, i + 1)
    low, high = _line(wraps, image, j), _line(wraps, image, j + 1)
    lower = _mixed(load4(texels, CHANNELS * (left + low)), load4(texels, CHANNELS * (right + low)), s)
    upper = _mixed(load4(texels, CHANNELS * (left + high)), load4(texels, CHANNELS * (right + high)), s)
    return _mixed(lower, upper, t)


@inlined
def _mixed(a, b, share):
    return a + (b - a) * share

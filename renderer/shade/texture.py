"""Values of textures: an image at texture coordinates, between its pixels and beyond its edges."""

import numpy as np

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.double_double import power_below
from renderer.numerics.simd import load, maximum, minimum
from renderer.shade.records import (
    ACROSS,
    CLAMP,
    DOWN,
    FILTER,
    LEVELS,
    MIPMAP,
    NEAREST,
    REPEAT,
    TEXEL,
    TEXTURE_COLUMNS,
    TRANSFORM,
    WRAP,
)

# Texels have red, green, blue and alpha.
CHANNELS = 4
# Coordinates beyond this, in images, are those of its corner: whole numbers of texels end there.
_FARTHEST = 2.0**31


@kernel
def texture_at(scene, texture, u, v, footprint):
    """Red, green, blue and alpha of a texture at texture coordinates.

    ``footprint`` is the width of what a ray sees, in units of the coordinates: a MIPMAP gives the mean over about that.
    """
    row = texture * TEXTURE_COLUMNS
    x, y = _moved(scene.textures, row, u, v)
    wide, high = np.int64(load(scene.textures, row + ACROSS)), np.int64(load(scene.textures, row + DOWN))
    filter_, first = load(scene.textures, row + FILTER), np.int64(load(scene.textures, row + TEXEL))
    if filter_ == NEAREST:
        return _nearest(scene, row, first, wide, high, x, y)
    if filter_ != MIPMAP:
        return _between_four(scene, row, first, wide, high, x, y)
    # The longer side of a pixel counts: rather blurred than shimmering.
    pixels = footprint * _stretch(scene.textures, row) * maximum(wide, high)
    level, share = _level_of(pixels, np.int64(load(scene.textures, row + LEVELS)))
    for _ in range(level):
        first, wide, high = first + wide * high, maximum(wide // 2, 1), maximum(high // 2, 1)
    near = _between_four(scene, row, first, wide, high, x, y)
    if share == 0.0:
        return near
    first, wide, high = first + wide * high, maximum(wide // 2, 1), maximum(high // 2, 1)
    return _mixed(near, _between_four(scene, row, first, wide, high, x, y), share)


@inlined
def _moved(textures, row, u, v):
    at = row + TRANSFORM
    x = (load(textures, at) * u + load(textures, at + 1) * v) + load(textures, at + 2)
    y = (load(textures, at + 3) * u + load(textures, at + 4) * v) + load(textures, at + 5)
    # NaN is beyond too.
    return x if abs(x) < _FARTHEST else 0.0, y if abs(y) < _FARTHEST else 0.0


@inlined
def _stretch(textures, row):
    """The most by which the rows of a texture stretch coordinates, along one of them."""
    at = row + TRANSFORM
    a, b = abs(load(textures, at)), abs(load(textures, at + 1))
    c, d = abs(load(textures, at + 3)), abs(load(textures, at + 4))
    return maximum(maximum(a, b), maximum(c, d))


@inlined
def _level_of(pixels, levels):
    """The finer of two levels whose texels have the width of so many pixels, and the share of the coarser."""
    if not pixels > 1.0:
        return np.int64(0), 0.0
    if not pixels < 2.0**30:
        return levels - 1, 0.0
    width, level = power_below(pixels), np.int64(0)
    while level < levels - 1 and width >= 2.0:
        width *= 0.5
        level += 1
    # Linear between two powers of two.
    return level, pixels / power_below(pixels) - 1.0 if level < levels - 1 else 0.0


@inlined
def _wrapped(rule, i, count):
    """The number of the texel that stands for the i-th of a row of ``count``."""
    if rule == CLAMP:
        return minimum(maximum(i, np.int64(0)), count - 1)
    if rule == REPEAT:
        return i % count
    there = i % (2 * count)
    return there if there < count else 2 * count - 1 - there


@inlined
def _texel(scene, row, first, wide, high, i, j):
    i = _wrapped(load(scene.textures, row + WRAP), i, wide)
    # The first row is the upper one; v points up.
    j = high - 1 - _wrapped(load(scene.textures, row + WRAP + 1), j, high)
    at = CHANNELS * (first + j * wide + i)
    return (
        np.float64(load(scene.texels, at)), np.float64(load(scene.texels, at + 1)),
        np.float64(load(scene.texels, at + 2)), np.float64(load(scene.texels, at + 3)),
    )  # fmt: skip


@inlined
def _nearest(scene, row, first, wide, high, x, y):
    return _texel(scene, row, first, wide, high, np.int64(np.floor(x * wide)), np.int64(np.floor(y * high)))


@kernel
def _between_four(scene, row, first, wide, high, x, y):
    """The value at a place from the four texels around it."""
    x, y = x * wide - 0.5, y * high - 0.5
    left, low = np.floor(x), np.floor(y)
    i, j, s, t = np.int64(left), np.int64(low), x - left, y - low
    lower = _mixed(_texel(scene, row, first, wide, high, i, j), _texel(scene, row, first, wide, high, i + 1, j), s)
    upper = _mixed(
        _texel(scene, row, first, wide, high, i, j + 1), _texel(scene, row, first, wide, high, i + 1, j + 1), s
    )
    return _mixed(lower, upper, t)


@inlined
def _mixed(a, b, share):
    return (
        a[0] + (b[0] - a[0]) * share, a[1] + (b[1] - a[1]) * share,
        a[2] + (b[2] - a[2]) * share, a[3] + (b[3] - a[3]) * share,
    )  # fmt: skip

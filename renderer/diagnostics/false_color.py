"""The AOVs of a picture drawn as colours: depth, normal, face, and the cost of each pixel."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.errors import expect
from renderer.mesh.colormaps import VIRIDIS, shades_of, step_of
from renderer.picture.image import Image, srgb

__all__ = ["AOVS", "VIRIDIS", "false_color", "limits_of", "limits_of_counts", "scale_colors", "shades_of"]

AOVS = "color", "depth", "normal", "face", "cost"
Limits = tuple[float, float]

_STEPS = 256
# The greys of the nearest and the farthest surface; black and white stay free for backgrounds.
_NEAR, _FAR = 240, 30
# The least value of a face's red, green and blue, so that none is near black.
_DARKEST = 48
# The most colours of faces: of more, a picture of a million pixels shows noise in place of surfaces. The faces of a
# group differ by a factor from _DIMMEST to 1, which is seen close by and leaves groups apart.
_GROUPS, _DIMMEST = 512, 0.7


def false_color(image: Image, aov: str, limits: Limits | None = None, faces: int = 0) -> NDArray[np.uint8]:
    """Draw an AOV of a picture, (h, w, 3) uint8 sRGB.

    color   the radiance itself
    depth   grey, the nearest surface the brightest
    normal  0.5 + 0.5 n: x, y, z of the shading normal as red, green, blue
    face    a colour for each face, the same in every picture of the mesh; where the mesh has more than 512 ``faces``,
            one for each of as many groups of neighbours in its list, and a shade of it for each face
    cost    rays traced for the pixel, all samples together, from dark blue (few) over green to yellow (many)

    Where nothing was hit, all but the cost show the radiance, which is the background. The scales of depth and cost go
    from ``limits[0]`` to ``limits[1]``, beyond which colours stay; None takes ``limits_of`` the picture. Raises
    ``ValueError`` naming the argument.
    """
    expect(aov in AOVS, "aov", f"one of {list(AOVS)}", repr(aov))
    low, high = limits_of(image, aov) if limits is None else limits
    expect(bool(np.isfinite((low, high)).all()) and low <= high, "limits", "finite low <= high", repr(limits))
    hit = image.face >= 0
    if aov == "color":
        return srgb(image.radiance)
    if aov == "cost":
        return shades_of(image.rays, low, high)
    colors = np.empty((*hit.shape, 3), np.uint8)
    colors[~hit] = srgb(image.radiance[~hit])
    if aov == "depth":
        greys = np.rint(np.linspace(_NEAR, _FAR, _STEPS)).astype(np.uint8)
        colors[hit] = greys[step_of(image.depth[hit], low, high), None]
    else:
        colors[hit] = _face_colors(image.face[hit], faces) if aov == "face" else _normal_colors(image.normal[hit])
    return colors


def limits_of(image: Image, aov: str) -> Limits:
    """Least and greatest depth of a surface, or ``limits_of_counts`` of the cost: the ends of a legend's scale.

    (0, 0) for other AOVs and where there is nothing.
    """
    if aov not in ("depth", "cost"):  # whose picture may lack these planes
        return (0.0, 0.0)
    if aov == "cost":
        return limits_of_counts(image.rays)
    values = image.depth[image.face >= 0]
    return (float(values.min()), float(values.max())) if values.size else (0.0, 0.0)


def limits_of_counts(counts: NDArray[np.integer[Any]]) -> Limits:
    """The least count and the one that 1 % of pixels exceed: a few of them would leave all others in one colour."""
    if not counts.size:
        return (0.0, 0.0)
    return float(counts.min()), float(np.percentile(counts, 99.0, method="higher"))


def scale_colors(aov: str) -> NDArray[np.uint8]:
    """The colours (n, 3) of a scale from its least value to its greatest, at even steps, for a legend."""
    if aov == "depth":
        return np.repeat(np.array([[_NEAR], [_FAR]], np.uint8), 3, axis=1)
    return VIRIDIS.copy()


def _normal_colors(normals: NDArray[np.float32]) -> NDArray[np.uint8]:
    """(n, 3) unit vectors as colours."""
    return (np.clip(0.5 + 0.5 * normals, 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)


def _face_colors(faces: NDArray[np.int32], count: int) -> NDArray[np.uint8]:
    """(n, 3) colours of face numbers of a mesh that has ``count``."""
    size = -(-max(count, 1) // _GROUPS)
    colors = _hashed(faces // size)
    if size == 1:
        return colors
    shades = _DIMMEST + (1.0 - _DIMMEST) / 255.0 * _hashed(faces)[:, :1]
    return np.rint(shades * colors).astype(np.uint8)


def _hashed(numbers: NDArray[np.int32]) -> NDArray[np.uint8]:
    """(n, 3) colours of numbers, by a hash, so that neighbouring ones get unlike colours.

    lowbias32 of Chris Wellons, Prospecting for Hash Functions, 2018 (public domain).
    """
    x = numbers.astype(np.uint32)
    x = (x ^ x >> np.uint32(16)) * np.uint32(0x7FEB352D)
    x = (x ^ x >> np.uint32(15)) * np.uint32(0x846CA68B)
    x = x ^ x >> np.uint32(16)
    channels = np.stack([x & 255, x >> np.uint32(8) & 255, x >> np.uint32(16) & 255], axis=-1)
    return (_DARKEST + channels * (255 - _DARKEST) // 255).astype(np.uint8)

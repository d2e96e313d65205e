"""Textures: texels by the index arithmetic of OpenGL's specification, and means of many texels."""

from itertools import product
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.materials.phong import Phong
from renderer.mesh.mesh import Mesh
from renderer.mesh.texture import Filter, Texture, Wrap
from renderer.scene.camera import PerspectiveCamera
from renderer.scene.scene import Scene
from validation.promises.pictures.glowing import Floats, shown, square, thing
from validation.promises.pictures.textured import CORNERS, across, close, linear, pixels, screen, seen, sheet
from validation.promises.row import figure, row

Bools = NDArray[np.bool_]
_WRAPS: tuple[Wrap, ...] = ("repeat", "mirror", "clamp")
# At this size no filter sees more than one texel in a pixel.
_SIZE = 48
_OPENGL = "OpenGL's formulas"
# Samples of the picture that stands for the truth, and the largest error of one sample beside it. Squares of 0.1 and
# 0.9 are 0.4 off their mean; a filter that blurs too little or too much is beyond half of this.
_MANY, _ERROR, _SHIMMER = 256, 0.05, 0.2


def check_textures(rng: Generator) -> list[dict[str, Any]]:
    """Images of few texels on a square, and a floor of fine squares."""
    errors = _errors()
    return [
        row("a texture is read by its filter, wraps and transform", _OPENGL, _read(rng)),
        row("texture coordinates are linear on each face", _OPENGL, _interpolated(rng)),
        row("integers of colours are sRGB, and floats linear", "IEC 61966-2-1", _codes(rng)),
        row("a checker has its first colour in the lower left", "closed form", _checker()),
        row("a pixel that sees a block of texels shows their mean", "closed form", _blocks(rng)),
        figure("one sample of a floor of fine squares is near the mean of many", f"{_MANY} samples",
               "RMS of mip maps beside many samples", errors["mipmap"], _ERROR),
        row("a floor without mip maps shimmers", f"{_MANY} samples", np.array([errors["nearest"] > _SHIMMER])),
    ]  # fmt: skip


def _read(rng: Generator) -> Bools:
    """Skewed transforms, which lead up to four images beyond the edges; magnified, mip maps are linear."""
    kept = []
    filters: tuple[Filter, ...] = ("nearest", "linear", "mipmap")
    for filter, wraps in product(filters, product(_WRAPS, _WRAPS)):
        image, rows = rng.random((5, 7, 3), np.float32), rng.uniform(-2.0, 2.0, (2, 3))
        found = seen((sheet(), screen(Texture(image, rows, wraps, filter))), size=_SIZE)
        kept.append(close(found, _value(image, _moved(rows, *pixels(_SIZE)), filter, wraps)))
    return np.concatenate(kept)


def _moved(rows: Floats, u: Floats, v: Floats) -> tuple[Floats, Floats]:
    return rows[0, 0] * u + rows[0, 1] * v + rows[0, 2], rows[1, 0] * u + rows[1, 1] * v + rows[1, 2]


def _value(image: NDArray[np.float32], at: tuple[Floats, Floats], filter: Filter, wraps: tuple[Wrap, Wrap]) -> Floats:
    """The texel that has a place within it, or the mean of the four around it, by their distances."""
    high, wide = image.shape[:2]
    x, y = at[0] * wide, at[1] * high
    if filter == "nearest":
        return _texel(image, np.floor(x), np.floor(y), wraps)
    i, j = np.floor(x - 0.5), np.floor(y - 0.5)
    s, t = (x - 0.5 - i)[..., None], (y - 0.5 - j)[..., None]
    corners = [[_texel(image, i + p, j + q, wraps) for p in (0, 1)] for q in (0, 1)]
    lower, upper = ((1.0 - s) * left + s * right for left, right in corners)
    return (1.0 - t) * lower + t * upper


def _texel(image: NDArray[np.float32], i: Floats, j: Floats, wraps: tuple[Wrap, Wrap]) -> Floats:
    """Texels by their numbers from the left and from below."""
    high, wide = image.shape[:2]
    found: Floats = image[high - 1 - _wrapped(j, high, wraps[1]), _wrapped(i, wide, wraps[0])].astype(np.float64)
    return found


def _wrapped(i: Floats, count: int, wrap: Wrap) -> NDArray[np.int64]:
    number = i.astype(np.int64)
    if wrap == "clamp":
        return np.clip(number, 0, count - 1)
    if wrap == "repeat":
        return number % count
    number = number % (2 * count)
    return np.where(number < count, number, 2 * count - 1 - number)


def _interpolated(rng: Generator) -> Bools:
    image, texcoords = rng.random((5, 7, 3), np.float32), CORNERS + rng.uniform(-0.4, 0.4, (4, 2))
    found = seen((sheet(texcoords), screen(Texture(image, filter="linear"))), size=_SIZE)
    u, v = np.moveaxis(across(texcoords, *pixels(_SIZE)), -1, 0)
    return close(found, _value(image, (u, v), "linear", ("repeat", "repeat")))


def _codes(rng: Generator) -> Bools:
    """Every code of 8 bits, and some of 16, in grey and in colour."""
    codes, many = np.arange(256, dtype=np.uint8).reshape(16, 16), rng.integers(0, 1 << 16, (16, 16, 3), np.uint16)
    shares = rng.random((16, 16, 3), np.float32)
    images = (
        (codes[..., None], linear(codes / 255.0)[..., None]), (np.stack([codes, codes.T, codes[::-1]], axis=-1), None),
        (many, linear(many / 65535.0)), (shares, shares),
    )  # fmt: skip
    kept = []
    for image, expected in images:
        found = seen((sheet(), screen(Texture(image, filter="nearest"))), size=16)
        kept.append(close(found, linear(image / 255.0) if expected is None else expected))
    return np.concatenate(kept)


def _checker() -> Bools:
    first, (x, y), kept = np.array([0.25, 0.5, 1.0]), pixels(_SIZE), []
    for squares in ((8, 4), (3, 5), (1, 1)):
        found = seen((sheet(), screen(Texture.checker(first, 0.125, squares=squares))), size=_SIZE)
        is_first = (np.floor(x * squares[0]) + np.floor(y * squares[1])) % 2 == 0
        kept.append(close(found, np.where(is_first[..., None], first, 0.125)))
    return np.concatenate(kept)


def _blocks(rng: Generator) -> Bools:
    """Blocks with sides of powers of two, long ones too, each beneath one pixel."""
    kept, size = [], 8
    for wide, high in ((2, 2), (4, 4), (8, 8), (4, 1), (1, 8), (8, 2)):
        image = rng.random((size * high, size * wide, 3), np.float32)
        found = seen((sheet(), screen(Texture(image))), size=size)
        kept.append(close(found, image.reshape(size, high, size, wide, 3).mean(axis=(1, 3), dtype=np.float64)))
    return np.concatenate(kept)


def _errors() -> dict[str, float]:
    """The root mean square by which one sample differs from many, up to the horizon."""
    truth, far = _floor("linear", _MANY), slice(36, 60)
    single: tuple[Filter, ...] = ("mipmap", "nearest")
    return {name: float(np.sqrt(np.mean((_floor(name, 1) - truth)[far] ** 2))) for name in single}


def _floor(filter: Filter, samples: int) -> NDArray[np.float32]:
    """A floor of squares to the horizon, from a low eye."""
    squares = np.kron([[0.9, 0.1], [0.1, 0.9]], np.ones((16, 16)))[..., None].astype(np.float32)
    flat = square(np.array([-30.0, 0.0, 0.0]), np.array([60.0, 0.0, 0.0]), np.array([0.0, 0.0, -60.0]))
    floor = Mesh(flat.vertices, flat.faces, texcoords=flat.vertices[:, [0, 2]])
    camera = PerspectiveCamera(eye=(0.3, 1.0, 1.0), target=(0.0, 0.7, -1.0), fov=50.0)
    materials: dict[str, Phong] = {"tiles": screen(Texture(squares, filter=filter))}
    scene = Scene(camera=camera, materials=materials, objects=(thing(floor, "tiles"),), background=0.5)
    return shown(scene, (96, 96), samples=samples)

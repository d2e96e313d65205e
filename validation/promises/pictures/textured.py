"""A unit square with texture coordinates, seen from above, and colours read from images by hand."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.materials.phong import Phong
from renderer.materials.registry import Material
from renderer.mesh.mesh import Mesh
from renderer.mesh.texture import Texture
from renderer.scene.scene import Scene
from validation.promises.pictures.glowing import Floats, from_above, shown, square, thing

# x grows to the right of the picture and with u, and y up it and with v.
CORNERS = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
# Texels and colours of pictures are float32, of which a few are multiplied and added.
CLOSE = 4e-6


def sheet(texcoords: Floats = CORNERS, height: float = 0.0, colors: Any = None) -> Mesh:
    """A square above the unit square. The first edges of both faces are along x: pixels are measured along these."""
    flat = square(np.array([0.0, height, 1.0]), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, -1.0]))
    return Mesh(flat.vertices, [[0, 1, 2], [2, 3, 0]], texcoords=texcoords, colors=colors)


def pixels(size: int) -> tuple[Floats, Floats]:
    """x and y in the middle of each pixel."""
    middles = (np.arange(size) + 0.5) / size
    x, y = np.meshgrid(middles, 1.0 - middles)
    return x, y


def seen(*layers: tuple[Mesh, Material], size: int, eye: float = 9.0, **given: Any) -> NDArray[np.float32]:
    """The radiance of sheets with their materials, from above in parallel rays unless another ``camera`` is given."""
    materials = {str(k): material for k, (_, material) in enumerate(layers)}
    objects = tuple(thing(mesh, str(k)) for k, (mesh, _) in enumerate(layers))
    view = {"camera": from_above((0.5, eye, 0.5), 1.0), **given}
    return shown(Scene(materials=materials, objects=objects, **view), (size, size))


def screen(texture: Texture) -> Phong:
    """A material that shows a texture as it is."""
    return Phong(diffuse=0.0, emission_map=texture)


def even(color: Any) -> Texture:
    """A texture of one linear value."""
    return Texture(np.array([[color]], np.float32))


def close(found: NDArray[np.float32], expected: Any) -> NDArray[np.bool_]:
    """Whether each pixel is within rounding of the colour expected of it."""
    kept: NDArray[np.bool_] = (np.abs(found - expected) <= CLOSE * np.maximum(1.0, np.abs(expected))).all(axis=-1)
    return kept.ravel()


def across(values: Floats, x: Floats, y: Floats) -> Floats:
    """The values (4, n) of a sheet's corners, interpolated linearly on each of its two triangles."""
    a, b, c, d = values
    x, y = x[..., None], y[..., None]
    return np.where(y < x, a + (b - a) * x + (c - b) * y, a + (d - a) * y + (c - d) * x)


def linear(encoded: Any) -> Floats:
    """Linear values of sRGB ones, by IEC 61966-2-1."""
    share = np.asarray(encoded, np.float64)
    return np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)

"""Textures and colours of vertices as the Whitted kernel reads them."""

from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.errors import expect
from renderer.materials.appearance import Appearance
from renderer.mesh.mesh import Mesh
from renderer.mesh.texture import Texture
from renderer.mesh.texture_image import TextureImage, value_of_one
from renderer.scene.instance import Instance
from renderer.shade.records import (
    CLAMP,
    COLORS,
    CUTOFF,
    EMISSION,
    LINEAR,
    MAP_COLUMNS,
    MAPPED,
    MIPMAP,
    MIRRORED,
    NEAREST,
    NORMAL_MAP,
    OPACITY,
    OPACITY_MAP,
    REPEAT,
    TEXTURE_COLUMNS,
    TINTED,
)

_WRAPS = {"repeat": REPEAT, "mirror": MIRRORED, "clamp": CLAMP}
_FILTERS = {"nearest": NEAREST, "linear": LINEAR, "mipmap": MIPMAP}
# The maps in the order of ``records.COLORS``.
_COLOR_MAPS = ("ambient_map", "diffuse_map", "specular_map", "reflectance_map", "transmittance_map", "emission_map")
assert len(_COLOR_MAPS) == len(COLORS) + 1


class Maps(NamedTuple):
    """The ``maps``, ``textures`` and ``texels`` of ``SceneArrays``."""

    maps: NDArray[np.float64]
    textures: NDArray[Any]
    texels: NDArray[np.float32]


def maps_of(looks: Iterable[Appearance]) -> Maps:
    """The textures of materials, each image once. Raises ``MeshError`` for an image that cannot be read."""
    images = _Images()
    textures: dict[tuple[Texture, bool], int] = {}

    def number(texture: Texture | None, is_color: bool) -> float:
        return -1.0 if texture is None else float(textures.setdefault((texture, is_color), len(textures)))

    rows = [_row(look, number) for look in looks]
    table = [
        _texture_row(texture, *images.placed(texture.image, is_color, texture.filter)) for texture, is_color in textures
    ]
    return Maps(np.array(rows).reshape(-1, MAP_COLUMNS), np.array(table).reshape(-1, TEXTURE_COLUMNS), images.texels())


def _row(look: Appearance, number: Any) -> NDArray[np.float64]:
    """A material's row of ``maps``."""
    row = np.zeros(MAP_COLUMNS)
    for k, name in enumerate(_COLOR_MAPS):
        row[k] = number(look.textures.get(name), True)
    row[EMISSION : EMISSION + 3] = look.emission
    for column, name in ((NORMAL_MAP, "normal_map"), (OPACITY_MAP, "opacity_map")):
        # rule: maps-of-data
        row[column] = number(look.textures.get(name), False)
    row[OPACITY], row[CUTOFF] = look.opacity, look.cutoff
    row[TINTED], row[MAPPED] = look.vertex_colors is not None, bool(look.textures)
    return row


def _texture_row(texture: Texture, first: int, size: tuple[int, int], levels: int) -> NDArray[np.float64]:
    wraps = [_WRAPS[wrap] for wrap in texture.wrap]
    moved = np.ravel(texture.transform)
    return np.array([first, *size, levels, *wraps, _FILTERS[texture.filter], texture.strength, *moved], np.float64)


class _Images:
    """The texels of images, level after level, each image once for colours and once for data."""

    def __init__(self) -> None:
        self._placed: dict[tuple[TextureImage, bool, bool], tuple[int, tuple[int, int], int]] = {}
        self._levels = list[NDArray[np.float32]]()
        self._end = 0

    def placed(self, image: TextureImage, is_color: bool, filter: str) -> tuple[int, tuple[int, int], int]:
        """The place of an image's first texel, its size, and how many levels it has."""
        # rule: floats-are-linear
        key = (image, is_color and image.pixels.dtype.kind == "u", filter == "mipmap")
        if key not in self._placed:
            levels = list(_pyramid(_linear(image.pixels, key[1]), key[2]))
            high, wide = levels[0].shape[:2]
            self._placed[key] = self._end, (wide, high), len(levels)
            self._levels += [level.reshape(-1, 4) for level in levels]
            self._end += sum(level.shape[0] * level.shape[1] for level in levels)
        return self._placed[key]

    def texels(self) -> NDArray[np.float32]:
        return np.concatenate([np.zeros((0, 4), np.float32), *self._levels]).reshape(-1)


def _linear(pixels: NDArray[Any], is_srgb: bool) -> NDArray[np.float32]:
    """Linear red, green, blue and alpha (h, w, 4), float32."""
    found = np.ones((*pixels.shape[:2], 4), np.float32)
    channels = pixels.shape[2]
    alpha = channels in (2, 4)
    most = value_of_one(pixels)
    colors = pixels[..., : channels - alpha]
    # rule: linear-of-srgb
    if is_srgb:
        colors = linear_of_srgb(np.arange(most + 1.0) / most).astype(np.float32)[colors]
    else:
        colors = colors / np.float64(most)
    found[..., :3] = colors
    if alpha:
        # rule: alpha-of-image
        found[..., 3] = pixels[..., -1] / most
    elif channels == 1:
        # A grey image may be the opacity itself.
        found[..., 3] = pixels[..., 0] / most
    return found


def linear_of_srgb(encoded: NDArray[Any]) -> NDArray[np.float64]:
    """Linear values of sRGB values from 0 to 1 (IEC 61966-2-1)."""
    low: NDArray[np.float64] = encoded / 12.92
    # rule: toe-of-srgb
    return np.where(encoded <= 0.04045, low, ((encoded + 0.055) / 1.055) ** 2.4)


def _pyramid(level: NDArray[np.float32], whole: bool) -> Iterator[NDArray[np.float32]]:
    """An image and, if the ``whole`` pyramid is wanted, means of it with half the sides each, down to one texel."""
    yield level
    while whole and max(level.shape[:2]) > 1:
        level = np.swapaxes(_halved(np.swapaxes(_halved(level), 0, 1)), 0, 1)
        yield level


def _halved(rows: NDArray[np.float32]) -> NDArray[np.float32]:
    """The means of two rows each; of an odd number, of two and a part of a third."""
    count, half = len(rows), len(rows) // 2
    if half == 0:
        return rows
    if count % 2 == 0:
        first, second = rows[::2], rows[1::2]
        # rule: mean-of-texels
        return np.float32(0.5) * (first + second)
    after = (np.arange(1, half + 1) / count).astype(np.float32)[:, None, None]
    return after[::-1] * rows[:-1:2] + np.float32(half / count) * rows[1::2] + after * rows[2::2]


def texcoords_of(instance: Instance, mesh: Mesh, look: Appearance) -> NDArray[np.float64]:
    """The texture coordinates of a mesh's vertices, (V, 2); zero where its material has no texture.

    Raises ``ValueError`` if it has one, and the mesh has no coordinates.
    """
    if mesh.texcoords is not None:
        return mesh.texcoords
    whose = f"mesh {mesh.name!r} of material {instance.material!r}"
    expect(not look.textures, whose, f"texture coordinates for its {next(iter(look.textures), '')}", "none")
    return np.zeros((len(mesh.vertices), 2))


def tints_of(instance: Instance, mesh: Mesh, look: Appearance) -> NDArray[np.float64]:
    """The linear colours of a mesh's vertices, (V, 3); white where its material does not use them.

    Raises ``ValueError`` if it does, and the mesh has none.
    """
    space = look.vertex_colors
    if space is None:
        return np.ones((len(mesh.vertices), 3))
    whose = f"mesh {mesh.name!r} of material {instance.material!r}"
    expect(mesh.colors is not None, whose, "colours of vertices for its vertex_colors", "none")
    colors = np.asarray(mesh.colors, np.float64)
    # rule: space-of-vertex-colours
    return linear_of_srgb(colors) if space == "srgb" else colors

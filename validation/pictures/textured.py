"""Scenes of a few faces, one for each kind of texture, which the references draw by Mitsuba's own plugins.

Images are of few large pixels, so that filters and wraps are seen, and nothing in them is symmetric.
"""

from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.materials.mirror import Mirror
from renderer.materials.phong import Phong
from renderer.materials.registry import Material
from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import icosphere
from renderer.mesh.texture import Texture
from renderer.scene.camera import PerspectiveCamera
from renderer.scene.light import DirectionalLight, PointLight
from renderer.scene.scene import RenderSettings, Scene, SceneObject

_CAMERA = PerspectiveCamera(eye=(0.4, 2.1, 3.9), target=(0.03, 0.35, 0.02), fov=41.0)
_LIGHTS = (
    DirectionalLight(direction=(0.5, -1.3, -0.6), irradiance=(0.3, 0.4, 0.35)),
    PointLight(position=(1.7, 3.1, 1.4), intensity=(2.4, 2.1, 1.8)),
)
# From texture coordinates to an image: turned, stretched and moved.
_MOVED = ((1.31, 0.42, 0.17), (-0.37, 0.94, -0.23))
_GREY = Phong(diffuse=0.5)
_MIRROR = Mirror(reflectance=(0.9, 0.8, 0.7))


class Row(NamedTuple):
    """A scene, its name, and what it shows."""

    name: str
    shows: str
    scene: Scene


def rows() -> list[Row]:
    """The scenes, by kinds of textures."""
    codes, alpha = _noise(1, 5, 7, 3), np.dstack([_noise(2, 4, 6, 3), _noise(3, 4, 6, 1)])
    values = _noise(4, 6, 4, 3).astype(np.float32) / 255.0
    nearest = {wrap: Texture(codes, _MOVED, (wrap, wrap), "nearest") for wrap in ("mirror", "clamp")}
    smooth: dict[str, Any] = {"transform": _MOVED, "filter": "linear"}
    return [
        _row("sRGB images", "bilinear, repeated", Phong(diffuse_map=Texture(codes, **smooth))),
        _row("linear images", "bilinear, repeated", _shiny(Texture(values, **smooth))),
        _row("mirrored images", "the nearest pixel", Phong(diffuse_map=nearest["mirror"])),
        _row("clamped images", "the nearest pixel", Phong(diffuse_map=nearest["clamp"])),
        _row("checkers", "squares of two colours", Phong(diffuse_map=_checker())),
        _row("colours of vertices", "sRGB and linear", Phong(vertex_colors="srgb"), Phong(vertex_colors="linear")),
        _row("normal maps", "on mirrored texture coordinates too", *_bumpy(Texture(_normals(), **smooth))),
        _row("masks", "and their shadows", _GREY, Phong(cutoff=0.5, opacity_map=Texture(alpha, **smooth))),
        _row("blends", "by an image's alpha", _GREY, Phong(opacity=0.9, opacity_map=Texture(alpha, **smooth))),
        _row("emission", "beside ambient light", Phong(diffuse=0.3, emission_map=Texture(codes, **smooth)),
             Phong(diffuse=0.2, emission=(0.1, 0.2, 0.4))),
    ]  # fmt: skip


def _row(name: str, shows: str, ground: Material, leaf: Material | None = None) -> Row:
    """A ground, a ball on it, a mirror behind it and a leaf above it; the leaf is of the ground's material if of no
    other, and the ball of the leaf's.
    """
    parts: list[tuple[str, Mesh, Literal["flat", "smooth"]]] = [
        ("ground", _ground(), "flat"),
        ("leaf", _ball(), "smooth"),
        ("leaf", _leaf(), "flat"),
        ("mirror", _wall(), "flat"),
    ]
    scene = Scene(
        camera=_CAMERA,
        materials={"ground": ground, "leaf": leaf or ground, "mirror": _MIRROR},
        objects=tuple(SceneObject(mesh=mesh, material=which, normals=normals) for which, mesh, normals in parts),
        lights=_LIGHTS,
        ambient=(0.1, 0.15, 0.2),
        background=(0.2, 0.3, 0.5),
        render=RenderSettings(resolution=(192, 128)),
    )
    return Row(f"textures: {name}", shows, scene)


def _shiny(texture: Texture) -> Phong:
    return Phong(diffuse=0.4, specular=0.6, specular_map=texture, reflectance=0.5, reflectance_map=texture, shininess=9)


def _checker() -> Texture:
    return Texture.checker((0.9, 0.5, 0.1), (0.1, 0.2, 0.4), squares=(7.3, 4.6))


def _bumpy(texture: Texture) -> tuple[Phong, Phong]:
    weak = Texture(texture.image, texture.transform, filter="linear", strength=0.6)
    return Phong(normal_map=texture), Phong(diffuse=0.3, specular=0.4, reflectance=0.4, normal_map=weak)


def _noise(seed: int, high: int, wide: int, channels: int) -> NDArray[np.uint8]:
    return np.random.default_rng(seed).integers(0, 256, (high, wide, channels), np.uint8)


def _normals() -> NDArray[np.uint8]:
    """Codes of normals that lean up to 30 degrees."""
    leaning = np.random.default_rng(5).uniform(-0.5, 0.5, (5, 6, 2))
    up = np.sqrt(1.0 - (leaning**2).sum(axis=2, keepdims=True))
    return np.round(255.0 * 0.5 * (np.concatenate([leaning, up], axis=2) + 1.0)).astype(np.uint8)


def _quad(corners: list[list[float]], texcoords: list[list[float]]) -> Mesh:
    colors = np.random.default_rng(6).uniform(0.0, 1.0, (4, 3))
    return Mesh(corners, [[0, 1, 2], [0, 2, 3]], colors=colors, texcoords=texcoords)


def _ground() -> Mesh:
    corners = [[-2.3, 0.0, 2.2], [2.4, 0.0, 2.1], [2.3, 0.0, -2.2], [-2.4, 0.0, -2.3]]
    return _quad(corners, [[-0.6, -0.7], [1.9, -0.5], [2.1, 1.8], [-0.7, 1.6]])


def _leaf() -> Mesh:
    """Above the ground, with an image that is mirrored on it."""
    corners = [[-1.4, 0.6, 0.9], [-0.2, 0.7, 1.1], [-0.1, 1.3, -0.2], [-1.3, 1.2, -0.3]]
    return _quad(corners, [[1.3, -0.2], [-0.4, -0.1], [-0.3, 1.2], [1.4, 1.1]])


def _wall() -> Mesh:
    return Mesh([[-2.5, 0.0, -1.7], [1.4, 0.0, -2.1], [1.5, 2.4, -2.2], [-2.4, 2.5, -1.8]], [[0, 1, 2], [0, 2, 3]])


def _ball() -> Mesh:
    """A ball whose texture coordinates are a view of it from the side, mirrored on the far half."""
    made = icosphere(3)
    vertices = 0.5 * np.asarray(made.vertices) + [0.9, 0.55, 0.3]
    x, y, z = np.asarray(made.vertices).T
    texcoords = np.column_stack([0.9 * x + 0.31 * z, 0.8 * y - 0.27 * z])
    return Mesh(vertices, made.faces, colors=np.column_stack([x, y, z]) / 2.0 + 0.5, texcoords=texcoords)

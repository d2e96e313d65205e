"""The reflectance and emission of faces, from the materials of a scene; and what radiosity leaves out."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.errors import expect
from renderer.materials.appearance import BLACK, Appearance
from renderer.materials.base import appearance_of
from renderer.materials.phong import Phong
from renderer.materials.registry import Material
from renderer.mesh.mesh import Mesh
from renderer.mesh.texture import Texture
from renderer.mesh.texture_image import value_of_one
from renderer.picture.maps import linear_of_srgb, tints_of
from renderer.scene.instance import Instance
from renderer.scene.scene import Scene

Floats = NDArray[np.float64]


class Look(NamedTuple):
    """A material as radiosity takes it.

    diffuse   (F, 3), the share of light that each face returns
    emission  (F, 3), the radiance that each face emits
    detail    (3,), the mean of the texture that pictures still show on top of the light, 1 without one
    """

    diffuse: Floats
    emission: Floats
    detail: Floats


def look_of(material: Material, instance: Instance, mesh: Mesh) -> Look | None:
    """The ``Look`` of a material on the faces of ``mesh``, which is that of ``instance`` cut into patches; None if it
    neither returns light evenly nor emits any.
    """
    look = appearance_of(material)
    if not (any(look.diffuse) or any(look.emission)):
        return None
    tint = tints_of(instance, mesh, look)[mesh.faces].mean(axis=1)
    detail, glow = (_mean_of(look.textures.get(f"{name}_map")) for name in ("diffuse", "emission"))
    diffuse, emission = look.diffuse * detail * tint, look.emission * glow * tint
    return Look(diffuse, emission, detail if shows_detail(look) else np.ones(3))


def shows_detail(look: Appearance) -> bool:
    """Whether pictures show the texture of diffuse light: what a surface emits beside it would be textured, too."""
    return "diffuse_map" in look.textures and not any(look.emission)


def lit_material(material: Material, brightness: Floats) -> Phong:
    """The material that shows colours of vertices times ``brightness`` (3,), and mirrors and lets through as before."""
    assert isinstance(material, Phong)
    dark = dict.fromkeys(("diffuse", "ambient", "specular"), BLACK)
    maps = dict.fromkeys(("diffuse_map", "ambient_map", "specular_map", "emission_map"))
    if shows_detail(appearance_of(material)):
        maps["emission_map"] = material.diffuse_map
    shown = {"emission": tuple(brightness.tolist()), "vertex_colors": "linear"}
    return material.model_copy(update={**dark, **maps, **shown})


def check_reflectance(scene: Scene) -> None:
    """Raise ``ValueError`` naming the material that returns all light or more, with which there is no solution."""
    for name in sorted({instance.material for instance in scene.instances}):
        diffuse = appearance_of(scene.materials[name]).diffuse
        expect(max(diffuse) < 1.0, f"materials.{name}.diffuse", "numbers less than 1 for radiosity", diffuse)


def left_out(scene: Scene) -> list[str]:
    """The parts of a scene that radiosity does not compute, in words that name the key."""
    found = []
    for name in sorted({instance.material for instance in scene.instances}):
        found += [f"materials.{name}: {what}" for what in _left_out_of(scene.materials[name])]
    if any(scene.ambient) and any(any(appearance_of(m).ambient) for m in scene.materials.values()):
        found.append("ambient: the light that it stands for is computed")
    if not scene.render.shadows:
        found.append("render.shadows: there are always shadows")
    return found


def _left_out_of(material: Material) -> list[str]:
    look = appearance_of(material)
    if not isinstance(material, Phong):
        return [f"what the {material.type} throws on other surfaces"]
    mapped = sorted({"diffuse_map", "emission_map"} & look.textures.keys())
    named: list[tuple[Any, str]] = [
        (any(look.specular), "its highlights"),
        (any(look.reflectance), "what it mirrors on other surfaces"),
        (look.passes_light or "opacity_map" in look.textures or look.cutoff > 0.0, "what it lets through"),
        ("normal_map" in look.textures, "its normal_map"),
        (mapped, f"{' and '.join(mapped)}, whose mean counts"),
    ]
    return [what for there, what in named if there]


def _mean_of(texture: Texture | None) -> Floats:
    """The mean colour of a texture, linear, (3,); 1 without one."""
    if texture is None:
        return np.ones(3)
    pixels = texture.image.pixels
    colors = pixels[..., :3] if pixels.shape[2] >= 3 else pixels[..., :1]
    values = colors.astype(np.float64) / value_of_one(pixels)
    if pixels.dtype.kind != "f":
        values = linear_of_srgb(values)
    return np.array(np.broadcast_to(values.mean(axis=(0, 1)), 3))

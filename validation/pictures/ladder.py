"""The ladder of a scene: each rung adds one effect of light, so that the lowest failing rung names the wrong effect.

    diffuse     diffuse light alone. A lamp at the eye replaces the scene's lights: it lights all that the eye sees,
                so no shadow is visible and no renderer needs a switch for shadows. Mirrors and glass are painted
                grey, and nothing shines by ambient light or of itself
    textures    maps of colours and of normals, colours of vertices, and masks, under the same lamp
    highlights  Phong's highlights, under the same lamp
    shadows     the scene's own lights, and with them their shadows
    mirrors     mirrors and constant reflectances
    glass       dielectrics, constant transmittances, and surfaces that are partly there
    everything  the scene as it is, which adds ambient light and emission

The check of AOVs (``aovs``), which compares the primary hits, is below all rungs. Every rung keeps the background,
which the rays that miss see. A rung that adds nothing to a scene is left out.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from renderer.materials.base import appearance_of
from renderer.materials.dielectric import Dielectric
from renderer.materials.mirror import Mirror
from renderer.materials.phong import Phong
from renderer.materials.registry import Material
from renderer.scene.camera import OrthographicCamera
from renderer.scene.light import DirectionalLight, Light, PointLight
from renderer.scene.scene import Scene
from renderer.scene.sky import Sky

_ADDS = {
    "diffuse": "direct diffuse light, of a lamp at the eye",
    "textures": "textures, colours of vertices and masks",
    "highlights": "Phong highlights",
    "shadows": "the scene's lights and their shadows",
    "mirrors": "mirrors and constant reflectances",
    "glass": "dielectrics, constant transmittances and blends",
    "everything": "the scene as it is",
}
NAMES = tuple(_ADDS)
_TEXTURES, _HIGHLIGHTS, _SHADOWS, _MIRRORS, _GLASS, _EVERYTHING = range(1, len(NAMES))

_BLACK = (0.0, 0.0, 0.0)
# The grey of mirrors and glass until their rung.
_GREY = Phong(diffuse=(0.5, 0.5, 0.5))
# Irradiance from the lamp at the camera's target: below 1, so that a point a little nearer is not clipped.
_LAMP = 0.7


@dataclass(frozen=True)
class Rung:
    """A scene with something left out, its name, and what it adds to the rung below."""

    name: str
    adds: str
    scene: Scene


def rungs(scene: Scene) -> tuple[list[Rung], dict[str, str]]:
    """The rungs of ``scene`` from the lowest up, the last being ``scene`` itself; and why others are left out.

    >>> from renderer.scene.camera import PerspectiveCamera
    >>> empty = Scene(camera=PerspectiveCamera(eye=(0.0, 0.0, 5.0), target=(0.0, 0.0, 0.0)), materials={})
    >>> [rung.name for rung in rungs(empty)[0]]
    ['everything']
    """
    left_out = _needless(scene)
    found = []
    for level, name in enumerate(NAMES[:_EVERYTHING]):
        derived = _derived(scene, level)
        if name not in left_out and _same(derived, scene):
            left_out[name] = "equal to the whole scene, which is judged as everything"
        if name not in left_out:
            found.append(Rung(name, _ADDS[name], derived))
    return [*found, Rung("everything", _ADDS["everything"], scene)], left_out


def _needless(scene: Scene) -> dict[str, str]:
    """Rungs that add nothing, each with its reason."""
    materials = [scene.materials[instance.material] for instance in scene.instances]
    phong = [material for material in materials if isinstance(material, Phong)]
    needless = {}
    if not scene.all_lights:
        needless = dict.fromkeys(("diffuse", "textures", "highlights", "shadows"), "the scene has no lights")
    elif not any(any(material.specular) for material in phong):
        needless["highlights"] = "no surface of the scene has highlights"
    if not any(map(_is_textured, phong)):
        needless["textures"] = "no surface of the scene has textures or colours of vertices"
    if not any(isinstance(m, Mirror) for m in materials) and not any(any(m.reflectance) for m in phong):
        needless["mirrors"] = "no surface of the scene is a mirror or has a constant reflectance"
    if not any(isinstance(m, Dielectric) for m in materials) and not any(m.passes_light for m in phong):
        needless["glass"] = "no surface of the scene is a dielectric, has a constant transmittance or blends"
    return needless


def _is_textured(material: Phong) -> bool:
    """Whether the rung of textures shows any of a material's."""
    look = appearance_of(material)
    later = {"emission_map", "opacity_map"} if look.blends else {"emission_map"}
    return look.vertex_colors is not None or look.cutoff > 0.0 or bool(look.textures.keys() - later)


def _derived(scene: Scene, level: int) -> Scene:
    """The scene of a rung below everything; meshes are not loaded again."""
    lights, sky = (scene.lights, scene.sky) if level >= _SHADOWS else ((_lamp(scene),), _unlit(scene.sky))
    materials = {name: _reduced(material, level) for name, material in scene.materials.items()}
    return scene.altered(lights=lights, sky=sky, materials=materials, ambient=_BLACK)


def _unlit(sky: Sky | None) -> Sky | None:
    """The sky without its lights."""
    return None if sky is None else sky.model_copy(update={"lights": 0})


def _reduced(material: Material, level: int) -> Material:
    """A material's reduction for a rung."""
    if isinstance(material, Mirror):
        return material if level >= _MIRRORS else _GREY
    if isinstance(material, Dielectric):
        return material if level >= _GLASS else _GREY
    changes: dict[str, Any] = {"emission": _BLACK}
    if level < _TEXTURES:
        changes |= dict.fromkeys(appearance_of(material).textures) | {"vertex_colors": None, "cutoff": 0.0}
    if level < _GLASS and (level < _TEXTURES or material.cutoff == 0.0):
        changes |= {"opacity": 1.0, "opacity_map": None}
    if level < _HIGHLIGHTS:
        changes["specular"] = _BLACK
    if level < _MIRRORS:
        changes["reflectance"] = _BLACK
    if level < _GLASS:
        changes["transmittance"] = _BLACK
    return material.model_copy(update=changes)


def _lamp(scene: Scene) -> Light:
    """A white light at the eye that shines along every primary ray."""
    eye, target = np.asarray(scene.camera.eye), np.asarray(scene.camera.target)
    towards = target - eye
    if isinstance(scene.camera, OrthographicCamera):
        return DirectionalLight(direction=tuple(towards.tolist()), irradiance=(_LAMP,) * 3)
    return PointLight(type="point", position=scene.camera.eye, intensity=(_LAMP * float(towards @ towards),) * 3)


def _same(derived: Scene, scene: Scene) -> bool:
    """Whether two scenes with the same meshes give the same picture; only Phong surfaces show ambient light."""
    used = {instance.material for instance in scene.instances}
    alike = all(derived.materials[name] == scene.materials[name] for name in used)
    return alike and derived.all_lights == scene.all_lights and derived.ambient == scene.ambient

"""Ambient light for Mitsuba's own integrators: a surface that shows k_a I_a becomes one that emits it.

As a light it would also shine on others, so a separate pass renders it in which no surface is lit: only rays from the
eye and through mirrors and glass meet it there, as in Whitted's model. An emitter shines on the side of its normal and
our ambient light on both, so a second pass flips the meshes.
"""

import mitsuba as mi
import numpy as np

from renderer.materials.phong import Phong
from renderer.scene.scene import Scene
from validation.references.mitsuba import scene as mitsuba_scene


def has_glow(scene: Scene) -> bool:
    """Whether ambient light is visible in ``scene``."""
    return any(any(_glow(scene, instance.material)) for instance in scene.instances)


def glowing(scene: Scene, shapes: dict[mi.Mesh, int], *, turned: bool) -> dict[mi.Mesh, int]:
    """``shapes`` with an emitter of k_a I_a on each that shows ambient light, flipped if ``turned``.

    Other shapes, glass among them, stay unchanged.
    """
    result = {}
    for shape, index in shapes.items():
        glow = _glow(scene, scene.instances[index].material)
        result[_emitting(shape, glow, turned) if any(glow) else shape] = index
    return result


def _glow(scene: Scene, name: str) -> mitsuba_scene.Rgb:
    """k_a I_a of the material ``name``."""
    material = scene.materials[name]
    if not isinstance(material, Phong):
        return (0.0, 0.0, 0.0)
    ambient = material.diffuse if material.ambient is None else material.ambient
    return [k * i for k, i in zip(ambient, scene.ambient, strict=True)]


def _emitting(shape: mi.Mesh, radiance: mitsuba_scene.Rgb, turned: bool) -> mi.Mesh:
    """A copy of a mesh with an emitter; ``turned`` reverses its faces' orientation and its normals."""
    properties = mi.Properties()
    properties["bsdf"] = shape.bsdf()
    properties["emitter"] = mi.load_dict({"type": "area", "radiance": {"type": "rgb", "value": list(radiance)}})
    counts, smooth = (shape.vertex_count(), shape.face_count()), shape.has_vertex_normals()
    result = mi.Mesh(shape.id(), *counts, has_vertex_normals=smooth, props=properties)
    given = mi.traverse(shape)
    faces = np.array(given["faces"]).reshape(-1, 3)
    normals = np.array(given["vertex_normals"]) * (-1.0 if turned else 1.0) if smooth else None
    return mitsuba_scene.fill(result, np.array(given["vertex_positions"]), faces[:, ::-1] if turned else faces, normals)

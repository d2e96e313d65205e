"""Mitsuba's path integrator with all its light: diffuse surfaces light each other, and what shines lights all.

``path`` keeps diffuse surfaces from lighting each other, as Whitted's pictures have it; this judges radiosity.
"""

from typing import NamedTuple

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

import validation.references.mitsuba.scene as mitsuba_scene  # selects the variant
from renderer.materials.phong import Phong
from renderer.scene.camera import PerspectiveCamera
from renderer.scene.scene import Scene

Floats = NDArray[np.float64]

# The name in reports.
NAME = "Mitsuba's path integrator with global light (scalar_rgb)"
# Disjoint sets of paths, from which the standard error follows.
_RUNS = 8


class Estimate(NamedTuple):
    """A picture by random paths: its mean and the standard error of that, linear radiance (h, w, 3)."""

    mean: Floats
    error: Floats


def global_light(scene: Scene, width: int, height: int, paths: int) -> Estimate:
    """The picture of a scene of diffuse surfaces by about ``paths`` paths a pixel, of any length.

    Emission shines from the front of faces; surfaces are diffuse on both sides.

    Raises ``ValueError`` for other materials than diffuse ones, for a sky and for other cameras than a perspective one.
    """
    made = _scene(scene, _diffuse(scene))
    sensor = _sensor(scene, width, height)
    integrator = mi.load_dict({"type": "path", "max_depth": -1})
    each = max(paths // _RUNS, 1)
    runs = np.array([
        np.array(mi.render(made, sensor=sensor, integrator=integrator, spp=each, seed=seed)) for seed in range(_RUNS)
    ], np.float64)  # fmt: skip
    return Estimate(runs.mean(axis=0), runs.std(axis=0, ddof=1) / np.sqrt(_RUNS))


def _diffuse(scene: Scene) -> list[Phong]:
    """The material of each instance."""
    found = []
    for instance in scene.instances:
        material = scene.materials[instance.material]
        plain = {"type", "diffuse", "emission"}
        if not isinstance(material, Phong) or not material.model_fields_set <= plain:
            raise ValueError(f"materials.{instance.material}: expected a diffuse one that may emit, got {material}")
        found.append(material)
    return found


def _scene(scene: Scene, materials: list[Phong]) -> mi.Scene:
    if scene.sky is not None:
        raise ValueError("scene: expected a background, got a sky")
    shapes = mitsuba_scene.meshes(scene, [mitsuba_scene.diffuse(material.diffuse) for material in materials])
    shining = {
        _emitting(shape, materials[index].emission) if any(materials[index].emission) else shape: index
        for shape, index in shapes.items()
    }
    lights = [mitsuba_scene.emitter(light) for light in scene.lights]
    around = [mitsuba_scene.background(scene)] if any(scene.background) else []
    return mitsuba_scene.assemble(shining, [*lights, *around])


def _emitting(shape: mi.Mesh, radiance: mitsuba_scene.Rgb) -> mi.Mesh:
    """A copy of a mesh that emits from the front of its faces."""
    properties = mi.Properties()
    properties["bsdf"] = shape.bsdf()
    properties["emitter"] = mi.load_dict({"type": "area", "radiance": {"type": "rgb", "value": list(radiance)}})
    result = mi.Mesh(shape.id(), shape.vertex_count(), shape.face_count(), props=properties)
    given = mi.traverse(shape)
    faces, places = (np.array(given[name]).reshape(-1, 3) for name in ("faces", "vertex_positions"))
    return mitsuba_scene.fill(result, places, faces)


def _sensor(scene: Scene, width: int, height: int) -> mi.Sensor:
    """A sensor with the film of the scene's camera; independent samples, and a box filter as ours."""
    camera = scene.camera
    if not isinstance(camera, PerspectiveCamera):
        raise ValueError(f"camera: expected a perspective one, got {camera.type}")
    place = mi.ScalarTransform4f().look_at(origin=list(camera.eye), target=list(camera.target), up=list(camera.up))
    film = {"type": "hdrfilm", "width": width, "height": height, "rfilter": {"type": "box"}, "pixel_format": "rgb"}
    return mi.load_dict({
        "type": "perspective", "fov": camera.fov, "fov_axis": "y", "to_world": place, "near_clip": 1e-3,
        "far_clip": 1e7, "film": film, "sampler": {"type": "independent"},
    })  # fmt: skip

"""Mitsuba's own integrators on a scene of ours, in either variant, as its users would call them.

``path`` follows one random branch at glass and adds light between diffuse surfaces, ``direct`` stops at the first
surface, and the background shines on diffuse surfaces, so their pictures differ from Whitted's. Only their time is
compared; they are no reference.
"""

from collections.abc import Callable
from typing import Any

import drjit as dr
import mitsuba as mi

from renderer.materials.dielectric import Dielectric
from renderer.materials.mirror import Mirror
from renderer.materials.registry import Material
from renderer.scene.camera import PerspectiveCamera
from renderer.scene.scene import Scene
from validation.benchmark.peers.mitsuba_variant import using
from validation.references.mitsuba import scene as mitsuba_scene


def drawing(scene: Scene, variant: str, integrator: str, size: int, max_depth: int) -> Callable[[], None]:
    """A call that draws ``scene``, size x size at one sample a pixel, and waits for the picture.

    integrator : "path", with as many edges as our rays have, or "direct".
    """
    with using(variant):
        shapes = mitsuba_scene.meshes(scene, [_bsdf(scene.materials[i.material]) for i in scene.instances])
        emitters = [mitsuba_scene.emitter(light) for light in scene.all_lights]
        emitters.append(mitsuba_scene.background(scene))
        loaded = mitsuba_scene.assemble(shapes, emitters)
        sensor = mi.load_dict(_sensor(scene, size))
        depth = {"max_depth": max_depth + 2, "rr_depth": 1000} if integrator == "path" else {}
        drawer: Any = mi.load_dict({"type": integrator} | depth)

    def draw() -> None:
        dr.eval(drawer.render(loaded, sensor, seed=0, spp=1))
        dr.sync_thread()

    return draw


def _bsdf(material: Material) -> Any:
    if isinstance(material, Mirror):
        return mitsuba_scene.mirror(material.reflectance)
    if isinstance(material, Dielectric):
        return mitsuba_scene.dielectric(material.ior, material.reflectance, material.transmittance)
    return mitsuba_scene.diffuse(material.diffuse)


def _sensor(scene: Scene, size: int) -> dict[str, Any]:
    camera = scene.camera
    if not isinstance(camera, PerspectiveCamera) or camera.type != "perspective":
        raise ValueError(f"scene: expected a perspective camera, got {camera.type}")
    look = mi.ScalarTransform4f().look_at(origin=list(camera.eye), target=list(camera.target), up=list(camera.up))
    film = {"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"}}
    return {"type": "perspective", "fov": camera.fov, "fov_axis": "y", "to_world": look, "film": film,
            "sampler": {"type": "independent"}}  # fmt: skip

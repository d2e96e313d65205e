"""Mitsuba's own film, samplers and path integrator on a scene of diffuse surfaces and mirrors.

No ray, no sample and no line of light transport is ours. The path integrator's picture is Whitted's where no diffuse
surface lights another: every albedo is multiplied by a millionth and every light divided by it, so light loses six
digits at each diffuse bounce after the first. Each light has its own pass, because the integrator would choose one at
random, and so has the background.
"""

from typing import Literal

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from renderer.materials.mirror import Mirror
from renderer.materials.phong import Phong
from renderer.scene.camera import PerspectiveCamera
from renderer.scene.scene import Scene
from validation.references.mitsuba import scene as mitsuba_scene
from validation.references.mitsuba.path import SHADOWLESS

# Interreflection is then this share of direct light. That is below float32's resolution of a picture, 6e-8 of each
# radiance times some ten; and 1e-6 times a radiance is far from float32's smallest number.
_FADED = 1e-6
# Longer than any path, so that no path ends by chance.
_NO_ROULETTE = 1000

Sampler = Literal["independent", "stratified", "centre"]


class Film:
    """``scene`` on a film of ``size`` x ``size`` pixels with a box filter: each pixel is the mean over its square.

    Raises ``ValueError`` unless the scene consists of diffuse surfaces and mirrors under a perspective camera, without
    ambient light and with shadows.
    """

    def __init__(self, scene: Scene, size: int) -> None:
        fault = can_judge(scene)
        if fault is not None:
            raise ValueError(f"scene: expected diffuse surfaces and mirrors in perspective, got {fault}")
        self._scene, self._size = scene, size
        # Each pass with the edges of its longest path beyond the bounces: one to the first surface, and one from the
        # last to the light.
        self._passes = [(self._lit(index), 2) for index in range(len(scene.all_lights))]
        if scene.sky is not None or any(scene.background):
            dark = mitsuba_scene.meshes(scene, [_bsdf(scene, i.material, lit=False) for i in scene.instances])
            self._passes.append((mitsuba_scene.assemble(dark, [mitsuba_scene.background(scene)]), 1))

    def render(self, samples: int, *, max_depth: int, sampler: Sampler, seed: int = 0) -> NDArray[np.float64]:
        """Linear radiance (size, size, 3) float64 by ``samples`` paths a pixel in each pass, ``max_depth`` bounces.

        "stratified" takes a square number; "centre" one sample, through the pixel's centre. Equal arguments give equal
        bits.
        """
        film = mi.load_dict(self._sensor(samples, sampler))
        picture = np.zeros((self._size, self._size, 3))
        for number, (scene, beyond) in enumerate(self._passes):
            integrator = mi.load_dict({"type": "path", "max_depth": max_depth + beyond, "rr_depth": _NO_ROULETTE})
            # Passes with equal seeds would share their errors.
            made = mi.render(scene, sensor=film, integrator=integrator, spp=samples, seed=1000 * seed + number)
            picture += np.array(made, dtype=np.float64)[..., :3]
        return picture

    def _lit(self, index: int) -> mi.Scene:
        shapes = mitsuba_scene.meshes(
            self._scene, [_bsdf(self._scene, i.material, lit=True) for i in self._scene.instances]
        )
        return mitsuba_scene.assemble(shapes, [mitsuba_scene.emitter(self._scene.all_lights[index], 1.0 / _FADED)])

    def _sensor(self, samples: int, sampler: Sampler) -> dict[str, object]:
        camera = self._scene.camera
        assert isinstance(camera, PerspectiveCamera)
        sampling: dict[str, object] = {"type": "independent", "sample_count": samples}
        if sampler != "independent":
            sampling = {"type": "stratified", "jitter": sampler == "stratified", "sample_count": samples}
        film = {"type": "hdrfilm", "width": self._size, "height": self._size, "rfilter": {"type": "box"}}
        film |= {"pixel_format": "rgb", "component_format": "float32"}
        to_world = mi.ScalarTransform4f().look_at(
            origin=list(camera.eye), target=list(camera.target), up=list(camera.up)
        )
        return {"type": "perspective", "fov": camera.fov, "fov_axis": "y", "to_world": to_world, "near_clip": 1e-3,
                "film": film, "sampler": sampling}  # fmt: skip


def can_judge(scene: Scene) -> str | None:
    """Why Mitsuba's film cannot give Whitted's picture of ``scene``; None if it can."""
    if scene.camera.type != "perspective":
        return "a camera that is not perspective"
    if any(scene.ambient):
        return "ambient light"
    if not scene.render.shadows:
        return f"render.shadows: {SHADOWLESS}"
    for name in sorted({instance.material for instance in scene.instances}):
        material = scene.materials[name]
        plain = isinstance(material, Phong) and not any((*material.specular, *material.reflectance))
        if not (plain or isinstance(material, Mirror)) or material.passes_light:
            return f"materials.{name}, which is neither a diffuse surface nor a mirror"
    return None


def _bsdf(scene: Scene, name: str, lit: bool) -> mi.BSDF:
    """A material's BSDF: diffuse surfaces are black in the background's pass, a millionth as bright in a light's."""
    material = scene.materials[name]
    if isinstance(material, Mirror):
        return mitsuba_scene.mirror(material.reflectance)
    assert isinstance(material, Phong)
    return mitsuba_scene.diffuse([_FADED * channel if lit else 0.0 for channel in material.diffuse])

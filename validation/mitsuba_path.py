"""Reference A: Mitsuba's own path integrator, on scenes where a path-traced picture is the Whitted picture.

Nothing of the light transport is written here, so it is independent of reference B's recursion too. Three
things make the global illumination of the path integrator into Whitted's:

1. Every diffuse albedo is multiplied by e and every light divided by e. Light that two diffuse surfaces
   scatter then counts e times too little, while direct light is unchanged; with e = 1e-6 what is left is
   below float32's rounding in a picture.
2. Each light is rendered alone and the pictures are summed: with several, the integrator chooses one at
   random. The background is one more such light, but not divided by e: it is seen without a diffuse bounce.
3. Russian roulette is off, and the paths are as long as our rays: D bounces, and one more edge to the light.
"""

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from renderer.material import Dielectric, Material, Mirror
from renderer.scene import Scene
from validation import mitsuba_scene as source

# The e of the module's docstring: what is left of interreflection, relative to direct light. 1e-6 is far
# below what a picture shows (1/255), and lights of 1 / e are far from float32's largest number.
INTERREFLECTION = 1e-6

# Longer than any path, so that none ends by chance.
_NO_ROULETTE = 1000


def can_judge(scene: Scene) -> str | None:
    """Why the path integrator's picture of ``scene`` is not Whitted's; None if it is."""
    for name in sorted({instance.material for instance in scene.instances}):
        fault = _unjudged(scene.materials[name], lit=any(scene.ambient))
        if fault is not None:
            return f"materials.{name}: {fault}"
    return None


def _unjudged(material: Material, lit: bool) -> str | None:
    """``lit`` says whether there is ambient light."""
    if isinstance(material, Mirror):
        return None
    if isinstance(material, Dielectric):
        return "a dielectric's branch is drawn at random"
    if any(material.specular):
        return "Mitsuba has no Phong highlight"
    if any(material.transmittance):
        return "Mitsuba has no surface that transmits a constant share"
    if any(material.diffuse) and any(material.reflectance):
        return "a surface both diffuse and mirroring draws its branch at random"
    if lit and any(material.diffuse if material.ambient is None else material.ambient):
        return "Mitsuba has no ambient light"
    return None


def _bsdf(material: Material) -> mi.BSDF:
    if any(material.reflectance):
        return source.mirror(material.reflectance)
    albedo = (0.0, 0.0, 0.0) if isinstance(material, Mirror | Dielectric) else material.diffuse
    return source.diffuse([INTERREFLECTION * channel for channel in albedo])


def path(
    scene: Scene,
    width: int,
    height: int,
    *,
    max_depth: int,
    samples: int = 1,
    rays: source.Rays | None = None,
) -> NDArray[np.float64]:
    """The picture of ``scene`` by reference A, linear radiance (height, width, 3) float64.

    max_depth, samples, rays : as for ``mitsuba_whitted.whitted``.

    Raises ``ValueError`` if ``can_judge`` says why not.
    """
    fault = can_judge(scene)
    if fault is not None:
        raise ValueError(f"scene: expected only diffuse surfaces and mirrors, got {fault}")
    shapes = source.meshes(scene, [_bsdf(scene.materials[i.material]) for i in scene.instances])
    passes = [(source.emitter(light, 1.0 / INTERREFLECTION), max_depth + 2) for light in scene.lights]
    if any(scene.background):
        passes.append((source.background(scene.background), max_depth + 1))
    bundles = source.camera_rays(scene, width, height, samples) if rays is None else [rays]
    result = np.zeros((height * width, 3))
    for light, edges in passes:
        lit = source.assemble(shapes, [light])
        for bundle in bundles:
            result += _traced(lit, bundle, edges)
    return (result / len(bundles)).reshape(height, width, 3)


def _traced(scene: mi.Scene, rays: source.Rays, edges: int) -> NDArray[np.float64]:
    """Radiance along each ray by paths of at most ``edges`` edges, (n, 3) float64."""
    integrator = mi.load_dict({"type": "path", "max_depth": edges, "rr_depth": _NO_ROULETTE})
    sampler = mi.load_dict({"type": "independent", "sample_count": 1})
    sampler.seed(0)
    traced = [
        integrator.sample(scene, sampler, mi.RayDifferential3f(ray))[0] for ray in source.mitsuba_rays(rays)
    ]
    return np.array(traced, dtype=np.float64).reshape(-1, 3)

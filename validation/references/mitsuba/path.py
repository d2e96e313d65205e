"""Reference A: Mitsuba's own path integrator, on scenes where a path-traced picture is the Whitted picture.

None of its light transport is written here, so it is also independent of reference B's recursion. Four measures turn
the global illumination of the path integrator into Whitted's:

1. A surface scatters the lights by diffuse + Phong but continues paths only as a mirror or glass (``phong``), so that
   no diffuse surface lights another.
2. Each light is rendered alone and the pictures are summed: with several, the integrator chooses one at random.
3. Radiance seen without lighting, the background and ambient light, has passes in which nothing is lit.
4. Russian roulette is off, and the paths are as long as our rays: D bounces, and one more edge to the light.

Without glass nothing is random. With it each path takes one branch, drawn by Fresnel's share, and the mean over many
paths tends to the Whitted picture: see ``random_paths``, which ``validation.pictures.monte_carlo`` judges.
"""

from itertools import chain
from typing import NamedTuple

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from renderer.materials.base import appearance_of
from renderer.materials.dielectric import Dielectric
from renderer.scene.scene import Scene
from validation.references.mitsuba import ambient, phong
from validation.references.mitsuba import scene as mitsuba_scene

# The name in reports.
NAME = "Mitsuba's native path integrator (scalar_rgb)"
# Longer than any path, so that no path ends by chance.
_NO_ROULETTE = 1000

# Why scenes without shadows cannot be judged.
SHADOWLESS = "Mitsuba's path integrator cannot leave shadows out"


class _Pass(NamedTuple):
    """One part of the light: a Mitsuba scene that holds this part only, and the largest number of edges of a path."""

    scene: mi.Scene
    edges: int


def can_judge(scene: Scene) -> str | None:
    """Why the path integrator's picture of ``scene`` is not Whitted's; None if it is."""
    return _first_fault(scene, glass="a dielectric's branch is drawn at random")


def _first_fault(scene: Scene, glass: str | None) -> str | None:
    """Why ``scene`` or one of its materials cannot be judged; ``glass`` is the reason for a dielectric, or None."""
    if not scene.render.shadows:
        return f"render.shadows: {SHADOWLESS}"
    for name in sorted({instance.material for instance in scene.instances}):
        material, fault = scene.materials[name], None
        if isinstance(material, Dielectric):
            fault = glass
        elif not appearance_of(material).is_plain:
            fault = "the recursion alone judges textures, masks, colours of vertices and emission"
        elif material.passes_light:
            fault = "Mitsuba has no surface that transmits a constant share"
        if fault is not None:
            return f"materials.{name}: {fault}"
    return None


def path(
    scene: Scene,
    width: int,
    height: int,
    *,
    max_depth: int,
    samples: int = 1,
    rays: mitsuba_scene.Rays | None = None,
) -> NDArray[np.float64]:
    """The picture of ``scene`` by reference A, linear radiance (height, width, 3) float64.

    max_depth, samples, rays : as for ``whitted.whitted``.

    Raises ``ValueError`` if ``can_judge`` gives a reason.
    """
    fault = can_judge(scene)
    if fault is not None:
        raise ValueError(f"scene: expected only Phong surfaces and mirrors, got {fault}")
    bundles = mitsuba_scene.camera_rays(scene, width, height, samples) if rays is None else [rays]
    passes = _passes(scene, max_depth)
    weights = mitsuba_scene.camera_weights(scene, bundles)
    result = sum(weight * _paths(passes, bundle, 1)[0] for weight, bundle in zip(weights, bundles, strict=True))
    return (result / len(bundles)).reshape(height, width, 3)


def random_paths(scene: Scene, rays: mitsuba_scene.Rays, count: int, *, max_depth: int) -> NDArray[np.float64]:
    """Radiance along ``count`` random paths of each of the n rays, (count, n, 3) float64.

    Their mean tends to the Whitted picture. Rows are independent of each other and the same in every run, and a smaller
    ``count`` gives the first of them.

    Raises ``ValueError`` for a surface that transmits a constant share of light.
    """
    fault = _first_fault(scene, glass=None)
    if fault is not None:
        raise ValueError(f"scene: expected only Phong surfaces, mirrors and dielectrics, got {fault}")
    return _paths(_passes(scene, max_depth), rays, count)


def _passes(scene: Scene, max_depth: int) -> list[_Pass]:
    """One pass for each light, and one or two for radiance seen without lighting: their sum is the picture."""
    materials = [scene.materials[instance.material] for instance in scene.instances]
    passes = []
    if scene.all_lights:
        lit = mitsuba_scene.meshes(scene, [phong.bsdf(material) for material in materials])
        passes = [
            _Pass(mitsuba_scene.assemble(lit, [mitsuba_scene.emitter(light)]), max_depth + 2)
            for light in scene.all_lights
        ]
    sky = [mitsuba_scene.background(scene)] if scene.sky is not None or any(scene.background) else []
    glows = ambient.has_glow(scene)
    if sky or glows:
        unlit = mitsuba_scene.meshes(scene, [phong.unlit(material) for material in materials])
        front = ambient.glowing(scene, unlit, turned=False)
        passes.append(_Pass(mitsuba_scene.assemble(front, sky), max_depth + 1))
    if glows:
        back = ambient.glowing(scene, unlit, turned=True)
        passes.append(_Pass(mitsuba_scene.assemble(back, []), max_depth + 1))
    return passes


def _paths(passes: list[_Pass], rays: mitsuba_scene.Rays, count: int) -> NDArray[np.float64]:
    """The sum of the passes along ``count`` paths of each ray, (count, n, 3) float64."""
    traced = [mi.RayDifferential3f(ray) for ray in mitsuba_scene.mitsuba_rays(rays)]
    result = np.zeros((count, len(traced), 3))
    for number, (scene, edges) in enumerate(passes):
        integrator = mi.load_dict({"type": "path", "max_depth": edges, "rr_depth": _NO_ROULETTE})
        sampler = mi.load_dict({"type": "independent", "sample_count": 1})
        # With one seed a path would share its numbers with a later path's next pass, and rows would not be independent.
        sampler.seed(number)
        for row in result:
            colors = (integrator.sample(scene, sampler, ray)[0] for ray in traced)
            # numpy.array queries each colour's shape first: 2.7 us a ray, as long as the path itself; this 0.1 us.
            row += np.fromiter(chain.from_iterable(colors), np.float64, row.size).reshape(row.shape)
    return result

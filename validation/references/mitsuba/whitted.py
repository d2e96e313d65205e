"""Reference B: the Whitted recursion over Mitsuba's scene, BSDFs and emitters.

Only the recursion is written here. Hits, shading frames, spawned rays, mirror and refraction directions, Fresnel's
shares, light falloff and shadows are Mitsuba's. Mitsuba has no plugin for the Phong highlight, which is computed from
Mitsuba's frame and its ``reflect``. Each lobe of a BSDF is sampled on its own, so nothing is random and a second run
gives the same bits.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from math import pi

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from renderer.materials.appearance import Appearance
from renderer.materials.base import appearance_of
from renderer.materials.dielectric import Dielectric
from renderer.materials.mirror import Mirror
from renderer.materials.registry import Material
from renderer.scene.scene import Scene
from validation.references.mitsuba import scene as mitsuba_scene
from validation.references.mitsuba import textures

# Delta lobes and delta emitters do not depend on the random numbers.
_ANY_NUMBER, _ANY_POINT = 0.5, mi.Point2f(0.5, 0.5)


def _context(component: int | None = None) -> mi.BSDFContext:
    """A context that samples one component of a BSDF, or all of them.

    Importance transport omits the factor 1 / eta^2 by which radiance is compressed in glass: Whitted's model, and ours,
    has none.
    """
    context = mi.BSDFContext(mi.TransportMode.Importance)
    if component is not None:
        context.component = component
    return context


_ALL, _REFLECTION, REFRACTION = _context(), _context(0), _context(1)


@dataclass(frozen=True)
class Lobe:
    """A direction in which a ray is followed; a ``weight`` that is given replaces the BSDF's own."""

    bsdf: mi.BSDF
    context: mi.BSDFContext
    weight: mi.Color3f | None = None


@dataclass(frozen=True)
class Surface:
    """A surface: what leaves it without lights, k_a I_a and emission, what scatters the lights, and the lobes."""

    own: mi.Color3f
    diffuse: mi.Color3f | None
    specular: mi.Color3f | None
    shininess: float
    lobes: tuple[Lobe, ...]


@dataclass(frozen=True)
class Recursion:
    scene: mi.Scene
    surfaces: dict[mi.Mesh, Surface]
    maps: dict[mi.Mesh, textures.Maps]
    lights: tuple[mi.Emitter, ...]
    ambient: mitsuba_scene.Rgb
    background: mi.Emitter
    max_depth: int
    shadows: bool

    def radiance(self, ray: mi.Ray3f, depth: int) -> mi.Color3f:
        return self.leaving(self.hit(ray), depth)

    def hit(self, ray: mi.Ray3f) -> mi.SurfaceInteraction3f:
        """The first hit that no mask leaves out, with the shading normal of a map."""
        si, before = self.scene.ray_intersect(ray), 0.0
        while si.is_valid() and not self.is_there(si):
            before += si.t
            si = self.scene.ray_intersect(si.spawn_ray(ray.d))
        if si.is_valid() and si.shape in self.maps:
            self.maps[si.shape].turn(si, ray.d)
        si.t += before
        return si

    def is_there(self, si: mi.SurfaceInteraction3f) -> bool:
        """Whether no mask leaves out the surface at a hit."""
        return si.shape not in self.maps or self.maps[si.shape].is_there(si)

    def surface(self, si: mi.SurfaceInteraction3f) -> Surface:
        """The surface at a hit."""
        maps = self.maps.get(si.shape)
        return self.surfaces[si.shape] if maps is None else _phong(maps.at(si), self.ambient)

    def leaving(self, si: mi.SurfaceInteraction3f, depth: int) -> mi.Color3f:
        """The radiance that leaves what a ray hit, against the ray."""
        if not si.is_valid():
            return self.background.eval(si)
        surface = self.surface(si)
        result = surface.own
        if surface.diffuse is not None or surface.specular is not None:
            for light in range(len(self.lights)):
                result = result + self.lit(si, surface, light)
        if depth < self.max_depth:
            for lobe in surface.lobes:
                result = result + self.follow(si, lobe, depth)
        return result

    def lit(self, si: mi.SurfaceInteraction3f, surface: Surface, light: int) -> mi.Color3f:
        sample, irradiance = self.lights[light].sample_direction(si, _ANY_POINT)
        wo = si.to_local(sample.d)
        if not wo.z * si.wi.z > 0.0 or self.hides(si, sample):
            return mi.Color3f(0.0)
        return irradiance * scattered(si, surface, wo)

    def hides(self, si: mi.SurfaceInteraction3f, sample: mi.DirectionSample3f) -> bool:
        """Whether a surface hides the light that was sampled; through holes of masks it shines."""
        if not (self.shadows and self.scene.ray_test(si.spawn_ray_to(sample.p))):
            return False
        while si.is_valid():
            si = self.scene.ray_intersect(si.spawn_ray_to(sample.p))
            if si.is_valid() and self.is_there(si):
                return True
        return False

    def follow(self, si: mi.SurfaceInteraction3f, lobe: Lobe, depth: int) -> mi.Color3f:
        sample, weight = lobe.bsdf.sample(lobe.context, si, _ANY_NUMBER, _ANY_POINT)
        if max(weight) == 0.0:  # total internal reflection, or a black lobe
            return mi.Color3f(0.0)
        share = weight if lobe.weight is None else lobe.weight
        return self.spawn(lobe, share, si.spawn_ray(si.to_world(sample.wo)), depth + 1)

    def spawn(self, lobe: Lobe, share: mi.Color3f, ray: mi.Ray3f, depth: int) -> mi.Color3f:
        """The share of the radiance along a ray that a lobe of a surface spawned."""
        return share * self.radiance(ray, depth)


def scattered(si: mi.SurfaceInteraction3f, surface: Surface, wo: mi.Vector3f) -> mi.Color3f:
    """k_d N.L + k_s (R.V)^n, over pi because the lights are multiplied by it.

    R.V is a float32 number: above a shininess of about 1e4 its rounding (6e-8, times n) begins to show.
    """
    result = mi.Color3f(0.0)
    if surface.diffuse is not None:
        result = result + surface.diffuse * _white().eval(_ALL, si, wo)
    if surface.specular is not None:
        cosine = float(sum(mi.reflect(wo) * si.wi))
        if cosine > 0.0:
            result = result + surface.specular * (cosine**surface.shininess / pi)
    return result


def _surface(material: Material, ambient_light: mitsuba_scene.Rgb) -> Surface:
    black = mi.Color3f(0.0)
    if isinstance(material, Mirror):
        return Surface(black, None, None, 0.0, (Lobe(mitsuba_scene.mirror(material.reflectance), _ALL),))
    if isinstance(material, Dielectric):
        glass = mitsuba_scene.dielectric(material.ior, material.reflectance, material.transmittance)
        return Surface(black, None, None, 0.0, (Lobe(glass, _REFLECTION), Lobe(glass, REFRACTION)))
    return _phong(appearance_of(material), ambient_light)


def _phong(look: Appearance, ambient_light: mitsuba_scene.Rgb) -> Surface:
    return Surface(
        mi.Color3f(*look.ambient) * mi.Color3f(*ambient_light) + mi.Color3f(*look.emission),
        mi.Color3f(*look.diffuse) if any(look.diffuse) else None,
        mi.Color3f(*look.specular) if any(look.specular) else None,
        look.shininess,
        _phong_lobes(look),
    )


def _phong_lobes(look: Appearance) -> tuple[Lobe, ...]:
    """The constant shares; clear glass gives the refracted direction, and weight 0 under total internal reflection."""
    lobes = []
    if any(look.reflectance):
        lobes.append(Lobe(_white_mirror(), _ALL, mi.Color3f(*look.reflectance)))
    if any(look.transmittance):
        # What blends is not bent.
        glass = _clear_glass(1.0 if look.blends else look.ior)
        lobes.append(Lobe(glass, REFRACTION, mi.Color3f(*look.transmittance)))
    return tuple(lobes)


@cache
def _white() -> mi.BSDF:
    return mitsuba_scene.diffuse((1.0, 1.0, 1.0))


@cache
def _white_mirror() -> mi.BSDF:
    return mitsuba_scene.mirror((1.0, 1.0, 1.0))


@cache
def _clear_glass(ior: float) -> mi.BSDF:
    return mitsuba_scene.dielectric(ior, (1.0, 1.0, 1.0), (1.0, 1.0, 1.0))


def recursion_of(
    scene: Scene, max_depth: int, kind: type[Recursion] = Recursion
) -> tuple[Recursion, dict[mi.Mesh, int]]:
    """The recursion over a scene, and its shapes with the indices of their instances."""
    surfaces = [_surface(scene.materials[i.material], scene.ambient) for i in scene.instances]
    # Mitsuba requires a BSDF for each shape, but only the surfaces' own lobes are sampled, so any will do.
    shapes = mitsuba_scene.meshes(scene, [mitsuba_scene.diffuse((0.0, 0.0, 0.0))] * len(surfaces))
    lights = tuple(mitsuba_scene.emitter(light) for light in scene.all_lights)
    maps = {name: textures.maps_of(scene.materials[name]) for name in {i.material for i in scene.instances}}
    of_shapes = {shape: maps[scene.instances[index].material] for shape, index in shapes.items()}
    recursion = kind(
        mitsuba_scene.assemble(shapes, lights),
        {shape: surfaces[index] for shape, index in shapes.items()},
        {shape: found for shape, found in of_shapes.items() if found is not None},
        lights,
        scene.ambient,
        mitsuba_scene.background(scene),
        max_depth,
        scene.render.shadows,
    )
    return recursion, shapes


def can_judge(scene: Scene) -> str | None:
    """Why Mitsuba cannot hold ``scene``, so that neither reference can judge it; None if it can."""
    if scene.camera.type in ("fisheye", "opencv_fisheye"):
        return "a fish-eye, which has no rays outside its circle"
    try:
        mitsuba_scene.meshes(scene, [mitsuba_scene.diffuse((0.0, 0.0, 0.0))] * len(scene.instances))
    except ValueError as error:
        return str(error)
    return textures.can_judge(scene)


def whitted(
    scene: Scene,
    width: int,
    height: int,
    *,
    max_depth: int,
    samples: int = 1,
    rays: mitsuba_scene.Rays | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> NDArray[np.float64]:
    """The picture of ``scene`` by reference B, linear radiance (height, width, 3) float64, without mip maps.

    max_depth : bounces followed, as in ``RenderSettings``; there is no ``min_weight``.
    samples : a square number of rays a pixel, on our regular grid.
    rays : origins and unit directions, (height * width, 3) each, instead of the camera's; ``samples`` is then unused.
    progress : called with the number of finished rows and of all rows.
    """
    tracer, _ = recursion_of(textures.without_mip_maps(scene), max_depth)
    bundles = mitsuba_scene.camera_rays(scene, width, height, samples) if rays is None else [rays]
    weights = mitsuba_scene.camera_weights(scene, bundles)
    result = np.zeros((height, width, 3))
    for number, bundle in enumerate(bundles):
        traced = mitsuba_scene.mitsuba_rays(bundle)
        for row in range(height):
            line = [tracer.radiance(ray, 0) for ray in traced[row * width : (row + 1) * width]]
            result[row] += weights[number] * np.array(line, dtype=np.float64).reshape(width, 3)
            if progress is not None:
                progress(number * height + row + 1, len(bundles) * height)
    return result / len(bundles)


@dataclass(frozen=True)
class Aovs:
    """The primary hits; every array begins with (height, width).

    depth : float64, distance along the unit ray, inf on a miss.
    position, geometric_normal, shading_normal : (..., 3) float64, NaN on a miss. Normals point to the side
        from which the face is counter-clockwise (the vertex normals' side), not to the eye.
    instance : int64 index into ``scene.instances``, -1 on a miss.
    """

    depth: NDArray[np.float64]
    position: NDArray[np.float64]
    geometric_normal: NDArray[np.float64]
    shading_normal: NDArray[np.float64]
    instance: NDArray[np.int64]


def aovs(scene: Scene, width: int, height: int, *, rays: mitsuba_scene.Rays | None = None) -> Aovs:
    """Mitsuba's float32 hits of our primary rays through the pixels' centres, or of ``rays``."""
    tracer, shapes = recursion_of(scene, 0)
    table = np.full((height * width, 10), np.nan)
    table[:, 0] = np.inf
    instance = np.full(height * width, -1, dtype=np.int64)
    bundle = mitsuba_scene.camera_rays(scene, width, height, 1)[0] if rays is None else rays
    for row, ray in enumerate(mitsuba_scene.mitsuba_rays(bundle)):
        si = tracer.hit(ray)
        if si.is_valid():
            # Behind a hole of a mask a ray is beside its line by an offset.
            place = ray(si.t) if tracer.maps else si.p
            table[row] = si.t, *place, *si.n, *si.sh_frame.n
            instance[row] = shapes[si.shape]
    vectors = table[:, 1:].reshape(height, width, 3, 3)
    return Aovs(
        table[:, 0].reshape(height, width),
        vectors[:, :, 0],
        vectors[:, :, 1],
        vectors[:, :, 2],
        instance.reshape(height, width),
    )

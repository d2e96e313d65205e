"""Whitted's recursion as lists of rays in Mitsuba's ``llvm_ad_rgb``: its fastest way to draw our picture.

All rays of one depth are one list: a Dr.Jit kernel finds their hits, lights them through shadow rays and writes the
reflected and refracted rays, which are gathered into the next list. Materials are looked up in tables, which is faster
than Mitsuba's virtual BSDF calls; hits, frames, spawned rays, Fresnel's shares and directions are Mitsuba's. It
supports no highlights, constant shares or ambient light, which ``checkered.toml`` does not have.
"""

from types import SimpleNamespace
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from renderer.materials.dielectric import Dielectric
from renderer.materials.mirror import Mirror
from renderer.scene.light import PointLight
from renderer.scene.scene import Scene
from validation.benchmark.peers.mitsuba_variant import LLVM, using
from validation.references.mitsuba import scene as mitsuba_scene

_DIFFUSE, _MIRROR, _GLASS = 0, 1, 2
# Taken from the variant once, so that none must be selected while a clock runs.
_NAMES = ("Float", "UInt32", "Point3f", "Color3f", "Ray3f", "Vector3f", "fresnel", "reflect", "refract")


class RayLists:
    """A scene with its rays, ready to be drawn repeatedly; ``rays`` are origins and unit directions (n, 3).

    Raises ``ValueError`` for a scene that has more than diffuse, mirror and glass surfaces under one point light.
    """

    def __init__(self, scene: Scene, rays: mitsuba_scene.Rays, max_depth: int) -> None:
        _check(scene)
        self._depth, self._count = max_depth, len(rays[0])
        with using(LLVM):
            self._mi = SimpleNamespace(**{name: getattr(mi, name) for name in _NAMES})
            shapes = mitsuba_scene.meshes(scene, [mitsuba_scene.diffuse((0.5, 0.5, 0.5))] * len(scene.instances))
            self._scene = mitsuba_scene.assemble(shapes, [mitsuba_scene.emitter(light) for light in scene.lights])
            self._tables(scene, shapes)
            o, d = (np.ascontiguousarray(a.T, np.float32) for a in rays)
            self._o, self._d = mi.Point3f(o), mi.Vector3f(d)
            light = scene.lights[0]
            assert isinstance(light, PointLight)
            self._light, self._intensity = mi.Point3f(*light.position), mi.Color3f(*light.intensity)
            self._sky = _sky(scene)
            dr.eval(self._o, self._d)

    def _tables(self, scene: Scene, shapes: dict[Any, int]) -> None:
        """Kind, colour and ior by a shape's number in Dr.Jit's registry."""
        numbers = {int(dr.reinterpret_array(mi.UInt32, mi.ShapePtr(s))[0]): i for s, i in shapes.items()}
        kind, ior = (np.zeros(max(numbers) + 1, t) for t in (np.uint32, np.float32))
        color = np.zeros((3, len(kind)), np.float32)
        for number, index in numbers.items():
            material = scene.materials[scene.instances[index].material]
            if isinstance(material, Dielectric):
                kind[number], ior[number], color[:, number] = _GLASS, material.ior, 1.0
            elif isinstance(material, Mirror):
                kind[number], color[:, number] = _MIRROR, material.reflectance
            else:
                kind[number], color[:, number] = _DIFFUSE, material.diffuse
        self._kind, self._ior, self._color = mi.UInt32(kind), mi.Float(ior), mi.Color3f(color)
        dr.eval(self._kind, self._ior, self._color)

    def draw(self, counts: dict[str, int] | None = None) -> NDArray[np.float32]:
        """The picture, (n, 3) linear radiance. ``counts`` receives ``rays`` and ``shadow_rays``, at a cost in time."""
        film = [dr.zeros(self._mi.Float, self._count) for _ in range(3)]
        pixel = dr.arange(self._mi.UInt32, self._count)
        o, d, weight = self._o, self._d, self._mi.Color3f(1.0)
        for depth in range(self._depth + 1):
            if counts is not None:
                counts["rays"] = counts.get("rays", 0) + dr.width(pixel)
            spawned, lit = self._trace(o, d, weight, pixel, film, depth < self._depth)
            if counts is not None:
                counts["shadow_rays"] = counts.get("shadow_rays", 0) + int(dr.count(lit)[0])
            if not spawned:
                break
            dr.eval(*film, *(part for mask_and_rays in spawned for part in mask_and_rays))
            lists = [self._gathered(pixel, *one) for one in spawned]
            o, d, weight, pixel = (_joined(*both) for both in zip(*lists, strict=True))
            if dr.width(pixel) == 0:
                break
        dr.eval(*film)
        dr.sync_thread()
        picture: NDArray[np.float32] = np.stack([channel.numpy() for channel in film], axis=-1)
        return picture

    def _missed(self, d: Any) -> Any:
        """The radiance of rays that hit nothing."""
        up, zenith, horizon, ground = (self._mi.Color3f(*row) for row in self._sky)
        sine = up[0] * d[0] + up[1] * d[1] + up[2] * d[2]
        return dr.select(sine > 0.0, horizon + sine * (zenith - horizon), ground)

    def _gathered(self, pixel: Any, wanted: Any, o: Any, d: Any, weight: Any) -> tuple[Any, ...]:
        """The rays where ``wanted``, gathered without gaps."""
        rows = dr.compress(wanted)
        m = self._mi
        return (dr.gather(m.Point3f, o, rows), dr.gather(m.Vector3f, d, rows), dr.gather(m.Color3f, weight, rows),
                dr.gather(m.UInt32, pixel, rows))  # fmt: skip

    def _trace(self, o: Any, d: Any, weight: Any, pixel: Any, film: Any, more: bool) -> tuple[list[Any], Any]:
        """Add the radiance of these rays to the film; returns the spawned rays, and the mask of shadow rays."""
        si = self._scene.ray_intersect(self._mi.Ray3f(o, d))
        hit = si.is_valid()
        shape = dr.reinterpret_array(self._mi.UInt32, si.shape)
        kind = dr.gather(self._mi.UInt32, self._kind, shape, hit)
        color = dr.gather(self._mi.Color3f, self._color, shape, hit)
        direct, lit = self._direct(si, color, hit & (kind == _DIFFUSE))
        seen = weight * dr.select(hit, direct, self._missed(d))
        for channel, value in zip(film, seen, strict=True):
            dr.scatter_add(channel, value, pixel)
        if not more:
            return [], lit
        glass = hit & (kind == _GLASS)
        share, cos_t, _, eta_ti = self._mi.fresnel(si.wi.z, dr.gather(self._mi.Float, self._ior, shape, glass))
        # A mirror reflects on both sides; glass reflects Fresnel's share of light.
        reflected = si.spawn_ray(si.to_world(self._mi.reflect(si.wi)))
        refracted = si.spawn_ray(si.to_world(self._mi.refract(si.wi, cos_t, eta_ti)))
        mirrored = weight * dr.select(glass, self._mi.Color3f(share), color)
        return [
            ((hit & (kind == _MIRROR)) | glass, reflected.o, reflected.d, mirrored),
            (glass & (share < 1.0), refracted.o, refracted.d, weight * (1.0 - share)),
        ], lit

    def _direct(self, si: Any, color: Any, diffuse: Any) -> tuple[Any, Any]:
        """k_d N.L I / r^2 where the light is on the eye's side and unoccluded, and the mask of shadow rays."""
        way = self._light - si.p
        cosine = si.to_local(dr.normalize(way)).z
        lit = diffuse & (cosine * si.wi.z > 0.0)
        shadowed = self._scene.ray_test(si.spawn_ray_to(self._light), lit)
        irradiance = self._intensity * (dr.abs(cosine) / dr.squared_norm(way))
        return dr.select(lit & ~shadowed, color * irradiance, 0.0), lit


def _joined(first: Any, second: Any) -> Any:
    """Both lists in one, component by component, because Dr.Jit joins only flat arrays."""
    if dr.depth_v(first) == 1:
        return dr.concat((first, second))
    return type(first)(*(dr.concat(both) for both in zip(first, second, strict=True)))


def _sky(scene: Scene) -> list[Any]:
    """The vector up, and the radiance of zenith, horizon and ground."""
    if scene.sky is None:
        return [(0.0, 1.0, 0.0), scene.background, scene.background, scene.background]
    ground = scene.sky.horizon if scene.sky.ground is None else scene.sky.ground
    return [np.eye(3)["xyz".index(scene.up)].tolist(), scene.sky.zenith, scene.sky.horizon, ground]


def _check(scene: Scene) -> None:
    used = [scene.materials[instance.material] for instance in scene.instances]
    plain = all(
        isinstance(m, Mirror)
        or (isinstance(m, Dielectric) and set((*m.reflectance, *m.transmittance)) == {1.0})
        or (not isinstance(m, Dielectric) and not any((*m.specular, *m.reflectance, *m.transmittance)))
        for m in used
    )
    one_light = len(scene.lights) == 1 and isinstance(scene.lights[0], PointLight)
    if not plain or not one_light or any(scene.ambient) or (scene.sky is not None and scene.sky.lights):
        raise ValueError("scene: expected diffuse, mirror and clear glass under one point light, got more")

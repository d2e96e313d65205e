"""A scene of ours as Mitsuba 3 objects: rays, BSDFs, meshes, emitters, and the scene that holds them.

Mitsuba runs in the variant ``scalar_rgb``, which every wheel contains; importing this module selects it for the whole
process. It computes in float32 and finds its hits with Embree, so it judges pictures, not distances.

A diffuse BSDF is k_d / pi in Mitsuba and k_d for us, so every light is multiplied by pi.
"""

from collections.abc import Sequence
from dataclasses import replace
from math import pi
from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from renderer.materials.appearance import Appearance
from renderer.materials.base import appearance_of
from renderer.mesh.mesh import Mesh
from renderer.scene.camera import primary_rays
from renderer.scene.filters import film_samples
from renderer.scene.instance import Instance
from renderer.scene.light import DirectionalLight, Light
from renderer.scene.scene import Scene
from renderer.scene.sky import Sky

mi.set_variant("scalar_rgb")

# So many that linear interpolation between them errs by about 1e-7. An odd number: one row is the horizon, where the
# gradient has its edge.
_SKY_ROWS = 4097

Rays = tuple[NDArray[np.float64], NDArray[np.float64]]
Rgb = Sequence[float]

# Rounding a vertex to float32 moves it by 2^-24 of its coordinate. Up to 2^-22 of the mesh's size, i.e. within four
# sizes of the origin, every float32 reader changes a model by as much; beyond, shapes would change.
VERTEX_ROUNDING = 2.0**-22


def camera_rays(scene: Scene, width: int, height: int, samples: int) -> list[Rays]:
    """Our primary rays for each sample of a pixel: origins, unit directions, (height * width, 3) float64."""
    places, _ = film_samples(scene.render.filter, samples)
    return [primary_rays(scene.camera, width, height, (x, y)) for x, y in places.tolist()]


def camera_weights(scene: Scene, bundles: list[Rays]) -> list[float]:
    """The weights of the samples of ``camera_rays``, of mean 1."""
    return film_samples(scene.render.filter, len(bundles))[1].tolist()


def mitsuba_rays(rays: Rays) -> list[mi.Ray3f]:
    """The rays as Mitsuba's, rounded to float32."""
    origins, directions = rays
    pairs = zip(origins.tolist(), directions.tolist(), strict=True)
    return [mi.Ray3f(mi.Point3f(*origin), mi.Vector3f(*direction)) for origin, direction in pairs]


def diffuse(albedo: Rgb) -> mi.BSDF:
    """Lambert's law on both sides of the surface."""
    return _two_sided({"type": "diffuse", "reflectance": spectrum(albedo)})


def mirror(reflectance: Rgb) -> mi.BSDF:
    """A perfect mirror on both sides of the surface."""
    return _two_sided({"type": "conductor", "material": "none", "specular_reflectance": spectrum(reflectance)})


def dielectric(ior: float, reflectance: Rgb, transmittance: Rgb) -> mi.BSDF:
    """Clear glass in air. Component 0 is reflection, 1 refraction."""
    return mi.load_dict(
        {
            "type": "dielectric",
            "int_ior": ior,
            "ext_ior": 1.0,
            "specular_reflectance": spectrum(reflectance),
            "specular_transmittance": spectrum(transmittance),
        }
    )


def emitter(light: Light, scale: float = 1.0) -> mi.Emitter:
    """A point or directional emitter ``scale`` times as bright as ``light`` (times pi, see the module)."""
    if isinstance(light, DirectionalLight):
        power = _radiance(light.irradiance, scale * pi)
        return mi.load_dict({"type": "directional", "direction": list(light.direction), "irradiance": power})
    return mi.load_dict(
        {
            "type": "point",
            "position": list(light.position),
            "intensity": _radiance(light.intensity, scale * pi),
        }
    )


def background(scene: Scene) -> mi.Emitter:
    """An emitter for the radiance that a ray sees when it leaves the scene."""
    if scene.sky is None:
        return mi.load_dict({"type": "constant", "radiance": _radiance(scene.background, 1.0)})
    bitmap = mi.Bitmap(_gradient(scene.sky).astype(np.float32))
    return mi.load_dict({"type": "envmap", "bitmap": bitmap, "to_world": _from_y_up(scene.up)})


def _gradient(sky: Sky) -> NDArray[np.float64]:
    """A map of the sky by latitude, (rows, 4, 3), from straight up to straight down."""
    sine = np.cos(np.linspace(0.0, pi, _SKY_ROWS))[:, None, None]
    ground = sky.horizon if sky.ground is None else sky.ground
    above = np.array(sky.horizon) + sine * (np.array(sky.zenith) - np.array(sky.horizon))
    return np.broadcast_to(np.where(sine > 0.0, above, ground), (_SKY_ROWS, 4, 3))


def _from_y_up(up: str) -> mi.ScalarTransform4f:
    """A turn that takes the y axis to the axis ``up``; the map is the same all around."""
    if up == "y":
        return mi.ScalarTransform4f()
    axis, angle = ([1.0, 0.0, 0.0], 90.0) if up == "z" else ([0.0, 0.0, 1.0], -90.0)
    return mi.ScalarTransform4f().rotate(axis, angle)


def meshes(scene: Scene, bsdfs: Sequence[mi.BSDF]) -> dict[mi.Mesh, int]:
    """One Mitsuba mesh for each instance that has faces, with the instance's index.

    It has the texture coordinates and the colours of vertices, ``vertex_color``, that the instance's material reads.

    bsdfs : one for each of ``scene.instances``.

    Raises ``ValueError`` for a mesh whose shape does not survive float32, see ``VERTEX_ROUNDING``.
    """
    placed = zip(scene.instances, bsdfs, strict=True)
    looks = [appearance_of(scene.materials[instance.material]) for instance in scene.instances]
    return {
        _mesh(i, instance, bsdf, looks[i]): i for i, (instance, bsdf) in enumerate(placed) if len(instance.mesh.faces)
    }


def in_float32(scene: Scene) -> Scene:
    """``scene`` with vertices rounded to float32, so that we draw the very triangles that Mitsuba gets of it.

    A mesh whose shape does not survive that stays as it is, see ``VERTEX_ROUNDING``.
    """
    rounded = tuple(Instance(_in_float32(i.mesh), i.material, i.smooth) for i in scene.instances)
    return scene.model_copy(update={"instances": rounded})


def _in_float32(mesh: Mesh) -> Mesh:
    with np.errstate(over="ignore"):  # beyond float32 it is inf, which is farther than any bound
        vertices = mesh.vertices.astype(np.float32).astype(np.float64)
    moved = np.abs(vertices - mesh.vertices).max(initial=0.0)
    return replace(mesh, vertices=vertices) if moved <= VERTEX_ROUNDING * mesh.extent.max() else mesh


def assemble(shapes: dict[mi.Mesh, int], emitters: Sequence[mi.Emitter]) -> mi.Scene:
    """The Mitsuba scene of these shapes and emitters.

    A hit's ``si.shape`` is the very object in ``shapes``, so ``shapes[si.shape]`` is the instance's index. Mitsuba may
    merge shapes when it loads a scene; that is turned off, and ``RuntimeError`` is raised should it happen all the
    same.
    """
    content: dict[str, Any] = {"type": "scene", "embree_use_robust_intersections": True}
    content |= {f"instance{i}": shape for shape, i in shapes.items()}
    content |= {f"emitter{i}": light for i, light in enumerate(emitters)}
    scene = mi.load_dict(content, optimize=False)
    loaded = scene.shapes()
    if len(loaded) != len(shapes) or any(shape not in shapes for shape in loaded):
        raise RuntimeError(f"mitsuba: expected the {len(shapes)} shapes handed in, got {len(loaded)}, merged or copied")
    return scene


def _two_sided(bsdf: dict[str, Any]) -> mi.BSDF:
    return mi.load_dict({"type": "twosided", "bsdf": bsdf})


def spectrum(color: Rgb) -> dict[str, Any]:
    """A spectrum of ``color`` that may exceed 1, as in our materials; the usual "rgb" may not."""
    return {"type": "srgb", "color": list(color), "unbounded": True}


def _radiance(color: Rgb, scale: float) -> dict[str, Any]:
    return {"type": "rgb", "value": [scale * channel for channel in color]}


def _mesh(index: int, instance: Instance, bsdf: mi.BSDF, look: Appearance) -> mi.Mesh:
    mesh = instance.mesh
    vertices = mesh.vertices.astype(np.float32)
    moved = np.abs(vertices - mesh.vertices).max()
    if not moved <= VERTEX_ROUNDING * mesh.extent.max():
        raise ValueError(
            f"instance {index} ({mesh.name}): expected vertices that float32 holds to {VERTEX_ROUNDING:.1g} "
            f"of the mesh's size {mesh.extent.max():.3g}, got one that moves by {moved:.3g}"
        )
    properties = mi.Properties()
    properties["bsdf"] = bsdf
    name, counts = f"instance{index}", (len(vertices), len(mesh.faces))
    mapped = len(look.textures) > 0
    result = mi.Mesh(name, *counts, has_vertex_normals=instance.smooth, has_vertex_texcoords=mapped, props=properties)
    if mapped:
        mi.traverse(result)["vertex_texcoords"] = np.asarray(mesh.texcoords, np.float32).ravel()
    fill(result, vertices, mesh.faces, instance.normals if instance.smooth else None)
    if look.vertex_colors is not None:
        result.add_attribute("vertex_color", 3, linear(mesh.colors, is_srgb=look.vertex_colors == "srgb").ravel())
    return result


def linear(colors: NDArray[np.floating] | None, *, is_srgb: bool) -> NDArray[np.float32]:
    """Colours (n, 3) as Mitsuba's bitmap converts them to linear ones."""
    bitmap = mi.Bitmap(np.array(colors, np.float32)[None])
    bitmap.set_srgb_gamma(is_srgb)
    return np.array(bitmap.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False))[0]


def fill(mesh: mi.Mesh, vertices: NDArray[Any], faces: NDArray[Any], normals: NDArray[Any] | None = None) -> mi.Mesh:
    """Set the mesh's arrays, float32 and uint32 in Mitsuba: vertices and their normals (V, 3), faces (F, 3)."""
    arrays = mi.traverse(mesh)
    arrays["vertex_positions"] = np.asarray(vertices, np.float32).ravel()
    arrays["faces"] = np.asarray(faces, np.uint32).ravel()
    if normals is not None:
        arrays["vertex_normals"] = np.asarray(normals, np.float32).ravel()
    arrays.update()
    return mesh

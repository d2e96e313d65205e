"""Textures and colours of vertices by Mitsuba's own plugins: what they make of a material at a hit.

Values, filters, wraps and the conversion of sRGB are those of ``bitmap``, ``checkerboard`` and ``mesh_attribute``. Only
their products with the colours of a material are written here. Mitsuba has the first row of an image where v is 0, and
we where v is 1, so all images are turned over.
"""

from dataclasses import dataclass, replace
from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

import validation.references.mitsuba.scene as mitsuba_scene  # selects the variant
from renderer.materials.appearance import Appearance
from renderer.materials.base import appearance_of
from renderer.materials.registry import Material
from renderer.mesh.texture import Texture
from renderer.scene.instance import Instance
from renderer.scene.scene import Scene

_COLORS = ("ambient", "diffuse", "specular", "reflectance", "transmittance", "emission")
_TINTED = ("ambient", "diffuse", "emission")
_FILTERS = {"linear": "bilinear", "nearest": "nearest"}
# (u, v) to (u, 1 - v).
_OVER = np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 1.0], [0.0, 0.0, 1.0]])
# Twice an area of texture coordinates; from smaller ones float32 makes no tangent.
_LEAST = 1e-12


@dataclass(frozen=True)
class Maps:
    """The maps of one material.

    look      the material
    colors    by the names of the colours that they multiply
    opacity   multiplies the opacity; None without one
    normals   likewise; strength multiplies their x and y
    vertices  the colours of vertices
    """

    look: Appearance
    colors: dict[str, mi.Texture]
    opacity: mi.Texture | None
    normals: mi.Texture | None
    strength: float
    vertices: mi.Texture | None

    def at(self, si: mi.SurfaceInteraction3f) -> Appearance:
        """The material at a hit, the same all over its surface."""
        colors = {name: mi.Color3f(*getattr(self.look, name)) for name in _COLORS}
        for name, texture in self.colors.items():
            colors[name] = colors[name] * texture.eval(si)
        if self.vertices is not None:
            for name in _TINTED:
                colors[name] = colors[name] * self.vertices.eval(si)
        if self.look.blends:
            share = self._opacity(si)
            colors = {name: share * color for name, color in colors.items()}
            colors["transmittance"] = colors["transmittance"] + (1.0 - share)
        seen: dict[str, Any] = {name: tuple(color) for name, color in colors.items()}
        return self.look._replace(**seen)

    def is_there(self, si: mi.SurfaceInteraction3f) -> bool:
        """Whether no mask leaves out the surface at a hit."""
        return self.look.cutoff == 0.0 or self._opacity(si) >= self.look.cutoff

    def turn(self, si: mi.SurfaceInteraction3f, d: mi.Vector3f) -> None:
        """Give a hit of a ray in direction ``d`` the normal of the map, between Mitsuba's dp/du and dp/dv."""
        if self.normals is None:
            return
        n = si.sh_frame.n
        along = _unit(si.dp_du - n * _dot(n, si.dp_du))
        across = mi.Vector3f(np.cross(n, along))
        across = -across if _dot(across, si.dp_dv) < 0.0 else across
        x, y, z = (2.0 * value - 1.0 for value in self.normals.eval_3(si))
        si.sh_frame = mi.Frame3f(_unit(self.strength * (x * along + y * across) + z * n))
        si.wi = si.to_local(-d)

    def _opacity(self, si: mi.SurfaceInteraction3f) -> float:
        return self.look.opacity * (1.0 if self.opacity is None else self.opacity.eval_1(si))


def maps_of(material: Material) -> Maps | None:
    """The maps of a material; None for one that is the same all over its surface.

    Raises ``ValueError`` for a texture that Mitsuba does not have.
    """
    look = appearance_of(material)
    if look.is_plain:
        return None
    colors = {name: _color(look.textures[f"{name}_map"]) for name in _COLORS if f"{name}_map" in look.textures}
    opacity, normals = look.textures.get("opacity_map"), look.textures.get("normal_map")
    return Maps(
        look,
        colors,
        None if opacity is None else _bitmap(opacity, _alpha(opacity.image.pixels), raw=True),
        None if normals is None else _bitmap(normals, _rgb(normals.image.pixels), raw=True),
        1.0 if normals is None else normals.strength,
        None if look.vertex_colors is None else mi.load_dict({"type": "mesh_attribute", "name": "vertex_color"}),
    )


def can_judge(scene: Scene) -> str | None:
    """Why Mitsuba has no textures like those of ``scene``; None if it has."""
    for instance in scene.instances:
        look = appearance_of(scene.materials[instance.material])
        where = f"materials.{instance.material}"
        for name, texture in look.textures.items():
            fault = _fault(texture)
            if fault is not None:
                return f"{where}.{name}: {fault}"
        if "normal_map" in look.textures and _has_flat_texcoords(instance):
            return f"{where}.normal_map: Mitsuba has other tangents where texture coordinates do not grow"
    return None


def _fault(texture: Texture) -> str | None:
    if texture.filter not in _FILTERS:
        return "Mitsuba's bitmap has no mip maps"
    if texture.wrap[0] != texture.wrap[1]:
        return f"Mitsuba's bitmap wraps alike along u and v, not {' and '.join(texture.wrap)}"
    return None


def without_mip_maps(scene: Scene) -> Scene:
    """``scene`` with the filter "linear" in place of "mipmap", which Mitsuba's bitmap does not have."""
    materials = {name: _linear(material) for name, material in scene.materials.items()}
    return scene if materials == scene.materials else scene.altered(materials=materials)


def _linear(material: Material) -> Material:
    fields = {name: getattr(material, name) for name in type(material).model_fields}
    changes = {
        name: replace(value, filter="linear")
        for name, value in fields.items()
        if isinstance(value, Texture) and value.filter == "mipmap"
    }
    return material.model_copy(update=changes) if changes else material


def _color(texture: Texture) -> mi.Texture:
    pixels = texture.image.pixels
    if texture.filter == "nearest" and _is_checker(texture):
        colors = {f"color{k}": mitsuba_scene.spectrum(_rgb(pixels)[1, k].tolist()) for k in (0, 1)}
        return mi.load_dict({"type": "checkerboard", "to_uv": mi.ScalarTransform3f(_rows(texture)), **colors})
    return _bitmap(texture, _rgb(pixels), raw=pixels.dtype.kind == "f")


def _is_checker(texture: Texture) -> bool:
    """Whether a texture is such as ``Texture.checker`` makes."""
    pixels = texture.image.pixels
    repeats = texture.wrap == ("repeat", "repeat") and pixels.dtype.kind == "f" and pixels.shape[:2] == (2, 2)
    return repeats and np.array_equal(pixels, pixels[::-1, ::-1])


def _bitmap(texture: Texture, pixels: NDArray[Any], *, raw: bool) -> mi.Texture:
    """A texture of pixels (h, w, channels); those that are not ``raw`` are sRGB."""
    fault = _fault(texture)
    if fault is not None:
        raise ValueError(f"texture: {fault}")
    bitmap = mi.Bitmap(np.array(pixels, order="C"))
    bitmap.set_srgb_gamma(not raw)
    return mi.load_dict(
        {
            "type": "bitmap",
            "bitmap": bitmap,
            "raw": raw,
            "format": "variant",
            "filter_type": _FILTERS[texture.filter],
            "wrap_mode": texture.wrap[0],
            "to_uv": mi.ScalarTransform3f(_OVER @ _rows(texture)),
        }
    )


def _rows(texture: Texture) -> NDArray[np.float64]:
    return np.array([*texture.transform, (0.0, 0.0, 1.0)])


def _rgb(pixels: NDArray[Any]) -> NDArray[Any]:
    """Red, green and blue of an image, which may be grey."""
    return pixels[..., :3] if pixels.shape[2] > 2 else np.repeat(pixels[..., :1], 3, axis=2)


def _alpha(pixels: NDArray[Any]) -> NDArray[Any]:
    """The opacity of an image (h, w, 1): its alpha, or grey where there is nothing else, or 1."""
    if pixels.shape[2] == 3:
        return np.ones((*pixels.shape[:2], 1), np.float32)
    return pixels[..., -1:]


def _has_flat_texcoords(instance: Instance) -> bool:
    """Whether texture coordinates of any face have no area."""
    if instance.mesh.texcoords is None:
        return False
    a, b, c = np.moveaxis(instance.mesh.texcoords[instance.mesh.faces], 1, 0)
    (e, f), (g, h) = (b - a).T, (c - a).T
    return bool((np.abs(e * h - f * g) < _LEAST).any())


def _dot(a: mi.Vector3f, b: mi.Vector3f) -> float:
    return float(sum(a * b))


def _unit(v: mi.Vector3f) -> mi.Vector3f:
    return v / _dot(v, v) ** 0.5

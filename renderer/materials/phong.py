"""Phong's material: ambient, diffuse and specular light, with shares that are mirrored and let through."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from renderer.arguments.fields import Color, stated
from renderer.arguments.types import ArrayLike
from renderer.jit.decorators import inlined, kernel
from renderer.materials.appearance import BLACK, Appearance
from renderer.materials.base import AnyTexture, BaseMaterial, Ior, Share, TextureLike
from renderer.materials.columns import DIFFUSE, LAMBERT, PHONG, SHININESS, SPECULAR, UNLIT
from renderer.mesh.texture import Texture
from renderer.numerics.simd import load
from renderer.numerics.vec3 import add, dot, scale, sub, three

# Colours that maps multiply.
_MAPPED = ("diffuse", "specular", "reflectance", "transmittance", "emission", "ambient")
_MAPS = (*(f"{name}_map" for name in _MAPPED), "opacity_map", "normal_map")


class Phong(BaseMaterial):
    """Ambient, diffuse and specular light, with a constant reflected and transmitted share.

    A colour is one number, or red, green and blue; usual values are from 0 to 1.

    Parameters
    ----------
    diffuse : float or array_like, shape (3,), default 0.8
        The share of light that is scattered evenly.
    ambient : float or array_like, shape (3,), optional
        The share of the scene's ambient light. By default that of ``diffuse``.
    specular : float or array_like, shape (3,), default 0
        The strength of highlights.
    shininess : float, default 32
        The exponent of highlights: the greater, the smaller they are.
    reflectance : float or array_like, shape (3,), default 0
        The share of mirrored light.
    transmittance : float or array_like, shape (3,), default 0
        The share of light that goes through the surface. Under total internal reflection there is none.
    ior : float, default 1.5
        The index of refraction.
    emission : float or array_like, shape (3,), default 0
        The radiance of the surface itself. It lights nothing else.
    opacity : float, default 1
        The share of the surface that is there, from 0 to 1. The rest lets light through, unbent.
    cutoff : float, default 0
        If it is above 0, the surface is there where its opacity is at least this, and nowhere else: leaves, fences.
    ambient_map, diffuse_map, specular_map : Texture or image, optional
        Multiply the colours of these names, which are 1 by default beside them; integers are sRGB, floats linear. That
        of ``diffuse`` multiplies ``ambient`` too if that has the colour of ``diffuse``. An image is a path, bytes or
        pixels, as ``TextureImage`` takes them.
    reflectance_map, transmittance_map, emission_map : Texture or image, optional
        Likewise.
    opacity_map : Texture or image, optional
        Its alpha multiplies ``opacity``.
    normal_map : Texture or image, optional
        Normals in the space of the surface's texture coordinates: 0 to 1 stand for -1 to 1.
    vertex_colors : {"linear", "srgb"}, optional
        The colours of the mesh's vertices multiply ``ambient``, ``diffuse`` and ``emission``.

    Raises
    ------
    SceneError
        For values that are negative or not finite.

    Warns
    -----
    SceneWarning
        Where a colour other than ``ambient`` is above 1.

    Notes
    -----
    ``Dielectric`` says how bodies that touch or overlap share their surface.

    Examples
    --------
    >>> from renderer import Phong
    >>> red = Phong(diffuse=(0.7, 0.1, 0.1), specular=0.2, shininess=50)
    >>> red.specular, red.reflectance
    ((0.2, 0.2, 0.2), (0.0, 0.0, 0.0))
    """

    type: Literal["phong"] = "phong"
    diffuse: Color = (0.8, 0.8, 0.8)
    ambient: Color | None = None
    specular: Color = BLACK
    shininess: Annotated[float, Field(ge=0.0, allow_inf_nan=False, strict=True)] = 32.0
    reflectance: Color = BLACK
    transmittance: Color = BLACK
    ior: Ior = 1.5
    emission: Color = BLACK
    opacity: Share = 1.0
    cutoff: Share = 0.0
    ambient_map: AnyTexture | None = None
    diffuse_map: AnyTexture | None = None
    specular_map: AnyTexture | None = None
    reflectance_map: AnyTexture | None = None
    transmittance_map: AnyTexture | None = None
    emission_map: AnyTexture | None = None
    opacity_map: AnyTexture | None = None
    normal_map: AnyTexture | None = None
    vertex_colors: Literal["linear", "srgb"] | None = None

    @model_validator(mode="before")
    @classmethod
    def _whole_maps(cls, values: Any) -> Any:
        """Let maps be seen as they are where their colours are not given."""
        if not isinstance(values, dict):
            return values
        mapped = [name for name in _MAPPED if values.get(f"{name}_map") is not None]
        return {**{name: 1.0 for name in mapped}, **values}

    @stated
    def __init__(
        self,
        *,
        diffuse: ArrayLike = 0.8,
        ambient: ArrayLike | None = None,
        specular: ArrayLike = 0.0,
        shininess: float = 32.0,
        reflectance: ArrayLike = 0.0,
        transmittance: ArrayLike = 0.0,
        ior: float = 1.5,
        emission: ArrayLike = 0.0,
        opacity: float = 1.0,
        cutoff: float = 0.0,
        ambient_map: TextureLike | None = None,
        diffuse_map: TextureLike | None = None,
        specular_map: TextureLike | None = None,
        reflectance_map: TextureLike | None = None,
        transmittance_map: TextureLike | None = None,
        emission_map: TextureLike | None = None,
        opacity_map: TextureLike | None = None,
        normal_map: TextureLike | None = None,
        vertex_colors: Literal["linear", "srgb"] | None = None,
        type: Literal["phong"] = "phong",
    ) -> None: ...

    def _appearance(self) -> Appearance:
        """The material as pictures treat it: of a simpler kind if it has no highlights, or no diffuse colour either."""
        return Appearance(
            kind=PHONG if any(self.specular) else LAMBERT if any(self.diffuse) else UNLIT,
            ambient=self.diffuse if self.ambient is None else self.ambient,
            diffuse=self.diffuse,
            specular=self.specular,
            reflectance=self.reflectance,
            transmittance=self.transmittance,
            shininess=self.shininess,
            ior=self.ior,
            emission=self.emission,
            opacity=self.opacity,
            cutoff=self.cutoff,
            textures=self._textures(),
            vertex_colors=self.vertex_colors,
        )

    def _textures(self) -> dict[str, Texture]:
        """The textures that there are; that of ambient light is the one of diffuse light, as is its colour."""
        named = {name: getattr(self, name) for name in _MAPS}
        if self.ambient is None:
            # rule: ambient-by-diffuse-map
            named["ambient_map"] = self.diffuse_map
        return {name: texture for name, texture in named.items() if texture is not None}


@inlined
def diffuse_light(materials, m, n, d, towards):
    """The share k_d N.L of light from the unit direction ``towards``, for N.L >= 0, of the material in row ``m``."""
    return scale(three(materials, m + DIFFUSE), dot(n, towards))


@inlined
def phong_light(materials, m, n, d, towards):
    """``diffuse_light``, and the share k_s (R.V)^n that is reflected against d."""
    shine = specular(d, n, towards, load(materials, m + SHININESS))
    return add(diffuse_light(materials, m, n, d, towards), scale(three(materials, m + SPECULAR), shine))


@kernel
def specular(d, n, light, shininess):
    """(R . V)^shininess with R = 2 N (N . L) - L and V = -d, 0 where R . V <= 0.

    exp(n log1p(-|R - V|^2 / 2)) keeps its accuracy where R . V is close to 1 and the exponent large.
    """
    r = sub(scale(n, 2.0 * dot(n, light)), light)
    # rule: highlight-in-front
    if -dot(r, d) <= 0.0:
        return 0.0
    difference = add(r, d)
    short = 0.5 * dot(difference, difference)
    return math.exp(shininess * math.log1p(-short)) if short < 1.0 else 0.0

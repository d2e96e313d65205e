"""Materials, and how each is written as a row for the kernels."""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field, model_validator

from renderer.arguments.types import ArrayLike
from renderer.mesh.texture import Texture
from renderer.mesh.texture_image import TextureImage
from renderer.scene.fields import Color, Fields, stated
from renderer.shade.records import DIELECTRIC, LAMBERT, MIRROR, PHONG, UNLIT


def _texture(value: Any) -> Any:
    """A texture of what stands for one: an image, or a table of a scene file."""
    if isinstance(value, dict) and "image" in value:
        return Texture(**value)
    return Texture(value) if isinstance(value, str | bytes | os.PathLike | TextureImage | np.ndarray) else value


TextureLike = Texture | TextureImage | str | bytes | os.PathLike[str] | NDArray[Any]
AnyTexture = Annotated[Texture, BeforeValidator(_texture)]
# Colours that maps multiply.
_MAPPED = ("ambient", "diffuse", "specular", "reflectance", "transmittance", "emission")
_Share = Annotated[float, Field(ge=0.0, le=1.0, strict=True)]
_Ior = Annotated[float, Field(gt=0.0, allow_inf_nan=False, strict=True)]
_BLACK = (0.0, 0.0, 0.0)
_WHITE = (1.0, 1.0, 1.0)


class _Material(Fields):
    def _slips(self) -> Iterable[str]:
        """Colours that would return more light than arrives."""
        for name in ("diffuse", "specular", "reflectance", "transmittance"):
            color = getattr(self, name, _BLACK)
            if max(color) > 1.0:
                yield f"{name}: expected numbers from 0 to 1, got {color}. Divide 8-bit colours by 255."


class Phong(_Material):
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
        The colours of the mesh's vertices multiply those of ``diffuse``, also as ``ambient``, and of ``emission``.

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
    specular: Color = _BLACK
    shininess: Annotated[float, Field(ge=0.0, allow_inf_nan=False, strict=True)] = 32.0
    reflectance: Color = _BLACK
    transmittance: Color = _BLACK
    ior: _Ior = 1.5
    emission: Color = _BLACK
    opacity: _Share = 1.0
    cutoff: _Share = 0.0
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

    @property
    def blends(self) -> bool:
        """Whether a share of light goes through the surface unbent, because it is not all there.

        Examples
        --------
        >>> from renderer import Phong
        >>> Phong(opacity=0.5).blends, Phong(opacity=0.5, cutoff=0.5).blends
        (True, False)
        """
        return self.cutoff == 0.0 and (self.opacity < 1.0 or self.opacity_map is not None)

    @property
    def textures(self) -> dict[str, Texture]:
        """The textures that there are, by the names of their fields.

        Examples
        --------
        >>> from renderer import Phong
        >>> Phong(diffuse_map="wood.png").textures.keys()
        dict_keys(['diffuse_map'])
        """
        names = (*(f"{name}_map" for name in _MAPPED), "opacity_map", "normal_map")
        return {name: texture for name in names if (texture := getattr(self, name)) is not None}

    @property
    def is_plain(self) -> bool:
        """Whether the surface is the same everywhere, opaque where it is not transparent, and emits nothing.

        Examples
        --------
        >>> from renderer import Phong
        >>> Phong().is_plain, Phong(emission=1).is_plain
        (True, False)
        """
        return not (self.textures or self.vertex_colors or any(self.emission) or self.opacity < 1.0)

    @property
    def passes_light(self) -> bool:
        """Whether rays go through the surface.

        Examples
        --------
        >>> from renderer import Phong
        >>> Phong().passes_light, Phong(transmittance=0.5).passes_light
        (False, True)
        """
        return any(self.transmittance) or self.blends

    @property
    def receives_light(self) -> bool:
        """Whether direct light changes the look of the surface.

        Examples
        --------
        >>> from renderer import Phong
        >>> Phong().receives_light, Phong(diffuse=0, ambient=1).receives_light
        (True, False)
        """
        return any(self.diffuse) or any(self.specular)


class Mirror(_Material):
    """A perfect mirror: reflected light and nothing else.

    Parameters
    ----------
    reflectance : float or array_like, shape (3,), default 1
        The share of mirrored light: one number, or red, green and blue.

    Raises
    ------
    SceneError
        For values that are negative or not finite.

    Warns
    -----
    SceneWarning
        Where a colour is above 1.

    Examples
    --------
    >>> from renderer import Mirror
    >>> Mirror(reflectance=0.9).reflectance
    (0.9, 0.9, 0.9)
    """

    type: Literal["mirror"] = "mirror"
    reflectance: Color = _WHITE

    @stated
    def __init__(self, *, reflectance: ArrayLike = 1.0, type: Literal["mirror"] = "mirror") -> None: ...

    @property
    def passes_light(self) -> bool:
        """False: nothing is seen through a mirror.

        Examples
        --------
        >>> from renderer import Mirror
        >>> Mirror().passes_light
        False
        """
        return False


class Dielectric(_Material):
    """Clear glass or water: light is reflected and refracted by Fresnel's equations.

    Parameters
    ----------
    ior : float, default 1.5
        The index of refraction.
    reflectance, transmittance : float or array_like, shape (3,), default 1
        Factors of the reflected and the refracted light: one number, or red, green and blue.

    Raises
    ------
    SceneError
        For values that are negative or not finite.

    Warns
    -----
    SceneWarning
        Where a colour is above 1.

    Notes
    -----
    Bodies that touch have no air between them. A ray crosses faces that coincide at once, from the medium before all of
    them to the medium after all, and takes the colours of the face that is first in the scene. An opaque face stops it.
    Where bodies overlap, the medium is that of the body which the ray entered last; of those entered at one point, that
    of the last in the scene.

    Examples
    --------
    >>> from renderer import Dielectric
    >>> green = Dielectric(ior=1.33, transmittance=(0.8, 1, 0.8))
    >>> green.ior, green.reflectance
    (1.33, (1.0, 1.0, 1.0))
    """

    type: Literal["dielectric"] = "dielectric"
    ior: _Ior = 1.5
    reflectance: Color = _WHITE
    transmittance: Color = _WHITE

    @stated
    def __init__(
        self,
        *,
        ior: float = 1.5,
        reflectance: ArrayLike = 1.0,
        transmittance: ArrayLike = 1.0,
        type: Literal["dielectric"] = "dielectric",
    ) -> None: ...

    @property
    def passes_light(self) -> bool:
        """Whether rays go through the surface.

        Examples
        --------
        >>> from renderer import Dielectric
        >>> Dielectric().passes_light, Dielectric(transmittance=0).passes_light
        (True, False)
        """
        return any(self.transmittance)


Material = Phong | Mirror | Dielectric


def kind_of(material: Material) -> int:
    """The kind of a material for the kernels. That of ``Phong`` goes by the colours that are not black."""
    if isinstance(material, Mirror):
        return MIRROR
    if isinstance(material, Dielectric):
        return DIELECTRIC
    return PHONG if any(material.specular) else LAMBERT if any(material.diffuse) else UNLIT


def material_row(material: Material) -> NDArray[np.float64]:
    """A material as the kernels read it, (MATERIAL_COLUMNS,)."""
    kind = kind_of(material)
    if isinstance(material, Mirror):
        return np.array([kind, *_BLACK, *_BLACK, *_BLACK, *material.reflectance, *_BLACK, 0.0, 1.0])
    passed = (*material.reflectance, *material.transmittance)
    if isinstance(material, Dielectric):
        return np.array([kind, *_BLACK, *_BLACK, *_BLACK, *passed, 0.0, material.ior])
    ambient = material.diffuse if material.ambient is None else material.ambient
    ior = 1.0 if material.blends else material.ior
    return np.array([kind, *ambient, *material.diffuse, *material.specular, *passed, material.shininess, ior])

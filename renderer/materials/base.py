"""The common base of all materials."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import fields
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field

from renderer.arguments.fields import Fields
from renderer.errors import expect_known
from renderer.materials.appearance import BLACK, Appearance
from renderer.mesh.texture import Texture
from renderer.mesh.texture_image import TextureImage


def _texture(value: Any) -> Any:
    """A texture of what stands for one: an image, or a table of a scene file."""
    if isinstance(value, dict) and "image" in value:
        for key in value:
            expect_known("key", key, _KEYS)
        return Texture(**value)
    return Texture(value) if isinstance(value, str | bytes | os.PathLike | TextureImage | np.ndarray) else value


_KEYS = tuple(field.name for field in fields(Texture))
TextureLike = Texture | TextureImage | str | bytes | os.PathLike[str] | NDArray[Any]
AnyTexture = Annotated[Texture, BeforeValidator(_texture)]
Share = Annotated[float, Field(ge=0.0, le=1.0, strict=True)]
Ior = Annotated[float, Field(gt=0.0, allow_inf_nan=False, strict=True)]


class BaseMaterial(Fields):
    """A material: its fields, and the ``Appearance`` by which all else goes."""

    def _appearance(self) -> Appearance:
        raise NotImplementedError

    @property
    def passes_light(self) -> bool:
        """Whether rays go through the surface.

        Examples
        --------
        >>> from renderer import Dielectric, Mirror, Phong
        >>> [material.passes_light for material in (Phong(), Phong(transmittance=0.5), Mirror(), Dielectric())]
        [False, True, False, True]
        """
        return self._appearance().passes_light

    @property
    def receives_light(self) -> bool:
        """Whether direct light changes the look of the surface.

        Examples
        --------
        >>> from renderer import Mirror, Phong
        >>> [material.receives_light for material in (Phong(), Phong(diffuse=0, ambient=1), Mirror())]
        [True, False, False]
        """
        return self._appearance().receives_light

    def _slips(self) -> Iterable[str]:
        """Colours that would return more light than arrives."""
        for name in ("diffuse", "specular", "reflectance", "transmittance"):
            color = getattr(self, name, BLACK)
            if max(color) > 1.0:
                yield f"{name}: expected numbers from 0 to 1, got {color}, used as given. Divide 8-bit colours by 255."


def appearance_of(material: BaseMaterial) -> Appearance:
    """A material's appearance in pictures."""
    return material._appearance()

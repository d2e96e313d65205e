"""Materials, and how each is written as a row for the kernels."""

from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from renderer.scene.fields import Color, Fields
from renderer.shade.records import DIELECTRIC, LAMBERT, MIRROR, PHONG, UNLIT

_Ior = Annotated[float, Field(gt=0.0, allow_inf_nan=False, strict=True)]
_BLACK = (0.0, 0.0, 0.0)
_WHITE = (1.0, 1.0, 1.0)


class Phong(Fields):
    """Ambient, diffuse and specular light with a constant reflected and transmitted part.

    ``ambient`` (k_a) is ``diffuse`` unless given. Under total internal reflection there is no transmitted part. Bodies
    that touch or overlap are as for ``Dielectric``.

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

    @property
    def passes_light(self) -> bool:
        """Whether rays go through the surface into the object.

        >>> from renderer import Phong
        >>> Phong().passes_light, Phong(transmittance=0.5).passes_light
        (False, True)
        """
        return any(self.transmittance)

    @property
    def receives_light(self) -> bool:
        """Whether direct light changes the look of the surface.

        >>> from renderer import Phong
        >>> Phong().receives_light, Phong(diffuse=0, ambient=1).receives_light
        (True, False)
        """
        return any(self.diffuse) or any(self.specular)

    @property
    def kind(self) -> int:
        """The kind for the kernels, PHONG, LAMBERT or UNLIT, by the colours that are not black."""
        return PHONG if any(self.specular) else LAMBERT if any(self.diffuse) else UNLIT

    def row(self) -> NDArray[np.float64]:
        """(MATERIAL_COLUMNS,) float64."""
        ambient = self.diffuse if self.ambient is None else self.ambient
        colors = (*ambient, *self.diffuse, *self.specular, *self.reflectance, *self.transmittance)
        return np.array([self.kind, *colors, self.shininess, self.ior])


class Mirror(Fields):
    """A perfect mirror: ``reflectance`` times the reflected light, nothing else.

    >>> from renderer import Mirror
    >>> Mirror(reflectance=0.9).reflectance
    (0.9, 0.9, 0.9)
    """

    type: Literal["mirror"] = "mirror"
    reflectance: Color = _WHITE

    @property
    def passes_light(self) -> bool:
        """Never: the object behind a mirror is not seen.

        >>> from renderer import Mirror
        >>> Mirror().passes_light
        False
        """
        return False

    def row(self) -> NDArray[np.float64]:
        """(MATERIAL_COLUMNS,) float64."""
        return np.array([MIRROR, *_BLACK, *_BLACK, *_BLACK, *self.reflectance, *_BLACK, 0.0, 1.0])


class Dielectric(Fields):
    """Clear glass of index ``ior``: Fresnel's share reflected, the rest refracted, tinted by the two colours.

    Bodies that touch have no air between them: faces that coincide are crossed at once, from the medium before all of
    them to the medium after all, by the colours of the one that is first in the scene; an opaque one stops the ray.
    Where bodies overlap, the one that the ray entered last holds; of those entered at one place, the last in the scene.

    >>> from renderer import Dielectric
    >>> green = Dielectric(ior=1.33, transmittance=(0.8, 1, 0.8))
    >>> green.ior, green.reflectance
    (1.33, (1.0, 1.0, 1.0))
    """

    type: Literal["dielectric"] = "dielectric"
    ior: _Ior = 1.5
    reflectance: Color = _WHITE
    transmittance: Color = _WHITE

    @property
    def passes_light(self) -> bool:
        """Whether rays go through the surface into the object.

        >>> from renderer import Dielectric
        >>> Dielectric().passes_light, Dielectric(transmittance=0).passes_light
        (True, False)
        """
        return any(self.transmittance)

    def row(self) -> NDArray[np.float64]:
        """(MATERIAL_COLUMNS,) float64."""
        colors = (*_BLACK, *_BLACK, *_BLACK, *self.reflectance, *self.transmittance)
        return np.array([DIELECTRIC, *colors, 0.0, self.ior])


Material = Phong | Mirror | Dielectric

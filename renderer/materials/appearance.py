"""The appearance of any material in pictures."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.mesh.texture import Texture

Rgb = tuple[float, float, float]
BLACK, WHITE = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)


class Appearance(NamedTuple):
    """The terms of a material in Whitted's sum, and what changes them along its surface.

    kind           one of ``columns``
    ambient        to transmittance: the shares of light of these names; shininess of highlights, and the index of
                   refraction, as ``Phong`` has them
    emission       the radiance of the surface itself
    opacity        the share of the surface that is there; cutoff: below which it is not there at all, or 0
    textures       by the names of fields of ``Phong``, such as diffuse_map
    vertex_colors  the space of colours of vertices that count, or None
    """

    kind: int
    ambient: Rgb = BLACK
    diffuse: Rgb = BLACK
    specular: Rgb = BLACK
    reflectance: Rgb = BLACK
    transmittance: Rgb = BLACK
    shininess: float = 0.0
    ior: float = 1.0
    emission: Rgb = BLACK
    opacity: float = 1.0
    cutoff: float = 0.0
    textures: Mapping[str, Texture] = MappingProxyType({})
    vertex_colors: Literal["linear", "srgb"] | None = None

    @property
    def blends(self) -> bool:
        """Whether a share of light goes through the surface unbent, because it is not all there."""
        return self.cutoff == 0.0 and (self.opacity < 1.0 or "opacity_map" in self.textures)

    @property
    def passes_light(self) -> bool:
        """Whether rays go through the surface."""
        return any(self.transmittance) or self.blends

    @property
    def receives_light(self) -> bool:
        """Whether light of lights changes the look of the surface."""
        return any(self.diffuse) or any(self.specular)

    @property
    def is_plain(self) -> bool:
        """Whether the surface is the same everywhere, opaque where it is not transparent, and emits nothing."""
        return not (self.textures or self.vertex_colors or any(self.emission) or self.opacity < 1.0)

    def row(self) -> NDArray[np.float64]:
        """The row of the kernels, (MATERIAL_COLUMNS,)."""
        colors = self.ambient, self.diffuse, self.specular, self.reflectance, self.transmittance
        # What blends is not bent.
        return np.array([self.kind, *np.ravel(colors), self.shininess, 1.0 if self.blends else self.ior])

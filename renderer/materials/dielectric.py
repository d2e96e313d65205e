"""Clear glass or water."""

from __future__ import annotations

from typing import Literal

from renderer.arguments.fields import Color, stated
from renderer.arguments.types import ArrayLike
from renderer.jit.decorators import inlined, kernel
from renderer.materials.appearance import WHITE, Appearance
from renderer.materials.base import BaseMaterial, Ior
from renderer.materials.columns import CLEAR
from renderer.numerics.vec3 import scale


class Dielectric(BaseMaterial):
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
    of the last in the scene. A ray within the plane in which bodies touch leaves the body that it entered.

    Examples
    --------
    >>> from renderer import Dielectric
    >>> green = Dielectric(ior=1.33, transmittance=(0.8, 1, 0.8))
    >>> green.ior, green.reflectance
    (1.33, (1.0, 1.0, 1.0))
    """

    type: Literal["dielectric"] = "dielectric"
    ior: Ior = 1.5
    reflectance: Color = WHITE
    transmittance: Color = WHITE

    @stated
    def __init__(
        self,
        *,
        ior: float = 1.5,
        reflectance: ArrayLike = 1.0,
        transmittance: ArrayLike = 1.0,
        type: Literal["dielectric"] = "dielectric",
    ) -> None: ...

    def _appearance(self) -> Appearance:
        """Its appearance in pictures."""
        return Appearance(CLEAR, reflectance=self.reflectance, transmittance=self.transmittance, ior=self.ior)


@inlined
def clear_shares(k_r, k_t, cos_i, cos_t, n1, n2):
    """The shares of ``bounced_light`` by Fresnel's equations, times the colours k_r and k_t."""
    # rule: total-reflection
    f = 1.0 if cos_t < 0.0 else fresnel(cos_i, cos_t, n1, n2)
    # rule: tint-of-glass
    return scale(k_r, f), scale(k_t, 1.0 - f)


@kernel
def fresnel(cos_i, cos_t, n1, n2):
    """Unpolarised reflectance of a dielectric boundary."""
    if n1 == n2:
        return 0.0  # also where both cosines are 0
    s = (n1 * cos_i - n2 * cos_t) / (n1 * cos_i + n2 * cos_t)
    p = (n1 * cos_t - n2 * cos_i) / (n1 * cos_t + n2 * cos_i)
    # rule: both-polarisations
    return 0.5 * (s * s + p * p)

"""A perfect mirror."""

from __future__ import annotations

from typing import Literal

from renderer.arguments.fields import Color, stated
from renderer.arguments.types import ArrayLike
from renderer.materials.appearance import WHITE, Appearance
from renderer.materials.base import BaseMaterial
from renderer.materials.columns import UNLIT


class Mirror(BaseMaterial):
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
    reflectance: Color = WHITE

    @stated
    def __init__(self, *, reflectance: ArrayLike = 1.0, type: Literal["mirror"] = "mirror") -> None: ...

    def _appearance(self) -> Appearance:
        """Its appearance in pictures."""
        return Appearance(UNLIT, reflectance=self.reflectance)

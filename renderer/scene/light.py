"""Lights, and how each is written as a row for the kernels."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import field_validator

from renderer.arguments.fields import Color, Fields, FiniteVector, stated
from renderer.arguments.types import ArrayLike
from renderer.scene.vectors import unit
from renderer.shade.records import DIRECTIONAL, POINT


class DirectionalLight(Fields):
    """Parallel light, as of the sun.

    Parameters
    ----------
    direction : array_like, shape (3,)
        The direction in which the light travels, of any length but 0.
    irradiance : float or array_like, shape (3,), default 1
        The light on a surface that faces it: one number, or red, green and blue.

    Raises
    ------
    SceneError
        For values that are negative or not finite, or a direction of length 0.

    Examples
    --------
    >>> from renderer import DirectionalLight, OrthographicCamera, Phong, Scene, SceneObject, render, shapes
    >>> floor = SceneObject(mesh=shapes.grid(), material="white")
    >>> above = OrthographicCamera(eye=(0, 1, 0), target=(0, 0, 0), up=(0, 0, 1), height=1)
    >>> light = DirectionalLight(direction=(0, -1, 0), irradiance=3)
    >>> scene = Scene(camera=above, materials={"white": Phong(diffuse=1)}, objects=[floor], lights=[light])
    >>> render(scene, resolution=1).radiance[0, 0]
    array([3., 3., 3.], dtype=float32)
    """

    type: Literal["directional"] = "directional"
    direction: FiniteVector
    irradiance: Color = (1.0, 1.0, 1.0)

    @stated
    def __init__(
        self, *, direction: ArrayLike, irradiance: ArrayLike = 1.0, type: Literal["directional"] = "directional"
    ) -> None: ...

    @field_validator("direction")
    @classmethod
    def _not_zero(cls, value: tuple[float, float, float]) -> tuple[float, float, float]:
        if not any(value):
            raise ValueError("expected a direction of non-zero length")
        return value


class PointLight(Fields):
    """A point that shines evenly in all directions.

    Parameters
    ----------
    position : array_like, shape (3,)
        The place of the light.
    intensity : float or array_like, shape (3,), default 1
        One number, or red, green and blue. At distance r the light is ``intensity / r**2``.

    Raises
    ------
    SceneError
        For values that are negative or not finite.

    Examples
    --------
    >>> from renderer import OrthographicCamera, Phong, PointLight, Scene, SceneObject, render, shapes
    >>> floor = SceneObject(mesh=shapes.grid(), material="white")
    >>> above = OrthographicCamera(eye=(0, 1, 0), target=(0, 0, 0), up=(0, 0, 1), height=1)
    >>> light = PointLight(position=(0, 2, 0), intensity=3)
    >>> scene = Scene(camera=above, materials={"white": Phong(diffuse=1)}, objects=[floor], lights=[light])
    >>> render(scene, resolution=1).radiance[0, 0]
    array([0.75, 0.75, 0.75], dtype=float32)
    """

    type: Literal["point"] = "point"
    position: FiniteVector
    intensity: Color = (1.0, 1.0, 1.0)

    @stated
    def __init__(
        self, *, position: ArrayLike, intensity: ArrayLike = 1.0, type: Literal["point"] = "point"
    ) -> None: ...


Light = DirectionalLight | PointLight


def light_row(light: Light) -> NDArray[np.float64]:
    """A light as the kernels read it, (LIGHT_COLUMNS,)."""
    if isinstance(light, PointLight):
        return np.array([POINT, *light.position, *light.intensity])
    return np.array([DIRECTIONAL, *-unit(light.direction), *light.irradiance])

"""Lights, and how each is written as a row for the kernels."""

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import field_validator

from renderer.scene.camera import unit
from renderer.scene.fields import Color, Fields, FiniteVector
from renderer.shade.records import DIRECTIONAL, POINT


class DirectionalLight(Fields):
    """Parallel light that travels along ``direction``; ``irradiance`` falls on a surface that faces it.

    >>> from renderer import DirectionalLight, OrthographicCamera, Phong, Scene, SceneObject, render
    >>> from renderer.mesh.shapes import grid
    >>> floor = SceneObject(mesh=grid(), material="white")
    >>> above = OrthographicCamera(eye=(0, 1, 0), target=(0, 0, 0), up=(0, 0, 1), height=1)
    >>> light = DirectionalLight(direction=(0, -1, 0), irradiance=3)
    >>> scene = Scene(camera=above, materials={"white": Phong(diffuse=1)}, objects=[floor], lights=[light])
    >>> render(scene, resolution=(1, 1)).radiance[0, 0]
    array([3., 3., 3.], dtype=float32)
    """

    type: Literal["directional"] = "directional"
    direction: FiniteVector
    irradiance: Color = (1.0, 1.0, 1.0)

    @field_validator("direction")
    @classmethod
    def _not_zero(cls, value: tuple[float, float, float]) -> tuple[float, float, float]:
        if not any(value):
            raise ValueError("expected a direction of non-zero length")
        return value

    def row(self) -> NDArray[np.float64]:
        """(LIGHT_COLUMNS,) float64."""
        towards = -unit(self.direction)
        return np.array([DIRECTIONAL, *towards, *self.irradiance])


class PointLight(Fields):
    """A point that shines evenly; the light arriving at distance r is ``intensity`` / r^2.

    >>> from renderer import OrthographicCamera, Phong, PointLight, Scene, SceneObject, render
    >>> from renderer.mesh.shapes import grid
    >>> floor = SceneObject(mesh=grid(), material="white")
    >>> above = OrthographicCamera(eye=(0, 1, 0), target=(0, 0, 0), up=(0, 0, 1), height=1)
    >>> light = PointLight(position=(0, 2, 0), intensity=3)
    >>> scene = Scene(camera=above, materials={"white": Phong(diffuse=1)}, objects=[floor], lights=[light])
    >>> render(scene, resolution=(1, 1)).radiance[0, 0]
    array([0.75, 0.75, 0.75], dtype=float32)
    """

    type: Literal["point"] = "point"
    position: FiniteVector
    intensity: Color = (1.0, 1.0, 1.0)

    def row(self) -> NDArray[np.float64]:
        """(LIGHT_COLUMNS,) float64."""
        return np.array([POINT, *self.position, *self.intensity])


Light = DirectionalLight | PointLight

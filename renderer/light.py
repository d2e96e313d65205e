"""Lights, and the rows of the array in which the kernels read them."""

from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, field_validator

from renderer.camera import FiniteVector, unit

# One row a light, float64: kind, x, y, z, red, green, blue. A directional light stores the unit vector
# towards the light, a point light its position.
LIGHT_COLUMNS = 7
DIRECTIONAL, POINT = 0, 1


def _grey(value: object) -> object:
    """Let one number stand for an equal red, green and blue."""
    return (value, value, value) if isinstance(value, int | float) and not isinstance(value, bool) else value


_Channel = Annotated[float, Field(ge=0.0, allow_inf_nan=False, strict=True)]
Color = Annotated[tuple[_Channel, _Channel, _Channel], BeforeValidator(_grey)]


class _Light(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class DirectionalLight(_Light):
    """Parallel light that travels along ``direction``; ``irradiance`` falls on a surface that faces it."""

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


class PointLight(_Light):
    """A point that shines evenly; the light arriving at distance r is ``intensity`` / r^2."""

    type: Literal["point"] = "point"
    position: FiniteVector
    intensity: Color = (1.0, 1.0, 1.0)

    def row(self) -> NDArray[np.float64]:
        """(LIGHT_COLUMNS,) float64."""
        return np.array([POINT, *self.position, *self.intensity])


Light = DirectionalLight | PointLight

"""A sky: what rays see that hit nothing, and the light of it, as many directional lights."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator

from renderer.arguments.fields import Color, Fields, FiniteVector, stated
from renderer.arguments.types import ArrayLike
from renderer.arguments.up import UP_AXES, turn_to
from renderer.scene.light import DirectionalLight
from renderer.studies.directions import Pattern, fibonacci_hemisphere


class Sky(Fields):
    """A clear sky around the scene, which shines, with a sun or none.

    Its radiance goes linearly from ``horizon`` to ``zenith`` with the sine of the height. Rays that hit nothing see it.
    Its light comes from ``lights`` directional lights, spread evenly over the hemisphere. That of the sun comes from
    ``sun_lights`` more, spread evenly over its disc, which is not seen.

    Parameters
    ----------
    zenith : float or array_like, shape (3,), default (0.35, 0.55, 0.9)
        The radiance straight up.
    horizon : float or array_like, shape (3,), default (0.85, 0.9, 0.95)
        The radiance at the horizon.
    ground : float or array_like, shape (3,), optional
        The radiance below the horizon, by default that of the horizon. It lights nothing.
    lights : int, default 96
        The number of directional lights, from 0 to 4096. Each costs a shadow ray for each surface that it may light.
    sun : array_like, shape (3,), optional
        The direction in which the sun's light travels, of any length but 0.
    sun_irradiance : float or array_like, shape (3,), default 1
        The sun's light on a surface that faces it.
    sun_angle : float, default 8
        The angle in degrees from the middle of the sun's disc to its rim, from 0 to 45: wide discs have soft shadows.
    sun_lights : int, default 16
        The number of the sun's lights, from 1 to 4096.

    Raises
    ------
    SceneError
        For a value out of its range.

    Notes
    -----
    A level surface of diffuse reflectance k, with nothing above it, gets the radiance k (horizon / 3 + 2 zenith / 3)
    as the number of lights grows. Lights have the irradiance of their part of the sky divided by pi, as all
    lights of a scene: a white surface that faces a light of irradiance 1 has radiance 1.

    Examples
    --------
    >>> from renderer import OrthographicCamera, Phong, Scene, SceneObject, Sky, render, shapes
    >>> floor = SceneObject(mesh=shapes.grid(), material="white")
    >>> above = OrthographicCamera(eye=(0, 1, 0), target=(0, 0, 0), up=(0, 0, 1), height=1)
    >>> sky = Sky(zenith=1, horizon=0.4, lights=100)
    >>> scene = Scene(camera=above, materials={"white": Phong(diffuse=1)}, objects=[floor], sky=sky)
    >>> render(scene, resolution=1).radiance[0, 0].round(3)
    array([0.8, 0.8, 0.8], dtype=float32)
    """

    zenith: Color = (0.35, 0.55, 0.9)
    horizon: Color = (0.85, 0.9, 0.95)
    ground: Color | None = None
    lights: Annotated[int, Field(ge=0, le=4096, strict=True)] = 96
    sun: FiniteVector | None = None
    sun_irradiance: Color = (1.0, 1.0, 1.0)
    sun_angle: Annotated[float, Field(ge=0.0, le=45.0, strict=True)] = 8.0
    sun_lights: Annotated[int, Field(ge=1, le=4096, strict=True)] = 16

    @stated
    def __init__(
        self,
        *,
        zenith: ArrayLike = (0.35, 0.55, 0.9),
        horizon: ArrayLike = (0.85, 0.9, 0.95),
        ground: ArrayLike | None = None,
        lights: int = 96,
        sun: ArrayLike | None = None,
        sun_irradiance: ArrayLike = 1.0,
        sun_angle: float = 8.0,
        sun_lights: int = 16,
    ) -> None: ...

    @field_validator("sun")
    @classmethod
    def _not_zero(cls, value: tuple[float, float, float] | None) -> tuple[float, float, float] | None:
        if value is not None and not any(value):
            raise ValueError("expected a direction of non-zero length")
        return value

    def directional(self, up: str) -> tuple[DirectionalLight, ...]:
        """The lights that stand for the sky, then those that stand for the sun.

        Parameters
        ----------
        up : {"x", "y", "z"}
            The axis upwards.

        Returns
        -------
        tuple of DirectionalLight
            ``lights`` of them over the hemisphere, and ``sun_lights`` over the sun's disc if there is a sun.

        Examples
        --------
        >>> from renderer import Sky
        >>> sky = Sky(sun=(0, 0, -1), sun_lights=8)
        >>> len(sky.directional("z"))
        104
        """
        made: list[DirectionalLight] = []
        # From patterns about z to those about ``up``, so that a turned scene has turned lights.
        turn = turn_to(up) @ turn_to("z").T
        if self.lights:
            towards = fibonacci_hemisphere(self.lights).directions @ turn.T
            sine = towards[:, UP_AXES[up]]
            horizon, zenith = np.array(self.horizon), np.array(self.zenith)
            irradiance = (horizon + sine[:, None] * (zenith - horizon)) * (2.0 / self.lights)
            made += [DirectionalLight(direction=-w, irradiance=c) for w, c in zip(towards, irradiance, strict=True)]
        if self.sun is not None:
            share = np.array(self.sun_irradiance) / self.sun_lights
            ways = self._rays_of_sun(np.array(self.sun) @ turn) @ turn.T
            made += [DirectionalLight(direction=way, irradiance=share) for way in ways]
        return tuple(made)

    def _rays_of_sun(self, sun: NDArray[np.float64]) -> NDArray[np.float64]:
        """Directions over the sun's disc, each for an equal solid angle: a hemisphere's, drawn together."""
        spread = fibonacci_hemisphere(self.sun_lights)
        least = np.cos(np.radians(self.sun_angle))
        height = least + (1.0 - least) * spread.directions[:, 2]
        around = np.sqrt(np.maximum(1.0 - height * height, 0.0))
        level = spread.directions[:, :2] / np.linalg.norm(spread.directions[:, :2], axis=1, keepdims=True)
        turned = Pattern(np.column_stack([level * around[:, None], height]), spread.weights)
        return turned.about([sun])[0]


def sky_rows(sky: Sky | None, up: str) -> NDArray[np.float64]:
    """The sky as the kernels read it, (4, 3): the unit vector up, then zenith, horizon and ground; (0, 3) for none."""
    if sky is None:
        return np.zeros((0, 3))
    ground = sky.horizon if sky.ground is None else sky.ground
    return np.array([np.eye(3)[UP_AXES[up]], sky.zenith, sky.horizon, ground])

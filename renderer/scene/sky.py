"""A sky: what rays see that hit nothing, and the light of it, as many directional lights."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from renderer.arguments.types import ArrayLike
from renderer.arguments.up import UP_AXES, turn_to
from renderer.scene.fields import Color, Fields, stated
from renderer.scene.light import DirectionalLight
from renderer.studies.directions import fibonacci_hemisphere


class Sky(Fields):
    """A clear sky around the scene, which shines.

    Its radiance goes linearly from ``horizon`` to ``zenith`` with the sine of the height. It is what rays see that hit
    nothing. Its light comes from ``lights`` directional lights, spread evenly over the hemisphere.

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

    @stated
    def __init__(
        self,
        *,
        zenith: ArrayLike = (0.35, 0.55, 0.9),
        horizon: ArrayLike = (0.85, 0.9, 0.95),
        ground: ArrayLike | None = None,
        lights: int = 96,
    ) -> None: ...

    def directional(self, up: str, count: int | None = None) -> tuple[DirectionalLight, ...]:
        """The lights that stand for the sky over the axis ``up``; by default as many as ``lights``."""
        count = self.lights if count is None else count
        if count == 0:
            return ()
        towards = fibonacci_hemisphere(count).directions @ (turn_to(up) @ turn_to("z").T).T
        sine = towards[:, UP_AXES[up]]
        horizon, zenith = np.array(self.horizon), np.array(self.zenith)
        irradiance = (horizon + sine[:, None] * (zenith - horizon)) * (2.0 / count)
        return tuple(
            DirectionalLight(direction=-way, irradiance=color) for way, color in zip(towards, irradiance, strict=True)
        )

    def rows(self, up: str) -> NDArray[np.float64]:
        """The sky as the kernels read it, (4, 3): the unit vector up, then zenith, horizon and ground."""
        ground = self.horizon if self.ground is None else self.ground
        return np.array([np.eye(3)[UP_AXES[up]], self.zenith, self.horizon, ground])

"""A turntable: the camera goes once around its target."""

import math
from collections.abc import Iterator

import numpy as np

from renderer.arguments.up import UP_AXES
from renderer.scene.camera import Camera
from renderer.scene.scene import Scene
from renderer.scene.vectors import rotated


def turned_cameras(scene: Scene, count: int) -> Iterator[Camera]:
    """The scene's camera, and it after each further ``count``-th part of a turn about the line through its target along
    the axis that is up, anticlockwise as seen from above.
    """
    camera, axis = scene.camera, np.eye(3)[UP_AXES[scene.up]]
    yield camera
    for number in range(1, count):
        moved, up = rotated(
            np.array([np.subtract(camera.eye, camera.target), camera.up]), axis, 2.0 * math.pi * number / count
        )
        place = {"eye": (camera.target + moved).tolist(), "up": up.tolist()}
        yield type(camera).model_validate({**camera.model_dump(), **place})

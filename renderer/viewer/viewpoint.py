"""The page's camera as a ``PerspectiveCamera``, and as the table of a scene file.

The page sends its camera as a matrix from camera to world, sixteen numbers column by column: unit vectors to the right,
up and back, and the eye, each with a fourth number.
"""

import math
from collections.abc import Sequence

import numpy as np

from renderer.errors import expect
from renderer.scene.camera import PerspectiveCamera


def camera_of(m: Sequence[float], fovy: float, distance: float = 1.0) -> PerspectiveCamera:
    """The camera with matrix ``m`` (16) and vertical field of view ``fovy`` (radians, between 0 and pi).

    Its target lies ``distance`` before the eye. Raises ``ValueError`` naming the argument.
    """
    columns = np.array(m, np.float64).reshape(4, 4)
    rest = columns[:, 3].tolist()
    expect(rest == [0.0, 0.0, 0.0, 1.0], "m", "a last row of 0, 0, 0, 1", rest)
    up, back, eye = columns[1, :3], columns[2, :3], columns[3, :3]
    with np.errstate(over="ignore", invalid="ignore"):  # the camera refuses what is not finite
        target = eye - distance * back
    return PerspectiveCamera(eye=_vector(eye), target=_vector(target), up=_vector(up), fov=math.degrees(fovy))


def camera_toml(camera: PerspectiveCamera) -> str:
    """The table [camera] with which ``load_scene`` makes ``camera`` again, to the bit.

    >>> print(camera_toml(PerspectiveCamera(eye=(0, 1, 4), target=(0, 0, 0), fov=40)))
    [camera]
    eye = [0.0, 1.0, 4.0]
    target = [0.0, 0.0, 0.0]
    up = [0.0, 1.0, 0.0]
    fov = 40.0
    <BLANKLINE>
    """
    # Python writes the shortest decimal that reads back as the same float64, in a form that TOML shares.
    rows = [f"{name} = {list(getattr(camera, name))!r}" for name in ("eye", "target", "up")]
    return "\n".join(["[camera]", *rows, f"fov = {camera.fov!r}", ""])


def _vector(values: np.ndarray) -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return x, y, z

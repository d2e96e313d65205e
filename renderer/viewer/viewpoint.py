"""The page's camera as a ``Camera``, and as the table of a scene file.

The page sends its camera as a matrix from camera to world, sixteen numbers column by column: unit vectors to the right,
up and back, and the eye, each with a fourth number.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import ValidationError

from renderer.arguments.fields import first_fault
from renderer.errors import SceneError, expect
from renderer.scene.camera import Camera, OpenCVCamera, OrthographicCamera, PerspectiveCamera, PinholeCamera
from renderer.viewer.protocol import Pixel

# The kinds of cameras that the page has.
PageCamera = PerspectiveCamera | OrthographicCamera

# From so many times the scene's size and distance away, rays to one point are parallel to a millionth.
_FAR = 1e6
# In degrees, for a camera that sees more than a plane can show.
_USUAL_FOV = 90.0


def camera_of(m: Sequence[float], fovy: float, distance: float = 1.0, height: float | None = None) -> PageCamera:
    """The camera with matrix ``m`` (16) and vertical field of view ``fovy`` (radians, between 0 and pi).

    With a ``height`` it is an orthographic one, whose film is so high (scene units) and ``fovy`` says nothing. Its
    target lies ``distance`` before the eye. Raises ``ValueError`` naming the argument.
    """
    columns = np.array(m, np.float64).reshape(4, 4)
    rest = columns[:, 3].tolist()
    expect(rest == [0.0, 0.0, 0.0, 1.0], "m", "a last row of 0, 0, 0, 1", rest)
    up, back, eye = columns[1, :3], columns[2, :3], columns[3, :3]
    with np.errstate(over="ignore", invalid="ignore"):  # the camera refuses what is not finite
        target = eye - distance * back
    at = {"eye": _vector(eye), "target": _vector(target), "up": _vector(up)}
    kind: type[PageCamera] = PerspectiveCamera if height is None else OrthographicCamera
    film = {"fov": math.degrees(fovy)} if height is None else {"height": float(height)}
    try:
        # Not by the constructor, which warns of angles in radians: a page may zoom in so far.
        return kind.model_validate({**at, **film})
    except ValidationError as error:
        raise SceneError(f"{kind.__name__}: {first_fault(error)}") from None


def page_camera(camera: Camera) -> PageCamera:
    """The camera that the page shows for ``camera``: itself, or a perspective one at its place for kinds that the page
    does not have.
    """
    if camera.type in ("perspective", "orthographic"):
        assert isinstance(camera, PerspectiveCamera | OrthographicCamera)
        return camera
    fov = _USUAL_FOV
    if isinstance(camera, PerspectiveCamera):
        fov = camera.fov
    if isinstance(camera, PinholeCamera | OpenCVCamera):
        fov = math.degrees(2.0 * math.atan(camera.height / camera.fy / 2.0))
    return PerspectiveCamera.model_validate({**camera.model_dump(include={"eye", "target", "up"}), "fov": fov})


def ray_through(pixel: Pixel) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Origin and unit direction of the ray through a pixel's centre, with the bits that they have in a picture."""
    camera = camera_of(pixel.m, pixel.fovy, height=pixel.height)
    return camera.rays((pixel.x + 0.5, pixel.y + 0.5), (pixel.w, pixel.h))


def seen_from(camera: PageCamera, bounds: ArrayLike) -> tuple[float, float, float]:
    """The point from which ``camera`` sees a scene within ``bounds`` (2, 3): its eye, or one far behind it where all
    rays are parallel.
    """
    if isinstance(camera, PerspectiveCamera):
        return camera.eye
    corners = np.asarray(bounds, np.float64)
    middle, size = corners.mean(axis=0), float(np.ptp(corners, axis=0).max())
    away = size + float(np.abs(np.subtract(camera.eye, middle)).max())
    return _vector(middle - _FAR * away * camera.frame()[2])


def camera_toml(camera: PageCamera) -> str:
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
    if isinstance(camera, PerspectiveCamera):
        own = [f"fov = {camera.fov!r}"]
    else:
        own = ['type = "orthographic"', f"height = {camera.height!r}"]
    return "\n".join(["[camera]", *rows, *own, ""])


def _vector(values: np.ndarray) -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return x, y, z

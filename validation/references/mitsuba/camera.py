"""Our primary rays against those of Mitsuba's own sensors, which are independent of our film map.

All picture references get our primary rays, so that float32 film positions do not decide silhouettes. This check makes
that fair: without it a wrong camera would be wrong in both pictures.
"""

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

import validation.references.mitsuba.scene  # noqa: F401  # selects the variant
from renderer.scene.camera import OrthographicCamera, PerspectiveCamera, primary_rays

Camera = PerspectiveCamera | OrthographicCamera
Vector = NDArray[np.float64]


def largest_distance(camera: Camera, size: int) -> float:
    """The largest distance in pixels between our ray and Mitsuba's through a pixel's centre, for size x size pixels.

    Measured at the distance of the camera's target, over 33 x 33 pixels that include the corners.
    """
    sensor = mi.load_dict(_sensor(camera, size))
    origins, directions = primary_rays(camera, size, size)
    steps = np.unique(np.linspace(0, size - 1, 33).astype(int))
    away = float(np.linalg.norm(np.subtract(camera.target, camera.eye)))
    worst = 0.0
    for y in steps:
        for x in steps:
            ray, _ = sensor.sample_ray(0.0, 0.5, mi.Point2f((x + 0.5) / size, (y + 0.5) / size), mi.Point2f(0.5))
            row = y * size + x
            theirs = _at(np.array(ray.o, np.float64), np.array(ray.d, np.float64), camera, away)
            worst = max(worst, float(np.linalg.norm(_at(origins[row], directions[row], camera, away) - theirs)))
    return worst / _pixel(camera, size, away)


def _at(o: Vector, d: Vector, camera: Camera, away: float) -> Vector:
    """The point where a ray crosses the plane through the target that faces the camera."""
    _, _, forward = camera.frame()
    t = (away - float(np.dot(o - np.asarray(camera.eye), forward))) / float(np.dot(d, forward))
    return o + t * d


def _pixel(camera: Camera, size: int, away: float) -> float:
    """A pixel's height at the target, in scene units."""
    if isinstance(camera, OrthographicCamera):
        return camera.height / size
    return float(2.0 * away * np.tan(np.radians(camera.fov) / 2.0) / size)


def _sensor(camera: Camera, size: int) -> dict[str, object]:
    to_world = mi.ScalarTransform4f().look_at(origin=list(camera.eye), target=list(camera.target), up=list(camera.up))
    film = {"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"}}
    if isinstance(camera, PerspectiveCamera):
        return {"type": "perspective", "fov": camera.fov, "fov_axis": "y", "to_world": to_world, "film": film}
    half = camera.height / 2.0
    to_world = to_world @ mi.ScalarTransform4f().scale([half, half, 1.0])
    return {"type": "orthographic", "to_world": to_world, "film": film}

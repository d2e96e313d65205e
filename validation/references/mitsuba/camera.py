"""Our primary rays against those of Mitsuba's own sensors, which are independent of our film map.

All picture references get our primary rays, so that float32 film positions do not decide silhouettes. This check makes
that fair: without it a wrong camera would be wrong in both pictures.
"""

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

import validation.references.mitsuba.scene  # noqa: F401  # selects the variant
from renderer.scene.camera import Camera, OrthographicCamera, PerspectiveCamera, PinholeCamera, ThinLensCamera
from renderer.scene.cameras.thin_lens import lens_places

Vectors = NDArray[np.float64]
Rays = tuple[Vectors, Vectors]
# The samples of a pixel that are compared where each starts at another point of a lens.
_SAMPLES = 9


def can_judge(camera: Camera) -> str | None:
    """Why Mitsuba has no sensor like ``camera``; None if it has one."""
    if isinstance(camera, PinholeCamera):
        square = camera.skew == 0.0 and camera.fx == camera.fy
        return None if square else "a pinhole camera whose pixels are not square"
    kept = isinstance(camera, PerspectiveCamera | OrthographicCamera)
    return None if kept else f"a camera of type {camera.type}"


def largest_distance(camera: Camera, resolution: tuple[int, int]) -> float:
    """The largest distance in pixels between our ray and Mitsuba's through a place of a film of some width and height.

    Measured at the distance of the camera's target and at half of it, over 33 x 33 pixels that include the corners.
    """
    width, height = resolution
    sensor = mi.load_dict(_sensor(camera, width, height))
    columns, rows = (np.unique(np.linspace(0, size - 1, 33).astype(int)) for size in resolution)
    x, y = (place.ravel() for place in np.meshgrid(columns + 0.5, rows + 0.5))
    worst: list[float] = []
    for number in range(_SAMPLES if isinstance(camera, ThinLensCamera) else 1):
        u, v = lens_places(x, y, number)
        ours = camera._sample_rays(x, y, width, height, number, _SAMPLES)
        # The x axis of Mitsuba's cameras points left.
        film, lens = np.stack([x / width, y / height], axis=1), np.stack([1.0 - u, v], axis=1)
        worst.append(_distance(ours, _rays(sensor, film, lens), camera, height))
    return float(np.max(worst))


def _rays(sensor: mi.Sensor, film: Vectors, lens: Vectors) -> Rays:
    """Mitsuba's rays through places (n, 2) of film and lens."""
    pairs = zip(film.tolist(), lens.tolist(), strict=True)
    rays = [sensor.sample_ray(0.0, 0.5, mi.Point2f(place), mi.Point2f(start))[0] for place, start in pairs]
    return np.array([ray.o for ray in rays], np.float64), np.array([ray.d for ray in rays], np.float64)


def _distance(ours: Rays, theirs: Rays, camera: Camera, height: int) -> float:
    """The largest distance in pixels of two rays where they cross the planes through the target and half-way to it."""
    target = float(np.linalg.norm(np.subtract(camera.target, camera.eye)))
    apart = ((_at(*ours, camera, away) - _at(*theirs, camera, away), away) for away in (target, 0.5 * target))
    return float(np.max([np.linalg.norm(off, axis=-1).max() / _pixel(camera, height, away) for off, away in apart]))


def _at(o: Vectors, d: Vectors, camera: Camera, away: float) -> Vectors:
    """The points where rays cross the plane that faces the camera, so far away from it."""
    _, _, forward = camera.frame()
    t = (away - (o - np.asarray(camera.eye)) @ forward) / (d @ forward)
    return np.asarray(o + t[:, None] * d)


def _pixel(camera: Camera, height: int, away: float) -> float:
    """A pixel's height in scene units, so far away."""
    if isinstance(camera, OrthographicCamera):
        return camera.height / height
    return float(2.0 * away * np.tan(np.radians(_fov(camera)) / 2.0) / height)


def _fov(camera: Camera) -> float:
    """The vertical field of view in degrees."""
    if isinstance(camera, PinholeCamera):
        return float(np.degrees(2.0 * np.arctan(0.5 * camera.height / camera.fy)))
    assert isinstance(camera, PerspectiveCamera)
    return camera.fov


def _sensor(camera: Camera, width: int, height: int) -> dict[str, object]:
    to_world = mi.ScalarTransform4f().look_at(origin=list(camera.eye), target=list(camera.target), up=list(camera.up))
    film = {"type": "hdrfilm", "width": width, "height": height, "rfilter": {"type": "box"}}
    if isinstance(camera, OrthographicCamera):
        # As wide as high: a film of another shape has its width in place of its height.
        half = 0.5 * camera.height * width / height
        to_world = to_world @ mi.ScalarTransform4f().scale([half, half, 1.0])
        return {"type": "orthographic", "to_world": to_world, "film": film}
    sensor = {"type": "perspective", "fov": _fov(camera), "fov_axis": "y", "to_world": to_world, "film": film}
    if isinstance(camera, ThinLensCamera):
        focus = camera._focus_distance()
        return sensor | {"type": "thinlens", "aperture_radius": camera.aperture, "focus_distance": focus}
    if isinstance(camera, PinholeCamera):
        # From the principal point to the middle, in widths and heights of the film.
        sensor["principal_point_offset_x"] = 0.5 - camera.cx / camera.width
        sensor["principal_point_offset_y"] = 0.5 - camera.cy / camera.height
    return sensor

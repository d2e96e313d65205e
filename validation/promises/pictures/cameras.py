"""Cameras: what each pixel sees, for films of every shape and tilted up.

By the inverse of OpenGL's matrices for perspective and parallel rays, by the formulas of ``lenses`` for others.
"""

from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.picture.render import render
from renderer.scene.camera import Camera, OrthographicCamera, PerspectiveCamera
from renderer.scene.scene import Floor, Scene
from validation.promises.pictures import lenses
from validation.promises.pictures.glowing import glowing
from validation.promises.row import row

Floats = NDArray[np.float64]
_SIZES = ((1, 1), (7, 7), (33, 5), (4, 31), (50, 50))
# Of the depth: OpenGL's matrices are inverted in float64, whose near plane is a hundredth of the far one.
_ROUNDING = 1e-9
_NEAR, _FAR = 0.5, 50.0
_BY = dict.fromkeys(("perspective", "orthographic"), "OpenGL's matrices")


def check_cameras(rng: Generator, count: int) -> list[dict[str, Any]]:
    """Random cameras of all kinds above an endless floor: the depth of every pixel, inf above the horizon."""
    kept: dict[str, list[NDArray[np.bool_]]] = {}
    for number in range(count):
        size = _SIZES[number % len(_SIZES)]
        camera = _random(rng, number, size)
        image = render(_scene(camera), resolution=size, max_depth=0)
        start, way = _lines(camera, *size)
        expected = _depth(start, way)
        with np.errstate(invalid="ignore"):
            near = np.abs(image.depth - expected) <= _ROUNDING * expected
        kept.setdefault(camera.type, []).append((near | (image.depth == expected)).ravel())
    return [
        row(f"the depth that each pixel of a camera sees, {kind}", _BY.get(kind, lenses.BY), np.concatenate(found))
        for kind, found in kept.items()
    ]


def _random(rng: Generator, number: int, size: tuple[int, int]) -> Camera:
    eye = rng.uniform((-3.0, 1.0, -3.0), (3.0, 6.0, 3.0))
    target = eye + rng.uniform((-2.0, -3.0, -2.0), (2.0, -0.3, 2.0))
    up = rng.normal(size=3)
    place = {"eye": tuple(eye.tolist()), "target": tuple(target.tolist()), "up": tuple(up.tolist())}
    kind = number % (2 + lenses.KINDS)
    if kind >= 2:
        return lenses.random(rng, kind - 2, place, size)
    if kind == 1:
        return OrthographicCamera.model_validate({**place, "height": float(rng.uniform(0.2, 4.0))})
    return PerspectiveCamera.model_validate({**place, "fov": float(rng.uniform(5.0, 140.0))})


def _scene(camera: Camera) -> Scene:
    floor = Floor(min=(-1e6, -1e6), max=(1e6, 1e6), materials=("any",))
    return Scene(camera=camera, materials={"any": glowing((0.5, 0.5, 0.5))}, floor=floor)


def _lines(camera: Camera, width: int, height: int) -> tuple[Floats, Floats]:
    """The start of each pixel's ray, and a vector along it."""
    if not isinstance(camera, PerspectiveCamera | OrthographicCamera):
        way = lenses.ways(camera, width, height) @ _view(camera)[:3, :3]
        return np.broadcast_to(np.asarray(camera.eye), way.shape), way
    return _opengl(camera, width, height)


def _opengl(camera: PerspectiveCamera | OrthographicCamera, width: int, height: int) -> tuple[Floats, Floats]:
    """On the ray from the near plane to the far one, back to the eye or film."""
    x, y = np.meshgrid((np.arange(width) + 0.5) / width * 2 - 1, 1 - (np.arange(height) + 0.5) / height * 2)
    inverse = np.linalg.inv(_projection(camera, width / height) @ _view(camera)).astype(np.float64)
    near, far = (_points(inverse, x, y, z) for z in (-1.0, 1.0))
    if isinstance(camera, PerspectiveCamera):
        start = np.broadcast_to(np.asarray(camera.eye), near.shape)
    else:
        start = near - (far - near) * (_NEAR / (_FAR - _NEAR))
    return start, far - near


def _depth(start: Floats, way: Floats) -> Floats:
    """The distance of the plane y = 0 along each line, inf where that misses it."""
    with np.errstate(divide="ignore", invalid="ignore"):
        t = -start[..., 1] / way[..., 1]
    point = start + np.where(t > 0, t, 0.0)[..., None] * way
    on = (t > 0) & (np.abs(point[..., 0]) <= 1e6) & (np.abs(point[..., 2]) <= 1e6)
    return np.where(on, np.linalg.norm(point - start, axis=-1), np.inf)


def _points(inverse: Floats, x: Floats, y: Floats, z: float) -> Floats:
    clip = np.stack([x, y, np.full_like(x, z), np.ones_like(x)], axis=-1) @ inverse.T
    points: Floats = clip[..., :3] / clip[..., 3:]
    return points


def _view(camera: Camera) -> Floats:
    """The matrix of gluLookAt."""
    eye, target, up = (np.asarray(v) for v in (camera.eye, camera.target, camera.up))
    forward = (target - eye) / np.linalg.norm(target - eye)
    side = np.cross(forward, up / np.linalg.norm(up))
    side /= np.linalg.norm(side)
    view = np.eye(4)
    view[:3, :3] = side, np.cross(side, forward), -forward
    view[:3, 3] = -view[:3, :3] @ eye
    return view


def _projection(camera: PerspectiveCamera | OrthographicCamera, aspect: float) -> Floats:
    """The matrix of gluPerspective, or of glOrtho."""
    depth = _FAR - _NEAR
    if isinstance(camera, PerspectiveCamera):
        f = 1.0 / np.tan(np.radians(camera.fov) / 2)
        last = [[0, 0, -(_FAR + _NEAR) / depth, -2 * _FAR * _NEAR / depth], [0, 0, -1, 0]]
        return np.array([[f / aspect, 0, 0, 0], [0, f, 0, 0], *last])
    half = camera.height / 2
    last = [[0, 0, -2 / depth, -(_FAR + _NEAR) / depth], [0, 0, 0, 1]]
    return np.array([[1 / (half * aspect), 0, 0, 0], [0, 1 / half, 0, 0], *last])

"""Small scenes of known radiance, for the extreme cases of shading."""

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from renderer import Image, Mesh, Scene, render
from renderer.materials.mirror import Mirror
from renderer.materials.phong import Phong
from renderer.materials.registry import Material
from renderer.mesh.shapes import icosphere
from renderer.scene.camera import Camera, PerspectiveCamera
from renderer.scene.scene import UNLIMITED_RAYS, SceneObject

Vector = tuple[float, float, float]

U = 2.0**-53
# Radiance is stored as float32: half an ulp, and as much again for the float64 sums before it.
REL = 2.0**-23
STORED = "2^-23 relative: radiance is stored as float32"

GLOWS = Phong(diffuse=0.0, ambient=1.0)
WHITE = Phong(diffuse=1.0, ambient=0.0)
MIRROR = Mirror(type="mirror")


def scene_of(camera: Camera, *parts: tuple[Mesh, Material], smooth: bool = False, **more: Any) -> Scene:
    """A scene of meshes with their materials; ambient light is 1 unless given."""
    normals: Literal["flat", "smooth"] = "smooth" if smooth else "flat"
    return Scene(
        camera=camera,
        materials={f"m{i}": material for i, (_, material) in enumerate(parts)} | more.pop("materials", {}),
        objects=tuple(SceneObject(mesh=m, material=f"m{i}", normals=normals) for i, (m, _) in enumerate(parts)),
        **{"ambient": 1.0, **more},
    )


def quad(centre: Any, a: Any, b: Any) -> Mesh:
    """A rectangle of half edges a and b, its normal along a x b."""
    c, a, b = (np.asarray(v, np.float64) for v in (centre, a, b))
    return Mesh(np.array([c - a - b, c + a - b, c + a + b, c - a + b]), np.array([[0, 1, 2], [0, 2, 3]]))


def level(x: float, y: float, z: float, half: float = 50.0) -> Mesh:
    """A square facing up."""
    return quad((x, y, z), (0, 0, half), (half, 0, 0))


def eye_at(eye: Vector, target: Vector, up: Vector = (0.0, 1.0, 0.0), fov: float = 20.0) -> PerspectiveCamera:
    """A camera whose picture of one pixel has one ray, from ``eye`` to ``target``."""
    return PerspectiveCamera(eye=eye, target=target, up=up, fov=fov)


def one(scene: Scene, **options: Any) -> Image:
    """The image of one pixel: the ray from the eye to the camera's target."""
    return render(scene, resolution=(1, 1), threads=1, **{"max_rays": UNLIMITED_RAYS, **options})


def pixel(scene: Scene, **options: Any) -> float:
    """The red radiance of that pixel."""
    return float(one(scene, **options).radiance[0, 0, 0])


def close(value: float, expected: float) -> bool:
    """Whether a stored radiance is as expected, to ``REL``."""
    return abs(value - expected) <= REL * expected


def vector(values: Any) -> Vector:
    """Three numbers as a tuple, which kernels take."""
    return (float(values[0]), float(values[1]), float(values[2]))


def unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Vectors (..., 3) scaled to unit length."""
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def ball(scale: float) -> Mesh:
    """An icosphere of 1,280 faces and radius ``scale`` at the origin."""
    return Mesh(icosphere(3).vertices * scale, icosphere(3).faces)

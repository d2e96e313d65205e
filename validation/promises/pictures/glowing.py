"""Scenes of surfaces that glow and need no light, and the comparison of their pictures with colours by hand."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.fields import Color
from renderer.materials.phong import Phong
from renderer.mesh.mesh import Mesh
from renderer.picture.prepare import PreparedScene
from renderer.picture.render import render
from renderer.scene.camera import OrthographicCamera
from renderer.scene.scene import Scene, SceneObject
from validation.meshes import squares

Floats = NDArray[np.float64]
BLACK: Color = (0.0, 0.0, 0.0)
# Radiance is stored as float32: half a unit of its last place, and as much for sums in float64.
_ROUNDING = 2.0**-23


def glowing(color: Color, reflectance: Color = BLACK, transmittance: Color = BLACK, ior: float = 1.0) -> Phong:
    """A surface that shows ``color`` by ambient light alone, which is (1, 1, 1) in these scenes."""
    return Phong(
        diffuse=BLACK, ambient=color, specular=BLACK, reflectance=reflectance, transmittance=transmittance, ior=ior
    )


def from_above(eye: tuple[float, float, float], height: float) -> OrthographicCamera:
    """A camera that looks straight down at the plane y = 0; x goes to the right of the picture and z down."""
    return OrthographicCamera(eye=eye, target=(eye[0], eye[1] - 1.0, eye[2]), up=(0.0, 0.0, -1.0), height=height)


def square(corner: Floats, u: Floats, v: Floats) -> Mesh:
    """The parallelogram from ``corner`` along u and v; u x v is its outside."""
    return squares(np.array([[corner, corner + u, corner + u + v, corner + v]]))


def thing(mesh: Mesh, material: str) -> SceneObject:
    """A mesh where it stands."""
    return SceneObject(mesh=mesh, material=material)


def shown(scene: Scene | PreparedScene, resolution: tuple[int, int], **settings: Any) -> NDArray[np.float32]:
    """The radiance of a scene."""
    return render(scene, resolution=resolution, **settings).radiance


def equal(radiance: NDArray[np.float32], expected: Floats) -> NDArray[np.bool_]:
    """Whether each pixel has the colour expected of it."""
    off = np.abs(radiance - expected).max(axis=-1)
    kept: NDArray[np.bool_] = off <= _ROUNDING * np.maximum(1.0, np.abs(expected).max(axis=-1))
    return kept

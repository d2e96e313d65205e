"""The sky over an empty scene, over level ground and in a mirror; and normals that stop at sharp edges."""

import math
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from renderer.materials.mirror import Mirror
from renderer.materials.phong import Phong
from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import icosphere
from renderer.picture.render import render
from renderer.scene.camera import OrthographicCamera
from renderer.scene.light import DirectionalLight
from renderer.scene.scene import Scene, SceneObject
from renderer.scene.sky import Sky
from validation.promises.pictures.glowing import equal, from_above, shown, square, thing
from validation.promises.row import row

_ZENITH, _HORIZON, _GROUND = np.array([0.25, 0.5, 1.0]), np.array([0.75, 0.5, 0.25]), np.array([0.125, 0.25, 0.0])
_LIGHTS = 64
# The sides of a prism: from wall to wall 10 degrees, and 90 from a wall to an end.
_SIDES = 36


def check_skies() -> list[dict[str, Any]]:
    """Each by a formula: a line in the sine of the height, integrals over the sky, the radial normals of a prism."""
    return [
        row("rays that miss see the sky of their height", "closed form", _seen()),
        row("a mirror shows the sky", "closed form", _mirrored()),
        row("level ground has the light of the whole sky and of the sun's disc", "closed form", _lit()),
        row("smooth normals stop at edges sharper than the crease", "closed form", _creased()),
        row("with a soft terminator a convex body hides no light from itself", "known answer", _soft()),
    ]


def _sky(**more: Any) -> Sky:
    return Sky(zenith=_ZENITH, horizon=_HORIZON, ground=_GROUND, **more)


def _of_height(sine: float) -> NDArray[np.float64]:
    return _HORIZON + sine * (_ZENITH - _HORIZON) if sine > 0.0 else _GROUND


def _seen() -> NDArray[np.bool_]:
    """Single rays at angles above and below the horizon, whichever axis is up."""
    kept: list[NDArray[np.bool_]] = []
    ups: tuple[Literal["x", "y", "z"], ...] = ("x", "y", "z")
    for axis, up in enumerate(ups):
        for angle in np.radians([-80.0, -10.0, 10.0, 45.0, 80.0]):
            towards = np.roll([math.sin(angle), math.cos(angle), 0.0], axis)
            side = np.roll([0.0, 0.0, 1.0], axis)
            camera = OrthographicCamera(eye=(0.0, 0.0, 0.0), target=towards, up=side, height=1.0)
            scene = Scene(camera=camera, materials={}, sky=_sky(), up=up)
            kept.append(equal(shown(scene, (1, 1)), np.full((1, 1, 3), _of_height(math.sin(angle)))).ravel())
    return np.concatenate(kept)


def _ground() -> Mesh:
    return square(np.array([-4.0, 0.0, -4.0]), np.array([0.0, 0.0, 8.0]), np.array([8.0, 0.0, 0.0]))


def _mirrored() -> NDArray[np.bool_]:
    kept = []
    for angle in np.radians([20.0, 45.0, 70.0]):
        eye = np.array([-math.cos(angle), math.sin(angle), 0.0])
        camera = OrthographicCamera(eye=eye, target=(0.0, 0.0, 0.0), up=(0.0, 0.0, 1.0), height=1e-6)
        materials, ground = {"mirror": Mirror(reflectance=0.5)}, thing(_ground(), "mirror")
        scene = Scene(camera=camera, materials=materials, objects=(ground,), sky=_sky())
        kept.append(equal(shown(scene, (1, 1)), np.full((1, 1, 3), 0.5 * _of_height(math.sin(angle)))).ravel())
    return np.concatenate(kept)


def _lit() -> NDArray[np.bool_]:
    """h / 3 + 2 z / 3 and the error of the midpoint rule; half of 1 + cos a of a sun straight above."""
    of_sky = _HORIZON / 3.0 + 2.0 * _ZENITH / 3.0 + (_HORIZON - _ZENITH) / (6.0 * _LIGHTS**2)
    of_sun = np.array([0.5, 0.25, 1.0]) * (1.0 + math.cos(math.radians(20.0))) / 2.0
    sun = {"sun": (0.0, -3.0, 0.0), "sun_irradiance": (0.5, 0.25, 1.0), "sun_angle": 20.0, "sun_lights": 7}
    kept = []
    for sky, light in (
        (_sky(lights=_LIGHTS), of_sky),
        (_sky(lights=0, **sun), of_sun),
        (_sky(lights=_LIGHTS, **sun), of_sky + of_sun),
    ):
        scene = Scene(
            camera=from_above((0.0, 5.0, 0.0), 1e-6), materials={"white": Phong(diffuse=1.0)},
            objects=(thing(_ground(), "white"),), sky=sky,
        )  # fmt: skip
        kept.append(equal(shown(scene, (1, 1)), np.full((1, 1, 3), light)).ravel())
    return np.concatenate(kept)


def _soft() -> NDArray[np.bool_]:
    """A smooth ball of few faces, lit from the side: with shadows and without the picture has the same bits."""
    camera = OrthographicCamera(eye=(0.0, 0.0, 5.0), target=(0.0, 0.0, 0.0), height=2.0)
    ball = SceneObject(mesh=icosphere(1), material="white", normals="smooth", rotate=(10.0, 20.0, 30.0))
    light = DirectionalLight(direction=(-1.0, 0.0, -0.2))
    scene = Scene(camera=camera, materials={"white": Phong(diffuse=1.0)}, objects=(ball,), lights=(light,))
    lit, soft = (
        render(scene, resolution=(40, 40), shadows=shadows, terminator="soft").radiance for shadows in (False, True)
    )
    return (lit == soft).all(axis=-1).ravel()


def _creased() -> NDArray[np.bool_]:
    """A prism about the z axis: its wall is round above 10 degrees and flat below; its ends are always flat."""
    turn = 2.0 * np.pi * np.arange(_SIDES) / _SIDES
    ring = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    i, j, n = np.arange(_SIDES), (np.arange(_SIDES) + 1) % _SIDES, _SIDES
    vertices = np.concatenate([np.c_[ring, np.zeros(n)], np.c_[ring, np.ones(n)], [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]])
    ends = [np.c_[j, i, np.full(n, 2 * n)], np.c_[i + n, j + n, np.full(n, 2 * n + 1)]]
    prism = Mesh(vertices, np.concatenate([np.c_[i, j, j + n], np.c_[i, j + n, i + n], *ends]))
    flat = np.repeat(prism.face_normals()[:, None], 3, axis=1)
    round_ = np.where(np.arange(4 * n)[:, None, None] < 2 * n, prism.triangles * (1.0, 1.0, 0.0), flat)
    kept = []
    for angle, wanted in ((9.0, flat), (11.0, round_), (80.0, round_)):
        creased = prism.creased(angle)
        assert creased.normals is not None
        kept.append(np.isclose(creased.normals[creased.faces], wanted, rtol=0.0, atol=1e-12).all(axis=-1).ravel())
    return np.concatenate(kept)

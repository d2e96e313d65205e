"""Numbers of bounces, and the weight that ends a ray: sums between two mirrors, and through panes, by hand."""

from collections.abc import Callable
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.fields import Color
from renderer.materials.dielectric import Dielectric
from renderer.materials.mirror import Mirror
from renderer.materials.phong import Phong
from renderer.materials.registry import Material
from renderer.picture.prepare import PreparedScene
from renderer.picture.render import prepare, render
from renderer.scene.camera import OrthographicCamera
from renderer.scene.light import PointLight
from renderer.scene.scene import RenderSettings, Scene, SceneObject
from validation.promises.pictures.glowing import BLACK, equal, glowing, shown, square, thing
from validation.promises.row import row

Floats = NDArray[np.float64]
# Powers of two, so that weights are exact and a bound can equal one: the largest channel, the mean, and red, green and
# blue alone end a ray at different bounces.
_WEIGHT: Color = (0.125, 0.5, 0.25)
_GLOW: tuple[Color, Color] = ((0.25, 0.5, 1.0), (1.0, 0.125, 0.5))
_DEPTHS = (0, 1, 2, 3, 6, 11)
_BOUNDS = (0.0, 0.5**3, float(np.nextafter(0.5**3, 1.0)), float(np.nextafter(0.5**3, 0.0)), 0.3, 0.07)
_CAMERA = OrthographicCamera(eye=(0.1, 0.2, 1.0), target=(0.1, 0.2, 0.0), height=1.0)
# How many rays a pixel needs that shows one of two squares that face each other, beside one light, at a depth.
_NEEDED: tuple[tuple[Material, Callable[[int], int]], ...] = (
    (Mirror(), lambda depth: 1 + depth),
    (Phong(diffuse=0.5, specular=0.0), lambda depth: 2),
    (Phong(diffuse=0.0, specular=0.5), lambda depth: 2),
    (Phong(diffuse=0.0, specular=0.0), lambda depth: 1),
    (Phong(diffuse=0.5, reflectance=0.5), lambda depth: 2 * (1 + depth)),
    (Phong(diffuse=0.0, specular=0.0, reflectance=0.5), lambda depth: 1 + depth),
    (Dielectric(reflectance=0.0, ior=1.5), lambda depth: 1 + min(depth, 1)),
)


def check_bounces() -> list[dict[str, Any]]:
    """Rays between two mirrors that face each other, and rays through parallel panes."""
    found = []
    for name, scene in (("between two mirrors", _mirrors()), ("through panes", _panes())):
        kept = [_kept(scene, depth, 0.0) for depth in _DEPTHS]
        found.append(row(f"max_depth bounces are followed, {name}", "closed form", np.concatenate(kept)))
        kept = [_kept(scene, 20, bound) for bound in _BOUNDS]
        promise = f"a ray ends where its largest weight is below min_weight, {name}"
        found.append(row(promise, "closed form", np.concatenate(kept)))
    found.append(row("a prepared scene is drawn at any max_depth", "closed form", _prepared()))
    glass = "glass that lets no light through reflects Fresnel's share"
    return [
        *found,
        row(glass, "Fresnel's formula", _black_glass()),
        row("rays are counted, and none that shows nothing is traced", "known answer", _counted()),
    ]


def _prepared() -> NDArray[np.bool_]:
    """Scenes whose own max_depth is 0 or 1, prepared once."""
    kept = []
    for scene, own in product((_mirrors(), _panes()), (0, 1)):
        ready = prepare(scene.model_copy(update={"render": RenderSettings(max_depth=own)}))
        kept += [_kept(ready, depth, 0.0) for depth in _DEPTHS]
    return np.concatenate(kept)


def _counted() -> NDArray[np.bool_]:
    """Pictures of each material of _NEEDED."""
    kept = []
    for material, number in _NEEDED:
        scene = Scene(
            camera=_CAMERA, materials={"any": material}, objects=(_wall(0.0, 1.0, "any"), _wall(2.0, -1.0, "any")),
            lights=(PointLight(position=(0.5, 0.5, 0.75), intensity=1.0),),
        )  # fmt: skip
        for depth in (0, 1, 4):
            rays = render(scene, resolution=(3, 2), max_depth=depth).rays
            kept.append((rays == number(depth)).ravel())
    return np.concatenate(kept)


def _black_glass() -> NDArray[np.bool_]:
    """A pane of glass from straight in front, before a bright background, with transmittance of one colour or none."""
    kept = []
    for ior in (1.25, 1.5, 3.0):
        for color in (BLACK, (0.0, 0.5, 0.0)):
            glass = Dielectric(ior=ior, transmittance=color)
            scene = Scene(
                camera=_CAMERA,
                materials={"glass": glass},
                objects=(_wall(0.0, 1.0, "glass"),),
                background=(1.0, 0.5, 0.25),
            )
            share = ((ior - 1.0) / (ior + 1.0)) ** 2
            weight = share + (1.0 - share) * np.array(color)
            kept.append(equal(shown(scene, (1, 1)), np.full((1, 1, 3), weight * [1.0, 0.5, 0.25])).ravel())
    return np.concatenate(kept)


def _kept(scene: Scene | PreparedScene, depth: int, bound: float) -> NDArray[np.bool_]:
    radiance = shown(scene, (5, 3), max_depth=depth, min_weight=bound)
    return equal(radiance, _expected(depth, bound)).ravel()


def _expected(depth: int, bound: float) -> Floats:
    color, weight = np.zeros(3), np.ones(3)
    for bounce in range(depth + 1):
        if bounce and weight.max() < bound:
            break
        color += weight * _GLOW[bounce % 2]
        weight *= _WEIGHT
    return color


def _scene(objects: list[tuple[float, float, str]], reflectance: Color, transmittance: Color) -> Scene:
    """Squares (z, which way they face, material), seen from z = 1 along -z."""
    materials = {name: glowing(glow, reflectance, transmittance) for name, glow in zip("ab", _GLOW, strict=True)}
    return Scene(
        camera=_CAMERA, materials=materials, objects=tuple(_wall(*one) for one in objects), ambient=(1.0, 1.0, 1.0)
    )


def _wall(z: float, facing: float, material: str) -> SceneObject:
    """A square across the view, which faces +z or -z."""
    x, y = np.array([8.0, 0.0, 0.0]), np.array([0.0, 8.0, 0.0])
    return thing(square(np.array([-4.0, -4.0, z]), *((x, y) if facing > 0.0 else (y, x))), material)


def _mirrors() -> Scene:
    return _scene([(0.0, 1.0, "a"), (2.0, -1.0, "b")], _WEIGHT, BLACK)


def _panes() -> Scene:
    """Each pane is entered: all of them face the eye."""
    return _scene([(-float(i), 1.0, "ab"[i % 2]) for i in range(25)], BLACK, _WEIGHT)

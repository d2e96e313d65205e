"""Lights of one colour each, directional and point lights, on a surface that scatters all of it."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.materials.dielectric import Dielectric
from renderer.materials.phong import Phong
from renderer.mesh.mesh import Mesh
from renderer.picture.render import render
from renderer.scene.light import DirectionalLight, PointLight
from renderer.scene.scene import RenderSettings, Scene, SceneObject
from validation.promises.pictures.glowing import equal, from_above, shown, square, thing
from validation.promises.row import row

_LIT = (24, 24)


def check_shining() -> list[dict[str, Any]]:
    """One pixel of a white square from above, lit straight from above from a distance of 2."""
    ground = square(np.array([-4.0, 0.0, -4.0]), np.array([0.0, 0.0, 8.0]), np.array([8.0, 0.0, 0.0]))
    kept = []
    for colors in ([(1, 0, 0)], [(0, 1, 0)], [(0, 0, 1)], [(0, 0, 1), (0, 0, 0), (0, 1, 0)]):
        strengths = [tuple(0.5 * float(c) for c in color) for color in colors]
        expected = np.full((1, 1, 3), np.sum(strengths, axis=0))
        for lights in (
            tuple(DirectionalLight(direction=(0.0, -1.0, 0.0), irradiance=s) for s in strengths),
            tuple(PointLight(position=(0.0, 2.0, 0.0), intensity=tuple(4.0 * c for c in s)) for s in strengths),
        ):
            scene = Scene(
                camera=from_above((0.0, 5.0, 0.0), 1e-6), materials={"white": Phong(diffuse=1.0, specular=0.0)},
                objects=(thing(ground, "white"),), lights=lights,
            )  # fmt: skip
            kept.append(equal(shown(scene, (1, 1)), expected).ravel())
    return [
        row("a light of any one colour shines, beside dark ones", "closed form", np.concatenate(kept)),
        row("highlights of the largest exponents keep their width", "closed form", _narrow(ground)),
        row("where smooth normals cancel, the face's own is used", "closed form", _flat(ground)),
        row(
            "light beyond float64 leaves a dark channel dark, and is the largest float32",
            "known answer",
            _endless(ground),
        ),
        row("what a lamp stands on does not hide it", "known answer", _lamps(ground)),
        row("light passes glass by its transmittance, and nothing opaque", "closed form", _through(ground)),
    ]


def _through(ground: Mesh) -> NDArray[np.bool_]:
    """Up to three panes, each a square, between the ground and its light; and an opaque one among them or above."""
    tint, kept = np.array([0.5, 1.0, 0.25]), []
    pane = square(np.array([-4.0, 0.0, -4.0]), np.array([0.0, 0.0, 8.0]), np.array([8.0, 0.0, 0.0]))
    for light in (
        DirectionalLight(direction=(0.25, -1.0, 0.5), irradiance=0.5),
        PointLight(position=(0.0, 8.0, 0.0), intensity=32.0),
    ):
        bare = None
        for layers in ((), ("glass",), ("glass",) * 3, ("white",), ("glass", "white"), ("white", "glass")):
            heights = [np.add(pane.vertices, (0.0, 2.0 + k, 0.0)) for k in range(len(layers))]
            panes = [thing(Mesh(at, pane.faces), name) for at, name in zip(heights, layers, strict=True)]
            scene = Scene(
                camera=from_above((0.0, 1.0, 0.0), 1e-6),
                materials={"white": Phong(diffuse=1.0), "glass": Dielectric(transmittance=tint)},
                objects=(thing(ground, "white"), *panes), lights=(light,),
                render=RenderSettings(max_depth=0, glass_shadows="clear"),
            )  # fmt: skip
            found = shown(scene, (1, 1))
            bare = found if bare is None else bare
            share = 0.0 if "white" in layers else tint ** len(layers)
            kept.append(equal(found, bare * share).ravel())
    return np.concatenate(kept)


def _narrow(ground: Mesh) -> NDArray[np.bool_]:
    """Light from so little beside the eye that the highlight is e^-1/2 of its middle, for exponents up to 1e14."""
    kept = []
    for power in range(2, 8):
        beside = 10.0**-power
        shininess = 1.0 / math.tan(beside) ** 2
        light = DirectionalLight(direction=(-math.sin(beside), -math.cos(beside), 0.0), irradiance=(1.0, 1.0, 1.0))
        scene = Scene(
            camera=from_above((0.0, 5.0, 0.0), 1e-6),
            materials={"shiny": Phong(diffuse=0.0, specular=1.0, shininess=shininess)},
            objects=(thing(ground, "shiny"),), lights=(light,),
        )  # fmt: skip
        # cos(x)^k, of which the cosine alone would lose all digits.
        expected = math.exp(shininess * 0.5 * math.log1p(-(math.sin(beside) ** 2)))
        kept.append(equal(shown(scene, (1, 1)), np.full((1, 1, 3), expected)).ravel())
    return np.concatenate(kept)


def _flat(ground: Mesh) -> NDArray[np.bool_]:
    """A square whose vertex normals are 0, and one whose normals cancel in the middle."""
    up, kept = np.array([0.0, 1.0, 0.0]), []
    for normals in (np.zeros((4, 3)), np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 0.0), (-1.0, 0.0, 0.0)])):
        mesh = Mesh(ground.vertices, ground.faces, normals)
        scene = Scene(
            camera=from_above((0.0, 5.0, 0.0), 1e-6), materials={"white": Phong(diffuse=1.0, specular=0.0)},
            objects=(SceneObject(mesh=mesh, material="white", normals="smooth"),),
            lights=(DirectionalLight(direction=(0.0, -1.0, 0.0), irradiance=(1.0, 0.5, 0.25)),),
        )  # fmt: skip
        image = render(scene, resolution=(1, 1))
        kept += [equal(image.radiance, np.array([[[1.0, 0.5, 0.25]]])).ravel(), (image.normal[0] == up).all(axis=1)]
    return np.concatenate(kept)


def _lamps(ground: Mesh) -> NDArray[np.bool_]:
    """Lamps on a ceiling of whole numbers, at places that float64 rounds, and turned ceilings whose lamps it rounds."""
    kept, up = [], np.array([0.0, 1.0, 0.0])
    for place in ((0.3, 0.2), (-1.1, 0.7), (1.0 / 3.0, 2.0 / 3.0)):
        for tilt in (0.0, 0.1):
            across, along = np.array([0.0, 0.0, 3.0]), np.array([3.0, 3.0 * tilt, 0.0])
            corner = 2.0 * up - 0.5 * across - 0.5 * along
            lamp = corner + (place[0] / 4.0 + 0.5) * along + (place[1] / 4.0 + 0.5) * across
            scene = Scene(
                camera=from_above((0.0, 1.0, 0.0), 2.0), materials={"any": Phong(diffuse=0.5)},
                objects=(thing(ground, "any"), thing(square(corner, along, across), "any")),
                lights=(PointLight(position=(lamp[0], lamp[1], lamp[2])),), render=RenderSettings(shadows=True),
            )  # fmt: skip
            kept.append((shown(scene, _LIT) > 0.0).all(axis=-1).ravel())
    return np.concatenate(kept)


def _endless(ground: Mesh) -> NDArray[np.bool_]:
    """Point lights so near that the irradiance of some channels overflows, on surfaces that lack some channels."""
    light = PointLight(position=(0.0, 1e-3, 0.0), intensity=(1e308, 1e308, 0.0))
    largest, kept = float(np.finfo(np.float32).max), []
    for diffuse, expected in (((1.0, 0.0, 1.0), (largest, 0.0, 0.0)), ((0.0, 1.0, 0.5), (0.0, largest, 0.0))):
        scene = Scene(
            camera=from_above((0.0, 5.0, 0.0), 1e-6), materials={"any": Phong(diffuse=diffuse, specular=0.0)},
            objects=(thing(ground, "any"),), lights=(light,),
        )  # fmt: skip
        kept.append((shown(scene, (1, 1)) == np.array(expected)).ravel())
    return np.concatenate(kept)

"""The planes of a picture beside its colours: which normals and faces it shows, and how many rays it counts."""

import warnings
from collections.abc import Callable
from itertools import combinations
from typing import Any

import numpy as np
import trimesh
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.materials.dielectric import Dielectric
from renderer.materials.mirror import Mirror
from renderer.materials.phong import Phong
from renderer.mesh.mesh import Mesh
from renderer.picture.render import render
from renderer.scene.camera import OrthographicCamera
from renderer.scene.light import DirectionalLight
from renderer.scene.scene import Floor, RenderSettings, Scene, SceneObject
from validation.promises.pictures.glowing import equal, from_above, glowing, square, thing
from validation.promises.row import row

Bools = NDArray[np.bool_]
_CAMERA = from_above((0.0, 5.0, 0.0), 2.0)
_SIZE = 3, 2
_ACROSS, _ALONG = np.array([0.0, 0.0, 8.0]), np.array([8.0, 0.0, 0.0])
# Sums of angles by two programs, in units of the last place of 1.
_ROUNDING = 1e-14


def check_images(rng: Generator) -> list[dict[str, Any]]:
    """Squares from above, of which one is seen from its back, and one covers half of the picture."""
    checks: dict[tuple[str, str], Callable[[], Bools]] = {
        ("a picture's normals are those of the winding, whichever side is seen", "known answer"): _sides,
        ("a picture counts the rays of all samples of a pixel", "direct count"): _samples,
        ("only surfaces that show direct light send shadow rays", "known answer"): _shadowed,
        ("arguments of render override the scene, also 0 and False", "closed form"): _given,
        ("pixels are marked as cut exactly where max_rays ended their rays", "known answer"): _cut,
        ("a picture's faces are those of the objects joined, also in one plane", "known answer"): _faces,
        ("a floor faces up, from wherever it is seen", "known answer"): _floor,
        ("each requested plane is kept, whatever the others are", "full picture"): _some,
        ("smooth objects have the normals of their files", "input arrays"): _smooth,
        ("the length of a light's direction does not matter", "closed form"): _lengths,
    }
    found = [row(promise, judge, check()) for (promise, judge), check in checks.items()]
    return [*found, row("vertex normals weigh faces by their angles", "trimesh", _weighed(rng))]


def _ground(up: bool = True) -> Mesh:
    return square(np.array([-4.0, 0.0, -4.0]), *((_ACROSS, _ALONG) if up else (_ALONG, _ACROSS)))


def _scene(mesh: Mesh, material: Any, **more: Any) -> Scene:
    return Scene(camera=_CAMERA, materials={"any": material}, objects=(thing(mesh, "any"),), **more)


def _sides() -> Bools:
    kept = []
    for up in (True, False):
        image = render(_scene(_ground(up), Phong()), resolution=_SIZE)
        kept.append((image.normal == [0.0, 1.0 if up else -1.0, 0.0]).ravel())
    return np.concatenate(kept)


def _samples() -> Bools:
    scene = _scene(_ground(), Mirror())
    return np.concatenate(
        [(render(scene, resolution=_SIZE, samples=k, max_depth=1).rays == 2 * k).ravel() for k in (1, 4, 9)]
    )


def _shadowed() -> Bools:
    """Half of the picture is lit, the other shows no light of a lamp."""
    halves = [square(np.array([x, 0.0, -4.0]), _ACROSS, _ALONG / 2.0) for x in (-4.0, 0.0)]
    sun = DirectionalLight(direction=(0.0, -1.0, 0.0), irradiance=(1.0, 1.0, 1.0))
    kept = []
    for dark in (Mirror(), Dielectric(type="dielectric"), Phong(diffuse=0.0, specular=0.0)):
        scene = Scene(
            camera=_CAMERA, materials={"dark": dark, "lit": Phong()}, lights=(sun,),
            objects=(thing(halves[0], "dark"), thing(halves[1], "lit")), render=RenderSettings(max_depth=0),
        )  # fmt: skip
        kept.append((render(scene, resolution=(8, 4)).rays == np.where(np.arange(8) >= 4, 2, 1)).ravel())
    return np.concatenate(kept)


def _given() -> Bools:
    """A light behind a screen, and a mirror under a glowing sky."""
    light = DirectionalLight(direction=(0.0, -1.0, 0.0), irradiance=(1.0, 1.0, 1.0))
    screen = square(np.array([-4.0, 9.0, -4.0]), _ACROSS, _ALONG)
    lit = Scene(
        camera=_CAMERA, materials={"any": Phong(diffuse=0.5, specular=0.0)}, lights=(light,),
        objects=(thing(_ground(), "any"), thing(screen, "any")), render=RenderSettings(shadows=True),
    )  # fmt: skip
    mirror = _scene(
        _ground(), glowing((0.25, 0.25, 0.25), reflectance=(0.5, 0.5, 0.5)), ambient=(1.0, 1.0, 1.0),
        background=(1.0, 1.0, 1.0), render=RenderSettings(max_depth=3, min_weight=0.75),
    )  # fmt: skip
    cases: tuple[tuple[Scene, dict[str, Any], float], ...] = (
        (lit, {}, 0.0), (lit, {"shadows": False}, 0.5),
        (mirror, {}, 0.25), (mirror, {"min_weight": 0.0}, 0.75), (mirror, {"min_weight": 0.0, "max_depth": 0}, 0.25),
    )  # fmt: skip
    kept = [equal(render(scene, resolution=_SIZE, **more).radiance, np.full(3, shade)) for scene, more, shade in cases]
    return np.concatenate(kept).ravel()


def _cut() -> Bools:
    """Two mirrors would go on, one alone and a surface that reflects nothing end by themselves."""
    above = square(np.array([-4.0, 9.0, -4.0]), _ALONG, _ACROSS)
    kept = []
    for material, meshes, number in ((Mirror(), 2, 6), (Mirror(), 1, 0), (Phong(), 2, 0)):
        # A mirror that nobody sees, so that every picture may have bounces.
        aside = thing(square(np.array([90.0, 0.0, 90.0]), _ACROSS, _ALONG), "mirror")
        objects = (*(thing(mesh, "any") for mesh in (_ground(), above)[:meshes]), aside)
        scene = Scene(camera=_CAMERA, materials={"any": material, "mirror": Mirror()}, objects=objects)
        most = 2 if meshes == 1 else 1 if number == 0 else 3
        kept.append(_quietly(scene, most) == number)
    return np.array(kept)


def _quietly(scene: Scene, most: int) -> int:
    """The number of cut pixels, without the warning."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return render(scene, resolution=_SIZE, max_rays=most, max_depth=9).cut


def _faces() -> Bools:
    """Squares side by side in one plane, one an object and three of another, and the two triangles of each."""
    columns = [square(np.array([x, 0.0, -4.0]), _ACROSS, _ALONG / 8.0) for x in (-2.0, -1.0, 0.0, 1.0)]
    joined = Mesh(
        np.concatenate([mesh.vertices for mesh in columns[1:]]),
        np.concatenate([mesh.faces + 4 * k for k, mesh in enumerate(columns[1:])]),
    )
    scene = Scene(
        camera=from_above((0.0, 5.0, 0.0), 1.0), materials={"any": Phong()},
        objects=(thing(columns[0], "any"), thing(joined, "any")),
    )  # fmt: skip
    face = render(scene, resolution=(40, 10)).face
    side = _side(columns[0])
    kept: Bools = (face == 2 * (np.arange(40) // 10) + side).ravel()
    return kept


def _side(mesh: Mesh) -> NDArray[np.int64]:
    """The one of a column's two triangles that each of its pixels shows, for each column: (10, 40)."""
    x, z = np.meshgrid(-2.0 + (np.arange(10) + 0.5) / 10.0, -0.5 + (np.arange(10) + 0.5) / 10.0)
    (a, _, c), _ = mesh.triangles[:, :, [0, 2]]
    first = mesh.triangles[0, 1, [0, 2]]
    way, to = c - a, first - a
    across = (way[0] * (z - a[1]) - way[1] * (x - a[0])) * (way[0] * to[1] - way[1] * to[0])
    return np.tile(np.where(across > 0.0, 0, 1), 4)


def _floor() -> Bools:
    floor, kept = Floor(min=(-9.0, -9.0), max=(9.0, 9.0), materials=("any",)), []
    for height in (5.0, -5.0):
        camera = OrthographicCamera(eye=(0.1, height, 0.2), target=(0.1, 0.0, 0.2), up=(0.0, 0.0, -1.0), height=2.0)
        image = render(Scene(camera=camera, materials={"any": Phong()}, floor=floor), resolution=_SIZE)
        kept.append((image.normal == [0.0, 1.0, 0.0]).ravel())
    return np.concatenate(kept)


def _some() -> Bools:
    """A square that covers half of the picture, so that no plane is alike everywhere."""
    scene, kept = _scene(square(np.array([0.0, 0.0, -4.0]), _ACROSS, _ALONG), Mirror()), []
    whole = render(scene, resolution=_SIZE)
    names = ("depth", "normal", "face", "rays")
    for planes in (some for k in range(5) for some in combinations(names, k)):
        image = render(scene, resolution=_SIZE, planes=planes)
        for name in names:
            plane = getattr(image, name)
            kept.append(np.array_equal(plane, getattr(whole, name)) if name in planes else plane.size == 0)
    return np.array(kept)


def _smooth() -> Bools:
    normals = np.tile([0.6, 0.8, 0.0], (4, 1))
    mesh = Mesh(_ground().vertices, _ground().faces, normals)
    kept = []
    for how, expected in (("smooth", (0.6, 0.8, 0.0)), ("flat", (0.0, 1.0, 0.0))):
        one = SceneObject.model_validate({"mesh": mesh, "material": "any", "normals": how})
        image = render(Scene(camera=_CAMERA, materials={"any": Phong()}, objects=(one,)), resolution=_SIZE)
        kept.append((np.abs(image.normal - expected) <= 2.0**-23).ravel())
    return np.concatenate(kept)


def _lengths() -> Bools:
    kept = []
    for long in (1e-3, 0.5, 1.0, 7.0, 1e6):
        light = DirectionalLight(direction=(0.0, -long, 0.0), irradiance=(0.5, 0.25, 1.0))
        scene = _scene(_ground(), Phong(diffuse=1.0, specular=0.0), lights=(light,))
        kept.append(equal(render(scene, resolution=_SIZE).radiance, np.array([0.5, 0.25, 1.0])).ravel())
    return np.concatenate(kept)


def _weighed(rng: Generator) -> Bools:
    """Random faces of few vertices, so that each vertex has some of them."""
    points = rng.normal(size=(12, 3))
    faces = np.array([rng.permutation(12)[:3] for _ in range(40)], np.int32)
    body = trimesh.Trimesh(points, faces, process=False)
    weighted = np.zeros((12, 3))
    np.add.at(weighted, faces, body.face_normals[:, None] * body.face_angles[:, :, None])
    expected = weighted / np.linalg.norm(weighted, axis=1)[:, None]
    found: Bools = (np.abs(Mesh(points, faces).vertex_normals() - expected) <= _ROUNDING).all(axis=1)
    return found

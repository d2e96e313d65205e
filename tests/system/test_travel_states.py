"""Every public object is copied and pickled whole, in its unusual states too."""

import copy
import dataclasses
import inspect
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
from cases import cases
from pydantic import BaseModel
from scipy.sparse import csr_array

import renderer
from renderer import (
    BruteForce,
    Dielectric,
    DirectionalLight,
    Floor,
    Mesh,
    Mirror,
    Octree,
    OrthographicCamera,
    PerspectiveCamera,
    Phong,
    PointLight,
    PreparedScene,
    RayScene,
    RenderSettings,
    Scene,
    SceneAllHits,
    SceneClosestPoints,
    SceneHits,
    SceneObject,
    Sky,
    needs_of,
    prepare,
    render,
    studies,
)  # fmt: skip
from renderer.checkpoints.study import Study
from renderer.mesh.shapes import box, icosphere
from renderer.picture.image import PLANES
from renderer.studies.points import on_faces

BALL, RAYS = icosphere(1), ([[0.1, 0.2, 3.0], [9.0, 9.0, 9.0]], [0.0, 0.0, -1.0])
EYE = PerspectiveCamera(eye=(0, 0, 6), target=(0, 0, 0), fov=30)
FULL = Mesh(BALL.vertices, BALL.faces, BALL.vertices, abs(BALL.vertices), BALL.vertices[:, :2], "ball")


def scene(*things: tuple[Mesh, str, str], **parts: Any) -> Scene:
    materials = {"grey": Phong(reflectance=0.3), "mirror": Mirror(), "glass": Dielectric()}
    objects = [
        SceneObject(mesh=mesh, material=m, normals=n, translate=(k, 0, 0)) for k, (mesh, m, n) in enumerate(things)
    ]
    light = DirectionalLight(direction=(0, -1, -1))
    return Scene(
        **{"camera": EYE, "materials": materials, "lights": [light], "objects": objects, "ambient": 0.5} | parts
    )


MIXED = scene(
    (FULL, "grey", "smooth"), (box(), "mirror", "flat"), (BALL, "glass", "flat"), (Mesh([], []), "grey", "smooth")
)
FLAT = RenderSettings(max_depth=0)
FLOOR = Floor(min=(-1, -1), max=(1, 2), materials=("grey", "mirror"), squares=(2, 3))
# Prepared for what its pictures need and no more: a copy of it must not be for another depth or tree.
PREPARED: dict[str, Callable[[], PreparedScene]] = {
    "mixed": lambda: prepare(MIXED),
    "depth 0": lambda: prepare(scene((FULL, "grey", "smooth"), (BALL, "glass", "flat"), render=FLAT)),
    "of brute force": lambda: prepare(MIXED, accelerator="brute"),
    "an octree of few faces": lambda: prepare(scene((box(), "grey", "flat")), accelerator="octree", split="sah"),
    "few faces": lambda: prepare(scene((box(), "grey", "flat"), floor=FLOOR)),
    "no faces": lambda: prepare(scene()),
    "touching glass": lambda: prepare(scene((box(), "glass", "flat"), (box(), "glass", "flat"))),
    "no light": lambda: prepare(scene((FULL, "grey", "smooth"), lights=[], camera=OrthographicCamera(
        eye=(0, 0, 6), target=(0, 0, 0), height=3))),
    "more than it needs": lambda: prepare(scene((box(), "grey", "flat")), needs=dataclasses.replace(
        needs_of(MIXED), float64_vertices=True)),
}  # fmt: skip


def octrees() -> dict[str, Any]:
    used = Octree.from_mesh(FULL, max_depth=1, leaf_size=32, threads=2)
    used.winding_number([[0.1, 0.2, 0.3]])
    return {
        "no faces": Octree([], []), "a face": Octree(np.eye(3), [[0, 1, 2]]), "a block": Octree(*few(4)),
        "two blocks": Octree(*few(5)), "used": used, "no faces, brute": BruteForce([], []),
        "brute": BruteForce(*few(5)), "repaired": BruteForce([*np.eye(3), [np.nan] * 3], [[0, 1, 3]], repair=True),
    }  # fmt: skip


def few(count: int) -> tuple[Any, Any]:
    return BALL.vertices, BALL.faces[:count]


def ray_scene() -> RayScene:
    made = RayScene(threads=2)
    made.add(FULL, [np.diag([-1.0, 2.0, 1.0, 1.0]), np.eye(4)], mask=[5, 1])
    made.show(0, np.array([True, False]))
    made.add(box(), name="box")
    return made


def things() -> dict[str, Any]:
    """An object of each public class, by its name and its state."""
    octree, image = Octree.from_mesh(FULL), render(MIXED, resolution=(9, 7), planes=("depth",))
    found = {f"octree, {name}": tree for name, tree in octrees().items()}
    found |= {f"prepared, {name}": make() for name, make in PREPARED.items()}
    hits = octree.closest_hit(*RAYS, t_error=True)
    found |= {
        "mesh": FULL, "mesh of nothing": Mesh([], []), "hits": hits, "hits of a shape": hits.shaped((2, 1)),
        "passage": hits.through(), "no hits": Octree([], []).closest_hit(*RAYS), "all": octree.all_hits(*RAYS),
        "closest": octree.closest_point(RAYS[0], 1.5), "steps": octree.count_steps(*RAYS), "stats": octree.stats,
        "repairs": Mesh.repaired(np.eye(3), [[0, 1, 7], [0, 1, 2]])[1], "needs": needs_of(MIXED), "scene": MIXED,
        "a scene not yet placed": scene((BALL, "grey", "flat"), floor=FLOOR), "floor": FLOOR, "settings": FLAT,
        "sky": Sky(sun=(0, -1, 0), sun_lights=2),
        "object": MIXED.objects[0], "light": MIXED.lights[0], "point light": PointLight(position=(0, 1, 2)),
        **{f"camera {k}": camera for k, camera in enumerate(CAMERAS)}, "image of a texture": TEXTURE.image,
        "texture": TEXTURE, "material of a file": renderer.MeshMaterial("wood", base_color_texture=TEXTURE),
        "camera": EYE, "parallel camera": OrthographicCamera(eye=(0, 0, 6), target=(0, 0, 0), height=3),
        **{f"material {name}": material for name, material in MIXED.materials.items()}, "image": image,
        "pattern": studies.tregenza(), "places": studies.face_points(BALL), "study": Study("sky", {"patches": 9}),
        "view factors": studies.view_factors(octree, sides="both", max_rays=256),
        "view factors of points": studies.view_factors_from(octree, [[0, 0, 9]], [0, 0, -1], sides="both"),
        "scan": studies.scan(octree, [0, 0, 0], 9), "points": on_faces(octree).points,
        "scene of rays": ray_scene(), "scene of rays, empty": RayScene(),
        "hits of a scene": ray_scene().closest_hit(*RAYS), "all hits of a scene": ray_scene().all_hits(*RAYS),
        "closest of a scene": ray_scene().closest_point(RAYS[0], 1.5),
        "errors": [kind("a line") for kind in (renderer.MeshError, renderer.SceneError, renderer.CutWarning,
                                               renderer.RepairWarning, renderer.SceneWarning)],
    }  # fmt: skip
    return found


TEXTURE = renderer.Texture(np.eye(2))
_PLACE = {"eye": (0, 0, 6), "target": (0, 0, 0)}
_FILM = {"width": 8, "height": 6, "fx": 5, "fy": 5}
CAMERAS = [
    renderer.PinholeCamera(**_PLACE, **_FILM), renderer.OpenCVCamera(**_PLACE, **_FILM),
    renderer.OpenCVFisheyeCamera(**_PLACE, **_FILM),
    renderer.FisheyeCamera(**_PLACE), renderer.EquirectangularCamera(**_PLACE),
    renderer.ThinLensCamera(**_PLACE, aperture=0.1),
]  # fmt: skip
THINGS = things()
WAYS: list[Callable[[Any], Any]] = [copy.copy, copy.deepcopy]
WAYS += [lambda one, protocol=protocol: pickle.loads(pickle.dumps(one, protocol)) for protocol in (2, 5)]


def content(thing: Any) -> Any:
    """All that an object holds, and what it works out and draws, by value."""
    if isinstance(thing, np.ndarray):
        return thing.dtype.str, thing.shape, thing.tobytes()
    if isinstance(thing, Octree | BruteForce):
        answers = [thing.closest_hit(*RAYS), thing.any_hit(*RAYS), thing.all_hits(*RAYS), thing.visible(*RAYS)]
        return type(thing), content([thing.mesh, thing.stats, thing.threads, thing.repairs, answers])
    if isinstance(thing, RayScene):
        held = [[thing.name(k), thing.transforms(k), thing.masks(k), thing.shown(k)] for k in thing.objects]
        answers = [thing.closest_hit(*RAYS), thing.any_hit(*RAYS), thing.all_hits(*RAYS)]
        return content([held, thing.objects, thing.threads, answers])
    if isinstance(thing, SceneHits | SceneAllHits | SceneClosestPoints):
        names = ("object", "instance", "face", "u", "v", "points", "normals", "colors", "texcoords")
        return type(thing), content([getattr(thing, name) for name in names])
    if isinstance(thing, PreparedScene):
        pictures = [render(thing, resolution=(9, 7), max_depth=depth) for depth in {0, thing.scene.render.max_depth}]
        shown = [content([getattr(image, plane) for plane in PLANES]) for image in pictures]
        return content(
            [thing.scene, thing.octree, thing.needs, list(thing.arrays), thing.touching, thing.tree.blocks]
        ), shown
    if isinstance(thing, csr_array):
        return thing.shape, content([thing.data, thing.indices, thing.indptr])
    if isinstance(thing, BaseModel):
        return type(thing), {name: content(getattr(thing, name)) for name in type(thing).model_fields}
    if isinstance(thing, BaseException):
        return type(thing), str(thing)
    if dataclasses.is_dataclass(thing):
        return type(thing), {f.name: content(getattr(thing, f.name)) for f in dataclasses.fields(thing)}
    if isinstance(thing, dict):
        return {name: content(value) for name, value in thing.items()}
    if isinstance(thing, list | tuple):
        return type(thing), [content(part) for part in thing]
    return thing


@cases("name", THINGS)
def test_a_copy_holds_and_answers_the_same(name: str) -> None:
    thing = THINGS[name]
    expected = content(thing)
    for way in WAYS:
        copied = way(thing)
        assert type(copied) is type(thing) and content(copied) == expected
        assert content(pickle.loads(pickle.dumps(copied))) == expected


def test_no_public_class_is_missing_here() -> None:
    public = [getattr(home, name) for home in (renderer, studies) for name in home.__all__]
    known = {type(one) for thing in THINGS.values() for one in (thing if isinstance(thing, list) else [thing])}
    assert {one for one in public if inspect.isclass(one)} <= known

"""Scenes at the ends of numbers: cameras, lights, transforms and settings.

Each is one clear error, or a picture that is sound and has the same bits by octree and by brute force, or, for
settings, by one thread and by three.
"""

import math
import warnings
from collections.abc import Callable
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from fuzz.values import NOT_FINITE, Kind, expect_clear, extreme, vector
from renderer import (
    CutWarning,
    Dielectric,
    DirectionalLight,
    EquirectangularCamera,
    FisheyeCamera,
    Image,
    Mirror,
    OpenCVCamera,
    OpenCVFisheyeCamera,
    OrthographicCamera,
    PerspectiveCamera,
    Phong,
    PinholeCamera,
    PointLight,
    PreparedScene,
    RenderSettings,
    Scene,
    SceneObject,
    ThinLensCamera,
    prepare,
    render,
)
from renderer.arguments.limits import FARTHEST
from renderer.mesh.shapes import box, grid, icosphere
from renderer.picture.image import PLANES

Values = dict[str, Any]
SMALL: Values = {"resolution": (8, 8), "threads": 1}
MESHES = {"box": box(), "ball": icosphere(1), "grid": grid()}
MATERIALS = {
    "red": Phong(diffuse=(0.7, 0.1, 0.0), specular=0.5, shininess=60.0),
    "half": Phong(diffuse=0.1, reflectance=0.5, transmittance=0.5, ior=1.0),
    "glass": Dielectric(),
    "silver": Mirror(reflectance=0.9),
}
CAMERAS: dict[str, Any] = {
    "perspective": PerspectiveCamera, "orthographic": OrthographicCamera, "pinhole": PinholeCamera,
    "fisheye": FisheyeCamera, "opencv": OpenCVCamera, "opencv_fisheye": OpenCVFisheyeCamera,
    "equirectangular": EquirectangularCamera, "thin_lens": ThinLensCamera,
}  # fmt: skip
# Their numbers beside their place, with usual values; "size" stands for that of the scene.
LENSES: dict[str, dict[str, list[Any]]] = {
    "perspective": {"fov": [1.0, 40.0, 179.0]}, "orthographic": {"height": ["size"]}, "equirectangular": {},
    "pinhole": {"fx": [8.0], "fy": [9.0], "cx": [4.0, -20.0]}, "fisheye": {"fov": [20.0, 180.0, 360.0]},
    "opencv": {"fx": [8.0], "fy": [9.0], "k1": [0.0, 0.1, -0.5], "p1": [0.0, 0.1], "k3": [0.0, 0.02]},
    "opencv_fisheye": {"fx": [3.0], "fy": [4.0], "k1": [0.0, 0.1, -0.5], "k3": [0.0, 0.02]},
    "thin_lens": {"fov": [40.0], "aperture": [0.0, "size"], "focus": ["size"]},
}  # fmt: skip
LIGHTS: dict[str, Any] = {"directional": DirectionalLight, "point": PointLight}
USUAL = PerspectiveCamera(eye=(0.4, 1.3, 4.0), target=(0.4, 0.3, 0.0))
WRONG = ["1", "", True, None, [], (1.0, 2.0), {}, 1j, "nan", (None, 0, 0), 10**400, np.float32(2.0), np.zeros(3)]


# --- what a sound picture is -----------------------------------------------------------------------------------


def outcome(take: Callable[[], Image]) -> Image | str:
    """The picture, or what its clear error says."""
    try:
        return take()
    except ValueError as error:
        expect_clear(error)
        return str(error)


def expect_sound(image: Image) -> None:
    """Finite light everywhere; depth and normal finite on a hit, and as documented on a miss."""
    hit = image.face >= 0
    assert np.isfinite(image.radiance).all() and (image.radiance >= 0.0).all(), "radiance that is no light"
    assert np.isfinite(image.depth[hit]).all() and not np.signbit(image.depth).any(), "a depth that is none"
    assert np.isposinf(image.depth[~hit]).all() and not image.normal[~hit].any(), "a miss that is none"
    assert (np.linalg.norm(image.normal[hit].astype(np.float64), axis=-1) <= 1.0 + 2.0**-22).all(), "a long normal"


def expect_same(one: Image | str, other: Image | str) -> str:
    """Two ways to one sound picture or one error: 'refused', 'missed' or 'hit'."""
    if isinstance(one, str) or isinstance(other, str):
        told = [x if isinstance(x, str) else "a picture" for x in (one, other)]
        assert told[0] == told[1], f"refused by one only: {told}"
        return "refused"
    expect_sound(one)
    for plane in PLANES:
        a, b = getattr(one, plane), getattr(other, plane)
        rows = np.argwhere(a != b)
        assert a.tobytes() == b.tobytes(), f"another {plane}, first at {rows[:1].tolist()} of {len(rows)}"
    return "hit" if (one.face >= 0).any() else "missed"


def by_both(scene: Scene) -> str:
    """By octree and by brute force."""
    one, other = (
        outcome(lambda accelerator=accelerator: render(scene, accelerator=accelerator, **SMALL))  # type: ignore[misc]
        for accelerator in ("octree", "brute")
    )
    return expect_same(one, other)


def _objects(size: float = 1.0) -> tuple[SceneObject, ...]:
    """A glass box, a ball of half a mirror and a floor, times ``size``."""
    rows = [
        ("box", "glass", (0.6, 0.6, 0.6), (0.5, 0.01, 0.2), "flat"),
        ("ball", "half", (0.5, 0.5, 0.5), (-0.5, 0.5, -0.3), "smooth"),
        ("grid", "red", (5.0, 1.0, 5.0), (0.0, 0.0, 0.0), "flat"),
    ]
    return tuple(
        SceneObject(
            mesh=MESHES[mesh],
            material=material,
            normals=normals,
            scale=tuple(x * size for x in scale),
            translate=tuple(x * size for x in translate),
        )
        for mesh, material, scale, translate, normals in rows
    )


# --- cameras ---------------------------------------------------------------------------------------------------


@cache
def ready(accelerator: Any, exponent: int) -> PreparedScene:
    """The scene that cameras look at, a power of two large."""
    size = 2.0**exponent
    lamp = PointLight(position=(size, 3.0 * size, 2.0 * size), intensity=8.0 * size * size)
    sun = DirectionalLight(direction=(0.5, -1.3, -0.6), irradiance=0.6)
    scene = Scene(camera=USUAL, materials=MATERIALS, lights=(lamp, sun), objects=_objects(size), ambient=0.1)
    return prepare(scene.altered(render=RenderSettings(max_depth=3)), accelerator=accelerator, threads=1)


def _camera_values(rng: Random, size: float) -> Values:
    """Arguments of a camera that looks at a scene of this size, or somewhere else."""
    kind = rng.choice(list(CAMERAS))
    eye, target = vector(rng, 0.4), vector(rng, 0.3)
    eye = (eye[0] * size, eye[1] * size + rng.choice([0.0, size]), eye[2] * size + rng.choice([0.0, 3.0 * size]))
    values: Values = {"type": kind, "eye": eye, "target": tuple(x * size for x in target)}
    if rng.random() < 0.5:
        values["up"] = vector(rng, 0.6)
    for lens, usual in LENSES[kind].items():
        choice = size if (choice := rng.choice(usual)) == "size" else choice
        values[lens] = extreme(rng) if rng.random() < 0.3 else choice
        if rng.random() < 0.9:
            values[lens] = abs(values[lens])
    if kind in ("pinhole", "opencv_fisheye"):
        values |= {"width": 8, "height": rng.choice([8, 8, 8, 5])}
    if rng.random() < 0.03:
        values[rng.choice(list(values))] = rng.choice(WRONG)
    return values


def make_camera(seed: int, index: int) -> Values:
    rng = Random(f"camera {seed} {index}")
    exponent = rng.choice([0, 0, 0, -55, -20, 20, 55])
    return {"exponent": exponent, **_camera_values(rng, 2.0**exponent)}


def check_camera(folder: Path, given: Values, index: int) -> str:
    values = dict(given)
    exponent, kind = values.pop("exponent"), values["type"]
    try:
        camera = CAMERAS.get(kind if isinstance(kind, str) else "", PerspectiveCamera)(**values)
    except ValueError as error:
        expect_clear(error)
        return "refused"
    one, other = (outcome(lambda a=a: render(ready(a, exponent), camera=camera, **SMALL)) for a in ("octree", "brute"))
    return expect_same(one, other)


# --- lights ----------------------------------------------------------------------------------------------------


def _color(rng: Random) -> Any:
    """A grey or a colour, mostly of no light below 0."""
    values = [extreme(rng, 0.005) if rng.random() < 0.5 else rng.random() for _ in range(3)]
    if rng.random() < 0.97:
        values = [abs(x) for x in values]
    return values[0] if rng.random() < 0.5 else tuple(values)


def _light(rng: Random) -> Values:
    if rng.random() < 0.5:
        return {"type": "directional", "direction": vector(rng, 0.5), "irradiance": _color(rng)}
    on_a_corner = rng.random() < 0.2
    place = rng.choice(MESHES["grid"].vertices.tolist()) if on_a_corner else vector(rng, 0.5)
    return {"type": "point", "position": tuple(place), "intensity": _color(rng)}


def make_light(seed: int, index: int) -> Values:
    rng = Random(f"light {seed} {index}")
    lights = [_light(rng) for _ in range(rng.choice([0, 1, 1, 1, 2, 2, 3, 5, 20, 100]))]
    if lights and rng.random() < 0.03:
        light = rng.choice(lights)
        light[rng.choice(list(light))] = rng.choice(WRONG)
    given: Values = {"lights": lights}
    if rng.random() < 0.3:
        given["ambient"] = _color(rng)
    if rng.random() < 0.3:
        given["background"] = _color(rng)
    if rng.random() < 0.3:
        shine = {"diffuse": _color(rng), "specular": _color(rng), "shininess": abs(extreme(rng, 0.0))}
        given["floor"] = {**shine, "reflectance": _color(rng)}
    return given


def check_light(folder: Path, given: Values, index: int) -> str:
    try:
        lights = tuple(LIGHTS.get(str(v["type"]), PointLight)(**v) for v in given["lights"])
        shine = {"red": Phong(**given["floor"])} if "floor" in given else {}
        colors = {name: given[name] for name in ("ambient", "background") if name in given}
        scene = Scene(
            camera=USUAL, materials={**MATERIALS, **shine}, lights=lights, objects=_objects(), **colors,
            render=RenderSettings(max_depth=3),
        )  # fmt: skip
    except ValueError as error:
        expect_clear(error)
        return "refused"
    return by_both(scene)


# --- transforms ------------------------------------------------------------------------------------------------


def _object(rng: Random, near: float) -> Values:
    size = near * rng.choice([1.0, 1.0, 0.5, abs(extreme(rng, 0.0)), 10.0 ** rng.uniform(-25.0, 25.0)])
    scale = [x * size for x in vector(rng, 0.15)]
    shift = [x * rng.choice([near, near, size]) for x in vector(rng, 0.15)]
    given = {
        "mesh": rng.choice(list(MESHES)),
        "material": rng.choice(list(MATERIALS)),
        "normals": rng.choice(["flat", "smooth"]),
        "scale": tuple(scale) if rng.random() < 0.7 else scale[0],
        "rotate": tuple(90.0 * x for x in vector(rng, 0.3)),
        "translate": tuple(shift),
    }
    if rng.random() < 0.02:
        given[rng.choice(["scale", "rotate", "translate", "normals", "material"])] = rng.choice(WRONG)
    return given


def make_transform(seed: int, index: int) -> Values:
    rng = Random(f"transform {seed} {index}")
    near = 1.0 if rng.random() < 0.6 else 10.0 ** rng.uniform(-18.0, 18.0)
    objects = [_object(rng, near) for _ in range(rng.choice([1, 1, 2, 3]))]
    # From some sizes away, so that most are seen.
    scale, place = objects[0]["scale"], objects[0]["translate"]
    sizes = scale if isinstance(scale, tuple) else (scale,)
    away = max((abs(x) for x in sizes if isinstance(x, float)), default=1.0) * rng.choice([0.1, 1.0, 3.0, 10.0])
    centre = place if isinstance(place, tuple) and len(place) == 3 and None not in place else (0.0, 0.0, 0.0)
    eye = tuple(x + away * rng.gauss(0.0, 1.0) for x in centre)
    usable = all(math.isfinite(x) and abs(x) <= FARTHEST for x in (*eye, *centre)) and eye != centre
    lamp = tuple(x + 3.0 * away for x in eye) if usable else (0.0, 3.0, 0.0)
    return {"objects": objects, "eye": eye if usable else (3.0, 2.0, 4.0), "target": centre if usable else (0, 0, 0),
            "lamp": lamp if all(map(math.isfinite, lamp)) else (0.0, 3.0, 0.0)}  # fmt: skip


def check_transform(folder: Path, given: Values, index: int) -> str:
    try:
        objects = tuple(SceneObject(**{**v, "mesh": MESHES[v["mesh"]]}) for v in given["objects"])
        scene = Scene(
            camera=PerspectiveCamera(eye=given["eye"], target=given["target"], up=(0.1, 1.0, 0.2)),
            materials=MATERIALS, objects=objects, lights=(PointLight(position=given["lamp"], intensity=8.0),),
            ambient=0.2, render=RenderSettings(max_depth=3),
        )  # fmt: skip
    except ValueError as error:
        expect_clear(error)
        return "refused"
    return by_both(scene)


# --- settings --------------------------------------------------------------------------------------------------

# Right values, of which all together are work for some tenths of a second at most, and wrong ones.
RIGHT: dict[str, list[Any]] = {
    "resolution": [(1, 1), (2, 3), (8, 8), (33, 1), (1, 33), (40, 33), [33, 40], np.array([5, 40]), (3, 128)],
    "samples": [1, 1, 1, 4, 9, np.int64(4)],
    "filter": ["box", "tent", "gaussian", "mitchell"],
    "max_depth": [0, 1, 2, 3, 6, 63, 64, np.int8(64)],
    "min_weight": [0.0, -0.0, 5e-324, 1e-300, 1e-12, 0.01, 0.5, math.nextafter(1.0, 0.0), 0, np.float32(0.01)],
    "max_rays": [1, 2, 3, 5, 16, 50, 50, 200, np.int32(7)],
    "shadows": [True, False, np.True_],
}
_INTEGERS = [0, -1, -(2**63), 2**62, 2**63, 2**64, 10**400, 1.5, 4.0, math.nan, math.inf]
BAD: dict[str, list[Any]] = {
    "resolution": [(0, 1), (1, -1), (16385, 1), (8,), (8, 8, 8), 8, (8.0, 8), "8x8", (2**63, 1), (math.nan, 8), {8, 9}],
    "samples": [2, 3, 65537, 65536**2, *_INTEGERS],
    "filter": ["Box", "", "lanczos", 1, True],
    "max_depth": [65, 2**31, *_INTEGERS[1:]],
    "min_weight": [1.0, -5e-324, -1.0, 2.0, 1e308, *NOT_FINITE],
    "max_rays": _INTEGERS,
    "shadows": [0, 1, "yes", 0.0, "true"],
    "depth": [1],
    "Samples": [4],
}
# Beyond so many rays a picture is made smaller.
MOST_RAYS = 60_000


def make_settings(seed: int, index: int) -> Values:
    rng = Random(f"settings {seed} {index}")
    given = {name: rng.choice(values) for name, values in RIGHT.items() if rng.random() < 0.7 or name == "resolution"}
    given.setdefault("max_rays", 50)
    pixels = int(np.prod(given["resolution"]))
    if pixels * int(given.get("samples", 1)) * int(given["max_rays"]) > MOST_RAYS:
        given.update(samples=1, max_rays=max(1, MOST_RAYS // (2 * pixels)))
    if int(given.get("max_depth", 6)) <= 2 and rng.random() < 0.2:
        given.update(max_rays=2**62 - 1, samples=1)
    if rng.random() < 0.2:
        name = rng.choice(list(BAD))
        given[name] = rng.choice([*BAD[name], *WRONG])
        # None takes the default, which is more than an input may cost.
        if given[name] is None or (name == "resolution" and isinstance(given[name], np.ndarray)):
            given[name] = "None"
    return given


@cache
def mirrors() -> PreparedScene:
    """Half mirrors one in another beside glass: a ray that meets one leaves two."""
    balls = tuple(SceneObject(mesh=MESHES["ball"], material="half", scale=r, normals="smooth") for r in (0.7, 1.0, 1.4))
    block = SceneObject(mesh=MESHES["box"], material="glass", translate=(0.9, -0.5, -0.5))
    eye = PerspectiveCamera(eye=(0.0, 0.0, 5.0), target=(0.0, 0.0, 0.0))
    lamp = PointLight(position=(0.0, 0.1, 0.0), intensity=9.0)
    scene = Scene(camera=eye, materials=MATERIALS, objects=(*balls, block), lights=(lamp,), background=0.5)
    return prepare(scene, threads=1)


def check_settings(folder: Path, given: Values, index: int) -> str:
    try:
        RenderSettings(**given)
        right = True
    except ValueError as error:
        expect_clear(error)
        right = False
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CutWarning)
        one, other = (outcome(lambda n=n: render(mirrors(), threads=n, **given)) for n in (1, 3))
    assert right != isinstance(one, str), f"RenderSettings and render differ: {right}, {str(one)[:200]}"
    return expect_same(one, other)


KINDS = {
    "camera": Kind(make_camera, check_camera),
    "light": Kind(make_light, check_light),
    "transform": Kind(make_transform, check_transform),
    "settings": Kind(make_settings, check_settings, share=1),
}


def prepare_kinds() -> None:
    """Compile the kernels before a clock starts."""
    for accelerator in ("octree", "brute"):
        render(ready(accelerator, 0), **SMALL)
    render(mirrors(), max_rays=2, max_depth=1, min_weight=1e-3, **SMALL)

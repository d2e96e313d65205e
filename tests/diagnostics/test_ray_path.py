"""The rays that a camera ray becomes: by hand for one surface, and against the renderer's pixels for whole scenes."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases import cases

from renderer.diagnostics.ray_path import MAX_RAYS, Segment, ray_path
from renderer.materials.dielectric import Dielectric
from renderer.materials.mirror import Mirror
from renderer.materials.phong import Phong
from renderer.materials.registry import Material
from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import box, icosphere, torus
from renderer.picture.prepare import PreparedScene, prepare_scene
from renderer.picture.render import render
from renderer.scene.camera import PerspectiveCamera
from renderer.scene.light import DirectionalLight, PointLight
from renderer.scene.needs import needs_of
from renderer.scene.scene import Floor, Scene, SceneObject, load_scene

SCENES = Path(__file__).parents[2] / "scenes"
# Radiance is stored as float32: half an ulp, and as much again for the float64 sums before it.
REL = 2.0**-23
# Hit points of scenes some units wide: float64 rounding of a few operations each, with three digits to spare.
NEAR = 1e-12
GLASS = Dielectric(type="dielectric", ior=1.5)
CLEAR = Phong(diffuse=0.1, specular=0.3, reflectance=0.2, transmittance=(0.5, 0.6, 0.7), ior=1.3)


def scene(*parts: tuple[Mesh, Material], eye: Any = (0.0, 2.0, 6.0), smooth: bool = False, **more: Any) -> Scene:
    """A scene of (mesh, material) pairs."""
    return Scene(
        camera=PerspectiveCamera(eye=eye, target=(0.1, 0.3, 0.2), fov=50),
        materials={"floor": Phong(diffuse=0.5, reflectance=0.1), **{f"m{i}": m for i, (_, m) in enumerate(parts)}},
        objects=tuple(
            SceneObject(mesh=mesh, material=f"m{i}", normals="smooth" if smooth else "flat")
            for i, (mesh, _) in enumerate(parts)
        ),
        **more,
    )


def stage_of(what: Scene, accelerator: str = "octree", max_depth: int = 6) -> PreparedScene:
    return prepare_scene(what, needs_of(what, max_depth=max_depth), accelerator, threads=1)


def moved(mesh: Mesh, *by: float) -> Mesh:
    return Mesh(mesh.vertices + np.array(by), mesh.faces)


def zoo(smooth: bool, eye: Any = (0.0, 2.0, 6.0)) -> Scene:
    """Each kind of material above a floor, in front of each other; the glass ball holds another."""
    parts = (
        (moved(icosphere(2), 0.0, 1.0, 1.5), GLASS),
        (moved(icosphere(1), 0.0, 2.0, 3.0).transformed(np.diag([0.5, 0.5, 0.5, 1.0])), CLEAR),
        (moved(icosphere(2), -2.0, 1.0, -1.0), Mirror(type="mirror", reflectance=(0.9, 0.8, 0.7))),
        (moved(torus(), 2.0, 0.5, -0.5), Phong(diffuse=(0.7, 0.2, 0.1), specular=0.5, reflectance=0.25)),
        (moved(box(), 0.5, 1.0, -3.0), Phong(diffuse=0.0, ambient=0.6)),
    )
    sun = DirectionalLight(direction=(-1, -3, -2), irradiance=(1, 0.9, 0.8))
    lights = sun, PointLight(position=(2, 4, 3), intensity=9)
    ground = Floor(min=(-5, -5), max=(5, 4), materials=("floor",))
    shared: dict[str, Any] = {"lights": lights, "floor": ground, "ambient": 0.2, "background": (0.1, 0.2, 0.4)}
    return scene(*parts, eye=eye, smooth=smooth, **shared)


def paths_of(prepared: PreparedScene, size: tuple[int, int], **options: Any) -> list[tuple[Segment, ...]]:
    """The path of each pixel's ray, in scanline order; the direction as the kernel has it, to the bit."""
    rows = prepared.scene.camera.rows(*size)
    centres = [(x + 0.5, y + 0.5) for y in range(size[1]) for x in range(size[0])]
    return [ray_path(prepared, rows[0], rows[3] + (x * rows[4] + y * rows[5]), **options) for x, y in centres]


def check_against_render(what: Scene, size: tuple[int, int], accelerator: Any = "octree", **options: Any) -> None:
    image = render(what, resolution=size, samples=1, threads=1, accelerator=accelerator, **options)
    prepared = stage_of(what, accelerator)
    paths = paths_of(prepared, size, **options)
    assert max(len(path) for path in paths) < MAX_RAYS  # the bound cuts none off
    sums = np.array([np.sum([s.radiance for s in path], axis=0) for path in paths]).reshape(*size[::-1], 3)
    np.testing.assert_allclose(sums, image.radiance, rtol=REL, atol=2.0**-149)
    counts = np.array([len(path) for path in paths]).reshape(size[::-1])
    np.testing.assert_array_equal(counts, image.rays)
    np.testing.assert_array_equal([path[0].face for path in paths], image.face.ravel())
    for path in paths:
        check_tree(path, options["max_depth"])


def check_tree(path: tuple[Segment, ...], max_depth: int) -> None:
    """Each segment begins where its parent ends, and is one bounce deeper unless it goes to a light."""
    assert path[0].kind == "camera" and path[0].parent == -1 and path[0].depth == 0
    for i, segment in enumerate(path[1:], 1):
        parent = path[segment.parent]
        assert 0 <= segment.parent < i and parent.hit and parent.kind != "shadow"
        assert segment.depth == parent.depth + (segment.kind != "shadow") <= max_depth
        np.testing.assert_allclose(segment.start, parent.end, rtol=0, atol=NEAR)
        assert (segment.face >= 0) == segment.hit
        # A shadow ray follows the ray that spawned it, others of its kind between them.
        assert segment.kind != "shadow" or all(s.kind == "shadow" for s in path[segment.parent + 1 : i])
    depths = [s.depth for s in path]
    assert depths == sorted(depths)


@cases(
    ("options", "smooth", "accelerator"),
    [
        ({"max_depth": 0}, False, "octree"),
        ({"max_depth": 1}, False, "brute"),
        ({"max_depth": 5}, False, "octree"),
        ({"max_depth": 5}, True, "octree"),
        ({"max_depth": 5, "min_weight": 0.11}, True, "octree"),
        ({"max_depth": 3, "shadows": False}, False, "octree"),
    ],
)
def test_segments_add_up_to_the_pixel(options: dict[str, Any], smooth: bool, accelerator: str) -> None:
    what = zoo(smooth)
    check_against_render(what, (14, 10), accelerator, **options)


def test_an_eye_in_glass_knows_its_media() -> None:
    # Within both balls: the inner one is centred at (0, 1, 1.5), half as wide.
    check_against_render(zoo(False, eye=(0.1, 1.1, 1.6)), (8, 6), max_depth=4)
    check_against_render(zoo(False, eye=(0.1, 1.1, 2.2)), (8, 6), max_depth=4)


def test_leaving_a_ball_in_a_ball_of_its_own_glass() -> None:
    """Between the two is another medium, which the ray is then in again."""
    balls = [icosphere(2).transformed(np.diag([r, r, r, 1.0])) for r in (1.0, 0.8, 0.6)]
    objects = tuple(SceneObject(mesh=m, material=k) for m, k in zip(balls, ("glass", "clear", "glass"), strict=True))
    camera = PerspectiveCamera(eye=(0, 0, 3), target=(0.1, 0.2, 0))
    what = Scene(camera=camera, materials={"glass": GLASS, "clear": CLEAR}, objects=objects, background=(1, 2, 4))
    check_against_render(what, (7, 5), max_depth=5)


@pytest.mark.parametrize("name", ["glass", "mirrors"])
def test_shipped_scenes(name: str) -> None:
    check_against_render(load_scene(SCENES / f"{name}.toml"), (5, 5), max_depth=4)


def test_a_mirror() -> None:
    what = scene((box(), Mirror(type="mirror", reflectance=(0.5, 0.25, 1.0))), background=(2, 4, 8))
    camera, reflected = ray_path(stage_of(what), (1.2, 3.0, 0.1), (-1, -2, 0), 3)
    assert camera.kind == "camera" and camera.hit and camera.weight == (1, 1, 1) and camera.radiance == (0, 0, 0)
    np.testing.assert_allclose(camera.end, (0.2, 1.0, 0.1), atol=NEAR)
    assert reflected.kind == "reflected" and not reflected.hit and reflected.face == -1
    assert reflected.weight == (0.5, 0.25, 1.0) and reflected.radiance == (1, 1, 8)
    way = np.subtract(reflected.end, reflected.start)
    np.testing.assert_allclose(way / np.linalg.norm(way), np.array([-1, 2, 0]) / math.sqrt(5), atol=NEAR)
    # Whoever draws it draws a line that leaves the model behind.
    assert np.linalg.norm(reflected.end) > math.sqrt(3)
    assert [s.kind for s in ray_path(stage_of(what), (1.2, 3.0, 0.1), (-1, -2, 0), 0)] == ["camera"]


def test_glass_by_snell_and_fresnel() -> None:
    prepared = stage_of(scene((box(), GLASS)))
    path = ray_path(prepared, (-0.5, 2.0, 0.1), (1, -1, 0), 1)
    assert [(s.kind, s.parent) for s in path] == [("camera", -1), ("reflected", 0), ("refracted", 0)]
    way = np.subtract(path[2].end, path[2].start)
    sin_t = math.sin(math.pi / 4) / 1.5
    assert way[0] / np.linalg.norm(way) == pytest.approx(sin_t, rel=NEAR)
    # s- and p-polarised reflectances in the angles themselves: Born and Wolf, Principles of Optics, 1.5.2.
    i, t = math.pi / 4, math.asin(sin_t)
    s, p = math.sin(i - t) / math.sin(i + t), math.tan(i - t) / math.tan(i + t)
    assert path[1].weight == pytest.approx([(s * s + p * p) / 2] * 3, rel=NEAR)
    assert np.add(path[1].weight, path[2].weight) == pytest.approx(1.0, rel=NEAR)


def test_total_internal_reflection() -> None:
    """At 45 degrees, above glass's 41.8, light goes round in a box: a wall after a wall, and none of it leaves."""
    prepared = stage_of(scene((box((-1, -1, -1), (1, 1, 1)), GLASS), background=1.0))
    path = ray_path(prepared, (-0.5, 0, 0), (1, 1, 0), 3)
    assert [s.kind for s in path] == ["camera", "reflected", "reflected", "reflected"]
    assert [s.parent for s in path] == [-1, 0, 1, 2]
    assert all(s.weight == (1, 1, 1) and s.hit for s in path)
    ends = [(0.5, 1, 0), (1, 0.5, 0), (-0.5, -1, 0), (-1, -0.5, 0)]
    np.testing.assert_allclose([s.end for s in path], ends, atol=NEAR)


def test_shadow_rays_say_what_hides_the_light() -> None:
    lights = (
        PointLight(position=(0, 2, 0), intensity=5),
        PointLight(position=(3, 3, 0)),
        DirectionalLight(direction=(3, -4, 0)),
        DirectionalLight(direction=(0, 1, 0)),
    )
    ground = Floor(min=(-5, -5), max=(4, 5), materials=("m0",))
    lid = box((-0.25, 0.75, -0.25), (0.25, 1.25, 0.25))
    behind = box((3, 4, -1), (5, 5, 1))  # the light at (3, 3, 0), which it does not hide
    what = scene((lid, Phong(ambient=0.25)), (behind, Phong()), lights=lights, floor=ground, ambient=(1, 2, 4))
    target, eye = np.array([0.1, 0.0, 0.05]), np.array([0.0, 2.0, 4.0])
    camera, over, aside, sun = ray_path(stage_of(what), eye, target - eye, 2)  # none to the light from below
    assert camera.radiance == (0.25, 0.5, 1.0)
    assert [s.kind for s in (over, aside, sun)] == ["shadow"] * 3 and {s.parent for s in (over, aside, sun)} == {0}
    assert over.hit and over.face >= 0 and over.radiance == (0, 0, 0)
    assert over.end[1] == pytest.approx(0.75, rel=NEAR)  # the lid's lower side, of those in the way the nearest
    assert not aside.hit and aside.end == (3, 3, 0)
    to_light = np.subtract((3, 3, 0), target)
    expected = 0.8 * 3 / np.linalg.norm(to_light) ** 3
    assert aside.radiance == pytest.approx([expected] * 3, rel=NEAR)
    assert not sun.hit and sun.radiance == pytest.approx([0.8 * 0.8] * 3, rel=NEAR)
    np.testing.assert_allclose(np.cross(np.subtract(sun.end, sun.start), (-3, 4, 0)), 0, atol=100 * NEAR)
    assert sun.end[1] > 1.25  # above all there is


def test_a_bounded_number_of_rays() -> None:
    """Of more rays than are told the deepest are left out: the rest is what a lower depth gives."""
    balls = tuple((icosphere(2).transformed(np.diag([r, r, r, 1.0])), CLEAR) for r in (0.4, 0.6, 0.8, 1.0))
    what = scene(*balls, lights=(PointLight(position=(0, 3, 0)),), background=0.5)
    prepared = stage_of(what)
    path = ray_path(prepared, (0.1, 0.2, 4), (0, 0, -1), 16)
    rays = [s for s in path if s.kind != "shadow"]
    assert len(rays) == MAX_RAYS and len(path) <= 2 * MAX_RAYS
    assert rays[-1].depth > 6
    shallow = ray_path(prepared, (0.1, 0.2, 4), (0, 0, -1), rays[-1].depth - 1)
    assert path[: len(shallow)] == shallow and len(shallow) > 400


def test_without_faces_there_is_a_background() -> None:
    empty = Scene(camera=zoo(False).camera, materials={}, background=(1, 2, 3))
    (segment,) = ray_path(stage_of(empty), (0, 0, 0), (0, 0, 1), 4)
    assert not segment.hit and segment.radiance == (1, 2, 3) and segment.end != segment.start


@cases(
    ("origin", "direction", "max_depth", "message"),
    [
        ((0, 0), (0, 0, 1), 1, "origin: expected three finite numbers"),
        ((0, 0, np.inf), (0, 0, 1), 1, "origin: expected three finite numbers"),
        ((0, 0, 1), (0, 0, np.nan), 1, "direction: expected three finite numbers"),
        ((0, 0, 1), (0, 0, 0), 1, "direction: expected a vector of non-zero length"),
        ((0, 0, 1), (0, 0, 1), -1, "max_depth: expected an integer >= 0"),
        ((0, 0, 1), (0, 0, 1), 1.0, "max_depth: expected an integer >= 0"),
        ((0, 0, 1), (0, 0, 1), True, "max_depth: expected an integer >= 0"),
    ],
)
def test_bad_arguments_are_named(origin: Any, direction: Any, max_depth: Any, message: str) -> None:
    prepared = stage_of(scene((box(), Phong())))
    with pytest.raises(ValueError, match=message):
        ray_path(prepared, origin, direction, max_depth)

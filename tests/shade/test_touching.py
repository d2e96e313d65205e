"""Bodies that touch have no air between them: pictures against closed forms, and bodies that are one or sunk."""

import math
from typing import Any

import numpy as np
import pytest
from cases import cases

from renderer.diagnostics.ray_path import MAX_RAYS, ray_path
from renderer.materials.dielectric import Dielectric
from renderer.materials.mirror import Mirror
from renderer.materials.phong import Phong
from renderer.materials.registry import Material
from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import box, grid, icosphere
from renderer.picture.image import Image
from renderer.picture.prepare import prepare_scene
from renderer.picture.render import render
from renderer.picture.touching import touching_faces
from renderer.scene.camera import PerspectiveCamera
from renderer.scene.light import DirectionalLight
from renderer.scene.needs import needs_of
from renderer.scene.scene import Floor, Scene, SceneObject
from renderer.trace.spawn import MITSUBA_EPSILON
from validation.pictures.unseen import box_at, columns_at, passed

pytestmark = pytest.mark.judges("Dielectric", "Phong", "PreparedScene.touching")


REL = 2.0**-22
GROUND = Phong(diffuse=0.0, ambient=0.5)
GLASS, WATER = Dielectric(ior=1.5), Dielectric(ior=1.33)
# The sky is blue, and nothing else is.
SKY = (0.0, 0.0, 1000.0)
EYES = [(2.3, 3.0, 4.1), (-1.7, 5.0, 0.4), (0.0, 4.0, 4.0), (0.3, 0.7, 5.0)]


def clear(ior: float) -> Dielectric:
    """Glass that reflects nothing: what it does not refract is lost."""
    return Dielectric(ior=ior, reflectance=0.0)


def scene(*parts: tuple[Mesh, Material], eye: Any, target: Any = (0, 0.4, 0), fov: float = 30, **more: Any) -> Scene:
    """A scene of (mesh, material) pairs; equal materials are one."""
    materials = {str(m): m for _, m in parts}
    objects = tuple(SceneObject(mesh=mesh, material=str(m), normals="flat") for mesh, m in parts)
    materials["ground"] = GROUND
    more.setdefault("background", SKY)
    camera = PerspectiveCamera(eye=eye, target=target, up=(0.1, 0.7, -0.7), fov=fov)
    return Scene(camera=camera, materials=materials, objects=objects, ambient=1.0, **more)


def level(y: float, turned: bool = False) -> Mesh:
    """A large square whose diagonal passes below the cubes, or the other diagonal."""
    square = [[-9.0, y, -9.0], [-9.0, y, 9.0], [9.0, y, 9.0], [9.0, y, -9.0]]
    return Mesh(square, [[0, 1, 3], [1, 2, 3]] if turned else [[0, 1, 2], [0, 2, 3]])


def cube(y: float, size: float = 1.0) -> Mesh:
    return box((-0.5 * size, y, -0.5 * size), (0.5 * size, 1.0 + y, 0.5 * size))


def picture(what: Scene, size: int = 48, **options: Any) -> Image:
    return render(what, resolution=(size, size), samples=1, **{"threads": 1, **options})


def alike(one: Image, other: Image, most: float) -> None:
    """Equal within 1e-6, but for a share of the pixels, those at edges."""
    scale = np.maximum(1.0, np.abs(other.radiance))
    apart = (np.abs(one.radiance.astype(np.float64) - other.radiance) > 1e-6 * scale).any(axis=2)
    assert apart.mean() <= most


class TestOnTheGround:
    @cases("eye", EYES[:3])
    @cases("y", [0.0, 0.1, -3.7, 1e3 / 3])
    @cases("material", [clear(1.5), Phong(diffuse=0.0, transmittance=0.9, ior=1.0)])
    def test_no_sky_is_seen_through_the_ground(self, material: Material, y: float, eye: Any) -> None:
        seen = {"eye": np.add(eye, (0, y, 0)).tolist(), "target": (0.0, y + 0.4, 0.0)}
        for turned in (False, True):
            for parts in (
                [(cube(y), material), (level(y, turned), GROUND)],
                [(level(y, turned), GROUND), (cube(y), material)],
            ):
                image = picture(scene(*parts, **seen))
                assert image.radiance[image.face >= 0].max() < 2.0

    @cases("eye", EYES)
    @cases("material", [GLASS, clear(1.5), Phong(diffuse=0.0, transmittance=0.9, ior=1.0)])
    def test_as_if_sunk_into_the_ground(self, material: Material, eye: Any) -> None:
        sun = {"lights": (DirectionalLight(direction=(1, -3, -2), irradiance=1.0),)}
        ground = Floor(min=(-9, -9), max=(9, 9), materials=("ground",), squares=(3, 3))
        for more, parts in (({"floor": ground}, []), ({}, [(level(0.0), Phong(diffuse=0.7))])):
            stands = scene((cube(0.0), material), *parts, eye=eye, **sun, **more)
            sunk = scene((cube(-1e-9), material), *parts, eye=eye, **sun, **more)
            alike(picture(stands, max_depth=6), picture(sunk, max_depth=6), 0.004)

    def test_a_mirror_below_glass_reflects_within_it(self) -> None:
        """Straight down through glass of index 1.5, back up and out: (1 - 0.04)^2 times 0.9 of the sky."""
        what = scene(
            (cube(0.0), clear(1.5)), (level(0.0), Mirror(reflectance=0.9)), eye=(0.1, 5, 0.2), target=(0.1, 0, 0.2)
        )
        image = render(what, resolution=(1, 1), max_depth=3)
        assert image.radiance[0, 0, 2] == pytest.approx(1000 * 0.9 * 0.96**2, rel=REL)

    @pytest.mark.parametrize("order", [1, -1])
    def test_of_two_grounds_in_one_plane_the_earlier_one_is_seen_through_glass(self, order: int) -> None:
        red, green = (Phong(diffuse=0.0, ambient=color) for color in ((0.5, 0.0, 0.0), (0.0, 0.5, 0.0)))
        grounds = [(level(0.0), red), (level(0.0, turned=True), green)][::order]
        image = picture(scene((cube(0.0), clear(1.5)), *grounds, eye=(0.1, 5.0, 0.2), target=(0.1, 0.0, 0.0), fov=2))
        seen = image.radiance.reshape(-1, 3).astype(np.float64)
        assert (seen[:, 0 if order == 1 else 1] > 0.4).all() and (seen[:, 1 if order == 1 else 0] == 0.0).all()

    def test_in_a_corner_of_walls(self) -> None:
        walls = [
            (box((-2.0, -1.0, -2.0), (2.0, 0.0, 2.0)), GROUND),
            (box((-2.0, 0.0, -2.0), (0.0, 3.0, 2.0)), GROUND),
            (box((0.0, 0.0, -2.0), (2.0, 3.0, 0.0)), GROUND),
        ]
        for material in (clear(1.5), Phong(diffuse=0.0, transmittance=0.9, ior=1.0)):
            parts = [*walls, (box((0, 0, 0), (1, 1, 1)), material)]
            for order in (parts, parts[::-1]):
                image = picture(scene(*order, eye=(3.1, 2.7, 3.3), target=(0.4, 0.4, 0.4)))
                assert image.radiance[..., 2].max() < 2.0

    def test_from_below_the_ground_hides_the_glass(self) -> None:
        for parts in ([(cube(0.0), GLASS), (level(0.0), GROUND)], [(level(0.0), GROUND), (cube(0.0), GLASS)]):
            image = picture(scene(*parts, eye=(0.3, -4, 0.2), fov=20))
            np.testing.assert_array_equal(image.radiance, np.float32(0.5))


def slab(low: float, high: float) -> Mesh:
    return box((-30.0, low, -30.0), (30.0, high, 30.0))


def through(angle: float, *parts: tuple[Mesh, Material], **options: Any) -> Image:
    """Seen at an angle from above, by pixels nearly of one direction."""
    t = math.radians(angle)
    eye = (20 * math.sin(t) + 0.3, 20 * math.cos(t), 0.2)
    what = scene(*parts, eye=eye, target=(0.3, 0.0, 0.2), fov=1e-4, background=1.0)
    return picture(what, 16, max_depth=12, **options)


class TestGlassOnGlass:
    def test_two_boxes_are_one(self) -> None:
        for parts in ((slab(0, 1), slab(1, 2)), (slab(1, 2), slab(0, 1))):
            for angle in (0, 20, 50, 75):
                two = through(angle, *((mesh, clear(1.5)) for mesh in parts))
                one = through(angle, (slab(0, 2), clear(1.5)))
                np.testing.assert_allclose(two.radiance, one.radiance, rtol=REL)
                np.testing.assert_allclose(two.radiance, passed(angle, 1, 1.5, 1), rtol=5e-6)
        assert passed(50, 1, 1.5, 1) == pytest.approx(0.888, abs=5e-4)

    @cases("eye", [(0.3, 1.0, 0.2), (0.5, 1.0, 0.5), (-1.0, 0.25, 0.1), (0.2, 0.0, 0.3)])
    def test_an_eye_on_glass_that_looks_in_is_outside(self, eye: Any) -> None:
        """Straight through two sides, each of which passes 96 %, whichever triangle the eye is on."""
        body = box((-1, 0, -1), (1, 1, 1))
        target = {1.0: (eye[0], -5, eye[2]), 0.0: (eye[0], 5, eye[2])}.get(eye[1], (5, eye[1], eye[2]))
        image = picture(scene((body, clear(1.5)), eye=eye, target=target, fov=0.001), 1, max_depth=12)
        assert image.radiance[0, 0, 2] == pytest.approx(1000.0 * 0.96**2, rel=1e-6)

    @pytest.mark.parametrize("target", [(0.31, 3, 0.2), (5, 0.7, 0.1), (-5, 0.7, 0.1)])
    def test_an_eye_where_two_boxes_touch_sees_what_it_sees_in_one(self, target: Any) -> None:
        pair = [(box((-1, 0.5, -1), (0.3, 1, 1)), clear(1.5)), (box((0.3, 0.5, -1), (1, 1, 1)), clear(1.5))]
        one = [(box((-1, 0.5, -1), (1, 1, 1)), clear(1.5))]
        for eye in ((0.3, 0.6, 0.2), (0.3, 0.75, 0.0)):
            seen = [picture(scene(*parts, eye=eye, target=target, fov=0.01), 1, max_depth=12) for parts in (pair, one)]
            assert seen[0].radiance[0, 0, 2] == pytest.approx(float(seen[1].radiance[0, 0, 2]), rel=1e-6)

    @cases("iors", [(1.5, 1.33, 1.8), (1.2, 2.4, 1.2), (1.33, 1.5, 1.33), (1.5, 1.5, 1.7)])
    @cases("angle", [0.0, 33.0, 65.0])
    def test_three_media(self, iors: tuple[float, ...], angle: float) -> None:
        parts = [(slab(-k, 1 - k), clear(ior)) for k, ior in enumerate(iors)]
        for order in ((0, 1, 2), (2, 1, 0), (1, 0, 2), (2, 0, 1)):
            image = through(angle, *(parts[k] for k in order))
            np.testing.assert_allclose(image.radiance, passed(angle, 1, *iors, 1), rtol=5e-6)

    def test_a_body_in_water_that_touches_its_wall(self) -> None:
        """From both sides; the body is later in the scene, so that it holds where both begin."""
        water, body = (slab(0, 3), clear(1.33)), (slab(1, 3), clear(1.7))
        for low, high in ((0.0, 2.0), (1.0, 3.0)):
            image = through(30, water, (slab(low, high), clear(1.7)))
            np.testing.assert_allclose(image.radiance, passed(30, 1, 1.33, 1.7, 1), rtol=5e-6)
        # Earlier in the scene, it is entered before the water, which then holds until the ray leaves it.
        image = through(30, body, water)
        np.testing.assert_allclose(image.radiance, passed(30, 1, 1.33, 1), rtol=5e-6)

    def test_the_body_that_was_entered_last_holds_in_an_overlap(self) -> None:
        """Glass from 0 to 1.1 and water from 1 to 2: one interface between the two, wherever it is."""
        parts = [(slab(0, 1.1), clear(1.5)), (slab(1, 2), clear(1.33))]
        for order in (parts, parts[::-1]):
            for angle in (0, 40):
                image = through(angle, *order)
                np.testing.assert_allclose(image.radiance, passed(angle, 1, 1.33, 1.5, 1), rtol=5e-6)
        assert passed(0, 1, 1.33, 1.5, 1) == pytest.approx(0.96 * 0.99639 * 0.97994, abs=1e-4)

    def test_boxes_of_which_one_is_smaller(self) -> None:
        """Through the common part of a face, and beside it."""
        small, large = (box((-1, 1, -1), (1, 2, 1)), clear(1.8)), (slab(0, 1), clear(1.5))
        for order in ((small, large), (large, small)):
            image = picture(scene(*order, eye=(0.1, 9, 0.2), target=(0.1, 0, 0.2), fov=0.1, background=1.0), 8)
            np.testing.assert_allclose(image.radiance, passed(0, 1, 1.8, 1.5, 1), rtol=1e-5)
            image = picture(scene(*order, eye=(5, 9, 0.2), target=(5, 0, 0.2), fov=0.1, background=1.0), 8)
            np.testing.assert_allclose(image.radiance, passed(0, 1, 1.5, 1), rtol=1e-5)

    def test_on_an_edge_far_from_the_origin(self) -> None:
        """Straight down onto a diagonal. There rounding moves points off the face that was hit."""
        (x, z), size = (1e6, 3e6), 0.01
        parts = [(box((x, y, z), (x + size, y + 1, z + size)), clear(1.5)) for y in (0, 1)]
        what = scene(*parts, eye=(x, 9, z), target=(x, 0, z), background=1.0)
        prepared = prepare_scene(what, needs_of(what, max_depth=8), "octree", threads=1)
        for share in np.linspace(0.01, 0.99, 50):
            at = share * size
            for other in (at, size - at):
                path = ray_path(prepared, (x + at, 9, z + other), (0, -1, 0), 8)
                assert sum(s.radiance[0] for s in path) == pytest.approx(passed(0, 1, 1.5, 1), rel=1e-6)


ORIGIN, FAR = (0.0, 0.0, 0.0), (-241.3, 200.7, 786.6)


@cases(
    "axis, place, up, plate",
    [
        (ORIGIN, (-(2.0**-54), 0.0), False, False),
        (ORIGIN, (-0.4865042554105199, 0.0), False, True),
        (ORIGIN, (-0.4865042554105199, 0.0), True, True),
        (FAR, (2.0**-45, 0.344010458076923), True, True),
        (FAR, (2.0**-45, 0.5160156871153276), True, True),
    ],
)
def test_within_the_planes_in_which_columns_touch(axis: Any, place: Any, up: bool, plate: bool) -> None:
    """A ray leaves the columns that it entered."""
    columns = list(columns_at(axis))
    ground = [(box_at(axis, (-3, -1, -3), (3, 0, 3)), clear(1.5))] if plate else []
    what = scene(*columns[:2], *ground, *columns[2:], eye=(0, 9, 0), background=1.0)
    prepared = prepare_scene(what, needs_of(what, max_depth=8), "octree", threads=1)
    height, way = (-9, 1) if up else (9, -1)
    path = ray_path(prepared, np.add(axis, (place[0], height, place[1])), (0, way, 0), 8)
    assert sum(s.radiance[0] for s in path) == pytest.approx(passed(0, 1, 1.5, 1), rel=1e-6)
    for one in path:
        np.testing.assert_allclose(np.subtract(one.end, axis)[[0, 2]], place, atol=1e-12)


@cases(
    "origin, way, count",
    [((0.5, -6.0, 0.5), (1, 13, 1), 4), ((-3.0, 0.5, 9.0), (0.5, 0, -1), 2), ((5.0, 1.0, -8.0), (-0.5, 0, 1), 2)],
)
def test_obliquely_through_an_edge_of_cubes_that_touch(origin: Any, way: Any, count: int) -> None:
    """As through one body."""
    cubes = [
        box((x, 0, z), (x + 1, 1 if count == 2 else 2, z + 1)) for x, z in ((0, 0), (1, 0), (0, 1), (1, 1))[:count]
    ]
    parts = [(mesh, clear(1.5 + k * 2.0**-40)) for k, mesh in enumerate(cubes)]
    seen = []
    for bodies in (
        parts,
        parts[::-1],
        [(box((0, 0, 0), np.max([mesh.vertices.max(0) for mesh in cubes], axis=0)), clear(1.5))],
    ):
        what = scene(*bodies, eye=(0, 9, 0), background=1.0)
        prepared = prepare_scene(what, needs_of(what, max_depth=9), "octree", threads=1)
        seen.append(sum(s.radiance[0] for s in ray_path(prepared, origin, way, 9)))
    assert seen[:2] == pytest.approx([seen[2], seen[2]], rel=1e-6) and seen[2] > 0.5


LARGE = ((-2, -1, -2), (2, 2, 2))
LEFT, RIGHT = ((-2, -1, -2), (0, 2, 0)), ((0, -1, -2), (2, 2, 0))
HIGH, LOW = ((-2, 0, -2), (0, 2, 1)), ((0, -1, -2), (2, 1, 0))


@cases(
    "bodies, z, up",
    [((LEFT, LARGE, RIGHT), -0.3, False), ((HIGH, LARGE, LOW), -0.3, True), ((LARGE, LEFT, RIGHT), 0.0, True)],
)
def test_within_the_plane_in_which_bodies_within_another_touch(bodies: Any, z: float, up: bool) -> None:
    parts = [(box(*corners), clear(1.5 + k * 2.0**-40)) for k, corners in enumerate(bodies)]
    what = scene(*parts, eye=(0, 9, 0), background=1.0)
    prepared = prepare_scene(what, needs_of(what, max_depth=8), "octree", threads=1)
    path = ray_path(prepared, (0, -9 if up else 9, z), (0, 1 if up else -1, 0), 8)
    assert sum(s.radiance[0] for s in path) == pytest.approx(passed(0, 1, 1.5, 1), rel=1e-6)


def test_the_first_of_faces_hit_together_is_in_the_picture() -> None:
    """From below through the ground, on which glass stands."""
    what = scene((cube(0.0), GLASS), (level(0.0), GROUND), eye=(-0.1, -9, 0.2), target=(-0.1, 0, 0.2), fov=0.1)
    prepared = prepare_scene(what, needs_of(what, max_depth=3), "octree", threads=1)
    seen = ray_path(prepared, (-0.1, -9, 0.2), (0, 1, 0), 3)[0].face
    assert (picture(what, 1).face == seen).all() and seen >= 12


def test_behind_an_open_sheet_only_faces_at_the_same_place_count() -> None:
    """A ray leaves the lower sheet, which it never entered. The upper one, tilted, lies beyond it."""
    lower = Mesh([[-1, 0, -1], [-1, 0, 1], [1, 0, 0]], [[0, 1, 2]])
    upper = Mesh([[-1, -0.5, -1], [1, 1.1, 0], [-1, -0.5, 1]], [[1, 2, 0]])
    elsewhere = [(box((9, y, 9), (10, y + 1, 10)), WATER) for y in (0, 1)]  # they touch
    for parts in ([(lower, GLASS), (upper, GLASS)], [(upper, GLASS), (lower, GLASS)]):
        what = scene(*parts, *elsewhere, eye=(0, 9, 0), background=1.0)
        prepared = prepare_scene(what, needs_of(what, max_depth=2), "octree", threads=1)
        assert ray_path(prepared, (-0.2, -9, 0.1), (0, 1, 0), 2)[0].end == pytest.approx((-0.2, 0, 0.1), abs=1e-12)


def other_diagonals(mesh: Mesh) -> Mesh:
    """A box of the same place whose squares are halved along their other diagonals."""
    middle = mesh.vertices.mean(axis=0) * [2, 0, 0]
    return Mesh(mesh.vertices * [-1, 1, 1] + middle, mesh.faces[:, ::-1])


class TestTurned:
    """Turned by any angle, planes that were one are so but for rounding."""

    def seen(self, rotate: Any, parts: list[tuple[Mesh, Material]], eye: Any, target: Any, **more: Any) -> Image:
        materials = {"ground": GROUND, **{str(m): m for _, m in parts}}
        objects = tuple(
            SceneObject(mesh=mesh, material=str(m), normals="flat", rotate=rotate, translate=(3, -7, 11))
            for mesh, m in parts
        )
        turn = np.array(objects[0].matrix())
        eye, target = ((turn @ (*p, 1.0))[:3].tolist() for p in (eye, target))
        camera = PerspectiveCamera(eye=eye, target=target, up=(0.1, 0.7, -0.7), fov=more.pop("fov"))
        return picture(
            Scene(camera=camera, materials=materials, objects=objects, ambient=1.0, **more), 40, max_depth=12
        )

    @cases("seed", range(3))
    def test_glass_on_the_ground(self, seed: int) -> None:
        rotate = np.random.default_rng(seed).uniform(-180, 180, 3).tolist()
        for mesh in (cube(0.0), other_diagonals(cube(0.0))):
            for parts in ([(mesh, clear(1.5)), (level(0.0), GROUND)], [(level(0.0), GROUND), (mesh, clear(1.5))]):
                image = self.seen(rotate, parts, (1, 3, 2), (0, 0.4, 0), fov=20, background=SKY)
                assert image.radiance.max() < 2.0

    @cases("seed", range(3))
    def test_glass_on_glass(self, seed: int) -> None:
        rotate = np.random.default_rng(seed).uniform(-180, 180, 3).tolist()
        t = math.radians(50)
        eye, target = (20 * math.sin(t) + 0.3, 20 * math.cos(t), 0.2), (0.3, 0.0, 0.2)
        for mesh in (slab(1, 2), other_diagonals(slab(1, 2)), box((-40, 1, -35), (50, 2, 37))):
            for parts in ((mesh, slab(0, 1)), (slab(0, 1), mesh)):
                image = self.seen(rotate, [(m, clear(1.5)) for m in parts], eye, target, fov=1e-4, background=1.0)
                np.testing.assert_allclose(image.radiance, passed(50, 1, 1.5, 1), rtol=5e-6)

    def test_a_mirror_below_glass(self) -> None:
        for seed in range(4):
            rotate = np.random.default_rng(seed).uniform(-180, 180, 3).tolist()
            for mesh in (cube(0.0), other_diagonals(cube(0.0))):
                parts = [(mesh, clear(1.5)), (level(0.0), Mirror(reflectance=0.9))]
                image = self.seen(rotate, parts, (0.1, 5, 0.2), (0.1, 0, 0.2), fov=1e-4, background=1.0)
                np.testing.assert_allclose(image.radiance, 0.9 * 0.96**2, rtol=5e-6)


def crowded() -> Scene:
    parts = (
        (box((0, 0, 0), (1, 1, 1)), GLASS),
        (box((1, 0, 0), (2, 1, 1)), WATER),
        (box((0.25, 1, 0.25), (1.5, 2, 1)), Phong(diffuse=0.1, reflectance=0.1, transmittance=0.7, ior=1.2)),
        (box((-1, 0, -1), (0, 2, 1)), Phong(diffuse=0.4, reflectance=0.2)),
        (box((1, 0, 0.5), (1.5, 0.5, 1)), GLASS),
        (level(0.0), Phong(diffuse=0.6, reflectance=0.1)),
    )
    lights = (DirectionalLight(direction=(-1, -3, -2), irradiance=0.7),)
    return scene(*parts, eye=(2.9, 2.8, 4.3), target=(0.7, 0.7, 0.5), fov=40, background=(0.2, 0.4, 0.8), lights=lights)


class TestOneAnswer:
    def test_paths_add_up_to_the_pixels(self) -> None:
        what, size = crowded(), (11, 9)
        image = render(what, resolution=size, samples=1, threads=1, max_depth=5, accelerator="octree")
        prepared = prepare_scene(what, needs_of(what, max_depth=5), "octree", threads=1)
        rows = what.camera.rows(*size)
        for y, x in np.ndindex(image.face.shape):
            path = ray_path(prepared, rows[0], rows[3] + ((x + 0.5) * rows[4] + (y + 0.5) * rows[5]), 5)
            assert len(path) == image.rays[y, x] < MAX_RAYS and path[0].face == image.face[y, x]
            np.testing.assert_allclose(sum(np.array(s.radiance) for s in path), image.radiance[y, x], rtol=2.0**-23)

    def test_tree_and_threads(self) -> None:
        first = picture(crowded(), 64, accelerator="octree")
        for options in ({"accelerator": "brute"}, {"accelerator": "octree", "threads": 3}):
            other = picture(crowded(), 64, **options)
            for one, two in ((first.radiance, other.radiance), (first.face, other.face), (first.rays, other.rays)):
                np.testing.assert_array_equal(one, two)

    def test_mitsubas_offset_leaves_each_face_alone(self) -> None:
        two = [(slab(0, 1), clear(1.5)), (slab(1, 2), clear(1.5))]
        image = through(50, *two, offset="mitsuba")
        assert np.abs(image.radiance - passed(50, 1, 1.5, 1)).max() > 0.01 and MITSUBA_EPSILON > 0.0

    def test_at_an_edge_too(self) -> None:
        """There a ray comes from outside upon the face in which two cubes touch, and by our offset enters another."""
        eye, way = (-3.0, 0.5, 9.0), (0.5, 0.0, -1.0)
        cubes = [(box((x, 0, 0), (x + 1, 1, 1)), clear(1.5 + x * 2.0**-40)) for x in (0, 1)]
        what = scene(*cubes, eye=eye, target=np.add(eye, way), fov=1e-3)
        hit = prepare_scene(what, needs_of(what), "octree", threads=1).octree.closest_hit(eye, way).face
        assert picture(what, 1, offset="mitsuba").face[0, 0] == hit != picture(what, 1).face[0, 0]


class TestTouchingFaces:
    def found(self, *parts: tuple[Mesh, Material]) -> list[int]:
        what = scene(*parts, eye=EYES[0])
        needs = needs_of(what)
        octree, brute = (prepare_scene(what, needs, accelerator, threads=2) for accelerator in ("octree", "brute"))
        found = octree.arrays.touching
        # Through the octree, and among all faces.
        for other in (brute.arrays.touching, touching_faces(brute.tree, brute.arrays, 2)):
            np.testing.assert_array_equal(other, found)
        return np.flatnonzero(found).tolist()

    def test_none_of_bodies_that_stand_alone(self) -> None:
        assert self.found((icosphere(3), GLASS)) == []
        assert self.found((box(), GLASS), (level(-0.001), GROUND)) == []
        assert self.found((grid(7, 5), GLASS)) == []

    def test_only_those_of_which_one_passes_light(self) -> None:
        top, bottom = (box((0, 1, 0), (1, 2, 1)), GLASS), (box(), GROUND)
        assert len(self.found(top, bottom)) == 4
        assert len(self.found(top, (box(), WATER))) == 4
        assert self.found((box((0, 1, 0), (1, 2, 1)), GROUND), bottom) == []

    def test_a_prepared_scene_finds_them_whatever_they_are_of(self) -> None:
        what = scene((box((0, 1, 0), (1, 2, 1)), GROUND), (box(), GROUND), eye=EYES[0])
        prepared = prepare_scene(what, needs_of(what), "octree")
        assert len(np.flatnonzero(prepared.touching)) == 4 and not prepared.arrays.touching.any()

    def test_faces_beside_each_other_do_not_touch(self) -> None:
        assert self.found((box(), GLASS), (box((1, 1, 0), (2, 2, 1)), GLASS)) == []

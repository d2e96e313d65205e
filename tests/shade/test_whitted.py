"""Whitted pictures whose radiance is known by hand, mostly of a single pixel."""

import math
from typing import Any

import numpy as np
import pytest
from cases import cases
from hypothesis import given, settings
from hypothesis import strategies as st

from renderer.materials.dielectric import Dielectric
from renderer.materials.mirror import Mirror
from renderer.materials.phong import Phong
from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import box, grid, icosphere, torus
from renderer.picture.image import Image
from renderer.picture.render import render
from renderer.scene.camera import OrthographicCamera, PerspectiveCamera
from renderer.scene.light import DirectionalLight, PointLight
from renderer.scene.scene import Floor, Scene, SceneObject
from renderer.trace.spawn import MITSUBA_EPSILON

pytestmark = pytest.mark.judges(
    "Dielectric", "DirectionalLight", "Image", "Mesh", "Mirror", "Mirror.passes_light", "Needs", "Phong",
    "Phong.passes_light", "PointLight", "RenderSettings", "render", "scene.ambient", "scene.background",
    "scene.lights", "scene.lights.directional.direction", "scene.lights.directional.irradiance",
    "scene.lights.point.intensity", "scene.lights.point.position", "scene.materials.dielectric.ior",
    "scene.materials.dielectric.reflectance", "scene.materials.dielectric.transmittance",
    "scene.materials.mirror.reflectance", "scene.materials.phong.ambient", "scene.materials.phong.diffuse",
    "scene.materials.phong.ior", "scene.materials.phong.reflectance", "scene.materials.phong.shininess",
    "scene.materials.phong.specular", "scene.materials.phong.transmittance", "scene.objects.normals",
    "scene.render.max_depth", "scene.render.min_weight", "scene.render.samples",
)  # fmt: skip


# Radiance is stored as float32: half an ulp, and as much again for the float64 sums before it.
REL = 2.0**-23
WHITE = Phong(diffuse=1.0, ambient=0.0)
GLOWS = Phong(diffuse=0.0, ambient=1.0)


def quad(centre: Any, a: Any, b: Any) -> Mesh:
    """A rectangle of half edges a and b, its normal along a x b."""
    c, a, b = (np.asarray(v, np.float64) for v in (centre, a, b))
    return Mesh([c - a - b, c + a - b, c + a + b, c - a + b], [[0, 1, 2], [0, 2, 3]])


def floor(y: float = 0.0, half: float = 50.0) -> Mesh:
    """A square facing up, its diagonal edge well off the origin."""
    return quad((3.0, y, 1.0), (0, 0, half), (half, 0, 0))


def towards(eye: Any, target: Any = (0, 0, 0), up: Any = (0, 1, 0)) -> PerspectiveCamera:
    return PerspectiveCamera(eye=eye, target=target, up=up, fov=20)


def scene(camera: Any, *parts: tuple[Mesh, Any], smooth: bool = False, **more: Any) -> Scene:
    """A scene of (mesh, material) pairs."""
    return Scene(
        camera=camera,
        materials={f"m{i}": material for i, (_, material) in enumerate(parts)},
        objects=tuple(
            SceneObject(mesh=mesh, material=f"m{i}", normals="smooth" if smooth else "flat")
            for i, (mesh, _) in enumerate(parts)
        ),
        **more,
    )


def pixel(what: Scene, **options: Any) -> np.ndarray:
    """The radiance of the ray from the eye to the camera's target."""
    return one(what, **options).radiance[0, 0]


def one(what: Scene, **options: Any) -> Image:
    return render(what, resolution=(1, 1), threads=1, **options)


SUN = DirectionalLight(direction=(0, -1, 0), irradiance=1.0)
FROM_SIDE = towards((3, 1, 0))


class TestLocalLight:
    def test_directional_light_on_a_diffuse_plane(self) -> None:
        colors = {"diffuse": (0.5, 0.25, 0.125), "ambient": 0.0}
        light = DirectionalLight(direction=(3, -4, 0), irradiance=(2, 3, 5))
        # k_d (N . L) E with N . L = 4/5.
        expected = np.array([0.5 * 2, 0.25 * 3, 0.125 * 5]) * 0.8
        value = pixel(scene(FROM_SIDE, (floor(), Phong(**colors)), lights=(light,)))
        np.testing.assert_allclose(value, expected, rtol=REL)

    def test_point_light_falls_with_the_square_of_the_distance(self) -> None:
        for k in (1.0, 2.0, 10.0):
            light = PointLight(position=(0, 3 * k, 4 * k), intensity=(10, 20, 30))
            # I / r^2 (N . L) with r = 5 k and N . L = 3/5.
            value = pixel(scene(FROM_SIDE, (floor(), WHITE), lights=(light,)))
            np.testing.assert_allclose(value, np.array([10, 20, 30]) / (25 * k * k) * 0.6, rtol=REL)

    def test_lights_add_up(self) -> None:
        lights = (SUN, PointLight(position=(0, 2, 0), intensity=4.0), SUN)
        assert pixel(scene(FROM_SIDE, (floor(), WHITE), lights=lights)) == pytest.approx(3.0, rel=REL)

    def test_ambient_is_the_diffuse_colour_unless_given(self) -> None:
        for material, expected in ((Phong(diffuse=(0.2, 0.4, 0.6)), (0.2, 0.4, 0.6)), (Phong(ambient=0.5), (0.5,) * 3)):
            value = pixel(scene(FROM_SIDE, (floor(), material), ambient=(1, 2, 3)))
            np.testing.assert_allclose(value, np.array(expected) * [1, 2, 3], rtol=REL)

    @cases("shininess", [0.0, 1.0, 7.0, 200.0])
    def test_highlight(self, shininess: float) -> None:
        """The eye stands at 45 degrees, the light 10 degrees off the mirror direction."""
        angle = math.radians(55)
        light = DirectionalLight(direction=(math.sin(angle), -math.cos(angle), 0), irradiance=2.0)
        material = Phong(diffuse=0.0, specular=(0.5, 0.25, 1.0), shininess=shininess)
        value = pixel(scene(towards((1, 1, 0)), (floor(), material), lights=(light,)))
        expected = math.cos(math.radians(10)) ** shininess * 2.0
        np.testing.assert_allclose(value, np.array([0.5, 0.25, 1.0]) * expected, rtol=REL)

    def test_light_from_behind_is_ambient_only(self) -> None:
        """Whether the plane faces the eye or not: light and eye are on opposite sides."""
        shiny = Phong(diffuse=0.5, ambient=0.25, specular=1.0, shininess=0.0)
        for light in (DirectionalLight(direction=(0, 1, 0)), PointLight(position=(0, -1, 0))):
            for mesh in (floor(), Mesh(floor().vertices, floor().faces[:, ::-1])):
                assert pixel(scene(FROM_SIDE, (mesh, shiny), lights=(light,), ambient=1.0)).tolist() == [0.25] * 3

    def test_surfaces_have_two_sides(self) -> None:
        lights = (DirectionalLight(direction=(0, 1, 0)), PointLight(position=(0, -2, 0), intensity=4.0))
        for mesh in (floor(), Mesh(floor().vertices, floor().faces[:, ::-1])):
            value = pixel(scene(towards((3, -1, 0)), (mesh, WHITE), lights=lights))
            assert value == pytest.approx(2.0, rel=REL)

    def test_point_light_in_the_hit_point_or_the_plane(self) -> None:
        for position in ((0, 0, 0), (1, 0, 0)):
            value = pixel(scene(FROM_SIDE, (floor(), WHITE), lights=(PointLight(position=position),)))
            # The hit point's rounding may lift the light above the surface by some u: little from afar, anything near.
            assert np.isfinite(value).all() and value.min() >= 0.0
            assert position == (0, 0, 0) or value.max() < 1e-6

    @cases("lights", [(), (SUN,)])
    @cases("materials", [{}, {"m": WHITE}])
    def test_an_empty_scene_is_all_background(self, lights: Any, materials: Any) -> None:
        empty = Scene(camera=FROM_SIDE, materials=materials, lights=lights, background=(1, 2, 3))
        for accelerator in ("octree", "brute"):
            image = render(empty, resolution=(3, 2), threads=1, accelerator=accelerator)
            assert image.radiance.tolist() == [[[1, 2, 3]] * 3] * 2
            assert (image.face == -1).all() and np.isinf(image.depth).all() and (image.normal == 0).all()

    def test_smooth_normals_are_interpolated_and_normalised(self) -> None:
        normals = np.array([[0, 3, 4], [0, 3, 4], [0, 3, -4], [0, 3, -4]]) / 5.0
        mesh = Mesh([[-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1]], [[0, 1, 2], [0, 2, 3]], normals=normals)
        light = DirectionalLight(direction=(0, 0, -1), irradiance=1.0)
        camera = towards((0.25, 5, 0.5), (0.25, 0, 0.5), up=(0, 0, -1))
        # At z = 1/2 the normal is 3/4 of the way to (0, .6, .8): (0, .6, .4) / sqrt(.52), and L = +z.
        smooth = pixel(scene(camera, (mesh, WHITE), lights=(light,), smooth=True))
        assert smooth == pytest.approx(0.4 / math.sqrt(0.52), rel=REL)
        assert pixel(scene(camera, (mesh, WHITE), lights=(light,))).max() == 0.0

    def test_normals_are_made_where_the_file_has_none(self) -> None:
        camera = towards((3, 4, 5))
        bare = Mesh(icosphere(4).vertices, icosphere(4).faces)
        exact = Mesh(bare.vertices, bare.faces, normals=bare.vertices)
        sun = DirectionalLight(direction=(-3, -4, -5))
        # Angle-weighted normals of an icosphere are its radii to second order in the edge, 1/16 here.
        value, expected = (pixel(scene(camera, (m, WHITE), lights=(sun,), smooth=True)) for m in (bare, exact))
        np.testing.assert_allclose(value, expected, atol=1e-4)
        np.testing.assert_allclose(expected, 1.0, atol=1e-4)


class TestShadows:
    def lit(self, light: Any, blocker: Mesh, **options: Any) -> float:
        camera = towards((0.3, 0.1, 0))
        return float(pixel(scene(camera, (floor(), WHITE), (blocker, WHITE), lights=(light,)), **options)[0])

    def test_a_blocker_shadows_and_one_beside_it_does_not(self) -> None:
        for light in (SUN, PointLight(position=(0, 2, 0), intensity=4.0)):
            assert self.lit(light, quad((0, 1, 0), (0, 0, 0.2), (0.2, 0, 0))) == 0.0
            assert self.lit(light, quad((0.4, 1, 0), (0, 0, 0.2), (0.2, 0, 0))) == pytest.approx(1.0, rel=REL)
            assert self.lit(light, quad((0, -1, 0), (0, 0, 0.2), (0.2, 0, 0))) == pytest.approx(1.0, rel=REL)

    @pytest.mark.parametrize("offset", ["bounded", "mitsuba"])
    def test_shadow_rays_end_at_a_point_light(self, offset: str) -> None:
        light = PointLight(position=(0, 2, 0), intensity=4.0)
        for beyond in (1e-12, 1e-6, 0.5, 100.0):
            blocker = quad((0, 2 + beyond, 0), (0, 0, 0.2), (0.2, 0, 0))
            assert self.lit(light, blocker, offset=offset) == pytest.approx(1.0, rel=REL), beyond

    @cases(
        ("offset", "short"),
        [("bounded", 2.0**-36), ("mitsuba", 10.0 * MITSUBA_EPSILON), (2.0**-10, 10.0 * 2.0**-10), (0.01, 0.1)],
    )
    def test_how_far_before_a_point_light_its_shadow_rays_end(self, offset: Any, short: float) -> None:
        """A share of the way: by Mitsuba's rule, or by a number's, ten epsilons."""
        light = PointLight(position=(0, 2, 0), intensity=4.0)
        for share, expected in ((0.9 * short, 1.0), (1.1 * short, 0.0)):
            blocker = quad((0, 2.0 * (1.0 - share), 0), (0, 0, 0.2), (0.2, 0, 0))
            assert self.lit(light, blocker, offset=offset) == pytest.approx(expected, rel=REL)

    def test_a_surface_at_the_light_does_not_hide_it(self) -> None:
        """Lamps stand in ceilings: any position, any slope. The docstring of the shadow ray promises it."""
        rng = np.random.default_rng(9)
        hidden = lit = 0
        for _ in range(100):
            position = rng.uniform(-1, 1, 3) + np.array([0, 3, 0])
            a = rng.normal(size=3)
            b = np.cross(a, rng.normal(size=3))
            # A corner of every triangle is the light itself, so the light is in their planes exactly.
            fan = Mesh([position, *(position + s * a + t * b for s, t in ((1, 0), (0, 1), (-1, 0), (0, -1)))],
                       [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]])  # fmt: skip
            eye = (0.3, 0.1, 0)
            plane = quad((0, 0, 0), (0, 0, 0.5), (0.5, 0, 0))
            light = PointLight(position=tuple(position), intensity=float(position @ position))
            image = one(scene(towards(eye), (plane, WHITE), (fan, WHITE), lights=(light,)))
            if image.face[0, 0] >= len(plane.faces):
                continue  # the lamp's own surface stands before the plane
            lit += 1
            hidden += image.radiance[0, 0, 0] == 0.0
        assert hidden == 0 and lit > 95

    @pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
    def test_a_floor_through_the_origin_does_not_shadow_itself(self, scale: float) -> None:
        """y = 0 makes the rounding bound of the hit point vanish; shadow rays once met the floor again."""
        ground = Floor(min=(-4 * scale, -4 * scale), max=(4.1 * scale, 4.3 * scale), materials=("m",), squares=(3, 3))
        for eye in ((1.3, 2.1, 4.7), (0.1, 0.9, 3.3)):
            for sun in ((0.3, -1, -0.2), (0.9, -0.05, 0.7)):
                lit = Scene(
                    camera=PerspectiveCamera(eye=tuple(scale * x for x in eye), target=(0, 0, 0), fov=30),
                    materials={"m": WHITE},
                    floor=ground,
                    lights=(DirectionalLight(direction=sun, irradiance=1.0),),
                    background=7.0,
                )
                image = render(lit, resolution=(40, 40), threads=1)
                on = image.face >= 0
                assert on.sum() > 1200
                cosine = -sun[1] / math.hypot(*sun)
                np.testing.assert_allclose(image.radiance[on], cosine, rtol=REL)

    @pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
    def test_a_lit_sphere_has_no_speckles(self, scale: float) -> None:
        """Flat normals: a face is lit iff it faces the light, and no face of a convex mesh shadows another."""
        ball = Mesh(icosphere(3).vertices * scale, icosphere(3).faces)
        camera = PerspectiveCamera(eye=(3 * scale, scale, 2 * scale), target=(0, 0, 0), fov=40)
        sun = DirectionalLight(direction=(-1, -2, 0.5))
        image = render(scene(camera, (ball, WHITE), lights=(sun,)), resolution=(60, 60), threads=1)
        on = image.face >= 0
        cosine = np.maximum(ball.face_normals() @ np.array([1, 2, -0.5]) / math.sqrt(5.25), 0.0)
        np.testing.assert_allclose(image.radiance[on][:, 0], cosine[image.face[on]], rtol=REL, atol=1e-15)

    def test_close_planes_cast_shadows_on_each_other(self) -> None:
        """A thousandth apart, a hundred away from the origin: no offset may jump the gap."""
        lower, upper = floor(100.0), quad((0, 100.001, 0), (0, 0, 0.4), (0.4, 0, 0))
        camera = PerspectiveCamera(eye=(1, 100.0005, 0), target=(0, 100.0, 0), fov=3)
        assert pixel(scene(camera, (lower, WHITE), (upper, WHITE), lights=(SUN,)))[0] == 0.0
        assert pixel(scene(camera, (lower, WHITE), lights=(SUN,)))[0] == pytest.approx(1.0, rel=REL)

    def test_dielectrics_cast_opaque_shadows(self) -> None:
        glass = (quad((0, 1, 0), (0, 0, 0.2), (0.2, 0, 0)), Dielectric(type="dielectric"))
        assert pixel(scene(towards((0.3, 0.1, 0)), (floor(), WHITE), glass, lights=(SUN,)))[0] == 0.0


def facing_mirrors(k_r: float) -> Scene:
    """The eye in the middle between two planes, each giving 1 of its own and ``k_r`` of the other."""
    material = Phong(diffuse=0.0, ambient=1.0, reflectance=k_r)
    walls = [quad((0.3, 0.1, z), (5, 0, 0), (0, 5, 0)) for z in (-1.0, 1.0)]
    return scene(towards((0, 0, 0), (0, 0, 1)), *((w, material) for w in walls), ambient=1.0)


class TestRecursion:
    @cases(
        ("k_r", "options", "expected"),
        [
            (0.9, {"max_depth": 64}, 9.98939),  # (1 - .9^65) / .1
            (1.0, {"max_depth": 64}, 65.0),
            (0.9, {"max_depth": 64, "min_weight": 0.01}, 9.9030),  # .9^43 is the last weight >= .01
            (0.9, {"max_depth": 0}, 1.0),
            (0.9, {"max_depth": 1}, 1.9),
            (0.9, {"max_depth": 2}, 2.71),
            (0.5, {"max_depth": 64, "min_weight": 0.25}, 1.75),  # a weight equal to min_weight goes on
        ],
    )
    def test_facing_mirrors(self, k_r: float, options: Any, expected: float) -> None:
        # The expected values have six digits.
        assert pixel(facing_mirrors(k_r), **options) == pytest.approx(expected, rel=5e-6)

    def test_colour_of_a_mirror_weighs_each_bounce(self) -> None:
        wall = quad((0.3, 0.1, 1), (5, 0, 0), (0, 5, 0))
        mirror = Mirror(type="mirror", reflectance=(0.5, 0.25, 1.0))
        what = scene(towards((0, 0, 0), (0, 0, 1)), (wall, mirror), background=(1, 2, 3), ambient=9.0, lights=(SUN,))
        assert pixel(what).tolist() == [0.5, 0.5, 3.0]
        assert pixel(what, max_depth=0).tolist() == [0, 0, 0]

    def test_min_weight_looks_at_the_largest_channel(self) -> None:
        wall = quad((0.3, 0.1, 1), (5, 0, 0), (0, 5, 0))
        green = Mirror(type="mirror", reflectance=(0, 0.1, 0))
        what = scene(towards((0, 0, 0), (0, 0, 1)), (wall, green), background=1)
        assert pixel(what, min_weight=0.1)[1] == pytest.approx(0.1, rel=REL)
        assert pixel(what, min_weight=0.11).tolist() == [0, 0, 0]

    def test_phong_reflects_and_transmits_constant_parts(self) -> None:
        """Different walls ahead and behind; the refracted ray goes straight at normal incidence."""
        pane = quad((0.3, 0.1, 1), (5, 0, 0), (0, 5, 0))
        ahead, behind = (quad((0, 0, z), (5, 0, 0), (0, 5, 0)) for z in (3, -3))
        material = Phong(diffuse=0.0, ambient=0.125, reflectance=(0.5, 0.25, 0), transmittance=(0, 0.25, 0.75))
        what = scene(
            towards((0, 0, 0), (0, 0, 1)),
            (pane, material),
            (ahead, Phong(diffuse=0.0, ambient=2.0)),
            (behind, Phong(diffuse=0.0, ambient=4.0)),
            ambient=1.0,
        )
        np.testing.assert_allclose(pixel(what), [0.125 + 2, 0.125 + 1 + 0.5, 0.125 + 1.5], rtol=REL)
        assert one(what, max_depth=1).rays[0, 0] == 3

    def test_no_transmitted_part_under_total_internal_reflection(self) -> None:
        """From inside a block of index 1.5 at 60 degrees: k_t is lost, k_r stays what it was."""
        block = box((-1, -1, -1), (1, 1, 1))
        material = Phong(diffuse=0.0, ambient=0.0, reflectance=0.25, transmittance=0.5, ior=1.5)
        camera = towards((0.1, 0.1, 0.05), (1, 0.1 + 0.9 * math.tan(math.radians(40)), 0.05))
        image = one(scene(camera, (block, material), background=1.0), max_depth=1)
        # 40 degrees refracts at 41.8 degrees' critical angle: half the background and a quarter of the inside, black.
        assert image.radiance[0, 0] == pytest.approx(0.5, rel=REL)
        camera = towards((0.1, 0.1, 0.05), (1, 0.1 + 0.9 * math.tan(math.radians(44)), 0.05))
        image = one(scene(camera, (block, material), background=1.0), max_depth=1)
        assert image.radiance[0, 0].max() == 0.0 and image.rays[0, 0] == 2

    def test_a_full_binary_tree_fits_the_stack(self) -> None:
        panes = [quad((0.3, 0.1, z), (5, 0, 0), (0, 5, 0)) for z in range(-15, 15)]
        material = Phong(diffuse=0.0, ambient=1.0, reflectance=1.0, transmittance=1.0, ior=1.0)
        what = scene(towards((0, 0, 0.5), (0, 0, 2)), (Mesh.concatenate(panes), material), ambient=1.0)
        for depth in range(11):
            image = one(what, max_depth=depth)
            assert image.rays[0, 0] == 2 ** (depth + 1) - 1 and image.radiance[0, 0, 0] == 2 ** (depth + 1) - 1


def reflectance(angle: float, n1: float, n2: float) -> float:
    """Fresnel by the sine and tangent of the angles' sum and difference."""
    other = math.asin(n1 / n2 * math.sin(angle))
    minus, plus = angle - other, angle + other
    return ((math.sin(minus) / math.sin(plus)) ** 2 + (math.tan(minus) / math.tan(plus)) ** 2) / 2


GLASS = Dielectric(type="dielectric", ior=1.5)


class TestGlass:
    def test_reflected_and_refracted_parts_at_one_surface(self) -> None:
        """Into glass and out of it at 30 degrees, reflection sees 1 and refraction 0, then the reverse."""
        angle = math.radians(30)
        water = quad((2.0, 0, 0.3), (0, 0, 50), (50, 0, 0))
        up, down = (quad((0, y, 0), (500, 0, 0), (0, 0, 500)) for y in (20, -20))
        for side, n1, n2 in ((1, 1.0, 1.5), (-1, 1.5, 1.0)):
            f = reflectance(angle, n1, n2)
            for bright, expected in ((up, f if side > 0 else 1 - f), (down, 1 - f if side > 0 else f)):
                camera = towards((math.sin(angle), side * math.cos(angle), 0))
                value = pixel(scene(camera, (water, GLASS), (bright, GLOWS), ambient=1.0))
                assert value == pytest.approx(expected, rel=2 * REL)

    def test_total_internal_reflection_loses_nothing(self) -> None:
        """From below the surface at 60 degrees all of the bright floor is seen, and nothing of the dark above."""
        angle = math.radians(60)
        water = (quad((2.0, 0, 0.3), (0, 0, 50), (50, 0, 0)), GLASS)
        bottom = (quad((0, -20, 0), (500, 0, 0), (0, 0, 500)), GLOWS)
        camera = towards((math.sin(angle), -math.cos(angle), 0))
        image = one(scene(camera, water, bottom, ambient=1.0))
        assert image.radiance[0, 0].tolist() == [1, 1, 1] and image.rays[0, 0] == 2

    def test_its_colours_tint_the_two_parts(self) -> None:
        glass = Dielectric(type="dielectric", ior=1.5, reflectance=(1, 0.5, 0), transmittance=(0, 0.5, 1))
        value = pixel(scene(towards((0, 1, 0), up=(1, 0, 0)), (floor(), glass), background=1.0))
        np.testing.assert_allclose(value, [0.04, 0.5, 0.96], rtol=REL)

    @pytest.mark.parametrize("drop", [1.0, 20.0])
    def test_a_plate_shifts_the_ray_by_half_its_thickness(self, drop: float) -> None:
        """At 60 degrees through 1 of index 1.5: parallel to itself, shifted .51247, weakened twice by 1 - F."""
        angle = math.radians(60)
        shift = math.sin(angle) * (1 - math.cos(angle) / math.sqrt(1.5**2 - math.sin(angle) ** 2))
        assert shift == pytest.approx(0.51247, abs=5e-6)
        plate = box((-200, -1, -200), (201, 0, 200))
        y = -1 - drop
        # Undisturbed the ray would reach x = y tan 60; the shift is across the ray, so it counts twice along x.
        x = -y * math.tan(angle) - shift / math.cos(angle)
        camera = towards((-math.sin(angle), math.cos(angle), 0))
        through = (1 - reflectance(angle, 1.0, 1.5)) ** 2
        for gap, expected in ((-1e-9, through), (1e-9, 0.0)):
            beyond = quad((x + 50 + gap, y, 0), (0, 0, 50), (50, 0, 0))
            value = pixel(scene(camera, (plate, GLASS), (beyond, GLOWS), ambient=1.0), max_depth=2)
            assert value == pytest.approx(expected, rel=2 * REL)

    @pytest.mark.parametrize("smooth", [False, True])
    def test_index_one_is_invisible(self, smooth: bool) -> None:
        ball = (icosphere(3), Dielectric(type="dielectric", ior=1.0))
        light = PointLight(position=(1, 5, 4), intensity=30.0)
        camera = PerspectiveCamera(eye=(0, 1.5, 4), target=(0, 0.2, 0), fov=60)
        # The light's shadow of the ball is opaque by decision, so the plane behind is lit by its ambient part only.
        wall = (quad((0.7, 0, -3), (30, 0, 0), (0, 30, 0)), Phong(diffuse=0.0, ambient=(1, 2, 3)))
        with_ball, without = (
            render(
                scene(camera, wall, *more, ambient=1.0, lights=(light,), smooth=smooth), resolution=(40, 40), threads=1
            )
            for more in ([ball], [])
        )
        assert (with_ball.face != without.face).mean() > 0.1
        np.testing.assert_allclose(with_ball.radiance, without.radiance, rtol=REL)

    def test_index_one_is_invisible_where_the_normal_is_at_right_angles_to_the_ray(self) -> None:
        """Interpolated normals need not be the plane's: cos i = 0 is met by rays that do hit."""
        slope = Mesh([[0, -1, -1], [1, 1, -1], [1, 1, 1], [0, -1, 1]], [[0, 1, 2], [0, 2, 3]], normals=[[0, 1, 0]] * 4)
        camera = towards((-3, 0.25, 0.125), (0, 0.25, 0.125))
        value = pixel(scene(camera, (slope, Dielectric(type="dielectric", ior=1.0)), background=(1, 2, 3), smooth=True))
        assert value.tolist() == [1, 2, 3]

    def test_a_furnace_stays_at_radiance_one(self) -> None:
        """Light from everywhere, no absorption: only what is cut at max_depth may be missing, nothing is gained."""
        camera = PerspectiveCamera(eye=(0, 1, 4), target=(0, 0, 0), fov=40)
        for smooth in (False, True):
            what = scene(camera, (icosphere(3), GLASS), background=1.0, smooth=smooth)
            image = render(what, resolution=(24, 24), max_depth=20, threads=1)
            assert image.radiance.max() <= 1 + 2 * REL
            assert np.median(image.radiance[image.face >= 0]) == pytest.approx(1.0, abs=1e-4)


class TestAovs:
    def test_plane_seen_in_perspective(self) -> None:
        camera = PerspectiveCamera(eye=(0.3, 2, 0.1), target=(0.3, 0, 0.1), up=(0, 0, -1), fov=90)
        image = render(scene(camera, (floor(), WHITE)), resolution=(4, 4), threads=1)
        at = (np.arange(4) + 0.5) / 2 - 1
        # At distance 1 the film spans -1 to 1; depth is along the ray, not along the axis.
        expected = 2 * np.sqrt(1 + at[None, :] ** 2 + at[:, None] ** 2)
        np.testing.assert_allclose(image.depth, expected, rtol=1e-14)
        assert (image.normal == [0, 1, 0]).all() and set(image.face.ravel()) <= {0, 1}
        assert image.depth.dtype == np.float64 and image.radiance.dtype == image.normal.dtype == np.float32

    def test_normals_are_the_surfaces_not_the_eyes(self) -> None:
        turned = Mesh(floor().vertices, floor().faces[:, ::-1])
        assert one(scene(FROM_SIDE, (turned, WHITE))).normal.tolist() == [[[0, -1, 0]]]

    def test_smooth_normals_of_a_sphere(self) -> None:
        ball = Mesh(icosphere(4).vertices, icosphere(4).faces, normals=icosphere(4).vertices * 7)
        camera = OrthographicCamera(type="orthographic", eye=(0, 0, 5), target=(0, 0, 0), height=1.5)
        image = render(scene(camera, (ball, WHITE), smooth=True), resolution=(16, 16), threads=1)
        at = (np.arange(16) + 0.5) / 16 * 1.5 - 0.75
        x, y = at[None, :], -at[:, None]
        z = np.sqrt(np.maximum(1 - x**2 - y**2, 0))
        inside = x**2 + y**2 < 0.8
        # Faces of edge h = .08 lie within h^2 / 6 of the sphere, along a ray that meets them at cos >= .4.
        np.testing.assert_allclose(image.depth[inside], (5 - z)[inside], atol=0.08**2 / 6 / 0.4)
        expected = np.stack(np.broadcast_arrays(x, y, z), axis=-1)
        np.testing.assert_allclose(image.normal[inside], expected[inside], atol=0.01)
        np.testing.assert_allclose(np.linalg.norm(image.normal[inside], axis=-1), 1, rtol=4 * REL)

    def test_nothing_of_bounces_in_them(self) -> None:
        wall = quad((0.3, 0.1, 1), (5, 0, 0), (0, 5, 0))
        other = quad((0.3, 0.1, -7), (5, 0, 0), (0, 5, 0))
        what = scene(towards((0, 0, 0), (0, 0, 1)), (wall, Mirror(type="mirror")), (other, GLOWS), ambient=1.0)
        image = one(what)
        assert image.depth[0, 0] == 1.0 and image.face[0, 0] in (0, 1) and image.radiance[0, 0, 0] == 1.0


def mixed(camera: Any = None) -> Scene:
    """Every material, both lights, smooth and flat, on a tiled floor."""
    return Scene(
        camera=camera or PerspectiveCamera(eye=(1, 2.5, 5), target=(0, 0.5, 0), fov=50),
        materials={
            "glass": GLASS,
            "mirror": Mirror(type="mirror", reflectance=0.8),
            "red": Phong(diffuse=(0.7, 0.1, 0.1), specular=0.5, reflectance=0.2, transmittance=0.1),
            "light": Phong(diffuse=0.7),
            "dark": Phong(diffuse=0.1, reflectance=0.1),
        },
        objects=(
            SceneObject(mesh=icosphere(2), material="glass", normals="smooth", scale=0.8, translate=(-0.7, 0.8, 1)),
            SceneObject(mesh=torus(0.8, 0.3, 24, 12), material="red", rotate=(70, 20, 0), translate=(1, 1, -0.6)),
            SceneObject(mesh=box(), material="mirror", translate=(-2, 0.02, -1.5)),
        ),
        floor=Floor(min=(-3, -3), max=(3, 3), squares=(5, 6), materials=("light", "dark")),
        lights=(DirectionalLight(direction=(-0.5, -1, -0.3)), PointLight(position=(1, 3, 2), intensity=5.0)),
        ambient=0.1,
        background=(0.3, 0.5, 0.8),
    )


def assert_same_bits(a: Image, b: Image) -> None:
    for name in ("radiance", "depth", "normal", "face", "rays"):
        assert getattr(a, name).tobytes() == getattr(b, name).tobytes(), name


class TestLaws:
    @cases("offset", ["bounded", "mitsuba"])
    @cases("split", ["midpoint", "sah"])
    def test_the_tree_changes_no_bit(self, split: Any, offset: Any) -> None:
        options: Any = {"resolution": (50, 37), "samples": 4, "offset": offset, "threads": 1}
        brute = render(mixed(), accelerator="brute", **options)
        assert_same_bits(render(mixed(), split=split, **options), brute)
        assert len(np.unique(brute.face)) > 250

    def test_neither_do_threads_or_another_run(self) -> None:
        first = render(mixed(), resolution=(97, 65), threads=1)
        for threads in (1, 2, 5):
            assert_same_bits(render(mixed(), resolution=(97, 65), threads=threads), first)

    def test_four_samples_are_the_mean_of_the_double_resolution(self) -> None:
        """The sample positions are the pixel centres of a picture of twice the size, exactly."""
        four = render(mixed(), resolution=(20, 16), samples=4, threads=1)
        large = render(mixed(), resolution=(40, 32), threads=1)
        blocks = large.radiance.reshape(16, 2, 20, 2, 3).astype(np.float64)
        np.testing.assert_allclose(four.radiance, blocks.mean(axis=(1, 3)), rtol=2 * REL)
        assert (four.rays == large.rays.reshape(16, 2, 20, 2).sum(axis=(1, 3))).all()
        assert (four.face == render(mixed(), resolution=(20, 16), threads=1).face).all()

    @pytest.mark.parametrize("k", [-40, 40])
    def test_a_power_of_two_changes_nothing_but_the_depth(self, k: int) -> None:
        def picture(factor: float) -> Image:
            camera = PerspectiveCamera(eye=(factor, 2 * factor, 3 * factor), target=(0, 0, 0), fov=40)
            ball, plane = (Mesh(m.vertices * factor, m.faces) for m in (icosphere(2), floor(-1.0)))
            light = PointLight(position=(0, 4 * factor, factor), intensity=9.0 * factor**2)
            return render(scene(camera, (ball, GLASS), (plane, WHITE), lights=(light,)),
                          resolution=(24, 24), threads=1)  # fmt: skip

        small, scaled = picture(1.0), picture(2.0**k)
        hit = small.face >= 0
        np.testing.assert_array_equal(scaled.face, small.face)
        np.testing.assert_array_equal(scaled.depth[hit], small.depth[hit] * 2.0**k)
        np.testing.assert_array_equal(scaled.radiance, small.radiance)

    @pytest.mark.parametrize("axis", [0, 1, 2])
    def test_a_mirrored_scene_gives_the_mirrored_picture(self, axis: int) -> None:
        sign = np.ones(3)
        sign[axis] = -1

        def picture(s: np.ndarray) -> Image:
            ball = Mesh(icosphere(2).vertices * s, icosphere(2).faces[:, :: int(s.prod())])
            camera = PerspectiveCamera(eye=tuple(s * (1, 2, 3)), target=(0, 0, 0), up=tuple(s * (0, 1, 0)), fov=50)
            light = PointLight(position=tuple(s * (2, 4, 1)), intensity=9.0)
            plane = Mesh(floor(-1).vertices * s, floor(-1).faces)
            parts = (ball, WHITE), (plane, Phong(reflectance=0.5))
            what = scene(camera, *parts, lights=(light,), background=0.2)
            return render(what, resolution=(24, 24), threads=1)

        plain, mirrored = picture(np.ones(3)), picture(sign)
        np.testing.assert_allclose(mirrored.radiance[:, ::-1], plain.radiance, rtol=4 * REL)


positions = st.tuples(*[st.floats(-3, 3)] * 3)
colors = st.floats(0, 1) | st.tuples(*[st.floats(0, 1)] * 3)
iors = st.sampled_from([1e-3, 0.5, 1.0, 1.0000001, 1.5, 10.0, 1e3])
materials = st.one_of(
    st.builds(
        Phong,
        diffuse=colors,
        specular=colors,
        shininess=st.sampled_from([0.0, 1.0, 30.0, 1e6]),
        reflectance=colors,
        transmittance=colors,
        ior=iors,
    ),
    st.builds(Mirror, type=st.just("mirror"), reflectance=colors),
    st.builds(Dielectric, type=st.just("dielectric"), ior=iors, reflectance=colors, transmittance=colors),
)
lights = st.one_of(
    st.builds(DirectionalLight, direction=positions.filter(any), irradiance=colors),
    st.builds(PointLight, position=positions, intensity=colors),
)
kinds = st.sampled_from(["flat", "smooth"])
meshes = st.sampled_from([icosphere(1), box((-1, -1, -1), (1, 1, 1)), grid(2, 2, (4.0, 4.0)), torus(1, 0.4, 8, 6)])


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_random_scenes_give_finite_pictures_of_equal_bits(data: Any) -> None:
    """No NaN, no infinity, nothing negative, and the octree never differs from brute force."""
    parts = data.draw(st.lists(st.tuples(meshes, materials, positions, kinds), min_size=1, max_size=3))
    what = Scene(
        camera=PerspectiveCamera(eye=data.draw(positions), target=(5, 4, 6), fov=100),
        materials={str(i): m for i, (_, m, _, _) in enumerate(parts)},
        objects=tuple(
            SceneObject(mesh=mesh, material=str(i), translate=at, normals=normals)
            for i, (mesh, _, at, normals) in enumerate(parts)
        ),
        lights=tuple(data.draw(st.lists(lights, max_size=2))),
        ambient=data.draw(colors),
        background=data.draw(colors),
    )
    tree, brute = (render(what, resolution=(6, 5), max_depth=4, accelerator=a, threads=1) for a in ("octree", "brute"))
    assert_same_bits(tree, brute)
    assert np.isfinite(tree.radiance).all() and (tree.radiance >= 0).all() and not np.isnan(tree.depth).any()
    assert np.isfinite(tree.normal).all()

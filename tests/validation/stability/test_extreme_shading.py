"""Extreme cases 33 to 45, 47 and 48; their judges find each broken rule; no picture ever holds a NaN or inf."""

import math
from typing import Any

import numpy as np
import pytest
from cases import cases
from hypothesis import given, settings
from hypothesis import strategies as st

from renderer import Image, Mesh, Scene, render
from renderer.materials.dielectric import Dielectric
from renderer.materials.mirror import Mirror
from renderer.materials.phong import Phong
from renderer.mesh.shapes import box, icosphere, torus
from renderer.scene.camera import PerspectiveCamera
from renderer.scene.light import DirectionalLight, PointLight
from renderer.scene.scene import SceneObject
from renderer.shade.shading import reflect, refract
from renderer.trace.spawn import OffsetRule
from validation.stability.cases.refraction import critical_angle, snell_residual, steep_indices
from validation.stability.cases.scenes import Vector, ball, eye_at, quad, scene_of
from validation.stability.cases.shading import CASES
from validation.stability.cases.spawned import missed_planes, self_hits, wrong_pixels


def test_rows_are_complete() -> None:
    assert [case.number for case in CASES] == [*range(33, 46), 47, 48]


class TestJudgesFindABrokenOffset:
    """The judges of rows 33 and 34, given another rule than the bound."""

    def test_fixed_offset_jumps_through_a_small_ball(self) -> None:
        assert wrong_pixels(1e-6, 8, offset=1e-4) > 0 and wrong_pixels(1e-6, 8) == 0
        assert self_hits(ball(1e-6), 10, OffsetRule(False, 1e-4))[0] > 0

    def test_no_offset_meets_the_same_ball_again(self) -> None:
        for scale in (1e-6, 1.0, 1e6):
            wrong, rays = self_hits(ball(scale), 100, OffsetRule(False, 0.0))
            assert wrong > rays / 10
        assert wrong_pixels(1.0, 16, offset=0.0) > 0

    @pytest.mark.parametrize("offset", [1e-4, "mitsuba"])
    def test_fixed_offset_jumps_the_gap_of_close_planes(self, offset: Any) -> None:
        assert missed_planes(offset) == ["reflected", "refracted", "shadow"]


def textbook(d: Vector, n: Vector, n1: float, n2: float) -> tuple[float, Vector]:
    """Refraction as it is usually printed: cos^2 t = 1 - eta^2 (1 - cos^2 i), t = eta d + (eta cos i - cos t) n."""
    eta, cos_i = n1 / n2, -float(np.dot(d, n))
    cos2 = 1.0 - eta * eta * (1.0 - cos_i * cos_i)
    if cos2 < 0.0:
        return -1.0, d
    cos_t = math.sqrt(cos2)
    x, y, z = (eta * a + (eta * cos_i - cos_t) * b for a, b in zip(d, n, strict=True))
    return cos_t, (x, y, z)


class TestJudgesFindABrokenRefraction:
    """The judges of rows 36 and 37, given another refraction."""

    def test_the_textbook_form_at_the_critical_angle(self) -> None:
        wrong, _, residual = critical_angle(textbook, 20)
        assert wrong > 0 and residual > 4.0

    def test_the_textbook_form_at_steep_indices(self) -> None:
        assert steep_indices(textbook, 5) > 4.0

    def test_the_inverted_law(self) -> None:
        def inverted(d: Vector, n: Vector, n1: float, n2: float) -> tuple[float, Vector]:
            return refract(d, n, n2, n1)

        wrong, _, residual = critical_angle(inverted, 5)
        assert wrong > 0 and residual > 4.0
        assert steep_indices(inverted, 5) > 4.0

    def test_a_nan(self) -> None:
        assert critical_angle(lambda d, n, n1, n2: (math.nan, d), 1)[1] > 0
        assert steep_indices(lambda d, n, n1, n2: (math.nan, d), 1) == math.inf

    def test_residual_by_hand(self) -> None:
        """Sines .6 and .8: 4 u * .6 - 3 u * .8 vanishes; with equal indices .2 is left."""
        d, t, n = (0.6, -0.8, 0.0), (0.8, -0.6, 0.0), (0.0, 1.0, 0.0)
        assert snell_residual(d, n, t, 4.0, 3.0) < 1.0
        assert snell_residual(d, n, t, 1.0, 1.0) == pytest.approx(0.2 * 2.0**53, rel=1e-12)


@pytest.mark.parametrize("count", [8, 9, 10])
def test_eight_media_are_remembered(count: int) -> None:
    """A ninth is left into the eighth, as it was entered. A tenth in it is entered from the eighth, not the ninth."""
    indices = [1.0, *(1.1 + 0.15 * k for k in range(count))]
    parts = [
        (box((-k, -k, -k), (k, k, k)), Dielectric(type="dielectric", ior=ior, reflectance=0.0))
        for k, ior in zip(range(count, 0, -1), indices[1:], strict=True)
    ]
    scene = scene_of(eye_at((-2 * count, 0.2, 0.3), (0, 0.2, 0.3)), *parts, background=1.0)
    value = float(render(scene, resolution=(1, 1), max_depth=2 * count + 1, threads=1).radiance[0, 0, 0])
    # Each surface is passed on the way in and on the way out.
    crossed = [(indices[min(k, 8)], indices[k + 1]) for k in range(count)]
    expected = math.prod((1 - ((a - b) / (a + b)) ** 2) ** 2 for a, b in crossed)
    assert value == pytest.approx(expected, rel=2.0**-23)


def expect_finite(image: Image) -> None:
    """Finite light everywhere; depth and normal of a hit finite, and of a miss as documented."""
    hit = image.face >= 0
    assert np.isfinite(image.radiance).all() and (image.radiance >= 0.0).all()
    assert np.isfinite(image.depth[hit]).all() and (image.depth[hit] >= 0.0).all()
    # Unit to float32's rounding, or zero where interpolated normals cancel.
    assert (np.linalg.norm(image.normal[hit].astype(np.float64), axis=-1) <= 1.0 + 2.0**-22).all()
    assert np.isposinf(image.depth[~hit]).all() and (image.normal[~hit] == 0.0).all()


unit_color = st.floats(0.0, 1.0)
indices = st.one_of(st.sampled_from([1.0, 1.5, 1e-3, 1e3]), st.floats(-3, 3).map(lambda x: 10.0**x))
shininess = st.one_of(st.sampled_from([0.0, 1.0, 1e6]), st.floats(0.0, 1e6))


@st.composite
def phongs(draw: Any) -> Phong:
    # k_r + k_t <= 1, so that min_weight bounds the number of rays in a generation.
    reflectance = draw(unit_color)
    return Phong(
        diffuse=draw(unit_color),
        specular=draw(unit_color),
        shininess=draw(shininess),
        reflectance=reflectance,
        transmittance=draw(unit_color) * (1.0 - reflectance),
        ior=draw(indices),
    )


materials = st.one_of(
    phongs(),
    unit_color.map(lambda k: Mirror(type="mirror", reflectance=k)),
    indices.map(lambda n: Dielectric(type="dielectric", ior=n)),
)


@st.composite
def meshes(draw: Any) -> Mesh:
    """Closed ones, nested at random; soups with slivers and faces of no area."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    kind = draw(st.sampled_from(["ball", "box", "torus", "soup", "quad"]))
    if kind == "soup":
        vertices = rng.normal(size=(12, 3)) * 10.0 ** rng.uniform(-8, 0, (12, 1))
        return Mesh(vertices, rng.integers(0, 12, (20, 3)))
    if kind == "quad":
        return quad(np.round(rng.normal(size=3), 1), *np.round(rng.normal(size=(2, 3)), 1))
    shape = {"ball": icosphere(1), "box": box((-1, -1, -1), (1, 1, 1)), "torus": torus(1, 0.4, 8, 6)}[kind]
    size, centre = 10.0 ** rng.uniform(-1, 0.5), rng.normal(size=3) * draw(st.sampled_from([0.0, 0.5]))
    return Mesh(shape.vertices * size + centre, shape.faces)


@st.composite
def scenes(draw: Any) -> Scene:
    """Anything valid at a scale from 1e-6 to 1e6: eye and lights anywhere, on vertices, just off them, inside."""
    scale = 10.0 ** draw(st.integers(-6, 6))
    shift = np.array([1.0, 2.0, -3.0]) * draw(st.sampled_from([0.0, 1.0, 1e3]))
    shapes = draw(st.lists(meshes(), min_size=1, max_size=4))
    placed = [Mesh((m.vertices + shift) * scale, m.faces) for m in shapes]
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    vertices = np.concatenate([m.vertices for m in placed])

    def spot() -> tuple[float, float, float]:
        on = vertices[rng.integers(len(vertices))]
        free = (rng.normal(size=3) * 3 + shift) * scale
        gap = draw(st.sampled_from([0.0, 1e-15, 1e-9, 1e-3]))
        x, y, z = free if draw(st.booleans()) else on + gap * scale * rng.normal(size=3)
        return float(x), float(y), float(z)

    lights: list[Any] = [DirectionalLight(direction=tuple(rng.normal(size=3).tolist()), irradiance=2.0)]
    lights += [PointLight(position=spot(), intensity=scale**2) for _ in range(draw(st.integers(0, 3)))]
    x, y, z = ((rng.normal(size=3) * 0.3 + shift) * scale).tolist()
    return Scene(
        camera=PerspectiveCamera(eye=spot(), target=(x, y, z), up=(0.3, 1.0, 0.2), fov=60.0),
        materials={f"m{i}": draw(materials) for i in range(len(placed))},
        objects=tuple(
            SceneObject(mesh=m, material=f"m{i}", normals=draw(st.sampled_from(["flat", "smooth"])))
            for i, m in enumerate(placed)
        ),
        lights=tuple(lights),
        ambient=draw(unit_color),
        background=draw(unit_color),
    )


@settings(max_examples=50)
@given(scenes(), st.integers(0, 64), st.sampled_from([0.01, 0.1]), st.sampled_from(["bounded", "mitsuba", 0.0]))
def test_no_picture_holds_a_nan_or_inf(scene: Scene, max_depth: int, min_weight: float, offset: Any) -> None:
    expect_finite(
        render(
            scene, resolution=(6, 6), max_depth=max_depth, min_weight=min_weight, offset=offset, threads=1, samples=4
        )
    )


@pytest.mark.filterwarnings("ignore::renderer.SceneWarning")
@pytest.mark.parametrize("ambient", [0.0, 1.0])
def test_weights_that_overflow_make_no_nan(ambient: float) -> None:
    """Reflectances may exceed 1: after eleven bounces the weight is beyond float64, and 0 times it still 0 or more."""
    walls = [quad((0.3, 0.1, z), (5, 0, 0), (0, 5, 0)) for z in (-1.0, 1.0)]
    gains = Phong(diffuse=0.0, ambient=1.0, reflectance=1e30)
    scene = scene_of(eye_at((0, 0, 0), (0, 0, 1)), *((w, gains) for w in walls), ambient=ambient)
    expect_finite(render(scene, resolution=(1, 1), max_depth=64, threads=1))


@cases("diffuse", [0.0, 1.0, (1.0, 0.0, 0.0)])
@cases("intensity", [1e30, 1e300])
def test_light_that_overflows_makes_no_nan(diffuse: Any, intensity: float) -> None:
    """A lamp of any brightness next to a wall that reflects some channels and others not."""
    wall = quad((0.3, 0.1, 1.0), (5, 0, 0), (0, 5, 0))
    lamp = PointLight(position=(0.0, 0.0, 1.0 - 1e-9), intensity=intensity)
    shiny = Phong(diffuse=diffuse, specular=(0.0, 1.0, 0.0))
    scene = scene_of(eye_at((0, 0, 0), (0, 0, 1)), (wall, shiny), lights=(lamp,))
    expect_finite(render(scene, resolution=(1, 1), threads=1))


def test_reflection_keeps_its_length_at_any_angle() -> None:
    """A host of mirrors at 64 bounces multiplies any drift of the direction's length."""
    d: Vector = (0.6, -0.8, 0.0)
    for i in range(1000):
        angle = 0.1 * i
        d = reflect(d, (math.cos(angle), math.sin(angle), 0.0))
    # Eight roundings a step, as in the test of ``reflect``; they add up at worst.
    assert abs(math.hypot(*d) - 1.0) <= 8 * 1000 * 2.0**-53

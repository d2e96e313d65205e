"""Extreme cases 41 to 45: facing mirrors, branching rays, highlights, lights on and under surfaces."""

import math

import numpy as np

from renderer import Mesh, Octree, Scene
from renderer.materials.phong import Phong, specular
from renderer.scene.light import DirectionalLight, Light, PointLight
from validation.references.mitsuba.whitted import whitted
from validation.stability.cases.case import ExtremeCase, Outcome
from validation.stability.cases.scenes import (
    REL,
    STORED,
    WHITE,
    U,
    close,
    eye_at,
    level,
    one,
    pixel,
    quad,
    scene_of,
    unit,
    vector,
)


def _facing_mirrors(k_r: float) -> Scene:
    material = Phong(diffuse=0.0, ambient=1.0, reflectance=k_r)
    walls = [quad((0.3, 0.1, z), (5, 0, 0), (0, 5, 0)) for z in (-1.0, 1.0)]
    return scene_of(eye_at((0, 0, 0), (0, 0, 1)), *((wall, material) for wall in walls))


def _mirrors(quick: bool) -> Outcome:
    values = [
        pixel(_facing_mirrors(0.9), max_depth=64),
        pixel(_facing_mirrors(0.9), max_depth=64, min_weight=0.01),
        pixel(_facing_mirrors(1.0), max_depth=64),
    ]
    # .9^43 = .01077 is the last weight of at least .01, so 44 terms.
    expected = [(1 - 0.9**65) / 0.1, (1 - 0.9**44) / 0.1, 65.0]
    theirs = [whitted(_facing_mirrors(k), 1, 1, max_depth=64)[0, 0, 0] for k in (0.9, 1.0)]
    ours = "{:.5f} L; {:.4f} L; {:g} L".format(*values)
    holds = all(close(a, b) for a, b in zip(values, expected, strict=True))
    return Outcome(ours, holds, mitsuba="{:.5f} L; no min_weight; {:g} L".format(*theirs))


def _branching(quick: bool) -> Outcome:
    panes = [quad((0.3, 0.1, z), (5, 0, 0), (0, 5, 0)) for z in range(-15, 15)]
    material = Phong(diffuse=0.0, ambient=1.0, reflectance=0.5, transmittance=0.5, ior=1.0)
    scene = scene_of(eye_at((0, 0, 0.5), (0, 0, 2)), (Mesh.concatenate(panes), material))
    image = one(scene, max_depth=64, min_weight=1e-4)
    rays, value = int(image.rays[0, 0]), float(image.radiance[0, 0, 0])
    # 2^-13 is the last weight of at least 1e-4: 14 generations, each of total weight 1.
    return Outcome(f"{rays} rays, {value:g} L", rays == 2**14 - 1 and close(value, 14.0))


def _highlights(quick: bool) -> Outcome:
    wrong = 0
    half = math.pi / 4
    for shininess in (0.0, 1.0, 1e6):
        material = Phong(diffuse=0.0, ambient=0.0, specular=1.0, shininess=shininess)
        for off in (0.0, 1e-6, 1e-3, 2e-3, 0.1, half, math.pi / 2 - 1e-3):
            light = DirectionalLight(direction=(math.sin(half + off), -math.cos(half + off), 0.0))
            if off > half - 1e-9:  # the light would be below; on the other side R.V = cos(off) too
                light = DirectionalLight(direction=(math.sin(half - off), -math.cos(half - off), 0.0))
            value = pixel(scene_of(eye_at((1, 1, 0), (0, 0, 0)), (level(3, 0, 1), material), lights=(light,)))
            # The angle errs by 2 u, cos^n relatively by n tan(off) times that, and the lobe by 16 u (n + 2).
            bound = REL + U * (16 * (shininess + 2) + 4 * shininess * math.tan(off))
            wrong += not abs(value - math.cos(off) ** shininess) <= bound
        # R.V below 0, and 0 itself, from eyes low above the plane.
        behind = DirectionalLight(direction=(-0.8, -0.6, 0.0))
        value = pixel(scene_of(eye_at((8, 1, 0), (0, 0, 0)), (level(3, 0, 1), material), lights=(behind,)))
        wrong += value != 0.0
        wrong += specular((-1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 1.0, 0.0), shininess) != 0.0
    return Outcome(f"{wrong} of 27 wrong", wrong == 0)


def _lights_on_surfaces(quick: bool) -> Outcome:
    rng = np.random.default_rng(44)
    brighter = pictures = 0
    material = Phong(diffuse=0.5, ambient=0.25, specular=1.0, shininess=0.0)
    for scale in (1e-6, 1.0, 1e6):
        for _ in range(20 if quick else 500):
            a = rng.normal(size=3)
            b = np.cross(a, rng.normal(size=3))
            plane = quad(rng.normal(size=3) * scale, a * scale, b * scale)
            n = vector(unit(np.cross(a, b)))
            inner = plane.vertices[0] + 0.4 * (plane.vertices[2] - plane.vertices[0])
            eye = vector(inner + scale * (np.array(n) + 0.3 * a))
            camera = eye_at(eye, vector(inner), up=vector(a), fov=30)
            way = camera.frame()[2]
            point = Octree.from_mesh(plane, threads=1).closest_hit([eye], [way]).points[0]
            for below in (0.0, 1e-12, 1e-6, 1.0):
                light = PointLight(position=vector(point - below * scale * np.array(n)))
                value = pixel(scene_of(camera, (plane, material), lights=(light,)))
                brighter, pictures = brighter + (value != 0.25), pictures + 1
    return Outcome(f"{pictures - brighter} of {pictures} ambient only", brighter == 0)


def _lit(light: Light, *blockers: Mesh) -> bool:
    eye = eye_at((0.3, 0.1, 0.0), (0.0, 0.0, 0.0))
    value = pixel(scene_of(eye, (level(3, 0, 1), WHITE), *((b, WHITE) for b in blockers), lights=(light,)))
    if value not in (0.0, 1.0):
        raise ValueError(f"a picture of 0 or 1 expected, got {value}")
    return value == 1.0


def _shadow_rays(quick: bool) -> Outcome:
    wrong = []
    sun, lamp = DirectionalLight(direction=(0, -1, 0)), PointLight(position=(0, 2, 0), intensity=4.0)
    for height, half in ((1.0, 0.2), (1e3, 0.2), (1e6, 0.2), (1e9, 10.0), (-1.0, 0.2)):
        if _lit(sun, level(0, height, 0, half)) != (height < 0):
            wrong.append(f"directional, occluder at {height:g}")
    for gap in (1e-12, 1e-9, 1e-6, 0.5, 1e3):
        if not _lit(lamp, level(0, 2 + gap, 0, 0.2)):
            wrong.append(f"point light, occluder {gap:g} past it")
    for gap in (1e-9, 1e-6, 1e-3, 1.0):
        if _lit(lamp, level(0, 2 - gap, 0, 0.2)):
            wrong.append(f"point light, occluder {gap:g} before it")
    return Outcome("; ".join(wrong) if wrong else "stops at the light in all 14", not wrong)


CASES: tuple[ExtremeCase, ...] = (
    ExtremeCase(
        41,
        "two facing mirrors, k_r = .9, depth 64, local L each; with min_weight .01; with k_r = 1",
        "9.98939 L; 9.9030 L; 65 L",
        ("closed form",),
        STORED,
        _mirrors,
    ),
    ExtremeCase(
        42,
        "k_r = k_t = .5 between 30 panes, depth 64, min_weight 1e-4",
        "ends after 2^14 - 1 rays, 14 L",
        ("closed form",),
        "exact count; " + STORED,
        _branching,
    ),
    ExtremeCase(
        43,
        "shininess 0, 1, 1e6; R.V <= 0",
        "cos^n; 0 for R.V <= 0",
        ("closed form",),
        "2^-23 for float32, and u (16 (n + 2) + 4 n tan): |R - V|^2 and the angle err by some u, the power by n of it",
        _highlights,
    ),
    ExtremeCase(
        44,
        "point light at the hit point, or below the surface, scales 1e-6 to 1e6",
        "ambient only",
        ("rule",),
        "exact: a light within rounding of a surface does not light it",
        _lights_on_surfaces,
    ),
    ExtremeCase(
        45,
        "directional light; point light with an occluder 1e-12 to 1e3 past it and 1e-9 to 1 before it",
        "the shadow ray stops at the light",
        ("closed form",),
        "exact: lit or not; shadow rays end 2^-36 = 1.5e-11 of the way before the light",
        _shadow_rays,
    ),
)

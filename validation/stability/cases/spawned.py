"""Extreme cases 33 and 34: rays that leave a surface neither hit it again nor jump over its neighbour.

The judges take the offset rule as an argument, so that the tests can pass one that must fail.
"""

from typing import Literal

import numpy as np

from renderer import Mesh, Octree, Scene, render
from renderer.materials.phong import Phong
from renderer.mesh.shapes import icosphere
from renderer.scene.light import DirectionalLight
from renderer.shade.shading import reflect, refract
from renderer.trace.spawn import BOUNDED, OffsetRule, facet_of, offset_distance, spawn_origin
from validation.references.mitsuba.whitted import whitted
from validation.stability.cases.case import ExtremeCase, Outcome
from validation.stability.cases.scenes import (
    GLOWS,
    MIRROR,
    WHITE,
    Vector,
    ball,
    eye_at,
    level,
    pixel,
    scene_of,
    unit,
    vector,
)

# The offset rule as ``render`` takes it.
Rule = Literal["bounded", "mitsuba"] | float

_SCALES = tuple(10.0**k for k in range(-6, 7))
_CLEAR = Phong(diffuse=0.0, ambient=1.0, transmittance=1.0, ior=1.5)


def _prism(sides: int = 512, half: float = 500.0) -> Mesh:
    """A long convex prism about the z axis: sides of aspect 1e5, caps that are fans of slivers."""
    angle = np.arange(sides) * (2 * np.pi / sides)
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    ends = [np.column_stack([ring, np.full(sides, z)]) for z in (-half, half)]
    i = np.arange(sides)
    j = (i + 1) % sides
    fan = np.arange(1, sides - 1)
    walls = [np.stack([i, j, j + sides], 1), np.stack([i, j + sides, i + sides], 1)]
    caps = [np.stack([0 * fan, fan + 1, fan], 1), np.stack([0 * fan, fan, fan + 1], 1) + sides]
    return Mesh(np.concatenate(ends), np.concatenate(walls + caps).astype(np.int32))


def self_hits(mesh: Mesh, count: int, offset: OffsetRule = BOUNDED) -> tuple[int, int]:
    """Spawn rays at ``count`` hits from outside and ``count`` from inside of a convex mesh: (wrong ones, all).

    A ray spawned outwards must hit nothing; one spawned inwards must leave through a face that points its way. Each is
    traced twice: from the offset start of pictures, and as ``leaving`` its face from the hit point.
    """
    # Trace rays inwards from outside, and outwards from inside.
    rng = np.random.default_rng(33)
    octree = Octree.from_mesh(mesh, threads=1)
    middle, size = (mesh.bounds[0] + mesh.bounds[1]) / 2, mesh.extent
    within = middle + 0.25 * size * rng.uniform(-1, 1, (2 * count, 3))
    afar = middle + 3.0 * size * unit(rng.normal(size=(2 * count, 3)))
    origins = np.concatenate([afar[:count], within[count:]])
    directions = unit(np.concatenate([within[:count] - afar[:count], afar[count:] - within[count:]]))
    hits = octree.closest_hit(origins, directions)
    corners = mesh.triangles[hits.face]
    normals, points, lost = hits.normals, hits.points, int((~hits.hit).sum())

    # Spawn a reflected, a shadow and, without total reflection, a refracted ray at each hit.
    starts: list[Vector] = []
    ways: list[Vector] = []
    outwards: list[bool] = []
    rows: list[int] = []
    for i in np.flatnonzero(hits.hit):
        n_g, p, d = vector(normals[i]), vector(points[i]), vector(directions[i])
        p0, p1, p2 = (vector(q) for q in corners[i])
        error, _ = offset_distance(p, p0, p1, p2, float(hits.u[i]), float(hits.v[i]), facet_of(p0, p1, p2, d))
        enters = float(np.dot(n_g, d)) < 0.0
        n = n_g if enters else vector(-normals[i])
        shadow = rng.normal(size=3)
        cos_t, through = refract(d, n, *((1.0, 1.5) if enters else (1.5, 1.0)))
        back = [reflect(d, n), vector(shadow if np.dot(shadow, n) > 0.0 else -shadow)]
        for w in back + [through] * (cos_t >= 0.0):
            starts.append(spawn_origin(p, error, n_g, w, offset))
            ways.append(w)
            rows.append(int(i))
            outwards.append(float(np.dot(n_g, w)) > 0.0)

    # Trace the spawned rays from both starts and count the wrong ones.
    wrong = 0
    for spawned in (octree.closest_hit(starts, ways), octree.closest_hit(points[rows], ways, leaving=hits.face[rows])):
        facing = np.einsum("nk,nk->n", np.nan_to_num(spawned.normals, nan=-1.0), np.array(ways)) > 0.0
        wrong += int(np.where(outwards, spawned.hit, ~(spawned.hit & facing)).sum())
    return lost + wrong, 2 * len(ways)


def ball_pictures(scale: float) -> tuple[Scene, Scene]:
    """A mirror under a sky of 1, and a clear ball whose front and far side add 1 each: the pixels must be 1 and 2."""
    camera = eye_at((3 * scale, scale, 2 * scale), (0, 0, 0), fov=30)
    return scene_of(camera, (ball(scale), MIRROR), background=1.0), scene_of(camera, (ball(scale), _CLEAR))


def wrong_pixels(scale: float, side: int, offset: Rule = "bounded") -> int:
    """Number of pixels of ``ball_pictures`` with a wrong value."""
    wrong = 0
    for scene, value in zip(ball_pictures(scale), (1.0, 2.0), strict=True):
        image = render(scene, resolution=(side, side), max_depth=1, threads=1, offset=offset)
        wrong += int((image.radiance[image.face >= 0] != value).sum())
    return wrong


def _spawned_rays(quick: bool) -> Outcome:
    bad = rays = pixels = 0
    for scale in _SCALES:
        for mesh, shift in ((icosphere(3), 0.0), (icosphere(3), 10.0), (_prism(), 0.0), (_prism(), 10.0)):
            convex = Mesh((mesh.vertices + shift) * scale, mesh.faces)
            found = self_hits(convex, 20 if quick else 1000)
            bad, rays = bad + found[0], rays + found[1]
        pixels += wrong_pixels(scale, 16 if quick else 64)
    theirs = []
    for scale in (1e-5, 1.0, 1e5):
        mirror, clear = (whitted(s, 8, 8, max_depth=1)[..., 0] for s in ball_pictures(scale))
        seen = render(ball_pictures(scale)[0], resolution=(8, 8), threads=1).face >= 0
        wrong = int((seen & (mirror != 1.0)).sum()), int((seen & (clear == 1.0)).sum())
        theirs.append(f"{scale:g}: {wrong[0]} self-hits, {wrong[1]} of {seen.sum()} refracted rays jump through")
    ours = f"{bad} wrong of {rays} rays, {pixels} wrong pixels"
    return Outcome(ours, bad == 0 and pixels == 0, mitsuba="; ".join(theirs))


def close_planes() -> dict[str, tuple[Scene, float]]:
    """Two planes 1e-3 apart at 100; a reflected, a refracted and a shadow ray must hit the second: scene, radiance."""
    lower, upper = level(103.0, 100.0, 101.0), level(103.0, 100.001, 101.0)
    between = eye_at((100.001, 100.0005, 100.0), (100.0, 100.0, 100.0), fov=3)
    above = eye_at((101.0, 101.0, 100.0), (100.0, 100.0, 100.0), fov=3)
    sun = DirectionalLight(direction=(0.0, -1.0, 0.0))
    pane = Phong(diffuse=0.0, ambient=0.0, transmittance=1.0, ior=1.5)
    return {
        "reflected": (scene_of(between, (lower, MIRROR), (upper, GLOWS)), 1.0),
        "refracted": (scene_of(above, (upper, pane), (lower, GLOWS)), 1.0),
        "shadow": (scene_of(between, (lower, WHITE), (upper, WHITE), lights=(sun,)), 0.0),
    }


def missed_planes(offset: Rule = "bounded") -> list[str]:
    """Kinds of ray that miss the second plane of ``close_planes``."""
    found = close_planes().items()
    return [kind for kind, (scene, value) in found if pixel(scene, max_depth=1, offset=offset) != value]


def _close_planes(quick: bool) -> Outcome:
    missed = missed_planes()
    found = close_planes().items()
    theirs = [kind for kind, (s, value) in found if abs(whitted(s, 1, 1, max_depth=1)[0, 0, 0] - value) > 0.5]
    return Outcome(_misses(missed), not missed, mitsuba=_misses(theirs))


def _misses(kinds: list[str]) -> str:
    return f"missed by {', '.join(kinds)}" if kinds else "hit by reflected, refracted and shadow rays"


CASES: tuple[ExtremeCase, ...] = (
    ExtremeCase(
        33,
        "reflected, refracted and shadow rays off a convex mesh and a slivery one, scales 1e-6 to 1e6",
        "0 self-hits, nothing jumped",
        ("closed form",),
        "exact: a convex mesh is hit once from outside and once from inside",
        _spawned_rays,
    ),
    ExtremeCase(
        34,
        "planes 1e-3 apart at p = 100",
        "reflected, refracted and shadow rays hit the second plane",
        ("closed form",),
        "exact: radiance is 0 or 1",
        _close_planes,
    ),
)

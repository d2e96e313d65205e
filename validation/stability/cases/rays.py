"""Extreme cases 1 to 11: rays that are hard to trace."""

from collections.abc import Callable
from itertools import product

import numpy as np
from numpy.typing import NDArray

from renderer import Mesh, Octree
from renderer.mesh.shapes import box, grid, icosphere
from validation.hits.rays import RayFamily, float32_exact, leak_rays
from validation.hits.watertight import leaks
from validation.meshes import integer_box
from validation.oracle.exact import FLOAT64_ROUNDOFF
from validation.oracle.rounding import RayView
from validation.promises.refused import refused
from validation.stability.cases.case import ExtremeCase, Outcome
from validation.stability.cases.judgement import (
    FIRST_FACE,
    SEED,
    against_exact,
    as_exact,
    both_modes,
    closest,
    embree_says,
    float32_mesh,
    hits_in_words,
    octrees,
    of,
    one_t,
    ray_batch,
    same_bits,
)

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


def _leaks(kind: int) -> Callable[[bool], Outcome]:
    """Leaks of rays aimed in full float64.

    A direction rounded to float32 would pass an edge at a distance that float64 resolves.
    """

    def run(quick: bool) -> Outcome:
        mesh = float32_mesh(icosphere(5))
        rays = leak_rays(mesh.vertices, mesh.faces, 100_000 if quick else 1_000_000, SEED)[kind]
        octree = Octree.from_mesh(mesh)
        lost = leaks(octree, rays)

        def say(t: Floats, face: Ints) -> str:
            return of(face < 0, "leak")

        return Outcome(f"{lost:,} leaks of {len(rays):,}", lost == 0, *embree_says(mesh, rays, say))

    return run


def _embrees_leak(quick: bool) -> Outcome:
    mesh = float32_mesh(icosphere(5))
    origin = (0.00018042983720079064, 0.02342480793595314, 0.03288514167070389)
    rays = ray_batch(origin, (-0.17487755417823792, 0.9636120200157166, -0.20216260850429535))
    hits = closest(Octree.from_mesh(mesh), rays)
    holds = as_exact(against_exact(mesh, rays, hits)) and abs(float(hits.t[0]) - 0.98341822) <= 5e-9
    return Outcome(one_t(hits.t, hits.face), holds, *embree_says(mesh, rays, one_t))


def _integer_box(quick: bool) -> Outcome:
    rng, count = np.random.default_rng(SEED), 2_000 if quick else 20_000
    origins, axis = rng.integers(1, 16, (count, 3)) / 2, rng.integers(0, 3, count)
    targets = rng.integers(0, 17, (count, 3)) / 2
    targets[np.arange(count), axis] = rng.choice([0.0, 8.0], count)
    directions = targets - origins
    # Where the longest component is a power of two, the kernel rounds nothing.
    unrounded = np.frexp(np.abs(directions).max(axis=1))[0] == 0.5

    def say(t: Floats, face: Ints) -> str:
        return f"t == 1 on {(t == 1).sum():,}, |t - 1| <= {np.abs(t - 1).max():.0e}"

    whole, holds, equal, largest, texts = integer_box(), True, 0, 0.0, []
    for shift in (0.0, 2.0**20):
        mesh, rays = Mesh(whole.vertices + shift, whole.faces), ray_batch(origins + shift, directions)
        hits = closest(Octree.from_mesh(mesh), rays)
        errors = against_exact(mesh, rays, hits)
        holds &= as_exact(errors) and errors.hits == count and bool((hits.t[unrounded] == 1).all())
        equal, largest = equal + int((hits.t == 1).sum()), max(largest, float(np.abs(hits.t - 1).max()))
        texts.append(embree_says(mesh, rays, say))
    ours = f"t == 1 on {equal:,} of {2 * count:,}, all {2 * unrounded.sum():,} unrounded; |t - 1| <= {largest:.1e}"
    return Outcome(ours, holds, *(f"{a}; shifted {b}" for a, b in zip(*texts, strict=True)))


def _grid_vertices(quick: bool) -> Outcome:
    flat = grid(32, 32, (32.0, 32.0))
    mesh = Mesh(flat.vertices[:, [0, 2, 1]], flat.faces)
    rays = ray_batch(mesh.vertices + np.array([0, 0, 5]), (0, 0, -1))
    hits = closest(Octree.from_mesh(mesh), rays)
    holds = len(rays) == 1089 and bool((hits.t == 5).all())
    return Outcome(f"{of(hits.hit)}, t == 5 on {(hits.t == 5).sum():,}", holds, *embree_says(mesh, rays, hits_in_words))


def _box_edge(quick: bool) -> Outcome:
    rays = ray_batch((1, 0.5, -1), [(-0.0, 0, 1), (0.0, 0, 1), (-0.0, -0.0, 1)])
    trees = octrees(box())
    t = np.stack([closest(tree, rays).t for tree in trees])
    return Outcome(f"t = {t[0, 0]:.8g}", bool((t == 1).all()), *embree_says(box(), rays, one_t))


def _beside_box(quick: bool) -> Outcome:
    beside = float(np.nextafter(np.float32(1), np.float32(2)))  # prints as 1.0000001
    rays = ray_batch([(beside, 0.5, -1), (1.0000001, 0.5, -1), (np.nextafter(1.0, 2.0), 0.5, -1)], (0, 0, 1))
    missed = [~closest(tree, rays).hit for tree in octrees(box())]
    return Outcome(of(missed[0], "missed"), bool(np.all(missed)), *embree_says(box(), rays.select([0]), one_t))


def _denormal_direction(quick: bool) -> Outcome:
    mesh, rng = float32_mesh(icosphere(3)), np.random.default_rng(SEED)
    origins = float32_exact(np.column_stack([rng.uniform(-0.7, 0.7, (1000, 2)), np.full(1000, 3.0)]))
    tilted, straight = ray_batch(origins, float32_exact((1e-42, 0, -1))), ray_batch(origins, (0, 0, -1))
    octree = Octree.from_mesh(mesh)
    hits = closest(octree, tilted)
    same = same_bits(hits, closest(octree, straight)) & hits.hit
    holds = bool(same.all()) and as_exact(against_exact(mesh, tilted, hits))
    alike = [
        e.closest_hit(origins, tilted.directions)[0] == e.closest_hit(origins, straight.directions)[0]
        for e in both_modes(mesh)
    ]
    return Outcome(of(same, "as (0,0,-1)"), holds, *(of(row, "as (0,0,-1)") for row in alike))


def _in_plane(quick: bool) -> Outcome:
    """Rays in a triangle's plane must miss where nothing rounds; elsewhere a hit must be one that rounding permits.

    Nothing rounds in a plane x = c, nor where the longest component of d is a power of two. Elsewhere float64 cannot
    decide whether the ray lies in the plane.
    """
    rng = np.random.default_rng(SEED)
    unrounded, hit, theirs, sound = [], [], [], True
    for case in range(60 if quick else 600):
        corners = rng.integers(-8, 9, (3, 3)).astype(float)
        if case % 2 == 0:
            corners[:, case // 2 % 3] = 3
        p, along, across = corners[0], corners[1] - corners[0], corners[2] - corners[0]
        if not np.cross(along, across).any():
            continue
        a = rng.integers(-4, 5, (40, 4))
        target, d = p + a[:, :1] * along + a[:, 1:2] * across, a[:, 2:3] * along + a[:, 3:] * across
        some = d.any(axis=1)
        rays, mesh = ray_batch((target - d)[some], d[some]), Mesh(corners, FIRST_FACE)
        hits = closest(Octree.from_mesh(mesh), rays)
        power = np.frexp(np.abs(rays.directions).max(axis=1))[0] == 0.5
        unrounded.append(power | (case % 2 == 0))
        hit.append(hits.hit)
        theirs.append([e.closest_hit(rays.origins, rays.directions)[1] >= 0 for e in both_modes(mesh)])
        sound &= not np.isnan(hits.t).any()
        sound &= all(_permitted(mesh, rays, row, float(hits.t[row])) for row in np.flatnonzero(hits.hit).tolist())
    strict, hits_in_all = np.concatenate(unrounded), np.concatenate(hit)
    ours = f"{of(hits_in_all[strict])} where nothing rounds; else {of(hits_in_all[~strict])}, by rounding"
    default, robust = np.concatenate(theirs, axis=1)
    return Outcome(ours, sound and not hits_in_all[strict].any(), of(default), of(robust))


def _permitted(mesh: Mesh, rays: RayFamily, row: int, t: float) -> bool:
    origin, direction = tuple(rays.origins[row].tolist()), tuple(rays.directions[row].tolist())
    return RayView(mesh.vertices, mesh.faces.astype(np.int64), origin, direction, FLOAT64_ROUNDOFF).is_permitted(t, 0)


def _bad_rays(quick: bool) -> Outcome:
    octree, row, caught = Octree.from_mesh(box()), 3, []
    # Few rays and many rays use different kernels.
    for argument, value, count in product(("origins", "directions"), (np.nan, np.inf, -np.inf, 0.0), (5, 50)):
        if argument == "origins" and value == 0.0:
            continue
        arrays = {"origins": np.ones((count, 3)), "directions": np.ones((count, 3))}
        if value == 0.0:
            arrays[argument][row] = 0.0
        else:
            arrays[argument][row, 1] = value
        for query in (octree.closest_hit, octree.any_hit):
            said = refused(query, arrays["origins"], arrays["directions"]) or ""
            caught.append(said.startswith(f"{argument}: ") and said.endswith(f"in row {row}"))
    return Outcome(of(caught, "rejected by argument and row"), all(caught))


def _on_surface(quick: bool) -> Outcome:
    """The documented rule: the interval [t_min, t_max] is closed, so a ray that starts on a face hits it at 0."""
    octree = Octree.from_mesh(box((0, 0, 0), (8, 8, 8)))
    ray = ([[3.25, 2.5, 0]], [[0, 0, 1]])
    least = float(np.nextafter(0.0, 1.0))
    found = [
        octree.closest_hit(*ray, t_min=low, t_max=high).t[0]
        for low, high in ((0, np.inf), (0, 0), (least, np.inf), (8, 8), (least, np.nextafter(8, 0)))
    ]
    outwards = octree.closest_hit(ray[0], [[0, 0, -1]]).t[0]
    ours = f"t = {found[0]:g}; t_min > 0: t = {found[2]:g}"
    rays = ray_batch(*ray)
    return Outcome(ours, [*found, outwards] == [0, 0, 8, 8, np.inf, 0], *embree_says(octree.mesh, rays, one_t))


CASES: tuple[ExtremeCase, ...] = (
    ExtremeCase(
        1, "icosphere 5 from inside, rays at edges", "0 leaks", ("closed form",), "none: a closed mesh has no holes",
        _leaks(0),
    ),
    ExtremeCase(
        2, "icosphere 5 from inside, rays at vertices", "0 leaks", ("closed form",), "none: a closed mesh has no holes",
        _leaks(1),
    ),
    ExtremeCase(
        3, "float32 icosphere 5, a ray that Embree robust lets through", "t = 0.98341822", ("exact",),
        "the derived bound of t, and half a unit of the eighth digit", _embrees_leak,
    ),
    ExtremeCase(
        4, "integer box [0,8]^3 of unit quads, d = target - o, also shifted by 2^20", "t == 1",
        ("closed form", "exact"),
        "none where |d|'s largest component is a power of two; else dx/dz rounds: the derived bound, some 10 u",
        _integer_box,
    ),
    ExtremeCase(
        5, "33 x 33 grid, vertical rays from z = 5 at all vertices", "1,089 hits, t == 5", ("closed form",), "none",
        _grid_vertices,
    ),
    ExtremeCase(6, "box [0,1]^3, o = (1,.5,-1), d = (-0,0,1)", "hit", ("closed form",), "none: t == 1", _box_edge),
    ExtremeCase(
        7, "the same box, o = (1.0000001,.5,-1), d = +z", "miss", ("closed form",), "none; also one float64 ulp beside",
        _beside_box,
    ),
    ExtremeCase(
        8, "icosphere 3, d = (1e-42,0,-1)", "as (0,0,-1)", ("exact", "Embree"),
        "bit for bit: the tilt moves nothing by an ulp", _denormal_direction,
    ),
    ExtremeCase(
        9, "rays in a triangle's plane", "miss, no NaN", ("rule", "Embree"),
        "none where nothing rounds; elsewhere float64 cannot tell: a hit must be one that rounding permits",
        _in_plane,
    ),
    ExtremeCase(
        10, "NaN, infinite or zero direction or origin", "ValueError that names the row", ("rule",), "none", _bad_rays
    ),
    ExtremeCase(
        11, "origin on the surface", "t = 0: the interval is closed", ("rule",), "none: all numbers are exact",
        _on_surface,
    ),
)  # fmt: skip

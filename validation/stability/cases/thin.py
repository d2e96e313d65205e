"""Row 49 of the extreme cases: closed meshes with a face of no area, or hardly any, between two that it joins."""

import numpy as np

from renderer import BruteForce, Mesh, Octree
from validation.hits.rays import RayFamily
from validation.stability.cases.case import ExtremeCase, Outcome
from validation.stability.cases.judgement import SEED, embree_says, hits_in_words, of, ray_batch, same_bits

# How far the corner on the split side lies beside it: on it, less and more than rounding.
BESIDE = (0.0, 1e-300, 1e-17, 2.3e-16, -1e-16, 1e-14, 1e-9)
# The short side of a needle: around the share of its length at which a face is taken for a line, and less.
SHORT = (2.0**-40, 2.0**-47, 2.0**-48, 2.0**-49, 2.0**-50, 2.0**-52)
# t at which the rays are aimed is 1, and they meet the split side within rounding: a corner 1e-9 beside it moves them
# by some times as much, as the faces are met at slopes of up to 5.
_NEAR = 1e-8


def split_side(beside: float) -> Mesh:
    """A tetrahedron whose slanted side has a corner more on one of its faces; the thin face [1, 3, 4] joins both."""
    corners = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 4.0], [1.0, beside, 3.0]]
    return Mesh(corners, [[0, 2, 1], [0, 3, 2], [1, 2, 3], [0, 1, 4], [0, 4, 3], [1, 3, 4]])


def at_the_side(count: int) -> RayFamily:
    """Rays from within, aimed along the whole split side."""
    rng = np.random.default_rng(SEED)
    origins, share = [0.7, 0.61, 0.53] + 0.1 * rng.random((count, 3)), rng.random((count, 1))
    return ray_batch(origins, [4.0, 0.0, 0.0] * share + [0.0, 0.0, 4.0] * (1.0 - share) - origins)


def needle(short: float) -> Mesh:
    """A tetrahedron one of whose sides has a corner more, ``short`` before its end: the face [2, 1, 4] is a needle."""
    corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [short, 1.0 - short, 0.0]]
    return Mesh(corners, [[2, 4, 0], [4, 1, 0], [0, 1, 3], [0, 3, 2], [1, 2, 3], [2, 1, 4]])


def at_the_needle(short: float, count: int) -> RayFamily:
    """Rays from within, aimed at the needle's short side and as far again behind it."""
    rng = np.random.default_rng(SEED)
    origins = np.column_stack(
        [rng.uniform(1e-4, 1e-2, count), rng.uniform(0.05, 0.8, count), rng.uniform(1e-4, 1e-2, count)]
    )
    share = 1.5 * short * rng.random((count, 1))
    return ray_batch(origins, [0.0, 1.0, 0.0] * (1.0 - share) + [1.0, 0.0, 0.0] * share - origins)


def _thin(quick: bool) -> Outcome:
    rays = at_the_side(30_000 if quick else 300_000)
    lost, off, differ = 0, 0, 0
    meshes = [(split_side(beside), rays) for beside in BESIDE]
    meshes += [(needle(short), at_the_needle(short, len(rays))) for short in SHORT]
    for mesh, rays in meshes:
        hits = Octree.from_mesh(mesh).closest_hit(rays.origins, rays.directions)
        brute = BruteForce.from_mesh(mesh).closest_hit(rays.origins, rays.directions)
        lost += int((~hits.hit).sum())
        off += int((abs(hits.t[hits.hit] - 1.0) > _NEAR).sum())
        differ += int((~same_bits(hits, brute)).sum())
    total = np.zeros(len(meshes) * len(rays), np.bool_)
    said = f"{lost} lost, {off} off, {differ} unlike brute force, {of(~total, 'rays')}"
    return Outcome(said, not (lost or off or differ), *embree_says(*meshes[0], hits_in_words))


CASES: tuple[ExtremeCase, ...] = (
    ExtremeCase(
        49, "a closed mesh with a face of no area, or hardly any, at a split side, or a needle; rays from within",
        "every ray hits, at t = 1; as brute force", ("closed form", "brute force"),
        "t within 1e-8, ten times as much as the widest of these faces moves it", _thin,
    ),
)  # fmt: skip

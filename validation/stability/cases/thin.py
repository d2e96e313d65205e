"""Row 49 of the extreme cases: closed meshes with a face of no area, or hardly any, between two that it joins."""

import numpy as np

from renderer import BruteForce, Mesh, Octree
from validation.hits.rays import RayFamily
from validation.stability.cases.case import ExtremeCase, Outcome
from validation.stability.cases.judgement import SEED, embree_says, hits_in_words, of, ray_batch, same_bits

# How far the corner on the split side lies beside it: on it, less and more than rounding.
BESIDE = (0.0, 1e-300, 1e-17, 2.3e-16, -1e-16, 1e-14, 1e-9)
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


def _thin(quick: bool) -> Outcome:
    rays = at_the_side(30_000 if quick else 300_000)
    lost, off, differ = 0, 0, 0
    for beside in BESIDE:
        mesh = split_side(beside)
        hits = Octree.from_mesh(mesh).closest_hit(rays.origins, rays.directions)
        brute = BruteForce.from_mesh(mesh).closest_hit(rays.origins, rays.directions)
        lost += int((~hits.hit).sum())
        off += int((abs(hits.t[hits.hit] - 1.0) > _NEAR).sum())
        differ += int((~same_bits(hits, brute)).sum())
    total = np.zeros(len(BESIDE) * len(rays), np.bool_)
    said = f"{lost} lost, {off} off, {differ} unlike brute force, {of(~total, 'rays')}"
    return Outcome(said, not (lost or off or differ), *embree_says(split_side(0.0), rays, hits_in_words))


CASES: tuple[ExtremeCase, ...] = (
    ExtremeCase(
        49, "a closed mesh with a face of no area, or 1e-300 to 1e-9 wide, along a split side; rays at it from within",
        "every ray hits, at t = 1; as brute force", ("analytic", "brute force"),
        "t within 1e-8, ten times as much as the widest of these faces moves it", _thin,
    ),
)  # fmt: skip

"""Extreme case 46: rays whose hits err by more than the boxes' width, in every order."""

from collections.abc import Callable, Iterator

import numpy as np

from renderer import BruteForce, Hits, Mesh, Octree
from validation.hits.compare import HitArrays
from validation.hits.rays import RayFamily, float32_exact
from validation.meshes import loose
from validation.stability.cases.case import ExtremeCase, Outcome
from validation.stability.cases.judgement import (
    SEED,
    against_exact,
    as_exact,
    embree_says,
    hits_in_words,
    of,
    ray_batch,
    same_bits,
)

# Exact arithmetic takes 20 ms a ray, because all 2,000 faces overlap.
JUDGED = 64


def sheets(count: int) -> Mesh:
    """Overlapping triangles in the plane x = 0: every float32 box around them is flat."""
    corners = float32_exact(np.random.default_rng(SEED).uniform(-0.5, 0.5, (count, 3, 3)))
    corners[..., 0] = 0.0
    return loose(corners)


def beside_sheets(side: int) -> RayFamily:
    """Rays from a square grid 1e-12 beside that plane, nearly along it."""
    y, z = np.meshgrid(np.linspace(-0.5, 0.5, side), np.linspace(-0.5, 0.5, side))
    return ray_batch(np.stack([np.full(y.size, 1e-12), y.ravel(), z.ravel()], axis=1), (-0.1, 1.0, 0.3))


def _refitted(mesh: Mesh) -> Octree:
    octree = Octree(mesh.vertices[:, [0, 2, 1]] * [1.0, 3.0, 0.5], mesh.faces)
    octree.refit(mesh.vertices)
    return octree


def orders(mesh: Mesh, rays: RayFamily, t_max: float | np.ndarray) -> Iterator[tuple[str, Hits]]:
    """Closest hits of the same rays by brute force, all kinds of trees, and batches cut and reordered in many ways."""

    def trace(accelerator: Octree | BruteForce, *pieces: np.ndarray) -> Hits:
        far = np.broadcast_to(t_max, len(rays))
        parts = [accelerator.closest_hit(rays.origins[p], rays.directions[p], t_max=far[p]) for p in pieces]
        back = np.argsort(np.concatenate(pieces), kind="stable")
        names = ("t", "face", "u", "v")
        t, face, u, v = (np.concatenate([getattr(part, name) for part in parts])[back] for name in names)
        return Hits(t, face, u, v, accelerator.mesh)

    rows = np.arange(len(rays))
    octree = Octree.from_mesh(mesh, threads=1)
    builds: dict[str, Callable[[], Octree | BruteForce]] = {
        "2 threads": lambda: Octree.from_mesh(mesh, threads=2),
        "3 threads": lambda: Octree.from_mesh(mesh, threads=3),
        "SAH": lambda: Octree.from_mesh(mesh, split="sah"),
        "large leaves": lambda: Octree.from_mesh(mesh, leaf_size=32),
        "a refit": lambda: _refitted(mesh),
        "one thread": lambda: octree,
    }
    yield "brute force", trace(BruteForce.from_mesh(mesh), rows)
    for name, build in builds.items():
        yield name, trace(build(), rows)
    yield "without the first eight", trace(octree, rows[8:], rows[:8])
    yield "turned", trace(octree, rows[::-1])
    yield "few at a time", trace(octree, *np.array_split(rows, len(rows) // 7))


def differing(mesh: Mesh, rays: RayFamily, t_max: float | np.ndarray = np.inf) -> tuple[np.ndarray, Hits, list[str]]:
    """Rays that some order answers differently from the first, the first order's hits, and those orders' names."""
    traced = orders(mesh, rays, t_max)
    _, first = next(traced)
    differs, names = np.zeros(len(rays), dtype=np.bool_), []
    for name, hits in traced:
        other = ~same_bits(hits, first)
        differs |= other
        names += [name] * bool(other.any())
    return differs, first, names


def _order(quick: bool) -> Outcome:
    mesh, rays = sheets(2000), beside_sheets(48 if quick else 120)
    differs, hits, names = differing(mesh, rays)
    # Half of the limits cut the hit off by less than its error, half keep it.
    close = np.where(hits.hit, hits.t, 1.0) * np.where(np.arange(len(rays)) % 2, 1 - 1e-9, 1 + 1e-9)
    differs_close, _, names_close = differing(mesh, rays, close)
    judged = np.linspace(0, len(rays) - 1, JUDGED).astype(int)
    few = hits.t[judged], hits.face[judged]
    right = as_exact(against_exact(mesh, rays.select(judged), HitArrays(*few)))
    both = differs | differs_close
    said = f"{of(both, 'rays')} differ" + (f": {', '.join(sorted({*names, *names_close}))}" if both.any() else "")
    return Outcome(f"{said}; {of(hits.hit)}", right and not both.any(), *embree_says(mesh, rays, hits_in_words))


CASES: tuple[ExtremeCase, ...] = (
    ExtremeCase(
        46, "2,000 overlapping faces in the plane x = 0, rays from 1e-12 beside it",
        "the same bits by brute force, every tree, a refit, any threads, batch and order, with any t_max; as exact",
        ("exact",), "none between orders; the derived bound of t", _order,
    ),
)  # fmt: skip

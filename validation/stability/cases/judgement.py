"""Judges of the extreme cases about hits, and the wording of their results."""

from collections.abc import Callable, Iterable
from fractions import Fraction

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike, NDArray

from renderer import BruteForce, Hits, Mesh, Octree
from validation.hits.compare import ExactErrors, HitArrays, exact_errors
from validation.hits.rays import RayFamily, float32_exact
from validation.oracle import exact
from validation.oracle.distance import way_from
from validation.references.embree import Embree

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

Accelerator = Octree | BruteForce

SEED = 2026
FIRST_FACE = np.array([[0, 1, 2]], dtype=np.int32)


def ray_batch(origins: ArrayLike, directions: ArrayLike) -> RayFamily:
    """Rays from rows that broadcast against each other, (n, 3) or (3,)."""
    o, d = np.broadcast_arrays(np.atleast_2d(np.asarray(origins, float)), np.atleast_2d(np.asarray(directions, float)))
    return RayFamily("extreme", np.ascontiguousarray(o), np.ascontiguousarray(d))


def closest(accelerator: Accelerator, rays: RayFamily) -> Hits:
    return accelerator.closest_hit(rays.origins, rays.directions)


def embree_says(mesh: Mesh, rays: RayFamily, say: Callable[[Floats, Ints], str]) -> tuple[str, str]:
    """The answers of Embree's default and robust mode, formatted by ``say(t, face)``."""
    # Numbers beyond float32 reach Embree as infinities; the table shows its answers.
    with np.errstate(over="ignore"):
        default, robust = (Embree(mesh.vertices, mesh.faces, robust=mode) for mode in (False, True))
        return (
            say(*default.closest_hit(rays.origins, rays.directions)),
            say(*robust.closest_hit(rays.origins, rays.directions)),
        )


def against_exact(mesh: Mesh, rays: RayFamily, hits: Hits | HitArrays) -> ExactErrors:
    """Compare every ray with exact arithmetic, t within the bound that rounding explains."""
    truth = exact.closest_hits(mesh.vertices, mesh.faces, rays.origins, rays.directions)
    return exact_errors(HitArrays.told(hits.t, hits.face), truth, mesh.vertices, mesh.faces, rays)


def as_exact(errors: ExactErrors) -> bool:
    """Whether no ray is wrong or undecidable in float64."""
    return errors.wrong == 0 and errors.near_edge == 0


def same_bits(first: Hits, second: Hits) -> Bools:
    """Rays with equal t, face, u and v, bit for bit."""
    same = first.face == second.face
    for a, b in ((first.t, second.t), (first.u, second.u), (first.v, second.v)):
        same &= a.view(np.int64) == b.view(np.int64)
    return same


def against_brute_force(mesh: Mesh, rays: RayFamily, octrees: Iterable[Octree]) -> tuple[int, str]:
    """Number of rays on which some octree differs from brute force, in t, face, u, v or any hit; and a text."""
    brute = closest(BruteForce.from_mesh(mesh), rays)
    differs = np.zeros(len(rays), dtype=np.bool_)
    for octree in octrees:
        differs |= ~same_bits(closest(octree, rays), brute)
        differs |= octree.any_hit(rays.origins, rays.directions) != brute.hit
    return int(differs.sum()), f"{of(differs, 'differ')}, {of(brute.hit)}"


def octrees(mesh: Mesh) -> list[Octree]:
    """Octrees by both split rules with small and large leaves; the first has the default options."""
    default = Octree.from_mesh(mesh)
    return [default] + [
        Octree.from_mesh(mesh, split=split, leaf_size=size) for split in ("midpoint", "sah") for size in (1, 8)
    ]


def ulp_errors(t: Floats, true: Iterable[Fraction]) -> Floats:
    """|t - true| in units of the last place of the true distance."""
    pairs = zip(t.tolist(), true, strict=True)
    return np.array([float(way_from(a, b) / Fraction(float(np.spacing(float(b))))) for a, b in pairs])


def of(good: ArrayLike, what: str = "hits") -> str:
    """A mask in words: "3 of 4 hits"."""
    mask = np.asarray(good)
    return f"{int(mask.sum()):,} of {mask.size:,} {what}"


def one_t(t: Floats, face: Ints) -> str:
    """The first ray's answer; Embree's -0 is shown as 0."""
    return f"t = {abs(t[0]):.8g}" if face[0] >= 0 else "miss"


def hits_in_words(t: Floats, face: Ints) -> str:
    return of(face >= 0)


def unit_rows(rng: Generator, count: int) -> Floats:
    rows = rng.standard_normal((count, 3))
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


def rotation(rng: Generator) -> Floats:
    """A random orthogonal matrix (3, 3)."""
    return np.asarray(np.linalg.qr(rng.standard_normal((3, 3)))[0])


def float32_mesh(mesh: Mesh) -> Mesh:
    return Mesh(float32_exact(mesh.vertices), mesh.faces)


def both_modes(mesh: Mesh) -> tuple[Embree, Embree]:
    return Embree(mesh.vertices, mesh.faces, robust=False), Embree(mesh.vertices, mesh.faces, robust=True)

"""Extreme cases 12 to 17: far from the origin, huge, tiny, thin and grazing."""

from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from renderer import BruteForce, Hits, Mesh, Octree
from renderer.mesh.shapes import icosphere
from validation.hits.rays import float32_exact
from validation.oracle import exact
from validation.oracle.exact import FLOAT64_ROUNDOFF
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
    of,
    ray_batch,
    rotation,
    same_bits,
    ulp_errors,
    unit_rows,
)

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


def _translated(quick: bool) -> Outcome:
    rng, ball = np.random.default_rng(SEED), icosphere(4)
    holds, ulp, texts = True, [], []
    for offset in 10.0 ** np.arange(2, 10):
        count = 500 if quick else 4_000
        mesh = Mesh(ball.vertices + offset, ball.faces)
        targets = 0.95 * unit_rows(rng, count) * rng.random((count, 1))
        origins = 2 * unit_rows(rng, count) + offset
        rays = ray_batch(origins, targets + offset - origins)
        hits = closest(Octree.from_mesh(mesh), rays)
        errors = against_exact(mesh, rays, hits)
        truth = exact.closest_hits(mesh.vertices, mesh.faces, rays.origins, rays.directions)
        holds &= as_exact(errors) and errors.hits == count
        ulp.append(ulp_errors(hits.t[hits.hit], [hit.t for hit in truth if hit is not None]) if holds else [np.inf])

        def worst(t: Floats, face: Ints, own: Hits = hits) -> str:
            both = (face >= 0) & own.hit
            return f"{np.abs(t[both] / own.t[both] - 1).max(initial=0.0):.0e} on {of(face >= 0)}"

        texts.append(embree_says(mesh, rays, worst))
    error = np.concatenate(ulp)
    holds &= bool((error <= 4).mean() >= 0.999)
    ours = f"at most {error.max():.1f} ulp, {of(error <= 4, 'within 4')}"
    said = [f"error {words[0]} at 1e2, {words[4]} at 1e6" for words in zip(*texts, strict=True)]
    return Outcome(ours, holds, *said)


def _powers_of_two(quick: bool) -> Outcome:
    mesh, rng = float32_mesh(icosphere(2)), np.random.default_rng(SEED)
    origins = float32_exact(2 * unit_rows(rng, 500))
    rays = ray_batch(origins, float32_exact(float32_exact(unit_rows(rng, 500)) - origins))
    brute = closest(BruteForce.from_mesh(mesh), rays)
    powers = range(-100, 101, 20 if quick else 1)
    same, said = [], []
    for k in powers:
        scaled, moved = Mesh(np.ldexp(mesh.vertices, k), mesh.faces), ray_batch(np.ldexp(origins, k), rays.directions)
        hits = closest(Octree.from_mesh(scaled), moved)
        expected = Hits(np.ldexp(brute.t, k), brute.face, brute.u, brute.v, mesh)
        same.append(bool(same_bits(hits, expected).all()))
        said.append(
            [((e.closest_hit(moved.origins, moved.directions)[1] >= 0) == brute.hit).all() for e in both_modes(scaled)]
        )
    default, robust = np.array(said).T
    words = "scales with the same hits"
    return Outcome(of(same, "scales bit for bit"), all(same), of(default, words), of(robust, words))


def _far_scales(quick: bool) -> Outcome:
    ball, rng, count = icosphere(3), np.random.default_rng(SEED), 200 if quick else 2_000
    origins = 2 * unit_rows(rng, count)
    directions = float32_exact(0.9 * unit_rows(rng, count) - origins)
    holds, ulp, texts = True, 0.0, []
    for scale in (1e-40, 1e-30, 1e30, 1e300):
        mesh, rays = Mesh(ball.vertices * scale, ball.faces), ray_batch(origins * scale, directions)
        hits = closest(Octree.from_mesh(mesh), rays)
        # Judge the scene times a power of two, which is an equal scene, so that no bound over- or underflows.
        near = -int(np.frexp(scale)[1])
        errors = against_exact(
            Mesh(np.ldexp(mesh.vertices, near), mesh.faces),
            ray_batch(np.ldexp(rays.origins, near), directions),
            Hits(np.ldexp(hits.t, near), hits.face, hits.u, hits.v, mesh),
        )
        holds &= as_exact(errors) and errors.hits == count
        ulp = max(ulp, errors.ulp_max)
        texts.append([f"{scale:.0e} {said}" for said in embree_says(mesh, rays, hits_in_words)])
    ours = f"all hit at 1e-40, 1e-30, 1e30, 1e300, at most {ulp:.1f} ulp off" if holds else "wrong or missing hits"
    return Outcome(ours, holds, *("; ".join(words) for words in zip(*texts, strict=True)))


def _slivers(quick: bool) -> Outcome:
    """Judge slivers with a base symmetric about the origin and the apex beside it, so that float32 holds any height."""
    rng, count = np.random.default_rng(SEED), 40 if quick else 200
    wrong, true_hits, found = 0, [], []
    for height in 10.0 ** -np.arange(1, 9):
        for _ in range(5 if quick else 20):
            turn = rotation(rng)
            corners = float32_exact([-turn[0], turn[0], height * turn[1]])
            mesh = Mesh(corners, FIRST_FACE)
            origins = float32_exact(2 * unit_rows(rng, count))
            targets = rng.dirichlet((1, 1, 1), count) @ corners
            rays = ray_batch(origins, float32_exact(targets - origins))
            errors = against_exact(mesh, rays, closest(Octree.from_mesh(mesh), rays))
            wrong += errors.wrong + errors.near_edge
            truth = exact.closest_hits(corners, mesh.faces, rays.origins, rays.directions)
            true_hits.append(np.array([hit is not None for hit in truth]))
            modes = both_modes(mesh)
            found.append(np.stack([e.closest_hit(rays.origins, rays.directions)[1] >= 0 for e in modes]))
    truly = np.concatenate(true_hits)
    default, robust = np.concatenate(found, axis=1)[:, truly]
    ours = f"{wrong} wrong of {len(truly):,}, {truly.sum():,} of them true hits"
    return Outcome(ours, wrong == 0 and bool(truly.any()), of(default, "true hits"), of(robust, "true hits"))


def _grazing(quick: bool) -> Outcome:
    rng, count = np.random.default_rng(SEED), 50
    scaled, flips, rays_in_all, theirs = [0.0], 0, 0, [[0.0], [0.0]]
    for angle in 10.0 ** -np.arange(1, 8):
        for _ in range(2 if quick else 20):
            corners = float32_exact([(-4, -4, 0), (4, -4, 0), (0, 4, 0)] @ rotation(rng))
            mesh, normal = Mesh(corners, FIRST_FACE), np.cross(corners[1] - corners[0], corners[2] - corners[0])
            normal /= np.linalg.norm(normal)
            along = np.cross(normal, unit_rows(rng, count))
            along /= np.linalg.norm(along, axis=1, keepdims=True)
            directions = float32_exact(np.cos(angle) * along - np.sin(angle) * normal)
            rays = ray_batch(float32_exact(rng.dirichlet((1, 1, 1), count) @ corners - 2 * directions), directions)
            truth = exact.closest_hits(corners, mesh.faces, rays.origins, rays.directions)
            answers = [closest(Octree.from_mesh(mesh), rays).t]
            answers += [e.closest_hit(rays.origins, rays.directions)[0] for e in both_modes(mesh)]
            rays_in_all += count
            for row, hit in enumerate(truth):
                flips += (hit is not None) != bool(np.isfinite(answers[0][row]))
                # The ray's real angle, after rounding to float32.
                sine = abs(float(normal @ directions[row])) / np.linalg.norm(directions[row])
                for kept, t in zip((scaled, *theirs), answers, strict=True):
                    if hit is not None and np.isfinite(t[row]):
                        kept.append(float(abs(Fraction(float(t[row])) - hit.t) / hit.t) * float(sine))
    ours = f"error {max(scaled) / FLOAT64_ROUNDOFF:.1f} u / angle, {flips} of {rays_in_all:,} otherwise than exact"
    said = [f"error {max(kept):.0e} / angle, {len(kept) - 1:,} hits" for kept in theirs]
    return Outcome(ours, flips == 0 and len(scaled) > 1 and max(scaled) <= 4 * FLOAT64_ROUNDOFF, *said)


def _far_origin(quick: bool) -> Outcome:
    mesh, rng, count = float32_mesh(icosphere(5)), np.random.default_rng(SEED), 10_000 if quick else 100_000
    origins = float32_exact(1e6 * unit_rows(rng, count))
    # Float32 moves the direction by at most 2^-25 of 1e6 a component, the target by 0.06. Rays pass within 0.6 of the
    # centre, and the faceted sphere, of inner radius 0.998, is always hit.
    rays = ray_batch(origins, float32_exact(0.5 * unit_rows(rng, count) * rng.random((count, 1)) - origins))
    hits = closest(Octree.from_mesh(mesh), rays)
    radius = np.linalg.norm(origins + hits.t[:, None] * rays.directions, axis=1)
    # o + t d errs by u 1e6 a component and by as much again from t; 1e-8 is 50 times that.
    holds = bool(hits.hit.all()) and bool((radius > 0.998 - 1e-8).all() and (radius < 1 + 1e-6).all())
    return Outcome(of(~hits.hit, "missed"), holds, *embree_says(mesh, rays, lambda t, face: of(face < 0, "missed")))


CASES: tuple[ExtremeCase, ...] = (
    ExtremeCase(
        12, "icosphere 4 moved by 1e2 ... 1e9, float64 rays", "within 4 ulp of exact", ("exact",),
        "4 ulp for 99.9 %; every ray within the derived bound, which starts at 10 u and grows as the ray grazes",
        _translated,
    ),
    ExtremeCase(
        13, "scale by 2^k, |k| <= 100", "t 2^k bit for bit", ("brute force",), "none: powers of two are exact",
        _powers_of_two,
    ),
    ExtremeCase(
        14, "scale 1e-40, 1e-30, 1e30 and 1e300", "hit", ("exact",), "the derived bound of t, after an exact rescale",
        _far_scales,
    ),
    ExtremeCase(
        15, "slivers of height 1e-1 ... 1e-8, rotated", "hits as exact", ("exact",), "the derived bound of t", _slivers
    ),
    ExtremeCase(
        16, "grazing at 1e-1 ... 1e-7 rad", "error <= 4 u / angle", ("exact",),
        "4 u / angle: the kernel's error in the plane's distance, over the sine", _grazing,
    ),
    ExtremeCase(
        17, "ray origin 1e6 away", "no miss near the centre", ("closed form",),
        "none for hits; hit points within 1e-8 of the shell between the facets and the sphere", _far_origin,
    ),
)  # fmt: skip

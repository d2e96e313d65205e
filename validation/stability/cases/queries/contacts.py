"""Row 52 of the extreme cases: all hits of rays at edges, corners, outlines and walls, judged by exact arithmetic."""

import math
from fractions import Fraction

import numpy as np
from numpy.random import Generator

from renderer import BruteForce, Mesh, Octree
from validation.meshes import loose
from validation.oracle.contacts import contacts, hits
from validation.stability.cases.case import ExtremeCase, Outcome
from validation.stability.cases.judgement import SEED, Floats
from validation.stability.cases.queries.inside import closed_solids

# Powers of two and whole numbers, so that a mesh of whole numbers stays one that float64 holds exactly.
PLACES = ((0.0, 1.0), (2.0**20, 1.0), (0.0, 2.0**-20), (2.0**20, 2.0**40))


def whole_meshes() -> dict[str, Mesh]:
    """Meshes whose corners are small integers: some closed solids, one of them twice, as soup, and flattened."""
    solids = {name: mesh for name, mesh in closed_solids().items() if (mesh.vertices == np.round(mesh.vertices)).all()}
    star = solids["integers"]
    flat = Mesh(np.floor(solids["nested boxes"].vertices / [1, 1, 4]), solids["nested boxes"].faces)
    return solids | {"twice": Mesh.concatenate([star, star]), "walls": flat, "soup of integers": loose(star.triangles)}


def rays_of(mesh: Mesh, rng: Generator, count: int) -> tuple[Floats, Floats]:
    """Rays from small integers at corners, at middles of edges and along axes, with slopes that float64 holds exactly.

    So a sheared corner is not rounded, and contacts are those of real arithmetic. The slopes are quarters: origins
    differ from their targets by a whole number of times a direction.
    """
    corners = mesh.triangles[rng.integers(0, len(mesh.faces), count)]
    targets = np.where(rng.random((count, 1)) < 0.5, corners[:, 0], (corners[:, 0] + corners[:, 1]) / 2)
    directions = rng.integers(-4, 5, (count, 3)).astype(np.float64)
    directions[rng.random((count, 3)) < 0.3] = 0.0
    directions[np.arange(count), rng.integers(0, 3, count)] = rng.choice([-4.0, 4.0], count)
    return targets - directions * rng.integers(0, 5, (count, 1)), directions


def fine_mesh(mesh: Mesh, rng: Generator) -> Mesh:
    """A mesh with corners at integers near 2^32: differences are exact, edge functions round to 0 near their edges."""
    fine = np.round(mesh.vertices * 2.0**30) + rng.integers(0, 2**14, mesh.vertices.shape)
    return Mesh(fine, mesh.faces)


def rays_beside_edges(mesh: Mesh, rng: Generator, count: int) -> tuple[Floats, Floats]:
    """Rays along z whose edge function of some edge is 1 or -1: the nearest that integers come to it."""
    origins: list[list[int]] = []
    while len(origins) < count:
        triangle = mesh.triangles[rng.integers(len(mesh.faces))].astype(np.int64)
        a, b, _ = np.roll(triangle, rng.integers(3), axis=0).tolist()
        dx, dy = b[0] - a[0], b[1] - a[1]
        if math.gcd(dx, dy) == 1 and abs(dx) > 1:
            # dx py - dy px = 1 or -1 for a point p between both ends.
            px = -pow(dy, -1, abs(dx)) % abs(dx) * (1 if dx > 0 else -1)
            if rng.random() < 0.5:
                px = dx - px
            py = round(Fraction(dy * px, dx))
            origins.append([a[0] + px, a[1] + py, -(2**36)])
    return np.array(origins, np.float64), np.tile([0.0, 0.0, 1.0], (count, 1))


def wrong_faces(mesh: Mesh, origins: Floats, directions: Floats) -> int:
    """``wrong_rays`` where t is rounded more than once: the faces hit, and the number of contacts, are compared."""
    wrong = 0
    queries = Octree.from_mesh(mesh)
    met, each = queries.count_hits(origins, directions), queries.all_hits(origins, directions, contacts=False)
    for i, (origin, direction) in enumerate(zip(origins, directions, strict=True)):
        expected = contacts(mesh.vertices, mesh.faces, origin, direction)
        faces = each.face[each.offsets[i] : each.offsets[i + 1]]
        wrong += met[i] != len(expected) or sorted(faces) != sorted(face for _, face in hits(expected))
    return int(wrong)


def wrong_rays(mesh: Mesh, origins: Floats, directions: Floats) -> int:
    """The number of rays of which some answer differs from exact arithmetic, or from another query's."""
    wrong = np.zeros(len(origins), np.bool_)
    expected = [contacts(mesh.vertices, mesh.faces, o, d) for o, d in zip(origins, directions, strict=True)]
    for accelerator in (Octree.from_mesh(mesh), BruteForce.from_mesh(mesh)):
        met, each = (accelerator.all_hits(origins, directions, contacts=merged) for merged in (True, False))
        for i, found in enumerate(expected):
            rows, all_rows = slice(*met.offsets[i : i + 2]), slice(*each.offsets[i : i + 2])
            # Nothing is rounded but t, once, so equal t are equal.
            wanted = [(float(contact.t), contact.faces[0]) for contact in found]
            wrong[i] |= wanted != list(zip(met.t[rows].tolist(), met.face[rows].tolist(), strict=True))
            wrong[i] |= [face for _, face in hits(found)] != each.face[all_rows].tolist()
        closest = accelerator.closest_hit(origins, directions)
        wrong |= accelerator.count_hits(origins, directions) != met.counts
        wrong |= accelerator.any_hit(origins, directions) != (met.counts > 0)
        first = np.where(met.counts > 0, np.append(met.face, -1)[met.offsets[:-1]], -1)
        wrong |= closest.face != first
        nearest = accelerator.all_hits(origins, directions, max_hits=1)
        wrong |= nearest.counts != closest.hit
        wrong[nearest.ray] |= nearest.face != closest.face[nearest.ray]
    return int(wrong.sum())


def _contacts(quick: bool) -> Outcome:
    rng, wrong, asked = np.random.default_rng(SEED), 0, 0
    for solid in whole_meshes().values():
        for offset, scale in PLACES:
            origins, directions = rays_of(solid, rng, 10 if quick else 40)
            mesh = Mesh((solid.vertices + offset) * scale, solid.faces)
            wrong, asked = wrong + wrong_rays(mesh, (origins + offset) * scale, directions), asked + len(origins)
        if len(solid.faces) > 12:
            fine = fine_mesh(solid, rng)
            rays = rays_beside_edges(fine, rng, 20 if quick else 100)
            wrong, asked = wrong + wrong_faces(fine, *rays), asked + len(rays[0])
    return Outcome(f"{wrong} of {asked:,} rays wrong", wrong == 0)


CASES: tuple[ExtremeCase, ...] = (
    ExtremeCase(
        52, "rays through corners, edges, outlines and planes of solids, walls, double faces and soup; far, tiny, huge",
        "contacts, hits, their number and order as in real arithmetic; first contact = closest hit", ("exact",),
        "none: nothing is rounded but t, once", _contacts,
    ),
)  # fmt: skip

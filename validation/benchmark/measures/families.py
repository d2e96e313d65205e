"""The benchmark's rays (camera, shadow, random, bounce, misses, short) and points (wide, box, near).

Seeded and exact in float32.
"""

import numpy as np

from renderer.mesh.mesh import Mesh, face_normals
from renderer.octree import Octree
from validation.benchmark.peers.contender import Family, Floats, Points
from validation.hits.rays import camera_rays, float32_exact, random_rays

_SEED = 11
# Spawned rays start at this share of the mesh's size off their surface: a thousand times float32's rounding, so that
# all contenders agree, and less than a tenth of an edge at 10 million faces.
_OFFSET = 5e-5
# Wide points fill a box of this many times the mesh's size, so that some are outside of the mesh's own.
_WIDE = 1.2
# Near points are within this share of the mesh's size from its surface.
_NEAR = 0.01
# Rays that miss pass through a box of this many times the mesh's size; of a flat mesh, at least this share of its
# largest is the box's half.
_AROUND, _THICK = 1.5, 0.05
# Batches of rays that are tried for misses; among fewer that miss, each is repeated.
_BATCHES = 20
# Length of short rays, of the mesh's size: most that start within ``_NEAR`` of the surface end before they meet it.
_SHORT = 0.02
MISSES = "misses"


def families(octree: Octree, count: int) -> tuple[Family, ...]:
    """``count`` rays of each family; shadow and bounce rays start where camera rays hit, in the pixels' order."""
    mesh = octree.mesh
    camera = camera_rays(mesh.vertices, count)
    hits = octree.closest_hit(camera.origins, camera.directions)
    seen = np.flatnonzero(hits.hit)
    if not len(seen):
        raise ValueError(f"mesh {mesh.name}: expected camera rays that hit, got none of {count}")
    # Every hit starts as many rays as needed, and rays from one hit are consecutive.
    rows = seen[np.arange(count) * len(seen) // count]
    normals = hits.normals[rows]
    normals *= -np.sign(np.einsum("ij,ij->i", normals, camera.directions[rows]))[:, None]
    lower, upper = mesh.bounds
    size = float(np.linalg.norm(upper - lower))
    origins = float32_exact(hits.points[rows] + _OFFSET * size * normals)
    light = (lower + upper) / 2 + size * np.array([0.4, 1.5, 0.9])
    rng = np.random.default_rng(_SEED)
    through = random_rays(mesh.triangles, count, rng)
    return (
        Family("camera", camera.origins, camera.directions),
        Family("shadow", origins, float32_exact(light - origins), t_max=1.0),
        Family("random", through.origins, through.directions),
        Family("bounce", origins, float32_exact(cosine_distributed(normals, rng))),
        _misses(octree, count),
        _short(mesh, count),
    )


def _misses(octree: Octree, count: int) -> Family:
    """Rays between random points of a box around the mesh that hit nothing, as the octree says; they have no end."""
    rng = np.random.default_rng([_SEED, 1])
    lower, upper = octree.mesh.bounds
    centre, half = (lower + upper) / 2, (upper - lower) / 2
    half = np.maximum(_AROUND * half, _THICK * half.max())
    found, have = [], 0
    for _ in range(_BATCHES):
        start, end = centre + half * rng.uniform(-1.0, 1.0, (2, count, 3))
        origins = float32_exact(start)
        rays = np.stack([origins, float32_exact(end - origins)], axis=1)
        rays = rays[rays[:, 1].any(axis=1)]
        found.append(rays[~octree.any_hit(rays[:, 0], rays[:, 1])])
        have += len(found[-1])
        if have >= count:
            break
    if not have:
        raise ValueError(f"mesh {octree.mesh.name}: expected rays around it that miss, got none of {_BATCHES * count}")
    rays = np.concatenate(found)[np.arange(count) % have]
    return Family(MISSES, np.ascontiguousarray(rays[:, 0]), np.ascontiguousarray(rays[:, 1]))


def _short(mesh: Mesh, count: int) -> Family:
    """Rays in all directions from beside the surface, unit directions but for float32, that soon end."""
    rng = np.random.default_rng([_SEED, 2])
    lower, upper = mesh.bounds
    directions = rng.standard_normal((count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    end = float(np.float32(_SHORT * np.linalg.norm(upper - lower)))
    return Family("short", float32_exact(_beside(mesh, count, rng)), float32_exact(directions), end, beyond=True)


def points(mesh: Mesh, count: int) -> tuple[Points, ...]:
    """``count`` points of each family: uniform in a wide box and in the mesh's own, and beside points of its faces."""
    rng = np.random.default_rng(_SEED)
    lower, upper = mesh.bounds
    centre, half = (lower + upper) / 2, (upper - lower) / 2
    wide = centre + _WIDE * half * rng.uniform(-1.0, 1.0, (count, 3))
    box = rng.uniform(lower, upper, (count, 3))
    near = _beside(mesh, count, rng)
    return Points("wide", float32_exact(wide)), Points("box", float32_exact(box)), Points("near", float32_exact(near))


def _beside(mesh: Mesh, count: int, rng: np.random.Generator) -> Floats:
    """Points within ``_NEAR`` of the mesh's size from points of random faces, along their normals."""
    corners = mesh.vertices[mesh.faces[rng.integers(0, len(mesh.faces), count)]]
    reach = _NEAR * np.linalg.norm(mesh.bounds[1] - mesh.bounds[0])
    away = rng.uniform(-1.0, 1.0, (count, 1)) * reach * face_normals(corners)
    beside: Floats = np.einsum("nk,nkj->nj", rng.dirichlet(np.ones(3), count), corners) + away
    return beside


def cosine_distributed(normals: Floats, rng: np.random.Generator) -> Floats:
    """Directions about ``normals`` (n, 3), density cos / pi: the normal plus a point of the unit sphere (Lambert)."""
    points = rng.standard_normal(normals.shape)
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    directions = normals + points
    # A point opposite to the normal within rounding gives no direction.
    directions[np.linalg.norm(directions, axis=1) < 1e-6] = (0.0, 0.0, 1.0)
    return directions

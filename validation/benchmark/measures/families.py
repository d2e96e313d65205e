"""The benchmark's ray families, seeded and exact in float32: camera, shadow, random and bounce."""

import numpy as np

from renderer.octree import Octree
from validation.benchmark.peers.contender import Family, Floats
from validation.hits.rays import camera_rays, float32_exact, random_rays

_SEED = 11
# Spawned rays start at this share of the mesh's size off their surface: a thousand times float32's rounding, so that
# all contenders agree, and less than a tenth of an edge at 10 million faces.
_OFFSET = 5e-5


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
    )


def cosine_distributed(normals: Floats, rng: np.random.Generator) -> Floats:
    """Directions about ``normals`` (n, 3), density cos / pi: the normal plus a point of the unit sphere (Lambert)."""
    points = rng.standard_normal(normals.shape)
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    directions = normals + points
    # A point opposite to the normal within rounding gives no direction.
    directions[np.linalg.norm(directions, axis=1) < 1e-6] = (0.0, 0.0, 1.0)
    return directions

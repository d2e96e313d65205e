"""A refitted tree against a new build over the same vertices and faces: the hits must be the same, bit for bit."""

from typing import Any

import numpy as np

from renderer.mesh.shapes import icosphere
from renderer.octree import Octree
from validation.gates import Gate
from validation.hits.rays import families
from validation.job import Job

_SEED = 2030
_RAYS = 3_000
_QUANTITY = "hits that differ from a new build"
# Each change moves faces out of their old boxes: stretched and moved away, and turned inside out along one axis.
_CHANGES = {
    "stretched and moved": (np.array([2.0, 0.5, 1.0]), np.array([3.0, 0.0, 0.0])),
    "mirrored": (np.array([-1.0, 1.0, 1.0]), np.zeros(3)),
}


def check_refit(job: Job) -> tuple[list[dict[str, Any]], list[Gate]]:
    """Refit a sphere's tree and trace rays; returns records for JSON and a gate for each change and family of rays.

    Other checks judge new builds by exact arithmetic, so a refitted tree with equal bits is as right as they are.
    """
    job.step("hits: refitted trees")
    records: list[dict[str, Any]] = []
    gates: list[Gate] = []
    mesh = icosphere(3)
    for change, (factors, offset) in _CHANGES.items():
        vertices = mesh.vertices * factors + offset
        octree, anew = Octree.from_mesh(mesh), Octree(vertices, mesh.faces)
        octree.refit(vertices)
        for rays in families(vertices, mesh.faces, _RAYS, _SEED)[:3]:
            first = octree.closest_hit(rays.origins, rays.directions)
            second = anew.closest_hit(rays.origins, rays.directions)
            differing = int(((first.t != second.t) | (first.face != second.face)).sum())
            subject = f"refitted sphere, {change}, {rays.name} rays"
            records.append({"subject": subject, "rays": len(rays), "differing": differing})
            reason = "equal vertices and faces give equal hits"
            gates.append(Gate("hits", subject, _QUANTITY, float(differing), "at most", 0.0, reason, ("Octree.refit",)))
    return records, gates

"""Leaks: rays from inside closed meshes at their edges and vertices, every one of which must hit."""

from typing import Any

import numpy as np

from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import icosphere, torus
from renderer.octree import Octree
from validation.gates import Gate
from validation.hits import watertight
from validation.hits.check import SEED, HitEffort, LoadedReference, load_reference
from validation.hits.rays import RayFamily, leak_rays
from validation.job import Job


def leak_meshes() -> dict[str, Mesh]:
    """Closed meshes; for each ``check_leaks`` has a place inside from which every ray must hit."""
    return {"icosphere 6": icosphere(6), "torus": torus(1.0, 0.4, 400, 125)}


def check_leaks(effort: HitEffort, job: Job) -> tuple[dict[str, Any], list[Gate]]:
    """Count leaks of ours and of the references; returns a record for JSON and the gates.

    Our rays are aimed in float64, or no float64 kernel could leak; a float32 reference rounds the mesh and the rays.
    """
    sets: list[dict[str, Any]] = []
    gates: list[Gate] = []
    costs: dict[str, float] = {}
    for name, mesh in leak_meshes().items():
        subject, octree = f"{name} ({len(mesh.faces):,} faces)", Octree.from_mesh(mesh)
        loaded = [load_reference(one, mesh) for one in effort.references if len(mesh.faces) <= one.most_faces]
        for rays in leak_rays(mesh.vertices, mesh.faces, effort.leaks, SEED):
            job.step(f"leaks: {name}, {rays.name}")
            inside = _from_ring_core(rays) if name == "torus" else rays
            leaks, limit = watertight.leaks(octree, inside), job.thresholds.hits.leaks
            theirs = [_leaks(one, inside) for one in loaded]
            sets.append({"mesh": subject, "kind": rays.name, "rays": len(rays), "ours": leaks, "references": theirs})
            where, reason = f"{subject}, {rays.name} rays from inside", "a closed mesh has no holes"
            gates.append(Gate("hits", where, "leaks", float(leaks), "at most", limit, reason))
        for one in loaded:
            costs[one.reference.name] = costs.get(one.reference.name, 0.0) + sum(one.seconds.values())
    return {"sets": sets, "costs": costs}, gates


def _leaks(loaded: LoadedReference, inside: RayFamily) -> dict[str, Any]:
    """Leaks of a reference among as many of the rays as it takes."""
    some = inside.select(np.arange(min(len(inside), loaded.reference.most_rays)))
    leaks = int(np.count_nonzero(~loaded.closest_hit(some).hit))
    return {"key": loaded.reference.key, "name": loaded.reference.name, "rays": len(some), "leaks": leaks}


def _from_ring_core(rays: RayFamily) -> RayFamily:
    """Rays at the same targets from the circle in the middle of the tube of ``torus(1, ...)``."""
    targets = rays.origins + rays.directions
    along = np.hypot(targets[:, 0], targets[:, 2])
    origins = np.stack([targets[:, 0] / along, np.zeros(len(along)), targets[:, 2] / along], axis=1)
    return RayFamily(rays.name, origins, targets - origins)

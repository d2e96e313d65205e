"""Hit distances of our octree against Embree, with every disagreement judged by exact arithmetic."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from renderer.mesh import Mesh
from renderer.mesh_io import load_mesh
from renderer.octree import Octree
from renderer.shapes import icosphere, torus
from validation import compare_hits, exact
from validation.cases import SCENES
from validation.compare_hits import HitArrays
from validation.embree import Embree
from validation.gates import Gate
from validation.rays import RayBatch, face_rays, families, float32_exact, leak_rays

SEED = 2026

# Families whose rays are aimed at nothing in particular: there, a hit that float64 cannot decide (the ray passes an
# edge closer than the rounding of the edge function) has a chance of 1e-9 a ray, so one would be suspicious. Rays
# aimed at silhouette edges and vertices are undecidable by design; they are counted and shown.
UNAIMED = ("camera", "random", "grazing", "from_inside", "face")


@dataclass(frozen=True)
class Effort:
    """How much to check: rays a family and mesh, rays judged exactly a family, leak rays of each kind."""

    rays: int
    exact: int
    leaks: int


QUICK = Effort(rays=10_000, exact=200, leaks=100_000)
FULL = Effort(rays=40_000, exact=2_000, leaks=1_000_000)


def meshes() -> dict[str, Mesh]:
    """What is shot at: our models, a mesh far from the origin, and triangles in no order, all float32-exact."""
    models = {name: load_mesh(SCENES / "models" / f"{name}.ply") for name in ("teapot", "torus_knot", "stairs")}
    ball = icosphere(5)
    far = Mesh(float32_exact(ball.vertices + np.array([1000.0, -2000.0, 500.0])), ball.faces)
    rng = np.random.default_rng(SEED)
    corners = float32_exact(rng.normal(size=(2000, 1, 3)) + 0.1 * rng.normal(size=(2000, 3, 3)))
    soup = Mesh(corners.reshape(-1, 3), np.arange(6000, dtype=np.int32).reshape(-1, 3))
    return {**models, "sphere_far_away": far, "triangle_soup": soup}


def run(quick: bool, step: Callable[[str], None]) -> tuple[dict[str, object], list[Gate]]:
    """Check all meshes with all families; returns a record for JSON and the gates."""
    effort = QUICK if quick else FULL
    records: list[dict[str, object]] = []
    gates: list[Gate] = []
    for name, mesh in meshes().items():
        octree, embree = Octree.from_mesh(mesh), Embree(mesh.vertices, mesh.faces, robust=True)
        batches = (*families(mesh.vertices, mesh.faces, effort.rays, SEED), face_rays(mesh.vertices, mesh.faces))
        for rays in batches:
            step(f"hits: {name}, {rays.name}")
            record, gate = _check(name, mesh, octree, embree, rays, effort)
            records.append(record)
            gates += gate
    leaks, leak_gates = _leaks(effort, step)
    return {"families": records, "leaks": leaks, "seed": SEED}, gates + leak_gates


def ours(octree: Octree, rays: RayBatch) -> HitArrays:
    """Our closest hits in the form that is compared."""
    hits = octree.closest_hit(rays.origins, rays.directions)
    return HitArrays(hits.t, hits.face)


def _check(
    name: str, mesh: Mesh, octree: Octree, embree: Embree, rays: RayBatch, effort: Effort
) -> tuple[dict[str, object], list[Gate]]:
    found = ours(octree, rays)
    comparison = compare_hits.compare(
        found, HitArrays(*embree.closest_hit(rays.origins, rays.directions)), mesh.vertices, mesh.faces, rays
    )
    judged = compare_hits.judge(comparison, mesh.vertices, mesh.faces, most=len(rays))
    sample = _sample(rays, effort.exact)
    picked = rays.select(sample)
    errors = compare_hits.exact_errors(
        HitArrays(found.t[sample], found.face[sample]),
        exact.closest_hits(mesh.vertices, mesh.faces, picked.origins, picked.directions),
        mesh.vertices,
        mesh.faces,
        picked,
    )
    occluded = octree.any_hit(rays.origins, rays.directions)
    differing = int(np.count_nonzero(occluded != found.hit))
    subject = f"{name}, {rays.name} rays"
    gates = [
        _gate(subject, "rays on which we are wrong", judged.ours_wrong, 0, "exact arithmetic says so"),
        _gate(subject, "of the exact sample, rays on which we are wrong", errors.wrong, 0, "exact arithmetic says so"),
        _gate(subject, "any-hit differs from closest hit", differing, 0, "the two have one definition of a hit"),
    ]
    if rays.name in UNAIMED:
        near_edge = judged.verdicts[compare_hits.NEAR_EDGE] + errors.near_edge
        gates.append(_gate(subject, "rays within float64 rounding of an edge", near_edge, 0, "nothing aims there"))
    record = {
        "mesh": name,
        "faces": len(mesh.faces),
        "embree": _shortened(judged.record()),
        "exact": _shortened(errors.record()),
        "any_hit_differs": differing,
    }
    return record, gates


def _sample(rays: RayBatch, count: int) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    if len(rays) <= count:
        return np.arange(len(rays))
    return np.sort(np.random.default_rng(SEED).choice(len(rays), count, replace=False))


def _gate(subject: str, quantity: str, value: float, threshold: float, reason: str) -> Gate:
    return Gate("hits", subject, quantity, float(value), "at most", threshold, reason)


# Disagreements that a report shows one by one; all are counted.
_LISTED = 5


def _shortened(record: dict[str, object]) -> dict[str, object]:
    """The record with its first few disagreements only."""
    return {k: list(v)[:_LISTED] if isinstance(v, list | tuple) else v for k, v in record.items()}


def closed_meshes() -> dict[str, Mesh]:
    """Closed meshes and a place within from which every ray must hit: a miss is a leak."""
    ring = torus(1.0, 0.4, 400, 125)
    return {"icosphere 6": icosphere(6), "torus": ring}


def _leaks(effort: Effort, step: Callable[[str], None]) -> tuple[list[dict[str, object]], list[Gate]]:
    """Rays from inside a closed mesh at its edges and vertices: ours and Embree's two modes.

    Ours are aimed in float64, or no float64 kernel could leak; Embree gets the same rays as float32 can hold them.
    """
    records: list[dict[str, object]] = []
    found = []
    for name, mesh in closed_meshes().items():
        octree = Octree.from_mesh(mesh)
        modes = {f"embree_{m}": Embree(mesh.vertices, mesh.faces, robust=m == "robust") for m in ("robust", "default")}
        for rays in leak_rays(mesh.vertices, mesh.faces, effort.leaks, SEED):
            step(f"leaks: {name}, {rays.name}")
            inside = _from_ring_core(rays) if name == "torus" else rays
            missed = ~octree.closest_hit(inside.origins, inside.directions).hit
            missed |= ~octree.any_hit(inside.origins, inside.directions)
            record: dict[str, object] = {
                "mesh": f"{name} ({len(mesh.faces):,} faces)",
                "rays": len(rays),
                "kind": rays.name,
                "ours": int(np.count_nonzero(missed)),
            }
            for mode, embree in modes.items():
                record[mode] = int(np.count_nonzero(embree.closest_hit(inside.origins, inside.directions)[1] < 0))
            records.append(record)
            subject = f"{record['mesh']}, {rays.name} rays from inside"
            found.append(_gate(subject, "leaks", float(missed.sum()), 0, "a closed mesh has no holes"))
    return records, found


def _from_ring_core(rays: RayBatch) -> RayBatch:
    """The same targets from the circle in the middle of the tube of ``torus(1, ...)``."""
    targets = rays.origins + rays.directions
    along = np.hypot(targets[:, 0], targets[:, 2])
    origins = np.stack([targets[:, 0] / along, np.zeros(len(along)), targets[:, 2] / along], axis=1)
    return RayBatch(rays.name, origins, targets - origins)

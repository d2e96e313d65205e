"""The drop-in for trimesh beside trimesh's own two intersectors: all hits of rays of five families, judged exactly."""

from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.trimesh_ray import RayMeshIntersector
from validation.job import Job
from validation.oracle.contacts import Contact, contacts
from validation.queries.shapes import families, shapes
from validation.references.trimesh_intersectors import intersectors

_SEED = 2504
OURS = "ours"
# How far a place may be from the exact one, in the mesh's largest coordinate: 2^13 units of its last place, 1e-12. Ours
# errs by few; trimesh goes from the origin by a quotient of rounded products, and starts again behind each hit.
PLACE = 2.0**-40
FAULTS = ("number", "faces", "places")


def check_drop_in(count: int, job: Job) -> list[dict[str, Any]]:
    """Two rows for each family of rays, ``count`` through each mesh, as made and moved: the rays that each caster
    answers wrongly, by their first fault: the number of hits, a face, a place.
    """
    casters, rng, rows = {OURS: RayMeshIntersector, **intersectors()}, np.random.default_rng(_SEED), []
    for family, aim in families().items():
        job.step(f"queries: the drop-in for trimesh, {family}")
        for where, meshes in shapes().items():
            faults = {name: dict.fromkeys(FAULTS, 0) for name in casters}
            for mesh in meshes:
                origins, directions = aim(mesh, rng, count)
                vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces, np.int32)
                expected = [contacts(vertices, faces, *ray) for ray in zip(origins, directions, strict=True)]
                for name, caster in casters.items():
                    for fault in _faults(caster(mesh), origins, directions, expected):
                        faults[name][fault] += 1
            rows.append({"subject": f"drop-in, {where}: {family}", "meshes": len(meshes), "asked": count * len(meshes),
                         "faults": faults, "wrong": sum(faults[OURS].values())})  # fmt: skip
    return rows


def _faults(
    caster: Any, origins: NDArray[np.float64], directions: NDArray[np.float64], expected: list[list[Contact]]
) -> list[str]:
    """The first fault of each ray that is answered wrongly."""
    with np.errstate(all="ignore"):  # trimesh divides by normals of length 0, and squares large coordinates
        places, rays, faces = caster.intersects_location(origins, directions, multiple_hits=True)
    places = np.reshape(places, (-1, 3))
    largest = np.abs(caster.mesh.bounds).max()
    found = []
    for row, contacts_of_ray in enumerate(expected):
        own = np.flatnonzero(rays == row)
        own = own[np.argsort((places[own] - origins[row]) @ directions[row], kind="stable")]
        fault = _fault(faces[own].tolist(), contacts_of_ray)
        if fault is None and len(own):
            exact = [_place(origins[row], directions[row], contact.t) for contact in contacts_of_ray]
            off = np.abs(places[own] - exact).max()
            fault = None if off <= PLACE * largest else "places"
        if fault is not None:
            found.append(fault)
    return found


def _fault(faces: list[int], expected: list[Contact]) -> str | None:
    """Whether there are more or fewer hits than contacts, or a face that none of those at that distance has."""
    if len(faces) != len(expected):
        return "number"
    for face, contact in zip(faces, expected, strict=True):
        if not any(face in other.faces for other in expected if other.t == contact.t):
            return "faces"
    return None


def _place(origin: NDArray[np.float64], direction: NDArray[np.float64], t: Fraction) -> list[float]:
    return [float(Fraction(o) + t * Fraction(d)) for o, d in zip(origin.tolist(), direction.tolist(), strict=True)]

"""All hits of rays through solids at corners, edges and between: ours against exact contacts, others beside."""

from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.octree import Octree
from validation.job import Job
from validation.oracle.contacts import Contact, contacts
from validation.queries.peers import peers
from validation.queries.places import places_of_faces
from validation.queries.solids import Solid, solids

Floats = NDArray[np.float64]
_SEED = 2043


def check_contacts(count: int, job: Job) -> list[dict[str, Any]]:
    """A row for each solid: the number of rays, and the wrong answers of ours and of others."""
    rows, rng = [], np.random.default_rng(_SEED)
    for solid in solids():
        job.step(f"queries: all hits, {solid.name}")
        origins, directions, targets = _rays(solid, rng, count)
        mesh = solid.mesh()
        expected = [contacts(mesh.vertices, mesh.faces, *ray) for ray in zip(origins, directions, strict=True)]
        numbers = np.array([len(found) for found in expected])
        others = {name: int((peer(mesh.vertices, mesh.faces).count_hits(origins, directions) != numbers).sum())
                  for name, peer in peers().items() if hasattr(peer, "count_hits")}  # fmt: skip
        rows.append({"subject": f"all hits: {solid.name}", "asked": count,
                     "wrong": int((_wrong(mesh, origins, directions, expected)
                                   | _unseen(mesh, origins, directions, targets, expected)).sum()), "beside": count,
                     "others": others})  # fmt: skip
    return rows


def _rays(solid: Solid, rng: Generator, count: int) -> tuple[Floats, Floats, Floats]:
    """Rays from whole points through corners, middles of edges and faces, with slopes that float64 holds exactly.

    Returns origins, directions, and those places.
    """
    targets = places_of_faces(solid.mesh().triangles, rng, count)
    directions = rng.integers(-4, 5, (count, 3)).astype(np.float64)
    directions[rng.random((count, 3)) < 0.3] = 0.0
    directions[np.arange(count), rng.integers(0, 3, count)] = rng.choice([-4.0, 4.0], count)
    return targets - directions * rng.integers(0, 9000, (count, 1)), directions, targets


def _unseen(
    mesh: Mesh, origins: Floats, directions: Floats, targets: Floats, expected: list[list[Contact]]
) -> NDArray[np.bool_]:
    """Whether the answer is wrong to whether origin and target see each other: nothing lies strictly between."""
    axis = np.abs(directions).argmax(axis=1)
    rows = np.arange(len(axis))
    ends = (targets - origins)[rows, axis] / directions[rows, axis]
    seen = np.array([not any(0 < contact.t < end for contact in found)
                     for found, end in zip(expected, ends.tolist(), strict=True)])  # fmt: skip
    octree = Octree.from_mesh(mesh)
    return (octree.visible(origins, targets) != seen) | (octree.visible(targets, origins) != seen)


def _wrong(mesh: Mesh, origins: Floats, directions: Floats, expected: list[list[Contact]]) -> NDArray[np.bool_]:
    """Rays of which the contacts' faces and t, or their number, are not the exact ones; or another query differs."""
    octree = Octree.from_mesh(mesh)
    met, closest = octree.all_hits(origins, directions), octree.closest_hit(origins, directions)
    wrong = octree.count_hits(origins, directions) != [len(found) for found in expected]
    wrong |= octree.any_hit(origins, directions) != (met.counts > 0)
    for i, found in enumerate(expected):
        rows = slice(*met.offsets[i : i + 2])
        wrong[i] |= met.t[rows].tolist() != [float(contact.t) for contact in found]
        wrong[i] |= met.face[rows].tolist() != [contact.faces[0] for contact in found]
        wrong[i] |= bool(found) and (closest.t[i], closest.face[i]) != (float(found[0].t), found[0].faces[0])
    return wrong

"""The section on queries: inside, distance, all hits and the drop-in for trimesh against exact arithmetic, with other
libraries beside ours.
"""

from typing import Any, NamedTuple

from validation.gates import Gate
from validation.job import Job
from validation.queries.contacts import check_contacts
from validation.queries.distances import ULPS, check_distances, meshes
from validation.queries.drop_in import check_drop_in
from validation.queries.inside import check_inside
from validation.queries.peers import peers
from validation.queries.shapes import families
from validation.queries.solids import solids


class QueryEffort(NamedTuple):
    """Points asked whether they lie inside, random and nasty, and how many of each kind others are asked; points whose
    distance is asked, for each mesh; rays through each solid; and rays of each family through each of trimesh's meshes.
    """

    random: int
    nasty: int
    beside: int
    distances: int
    rays: int
    drop_in: int


QUICK = QueryEffort(200_000, 60_000, 400, 60, 60, 4)
FULL = QueryEffort(10_080_000, 1_008_000, 4_000, 400, 500, 24)
_REASON = "exact: integer or rational arithmetic"
_DISTANCE = (
    f"within {ULPS} ulp of the exact distance, nearer than 2^-64 of the reach 2^-90 of it; 0 on the surface only"
)


def steps(job: Job) -> int:
    """Number of calls of ``job.step``: two for each solid, one for each mesh whose distance is asked, and one for each
    family of rays that the drop-in is asked.
    """
    return 2 * len(solids()) + len(meshes()) + len(families())


def run(job: Job) -> tuple[dict[str, Any], list[Gate]]:
    """Ask all questions; returns a record for JSON, and for each row a gate that no answer of ours is wrong."""
    return judge(QUICK if job.quick else FULL, job)


def judge(effort: QueryEffort, job: Job) -> tuple[dict[str, Any], list[Gate]]:
    """``run`` with so much effort."""
    inside = check_inside(effort.random, effort.nasty, effort.beside, job)
    distances = check_distances(effort.distances, job)
    contacts = check_contacts(effort.rays, job)
    drop_in = check_drop_in(effort.drop_in, job)
    rows = [*inside, *distances, *contacts]
    gates = [
        *_gates(inside, _REASON, "Octree.contains"),
        *_gates(distances, _DISTANCE, "Octree.closest_point"),
        *_gates(contacts, _REASON, "Octree.all_hits", "Octree.count_hits", "AllHits"),
        *_gates(drop_in, _REASON, "trimesh_ray.RayMeshIntersector.intersects_location"),
    ]
    costs = dict.fromkeys(("exact arithmetic", *peers()))
    return {"rows": rows, "drop_in": drop_in, "peers": list(peers()), "costs": costs}, gates


def _gates(rows: list[dict[str, Any]], reason: str, *judged: str) -> list[Gate]:
    """A gate for each row, on the public names that its answers are of."""
    return [
        Gate("queries", row["subject"], "wrong answers", float(row["wrong"]), "at most", 0.0, reason, judged)
        for row in rows
    ]

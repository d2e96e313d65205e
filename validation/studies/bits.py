"""Every bit of occlusion against Embree; where they differ, exact arithmetic says who is wrong."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.octree import Octree
from renderer.studies import face_points, fibonacci_sphere, occlusion
from validation.oracle.exact import closest_hits
from validation.references.embree import Embree
from validation.studies.bodies import bodies

Floats = NDArray[np.float64]
_SEED = 2044
# Embree's rays start so far off their face, as a share of the mesh: it has no other way to leave one.
_OFF = 1e-5
# Exact rays start on the face itself, which they must not meet: they begin behind it, nearer than any other face is.
_BEGIN = 1e-9
# Rounding decides on which side of its horizon a direction lies: nearer to it than this, either will do.
_LEVEL = 1e-12
# Of the bits on which both agree, so many are judged too.
_SAMPLE = 300


def check_bits(name: str, points: int, directions: int) -> dict[str, Any]:
    """A row: the number of bits, those that Embree has otherwise, and the wrong ones of each, by exact arithmetic."""
    mesh = bodies()[name]
    rng = np.random.default_rng(_SEED)
    place = face_points(mesh)
    rows = np.sort(rng.choice(len(place.points), min(points, len(place.points)), replace=False))
    start, normal, face = place.points[rows], place.normals[rows], place.faces[rows]
    ways = fibonacci_sphere(directions).directions
    packed: Any = occlusion(Octree.from_mesh(mesh), start, normal, ways, leaving=face, packed=True)
    ours = np.unpackbits(packed, axis=-1, count=directions).astype(np.bool_)
    height = normal @ ways.T
    point, way = np.nonzero(height > _LEVEL)
    theirs = _embree(mesh, start, normal, ways, point, way)
    differing = np.flatnonzero(ours[point, way] != theirs)
    judged = np.union1d(differing, rng.choice(len(point), min(_SAMPLE, len(point)), replace=False))
    truth = hidden_exactly(mesh, start[point[judged]], ways[way[judged]])
    below = int((~ours[height < -_LEVEL]).sum())
    wrong = int((ours[point[judged], way[judged]] != truth).sum()) + below
    return {"subject": f"bits: {name}", "asked": ours.size, "differing": len(differing), "judged": len(judged),
            "wrong": wrong, "embree_wrong": int((theirs[judged] != truth).sum()),
            "hidden": float(ours.mean())}  # fmt: skip


def hidden_exactly(mesh: Mesh, origins: Floats, directions: Floats) -> NDArray[np.bool_]:
    """Whether each ray meets a face farther away than ``_BEGIN`` of the mesh's size; directions are unit vectors."""
    begin = _BEGIN * float(mesh.extent.max())
    hits = closest_hits(mesh.vertices, mesh.faces, origins, directions, t_min=begin)
    return np.array([hit is not None for hit in hits], np.bool_)


def _embree(mesh: Mesh, start: Floats, normal: Floats, ways: Floats, point: Any, way: Any) -> NDArray[np.bool_]:
    off = start + _OFF * float(mesh.extent.max()) * normal
    embree = Embree(mesh.vertices, mesh.faces)
    parts = np.array_split(np.arange(len(point)), max(1, len(point) // 1_000_000))
    return np.concatenate([embree.any_hit(off[point[part]], ways[way[part]]) for part in parts])

"""The first hits of rays from one place, which may lie on the surface: where a scanner stands."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.distance.closest import closest_point
from renderer.distance.on_surface import on_surface
from renderer.mesh.mesh import Mesh, face_normals
from renderer.octree import Octree
from renderer.queryable import Built, Queries
from renderer.rayscene.built import BuiltScene
from renderer.rayscene.hits import SceneHits
from renderer.results.hits import Hits
from renderer.studies.share import Snapshot
from renderer.trace.batch import Leaving, check_rays, offset_origins
from renderer.trace.closest import closest_hits
from renderer.trace.starts.cone import HOLDERS_WORDS
from renderer.trace.starts.record import ALL, ANCHOR, CODE, FACE, HEAD, IGNORED, MASK, ROW, WAY
from renderer.trace.starts.search import side_taken
from renderer.trace.walk import stack_size

Floats = NDArray[np.float64]


def hits_from_stand(
    surfaces: Queries | Snapshot, place: Floats, directions: Floats, reach: Floats, normal: Floats | None
) -> Hits | SceneHits:
    """The first hits of rays (k, 3) from a place: if on the surface, on the side of the normal or the outer side."""
    built, threads = surfaces._built, surfaces.threads
    row = _row_at(built, place, threads)
    if row[FACE] < 0.0:
        return surfaces.closest_hit(place, directions, t_max=reach)
    own, face = _mesh_with(built, int(row[FACE]))
    # rule: outer-side-of-scanner
    outer = face_normals(own.vertices[own.faces[face : face + 1]])[0] if normal is None else normal
    own, face = _take_side(built, row, outer)
    count, code = len(directions), row[[CODE]].astype(np.int64)
    leaving = Leaving(np.full(count, face), code, np.tile(row[ANCHOR : ANCHOR + 3], (count, 1)))
    rays, _ = check_rays(place, directions, 0.0, reach)
    rays = offset_origins(rays, leaving, own, built.tree.scale, threads)
    rows = rays.starts[HEAD:].view(np.float64).reshape(count, ROW)
    rows[:, FACE], rows[:, WAY : WAY + 3], rows[:, MASK], rows[:, IGNORED] = row[FACE], outer, ALL, -1.0
    hits = closest_hits(built.tree, built.mesh, threads, *rays)
    return SceneHits(hits, built) if isinstance(built, BuiltScene) else hits


def _row_at(built: Built | BuiltScene, place: Floats, threads: int) -> Floats:
    """The row of ``starts.record`` of a start at a place; its face is -1 where that is on no surface."""
    row, tree, mesh, near = np.zeros(ROW), built.tree, built.mesh, -1
    row[FACE] = -1.0
    if isinstance(built, BuiltScene):
        if not len(mesh.faces):
            return row
        near = int(closest_point(tree, mesh, place[None], np.inf, threads, built.counted(None)).face[0])
        # The nearest face alone, which is the one that the place is on, if it is on any.
        mesh, tree = Octree.from_mesh(_mesh_with(built, near)[0])._built
    face, code, anchor = (part[0] for part in on_surface(tree, mesh, place[None], np.full(1, -1), threads))
    row[FACE], row[CODE], row[ANCHOR : ANCHOR + 3] = near if near >= 0 and face >= 0 else face, code, anchor
    return row


def _take_side(built: Built | BuiltScene, row: Floats, normal: Floats) -> tuple[Mesh, int]:
    """Write the face and the side of a start that a normal selects. Returns a mesh with the face, and its number."""
    stack, memory = np.empty(stack_size(built.tree.depth), np.int64), np.empty(HOLDERS_WORDS, np.int64)
    own, _ = _mesh_with(built, int(row[FACE]))
    side_taken(built.tree.descriptor, own.vertices, own.faces, row, tuple(normal.tolist()), stack, memory)
    return _mesh_with(built, int(row[FACE]))


def _mesh_with(built: Built | BuiltScene, face: int) -> tuple[Mesh, int]:
    """A mesh that has a face, and the face's number in it: of a scene a mesh of that face alone."""
    if isinstance(built, BuiltScene):
        return built.mesh_of(np.array([face]))[0], 0
    return built.mesh, face

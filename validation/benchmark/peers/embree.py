"""Embree through ``embreex``, as a contender. It traces on one thread: the wrapper's loop does not allow more.

``validation.references.embree`` judges hits and converts on every call; here rays and results stay in embreex's float32
arrays.
"""

from typing import Any

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray

from validation.benchmark.peers.contender import Faces, Family, Floats, Peer, Query, System

# Where nothing is hit, Embree leaves the input value in t; the face distinguishes hits from misses.
_NO_FACE = -1


class EmbreePeer(Peer):
    """A scene of one mesh, robust as ours is; its first query builds it."""

    def __init__(self, vertices: NDArray[np.float32], faces: Faces) -> None:
        self._scene = EmbreeScene(robust=True)
        TriangleMesh(self._scene, vertices, faces)
        self._ray = np.zeros((1, 3), np.float32), np.array([[0, 0, 1]], np.float32)

    def closest(self, rays: Family) -> Query:
        """t, u, v, normal and face of each ray; embreex has no smaller query."""
        o, d, far = _native(rays)
        return Query(lambda: self._scene.run(o, d, dists=far, query="INTERSECT", output=True), _t)

    def any(self, rays: Family) -> Query:
        """Embree's occlusion query."""
        o, d, far = _native(rays)
        return Query(lambda: self._scene.run(o, d, dists=far, query="OCCLUDED"), lambda face: face > _NO_FACE)

    def touch(self) -> None:
        """Trace one ray."""
        self._scene.run(*self._ray, query="OCCLUDED")


def systems() -> list[System]:
    """The one contender of embreex."""
    return [System("embree", "Embree (embreex)", 1, "float32", _builder)]


def _builder(vertices: Floats, faces: Faces) -> Any:
    points, triangles = vertices.astype(np.float32), np.ascontiguousarray(faces, np.int32)
    return lambda: EmbreePeer(points, triangles)


def _native(rays: Family) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
    # embreex's own default where no distance is given.
    far = 1e37 if np.isinf(rays.t_max) else rays.t_max
    return rays.origins.astype(np.float32), rays.directions.astype(np.float32), np.full(len(rays), far, np.float32)


def _t(found: dict[str, Any]) -> Floats:
    t: Floats = np.where(found["primID"] > _NO_FACE, found["tfar"].astype(np.float64), np.inf)
    return t

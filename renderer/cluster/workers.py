"""What a worker keeps: the meshes that it was sent, with their trees, which it builds once each."""

from __future__ import annotations

import threading
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.octree import Octree

# The trees of a worker, by the digests of their meshes; the latest ones, because a worker serves many runs.
_MOST = 2
_TREES: dict[str, Octree] = {}
_LOCK = threading.Lock()


class SentMesh(NamedTuple):
    """A mesh as it travels: its digest, vertices (V, 3) float64, faces (F, 3) int32, and the tree's split rule."""

    digest: str
    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    split: Literal["midpoint", "sah"]

    def octree(self) -> Octree:
        """The tree over it, from this process's own or built now, whose queries take one thread each.

        Other threads that need it wait.
        """
        key = f"{self.digest} {self.split}"
        with _LOCK:
            if key not in _TREES:
                while len(_TREES) >= _MOST:
                    del _TREES[next(iter(_TREES))]
                # Arrays that came over the wire cannot be written, which kernels would be compiled anew for.
                mesh = Mesh(np.array(self.vertices), np.array(self.faces))
                _TREES[key] = Octree.from_mesh(mesh, split=self.split, threads=1)
            return _TREES[key]


def answer_part(mesh: SentMesh, study: Any, points: Any) -> NDArray[np.float64]:
    """The answers to a study's part; a task."""
    answers: NDArray[np.float64] = study.answer(mesh.octree(), points, threads=1)
    return answers

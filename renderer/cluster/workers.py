"""The meshes and scenes that a worker keeps, each with the tree that it builds once."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.split import Split
from renderer.checkpoints.pictures import Picture
from renderer.mesh.mesh import Mesh
from renderer.octree import Octree
from renderer.picture.prepare import PreparedScene, prepare_scene
from renderer.scene.needs import Features
from renderer.scene.scene import Scene

# The trees of a worker and what goes with them, by digests of what they are made of; the latest ones, because a worker
# serves many runs.
_MOST = 2
_TREES: dict[str, Any] = {}
_LOCK = threading.Lock()


class SentMesh(NamedTuple):
    """A mesh as it travels: its digest, vertices (V, 3) float64, faces (F, 3) int32, and the tree's split rule."""

    digest: str
    vertices: NDArray[np.float64]
    faces: NDArray[np.int32]
    split: Split

    def octree(self) -> Octree:
        """The tree over it, from this process's own or built now, whose queries take one thread each.

        Other threads that need it wait.
        """

        def build() -> Octree:
            # Arrays that came over the wire cannot be written, which kernels would be compiled anew for.
            mesh = Mesh(np.array(self.vertices), np.array(self.faces))
            return Octree.from_mesh(mesh, split=self.split, threads=1)

        octree: Octree = kept(f"{self.digest} {self.split}", build)
        return octree


class SentScene(NamedTuple):
    """A scene as it travels: its digest, itself with its meshes in the world, what is to be ready, and its tree's kind.

    ``digest`` is that of ``renderer.checkpoints.pictures.digest_of_scene``, and the rest as ``renderer.render`` has it.
    """

    digest: str
    scene: Scene
    needs: Features
    accelerator: str
    split: Split

    def prepared(self) -> PreparedScene:
        """The scene made ready, from this process's own or now. Other threads that need it wait."""

        def prepare() -> PreparedScene:
            return prepare_scene(self.scene, self.needs, self.accelerator, self.split, threads=1)

        prepared: PreparedScene = kept(f"{self.digest} {self.needs} {self.accelerator} {self.split}", prepare)
        return prepared


class SentStudy(NamedTuple):
    """A study as it travels, once for all its parts: the digest of its mesh, the mesh, and itself with its options,
    some of which have a number for each face.
    """

    digest: str
    mesh: SentMesh
    study: Any


def kept(key: str, make: Callable[[], Any]) -> Any:
    """The value that this process has under a key, or makes while other threads wait; ``make`` must not call this."""
    with _LOCK:
        if key not in _TREES:
            while len(_TREES) >= _MOST:
                del _TREES[next(iter(_TREES))]
            _TREES[key] = make()
        return _TREES[key]


def evaluate_part(sent: SentStudy, points: Any) -> NDArray[np.float64]:
    """The answers to a study's part; a task."""
    answers: NDArray[np.float64] = sent.study.evaluate(sent.mesh.octree(), points, threads=1)
    return answers


def render_rows(scene: SentScene, picture: Picture, begin: int, end: int) -> NDArray[np.uint8]:
    """Some rows of a picture; a task."""
    return picture.rows(scene.prepared(), begin, end, threads=1)

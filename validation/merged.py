"""Scenes whose hits name the faces of one mesh, and the ways to make them."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import box
from renderer.rayscene.scene import RayScene
from renderer.trace.layout import MASK_BITS
from validation.oracle.placing import Body

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Along each axis, how much larger than its mesh a part stands in the scene.
_STRETCHES = np.array([(1.0, 1.0, 1.0), (-0.5, 2.0, 4.0), (8.0, 0.25, 1.0)])


class MergedHits:
    """Hits of a scene, with ``face`` as that of the mesh that its placed meshes make together."""

    def __init__(self, found: Any, face: Ints) -> None:
        self.found, self.face = found, face

    def __getattr__(self, name: str) -> Any:
        return getattr(self.found, name)


class Merged:
    """A scene that numbers the faces of its hits as ``oracle.placing.placed`` does; its rays have one mask."""

    def __init__(self, scene: RayScene, bodies: list[Body], mask: int = MASK_BITS) -> None:
        self.scene, self._mask = scene, mask
        objects, ends = (
            scene.objects[: len(bodies)],
            np.cumsum([len(body.faces) * len(body.matrices) for body in bodies]),
        )
        self._faces = np.zeros(max(scene.objects) + 1, np.int64)
        # What no ray should see is beyond all faces.
        self._first = np.full(len(self._faces), ends[-1])
        self._faces[objects] = [len(body.faces) for body in bodies]
        self._first[objects] = [0, *ends[:-1]]

    def closest_hit(self, origins: Floats, directions: Floats, leaving: Any = None, **options: Any) -> MergedHits:
        """``RayScene.closest_hit``."""
        left = leaving.found if isinstance(leaving, MergedHits) else leaving
        options = {"mask": self._mask, "leaving": left, **options}
        return self.merged(self.scene.closest_hit(origins, directions, **options))

    def any_hit(self, origins: Floats, directions: Floats) -> NDArray[np.bool_]:
        """``RayScene.any_hit``."""
        return self.scene.any_hit(origins, directions, mask=self._mask)

    def closest_point(self, points: Floats) -> MergedHits:
        """``RayScene.closest_point``."""
        return self.merged(self.scene.closest_point(points))

    def merged(self, found: Any) -> MergedHits:
        """The faces that a query of the scene found, -1 for none."""
        number = self._first[found.object] + found.instance * self._faces[found.object] + found.face
        return MergedHits(found, np.where(found.object >= 0, number, -1))


def made(bodies: list[Body]) -> Merged:
    """A scene of all bodies."""
    scene = RayScene()
    for body in bodies:
        scene.add(Mesh(body.vertices, body.faces), body.matrices)
    return Merged(scene, bodies)


def changed(bodies: list[Body]) -> Merged:
    """The same scene, made of other vertices and matrices, with more objects, and queried before each change."""
    scene = RayScene()
    ray = np.zeros(3), np.ones(3)
    extra = scene.add(box((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0)))
    for body in bodies:
        object_ = scene.add(Mesh(body.vertices[::-1] * 3.0, body.faces), np.roll(body.matrices, 1, axis=0) + 0.25)
        scene.closest_hit(*ray)
        scene.refit(object_, body.vertices)
        scene.closest_hit(*ray)
        scene.move(object_, body.matrices[::-1] - 0.25)
        scene.show(object_, False)
        for some in (np.arange(first, len(body.matrices), 2) for first in (0, 1)):
            scene.closest_hit(*ray)
            scene.move(object_, body.matrices[some], instances=some)
        scene.show(object_)
    scene.remove(extra)
    return Merged(scene, bodies)


def parted(vertices: ArrayLike, faces: ArrayLike, masked: bool = False) -> Merged:
    """A scene of three parts of a mesh, each stretched and mirrored by powers of two and placed back where it was.

    With ``masked`` each part is there twice, and rays see one of both.
    """
    corners, bodies = np.asarray(vertices, np.float64), []
    for part, stretch in zip(np.array_split(np.asarray(faces), len(_STRETCHES)), _STRETCHES, strict=True):
        if len(part):
            order = [0, 2, 1] if np.prod(stretch) < 0.0 else [0, 1, 2]
            back = np.concatenate([np.diag(stretch), np.zeros((3, 1))], axis=1)[None]
            bodies.append(Body(corners / stretch, part[:, order], back))
    if not masked:
        return made(bodies)
    scene = RayScene()
    for mask in (1, 2):
        for body in bodies:
            scene.add(Mesh(body.vertices, body.faces), body.matrices, mask=mask)
    return Merged(scene, bodies, mask=1)

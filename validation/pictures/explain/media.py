"""Pixels that the rule for media decides: a stack of the bodies that a ray is in, or the side of the normal.

The rule for the stack is written here a second time, in plain Python. A ray enters a body where it meets a face from in
front, and leaves it from behind. The body that it entered last holds, and of those entered at one place the one that is
later in the scene. Faces that coincide are crossed together: bodies are entered before others are left, and an opaque
face among them stops the ray. A body that the ray never entered is left from its own index.
"""

from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.diagnostics.ray_step import steps_of
from renderer.materials.base import appearance_of
from renderer.materials.registry import Material
from renderer.picture.prepare import PreparedScene
from renderer.scene.scene import Scene
from validation.oracle.inside import winding_number
from validation.pictures.explain.optics import wrong_rays
from validation.pictures.explain.ours import Ours
from validation.pictures.explain.pixels import wrong_sum
from validation.pictures.explain.planes import Planes
from validation.references.ray_tree import Node

# Faces coincide up to roundings of their corners: some 2^10 float64 roundings of the coordinates.
_NEAR = 2.0**-42

# Why the rules may differ: what lets a ray be in a body twice, or in two of them. A mesh may overlap itself.
OPEN, OVERLAPPING, COINCIDING = "open glass", "overlapping glass", "coinciding faces"
INTERPOLATED = "an interpolated normal turned away from the ray"
WHYS = (OPEN, OVERLAPPING, COINCIDING, INTERPOLATED)


class Ruled(NamedTuple):
    """A pixel that differs between the rules: why it may, or None where no geometry lets it; and what is wrong."""

    row: int
    column: int
    why: str | None
    wrong: str | None


class _Body(NamedTuple):
    """A body that a ray is in: the number of its instance, its index of refraction, and its material."""

    instance: int
    ior: float
    material: str


class MediaJudge:
    """Judges the pixels that differ between both rules, on a scene with one ray a pixel."""

    def __init__(self, prepared: PreparedScene, resolution: tuple[int, int]) -> None:
        scene = prepared.scene
        self._scene, self._width = scene, resolution[0]
        self._ours = Ours(steps_of(prepared), scene.render.max_depth, scene.render.shadows)
        triangles = [i.mesh.vertices[i.mesh.faces] for i in scene.instances]
        self._corners = np.concatenate([*triangles, np.zeros((0, 3, 3))])
        self._planes = Planes(self._corners)
        self._owner = np.repeat(np.arange(len(triangles)), [len(one) for one in triangles])

    def judge(self, picture: NDArray[np.floating], pixels: Sequence[tuple[int, int]]) -> list[Ruled]:
        """The geometry that lets pixels of our picture by the stack differ from that by the normal, and what is wrong
        in their rays by the rule for the stack.
        """
        found = []
        resolution = self._width, len(picture)
        around = self._around(np.asarray(self._scene.camera.eye))
        for row, column in pixels:
            tree = self._ours.pixel(self._scene.camera, resolution, row, column)
            said = [*wrong_sum(tree, picture[row, column]), *self._walk(tree, around)]
            wrong = next((text for text in said if text not in WHYS), None)
            found.append(Ruled(row, column, next(iter(said), None) if wrong is None else None, wrong))
        return found

    def _walk(self, node: Node, media: tuple[_Body, ...], turned: bool = False) -> Iterator[str]:
        """Yields the reasons that let the rules differ along a tree, and the faults there.

        turned : whether an interpolated normal has shown the ray the other side of its face before.
        """
        after = media
        if node.face >= 0:
            met, sure = self._together(node)
            clear = [self._material(face).passes_light for face in met]
            if len(met) > 1 and any(clear):
                yield COINCIDING
            if not sure and any(clear):
                # At an edge of a face that coincides: whether the ray is within that one float64 may not know.
                return
            if not all(clear) and (node.indices is not None or "refracted" in node.children):
                yield f"face {node.face}: an opaque face among those that coincide does not stop the ray"
            elif node.indices is not None:
                crossed = [(self._body(face), self._enters(node, face)) for face in met]
                after, indices = _crossed(media, crossed)
                yield from self._compared(node, media, indices, together=len(met) > 1, turned=turned)
                turned = turned or self._enters(node, node.face) != (float(node.direction @ node.normal) <= 0.0)
            if node.depth < self._ours.max_depth:
                yield from wrong_rays(node, self._material(node.face))
        for kind, child in node.children.items():
            yield from self._walk(child, after if kind == "refracted" else media, turned)

    def _material(self, face: int) -> Material:
        return self._scene.materials[self._body(face).material]

    def _compared(
        self, node: Node, media: tuple[_Body, ...], indices: tuple[float, float], *, together: bool, turned: bool
    ) -> Iterator[str]:
        """Whether our indices are those of the rule, and what lets them differ from those of the normal."""
        if indices != node.indices:
            yield f"face {node.face}: by the rule the indices are {indices}, and ours took {node.indices}"
        body, enters = self._body(node.face), self._enters(node, node.face)
        turned = turned or enters != (float(node.direction @ node.normal) <= 0.0)
        if not together and indices != ((1.0, body.ior) if enters else (body.ior, 1.0)):
            meshes = [self._scene.instances[one.instance].mesh for one in (*media, body)]
            is_open = any(len(mesh.open_edges) for mesh in meshes)
            yield OPEN if is_open else INTERPOLATED if turned else OVERLAPPING

    def _together(self, node: Node) -> tuple[list[int], bool]:
        """The faces at the place of a hit and in the plane of the face that was hit, ascending; and whether the place
        is within all of them, and not at an edge.
        """
        room = _NEAR * (1.0 + float(np.abs(node.point).max()))
        others = self._planes.coinciding(node, room)
        return sorted([node.face, *others]), all(depth > room for depth in others.values())

    def _enters(self, node: Node, face: int) -> bool:
        if face == node.face:
            return float(node.direction @ node.shading) <= 0.0
        a, b, c = self._corners[face]
        return float(node.direction @ np.cross(b - a, c - a)) <= 0.0

    def _body(self, face: int) -> _Body:
        instance = int(self._owner[face])
        name = self._scene.instances[instance].material
        material = self._scene.materials[name]
        look = appearance_of(material)
        return _Body(instance, 1.0 if look.blends else look.ior, name)

    def _around(self, eye: NDArray[np.float64]) -> tuple[_Body, ...]:
        """The closed glass around the eye, the largest first."""
        around = []
        for number, instance in enumerate(self._scene.instances):
            corners = instance.mesh.vertices[instance.mesh.faces]
            glass = self._scene.materials[instance.material].passes_light
            if not glass or not len(corners) or (eye < corners.min((0, 1))).any() or (eye > corners.max((0, 1))).any():
                continue
            exactly = [[[Fraction(x) for x in corner] for corner in triangle] for triangle in corners.tolist()]
            if winding_number([Fraction(x) for x in eye.tolist()], exactly):
                volume = abs(np.linalg.det(corners).sum())
                around.append((volume, number, self._body(int(np.flatnonzero(self._owner == number)[0]))))
        return tuple(body for _, _, body in sorted(around, reverse=True))


def _crossed(
    media: tuple[_Body, ...], faces: Sequence[tuple[_Body, bool]]
) -> tuple[tuple[_Body, ...], tuple[float, float]]:
    """The media beyond some faces, which are entered or left; and the indices of refraction before and beyond."""
    after, before = [*media, *(body for body, enters in faces if enters)], _index(media)
    for body, enters in faces:
        if not enters:
            last = max((k for k, one in enumerate(after) if one.material == body.material), default=None)
            if last is None:
                before = body.ior
            else:
                del after[last]
    return tuple(after), (before, _index(after))


def _index(media: Sequence[_Body]) -> float:
    return media[-1].ior if media else 1.0


def open_glass(scene: Scene) -> dict[str, int]:
    """The number of open edges of each instance of glass that has some, by its mesh and number."""
    found: dict[str, int] = {}
    for number, instance in enumerate(scene.instances):
        if scene.materials[instance.material].passes_light and len(instance.mesh.open_edges):
            found[f"{instance.mesh.name or 'mesh'} ({number})"] = len(instance.mesh.open_edges)
    return found

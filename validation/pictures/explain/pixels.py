"""The reason of each pixel that differs: rounding, a rule, a fault of the reference or of ours, or none that is known.

Where faces coincide each renderer takes one of them by a rule of its own: ours the lowest, Mitsuba's any.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from renderer.diagnostics.ray_step import steps_of
from renderer.picture.image import Image
from renderer.picture.prepare import PreparedScene
from renderer.scene.camera import primary_rays
from renderer.scene.scene import Scene
from renderer.trace.spawn import BOUNDED, MITSUBA_EPSILON, OffsetRule
from validation.oracle import exact
from validation.pictures.explain import exactly
from validation.pictures.explain.ours import Ours
from validation.pictures.explain.partings import Parting, partings
from validation.pictures.explain.step import Fault, coincide, compare
from validation.references.mitsuba.recorded import Trees
from validation.references.ray_tree import Node

Reason = Literal["rounding", "offset", "coinciding faces", "reference wrong", "ours wrong", "unexplained"]
Rule = Literal["own", "matched"]
REASONS: tuple[Reason, ...] = get_args(Reason)
_WRONG: Reason = "ours wrong"
RED: tuple[Reason, ...] = (_WRONG, "unexplained")

# A picture holds float32; its pixel's sum is that of the tree in float64: half an ulp, and as much for the sums.
STORED = 2.0**-23
# The reference adds in float32: some hundred roundings of 6e-8.
_SUMMED = 1e-5
# After so many red pixels the verdict is settled, and the others are not looked at.
SETTLED = 20
# What a hundredth of a step of an 8-bit picture receives is walked: in deep glass most rays are fainter.
_SEEN = 0.01 / 255.0
# Pixels that are looked at together.
_AT_ONCE = 256
# Less than any radiance that counts.
_LEAST = 1e-30
_MITSUBA = OffsetRule(False, MITSUBA_EPSILON)


class Pixel(NamedTuple):
    """A pixel, its reason, and what was found: where the trees part, and what differs there."""

    row: int
    column: int
    reason: Reason
    found: list[str]
    trees: tuple[Node, Node]


@dataclass(frozen=True)
class Explained:
    """The pixels that were looked at, and how many were left once the verdict was settled."""

    pixels: list[Pixel]
    left: int

    def counts(self) -> dict[str, int]:
        """The number of pixels by reason, of those that were looked at."""
        counts = Counter[str](pixel.reason for pixel in self.pixels)
        return {reason: counts[reason] for reason in REASONS}


class Explainer:
    """Explains the pixels of one scene, drawn with one ray a pixel and the media of normals, against Mitsuba's.

    >>> from renderer import prepare
    >>> from renderer.scene.camera import PerspectiveCamera
    >>> empty = Scene(camera=PerspectiveCamera(eye=(0.0, 0.0, 5.0), target=(0.0, 0.0, 0.0)), materials={})
    >>> Explainer(prepare(empty), (16, 16)).explain("own", np.zeros((16, 16, 3)), [(3, 4)]).pixels[0].reason
    'rounding'
    """

    def __init__(self, prepared: PreparedScene, resolution: tuple[int, int]) -> None:
        scene = prepared.scene
        self._scene, self._resolution = scene, resolution
        self._origins, self._directions = primary_rays(scene.camera, *resolution)
        self._mesh = _mesh_of(scene)
        self._theirs = Trees(scene, scene.render.max_depth)
        self._ours = {
            rule: Ours(steps_of(prepared, offset, "normal"), scene.render.max_depth, scene.render.shadows)
            for rule, offset in (("own", BOUNDED), ("matched", _MITSUBA))
        }

    def explain(
        self,
        rule: Rule,
        picture: NDArray[np.floating],
        pixels: Sequence[tuple[int, int]],
        theirs: NDArray[np.floating] | None = None,
    ) -> Explained:
        """The reasons of some pixels, (row, column), of our ``picture`` (h, w, 3) under an offset rule.

        theirs : the reference's picture, whose pixels are compared with the light along its rays.
        """
        looked: list[Pixel] = []
        for begin in range(0, len(pixels), _AT_ONCE):
            looked += self._explain(rule, picture, pixels[begin : begin + _AT_ONCE], theirs)
            if sum(pixel.reason in RED for pixel in looked) >= SETTLED:
                break
        return Explained(looked, len(pixels) - len(looked))

    def explains_primary(self, image: Image, row: int, column: int) -> bool:
        """Whether the first hit of a pixel is as the picture has it, and Mitsuba's but for rounding."""
        hit = self._tree("matched", row, column)
        same = hit.face == image.face[row, column] and hit.t == image.depth[row, column]
        shading = hit.face < 0 or np.abs(hit.shading - image.normal[row, column]).max() <= STORED
        return bool(same and shading) and not compare(self._their_tree(row, column), self._ours["matched"]).faults

    def _explain(
        self, rule: Rule, picture: NDArray[np.floating], pixels: Sequence[tuple[int, int]],
        theirs: NDArray[np.floating] | None,
    ) -> list[Pixel]:  # fmt: skip
        pairs = [(self._tree(rule, row, column), self._their_tree(row, column)) for row, column in pixels]
        parted = [partings(*pair) for pair in pairs]
        judged = iter(self._wrong(list(chain.from_iterable(parted))))
        found = []
        for (row, column), pair, places in zip(pixels, pairs, parted, strict=True):
            wrong = [place for place in places if next(judged)]
            faulty = list(self._ours_wrong(rule, pair[0], picture[row, column], wrong))
            if faulty:
                reason, said = _WRONG, faulty
            elif theirs is not None and not _is_sum(pair[1], theirs[row, column]):
                reason, said = "unexplained", ["the reference's picture is not the light along its rays"]
            else:
                reason, said = self._reason(rule, row, column, pair[1], places)
            found.append(Pixel(row, column, reason, [*said, *map(_parted, places)], pair))
        return found

    def _wrong(self, places: list[Parting]) -> list[bool]:
        """Whether our ray at each parting has a hit that it cannot have. Exact arithmetic knows no masks."""
        if self._ours["own"].has_masks:
            return [False] * len(places)
        # Exact arithmetic turns the mesh into whole numbers once for all.
        return exactly.wrong(places, *self._mesh)

    def _tree(self, rule: Rule, row: int, column: int) -> Node:
        return self._ours[rule].pixel(self._scene.camera, self._resolution, row, column)

    def _their_tree(self, row: int, column: int) -> Node:
        at = row * self._resolution[0] + column
        return self._theirs.tree(self._origins[at], self._directions[at])

    def _ours_wrong(
        self, rule: str, ours: Node, color: NDArray[np.floating], wrong: Sequence[Parting]
    ) -> Iterator[str]:
        """Yields the faults of our own tree, whatever Mitsuba's is."""
        yield from wrong_sum(ours, color)
        if rule == "own":
            yield from exactly.misplaced(ours, self._scene.all_lights)
        for place in wrong:
            yield f"{place.where}: no ray from there has our hit, face {place.ours.face} at {place.ours.t!r}"

    def _reason(
        self, rule: Rule, row: int, column: int, theirs: Node, parted: Sequence[Parting]
    ) -> tuple[Reason, list[str]]:
        reason, found = self._steps(theirs)
        if reason is not None:
            return reason, found
        if any(place.what == "hit" and coincide(place.ours, place.theirs) for place in parted):
            return "coinciding faces", []
        # Under Mitsuba's rule for offsets our tree does not part from theirs.
        follows = rule == "own" and not partings(self._tree("matched", row, column), theirs)
        return "offset" if follows else "rounding", []

    def _steps(self, theirs: Node) -> tuple[Reason | None, list[str]]:
        """The reason that lies in a step of theirs, None where each is ours but for rounding."""
        coinciding = []
        for where, node in _nodes(theirs, "camera", 1.0):
            found, another = compare(node, self._ours["matched"])
            if found:
                reference = all(self._is_theirs(fault, node) for fault in found)
                return "reference wrong" if reference else "unexplained", [_said(where, fault) for fault in found]
            coinciding += [f"{where}: theirs hits face {node.face} of those that coincide"] if another else []
        return ("coinciding faces", coinciding) if coinciding else (None, [])

    def _is_theirs(self, fault: Fault, node: Node) -> bool:
        """Whether exact arithmetic gives our hit for their ray, which float32 holds exactly."""
        if fault.quantity != "face" or self._ours["own"].has_masks:
            return False
        (hit,) = exact.closest_hits(*self._mesh, node.origin[None], node.direction[None])
        return fault.ours == -1 if hit is None else fault.ours in hit.faces_at_t


def wrong_sum(tree: Node, color: NDArray[np.floating]) -> Iterator[str]:
    """Says where a pixel of our picture is not the light along its rays."""
    total = tree.radiance()
    if not (np.abs(total - color) <= STORED * np.abs(total) + _LEAST).all():
        yield f"the picture has {color.tolist()}, and the light along its rays is {total.tolist()}"


def _is_sum(tree: Node, color: NDArray[np.floating]) -> bool:
    """Whether a pixel of a picture in float32 is the light along its rays."""
    total = tree.radiance()
    return bool((np.abs(total - color) <= _SUMMED * (np.abs(total) + 1.0)).all())


def _mesh_of(scene: Scene) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """The vertices and faces of all instances, in their order."""
    meshes = [instance.mesh for instance in scene.instances]
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    points = [np.asarray(mesh.vertices, np.float64) for mesh in meshes]
    faces = [mesh.faces.astype(np.int64) + start for mesh, start in zip(meshes, starts, strict=False)]
    return np.concatenate([*points, np.zeros((0, 3))]), np.concatenate([*faces, np.zeros((0, 3), np.int64)])


def _nodes(node: Node, where: str, weight: float) -> Iterator[tuple[str, Node]]:
    """The rays of a tree that the pixel receives enough of to be seen."""
    yield where, node
    for kind, child in node.children.items():
        received = weight * float(child.share.max())
        if received > _SEEN:
            yield from _nodes(child, f"{where}, {kind}", received)


def _parted(parting: Parting) -> str:
    if parting.what == "hit":
        return f"{parting.where}: ours hits face {parting.ours.face}, theirs {parting.theirs.face}"
    return f"{parting.where}: {parting.what}"


def _said(where: str, fault: Fault) -> str:
    return f"{where}: {fault.quantity}: ours {fault.ours}, theirs {fault.theirs}, at most {fault.allowed:.3g} apart"

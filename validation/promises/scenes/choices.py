"""Choices of what a ray may hit: masks, sides, ignored, hidden and removed instances, of bodies with whole corners."""

from collections.abc import Iterator
from fractions import Fraction
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import box
from renderer.rayscene.scene import RayScene
from validation.merged import Merged
from validation.oracle.contacts import Contact, contacts
from validation.oracle.placing import Body, placed
from validation.promises.row import row

Bools = NDArray[np.bool_]
Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_JUDGE = "integer arithmetic"
_COUNT, _RAYS, _FEW = 8, 160, 8
_CORNER = Mesh([[0, 0, 0], [2, 0, 0], [0, 2, 0], [0, 0, 2]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
_ALL = 2**32 - 1


class _Query(NamedTuple):
    """The options of a query beside its rays, and the faces (rays, all) that may be hit."""

    options: dict[str, Any]
    allowed: Bools


def check_choices(rng: Generator) -> list[dict[str, Any]]:
    """Boxes and corners turned, mirrored, sheared, on each other; with some hidden; and without the first ones."""
    bodies = [_body(box(), rng), _body(_CORNER, rng), _body(box(), rng)]
    masks = rng.integers(0, 16, (len(bodies), _COUNT)) + 2**31 * rng.integers(0, 2, (len(bodies), _COUNT))
    # The last body stands in a scene that stands in this one twice.
    outer = np.stack([np.eye(4), np.eye(4)[[1, 2, 0, 3]]])
    outer[1, :3, 3] = 2.0, -1.0, 3.0
    within = bodies[2].matrices[: _COUNT // 2]
    bodies[2] = bodies[2]._replace(matrices=(outer[:, None] @ _square(within)).reshape(-1, 4, 4)[:, :3])
    masks[2] = np.tile(masks[2, : _COUNT // 2], 2)
    scene, inner, world = RayScene(), RayScene(), _World(bodies, rng)
    objects = [scene.add(Mesh(*bodies[k][:2]), bodies[k].matrices, mask=masks[k]) for k in (0, 1)]
    there = inner.add(Mesh(*bodies[2][:2]), within, mask=masks[2, : _COUNT // 2])
    objects.append(scene.add_scene(inner, outer)[there])
    shown = np.ones(masks.shape, np.bool_)
    found: dict[str, list[Bools]] = {}

    def ask(kept: list[Body]) -> None:
        for query in _queries(scene, world, np.where(shown, masks, 0), rng):
            for name, good in world.judged(Merged(scene, kept), query).items():
                found.setdefault(name, []).append(good)

    ask(bodies)
    shown[:] = rng.random(masks.shape) < 0.7
    some = rng.permutation(_COUNT)[: _COUNT // 2]
    masks[1, some] = rng.integers(0, 16, len(some))
    scene.mask(objects[1], masks[1, some], instances=some)
    scene.show(objects[0], shown[0])
    for object_, flags in zip(objects[1:], shown[1:], strict=True):
        scene.show(object_, flags[some], instances=some)
        flags[np.setdiff1d(np.arange(_COUNT), some)] = True
    ask(bodies)
    scene.remove(objects[0])
    shown[0] = False
    ask(bodies[1:])
    return [row(f"a ray hits what it may: {name}", _JUDGE, np.concatenate(kept)) for name, kept in found.items()]


def _body(mesh: Mesh, rng: Generator) -> Body:
    """At whole places, turned by quarters, mirrored or sheared; the last two are alike."""
    matrices = np.zeros((_COUNT, 3, 4))
    for matrix in matrices:
        matrix[:, :3] = np.eye(3)[rng.permutation(3)] * rng.choice([-2.0, -1.0, 1.0, 2.0], 3)
        matrix[0, :3] += rng.integers(-1, 2) * matrix[1, :3]
        matrix[:, 3] = rng.integers(-4, 5, 3)
    matrices[-1] = matrices[-2]
    return Body(mesh.vertices, mesh.faces.astype(np.int64), matrices)


def _square(matrices: Floats) -> Floats:
    """Matrices (k, 3, 4) as (k, 4, 4)."""
    return np.concatenate([matrices, np.tile([[0.0, 0.0, 0.0, 1.0]], (len(matrices), 1, 1))], axis=1)


def _queries(scene: RayScene, world: "_World", masks: Ints, rng: Generator) -> Iterator[_Query]:
    """Masks one for each ray and one for all, with and without what is hit first, bounds, and sides of faces."""
    for mask in (_ALL, rng.integers(0, 16, _RAYS), 5, 2**31 + rng.integers(0, 2, _RAYS)):
        meets = (np.broadcast_to(mask, _RAYS)[:, None] & masks.ravel()) != 0
        first = scene.closest_hit(*world.rays, mask=mask)
        number = np.where(first.hit, (first.object) * _COUNT + first.instance, -1)
        passed = number[:, None] == np.arange(masks.size)
        for ignore, bounds in product((None, first), ({}, {"t_min": 0.5, "t_max": 2.0})):
            allowed = (meets if ignore is None else meets & ~passed)[:, world.instance]
            yield _Query({"mask": mask, "ignore": ignore, **bounds}, allowed)
        for side, sign in (("front", -1), ("back", 1)):
            yield _Query(
                {"mask": mask, "ignore": None, "faces": side}, meets[:, world.instance] & (world.sides == sign)
            )


class _World:
    """The placed bodies, whole rays at them, and all contacts of each."""

    def __init__(self, bodies: list[Body], rng: Generator) -> None:
        vertices, faces = placed(bodies)
        self.corners = vertices[faces]
        counts = np.repeat([len(body.faces) for body in bodies], _COUNT)
        self.instance, self.first = np.repeat(np.arange(len(counts)), counts), np.cumsum([0, *counts])[::_COUNT]
        # Slopes in fourths: float64 holds all but the last quotient.
        directions = rng.integers(-4, 5, (_RAYS, 3)).astype(np.float64)
        directions[np.arange(_RAYS), rng.integers(0, 3, _RAYS)] = rng.choice([-4.0, 4.0], _RAYS)
        back = rng.choice([0.0, 0.5, 1.0, 2.0], (_RAYS, 1), p=[0.1, 0.3, 0.3, 0.3])
        # At corners, middles of edges and places within.
        weights = np.array([(4, 0, 0), (2, 2, 0), (2, 1, 1)])[rng.integers(0, 3, _RAYS)] / 4.0
        targets = np.einsum("nk,nkx->nx", weights, self.corners[rng.integers(0, len(faces), _RAYS)])
        self.rays = targets - back * directions, directions
        # Products of whole numbers: 1 where a ray goes with the normal of a face.
        normals = np.cross(self.corners[:, 1] - self.corners[:, 0], self.corners[:, 2] - self.corners[:, 0])
        self.sides = np.sign(directions @ normals.T)
        self.lines = [contacts(vertices, faces.astype(np.int32), *ray) for ray in zip(*self.rays, strict=True)]

    def judged(self, merged: Merged, query: _Query) -> dict[str, Bools]:
        """The rays with right answers to all queries of a scene, which may lack the first objects."""
        scene, rays, options = merged.scene, self.rays, query.options
        lacking = int(self.first[min(scene.objects)])
        low, high = options.get("t_min", 0.0), options.get("t_max", np.inf)
        lines = [self._allowed(line, may, low, high) for line, may in zip(self.lines, query.allowed, strict=True)]
        hits = merged.closest_hit(*rays, **options)
        face = np.where(hits.face >= 0, hits.face + lacking, -1)
        every = merged.merged(scene.all_hits(*rays, **options, contacts=False))
        listed = [[(Fraction(t), int(f) + lacking) for t, f in zip(every.t[a:b], every.face[a:b], strict=True)]
                  for a, b in zip(every.offsets[:-1], every.offsets[1:], strict=True)]  # fmt: skip
        each = [[(contact.t, face) for contact in line for face in contact.faces] for line in lines]
        alone = [] if options["ignore"] is not None else [_few(merged, rays, options) == hits.face]
        return {
            "closest_hit": self._first(lines, hits.t, face),
            "closest_hit of few rays": np.concatenate([*alone, np.ones(0, np.bool_)]),
            "any_hit": scene.any_hit(*rays, **options) == [len(line) > 0 for line in lines],
            "count_hits": scene.count_hits(*rays, **options) == [len(line) for line in lines],
            "count_hits of each face": scene.count_hits(*rays, **options, contacts=False) == list(map(len, each)),
            "counts of all_hits": (every.counts == list(map(len, each))) & (every.counts == np.diff(every.offsets)),
            "rays of all_hits": every.ray == np.repeat(np.arange(_RAYS), every.counts),
            "all_hits": np.array([_rounded(a) == _rounded(b) for a, b in zip(listed, each, strict=True)]),
        }

    def _allowed(self, line: list[Contact], may: Bools, low: float, high: float) -> list[Contact]:
        """The contacts from ``low`` to ``high`` with those of their faces that may be hit."""
        kept = [Contact(c.t, tuple(f for f in c.faces if may[f])) for c in line if low <= c.t <= high]
        return [contact for contact in kept if contact.faces]

    def _first(self, lines: list[list[Contact]], t: Floats, face: Ints) -> Bools:
        """Whether t and the face are right; of faces with equal corners, the first must be named."""
        kept = []
        for line, t_of_ray, number in zip(lines, t.tolist(), face.tolist(), strict=True):
            nearest = [f for contact in line for f in contact.faces if contact.t == line[0].t]
            alike = [f for f in nearest if np.array_equal(self.corners[f], self.corners[number])]
            right = number in nearest and number == min(alike) and t_of_ray == float(line[0].t) if line else number < 0
            kept.append(right)
        return np.array(kept)


def _few(merged: Merged, rays: tuple[Floats, Floats], options: dict[str, Any]) -> Ints:
    """The faces of closest hits of a few rays a call, which a kernel of their own traces."""
    mask, more = np.broadcast_to(options["mask"], _RAYS), {k: options[k] for k in options.keys() - {"mask", "ignore"}}
    parts = [slice(k, k + _FEW) for k in range(0, _RAYS, _FEW)]
    return np.concatenate([merged.closest_hit(*(r[k] for r in rays), mask=mask[k], **more).face for k in parts])


def _rounded(hits: list[tuple[Fraction, int]]) -> list[tuple[float, int]]:
    """Hits by t and face, as float64 has t."""
    return sorted((float(t), face) for t, face in hits)

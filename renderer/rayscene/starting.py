"""The rays of a query on a scene: which instances each may hit, and which face it leaves."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.arrays import real_argument
from renderer.arguments.types import ArrayLike
from renderer.errors import expect
from renderer.rayscene.built import BuiltScene
from renderer.rayscene.hits import SceneHits, ScenePassage
from renderer.results.hits import Hits, Passage
from renderer.trace.batch import NO_STARTS, RayBatch, check_rays, offset_origins, whole_numbers
from renderer.trace.batch import Leaving as StartsOn
from renderer.trace.instances import FLAGS
from renderer.trace.layout import MASK_BITS
from renderer.trace.leaving import check_leaving, shapes_of_starts
from renderer.trace.starts.record import ALL, FACE, HEAD, IGNORED, MASK, ROW, ROW_STEP

Leaving = SceneHits | ScenePassage | None


class Choice(NamedTuple):
    """The arguments of a query that say what each ray may hit."""

    leaving: Leaving
    mask: ArrayLike
    ignore: SceneHits | None
    faces: str


def rays_of(
    scene: BuiltScene, origins: ArrayLike, directions: ArrayLike, t_min: ArrayLike, t_max: ArrayLike, choice: Choice
) -> tuple[RayBatch, tuple[int, ...]]:
    """The arguments of a query, checked, and the dimensions of the rays."""
    plain = choice.leaving is None or choice.faces == "both"
    expect(plain, "faces", "'both' with leaving", repr(choice.faces))
    leaving, ignored = _on_faces(scene, choice.leaving), _ignored(scene, choice.ignore)
    shapes = shapes_of_starts(leaving, None) if leaving is not None else {}
    mask = real_argument("mask", choice.mask)
    shapes |= {"mask": mask.shape, **({} if ignored is None else {"ignore": ignored.shape})}
    rays, shape = check_rays(origins, directions, t_min, t_max, shapes)
    count, masks = rays.number, _masks(mask, shape)
    if leaving is not None:
        rays = _leave(
            scene, rays, _seen_of(scene, check_leaving(leaving, None, shape, scene.count), masks, ignored, shape)
        )
    elif ignored is not None or (masks != ALL).any():
        rows = count if ignored is not None or len(masks) > 1 else 1
        starts = np.zeros(HEAD + ROW * rows, np.int64)
        starts[ROW_STEP] = ROW if rows > 1 else 0
        rays = rays._replace(starts=starts)
        _rows(rays)[:, FACE] = -1.0
    if rays.starts is not NO_STARTS:
        _rows(rays)[:, MASK] = masks
        _rows(rays)[:, IGNORED] = -1.0 if ignored is None else np.broadcast_to(ignored, shape).reshape(-1)
    return rays, shape


def _rows(rays: RayBatch) -> NDArray[np.float64]:
    return rays.starts[HEAD:].view(np.float64).reshape(-1, ROW)


def _on_faces(scene: BuiltScene, leaving: Leaving) -> Hits | Passage | None:
    """The faces of the scene that rays leave."""
    if leaving is None:
        return None
    known = isinstance(leaving, SceneHits | ScenePassage)
    expect(known, "leaving", "hits of a scene", type(leaving).__name__)
    now = leaving.moment == scene.moment
    expect(now, "leaving", "hits on the scene as it is", "hits of another scene, or from before this one changed")
    return leaving.passage if isinstance(leaving, ScenePassage) else leaving._found


def _masks(mask: NDArray[Any], shape: tuple[int, ...]) -> NDArray[np.float64]:
    """The mask of each ray, or of all, as float64."""
    rows = whole_numbers("mask", mask, shape).reshape(-1) if mask.ndim else whole_numbers("mask", mask, ()).reshape(1)
    good = (rows >= 0) & (rows <= MASK_BITS)
    if not good.all():
        row = int((~good).argmax())
        expect(False, "mask", "32 bits", f"{rows[row]} in row {row}")
    return rows.astype(np.float64)


def _ignored(scene: BuiltScene, ignore: SceneHits | None) -> NDArray[np.float64] | None:
    """The instance, counted from 1 among all, that each ray does not hit, (...); -1 for none."""
    if ignore is None:
        return None
    expect(isinstance(ignore, SceneHits), "ignore", "hits of a scene", type(ignore).__name__)
    expect(ignore._scene.owner == scene.owner, "ignore", "hits of this scene", "hits of another")
    begins = {m.id: (scene.members.rows(m).start, m.count) for m in scene.members}
    ignored = np.full(ignore.object.shape, -1.0)
    for id_ in np.unique(ignore.object[ignore.object >= 0]).tolist():
        if id_ in begins:
            own, (begin, count) = ignore.object == id_, begins[id_]
            expect(int(ignore.instance[own].max()) < count, "ignore", f"instances below {count}", "others")
            ignored[own] = ignore.instance[own] + begin + 1
    return ignored


def _seen_of(
    scene: BuiltScene,
    left: StartsOn,
    masks: NDArray[np.float64],
    ignored: NDArray[np.float64] | None,
    shape: tuple[int, ...],
) -> StartsOn:
    """``left`` without the faces of instances that the rays do not see, and start on as on nothing."""
    if scene.count == 0 or (ignored is None and (masks == ALL).all()):
        return left
    number = scene.instances_of(left.faces) + 1
    flags = scene.top.instances.view(np.int64)[number - 1, FLAGS]
    unseen = (masks.astype(np.int64) & flags & MASK_BITS) == 0
    if ignored is not None:
        unseen |= np.broadcast_to(ignored, shape).reshape(-1) == number
    return left._replace(faces=np.where(unseen, -1, left.faces))


def _leave(scene: BuiltScene, rays: RayBatch, left: StartsOn) -> RayBatch:
    """The rays moved off the faces that they leave."""
    # The kernels need the faces that rays leave as a mesh of their own; all others they look up in the scene.
    own, faces = scene.mesh_of(left.faces)
    moved = offset_origins(rays, left._replace(faces=faces), own, 1.0, scene.threads)
    _rows(moved)[:, FACE] = left.faces
    return moved

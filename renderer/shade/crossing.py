"""Crosses coinciding faces together, so that there is no air between bodies that touch.

The ray goes from the medium before all of them to the medium after all; an opaque face among them stops it. Where media
overlap, the body entered last counts; for bodies entered at one place, the one later in the scene. A ray within the
plane in which bodies touch hits faces of several at one point: it leaves the body that it is in.
"""

from typing import Any, NamedTuple

import numpy as np

from renderer.jit.decorators import inlined, kernel
from renderer.materials.columns import IOR
from renderer.materials.registry import lets_through
from renderer.numerics.simd import load, minimum, pointer, store
from renderer.numerics.vec3 import dot
from renderer.shade.surface import Look, left_from, look_at, material_of, scene_pointers
from renderer.trace.edge_signs import corners_at
from renderer.trace.spawn import LEVEL, Place
from renderer.trace.starts.cone import NUMBER, PATH, PLACE, holder, make_holders, put_holder
from renderer.trace.starts.level import (
    NO_MEMBER,
    Spot,
    are_level,
    list_members,
    list_near,
    member_spot,
    point_of,
    spot_of,
)
from renderer.trace.trees import tree_pointers

# Room for media that a ray enters at one place, beside those that it remembers.
SPARE = 8
# The marks of faces, in their word PATH: a body is entered or left through it, or neither.
_ALONG, _ENTERED, _LEFT = 0, 1, 2


class Together(NamedTuple):
    """Faces that a ray crosses at one point: what it sees of them, where rays leave them backwards and onwards, and how
    many are marked, 0 for a single face.
    """

    seen: Spot
    near: Spot
    far: Spot
    count: int  # type: ignore[assignment]  # tuples have a method of that name


class Media(NamedTuple):
    """The media of a ray: a pointer to the rows of their materials, outermost first, their number, and the largest
    number.
    """

    rows: Any
    count: int  # type: ignore[assignment]  # tuples have a method of that name
    limit: int


class Change(NamedTuple):
    """The indices of refraction before and beyond a surface, and the number of media beyond."""

    n1: float
    n2: float
    left: int


@inlined
def came_from(n_g, d):
    """The side of a face from which a ray of direction d comes: 1 for that of its normal, or -1."""
    return -1.0 if dot(d, n_g) > 0.0 else 1.0


@inlined
def place_at(spot, surface, d):
    """The ``Place`` of rays that leave the ``Surface`` at a spot hit by a ray of direction d."""
    return _place(spot, surface, d, 0.0)


@inlined
def place_beyond(spot, surface, d):
    """``place_at`` for rays that have crossed all the faces there together: the face of the spot is the last of them,
    whichever there are.
    """
    # rule: beyond-all-level
    return _place(spot, surface, d, float(spot.face + 1))


@inlined
def _place(spot, surface, d, pile):
    return Place(float(spot.face), spot.u, spot.v, surface.slack, came_from(surface.n_g, d), pile)


@inlined
def may_coincide(scene, face):
    """Whether a face may coincide with another, one of which transmits light."""
    return scene.has_touching and scene.ways.touches(scene, face)


@kernel
def faces_together(tree, scene, spot, d, media, stack, memory):
    """The faces that a ray of direction d in ``media`` hits at a ``Spot``. ``stack`` and ``memory`` as for
    ``search.depart``; the marks there last until the next search.
    """
    together = _faces_at(tree, scene, spot, d, stack, memory)
    # rule: leave-own-body
    if _some_leave_other(scene, together, d, media, memory):
        own = _own_spot(tree, scene, spot, d, media, stack, memory)
        return _faces_at(tree, scene, own, d, stack, memory)
    return together


@inlined
def _is_among(media, material):
    """Whether a material is one of the media of a ray."""
    found = False
    for k in range(media.count):
        found = found or load(media.rows, k) == material
    return found


@inlined
def leaves_other(scene, look, d, media):
    """Whether a ray of direction d in ``media`` leaves a body that it is not in, through the face of a ``Look``; never
    where no bodies touch, or each face is crossed by itself.
    """
    clear = scene.has_touching and media.limit > 0 and lets_through(scene.materials, look.material)
    return clear and dot(d, look.n_s) > 0.0 and not _is_among(media, look.material)


@inlined
def _some_leave_other(scene, together, d, media, memory):
    """``leaves_other`` for any of the faces that a ray crosses together."""
    seen, holders, other = together.seen, make_holders(memory), False
    if together.count == 0:
        return leaves_other(scene, look_at(scene, seen.face, seen.u, seen.v, d), d, media)
    for k in range(together.count):
        left = holder(holders, k, PATH) == _LEFT
        other = other or (left and not _is_among(media, material_of(scene, holder(holders, k, NUMBER))))
    return other and media.limit > 0


@kernel
def _own_spot(tree, scene, spot, d, media, stack, memory):
    """The spot at the same place of the lowest face through which a ray leaves one of its ``media``; of a ray in none,
    of the lowest through which it enters a body and leaves none. Without such a face the given spot.
    """
    holders, o = make_holders(memory), point_of(tree, scene, spot)
    count = list_near(tree, scene, spot, stack, holders, True)
    for k in range(count):
        own = spot_of(tree, holder(holders, k, PLACE), holder(holders, k, NUMBER), o)
        look = look_at(scene, own.face, own.u, own.v, d)
        slope = dot(d, look.n_s)
        put_holder(holders, k, PATH, _LEFT if slope > LEVEL else (_ENTERED if slope < -LEVEL else _ALONG))
    for k in range(count):
        place, number, way = holder(holders, k, PLACE), holder(holders, k, NUMBER), holder(holders, k, PATH)
        if way == _LEFT and _is_among(media, material_of(scene, number)):
            return spot_of(tree, place, number, o)
        if way == _ENTERED and media.count == 0 and not _has_left_beside(tree, holders, count, place):
            return spot_of(tree, place, number, o)
    return spot


@kernel
def _has_left_beside(tree, holders, count, place):
    """Whether one of the listed faces that are left lies in the plane of another face."""
    found = False
    for k in range(count):
        level = are_level(corners_at(tree, place), corners_at(tree, holder(holders, k, PLACE)))
        found = found or (level and holder(holders, k, PATH) == _LEFT)
    return found


@kernel
def _faces_at(tree, scene, spot, d, stack, memory):
    """``faces_together`` for a ray in any media."""
    if not may_coincide(scene, spot.face):
        return Together(spot, spot, spot, 0)
    holders, opaque, clear = make_holders(memory), NO_MEMBER, False
    near = list_near(tree, scene, spot, stack, holders, False)
    if near < 2:
        return Together(spot, spot, spot, 0)
    members, met = list_members(tree, scene, spot, d, holders, near)
    # rule: touching-bodies
    if members.count < 2:
        return Together(spot, spot, spot, 0)
    for k in range(members.count - 1, -1, -1):
        at_ = member_spot(tree, holders, k, spot, met)
        look = look_at(scene, at_.face, at_.u, at_.v, d)
        put_holder(holders, k, PATH, _LEFT if dot(d, look.n_s) > 0.0 else _ENTERED)
        through = lets_through(scene.materials, look.material)
        clear = clear or through
        # rule: opaque-stops-light
        if not through:
            opaque = k
    if not clear:
        # Of opaque faces alone the one that was hit is seen, however many are marked as touching.
        return Together(spot, spot, spot, 0)
    seen = member_spot(tree, holders, 0 if opaque == NO_MEMBER else opaque, spot, met)
    return Together(seen, members.near, members.far, members.count if opaque == NO_MEMBER else 0)


@inlined
def look_together(scene, together, d):
    """The ``Look`` of a ray of direction d: that of the face that it sees, at the place where rays leave backwards."""
    seen, near = together.seen, together.near
    look = look_at(scene, seen.face, seen.u, seen.v, d)
    if near.face == seen.face:
        return look
    other = look_at(scene, near.face, near.u, near.v, d)
    return Look(other.p, other.facet, look.n_s, look.material)


@inlined
def _enter(media, count, material, most):
    """Add a medium to ``media`` in place, unless there are ``most``. Returns their number."""
    if count < most:
        store(media, count, np.int64(material))
        count += 1
    return count


@kernel
def _leave(media, count, material):
    """Remove the innermost entry of a medium from ``media`` in place, so that overlapping bodies are left one by one.
    Returns their number, unchanged if there is none.
    """
    # rule: innermost-entry
    for k in range(count - 1, -1, -1):
        if load(media, k) == material:
            for j in range(k, count - 1):
                store(media, j, load(media, j + 1))
            return count - 1
    return count


@inlined
def _innermost_ior(scene, media, count):
    return load(scene.materials, load(media, count - 1) + IOR) if count > 0 else 1.0


@inlined
def cross(scene, together, m, inside, media, beyond, memory):
    """The ``Change`` of a ray in ``media`` that crosses the surface it hit. The media beyond go to ``beyond``, which
    has room for SPARE more. A single face has material ``m`` and is hit from ``inside`` or not.

    A ninth medium is not remembered: leaving it then leads back into the eighth.
    """
    for k in range(media.count):
        store(beyond, k, load(media.rows, k))
    if together.count > 0:
        return _cross_all(scene, together.count, media, beyond, memory)
    n1, count = _innermost_ior(scene, media.rows, media.count), media.count
    if inside:
        count = _leave(beyond, count, m)
        # A body that the ray never entered, as through the hole of a mesh.
        n1 = load(scene.materials, m + IOR) if count == media.count else n1
    else:
        count = _enter(beyond, count, m, media.limit + SPARE)
    return Change(n1, _innermost_ior(scene, beyond, count), minimum(count, media.limit))


@kernel
def _cross_all(scene, members, media, beyond, memory):
    """``cross`` for all members: bodies are entered, lower faces first, before others are left, so that a sheet entered
    and left at once changes nothing.
    """
    # rule: medium-of-crossing
    holders, count, n1 = make_holders(memory), media.count, _innermost_ior(scene, media.rows, media.count)
    for k in range(members):
        if holder(holders, k, PATH) == _ENTERED:
            count = _enter(beyond, count, material_of(scene, holder(holders, k, NUMBER)), media.limit + SPARE)
    for k in range(members):
        if holder(holders, k, PATH) == _LEFT:
            material, before = material_of(scene, holder(holders, k, NUMBER)), count
            count = _leave(beyond, count, material)
            n1 = load(scene.materials, material + IOR) if count == before else n1
    return Change(n1, _innermost_ior(scene, beyond, count), minimum(count, media.limit))


@kernel
def together_of(descriptor, arrays, spot, d, media, limit, stack, memory):
    """``faces_together``, for Python; ``media`` is an array, and ``limit`` the most that a ray remembers."""
    tree, scene, around = tree_pointers(descriptor), scene_pointers(arrays), Media(pointer(media), len(media), limit)
    return faces_together(tree, scene, spot, d, around, pointer(stack), pointer(memory))


@kernel
def change_of(arrays, together, m, inside, media, beyond, memory):
    """``cross``, for Python; ``media`` is an array."""
    around = Media(pointer(media), len(media), len(beyond) - SPARE)
    return cross(scene_pointers(arrays), together, m, inside, around, pointer(beyond), pointer(memory))


@kernel
def surface_together_of(arrays, together, d):
    """The ``Surface`` that a ray of direction d hits, for Python."""
    scene, near = scene_pointers(arrays), together.near
    return left_from(scene, near.face, near.u, near.v, look_together(scene, together, d))

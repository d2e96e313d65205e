"""Where a ray crosses the surface: faces that coincide there are crossed together, with no air between bodies.

The ray goes from the medium before all of them to the medium after all; an opaque one among them stops it. Where media
overlap, the body that the ray entered last holds; of bodies entered at one place, the one that is later in the scene.
"""

from typing import Any, NamedTuple

import numpy as np

from renderer.kernels.jit import inlined, kernel
from renderer.kernels.simd import get, pointer, put, smaller
from renderer.kernels.vec3 import dot
from renderer.shade.records import IOR
from renderer.shade.surface import lets_through, scene_pointers, surface_at
from renderer.trace.leaf import tree_pointers
from renderer.trace.spawn import Place
from renderer.trace.starts.anchor import anchor_of
from renderer.trace.starts.cone import NUMBER, PATH, PLACE, holder, make_holders, put_holder
from renderer.trace.starts.meeting import barycentrics_of, meet_face, seen_from, slope_there, unit_direction
from renderer.trace.starts.record import BARYCENTRIC, Start, corners_of
from renderer.trace.starts.region import coincide
from renderer.trace.starts.search import list_holders

# Room for media that a ray enters at one place, beside those that it remembers.
SPARE = 8
_NONE = -1
# The marks of holders, in their word PATH: apart from the others, or a body is entered or left through it.
_APART, _ENTERED, _LEFT = 0, 1, 2


class Spot(NamedTuple):
    """A point of a face, by its barycentrics."""

    face: int
    u: float
    v: float


class Together(NamedTuple):
    """Faces that a ray crosses at one point: where it sees them, where it leaves them behind, and the number of holders
    among which they are marked, 0 where one face alone is met.
    """

    seen: Spot
    last: Spot
    count: int


class Media(NamedTuple):
    """Media that a ray is in: a pointer to the rows of their materials, outermost first, their number, and the most
    that it remembers.
    """

    rows: Any
    count: int
    limit: int


class Change(NamedTuple):
    """The indices of refraction before and beyond a surface, and the number of media beyond."""

    n1: float
    n2: float
    left: int


class _Contact(NamedTuple):
    """A point where faces may coincide: its anchor, the direction of a ray there, the slope of that against the
    anchor's face, the faces that hold it and their number.
    """

    anchor: Any
    d: Any
    slope: int
    holders: Any
    count: int


@inlined
def place_at(spot, surface, d):
    """The ``Place`` for rays that leave the ``Surface`` at a spot, which a ray of direction d met."""
    return Place(float(spot.face), spot.u, spot.v, surface.slack, -1.0 if dot(d, surface.n_g) > 0.0 else 1.0)


@inlined
def faces_together(tree, scene, spot, d, stack, memory):
    """The faces that a ray of direction d meets at a ``Spot``. ``stack`` and ``memory`` as for ``search.depart``: the
    marks there last until the next search.
    """
    if scene.has_touching and get(scene.touching, spot.face) != 0:
        return _faces_together(tree, scene, spot, d, stack, memory)
    return Together(spot, spot, 0)


@kernel
def _faces_together(tree, scene, spot, d, stack, memory):
    contact = _contact_at(tree, scene, spot, d, stack, memory)
    if _mark_members(tree, scene, contact, spot, d) < 2:
        return Together(spot, spot, 0)
    opaque, first, last = _NONE, _NONE, _NONE
    k = _next_member(contact.holders, contact.count, _NONE)
    while k != _NONE:
        first = k if first == _NONE else first
        if opaque == _NONE and not lets_through(scene.materials, _material_of(scene, contact.holders, k)):
            opaque = k
        last = k
        k = _next_member(contact.holders, contact.count, k)
    if opaque != _NONE:
        seen = _spot_of(tree, contact, opaque, spot)
        return Together(seen, seen, 0)
    return Together(_spot_of(tree, contact, first, spot), _spot_of(tree, contact, last, spot), contact.count)


@kernel
def _contact_at(tree, scene, spot, d, stack, memory):
    corners = corners_of(scene.vertices, scene.faces, spot.face, tree.scale)
    anchor = anchor_of(Start(corners, (spot.u, spot.v, 0.0), spot.face, BARYCENTRIC))
    way, _ = unit_direction(d)
    slope, holders = slope_there(anchor, way), make_holders(memory)
    count = list_holders(tree, anchor, way, slope, 1.0, stack, holders)
    return _Contact(anchor, way, slope, holders, count)


@kernel
def _mark_members(tree, scene, contact, spot, d):
    """Mark the holders that coincide with the face of a spot; returns their number."""
    holders, own, members = contact.holders, _NONE, 0
    for k in range(contact.count):
        if holder(holders, k, NUMBER) == spot.face:
            own = k
    for k in range(contact.count):
        mark = _APART
        if own != _NONE and (k == own or coincide(tree, contact.anchor, holders, own, k)):
            at_ = _spot_of(tree, contact, k, spot)
            inside = dot(d, surface_at(scene, at_.face, at_.u, at_.v, d).n_s) > 0.0
            mark, members = (_LEFT if inside else _ENTERED), members + 1
        put_holder(holders, k, PATH, mark)
    return members


@kernel
def _spot_of(tree, contact, k, met):
    """The ``Spot`` of the k-th holder; ``met`` is that of the face that the ray was found to hit."""
    face = holder(contact.holders, k, NUMBER)
    if face == met.face:
        return met
    seen = seen_from(tree, holder(contact.holders, k, PLACE), contact.anchor)
    u, v = barycentrics_of(meet_face(seen, contact.anchor, contact.d, contact.slope, 1.0))
    return Spot(face, u, v)


@kernel
def _next_member(holders, count, k):
    """The marked holder with the next higher number than the k-th one; the lowest for k = _NONE; _NONE for no more."""
    best = _NONE
    for j in range(count):
        if holder(holders, j, PATH) != _APART:
            number = holder(holders, j, NUMBER)
            after = k == _NONE or number > holder(holders, k, NUMBER)
            if after and (best == _NONE or number < holder(holders, best, NUMBER)):
                best = j
    return best


@inlined
def _material_of(scene, holders, k):
    return np.int64(get(scene.material, holder(holders, k, NUMBER)))


@inlined
def _enter(media, count, material, most):
    """Add a medium to ``media`` in place, unless there are ``most``; returns their number."""
    if count < most:
        put(media, count, np.int64(material))
        count += 1
    return count


@kernel
def _leave(media, count, material):
    """Take the innermost entry of a medium out of ``media`` in place, wherever it stands, so that overlapping bodies
    are left one by one; returns their number, which is the same where there is none.
    """
    for k in range(count - 1, -1, -1):
        if get(media, k) == material:
            for j in range(k, count - 1):
                put(media, j, get(media, j + 1))
            return count - 1
    return count


@inlined
def _innermost_ior(scene, media, count):
    return get(scene.materials, get(media, count - 1) + IOR) if count > 0 else 1.0


@inlined
def cross(scene, together, m, inside, media, beyond, memory):
    """The ``Change`` of a ray in ``media`` that crosses what it met, whose media beyond go to ``beyond``, with SPARE
    more room than the ray remembers. One face alone is of material ``m``, and met from ``inside`` or not.

    A ninth medium is not remembered: leaving it then leads back into the eighth.
    """
    for k in range(media.count):
        put(beyond, k, get(media.rows, k))
    if together.count > 0:
        return _cross_all(scene, together.count, media, beyond, memory)
    n1, count = _innermost_ior(scene, media.rows, media.count), media.count
    if inside:
        count = _leave(beyond, count, m)
        # A body that the ray never entered, as through the hole of a mesh.
        n1 = get(scene.materials, m + IOR) if count == media.count else n1
    else:
        count = _enter(beyond, count, m, media.limit + SPARE)
    return Change(n1, _innermost_ior(scene, beyond, count), smaller(count, media.limit))


@kernel
def _cross_all(scene, holder_count, media, beyond, memory):
    """``cross`` of all marked faces: bodies are entered, lower faces first, before others are left, so that a sheet
    that is entered and left at once changes nothing.
    """
    holders, count, n1 = make_holders(memory), media.count, _innermost_ior(scene, media.rows, media.count)
    for mark in (_ENTERED, _LEFT):
        k = _next_member(holders, holder_count, _NONE)
        while k != _NONE:
            material = _material_of(scene, holders, k)
            if holder(holders, k, PATH) == mark:
                before = count
                if mark == _ENTERED:
                    count = _enter(beyond, count, material, media.limit + SPARE)
                else:
                    count = _leave(beyond, count, material)
                    n1 = get(scene.materials, material + IOR) if count == before else n1
            k = _next_member(holders, holder_count, k)
    return Change(n1, _innermost_ior(scene, beyond, count), smaller(count, media.limit))


@kernel
def together_of(words, arrays, spot, d, stack, memory):
    """``faces_together``, for Python."""
    return faces_together(tree_pointers(words), scene_pointers(arrays), spot, d, pointer(stack), pointer(memory))


@kernel
def change_of(arrays, together, m, inside, media, beyond, memory):
    """``cross``, for Python; ``media`` is an array."""
    around = Media(pointer(media), len(media), len(beyond) - SPARE)
    return cross(scene_pointers(arrays), together, m, inside, around, pointer(beyond), pointer(memory))

"""View factors with closed forms: each exchange between its bounds, within eight of its standard errors.

Flat faces stand for round shapes: the exchange is then between that of the shapes within them and around them.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from renderer.mesh.mesh import Mesh
from renderer.octree import Octree
from renderer.studies import view_factors
from validation.oracle.view_factors import cylinders, discs, rectangles, spheres
from validation.oracle.view_factors.rectangles import Span
from validation.studies.factors import round as shapes
from validation.studies.factors import street
from validation.studies.factors.rooms import Plate, Room, between, box_plates, of_plates

# A standard error is that of eight sequences: by Student's law with seven degrees of freedom, chance is beyond eight
# of them once in 11,000.
ERRORS = 8.0
# So many rays in the mean hit what none hit once in three million.
UNSEEN = 15.0
# Of the area: what rounding leaves of an exact exchange, a thousand times the 1e-12 of a contour integral's terms.
ROUNDING = 1e-9
# The requested standard error of rows, of all their entries together.
_QUICK, _FULL = 0.005, 0.002
# Enough for that at any share: rows end when their error is reached.
_RAYS = 1 << 21
_SIDES = 120
_LEVEL = 3


class Entry(NamedTuple):
    """Between which two numbers the exchange A1 F12 of two surfaces is."""

    one: int
    other: int
    low: float
    high: float


@dataclass(frozen=True)
class Form:
    """A room, what is known of it, and the options of the call."""

    name: str
    source: str
    room: Room
    entries: list[Entry]
    options: dict[str, Any] = field(default_factory=dict)


def check(name: str, quick: bool) -> dict[str, Any]:
    """A row: the largest error of a view factor, its largest share of what is allowed, and rays a row."""
    form = FORMS[name]()
    rtol = _QUICK if quick else _FULL
    octree = Octree.from_mesh(form.room.mesh)
    found: Any = view_factors(octree, form.room.groups, rtol=rtol, max_rays=_RAYS, **form.options)
    exchange, stated = found.exchange.toarray(), found.errors.toarray()
    errors, shares = [0.0], [0.0]
    for one, other, low, high in form.entries:
        area, value = float(found.areas[one]), float(exchange[one, other])
        beyond = max(low - value, value - high, 0.0) / area if np.isfinite(value) else np.inf
        # No ray says how much an entry errs that none has hit.
        chance = ERRORS * float(stated[one, other]) if value else UNSEEN / max(int(found.rays[one]), 1)
        errors.append(beyond)
        shares.append(beyond / (ROUNDING + (chance if found.rays[one] else 0.0)))
    # What two surfaces exchange is the mean of what the rays of both say, the larger one's by its area.
    ratio = np.minimum(1.0, found.areas[:, None] / found.areas)
    asked = np.sqrt(((stated * ratio) ** 2).sum(axis=1)) / rtol
    return {"subject": form.name, "source": form.source, "entries": len(form.entries), "error": max(errors),
            "stated": float(max((stated[e.one, e.other] for e in form.entries), default=0.0)),
            "rays": int(found.rays.max()), "share_of_allowed": max(shares),
            "share_of_asked": float(asked[found.rays < _RAYS].max(initial=0.0))}  # fmt: skip


def _exact(one: int, other: int, exchange: float) -> Entry:
    return Entry(one, other, exchange, exchange)


def _box() -> Form:
    """Four C-14 of each axis and a C-11."""
    size = (4.0, 2.5, 3.0)
    entries = []
    for i in range(6):
        for j in range(i + 1, 6):
            a, b = i // 2, j // 2
            if a == b:
                u, v = (size[axis] for axis in range(3) if axis != a)
                entries.append(_exact(i, j, u * v * rectangles.parallel(u, v, size[a])))
            else:
                common = size[3 - a - b]
                entries.append(_exact(i, j, size[b] * common * rectangles.perpendicular(size[b], size[a], common)))
    return Form("walls of a room", "Howell C-11, C-14", of_plates(box_plates((0, 0, 0), size, inward=True)), entries)


def _box_in_room() -> Form:
    """A body's sides and the walls around it: what is before a side is hidden by nothing."""
    walls = box_plates((0.0, 0.0, 0.0), (4.0, 3.0, 2.5), inward=True)
    sides = box_plates((1.0, 0.5, 0.5), (2.5, 1.5, 1.75), inward=False)
    entries = [_exact(i, 6 + j, between(wall, side)) for i, wall in enumerate(walls) for j, side in enumerate(sides)]
    entries += [_exact(6 + i, 6 + j, 0.0) for i in range(6) for j in range(6)]
    return Form("a box within a room", "Howell C-13, C-15", of_plates(walls + sides), entries)


def _one_behind() -> Form:
    """A floor on both sides of a wall's plane, which sees the wall's front and back."""
    floor = Plate(2, 1, 0.0, (Span(-1.0, 2.0), Span(0.0, 2.0)))
    wall = Plate(0, 1, 0.0, (Span(-1.0, 1.5), Span(0.5, 3.0)))
    both = between(floor, wall) + between(floor, wall._replace(sign=-1))
    source = "Howell C-15, of what is in front of each side"
    room, options = of_plates([floor, wall]), {"sides": "both"}
    return Form("a floor that goes on behind a wall", source, room, [_exact(0, 1, both)], options)


def _discs() -> Form:
    (low, one), (high, two) = shapes.disc(1.0, 0.0, True, _SIDES), shapes.disc(1.5, 1.25, False, _SIDES)
    bounds = [np.pi * a * a * discs.coaxial(a, b, 1.25) for a, b in zip(one, two, strict=True)]
    return Form("coaxial discs", "Howell C-41", _joined(low, high), [Entry(0, 1, *bounds)])


def disc_between(between: float = 0.5, share: float = 0.4) -> Form:
    """The third disc hides more the larger it is. All have two sides."""
    far = 2.0
    (low, one), (high, two) = shapes.disc(1.0, 0.0, True, _SIDES), shapes.disc(1.2, far, False, _SIDES)
    middle, three = shapes.disc(between, share * far, True, _SIDES)
    least, most = (
        np.pi * a * a * discs.with_disc_between(a, b, far, c, share)
        for a, b, c in ((one.within, two.within, three.around), (one.around, two.around, three.within))
    )
    entries = [
        Entry(0, 1, least, most),
        Entry(0, 2, *(np.pi * a * a * discs.coaxial(a, b, share * far) for a, b in zip(one, three, strict=True))),
        Entry(2, 1, *(np.pi * a * a * discs.coaxial(a, b, far - share * far) for a, b in zip(three, two, strict=True))),
    ]
    source = "two arcs of a lens, over rings"
    return Form("a disc between two discs", source, _joined(low, high, middle), entries, {"sides": "both"})


def _disc_and_ball() -> Form:
    (plate, one), (ball, two) = shapes.disc(1.5, 0.0, True, _SIDES), shapes.ball(0.75, (0.0, 0.0, 1.5), _LEVEL)
    bounds = [np.pi * a * a * spheres.from_disc(b, a, 1.5) for a, b in zip(one, two, strict=True)]
    return Form("a disc and a ball", "Howell C-113", _joined(plate, ball), [Entry(0, 1, *bounds), _exact(1, 1, 0.0)])


def _balls() -> Form:
    (left, one), (right, two) = shapes.ball(1.0, (0.0, 0.0, 0.0), _LEVEL), shapes.ball(1.5, (0.0, 0.0, 3.0), _LEVEL)
    bounds = [4.0 * np.pi * a * a * spheres.to_sphere(a, b, 3.0) for a, b in zip(one, two, strict=True)]
    return Form("two balls", "Howell B-38, over rings", _joined(left, right), [Entry(0, 1, *bounds)])


def _ball_in_ball() -> Form:
    """Exact for any convex body within a closed one, of flat faces too: A1 F12 is the inner area."""
    inner, _ = shapes.ball(0.5, (0.25, 0.125, -0.125), 2)
    outer, _ = shapes.ball(1.0, (0.0, 0.0, 0.0), 3, outward=False)
    room = _joined(inner, outer)
    inside, outside = room.areas.tolist()
    entries = [_exact(0, 1, inside), _exact(1, 1, outside - inside), _exact(0, 0, 0.0)]
    return Form("a ball within a ball", "(r / R)^2, 1 - (r / R)^2", room, entries)


def _cylinders() -> Form:
    """A wider inner cylinder takes part in more, a wider outer one lets more out by its ends."""
    length = 2.0
    (inner, one), (outer, two) = shapes.shell(0.5, length, True, _SIDES), shapes.shell(1.0, length, False, _SIDES)
    bounds = [
        2.0 * np.pi * b * length * cylinders.to_inner(a, b, length)
        for a, b in ((one.within, two.around), (one.around, two.within))
    ]
    return Form("coaxial cylinders", "Howell C-91", _joined(inner, outer), [Entry(0, 1, *bounds), _exact(0, 0, 0.0)])


def street_with_block() -> Form:
    """Strips of an endless street past a block; a little is missing because the street has ends."""
    room = street.room()
    count = int(room.groups.max()) + 1
    entries = []
    for i in range(count):
        for j in range(i + 1, count):
            whole = street.known(i, j) * street.LENGTH
            entries.append(Entry(i, j, whole * (1.0 - street.MISSING), whole))
    return Form("a street with a block", "Hottel's crossed strings", room, entries)


def sheets(a: float = 0.5, b: float = 0.25) -> Form:
    """Sheets that let shares of rays through, between squares whose lines all pass them."""
    flat = (Span(0.0, 1.0), Span(0.0, 1.0))
    plates = [Plate(2, 1, 0.0, flat), Plate(2, -1, 1.5, flat), Plate(2, 1, 0.5, flat), Plate(2, 1, 1.0, flat)]
    one, two, three = (rectangles.parallel(1.0, 1.0, far) for far in (0.5, 1.0, 1.5))
    entries = [
        _exact(0, 1, a * b * three), _exact(0, 2, (1.0 - a) * one), _exact(0, 3, a * (1.0 - b) * two),
        _exact(2, 1, (1.0 - a) * b * two), _exact(2, 3, (1.0 - a) * (1.0 - b) * one), _exact(3, 1, (1.0 - b) * one),
    ]  # fmt: skip
    lets = np.repeat([0.0, 0.0, a, b], 2)
    return Form("sheets between two squares", "Howell C-11 times what sheets let through", of_plates(plates), entries,
                {"transmittance": lets})  # fmt: skip


def _both_sides() -> Form:
    """Squares with two sides in the open: the exchange is that of the sides that face each other."""
    plates = [Plate(2, sign, at, (Span(0.0, 1.0), Span(0.0, 1.0))) for sign, at in ((-1, 0.0), (-1, 1.0))]
    known = [_exact(0, 1, rectangles.parallel(1.0, 1.0, 1.0)), _exact(0, 0, 0.0)]
    return Form("squares with two sides", "Howell C-11", of_plates(plates), known, {"sides": "both"})


def _joined(*meshes: Mesh) -> Room:
    """Each mesh a surface."""
    counts = [len(mesh.faces) for mesh in meshes]
    return Room(Mesh.concatenate(list(meshes)), np.repeat(np.arange(len(meshes)), counts).astype(np.int64))


FORMS: dict[str, Callable[[], Form]] = {
    "walls of a room": _box,
    "a box within a room": _box_in_room,
    "a floor that goes on behind a wall": _one_behind,
    "coaxial discs": _discs,
    "a disc between two discs": disc_between,
    "a disc and a ball": _disc_and_ball,
    "two balls": _balls,
    "a ball within a ball": _ball_in_ball,
    "coaxial cylinders": _cylinders,
    "a street with a block": street_with_block,
    "sheets between two squares": sheets,
    "squares with two sides": _both_sides,
}

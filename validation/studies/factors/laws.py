"""Exact laws of view factors: each check counts the answers that break one."""

import warnings
from collections.abc import Iterator
from typing import Any

import numpy as np

from renderer.octree import Octree
from renderer.studies import view_factors
from validation.oracle.view_factors.rectangles import Span, parallel
from validation.studies.checks import Asked, Check, counted, row_of
from validation.studies.factors.forms import ERRORS, FORMS
from validation.studies.factors.heat import heat_adds_up, two_surfaces
from validation.studies.factors.rooms import ROOMS, Plate, Room, of_plates, room_with_column, two_rooms

# Sums of some hundred shares, each rounded.
_SUM = 1e-12
# Rows that are traced again are balanced in steps, to 1e-9.
_BALANCED = 1e-8
# Laws hold for any number of rays.
_RTOL, _RAYS = 0.05, 4096


def _found(room: Room, **options: Any) -> Any:
    chosen = {"rtol": _RTOL, "max_rays": _RAYS} | options
    return view_factors(Octree.from_mesh(room.mesh), room.groups, **chosen)


def _each() -> Iterator[Any]:
    """Rooms and forms, by surfaces and by faces, with two sides, and with faces that let something through."""
    for room in (build() for build in ROOMS.values()):
        yield _found(room)
        yield _found(room._replace(groups=np.arange(len(room.groups))))
        yield _found(room, sides="both")
        yield _found(room, sides="both", transmittance=np.where(room.groups % 3 == 1, 0.25, 0.0))
    for form in (build() for build in FORMS.values()):
        yield _found(form.room, **form.options)


def rows_are_whole() -> Asked:
    """Each row of view factors, with the sky, has the sum 1."""
    sums = [found.matrix.sum(axis=1) + found.sky + found.backs for found in _each()]
    return counted(np.abs(np.concatenate(sums) - 1.0) <= _SUM)


def rows_by_rays_are_whole() -> Asked:
    """Of an exchange that is traced again for each product, each row, with the sky, has the sum 1 within 1e-8."""
    right = []
    for room in (build() for build in ROOMS.values()):
        found = view_factors(Octree.from_mesh(room.mesh), room.groups, form="rays", max_rays=_RAYS)
        sums = found.exchange @ np.ones(len(found.areas)) / found.areas
        right.append(np.abs(sums + found.sky + found.backs - 1.0) <= _BALANCED)
    return counted(np.concatenate(right))


def what_leaves_comes_back() -> Asked:
    """A_i F_ij equals A_j F_ji, bit for bit."""
    parts = [(found.exchange.toarray(), found.exchange.T.toarray()) for found in _each()]
    return counted(np.concatenate([(there == back).ravel() for there, back in parts]))


def shares_are_shares() -> Asked:
    """No view factor, share of the sky or error is negative or no number, and no share is above 1."""
    right = []
    for found in _each():
        shares = [found.matrix.toarray().ravel(), found.sky, found.backs]
        right += [(part >= 0.0) & (part <= 1.0 + _SUM) for part in shares]
        right.append((found.errors.data >= 0.0) & np.isfinite(found.errors.data))
    return counted(np.concatenate(right))


def planes_do_not_see_themselves() -> Asked:
    """A face, or a surface of faces in one plane, does not see itself."""
    rooms = [build() for build in ROOMS.values()]
    found = [_found(room) for room in rooms] + [_found(rooms[0]._replace(groups=np.arange(len(rooms[0].groups))))]
    return counted(np.concatenate([part.exchange.diagonal() == 0.0 for part in found]))


def closed_rooms_have_no_sky() -> Asked:
    """Nothing leaves a closed room, nor ends on a back."""
    found = [_found(build()) for name, build in ROOMS.items() if name.startswith("room")]
    return counted(np.concatenate([part.sky == 0.0 for part in found] + [part.backs == 0.0 for part in found]))


def backs_do_not_receive() -> Asked:
    """Of what a plate sends to the back of another nothing is received, and the rest is that of plates face to face."""
    flat = (Span(0.0, 1.0), Span(0.0, 1.0))
    room = of_plates([Plate(2, 1, 0.0, flat), Plate(2, 1, 1.0, flat)])
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        found = _found(room, rtol=0.01, max_rays=1 << 16)
    known, rays = parallel(1.0, 1.0, 1.0), int(found.rays[0])
    close = abs(float(found.backs[0]) - known) <= ERRORS * np.sqrt(known * (1.0 - known) / rays)
    return counted([found.exchange.nnz == 0, close, found.backs[1] == 0.0, found.sky[1] == 1.0, len(said) == 1])


def a_column_only_hides() -> Asked:
    """No two walls exchange more with a column in the room than without it."""
    rooms = room_with_column(False), room_with_column(True)
    free, hidden = (_found(room, rtol=0.005, max_rays=1 << 18) for room in rooms)
    walls = [plane for plane in rooms[0].planes if plane.axis < 2]
    rows, places = ([room.planes.index(plane) for plane in walls] for room in rooms)
    before, after = free.matrix.toarray()[np.ix_(rows, rows)], hidden.matrix.toarray()[np.ix_(places, places)]
    errors = np.hypot(free.errors.toarray()[np.ix_(rows, rows)], hidden.errors.toarray()[np.ix_(places, places)])
    return counted(after <= before + ERRORS * errors + _SUM)


def walls_between_rooms_hide_all() -> Asked:
    """Surfaces of two rooms exchange nothing, and by faces neither."""
    room = two_rooms()
    faces = room._replace(groups=np.arange(len(room.groups)))
    left = room.mesh.triangles[:, :, 0].max(axis=1) <= 1.0
    exchange = _found(faces).exchange.toarray()
    return counted(exchange[np.ix_(left, ~left)] == 0.0)


def threads_change_nothing() -> Asked:
    """All bits are the same for any number of threads."""
    right = []
    for room in (build() for build in ROOMS.values()):
        one, three = (_found(room, threads=threads) for threads in (1, 3))
        for a, b in ((one.exchange, three.exchange), (one.errors, three.errors)):
            right.append((a.toarray() == b.toarray()).ravel())
        right += [one.sky == three.sky, one.rays == three.rays]
    return counted(np.concatenate(right))


def faces_add_up_to_surfaces() -> Asked:
    """The exchange of two surfaces is the sum of that of their faces, within the errors of both."""
    right = []
    for room in (build() for build in ROOMS.values()):
        whole, number = _found(room), int(room.groups.max()) + 1
        parts = _found(room._replace(groups=np.arange(len(room.groups))))
        member = (room.groups == np.arange(number)[:, None]).astype(np.float64)
        sums = member @ parts.exchange.toarray() @ member.T
        squares = member @ (parts.errors.toarray() * parts.areas[:, None]) ** 2 @ member.T
        errors = np.sqrt(squares + (whole.errors.toarray() * whole.areas[:, None]) ** 2)
        # Entries that no ray has hit state no error.
        unseen = 15.0 * whole.areas[:, None] / max(int(whole.rays.min()), 256)
        right.append(np.abs(sums - whole.exchange.toarray()) <= ERRORS * errors + unseen)
    return counted(np.concatenate([part.ravel() for part in right]))


CHECKS = {
    "rows of view factors": Check(rows_are_whole, ("studies.view_factors", "studies.ViewFactors.matrix")),
    "rows by rays alone": Check(rows_by_rays_are_whole, ("studies.view_factors",)),
    "reciprocal exchange": Check(what_leaves_comes_back, ("studies.view_factors", "studies.ViewFactors")),
    "view factors are shares": Check(shares_are_shares, ("studies.view_factors",)),
    "planes and themselves": Check(planes_do_not_see_themselves, ("studies.view_factors",)),
    "closed rooms": Check(closed_rooms_have_no_sky, ("studies.view_factors",)),
    "backs of plates": Check(backs_do_not_receive, ("studies.view_factors",)),
    "a column in a room": Check(a_column_only_hides, ("studies.view_factors",)),
    "two rooms": Check(walls_between_rooms_hide_all, ("studies.view_factors",)),
    "view factors by any threads": Check(threads_change_nothing, ("studies.view_factors",)),
    "heat of two surfaces": Check(two_surfaces, ("radiosity.net_heat", "radiosity.Heat")),
    "heat of a room": Check(heat_adds_up, ("radiosity.net_heat",)),
    "faces and surfaces": Check(faces_add_up_to_surfaces, ("studies.view_factors",)),
}


def check(name: str) -> dict[str, Any]:
    """A row: the number of answers, and of those that are not as they must be."""
    return row_of(name, CHECKS[name])

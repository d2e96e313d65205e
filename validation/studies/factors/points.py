"""View factors from points: walls of a room by Lambert's formula, and the sky of a street past a block."""

from typing import Any

import numpy as np

from renderer.octree import Octree
from renderer.studies import view_factors_from
from validation.oracle.view_factors.polygons import element_to_polygon
from validation.studies.factors import street
from validation.studies.factors.forms import ERRORS, ROUNDING, UNSEEN
from validation.studies.factors.rooms import box_plates, of_plates

_SEED = 2054
_QUICK, _FULL = 0.02, 0.005
_RAYS = 1 << 21
CHECKS = ("points in a room", "points in a street with a block")


def check(name: str, quick: bool) -> dict[str, Any]:
    """A row: the largest error of a view factor and its largest share of what is allowed."""
    known, found = (_room if name == CHECKS[0] else _street)(_QUICK if quick else _FULL)
    shares, stated = np.concatenate([found.matrix.toarray(), found.sky[:, None]], axis=1), found.errors.toarray()
    # The sky's error is stated nowhere: rays at random err so much.
    skies = np.sqrt(known[:, -1:] * (1.0 - known[:, -1:]) / found.rays[:, None])
    stated = np.concatenate([stated, skies], axis=1)
    chance = np.where(shares > 0.0, ERRORS * stated, UNSEEN / found.rays[:, None])
    errors = np.where(np.isnan(known), 0.0, np.abs(shares - known))
    return {"subject": name, "source": _SOURCES[name], "entries": int(np.isfinite(known).sum()),
            "error": float(errors.max()), "stated": float(np.nanmax(stated)), "rays": int(found.rays.max()),
            "share_of_allowed": float((errors / (chance + ROUNDING)).max()), "share_of_asked": 0.0}  # fmt: skip


_SOURCES = {CHECKS[0]: "Lambert's formula", CHECKS[1]: "(cos a + cos b) / 2 of the angles of what hides"}


def _room(rtol: float) -> tuple[Any, Any]:
    """Points in the air and on walls, all normals of a cube and some askew."""
    plates = box_plates((0.0, 0.0, 0.0), (4.0, 2.5, 3.0), inward=True)
    room, rng = of_plates(plates), np.random.default_rng(_SEED)
    normals = np.concatenate([np.eye(3), -np.eye(3), rng.normal(size=(6, 3)), [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]])
    points = rng.uniform(0.1, 2.4, (len(normals), 3))
    # The last two lie on the floor and on a wall, 1/64 beside an edge.
    points[-2:] = [[0.015625, 1.0, 0.0], [0.0, 1.0, 2.984375]]
    known = [
        [*(element_to_polygon(point, normal, plate.corners()) for plate in plates), 0.0]
        for point, normal in zip(points, normals, strict=True)
    ]
    found = view_factors_from(Octree.from_mesh(room.mesh), points, normals, room.groups, rtol=rtol, max_rays=_RAYS)
    return np.array(known), found


def _street(rtol: float) -> tuple[Any, Any]:
    """Points of the left floor see the sky over the left wall, and over the block or the wall behind it."""
    room, (low, high, top) = street.room(), street.BLOCK
    x = low * (np.arange(24) + 0.5) / 24.0
    left = np.arctan2(street.LEFT, x)
    over = np.maximum(np.arctan2(street.RIGHT, street.WIDTH - x), np.arctan2(top, low - x))
    over = np.maximum(over, np.arctan2(top, high - x))
    points = np.stack([x, np.linspace(-1.0, 1.0, 24), np.zeros(24)], axis=1)
    found = view_factors_from(
        Octree.from_mesh(room.mesh), points, [0.0, 0.0, 1.0], room.groups, rtol=rtol, max_rays=_RAYS
    )
    known = np.full((24, int(room.groups.max()) + 2), np.nan)
    known[:, -1] = (np.cos(left) + np.cos(over)) / 2.0
    return known, found

"""View factors of rooms beside those that Embree's rays count: as many standard errors apart as chance allows."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.octree import Octree
from renderer.studies import view_factors
from validation.references.embree import Embree
from validation.studies.factors.rooms import ROOMS, Floats, Room

_SEED = 2055
# Rays from each surface for Embree: a share of a half then errs by 1e-3, or by 2e-4.
_QUICK, _FULL = 1 << 18, 1 << 23
_PART = 1 << 20
# Ours err less, so that it is Embree's errors that decide: those are sums of many rays, and normal.
_RTOL = {True: 0.004, False: 0.001}
_RAYS = 1 << 22
# Embree's rays start so far off their face, as a share of the mesh. What they see beside an edge changes, within as
# much of it: by less than the errors of these counts.
_OFF = 2e-6
# Chance is beyond five standard errors once in two million.
ERRORS = 5.0


def check(name: str, quick: bool) -> dict[str, Any]:
    """A row: entries, the largest difference of a view factor, and the largest in standard errors of both."""
    room = ROOMS[name]()
    found: Any = view_factors(Octree.from_mesh(room.mesh), room.groups, rtol=_RTOL[quick], max_rays=_RAYS)
    ours = np.concatenate([found.matrix.toarray(), found.sky[:, None]], axis=1)
    rays = _QUICK if quick else _FULL
    theirs = counted(room, rays) / rays
    # Of the sky the error is not stated: at most that of random rays.
    skies = np.sqrt(found.sky * (1.0 - found.sky) / np.maximum(found.rays, 1))
    stated = np.concatenate([found.errors.toarray(), skies[:, None]], axis=1)
    mean = np.clip((ours + theirs) / 2.0, 1.0 / rays, 1.0 - 1.0 / rays)
    errors = np.sqrt(stated**2 + mean * (1.0 - mean) / rays)
    apart = np.abs(ours - theirs) / errors
    return {"subject": f"view factors of a {name}", "surfaces": len(ours), "rays": rays, "entries": ours.size,
            "difference": float(np.abs(ours - theirs).max()), "apart": float(apart.max()),
            "mean_square": float(np.mean(apart[(ours > 0.0) | (theirs > 0.0)] ** 2))}  # fmt: skip


def counted(room: Room, rays: int) -> Floats:
    """The number of each surface's rays that end on each surface, and in the last column in the sky."""
    corners, rng = room.mesh.triangles, np.random.default_rng(_SEED)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(across, axis=1)
    number = int(room.groups.max()) + 1
    embree, off = Embree(room.mesh.vertices, room.mesh.faces), _OFF * float(room.mesh.extent.max())
    # A face that is not there stands for the sky.
    surface = np.append(room.groups, number)
    found = np.zeros((number, number + 1))
    for row in range(number):
        own = np.flatnonzero(room.groups == row)
        for begin in range(0, rays, _PART):
            faces = rng.choice(own, min(_PART, rays - begin), p=areas[own] / areas[own].sum())
            points, ways = _rays(corners[faces], across[faces] / areas[faces, None], rng)
            hit = embree.closest_hit(points + off * across[faces] / areas[faces, None], ways)[1]
            found[row] += np.bincount(surface[hit], minlength=number + 1)
    return found


def _rays(corners: Floats, normals: Floats, rng: np.random.Generator) -> tuple[Floats, NDArray[np.float64]]:
    """Points uniform in triangles; directions by the cosine: the normal and a point of the unit sphere."""
    a, b = rng.random((2, len(corners), 1))
    root = np.sqrt(a)
    points = (1.0 - root) * corners[:, 0] + root * (1.0 - b) * corners[:, 1] + root * b * corners[:, 2]
    sphere = rng.normal(size=points.shape)
    ways = normals + sphere / np.linalg.norm(sphere, axis=1, keepdims=True)
    return points, ways

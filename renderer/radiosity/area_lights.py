"""Direct light of small surfaces that emit: exact where a patch sees them whole, by shadow rays elsewhere.

View factors by rays have the same error for the light of a small lamp, which few rays hit, as for all that is reflected
around. So the light of lamps is computed by itself, and view factors are left the rest.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.queryable import Queries
from renderer.radiosity.lamps import POINTS
from renderer.shade.lights import SHORT_OF_LIGHT
from renderer.studies.factors.pairs import exact_pairs
from renderer.studies.factors.surfaces import areas_of
from renderer.system.terminal import progress_bar

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# What emits more than this share of all area is no lamp: its light is smooth, and its pairs are many.
_SMALL = 0.125
# The most pairs of a patch and a lamp: at some microseconds each, as long as view factors take.
_MOST_PAIRS = 1 << 22
# Pairs whose shadow rays are traced together: they take some 60 MB.
_TOGETHER = 1 << 14


def lamps_of(octree: Queries, emission: Floats, faces: Ints) -> Ints:
    """Those of ``faces`` (n,), which emit ``emission`` (n, 3), whose light ``light_of_lamps`` computes."""
    shines = emission.max(axis=1) > 0.0
    areas, count = areas_of(octree.mesh), int(shines.sum())
    small = areas[faces[shines]].sum() <= _SMALL * areas.sum() and count * len(faces) <= _MOST_PAIRS
    return np.flatnonzero(shines) if small else np.zeros(0, np.int64)


def light_of_lamps(octree: Queries, emission: Floats, faces: Ints, lamps: Ints, *, progress: bool = False) -> Floats:
    """The light of some of ``faces`` (n,), the rows ``lamps``, that arrives at all of them, (n, 3): the sum of F E."""
    found, areas = np.zeros((len(faces), 3)), areas_of(octree.mesh)[faces]
    with progress_bar(len(lamps), "lamp", progress) as update:
        for lamp in lamps:
            exchange = _exchange(octree, faces, int(lamp))
            found += (exchange / areas)[:, None] * emission[lamp]
            if update is not None:
                update(1)
    return found


def _exchange(octree: Queries, faces: Ints, lamp: int) -> Floats:
    """A_i F_ij of all faces and one of them, (n,)."""
    others = np.delete(np.arange(len(faces)), lamp)
    pairs = np.sort(np.stack([faces[others], np.full(len(others), faces[lamp])], axis=1), axis=1)
    exact, known = exact_pairs(octree._built, pairs, octree.threads)
    found = np.zeros(len(faces))
    found[others] = exact
    unknown = others[~known]
    for start in range(0, len(unknown), _TOGETHER):
        some = unknown[start : start + _TOGETHER]
        found[some] = _by_shadow_rays(octree, faces[some], int(faces[lamp]))
    return found


def _by_shadow_rays(octree: Queries, faces: Ints, lamp: int) -> Floats:
    """A_i F_ij of some faces and one, (k,): four points of each, and a ray between each two."""
    corners, normals, areas = octree.mesh.triangles, octree.mesh.face_normals(), areas_of(octree.mesh)
    near, far = np.einsum("pk,nkc->npc", POINTS, corners[faces])[:, :, None], (POINTS @ corners[lamp])[None, None]
    towards = np.broadcast_to(far - near, (len(faces), len(POINTS), len(POINTS), 3))
    squares = np.einsum("npqc,npqc->npq", towards, towards)
    cosines = np.einsum("npqc,nc->npq", towards, normals[faces]) * -(towards @ normals[lamp])
    lit = (cosines > 0.0) & (np.einsum("npqc,nc->npq", towards, normals[faces]) > 0.0)
    # No point sends a lamp more than all that it sends: the bound counts where faces meet.
    most = 1.0 / areas[lamp]
    share = np.minimum(np.divide(cosines, np.pi * squares**2, out=np.zeros_like(squares), where=lit), most)
    row, one, other = np.nonzero(lit)
    starts = np.broadcast_to(near, towards.shape)[row, one, other]
    hidden = octree.any_hit(starts, towards[row, one, other], t_max=SHORT_OF_LIGHT, leaving=faces[row], side=1)
    # rule: lamp-shadows
    seen = np.bincount(row, np.where(hidden, 0.0, share[row, one, other]), len(faces)) / len(POINTS) ** 2
    return seen * areas[faces] * areas[lamp]

"""Mitsuba's intersections as a reference for hits, ray by ray from Python.

The variant ``scalar_rgb`` works in float32 and finds hits with its own Embree in robust mode: it judges the answers
that come through Mitsuba, and is no independent judge of distances.
"""

from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray

import validation.references.mitsuba.scene as mitsuba_scene  # selects the variant


def version() -> str:
    """Version of the installed Mitsuba."""
    return str(mi.__version__)


class MitsubaHits:
    """A Mitsuba scene of one mesh: ``vertices`` (V, 3), ``faces`` (F, 3); copied, rounded to float32.

    >>> scene = MitsubaHits([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> scene.closest_hit([[0.25, 0.25, 1], [2, 2, 1]], [[0, 0, -2], [0, 0, -2]])
    (array([0.5, inf]), array([ 0, -1]))
    """

    _scene: Any

    def __init__(self, vertices: ArrayLike, faces: ArrayLike) -> None:
        points = np.array(vertices, dtype=np.float32).reshape(-1, 3)
        corners = np.array(faces, dtype=np.uint32).reshape(-1, 3)
        shape = mitsuba_scene.fill(mi.Mesh("mesh", len(points), len(corners)), points, corners)
        self._scene = mitsuba_scene.assemble({shape: 0} if len(corners) else {}, [])

    def closest_hit(self, origins: ArrayLike, directions: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Closest hits of ``origins``, ``directions`` (n, 3): (t, face), t in units of |direction|.

        ``t`` is Mitsuba's float32 stored as float64, inf on a miss; ``face`` is int64, -1 on a miss.
        """
        o = np.asarray(origins, dtype=np.float64).reshape(-1, 3)
        d = np.asarray(directions, dtype=np.float64).reshape(-1, 3)
        t, face = np.full(len(o), np.inf), np.full(len(o), -1, dtype=np.int64)
        for row, ray in enumerate(mitsuba_scene.mitsuba_rays((o, d))):
            found = self._scene.ray_intersect_preliminary(ray)
            if found.is_valid():
                t[row], face[row] = found.t, self._face(found)
        return t, face

    def _face(self, found: Any) -> int:
        return int(found.prim_index)

"""Our own ``BruteForce`` as a reference for hits: the octree's triangle test without the octree.

It shares the octree's triangle test, so it judges which faces the octree skips, and not the test.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer.octree import BruteForce


class Brute:
    """Every ray against every face of ``vertices`` (V, 3), ``faces`` (F, 3).

    >>> brute = Brute([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> brute.closest_hit([[0.25, 0.25, 1], [2, 2, 1]], [[0, 0, -2], [0, 0, -2]])
    (array([0.5, inf]), array([ 0, -1]))
    """

    def __init__(self, vertices: ArrayLike, faces: ArrayLike) -> None:
        self._faces = BruteForce(vertices, faces)

    def closest_hit(self, origins: ArrayLike, directions: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Closest hits of ``origins``, ``directions`` (n, 3): (t, face), t in units of |direction|.

        ``t`` is float64, inf on a miss; ``face`` is int64, -1 on a miss.
        """
        hits = self._faces.closest_hit(origins, directions)
        return hits.t, hits.face

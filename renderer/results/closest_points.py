"""The points of a mesh that are nearest to given points."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.results.attributes import Attributes
from renderer.results.hits import points_on, where_found


@dataclass(eq=False, slots=True)
class ClosestPoints(Attributes):
    """The nearest point of a mesh to each of some points. The shape (...) is that of the points.

    Attributes
    ----------
    distance : ndarray of float64, shape (...)
        inf if nothing is within ``max_distance``.
    face : ndarray of int64, shape (...)
        The face that has the nearest point; -1 if there is none.
    u, v : ndarray of float64, shape (...)
        Barycentrics: the point is (1 - u - v) p0 + u p1 + v p2; nan if there is none.

    Examples
    --------
    >>> from renderer import Octree
    >>> from renderer.mesh.shapes import box
    >>> near = Octree(box()).closest_point([[0.5, 0.25, 3], [5, 5, 5]], max_distance=4)
    >>> near.distance, near.face, near.u
    (array([ 2., inf]), array([10, -1]), array([0.25,  nan]))
    """

    distance: NDArray[np.float64]
    face: NDArray[np.int64]
    u: NDArray[np.float64]
    v: NDArray[np.float64]
    _mesh: Mesh = field(repr=False)

    @property
    def found(self) -> NDArray[np.bool_]:
        """Whether a point of the mesh is within ``max_distance``, (...) bool.

        Examples
        --------
        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> Octree(box()).closest_point([[0.5, 0.25, 3], [5, 5, 5]], max_distance=4).found
        array([ True, False])
        """
        return self.face >= 0

    @property
    def points(self) -> NDArray[np.float64]:
        """The nearest points, from the barycentrics, (..., 3) float64; nan if there is none.

        Examples
        --------
        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> Octree(box()).closest_point([[0.5, 0.25, 3], [5, 5, 5]], max_distance=4).points
        array([[0.5 , 0.25, 1.  ],
               [ nan,  nan,  nan]])
        """
        return where_found(self.found, points_on, self._mesh, self.face, self.u, self.v)

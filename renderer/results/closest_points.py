"""The points of a mesh that are nearest to given points."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.results.hits import points_on


@dataclass(eq=False, slots=True)
class ClosestPoints:
    """The point of a mesh that is nearest to each of some points; shapes are the leading dimensions of those.

    distance  (...) float64; inf where none is within max_distance
    face      (...) int64; -1 there
    u, v      (...) float64, P = (1 - u - v) p0 + u p1 + v p2; nan there

    >>> from renderer import Octree
    >>> from renderer.mesh.shapes import box
    >>> near = Octree.from_mesh(box()).closest_point([[0.5, 0.25, 3], [5, 5, 5]], max_distance=4)
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
        """Whether a point of the mesh is within max_distance, (...) bool.

        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> near = Octree.from_mesh(box()).closest_point([[0.5, 0.25, 3], [5, 5, 5]], max_distance=4)
        >>> near.found
        array([ True, False])
        """
        return self.face >= 0

    @property
    def points(self) -> NDArray[np.float64]:
        """The nearest points from the barycentrics, (..., 3) float64; nan where there is none.

        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> near = Octree.from_mesh(box()).closest_point([[0.5, 0.25, 3], [5, 5, 5]], max_distance=4)
        >>> near.points
        array([[0.5 , 0.25, 1.  ],
               [ nan,  nan,  nan]])
        """
        points, found = np.full((*self.face.shape, 3), np.nan), self.found
        points[found] = points_on(self._mesh, self.face[found], self.u[found], self.v[found])
        return points

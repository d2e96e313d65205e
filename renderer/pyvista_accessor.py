"""``mesh.octree`` of every ``pyvista.PolyData``: queries by an ``Octree`` of the mesh.

PyVista, from 0.48 on, finds this module by the entry point ``pyvista.accessors``, so a script need not import it.
"""

from typing import TYPE_CHECKING, Any

import numpy as np
import pyvista
from numpy.typing import NDArray

from renderer.arguments.types import ArrayLike
from renderer.errors import expect

if TYPE_CHECKING:
    from renderer.octree import Octree
    from renderer.results.closest_points import ClosestPoints
    from renderer.results.hits import AllHits, Hits

if not hasattr(pyvista, "register_dataset_accessor"):
    raise ImportError(
        f"renderer: mesh.octree takes PyVista 0.48 or newer, which has accessors, got {pyvista.__version__}"
    )


@pyvista.register_dataset_accessor("octree", pyvista.PolyData)
class OctreeAccessor:
    """The octree of a ``pyvista.PolyData`` of triangles, with the arguments and answers of ``renderer.Octree``.

    The tree is built by the first query, and again after a change of the mesh that PyVista notices. ``face`` is the
    number of a cell. Queries raise ``ValueError`` for a mesh that is not all triangles.

    Examples
    --------
    >>> import pyvista
    >>> sheet = pyvista.Plane(i_resolution=1, j_resolution=1).triangulate()
    >>> sheet.octree.closest_hit([[0.1, 0.2, 3.0]], [[0, 0, -1]]).t
    array([3.])
    """

    def __init__(self, dataset: Any) -> None:
        self._dataset = dataset
        self._time = -1
        self._octree: Octree | None = None

    @property
    def tree(self) -> "Octree":
        """The ``renderer.Octree`` of the mesh as it is now."""
        time = self._dataset.GetMTime()
        if self._octree is None or time != self._time:
            # Late, so that a mesh without queries imports no compiler.
            from renderer.octree import Octree

            # One that has no cells has no faces to speak of; vertices and lines are cells too.
            expect(self._dataset.is_all_triangles or self._dataset.n_cells == 0,
                   "mesh", "triangles only, as mesh.triangulate() makes them", "other cells")  # fmt: skip
            faces = np.asarray(self._dataset.faces).reshape(-1, 4)[:, 1:]
            self._octree, self._time = Octree(np.asarray(self._dataset.points, np.float64), faces), time
        return self._octree

    def closest_hit(self, origins: ArrayLike, directions: ArrayLike, **options: Any) -> "Hits":
        """The nearest hit of each ray; see ``Octree.closest_hit``."""
        return self.tree.closest_hit(origins, directions, **options)

    def any_hit(self, origins: ArrayLike, directions: ArrayLike, **options: Any) -> NDArray[np.bool_]:
        """Whether each ray hits anything; see ``Octree.any_hit``."""
        return self.tree.any_hit(origins, directions, **options)

    def all_hits(self, origins: ArrayLike, directions: ArrayLike, **options: Any) -> "AllHits":
        """All hits of each ray; see ``Octree.all_hits``."""
        return self.tree.all_hits(origins, directions, **options)

    def contains(self, points: ArrayLike, **options: Any) -> NDArray[np.bool_]:
        """Whether each point lies inside; see ``Octree.contains``."""
        return self.tree.contains(points, **options)

    def closest_point(self, points: ArrayLike, **options: Any) -> "ClosestPoints":
        """The point of the surface that is nearest to each point; see ``Octree.closest_point``."""
        return self.tree.closest_point(points, **options)

    def signed_distance(self, points: ArrayLike, **options: Any) -> NDArray[np.float64]:
        """The distance of each point, positive outside; see ``Octree.signed_distance``."""
        return self.tree.signed_distance(points, **options)

    def visible(self, points: ArrayLike, targets: ArrayLike, **options: Any) -> NDArray[np.bool_]:
        """Whether nothing lies between each point and its target; see ``Octree.visible``."""
        return self.tree.visible(points, targets, **options)

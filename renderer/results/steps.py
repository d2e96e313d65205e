"""The steps of searches for closest hits, counted."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(eq=False, slots=True)
class Steps:
    """Steps of the search for each ray's closest hit, of a ray that travels alone and goes to the nearest boxes first.

    nodes      (...) int64, the nodes entered, whose eight boxes are tested at once
    triangles  (...) int64, the triangles tested

    >>> from renderer import Octree
    >>> from renderer.mesh.shapes import box
    >>> steps = Octree.from_mesh(box()).count_steps([[0.5, 0.25, 3], [5, 5, 5]], [[0, 0, -1], [0, 0, -1]])
    >>> steps.nodes, steps.triangles
    (array([1, 1]), array([4, 0]))
    """

    nodes: NDArray[np.int64]
    triangles: NDArray[np.int64]

"""The steps of searches for closest hits, counted."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(eq=False, slots=True)
class Steps:
    """The steps of each ray's search for its closest hit, if it travels alone and comes to near boxes first.

    Attributes
    ----------
    nodes : ndarray of int64, shape (...)
        Nodes entered; the eight boxes of one are tested at once.
    triangles : ndarray of int64, shape (...)
        Triangles tested.

    Examples
    --------
    >>> from renderer import Octree
    >>> from renderer.mesh.shapes import box
    >>> steps = Octree(box()).count_steps([[0.5, 0.25, 3], [5, 5, 5]], [0, 0, -1])
    >>> steps.nodes, steps.triangles
    (array([1, 1]), array([4, 0]))
    """

    nodes: NDArray[np.int64]
    triangles: NDArray[np.int64]

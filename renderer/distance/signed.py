"""Signed distances: ``closest_point`` with the sign of ``contains``."""

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.types import ArrayLike
from renderer.distance.closest import closest_point
from renderer.inside.contains import contains
from renderer.mesh.mesh import Mesh
from renderer.trace.layout import Tree


def signed_distance(
    tree: Tree, mesh: Mesh, points: ArrayLike, max_distance: ArrayLike, rule: str, winding: bool, threads: int
) -> NDArray[np.float64]:
    """Distances, negative inside, see ``Octree.signed_distance``."""
    # First, as it is the quicker of the two to refuse a mesh.
    inside = contains(tree, mesh, points, True, rule, winding, threads)
    distance = closest_point(tree, mesh, points, max_distance, threads).distance
    return np.where(inside & (distance > 0.0), -distance, distance)

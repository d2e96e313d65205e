"""Points inside a mesh, for trimesh's ``contains``; the same for each call and batch."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from renderer.octree import Octree
    from renderer.trimesh_ray.trees import Traced

Floats = NDArray[np.float64]

# Directions of the votes: trimesh's first, and another in place of its random one, so that answers stay.
_VOTES = np.array([[0.4395064455, 0.617598629942, 0.652231566745], [-0.6210395307, 0.3329172404, -0.7095612921]])


def points_within(it: "Traced", points: Floats) -> NDArray[np.bool_]:
    """Whether each point (n, 3) lies inside, (n,); see ``RayMeshIntersector.contains_points``."""
    lower, upper = it.bounds
    within: NDArray[np.bool_] = ((points >= lower) & (points <= upper)).all(axis=1)  # of NaN too
    if not within.any():
        return within
    octree, some = it.solid, points[within]
    odd = len(octree.mesh.odd_edges)
    if odd == 0:
        within[within] = octree.contains(some, rule="even-odd")
    elif len(octree.mesh.open_edges) == odd:
        # Turned one way, but for the edges where the mesh is open. It may be inwards.
        from renderer.inside.contains import contains  # which imports the compiler

        mesh, tree = octree._built
        outwards = contains(tree, mesh, some, True, "nonzero", True, octree.threads)
        within[within] = outwards | (octree.winding_number(some) < -0.5)
    else:
        within[within] = _by_votes(octree, some)
    return within


def _by_votes(octree: "Octree", points: Floats) -> NDArray[np.bool_]:
    """Parity by two opposite rays, as trimesh counts: where they differ, and both hit, by another two."""
    inside = octree.closest_point(points).distance == 0.0
    left = np.flatnonzero(~inside)
    for direction in _VOTES:
        ahead, behind = (octree.count_hits(points[left], way) for way in (direction, -direction))
        agree = ahead % 2 == behind % 2
        inside[left[agree]] = ahead[agree] % 2 == 1
        # A ray that hits nothing has left the mesh: what is amiss adds hits rather than loses them.
        left = left[~agree & (ahead > 0) & (behind > 0)]
    return inside

"""Faces that lie in one plane at the place of a hit."""

import numpy as np
from numpy.typing import NDArray

from validation.references.ray_tree import Node


class Planes:
    """The faces of a mesh, corners (F, 3, 3), to be searched for those in one plane."""

    def __init__(self, corners: NDArray[np.float64]) -> None:
        self.corners = corners
        self._low, self._high = corners.min(axis=1), corners.max(axis=1)

    def coinciding(self, node: Node, room: float) -> dict[int, float]:
        """The other faces in the plane of the face that was hit which have the point, but for ``room``, by number: how
        far the point is within each.
        """
        boxes = ((self._low <= node.point + room) & (self._high >= node.point - room)).all(axis=1)
        faces = [face for face in np.flatnonzero(boxes).tolist() if face != node.face]
        found = {face: _within(self.corners[face], node, room) for face in faces}
        return {face: depth for face, depth in found.items() if depth >= -room}


def _within(corners: NDArray[np.float64], node: Node, room: float) -> float:
    """The distance of a hit's point from a face's nearest side: negative outside, and -inf in another plane."""
    a, b, c = corners
    normal = np.cross(b - a, c - a)
    area = float(np.linalg.norm(normal))
    if area == 0.0 or abs(float(normal @ node.normal)) < area * (1.0 - 1e-9):
        return -np.inf
    if abs(float(normal @ (node.point - a))) > area * room:
        return -np.inf
    sides = ((a, b), (b, c), (c, a))
    return min(
        float(normal @ np.cross(q - p, node.point - p)) / (area * float(np.linalg.norm(q - p))) for p, q in sides
    )

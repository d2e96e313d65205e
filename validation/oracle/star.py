"""Inside, outside or on the surface of a star-shaped solid with whole corners: exact, for points by the million.

Each point lies in the cone of some face as seen from the centre, and is inside where it lies before that face. Both are
signs of determinants of whole numbers, which float64 holds exactly.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
# Products of three coordinates up to this size, and the sums of six of them, are below 2^53.
LARGEST = 2.0**16
_TOGETHER = 1 << 16


@dataclass(frozen=True)
class Star:
    """A closed mesh around the origin whose faces all look outwards from it: ``vertices`` (V, 3) whole, ``faces``.

    Raises ``ValueError`` where a vertex is not whole or too large, or a face does not look outwards.
    """

    vertices: Floats
    faces: NDArray[np.int32]

    def __post_init__(self) -> None:
        if (self.vertices != np.round(self.vertices)).any() or np.abs(self.vertices).max() > LARGEST:
            raise ValueError("vertices: expected whole numbers up to 2^16")
        if (self._volumes() <= 0.0).any():
            raise ValueError("faces: expected all to look outwards from the origin")

    def _volumes(self) -> Floats:
        a, b, c = self.vertices[self.faces].transpose(1, 0, 2)
        volumes: Floats = (a * np.cross(b, c)).sum(axis=1)
        return volumes

    def sides(self, points: Floats) -> NDArray[np.int8]:
        """1 inside, 0 on the surface, -1 outside, (n,), of whole ``points`` (n, 3) up to 2^16."""
        if (points != np.round(points)).any() or np.abs(points).max(initial=0.0) > LARGEST:
            raise ValueError("points: expected whole numbers up to 2^16")
        return np.concatenate([np.empty(0, np.int8)] + [
            self._sides(points[begin : begin + _TOGETHER]) for begin in range(0, len(points), _TOGETHER)
        ])  # fmt: skip

    def _sides(self, points: Floats) -> NDArray[np.int8]:
        a, b, c = self.vertices[self.faces].transpose(1, 0, 2)
        # Determinants of the point with two corners each: it is in the cone where none is negative.
        within = np.ones((len(points), len(a)), np.bool_)
        for p, q in ((b, c), (c, a), (a, b)):
            within &= points @ np.cross(p, q).T >= 0.0
        # The determinant of the corners is the sum of these three where the point lies on the face.
        beyond = points @ (np.cross(b, c) + np.cross(c, a) + np.cross(a, b)).T - self._volumes()
        face = within.argmax(axis=1)
        if not within[np.arange(len(points)), face].all():
            raise ValueError("faces: expected a closed mesh")
        return -np.sign(beyond[np.arange(len(points)), face]).astype(np.int8)

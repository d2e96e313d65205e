"""Places of faces at which rays are aimed: corners, middles of edges, points between."""

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def places_of_faces(triangles: Floats, rng: Generator, count: int) -> Floats:
    """(count, 3) places of random faces of ``triangles`` (F, 3, 3), by fourths of their corners' coordinates."""
    corners = triangles[rng.integers(0, len(triangles), count)]
    kind = rng.integers(0, 3, (count, 1))
    places = np.where(kind == 0, corners[:, 0], (corners[:, 0] + corners[:, 1]) / 2)
    return np.where(kind == 2, (2 * corners[:, 0] + corners[:, 1] + corners[:, 2]) / 4, places)

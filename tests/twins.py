"""Slow twins of the queries: plain NumPy, every ray and point against every face, and no kernel of the renderer.

All numbers are meant to be small multiples of a power of two, and directions of such powers: then no sum, product or
quotient here is rounded, and what float64 tells is exact.
"""

import numpy as np
from numpy.typing import NDArray

from renderer import Mesh
from renderer.mesh.shapes import box

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Flags = NDArray[np.bool_]

# Cubes, by their least corners and sides: two that cross, and one apart.
CUBES = [((0.0, 0.0, 0.0), 4.0), ((2.0, 1.0, 3.0), 4.0), ((8.0, 8.0, 8.0), 2.0)]
MESH = Mesh.concatenate([box(lower, tuple(x + side for x in lower)) for lower, side in CUBES])
CORNERS = MESH.triangles
FACES = len(CORNERS)
NORMALS = MESH.face_normals()


def dot(a: Floats, b: Floats) -> Floats:
    """The products of vectors (..., 3)."""
    products: Floats = (a * b).sum(axis=-1)
    return products


def meetings(corners: Floats, origins: Floats, directions: Floats, edges: bool = True) -> Floats:
    """t (n, F) at which lines meet faces (F, 3, 3), with their edges; NaN where they miss or lie in the plane."""
    a, b, c = (corners[:, k] - origins[:, None] for k in range(3))
    ways = np.broadcast_to(directions[:, None], a.shape)
    # The volumes on the three sides of a line: of one sign where it passes between the corners.
    sides = np.stack([dot(ways, np.cross(*pair)) for pair in ((b, c), (c, a), (a, b))])
    whole = sides.sum(axis=0)
    least = (sides * np.sign(whole)).min(axis=0)
    inside = (whole != 0.0) & ((least >= 0.0) if edges else (least > 0.0))
    heights = dot(a, np.cross(b - a, c - a))
    return np.where(inside, heights / np.where(inside, whole, 1.0), np.nan)


def nearest_places(corners: Floats, points: Floats) -> Floats:
    """The place (n, F, 3) of each face that is nearest to each point."""
    places, least = [], []
    for a, b in ((0, 1), (1, 2), (2, 0)):
        first, way = corners[:, a], corners[:, b] - corners[:, a]
        share = np.clip(dot(points[:, None] - first, way) / dot(way, way), 0.0, 1.0)
        places.append(first + share[..., None] * way)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    height = dot(corners[:, 0] - points[:, None], normals) / dot(normals, normals)
    foot = points[:, None] + height[..., None] * normals
    turns = [
        dot(np.cross(corners[:, (k + 1) % 3] - corners[:, k], foot - corners[:, k]), normals) >= 0.0 for k in range(3)
    ]
    places.append(np.where(np.logical_and.reduce(turns)[..., None], foot, np.inf))
    with np.errstate(invalid="ignore"):
        least = [dot(place - points[:, None], place - points[:, None]) for place in places]
    chosen = np.argmin(np.stack(least), axis=0)
    found: Floats = np.take_along_axis(np.stack(places), chosen[None, ..., None], axis=0)[0]
    return found


def holding(corners: Floats, points: Floats) -> Flags:
    """Which faces (n, F) hold each point, at their edges and corners too."""
    held: Flags = (nearest_places(corners, points) == points[:, None]).all(axis=-1)
    return held

"""Points of a level grid, dropped on a mesh or at one height."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.arrays import real_argument
from renderer.arguments.points import check_points
from renderer.arguments.types import ArrayLike
from renderer.arguments.up import up_axis
from renderer.errors import expect
from renderer.mesh.mesh import Mesh
from renderer.queryable import Queries
from renderer.rayscene.scene import RayScene
from renderer.studies.places import FacePoints
from renderer.studies.share import octree_of

Floats = NDArray[np.float64]

# More would not fit into memory with their normals and results: 7 numbers of 8 bytes each.
_MOST = 1 << 28


def grid_points(
    octree: Queries | RayScene,
    spacing: float,
    *,
    bounds: ArrayLike | None = None,
    height: float | None = None,
    up: Literal["x", "y", "z"] = "z",
) -> FacePoints:
    """The points of a level grid, dropped from above on the mesh, or all at one height.

    Parameters
    ----------
    octree : Octree, BruteForce or RayScene
        Of a scene faces are those of its ``merged`` mesh, as for `occlusion`.
    spacing : float
        The distance between neighbours, > 0, in scene units.
    bounds : array_like, shape (2, 3), optional
        The least and greatest corner of the region, such as the `bounds` of a `Mesh`. The coordinates along `up` do
        not matter. By default the region is that of the whole mesh.
    height : float, optional
        The coordinate along `up` of all points. By default points are dropped: they lie where rays from above first
        hit the mesh.
    up : {"x", "y", "z"}, default "z"
        The axis that points up.

    Returns
    -------
    FacePoints
        Along a row the first of the two level coordinates grows, from row to row the second. The first point lies
        half a spacing inside the least corner. The points of a row or column share their coordinate exactly.

        Dropped points have the face that was hit, and its normal on the upper side. There is no point where a ray
        hits nothing. At a `height`, normals point up and faces are -1.

    Raises
    ------
    ValueError
        If an argument is not as above, or if there would be more than 2^28 points.

    Examples
    --------
    >>> from renderer import Octree
    >>> from renderer.mesh.shapes import box
    >>> from renderer.studies import grid_points, sky_view_factor
    >>> octree = Octree.from_mesh(box((0, 0, 0), (2, 1, 5)))
    >>> grid_points(octree, 1.0).points
    array([[0.5, 0.5, 5. ],
           [1.5, 0.5, 5. ]])
    >>> street = grid_points(octree, 1.0, bounds=[[2, 0, 0], [4, 1, 0]], height=1.5)
    >>> street.points
    array([[2.5, 0.5, 1.5],
           [3.5, 0.5, 1.5]])
    >>> sky_view_factor(octree, street.points, street.normals).round(2)
    array([0.73, 0.89])
    """
    octree = octree_of(octree)
    axis = up_axis(up)
    level = [a for a in range(3) if a != axis]
    lower, upper = octree.mesh.bounds if bounds is None else _region(bounds)
    lower, upper = lower[level], upper[level]
    ordered = bounds is None or bool((lower <= upper).all())
    expect(ordered, "bounds", "the least corner, then the greatest", f"{lower.tolist()} and {upper.tolist()}")
    first, second = _coordinates(lower, upper, spacing)
    points = np.empty((len(first) * len(second), 3))
    points[:, level] = np.stack([g.ravel() for g in np.meshgrid(first, second)], axis=1)
    if height is not None:
        given = real_argument("height", height)
        expect(given.ndim == 0 and bool(np.isfinite(given)), "height", "a finite number", repr(height))
        points[:, axis] = given
        normals = np.tile(np.eye(3)[axis], (len(points), 1))
        return FacePoints(points, normals, np.full(len(points), -1, np.int64))
    points[:, axis] = _above(octree.mesh, axis)
    return _dropped(octree, points, axis)


def _region(bounds: ArrayLike) -> Floats:
    """The corners of a region."""
    corners, shape = check_points("bounds", bounds)
    expect(shape == (2,), "bounds", "shape (2, 3)", f"shape {(*shape, 3)}")
    return corners


def _coordinates(lower: Floats, upper: Floats, spacing: float) -> list[Floats]:
    """The coordinates of a grid along both axes."""
    given = real_argument("spacing", spacing)
    good = given.ndim == 0 and bool(0.0 < given < np.inf)
    expect(good, "spacing", "a number > 0, in the mesh's units", f"{spacing}")
    with np.errstate(over="ignore"):
        counts = np.maximum(1.0, np.ceil((upper - lower) / spacing))
        number = counts.prod()
    expect(bool(number <= _MOST), "spacing", f"a spacing with at most {_MOST:,} points", f"{number:.4g}")
    along = [lower[a] + spacing * (np.arange(int(counts[a])) + 0.5) for a in (0, 1)]
    # The last may stand beside the mesh, and too far away for any ray.
    return [values[values <= upper[a]] for a, values in enumerate(along)]


def _above(mesh: Mesh, axis: int) -> float:
    """A coordinate above all of a mesh."""
    return float(mesh.bounds[1][axis]) + float(np.abs(mesh.bounds).max()) * 2.0**-20 + float(mesh.extent.max())


def _dropped(octree: Queries, starts: Floats, axis: int) -> FacePoints:
    """The first hits of rays from above, without misses."""
    hits = octree.closest_hit(starts, 0.0 - np.eye(3)[axis])
    seen = np.flatnonzero(hits.hit)
    points, normals = starts[seen], hits.normals[seen]
    # Only the height is the hit's: its other coordinates are those of the grid but for rounding.
    points[:, axis] = hits.points[seen, axis]
    normals[normals[:, axis] < 0.0] *= -1.0
    return FacePoints(points, normals, hits.face[seen].astype(np.int64))

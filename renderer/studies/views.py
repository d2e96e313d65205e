"""Views from one place: faces seen by an eye, depths seen by a camera."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.arrays import flag_argument
from renderer.arguments.counts import count_argument
from renderer.arguments.points import check_points, farthest_of
from renderer.arguments.types import ArrayLike
from renderer.errors import expect
from renderer.mesh.mesh import face_normals
from renderer.numerics.film_rays import along
from renderer.queryable import Queries
from renderer.rayscene.scene import RayScene
from renderer.results.hits import points_on
from renderer.studies.edge_on import are_edge_on
from renderer.studies.film import AffineCamera, Camera, axis_of, rays_of
from renderer.studies.share import ROWS as _ROWS
from renderer.studies.share import Snapshot, octree_of, snapshot_of
from renderer.system.terminal import progress_bar

Floats = NDArray[np.float64]

# The most parts of a face's sides.
_MOST_CUTS = 64


def visible_faces(
    octree: Queries | RayScene, eye: ArrayLike, *, cuts: int = 1, progress: bool = False
) -> NDArray[np.bool_]:
    """The faces seen from an eye: those of which at least one sample point sees the eye.

    Parameters
    ----------
    octree : Octree, BruteForce or RayScene
        Of a scene the faces are those of its ``merged`` mesh, as for `occlusion`.
    eye : array_like, shape (3,)
        An eye on the surface is not hidden by the faces that hold it.
    cuts : int, default 1
        From 1 to 64. Each face is cut into cuts^2 equal triangles, and their centroids are its sample points. A face
        that is seen only between them counts as hidden.
    progress : bool, default False
        Show a bar on standard error if that is a terminal.

    Returns
    -------
    ndarray of bool, shape (F,)
        False for a face without area, and for one whose plane holds the eye, exactly.

    Raises
    ------
    ValueError
        If an argument is not as above.

    See Also
    --------
    renderer.Octree.visible

    Notes
    -----
    Rays leave the faces on the side of the eye, without an epsilon. So a single sheet is seen from behind, too; of a
    closed mesh only those faces are seen that look towards the eye.

    Examples
    --------
    >>> from renderer import Octree
    >>> from renderer.mesh.shapes import box
    >>> from renderer.studies import visible_faces
    >>> octree = Octree.from_mesh(box())
    >>> visible_faces(octree, [0.5, 0.5, 9]).nonzero()[0]
    array([10, 11])
    """
    octree = octree_of(octree)
    place = _one_place("eye", eye, octree)
    cuts = count_argument("cuts", cuts, 1, _MOST_CUTS)
    mesh = octree.mesh
    seen = np.zeros(len(mesh.faces), np.bool_)
    with progress_bar(len(seen), "face", flag_argument("progress", progress)) as update:
        for begin in range(0, len(seen), _ROWS):
            corners = mesh.vertices[mesh.faces[begin : begin + _ROWS]]
            left = begin + np.flatnonzero(face_normals(corners).any(axis=1) & ~are_edge_on(corners, place))
            for u, v in _centroids(cuts):
                points = points_on(mesh, left, np.full(len(left), u), np.full(len(left), v))
                # rule: faces-in-view
                reached = octree.visible(points, place, leaving=left)
                seen[left[reached]] = True
                left = left[~reached]
            if update is not None:
                update(len(corners))
    return seen


def depth_map(
    octree: Queries | RayScene,
    camera: Camera | AffineCamera,
    width: int,
    height: int,
    *,
    depth: Literal["distance", "z"] = "distance",
    progress: bool = False,
) -> Floats:
    """The distance from a camera to the surface at the centre of each pixel.

    Parameters
    ----------
    octree : Octree, BruteForce or RayScene
    camera : PerspectiveCamera, OrthographicCamera or another of the cameras
        Or anything with a method ``rows(width, height)`` as theirs, which returns an array (6, 3).
    width, height : int
        The size in pixels, from 1 to 2^16.
    depth : {"distance", "z"}, default "distance"
        The distance along the ray, or along the axis of the camera, as depth sensors and OpenCV have it. The latter is
        below 0 behind a fish-eye.
    progress : bool, default False
        Show a bar on standard error if that is a terminal.

    Returns
    -------
    ndarray of float64, shape (height, width)
        In scene units; inf where the ray hits nothing. The distance along the ray has the bits of ``Image.depth``.

    Raises
    ------
    ValueError
        If an argument is not as above.

    Examples
    --------
    >>> from renderer import Octree, PerspectiveCamera
    >>> from renderer.mesh.shapes import box
    >>> from renderer.studies import depth_map
    >>> camera = PerspectiveCamera(eye=(0.5, 0.25, 3), target=(0.5, 0.25, 0))
    >>> depth_map(Octree.from_mesh(box()), camera, 3, 1)
    array([[inf,  2., inf]])

    A wall across the view is equally far along the axis, and not along the rays.

    >>> camera = PerspectiveCamera(eye=(0.5, 0.5, 2), target=(0.5, 0.5, 0), fov=60)
    >>> [depth_map(Octree.from_mesh(box()), camera, 3, 3, depth=depth)[0].round(3) for depth in ("z", "distance")]
    [array([1., 1., 1.]), array([1.139, 1.072, 1.139])]
    """
    surfaces = snapshot_of(octree)
    width, height = count_argument("width", width, 1, 1 << 16), count_argument("height", height, 1, 1 << 16)
    expect(isinstance(depth, str) and depth in ("distance", "z"), "depth", "'distance' or 'z'", repr(depth))
    rays_at, found = rays_of(camera, width, height), np.empty((height, width))
    axis = axis_of(camera, width, height) if depth == "z" else None
    lines, x = max(1, _ROWS // width), np.arange(width) + 0.5
    with progress_bar(height, "line", flag_argument("progress", progress)) as update:
        for top in range(0, height, lines):
            y = np.arange(top, min(top + lines, height)) + 0.5
            origins, directions = rays_at(*np.meshgrid(x, y))
            t = _depths(surfaces, origins, directions)
            found[top : top + lines] = t if axis is None else np.where(np.isinf(t), t, t * along(directions, axis))
            if update is not None:
                update(len(y))
    return found


def _depths(surfaces: Queries | Snapshot, origins: Floats, directions: Floats) -> Floats:
    """The t of rays (..., 3), inf for those whose direction is NaN."""
    there = ~np.isnan(directions[..., 0])
    if there.all():
        return surfaces.closest_hit(origins, directions).t
    t = np.full(there.shape, np.inf)
    t[there] = surfaces.closest_hit(origins[there], directions[there]).t
    return t


def _one_place(argument: str, place: ArrayLike, octree: Queries) -> Floats:
    rows, shape = check_points(argument, place, farthest_of(octree.tree.scale))
    expect(shape == (), argument, "shape (3,)", f"shape {(*shape, 3)}")
    return rows[0]


def _centroids(cuts: int) -> Iterator[tuple[float, float]]:
    """The barycentrics u and v of the centroids of the cuts^2 equal parts of a triangle."""
    for i in range(cuts):
        for j in range(cuts - i):
            yield (i + 1.0 / 3.0) / cuts, (j + 1.0 / 3.0) / cuts
            if i + j < cuts - 1:
                yield (i + 2.0 / 3.0) / cuts, (j + 2.0 / 3.0) / cuts

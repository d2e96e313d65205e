"""What is seen from one place: faces by an eye, depths by a camera, points by a scanner."""

from __future__ import annotations

from collections.abc import Iterator
from numbers import Integral
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.arrays import flag_argument, real_array
from renderer.arguments.counts import count_argument
from renderer.arguments.points import check_points, farthest_of
from renderer.arguments.types import ArrayLike
from renderer.distance.on_surface import on_surface
from renderer.errors import expect
from renderer.mesh.mesh import face_normals
from renderer.queryable import Queries
from renderer.results.hits import Hits, points_on
from renderer.studies.directions import Pattern, check_count, fibonacci_sphere
from renderer.studies.edge_on import are_edge_on
from renderer.studies.share import check_directions, check_reach, expect_octree, lengths_of, limits_of
from renderer.system.terminal import progress_bar
from renderer.trace.batch import Leaving, check_rays, offset_origins
from renderer.trace.closest import closest_hits
from renderer.trace.starts.cone import HOLDERS_WORDS
from renderer.trace.starts.record import ANCHOR, CODE, FACE, HEAD, ROW, WAY
from renderer.trace.starts.search import side_taken
from renderer.trace.walk import stack_size

Floats = NDArray[np.float64]

# Rays that are written down together: a tenth of a second of tracing, some dozens of megabytes.
_ROWS = 1 << 18
# The most parts of a face's sides.
_MOST_CUTS = 64


class Camera(Protocol):
    """Anything with the rays of a camera, such as a ``PerspectiveCamera``."""

    def rows(self, width: int, height: int) -> Floats:
        """The affine map from film to rays (6, 3): origin, its steps along x and y, direction, and its steps."""


class Scan(NamedTuple):
    """The point cloud of a scanner: the hits of its rays, in the order of the rays. Rays that miss are left out.

    Attributes
    ----------
    points : ndarray of float64, shape (m, 3)
    normals : ndarray of float64, shape (m, 3)
        Unit vectors, on the side from which the corners of the face run counter-clockwise.
    distances : ndarray of float64, shape (m,)
        From the scanner, in scene units.
    faces : ndarray of int64, shape (m,)
    rays : ndarray of int64, shape (m,)
        The row of each ray in the directions of the scanner.

    See Also
    --------
    scan

    Examples
    --------
    >>> from renderer import Octree
    >>> from renderer.mesh.shapes import box
    >>> from renderer.studies import scan
    >>> cloud = scan(Octree.from_mesh(box((-1, -1, -1), (1, 1, 1))), [0, 0, 0], 1000)
    >>> len(cloud.points), bool((abs(cloud.points).max(axis=1).round(9) == 1).all())
    (1000, True)
    """

    points: Floats
    normals: Floats
    distances: Floats
    faces: NDArray[np.int64]
    rays: NDArray[np.int64]


def visible_faces(octree: Queries, eye: ArrayLike, *, cuts: int = 1, progress: bool = False) -> NDArray[np.bool_]:
    """Which faces are seen from an eye: those of which at least one sample point sees the eye.

    Parameters
    ----------
    octree : Octree or BruteForce
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
    expect_octree(octree)
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


def depth_map(octree: Queries, camera: Camera, width: int, height: int, *, progress: bool = False) -> Floats:
    """The distance from a camera to the surface at the centre of each pixel, along the ray.

    Parameters
    ----------
    octree : Octree or BruteForce
    camera : PerspectiveCamera or OrthographicCamera
        Or anything with a method ``rows(width, height)`` as theirs, which returns an array (6, 3).
    width, height : int
        The size in pixels, from 1 to 2^16.
    progress : bool, default False
        Show a bar on standard error if that is a terminal.

    Returns
    -------
    ndarray of float64, shape (height, width)
        In scene units; inf where the ray hits nothing. The distance is along the ray, not along the axis of the
        camera. It has the bits of ``Image.depth``.

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
    """
    expect_octree(octree)
    width, height = count_argument("width", width, 1, 1 << 16), count_argument("height", height, 1, 1 << 16)
    expect(callable(getattr(camera, "rows", None)), "camera", "a camera", type(camera).__name__)
    rows, depth = _rows_of(camera, width, height), np.empty((height, width))
    lines, x = max(1, _ROWS // width), np.arange(width)[:, None] + 0.5
    with progress_bar(height, "line", flag_argument("progress", progress)) as update:
        for top in range(0, height, lines):
            y = np.arange(top, min(top + lines, height))[:, None, None] + 0.5
            # In the order in which pictures add them up, so that bits are the same.
            origins = rows[0] + (rows[1] * x + rows[2] * y)
            directions = rows[3] + (rows[4] * x + rows[5] * y)
            good = np.isfinite(directions).all(axis=-1) & directions.any(axis=-1)
            if not good.all():
                expect(False, "camera", "rows with finite, non-zero directions", f"{directions[~good][0].tolist()}")
            depth[top : top + lines] = octree.closest_hit(origins, _unit(directions)).t
            if update is not None:
                update(len(y))
    return depth


def scan(
    octree: Queries,
    origin: ArrayLike,
    pattern: Pattern | ArrayLike | int = 100_000,
    *,
    normal: ArrayLike | None = None,
    max_distance: float = np.inf,
    progress: bool = False,
    distance: float | None = None,
) -> Scan:
    """The point cloud that a scanner measures, without noise: the first hit of each ray.

    Parameters
    ----------
    octree : Octree or BruteForce
    origin : array_like, shape (3,)
        Where the scanner stands.
    pattern : Pattern, array_like of shape (k, 3), or int, default 100_000
        The directions of the rays, of any length; or their number, 1 to 2^24, for `fibonacci_sphere`.
    normal : array_like, shape (3,), optional
        For a scanner on the surface: it stands on this side. By default it stands on the outer side of its face,
        from which the corners run counter-clockwise.
    max_distance : float, default inf
        How far the scanner reaches, in scene units.
    progress : bool, default False
        Show a bar on standard error if that is a terminal.
    distance : float, optional
        The former name of `max_distance`.

    Returns
    -------
    Scan
        Without the rays that hit nothing. If the scanner stands on the surface, a ray that leads through it hits it
        at a distance of 0.

    Raises
    ------
    ValueError
        If an argument is not as above.

    Examples
    --------
    >>> from renderer import Octree
    >>> from renderer.mesh.shapes import box
    >>> from renderer.studies import scan
    >>> cloud = scan(Octree.from_mesh(box()), [0.5, 0.25, 3], [[0, 0, -2], [0, 0, 1]])
    >>> cloud.points, cloud.distances, cloud.rays
    (array([[0.5 , 0.25, 1.  ]]), array([2.]), array([0]))
    """
    expect_octree(octree)
    place = _one_place("origin", origin, octree)
    directions = _directions(pattern)
    reach = limits_of(check_reach(max_distance, distance), directions)
    towards = None if normal is None else _one_direction("normal", normal)
    parts: list[Scan] = []
    with progress_bar(len(directions), "ray", flag_argument("progress", progress)) as update:
        for begin in range(0, len(directions), _ROWS):
            some = directions[begin : begin + _ROWS]
            hits = _first_hits(octree, place, some, reach[begin : begin + _ROWS], towards)
            rays = np.flatnonzero(hits.hit)
            away = hits.t[rays] * lengths_of(some[rays])
            parts.append(Scan(hits.points[rays], hits.normals[rays], away, hits.face[rays], begin + rays))
            if update is not None:
                update(len(some))
    return Scan(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))


def _first_hits(octree: Queries, place: Floats, directions: Floats, reach: Floats, normal: Floats | None) -> Hits:
    """The first hits of rays from one place, which may lie on the surface."""
    mesh, tree = octree._built
    rays, _ = check_rays(place, directions, 0.0, reach)
    face, code, anchor = (part[0] for part in on_surface(tree, mesh, place[None], np.full(1, -1), octree.threads))
    if face >= 0:
        # rule: outer-side-of-scanner
        outer = face_normals(mesh.vertices[mesh.faces[face : face + 1]])[0] if normal is None else normal
        row = _row_on_side(octree, face, code, anchor, outer)
        count, (face, code) = len(directions), row[[FACE, CODE]].astype(np.int64)
        leaving = Leaving(np.full(count, face), np.full(1, code), np.tile(row[ANCHOR : ANCHOR + 3], (count, 1)))
        rays = offset_origins(rays, leaving, mesh, tree.scale, octree.threads)
        rays.starts[HEAD:].view(np.float64).reshape(count, ROW)[:, WAY : WAY + 3] = outer
    return closest_hits(tree, rays, mesh, octree.threads)


def _row_on_side(octree: Queries, face: int, code: int, anchor: Floats, normal: Floats) -> Floats:
    """The row of ``starts.record`` of a start on a face, on the side of a normal."""
    mesh, tree = octree._built
    row = np.zeros(ROW)
    row[FACE], row[CODE], row[ANCHOR : ANCHOR + 3] = face, code, anchor
    stack, memory = np.empty(stack_size(tree.depth), np.int64), np.empty(HOLDERS_WORDS, np.int64)
    side_taken(tree.descriptor, mesh.vertices, mesh.faces, row, tuple(normal.tolist()), stack, memory)
    return row


def _one_place(argument: str, place: ArrayLike, octree: Queries) -> Floats:
    rows, shape = check_points(argument, place, farthest_of(octree.tree.scale))
    expect(shape == (), argument, "shape (3,)", f"shape {(*shape, 3)}")
    return rows[0]


def _one_direction(argument: str, direction: ArrayLike) -> Floats:
    expect(np.shape(direction) == (3,), argument, "shape (3,)", f"shape {np.shape(direction)}")
    return check_directions(argument, np.reshape(direction, (1, 3)))[0]


def _rows_of(camera: Camera, width: int, height: int) -> Floats:
    """A camera's affine map."""
    expected = "rows(width, height) of shape (6, 3), finite"
    try:
        given = camera.rows(width, height)
    except TypeError as error:  # of a class, or of one that takes other arguments
        raise ValueError(f"camera: expected {expected}, got {error}") from error
    try:
        rows = real_array(given)
    except ValueError as error:
        raise ValueError(f"camera: expected {expected}, got {type(given).__name__}") from error
    expect(rows.shape == (6, 3), "camera", expected, f"shape {rows.shape}")
    bad = ~np.isfinite(rows).all(axis=1)
    expect(not bad.any(), "camera", expected, f"{rows[int(bad.argmax())].tolist()} in row {int(bad.argmax())}")
    return rows.astype(np.float64)


def _directions(pattern: Pattern | ArrayLike | int) -> Floats:
    if isinstance(pattern, Pattern):
        return check_directions("pattern", pattern.directions)
    if isinstance(pattern, Integral):  # of NumPy, too
        return fibonacci_sphere(check_count("pattern", pattern)).directions
    return check_directions("pattern", pattern)


def _centroids(cuts: int) -> Iterator[tuple[float, float]]:
    """The barycentrics u and v of the centroids of the cuts^2 equal parts of a triangle."""
    for i in range(cuts):
        for j in range(cuts - i):
            yield (i + 1.0 / 3.0) / cuts, (j + 1.0 / 3.0) / cuts
            if i + j < cuts - 1:
                yield (i + 2.0 / 3.0) / cuts, (j + 2.0 / 3.0) / cuts


def _unit(vectors: Floats) -> Floats:
    """``vec3.normalized`` of vectors (..., 3) that are not zero, with its bits."""
    scaled = vectors * (1.0 / np.abs(vectors).max(axis=-1, keepdims=True))
    x, y, z = (scaled[..., k : k + 1] for k in range(3))
    return scaled * (1.0 / np.sqrt(x * x + y * y + z * z))

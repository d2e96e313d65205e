"""The points that a scanner measures: the first hit of each ray, and those behind surfaces that let light through."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields
from functools import partial
from numbers import Integral
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.arrays import flag_argument, real_argument
from renderer.arguments.counts import count_argument
from renderer.arguments.points import check_points, farthest_of
from renderer.arguments.types import ArrayLike
from renderer.errors import expect
from renderer.queryable import Queries
from renderer.rayscene.hits import SceneHits
from renderer.rayscene.scene import RayScene
from renderer.results.hits import Hits
from renderer.studies.directions import Pattern, check_count, fibonacci_sphere
from renderer.studies.film import AffineCamera, Camera, is_camera, rays_of
from renderer.studies.share import ROWS as _ROWS
from renderer.studies.share import Snapshot, check_directions, check_reach, lengths_of, limits_of, snapshot_of
from renderer.studies.stand import hits_from_stand
from renderer.system.terminal import progress_bar
from renderer.trace.layout import MASK_BITS

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

_RAYS = 100_000  # by default


@dataclass(frozen=True, eq=False)
class Scan:
    """The point cloud of a scanner, in the order of the rays. Rays that miss are left out.

    It unpacks as its first five arrays.

    Attributes
    ----------
    points : ndarray of float64, shape (m, 3)
    normals : ndarray of float64, shape (m, 3)
        Unit vectors, on the side from which the corners of the face run counter-clockwise.
    distances : ndarray of float64, shape (m,)
        From the scanner, in scene units.
    faces : ndarray of int64, shape (m,)
    rays : ndarray of int64, shape (m,)
        The row of each ray in the directions or poses of the scanner.
    cosines : ndarray of float64, shape (m,)
        The cosine of the angle between ray and normal, from 0 to 1, on either side of the face.
    returns : ndarray of int64, shape (m,)
        1 for the first hit of a ray, 2 for the next one.
    objects, instances : ndarray of int64, shape (m,)
        As of ``SceneHits``, with `faces` of the object's mesh; 0 for what is no scene.

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
    faces: Integers
    rays: Integers
    cosines: Floats
    returns: Integers
    objects: Integers
    instances: Integers

    def __iter__(self) -> Iterator[NDArray[Any]]:
        return iter((self.points, self.normals, self.distances, self.faces, self.rays))


def scan(
    octree: Queries | RayScene,
    origin: ArrayLike | Camera | AffineCamera,
    pattern: Pattern | ArrayLike | int | None = None,
    *,
    normal: ArrayLike | None = None,
    max_distance: float = np.inf,
    returns: int = 1,
    through: ArrayLike = (),
    mask: int = MASK_BITS,
    ignore: SceneHits | None = None,
    progress: bool = False,
    distance: float | None = None,
) -> Scan:
    """The point cloud that a scanner measures, without noise: the first hit of each ray, or its first few.

    Parameters
    ----------
    octree : Octree, BruteForce or RayScene
    origin : array_like, shape (3,), (k, 3), (3, 4), (4, 4), (k, 3, 4) or (k, 4, 4); or a camera
        Where the scanner stands. A matrix is its pose: it also turns the directions. For a scanner that moves while
        it scans, give one place or pose for each ray. A camera, as of `depth_map`, has a ray through the centre of each
        pixel that shows something.
    pattern : Pattern, array_like of shape (k, 3), or int, default 100_000
        The directions of the rays, of any length; or their number, 1 to 2^24, for `fibonacci_sphere`. A single one is
        that of all rays. For a camera: width and height of its film, from 1 to 2^16 pixels, by default those that it is
        calibrated for.
    normal : array_like, shape (3,), optional
        For a scanner on the surface, at one place: it stands on this side. By default it stands on the outer side of
        its face, from which the corners run counter-clockwise.
    max_distance : float, default inf
        How far the scanner reaches, in scene units.
    returns : int, default 1
        The most hits of a ray. A ray goes on behind a hit on an object in `through`, and ends at any other.
    through : array_like of int, optional
        The objects that let light through. An octree is object 0.
    mask : int, default all bits
    ignore : SceneHits, shape (), optional
        As for ``RayScene.closest_hit``, for all rays: the body that carries the scanner is not hit.
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

    Notes
    -----
    Where a camera, a scanner that moves, or one with `mask` or `ignore`, touches the surface, its rays hit that at
    once, as those of ``closest_hit`` do.

    Examples
    --------
    >>> from renderer import Octree
    >>> from renderer.mesh.shapes import box
    >>> from renderer.studies import scan
    >>> cloud = scan(Octree.from_mesh(box()), [0.5, 0.25, 3], [[0, 0, -2], [0, 0, 1]])
    >>> cloud.points, cloud.distances, cloud.rays
    (array([[0.5 , 0.25, 1.  ]]), array([2.]), array([0]))

    Through a pane of glass to the wall behind it, from a scanner that a pose turns to +y.

    >>> from renderer import RayScene
    >>> scene = RayScene()
    >>> pane, wall = scene.add(box((-1, 2, -1), (1, 2.5, 1))), scene.add(box((-1, 4, -1), (1, 5, 1)))
    >>> pose = [[0, -1, 0, 0.2], [1, 0, 0, 0], [0, 0, 1, 0.1]]
    >>> cloud = scan(scene, pose, [[1, 0, 0]], returns=3, through=pane)
    >>> cloud.objects, cloud.distances, cloud.returns
    (array([0, 0, 1]), array([2. , 2.5, 4. ]), array([1, 2, 3]))

    By a depth camera, whose ray in row y and column x has the number y * width + x.

    >>> from renderer import PerspectiveCamera
    >>> camera = PerspectiveCamera(eye=(0.5, 0.25, 3), target=(0.5, 0.25, 0))
    >>> scan(Octree.from_mesh(box()), camera, (3, 1)).rays
    array([1])
    """
    surfaces = snapshot_of(octree)
    beams = _beams(surfaces, origin, pattern, check_reach(max_distance, distance))
    closest = _closest(surfaces, mask, ignore)
    stands = len(beams.origins) == 1 and not is_camera(origin) and mask == MASK_BITS and ignore is None
    expected = "None where the scanner moves or has a mask or ignore, or is a camera"
    expect(stands or normal is None, "normal", expected, repr(normal))
    side = None if normal is None else _one_direction("normal", normal)
    returns = count_argument("returns", returns, 1)
    clear = _clear_objects(surfaces, through, returns)
    parts: list[Scan] = []
    with progress_bar(len(beams.rays), "ray", flag_argument("progress", progress)) as update:
        for begin in range(0, max(len(beams.rays), 1), _ROWS):
            some = beams.part(slice(begin, begin + _ROWS))
            if stands:
                hits = hits_from_stand(surfaces, some.origins[0], some.directions, some.reach, side)
            else:
                hits = closest(some.origins, some.directions, t_max=some.reach)
            parts += _each_return(hits, some, closest, returns, clear)
            if update is not None:
                update(len(some.rays))
    return _joined(parts)


class _Beams(NamedTuple):
    """Rays of a scanner: origins (1, 3) or (k, 3), directions (k, 3), the t that they reach and their numbers (k,)."""

    origins: Floats
    directions: Floats
    reach: Floats
    rays: Integers

    def part(self, rows: slice | Integers) -> _Beams:
        """Some of the rays."""
        origins = self.origins if len(self.origins) == 1 else self.origins[rows]
        return _Beams(origins, self.directions[rows], self.reach[rows], self.rays[rows])


def _beams(
    surfaces: Queries | Snapshot,
    origin: ArrayLike | Camera | AffineCamera,
    pattern: Pattern | ArrayLike | int | None,
    reach: float,
) -> _Beams:
    """The rays of a scanner. Raises ``ValueError`` naming argument and row."""
    if is_camera(origin):
        return _beams_of_film(origin, pattern, reach)
    directions, given = _directions(pattern), real_argument("origin", origin)
    posed = given.shape[-2:] in ((3, 4), (4, 4))
    if posed:
        rigid = given.shape[-2] == 3 or bool((given[..., 3, :] == [0.0, 0.0, 0.0, 1.0]).all())
        expect(rigid, "origin", "poses whose last row is 0 0 0 1", "others")
    farthest = farthest_of(surfaces._built.tree.scale)
    places, shape = check_points("origin", given[..., :3, 3] if posed else given, farthest)
    count = shape[0] if shape else len(directions)
    fits = len(shape) < 2 and count > 0 and len(directions) in (1, count)
    expect(fits, "origin", f"a place or pose, or {len(directions)}, of shape (..., 3)", f"shape {given.shape}")
    if posed:
        x, y, z = (part[:, None] for part in directions.T)
        turn = given[..., :3, :3].reshape(-1, 3, 3)
        # In the order of sums of ``Mesh.transformed``.
        directions = check_directions("origin", (x * turn[:, :, 0] + y * turn[:, :, 1]) + z * turn[:, :, 2])
    elif len(directions) < count:
        directions = np.tile(directions, (count, 1))
    return _Beams(places, directions, limits_of(reach, directions), np.arange(count))


def _beams_of_film(camera: Any, pattern: object, reach: float) -> _Beams:
    """The rays of a camera, without those of pixels that show nothing."""
    given = getattr(camera, "film_size", None) if pattern is None else pattern
    sizes = np.asarray(getattr(given, "directions", given))
    whole = sizes.shape == (2,) and sizes.dtype.kind in "iu" and bool(((sizes >= 1) & (sizes <= 1 << 16)).all())
    expect(whole, "pattern", "width and height of the camera's film, from 1 to 65536", repr(pattern))
    width, height = sizes.tolist()
    origins, directions = rays_of(camera, width, height)(*np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5))
    origins, directions = np.broadcast_to(origins, directions.shape).reshape(-1, 3), directions.reshape(-1, 3)
    shown = np.flatnonzero(~np.isnan(directions[:, 0]))
    return _Beams(origins[shown], directions[shown], np.full(len(shown), reach), shown)


def _closest(surfaces: Queries | Snapshot, mask: int, ignore: SceneHits | None) -> Callable[..., Hits | SceneHits]:
    """The query for closest hits, with what the rays of a scanner pass through."""
    expect(np.ndim(mask) == 0, "mask", "one for all rays", f"shape {np.shape(mask)}")
    if isinstance(surfaces, Queries):
        expect(mask == MASK_BITS, "mask", "all bits, where there is no RayScene", repr(mask))
        expect(ignore is None, "ignore", "None, where there is no RayScene", type(ignore).__name__)
        return surfaces.closest_hit
    shape = np.shape(getattr(ignore, "t", 0.0))
    expect(shape == (), "ignore", "one hit for all rays", f"shape {shape}")
    return partial(surfaces.closest_hit, mask=mask, ignore=ignore)


def _clear_objects(surfaces: Queries | Snapshot, through: ArrayLike, returns: int) -> NDArray[Any]:
    """The objects that let light through."""
    known = [0] if isinstance(surfaces, Queries) else [member.id for member in surfaces._built.members]
    clear = real_argument("through", through).ravel()
    unknown = clear[~np.isin(clear, known)].tolist()
    expect(not unknown, "through", f"some of the objects {known}", unknown)
    expect(returns == 1 or len(clear) > 0, "through", "objects that let light through, for several returns", "none")
    return clear


def _each_return(
    hits: Hits | SceneHits, beams: _Beams, closest: Callable[..., Any], most: int, clear: NDArray[Any]
) -> Iterator[Scan]:
    """The first hits of rays as a cloud, and then those behind hits on ``clear`` objects, up to the ``most``-th."""
    gone = np.zeros(len(beams.rays))
    for number in range(1, most + 1):
        hit, gone = np.flatnonzero(hits.hit), gone + hits.t
        cloud = _cloud(hits, hit, beams, gone, number)
        yield cloud
        goes = np.isin(cloud.objects, clear)
        if number == most or not goes.any():
            return
        on = hit[goes]
        leaving, gone = hits[on].through(), gone[on]
        beams = beams.part(on)._replace(origins=cloud.points[goes])
        # A hit at the end of the reach may, by rounding, be beyond it.
        left = np.maximum(beams.reach - gone, 0.0)
        hits = closest(beams.origins, beams.directions, t_max=left, leaving=leaving)


def _cloud(hits: Hits | SceneHits, hit: Integers, beams: _Beams, t: Floats, number: int) -> Scan:
    """The points of the rays ``hit``, which have come as far as ``t``."""
    directions, normals = beams.directions[hit], hits.normals[hit]
    lengths = lengths_of(directions)
    cosines = np.minimum(np.abs((normals * directions).sum(axis=1)) / lengths, 1.0)
    objects = instances = np.zeros(len(hit), np.int64)
    if isinstance(hits, SceneHits):
        objects, instances = hits.object[hit], hits.instance[hit]
    return Scan(
        hits.points[hit], normals, t[hit] * lengths, hits.face[hit], beams.rays[hit], cosines,
        np.full(len(hit), number), objects, instances,
    )  # fmt: skip


def _joined(parts: list[Scan]) -> Scan:
    """All parts in one, by the number of the ray and then of the return."""
    names = [field.name for field in fields(Scan)]
    whole = Scan(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))
    if (whole.returns == 1).all():
        return whole
    order = np.argsort(whole.rays, kind="stable")
    return Scan(*(getattr(whole, name)[order] for name in names))


def _one_direction(argument: str, direction: ArrayLike) -> Floats:
    expect(np.shape(direction) == (3,), argument, "shape (3,)", f"shape {np.shape(direction)}")
    return check_directions(argument, np.reshape(direction, (1, 3)))[0]


def _directions(pattern: Pattern | ArrayLike | int | None) -> Floats:
    if pattern is None:
        return fibonacci_sphere(_RAYS).directions
    if isinstance(pattern, Pattern):
        return check_directions("pattern", pattern.directions)
    if isinstance(pattern, Integral):  # of NumPy, too
        return fibonacci_sphere(check_count("pattern", pattern)).directions
    return check_directions("pattern", pattern)

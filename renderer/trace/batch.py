"""Batches of rays as queries get them: shapes and bounds are checked, and starts are moved off their faces."""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.arrays import real_argument
from renderer.arguments.limits import FARTHEST, LONGEST, SHORTEST
from renderer.arguments.types import ArrayLike
from renderer.errors import expect
from renderer.mesh.mesh import Mesh
from renderer.system.spare import recycled
from renderer.system.threads import for_chunks
from renderer.trace.spawn import FARTHEST_START, offset_from_faces
from renderer.trace.starts.record import ALL, FACE, FACES, HEAD, IGNORED, MASK, ROW, ROW_STEP, VERTICES

# The most rays of a chunk: small enough to share 1e5 rays between many threads and to stop within milliseconds on
# Ctrl-C, large enough that taking a chunk costs nothing beside its 1 to 10 ms of tracing.
CHUNK = 8192

Floats = NDArray[np.float64]

_FLOAT64 = np.dtype(np.float64)
_MOST = float(np.finfo(np.float64).max)


def _vectors(argument: str, values: ArrayLike) -> NDArray[Any]:
    """The values as an array (..., 3)."""
    if are_plain(values, values, 0.0, math.inf):
        return cast(Floats, values)
    array = real_argument(argument, values)
    expect(array.ndim >= 1 and array.shape[-1] == 3, argument, "shape (..., 3)", f"shape {array.shape}")
    return array


def _doubles(array: NDArray[Any]) -> NDArray[np.float64]:
    flags = array.flags
    if flags.c_contiguous and flags.writeable and array.dtype == np.float64:
        return array
    with np.errstate(over="ignore", invalid="ignore"):  # infinities and NaN are rejected with their row
        # Writable, because Numba would compile all kernels again for arrays that are not.
        return np.require(array, np.float64, ("C_CONTIGUOUS", "WRITEABLE"))


def _bound(argument: str, given: NDArray[Any], shape: tuple[int, ...], largest: float) -> NDArray[np.float64]:
    """One bound for all rays or one per ray, from 0 to ``largest``, as a (1,) or (n,) array."""
    array = _doubles(given.reshape(-1) if given.ndim == 0 else np.broadcast_to(given, shape).reshape(-1))
    good = (array >= 0.0) & (array <= largest)
    if not good.all():
        row = int((~good).argmax())
        expect(False, argument, f"numbers from 0 to {largest:.3g}", f"{array[row]} in row {row}")
    return array


def _no_starts() -> NDArray[np.int64]:
    starts = np.zeros(HEAD + ROW, np.int64)
    row = starts[HEAD:].view(np.float64)
    row[FACE], row[MASK], row[IGNORED] = -1.0, ALL, -1.0
    return starts


# The usual bounds of rays.
ZERO, INFINITY = np.zeros(1), np.full(1, np.inf)
# The starts of rays that start on no surface; and for kernels that are compiled apart for such rays.
NO_STARTS = _no_starts()
ALONE = np.zeros(1, np.uint64)


class RayBatch(NamedTuple):
    """n rays whose shapes and bounds passed the checks; build them with ``check_rays``.

    origins and directions (n, 3) or (1, 3) for all, t_min and t_max (n,) or (1,) for all, all float64; starts as in
    ``starts.record``, int64.
    """

    origins: NDArray[np.float64]
    directions: NDArray[np.float64]
    t_min: NDArray[np.float64] = ZERO
    t_max: NDArray[np.float64] = INFINITY
    starts: NDArray[np.int64] = NO_STARTS

    @property
    def number(self) -> int:
        """The number of rays."""
        return count_rays(self.origins, self.directions)


def count_rays(origins: NDArray[np.float64], directions: NDArray[np.float64]) -> int:
    """The number of rays, by the arrays of a ``RayBatch``."""
    return len(origins) if len(origins) != 1 else len(directions)


NO_SHAPES: Mapping[str, tuple[int, ...]] = {}


def check_rays(
    origins: ArrayLike,
    directions: ArrayLike,
    t_min: ArrayLike,
    t_max: ArrayLike,
    starts: Mapping[str, tuple[int, ...]] = NO_SHAPES,
) -> tuple[RayBatch, tuple[int, ...]]:
    """A batch whose shapes, types and bounds are checked, and the shape of its rays: that of all arguments together.

    ``starts`` has the shapes of ``leaving`` and ``side``. Whether each ray is in range is checked when it is traced.
    Raises ``ValueError`` naming the argument and, for a bad bound, its row.
    """
    if not starts and are_plain(origins, directions, t_min, t_max):
        rays = RayBatch(cast(Floats, origins), cast(Floats, directions))
        return rays, (rays.number,)
    origins, directions = _vectors("origins", origins), _vectors("directions", directions)
    low = None if type(t_min) is float and t_min == 0.0 else real_argument("t_min", t_min)
    high = None if type(t_max) is float and t_max == np.inf else real_argument("t_max", t_max)
    alike = origins.shape == directions.shape and origins.ndim == 2 and origins.strides[0] and directions.strides[0]
    shape = (len(origins),) if alike else broadcast_shape("directions", directions, "origins", origins)
    joint = shape if low is None and high is None and not starts else _joint(shape, low, high, starts)
    if not alike or joint != shape:
        shape = joint
        origins, directions = _rows(origins, shape), _rows(directions, shape)
        if len(origins) == len(directions) == 1 != math.prod(shape):
            # One of them says how many rays there are.
            directions = np.broadcast_to(directions, (math.prod(shape), 3))
    return RayBatch(
        _doubles(origins),
        _doubles(directions),
        ZERO if low is None else _bound("t_min", low, shape, _MOST),
        INFINITY if high is None else _bound("t_max", high, shape, np.inf),
    ), shape


def _joint(
    shape: tuple[int, ...],
    low: NDArray[Any] | None,
    high: NDArray[Any] | None,
    starts: Mapping[str, tuple[int, ...]],
) -> tuple[int, ...]:
    """The shape of rays together with those of their bounds and starts."""
    bounds = {name: () if bound is None else bound.shape for name, bound in (("t_min", low), ("t_max", high))}
    for argument, other in {**bounds, **starts}.items():
        shape = joint_shape(argument, other, shape, "that of the rays")
    return shape


def broadcast_shape(argument: str, values: NDArray[Any], other: str, others: NDArray[Any]) -> tuple[int, ...]:
    """The leading dimensions of two arrays (..., 3) together."""
    try:
        return np.broadcast_shapes(values.shape[:-1], others.shape[:-1])
    except ValueError:
        expected = f"a shape that goes with that of {other}, {others.shape}"
        expect(False, argument, expected, f"shape {values.shape}")
        raise


def joint_shape(argument: str, shape: tuple[int, ...], others: tuple[int, ...], of: str) -> tuple[int, ...]:
    """The shape of an argument that has a value a ray, or a point, and of those together."""
    try:
        return np.broadcast_shapes(shape, others)
    except ValueError:
        expect(False, argument, f"a number or a shape that goes with {of}, {others}", f"shape {shape}")
        raise


def _rows(array: NDArray[Any], shape: tuple[int, ...]) -> NDArray[Any]:
    """Vectors for rays of the given dimensions as rows: one for each ray, or one for all."""
    if array.size == 3 and 0 not in shape:
        return array.reshape(1, 3)
    if array.shape[:-1] != shape:
        array = np.broadcast_to(array, (*shape, 3))
    # A vector that was broadcast to all rays, as the eye of a camera, need not be copied for each.
    if array.size > 3 and not any(array.strides[:-1]):
        return array[(0,) * (array.ndim - 1)].reshape(1, 3)
    return array.reshape(-1, 3)


def are_plain(origins: Any, directions: Any, t_min: Any, t_max: Any) -> bool:
    """Whether rays are as most calls have them: two arrays (n, 3) that kernels take as they are, and the usual bounds.

    Few rays notice how long this takes.
    """
    if not (type(origins) is type(directions) is np.ndarray and type(t_min) is type(t_max) is float):
        return False
    shape = origins.shape
    if not (origins.dtype is directions.dtype is _FLOAT64 and len(shape) == 2 and shape[1] == 3):
        return False
    if not (shape == directions.shape and t_min == 0.0 and t_max == math.inf):
        return False
    return origins.flags.carray and directions.flags.carray


def check_faces(argument: str, faces: ArrayLike, shape: tuple[int, ...], most: int) -> NDArray[np.int64]:
    """Faces, -1 for none, broadcast to rays of some shape, as an array (n,) of its own.

    Raises ``ValueError`` naming the argument and, for a face beyond the last of ``most``, its row.
    """
    # A copy, which no other thread can change once it is checked.
    rows = np.array(whole_numbers(argument, faces, shape), np.int64).reshape(-1)
    good = (rows >= -1) & (rows < most)
    if not good.all():
        row = int((~good).argmax())
        expect(False, argument, f"faces from 0 to {most - 1}, or -1", f"{rows[row]} in row {row}")
    return rows


def whole_numbers(argument: str, values: ArrayLike, shape: tuple[int, ...]) -> NDArray[Any]:
    """Integers as an array broadcast to a shape. Raises ``ValueError`` naming the argument."""
    array = real_argument(argument, values)
    try:
        rows = np.broadcast_to(array, shape)
        fits = array.dtype.kind in "iu"
    except ValueError:
        rows, fits = array, False
    expect(fits, argument, f"an integer or integers of shape {shape}", f"{array.dtype} of shape {array.shape}")
    return rows


def make_starts(count: int, mesh: Mesh) -> NDArray[np.int64]:
    """Starts of rays as in ``starts.record``, on a mesh that the caller keeps; rows follow HEAD, not yet written."""
    starts = recycled(HEAD + ROW * count, np.int64)
    starts[ROW_STEP], starts[VERTICES], starts[FACES] = ROW, mesh.vertices.ctypes.data, mesh.faces.ctypes.data
    return starts


class Leaving(NamedTuple):
    """The faces that rays leave, and how: checked arrays of one row a ray.

    faces    (n,) int64, -1 for none
    code     (n,) or (1,) int64, the bits of ``starts.record``
    anchors  (n, 3) float64: u, v and the pile; or no row, where the origins say where the rays start
    """

    faces: NDArray[np.int64]
    code: NDArray[np.int64]
    anchors: NDArray[np.float64]


def offset_origins(rays: RayBatch, leaving: Leaving, mesh: Mesh, scale: float, threads: int) -> RayBatch:
    """The rays with their origins moved off the faces that they leave, see ``spawn.offset_from_faces``, and with their
    ``starts``; ``scale`` is the tree's.

    Raises ``ValueError`` naming the argument and the row for an origin out of bounds or not on its face.
    """
    count = rays.number
    near, finite = np.abs(rays.origins) <= FARTHEST / scale, np.isfinite(rays.directions)
    if not (near.all() and finite.all()):
        # Rejected before it is moved, so that the message names the numbers as given.
        reject(rays, int((~(near & finite).all(axis=1)).argmax()), scale)
    origins, starts, bad = recycled(3 * count).reshape(count, 3), make_starts(count, mesh), list[int]()
    rows, corners = starts[HEAD:].view(np.float64).reshape(count, ROW), (mesh.vertices, mesh.faces)

    def leave(begin: int, end: int) -> None:
        row = offset_from_faces(*corners, rays.origins, rays.directions, leaving, origins, rows, begin, end, scale)
        if row >= 0:
            bad.append(row)

    for_chunks(leave, count, CHUNK, threads)
    if bad:
        row = min(bad)
        face, origin = leaving.faces[row], rays.origins[row if len(rays.origins) > 1 else 0]
        expected = f"a point of face {face} that it leaves, within {FARTHEST_START:.1g} of the largest coordinate"
        expect(False, "origins", expected, f"{origin.tolist()} in row {row}")
    return rays._replace(origins=origins, starts=starts)


def reject(rays: RayBatch, row: int, scale: float) -> None:
    """Raise the error for a ray out of bounds."""
    origin = rays.origins[row if len(rays.origins) > 1 else 0]
    with np.errstate(over="ignore"):
        near = (np.abs(origin) * scale <= FARTHEST).all()
    if not near:
        expected = f"finite numbers within {FARTHEST / scale:.3g}"
        expect(False, "origins", expected, f"{origin.tolist()} in row {row}")
    expected = f"finite, non-zero vectors, the largest component from {SHORTEST:.3g} to {LONGEST:.3g}"
    direction = rays.directions[row if len(rays.directions) > 1 else 0]
    expect(False, "directions", expected, f"{direction.tolist()} in row {row}")

"""Batches of rays as queries get them: shapes and bounds are checked, and starts are moved off their faces."""

from typing import Any, NamedTuple, TypeGuard

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer.arrays import real_argument
from renderer.errors import expect
from renderer.limits import FARTHEST, LONGEST, SHORTEST
from renderer.mesh.mesh import Mesh
from renderer.process.parallel import for_chunks
from renderer.trace.spawn import leave_faces

# The most rays of a chunk: small enough to share 1e5 rays between many threads and to stop within milliseconds on
# Ctrl-C, large enough that taking a chunk costs nothing beside its 1 to 10 ms of tracing.
CHUNK = 8192

_MOST = float(np.finfo(np.float64).max)


def _vectors(argument: str, values: ArrayLike) -> NDArray[Any]:
    """The values as an array (n, 3); one vector (3,) becomes one row."""
    array = real_argument(argument, values)
    if array.shape == (3,):
        return array[None]
    expect(array.ndim == 2 and array.shape[1] == 3, argument, "shape (n, 3)", f"shape {array.shape}")
    return array


def _doubles(array: NDArray[Any]) -> NDArray[np.float64]:
    flags = array.flags
    if flags.c_contiguous and flags.writeable and array.dtype == np.float64:
        return array
    with np.errstate(over="ignore", invalid="ignore"):  # infinities and NaN are rejected with their row
        # Writable, because Numba would compile all kernels again for arrays that are not.
        return np.require(array, np.float64, ("C_CONTIGUOUS", "WRITEABLE"))


def _bound(argument: str, value: ArrayLike, count: int, largest: float) -> NDArray[np.float64]:
    """One bound for all rays or one per ray, from 0 to ``largest``, as a (1,) or (n,) array."""
    array = real_argument(argument, value)
    fits = array.ndim == 0 or array.shape == (count,)
    expect(fits, argument, f"a number or shape ({count},)", f"shape {array.shape}")
    array = _doubles(np.atleast_1d(array))
    good = (array >= 0.0) & (array <= largest)
    if not good.all():
        row = int((~good).argmax())
        expect(False, argument, f"numbers from 0 to {largest:.3g}", f"{array[row]} in row {row}")
    return array


class RayBatch(NamedTuple):
    """Rays whose shapes and bounds passed the checks; build them with ``check_rays``.

    origins (n, 3) or (1, 3) for all, directions (n, 3), t_min and t_max (n,) or (1,) for all, all float64.
    """

    origins: NDArray[np.float64]
    directions: NDArray[np.float64]
    t_min: NDArray[np.float64]
    t_max: NDArray[np.float64]


_ZERO, _INFINITY = np.zeros(1), np.full(1, np.inf)


def check_rays(origins: ArrayLike, directions: ArrayLike, t_min: ArrayLike, t_max: ArrayLike) -> RayBatch:
    """Check shapes, types and bounds of a batch; whether each ray is in range is checked when it is traced.

    Raises ``ValueError`` naming the argument and, for a bad bound, its row.
    """
    if not (_is_plain(origins) and _is_plain(directions)):
        origins, directions = _vectors("origins", origins), _vectors("directions", directions)
    if len(origins) != len(directions):
        origins, directions = _paired(origins, directions)
    count = len(directions)
    # The usual bounds share arrays.
    low = _ZERO if type(t_min) is float and t_min == 0.0 else _bound("t_min", t_min, count, _MOST)
    high = _INFINITY if type(t_max) is float and t_max == np.inf else _bound("t_max", t_max, count, np.inf)
    # An eye broadcast to all rays, as of a camera, need not be copied for each.
    shared = count > 1 and origins.strides[0] == 0
    return RayBatch(_doubles(origins[:1] if shared else origins), _doubles(directions), low, high)


def _paired(origins: NDArray[Any], directions: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Origins and directions row by row, where one of them may be a single row for all of the other."""
    if len(origins) == 1:
        return np.broadcast_to(origins, directions.shape), directions
    one = len(directions) == 1
    expect(one, "directions", f"{len(origins)} rows as in origins, or one for all", f"{len(directions)} rows")
    return origins, np.broadcast_to(directions, origins.shape)


def _is_plain(values: ArrayLike) -> TypeGuard[NDArray[np.float64]]:
    """Whether it is an (n, 3) array of float64, as most are; a quick check for calls with few rays."""
    return type(values) is np.ndarray and values.dtype == np.float64 and values.ndim == 2 and values.shape[1] == 3


def moved_off(
    rays: RayBatch, leaving: ArrayLike, mesh: Mesh, scale: float, threads: int, argument: str = "leaving"
) -> RayBatch:
    """The rays with their starts moved off the faces ``leaving``, see ``spawn.leave_faces``.

    ``scale`` is the tree's, ``argument`` the name of ``leaving`` in errors.

    Raises ``ValueError`` naming the argument and, for a face that is not there or an origin out of bounds, its row.
    """
    count = len(rays.directions)
    array = real_argument(argument, leaving)
    whole = array.dtype.kind in "iu" and (array.ndim == 0 or array.shape == (count,))
    expect(whole, argument, f"an integer or integers of shape ({count},)", f"{array.dtype} of shape {array.shape}")
    # A copy, which no other thread can change once it is checked.
    faces = np.array(np.broadcast_to(array, (count,)), np.int64)
    good = (faces >= -1) & (faces < len(mesh.faces))
    if not good.all():
        row = int((~good).argmax())
        expect(False, argument, f"faces from 0 to {len(mesh.faces) - 1}, or -1", f"{faces[row]} in row {row}")
    sound = (np.abs(rays.origins) <= FARTHEST / scale).all(axis=1) & np.isfinite(rays.directions).all(axis=1)
    if not sound.all():
        # Rejected before it is moved, so that the message names the numbers as given.
        reject(rays, int((~sound).argmax()), scale)
    starts = np.empty((count, 3))

    def leave(begin: int, end: int) -> None:
        leave_faces(mesh.vertices, mesh.faces, rays.origins, rays.directions, faces, starts, (begin, end, scale))

    for_chunks(leave, count, CHUNK, threads)
    return rays._replace(origins=starts)


def reject(rays: RayBatch, row: int, scale: float) -> None:
    """Raise the error for a ray out of bounds."""
    origin = rays.origins[row if len(rays.origins) > 1 else 0]
    with np.errstate(over="ignore"):
        near = (np.abs(origin) * scale <= FARTHEST).all()
    if not near:
        expected = f"finite numbers within {FARTHEST / scale:.3g}"
        expect(False, "origins", expected, f"{origin.tolist()} in row {row}")
    expected = f"finite, non-zero vectors, the largest component from {SHORTEST:.3g} to {LONGEST:.3g}"
    expect(False, "directions", expected, f"{rays.directions[row].tolist()} in row {row}")

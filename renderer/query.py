"""Batches of rays against a tree: checks at the boundary, chunks on threads, and the results."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer.batch import FARTHEST, LONGEST, SHORTEST, search_chunk, trace_chunk, trace_few
from renderer.errors import expect
from renderer.layout import Tree
from renderer.mesh import Mesh, face_normals
from renderer.parallel import for_chunks
from renderer.prepared import WIDTH
from renderer.spawn import leave_faces
from renderer.traverse import make_memory, stack_size

# Small enough to share 1e5 rays between many threads and to stop within milliseconds on Ctrl-C, large enough that
# taking a chunk costs nothing beside its 1 to 10 ms of tracing.
CHUNK = 8192
# Few rays go in smaller chunks, sixteen a thread, so that no thread has much more to do than another.
_LEAST_CHUNK = 1024
# Fewer rays than a packet holds go one by one, by a kernel that compiles in a fraction of the time.
FEW = WIDTH - 1


@dataclass(frozen=True, eq=False)
class Hits:
    """Closest hits, one row a ray.

    t     (n,) float64, in units of |direction|; inf on a miss
    face  (n,) int64; -1 on a miss
    u, v  (n,) float64, P = (1 - u - v) p0 + u p1 + v p2; nan on a miss
    """

    t: NDArray[np.float64]
    face: NDArray[np.int64]
    u: NDArray[np.float64]
    v: NDArray[np.float64]
    _mesh: Mesh = field(repr=False)

    @property
    def hit(self) -> NDArray[np.bool_]:
        """(n,) bool."""
        return self.face >= 0

    @property
    def points(self) -> NDArray[np.float64]:
        """Hit points from the barycentrics, (n, 3) float64; nan on a miss."""
        points = np.full((len(self.t), 3), np.nan)
        hit = self.hit
        corners = self._mesh.vertices[self._mesh.faces[self.face[hit]]]
        u, v = self.u[hit, None], self.v[hit, None]
        points[hit] = (1.0 - u - v) * corners[:, 0] + u * corners[:, 1] + v * corners[:, 2]
        return points

    @property
    def normals(self) -> NDArray[np.float64]:
        """Unit geometric normals by the faces' winding, (n, 3) float64; nan on a miss."""
        normals = np.full((len(self.t), 3), np.nan)
        hit = self.hit
        corners = self._mesh.vertices[self._mesh.faces[self.face[hit]]]
        normals[hit] = face_normals(corners)
        return normals


def _array(argument: str, values: ArrayLike) -> NDArray[Any]:
    try:
        array = np.asarray(values)
    except ValueError as error:  # a ragged list
        raise ValueError(f"{argument}: expected an array, got {error}") from None
    expect(array.dtype.kind in "fiu", argument, "real numbers", f"dtype {array.dtype}")
    return array


def _vectors(argument: str, values: ArrayLike) -> NDArray[Any]:
    array = _array(argument, values)
    expect(array.ndim == 2 and array.shape[1] == 3, argument, "shape (n, 3)", f"shape {array.shape}")
    return array


def _doubles(array: NDArray[Any]) -> NDArray[np.float64]:
    with np.errstate(over="ignore", invalid="ignore"):  # infinities and NaN are rejected with their row
        # Writable, because Numba would compile all kernels again for arrays that are not.
        return np.require(array, np.float64, ("C_CONTIGUOUS", "WRITEABLE"))


def _bound(argument: str, value: ArrayLike, count: int, largest: float) -> NDArray[np.float64]:
    """One bound for all rays or one each, from 0 to ``largest``, as a (1,) or (n,) array."""
    array = _array(argument, value)
    fits = array.ndim == 0 or array.shape == (count,)
    expect(fits, argument, f"a number or shape ({count},)", f"shape {array.shape}")
    array = _doubles(np.atleast_1d(array))
    good = (array >= 0.0) & (array <= largest)
    if not good.all():
        row = int((~good).argmax())
        expect(False, argument, f"numbers from 0 to {largest:.3g}", f"{array[row]} in row {row}")
    return array


@dataclass(frozen=True)
class Rays:
    """Rays whose shapes and bounds passed the checks; build them with ``check_rays``. One origin may stand for all."""

    origins: NDArray[np.float64]
    directions: NDArray[np.float64]
    t_min: NDArray[np.float64]
    t_max: NDArray[np.float64]


def check_rays(origins: ArrayLike, directions: ArrayLike, t_min: ArrayLike, t_max: ArrayLike) -> Rays:
    """Check shapes, types and bounds of a batch; whether each ray is finite is seen when it is traced.

    Raises ``ValueError`` naming the argument and, for a bad bound, its row.
    """
    origins, directions = _vectors("origins", origins), _vectors("directions", directions)
    expect(len(origins) == len(directions), "directions", f"{len(origins)} rows as in origins", len(directions))
    low = _bound("t_min", t_min, len(origins), float(np.finfo(np.float64).max))
    high = _bound("t_max", t_max, len(origins), np.inf)
    # An eye broadcast to all rays, as of a camera, need not be copied for each.
    shared = len(origins) > 1 and origins.strides[0] == 0
    return Rays(_doubles(origins[:1] if shared else origins), _doubles(directions), low, high)


def left(rays: Rays, leaving: ArrayLike, mesh: Mesh, threads: int) -> Rays:
    """The rays with their starts moved off the faces ``leaving``, see ``spawn.leave_faces``.

    Raises ``ValueError`` naming the argument and, for a face that is not there, its row.
    """
    count = len(rays.directions)
    array = _array("leaving", leaving)
    whole = array.dtype.kind in "iu" and (array.ndim == 0 or array.shape == (count,))
    expect(whole, "leaving", f"an integer or integers of shape ({count},)", f"{array.dtype} of shape {array.shape}")
    good = (array >= -1) & (array < len(mesh.faces))
    if not good.all():
        row = int((~np.atleast_1d(good)).argmax())
        expected = f"faces from 0 to {len(mesh.faces) - 1}, or -1"
        expect(False, "leaving", expected, f"{np.atleast_1d(array)[row]} in row {row}")
    faces = np.array(np.broadcast_to(array, (count,)), np.int64)
    starts = np.empty((count, 3))

    def leave(begin: int, end: int) -> None:
        leave_faces(mesh.vertices, mesh.faces, rays.origins, rays.directions, faces, starts, begin, end)

    for_chunks(leave, count, CHUNK, threads)
    return replace(rays, origins=starts)


def _reject(rays: Rays, row: int, scale: float) -> None:
    """Raise the error of a ray out of bounds."""
    origin = rays.origins[row if len(rays.origins) > 1 else 0]
    if not (np.abs(origin) * scale <= FARTHEST).all():
        near = f"finite numbers within {FARTHEST / scale:.3g}"
        expect(False, "origins", near, f"{origin.tolist()} in row {row}")
    expected = f"finite, non-zero vectors, components up to {SHORTEST:.3g} to {LONGEST:.3g}"
    expect(False, "directions", expected, f"{rays.directions[row].tolist()} in row {row}")


def closest_hits(tree: Tree, rays: Rays, mesh: Mesh, threads: int) -> Hits:
    """Closest hits of a batch."""
    count = len(rays.directions)
    if count <= FEW and tree.depth > 0:
        return _few_hits(tree, rays, mesh)
    out = np.empty(count), np.empty(count, np.int64), np.empty(count), np.empty(count)
    _run(tree, rays, (*out, np.empty(0, np.bool_)), threads, any_hit=False)
    return Hits(*out, mesh)


def any_hits(tree: Tree, rays: Rays, threads: int) -> NDArray[np.bool_]:
    """Whether each ray of a batch hits anything."""
    count = len(rays.directions)
    if count <= FEW and tree.depth > 0:
        return _few(tree, rays)[3].view(np.int64) >= 0
    none, out = np.empty(0), np.empty(count, np.bool_)
    _run(tree, rays, (none, np.empty(0, np.int64), none, none, out), threads, any_hit=True)
    return out


def _few_hits(tree: Tree, rays: Rays, mesh: Mesh) -> Hits:
    t, u, v, face = _few(tree, rays)
    return Hits(t, face.view(np.int64), u, v, mesh)


def _few(tree: Tree, rays: Rays) -> NDArray[np.float64]:
    """Closest hits of a few rays on the caller's thread, as ``batch.trace_few`` writes them."""
    out = np.empty((4, len(rays.directions)))
    stack = np.empty(stack_size(tree.depth), np.int64)
    row = trace_few(tree.words, rays.origins, rays.directions, rays.t_min, rays.t_max, out, stack)
    if row >= 0:
        _reject(rays, row, tree.scale)
    return out


def _run(tree: Tree, rays: Rays, out: Any, threads: int, any_hit: bool) -> None:
    arrays, count = (rays.origins, rays.directions, rays.t_min, rays.t_max), len(rays.directions)
    size = min(CHUNK, max(_LEAST_CHUNK, count // (16 * threads)))
    bad: list[int] = []

    def trace(begin: int, end: int) -> None:
        # Only chunks behind a bad ray are left out, so the first bad ray is always among the found.
        if not bad or begin < bad[0]:
            if tree.depth > 0:
                row = trace_chunk(tree.words, arrays, out, begin, end, any_hit, make_memory(tree.depth, end - begin))
            else:
                row = search_chunk(tree.words, arrays, out, begin, end, any_hit)
            if row >= 0:
                bad.append(row)

    for_chunks(trace, count, size, threads)
    if bad:
        _reject(rays, min(bad), tree.scale)

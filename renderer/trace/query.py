"""Batches of rays against a tree: checks at the boundary, chunks on threads, and the results."""

import threading
from dataclasses import dataclass, field
from typing import Any, NamedTuple, TypeGuard

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer.arrays import real_argument
from renderer.errors import expect
from renderer.limits import FARTHEST, LONGEST, SHORTEST
from renderer.mesh.mesh import Mesh, face_normals
from renderer.process.parallel import for_chunks
from renderer.trace.layout import BLOCK_FACES, Tree
from renderer.trace.ray_lanes import WIDTH
from renderer.trace.rays import HIT_ROWS
from renderer.trace.singly import FEW_DEPTH, stack_size, trace_few
from renderer.trace.spawn import leave_faces
from renderer.trace.traverse import Memory, make_memory, search_chunk, trace_chunk

# The most rays of a chunk: small enough to share 1e5 rays between many threads and to stop within milliseconds on
# Ctrl-C, large enough that taking a chunk costs nothing beside its 1 to 10 ms of tracing.
CHUNK = 8192
# Few rays go in smaller chunks, sixteen per thread, so that no thread has much more to do than another.
_LEAST_CHUNK = 1024
# A chunk of brute force is so many tests of a ray against a block, at some nanoseconds per test.
_BLOCK_TESTS = 1 << 22
# Fewer rays than a packet holds go one by one, by a kernel that compiles in a fraction of the time.
FEW = WIDTH - 1


# Slots and not frozen: a call with one ray spends a third of its time on making objects.
@dataclass(eq=False, slots=True)
class Hits:
    """Closest hits, one row per ray.

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
        """Whether each ray hit a face, (n,) bool."""
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


def moved_off(rays: RayBatch, leaving: ArrayLike, mesh: Mesh, scale: float, threads: int) -> RayBatch:
    """The rays with their starts moved off the faces ``leaving``, see ``spawn.leave_faces``; ``scale`` is the tree's.

    Raises ``ValueError`` naming the argument and, for a face that is not there or an origin out of bounds, its row.
    """
    count = len(rays.directions)
    array = real_argument("leaving", leaving)
    whole = array.dtype.kind in "iu" and (array.ndim == 0 or array.shape == (count,))
    expect(whole, "leaving", f"an integer or integers of shape ({count},)", f"{array.dtype} of shape {array.shape}")
    # A copy, which no other thread can change once it is checked.
    faces = np.array(np.broadcast_to(array, (count,)), np.int64)
    good = (faces >= -1) & (faces < len(mesh.faces))
    if not good.all():
        row = int((~good).argmax())
        expect(False, "leaving", f"faces from 0 to {len(mesh.faces) - 1}, or -1", f"{faces[row]} in row {row}")
    sound = (np.abs(rays.origins) <= FARTHEST / scale).all(axis=1) & np.isfinite(rays.directions).all(axis=1)
    if not sound.all():
        # Rejected before it is moved, so that the message names the numbers as given.
        _reject(rays, int((~sound).argmax()), scale)
    starts = np.empty((count, 3))

    def leave(begin: int, end: int) -> None:
        leave_faces(mesh.vertices, mesh.faces, rays.origins, rays.directions, faces, starts, (begin, end, scale))

    for_chunks(leave, count, CHUNK, threads)
    return rays._replace(origins=starts)


def _reject(rays: RayBatch, row: int, scale: float) -> None:
    """Raise the error for a ray out of bounds."""
    origin = rays.origins[row if len(rays.origins) > 1 else 0]
    with np.errstate(over="ignore"):
        near = (np.abs(origin) * scale <= FARTHEST).all()
    if not near:
        expected = f"finite numbers within {FARTHEST / scale:.3g}"
        expect(False, "origins", expected, f"{origin.tolist()} in row {row}")
    expected = f"finite, non-zero vectors, the largest component from {SHORTEST:.3g} to {LONGEST:.3g}"
    expect(False, "directions", expected, f"{rays.directions[row].tolist()} in row {row}")


def closest_hits(tree: Tree, rays: RayBatch, mesh: Mesh, threads: int) -> Hits:
    """Closest hits of a batch."""
    if _are_few(tree, rays):
        out = _trace_few(tree, rays)
    else:
        out = np.empty((HIT_ROWS, len(rays.directions)))
        _run(tree, rays, out, threads, any_hit=False)
    t, u, v, face = out
    return Hits(t, face.view(np.int64), u, v, mesh)


def any_hits(tree: Tree, rays: RayBatch, threads: int) -> NDArray[np.bool_]:
    """Whether each ray of a batch hits anything."""
    if _are_few(tree, rays):
        return _trace_few(tree, rays)[3].view(np.int64) >= 0
    # In whole words, so that kernels are compiled for one kind of output.
    out = np.empty((1, -(-len(rays.directions) // 8)))
    _run(tree, rays, out, threads, any_hit=True)
    return out.view(np.bool_)[0, : len(rays.directions)]


def _are_few(tree: Tree, rays: RayBatch) -> bool:
    """Whether the rays are traced one by one."""
    return tree.has_nodes and len(rays.directions) <= FEW and tree.depth <= FEW_DEPTH


def _trace_few(tree: Tree, rays: RayBatch) -> NDArray[np.float64]:
    """Closest hits of a few rays on the caller's thread, as ``singly.trace_few`` writes them."""
    out = np.empty((HIT_ROWS, len(rays.directions)))
    row = trace_few(tree.words, rays, out)
    if row >= 0:
        _reject(rays, row, tree.scale)
    return out


def rays_against_blocks(tree: Tree) -> int:
    """The number of rays in a chunk of brute force: some 10 ms of work, so that Ctrl-C and other threads need not wait
    for long.
    """
    return max(1, _BLOCK_TESTS * BLOCK_FACES // max(1, len(tree.faces)))


def _run(tree: Tree, rays: RayBatch, out: NDArray[np.float64], threads: int, any_hit: bool) -> None:
    count = len(rays.directions)
    size = min(CHUNK, max(_LEAST_CHUNK, count // (16 * threads)))
    if not tree.has_nodes:
        size = min(size, rays_against_blocks(tree))
    bad: list[int] = []

    def trace(begin: int, end: int) -> None:
        # Only chunks after a bad ray are left out, so the first bad ray is always found.
        if not bad or begin < bad[0]:
            if tree.has_nodes:
                row = trace_chunk(tree.words, rays, out, begin, end, any_hit, _thread_memory(tree.depth))
            else:
                row = search_chunk(tree.words, rays, out, begin, end, any_hit)
            if row >= 0:
                bad.append(row)

    if count <= size:
        trace(0, count)
    else:
        for_chunks(trace, count, size, threads)
    if bad:
        _reject(rays, min(bad), tree.scale)


class _Local(threading.local):
    """The memory in which one thread traces chunks, kept from one chunk to the next: 100 kB."""

    memory: Memory | None = None


_local = _Local()


def _thread_memory(depth: int) -> Memory:
    memory = _local.memory
    if memory is None or memory.stack_size < stack_size(depth):
        memory = _local.memory = make_memory(depth, CHUNK)
    return memory

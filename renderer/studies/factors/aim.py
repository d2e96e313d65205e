"""Rays from a surface: starts uniform by area, directions by the cosine law.

The rays follow a Kronecker sequence in four dimensions, two for the point and two for the direction, eight times with
shifts of their own: what these eight find differs as much as each errs. Each surface shifts the points and turns the
directions by numbers of its own, so that errors of many surfaces do not add up.
"""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.distance.on_surface import SurfacePoints
from renderer.jit.decorators import inlined, kernel
from renderer.mesh.mesh import Mesh
from renderer.numerics.mixing import mixed, share_of
from renderer.numerics.simd import load, offset, pointer, store
from renderer.numerics.vec3 import add, put3, row3, scale, three
from renderer.studies.factors.surfaces import Surfaces
from renderer.trace.starts.record import ABOVE, KNOWN

# The sequences, each with a shift of its own, and their dimensions.
REPLICATES, _DIMENSIONS = 8, 4
# The steps of the sequence times 2^64: 1/g, 1/g^2, ... for the root g of g^5 = g + 1 (Roberts 2018).
_ROOT = 1.1673039782614187
_STEPS = np.array([int(2.0**64 / _ROOT**k) for k in range(1, _DIMENSIONS + 1)], np.uint64)
# The golden ratio times 2^64, by which SplitMix64 counts.
WEYL = np.uint64(0x9E3779B97F4A7C15)
# The columns of a ray: the share of the area before its point, the place across there, and the direction in the frame.
SHARE, ACROSS, DIRECTION, RAY = 0, 1, 2, 5
# Those of a row: what is added to both, and the cosine and sine by which directions are turned.
COSINE, SINE, TURN = 2, 3, 4


class Senders(NamedTuple):
    """The senders, as kernels read them: n rows, each with the members from ``first`` of it to that of the next row.

    first    (n + 1,) int64
    faces    (m,) int64: the face of each member, -1 for a point on no face
    ends     (m,) float64: the share of its row's area up to each member; 1 for the last
    corners  (m, 9) float64: the first corner of a member, and the two sides from there; 0 for the sides of a point
    frames   (m, 9) float64: three unit vectors, the last the normal
    both     (m,) bool: whether it sends from both sides
    above    (m,) bool: whether the frame's normal is on the side of the face's
    """

    first: NDArray[np.int64]
    faces: NDArray[np.int64]
    ends: NDArray[np.float64]
    corners: NDArray[np.float64]
    frames: NDArray[np.float64]
    both: NDArray[np.bool_]
    above: NDArray[np.bool_]


def senders_of(mesh: Mesh, surfaces: Surfaces) -> Senders:
    """The surfaces as senders; faces without area are no members."""
    faces = np.flatnonzero(surfaces.weights > 0.0)
    faces = faces[np.argsort(surfaces.of_face[faces], kind="stable")]
    rows, weights = surfaces.of_face[faces], surfaces.weights[faces]
    first = np.searchsorted(rows, np.arange(surfaces.number + 1))
    sums = np.cumsum(weights)
    before = np.concatenate([[0.0], sums])[first[:-1]]
    ends = (sums - before[rows]) / surfaces.areas[rows]
    ends[first[1:] - 1] = 1.0
    corners = mesh.vertices[mesh.faces[faces]]
    corners[:, 1:] -= corners[:, :1]
    normals = np.cross(corners[:, 1], corners[:, 2])
    above = np.ones(len(faces), np.bool_)
    return Senders(first, faces, ends, corners.reshape(-1, 9), frames_of(normals), surfaces.both[faces], above)


def senders_at(points: SurfacePoints, places: NDArray[np.float64], normals: NDArray[np.float64], mesh: Mesh) -> Senders:
    """Points (m, 3) as senders, a row each; their normals (m, 3), not zero, say on which side of a face they lie."""
    count, faces = len(places), points.faces
    corners = np.zeros((count, 9))
    corners[:, :3] = places
    # A normal in the plane of its face belongs to the front.
    above = (normals * mesh.face_normals()[faces]).sum(axis=1) >= 0.0
    first, ends, both = np.arange(count + 1), np.ones(count), np.zeros(count, np.bool_)
    return Senders(first, faces, ends, corners, frames_of(normals), both, above)


def frames_of(normals: NDArray[np.float64]) -> NDArray[np.float64]:
    """For normals (m, 3), not zero, three unit vectors at right angles, of which they are the last: (m, 9)."""
    z = normals / np.abs(normals).max(axis=1, keepdims=True)
    z /= np.linalg.norm(z, axis=1, keepdims=True)
    x = np.cross(np.eye(3)[np.abs(z).argmin(axis=1)], z)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    return np.concatenate([x, np.cross(z, x), z], axis=1)


def turns_of(rows: NDArray[np.int64]) -> NDArray[np.float64]:
    """By what rays of some rows differ from those of others, (rows, TURN): they depend on the row alone."""
    own = np.arange(1, 4, dtype=np.uint64)
    numbers = (rows.astype(np.uint64)[:, None] * np.uint64(3) + own).astype(np.uint64)
    share, across, turn = share_of(mixed(numbers * WEYL)).T
    return np.stack([share, across, np.cos(2.0 * np.pi * turn), np.sin(2.0 * np.pi * turn)], axis=1)


@lru_cache(maxsize=64)
def rays_from(begin: int, count: int) -> NDArray[np.float64]:
    """The rays from ``begin`` on, (count, RAY)."""
    rays = np.arange(begin, begin + count, dtype=np.uint64)
    numbers = np.arange(1, REPLICATES * _DIMENSIONS + 1, dtype=np.uint64) * WEYL
    shifts = mixed(numbers).reshape(REPLICATES, _DIMENSIONS)[rays % np.uint64(REPLICATES)]
    bits = shifts + (rays // np.uint64(REPLICATES))[:, None] * _STEPS
    share, across, u, v = share_of(bits).T
    turn = 2.0 * np.pi * v
    # rule: cosine-of-exchange
    level, height = np.sqrt(u), np.sqrt(1.0 - u)
    return np.stack([share, across, level * np.cos(turn), level * np.sin(turn), height], axis=1)


@kernel
def _member_at(ends, begin, end, share):
    """The member of a row, from ``begin`` to before ``end``, in which a share of its area lies."""
    low, high = begin, end - 1
    while low < high:
        middle = (low + high) // 2
        if load(ends, middle) > share:
            high = middle
        else:
            low = middle + 1
    return low


@inlined
def _shifted(ray, turn, column):
    """A number of a ray in [0, 1), shifted by that of a row."""
    moved = load(ray, column) + load(turn, column)
    return moved if moved < 1.0 else moved - 1.0


@inlined
def _direction(frame, ray, turn, side):
    """The direction of a ray, on a side of a frame's plane."""
    (x, y, z), cosine, sine = three(ray, DIRECTION), load(turn, COSINE), load(turn, SINE)
    across = add(scale(row3(frame, 0), cosine * x - sine * y), scale(row3(frame, 1), sine * x + cosine * y))
    return add(across, scale(row3(frame, 2), side * z))


@kernel
def aim_rows(
    first, members, ends, corners, frames, both, above, rays, turns, rows, origins, directions, faces, codes
):  # fmt: skip
    """Write the rays of some rows: the first of each, then the second of each, and so on.

    first, members ... above  the arrays of ``Senders``
    rays                      (count, RAY) float64, of ``rays_from``
    turns                     (rows, TURN) float64, of ``turns_of``
    origins, directions       (count * rows, 3) float64
    faces, codes              (count * rows,) int64: the face that each ray leaves, and the bits of ``starts.record``
    """
    for k in range(len(rays)):
        ray = offset(pointer(rays), RAY * k)
        for s in range(len(rows)):
            turn = offset(pointer(turns), TURN * s)
            low, i, share = first[rows[s]], k * len(rows) + s, _shifted(ray, turn, SHARE)
            member = _member_at(pointer(ends), low, first[rows[s] + 1], share)
            before = ends[member - 1] if member > low else 0.0
            inside, side = (share - before) / (ends[member] - before), 1.0
            if both[member]:
                inside, side = (2.0 * inside, 1.0) if inside < 0.5 else (2.0 * inside - 1.0, -1.0)
            # Uniform in a triangle: the square root of one number, and the other across.
            root, across = math.sqrt(inside), _shifted(ray, turn, ACROSS)
            place, frame = offset(pointer(corners), 9 * member), offset(pointer(frames), 9 * member)
            sides = add(scale(row3(place, 1), root * (1.0 - across)), scale(row3(place, 2), root * across))
            put3(pointer(origins), 3 * i, add(three(place, 0), sides))
            put3(pointer(directions), 3 * i, _direction(frame, ray, turn, side))
            store(pointer(faces), i, members[member])
            store(pointer(codes), i, np.int64(KNOWN | (ABOVE if (side > 0.0) == above[member] else 0)))

"""Numbers of a hit besides its face: t, u, v, the point and the normal, by whole numbers."""

from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.octree import BruteForce, Octree
from validation.meshes import loose
from validation.promises.hits.ways import Indices, asked
from validation.promises.row import row

Floats = NDArray[np.float64]
# Hits whose plane the ray meets at a sine below this say little: their u and v err by its inverse.
_LEAST_SINE = 0.1
# 2^10 units of the last place of u, v and of the largest coordinate: what remains of rounding at that sine and in faces
# a hundredth as high as wide. What is wrong differs by 2^-30 and more.
_NEAR = 2.0**-43
_JUDGE = "integer arithmetic"


class _Exact(NamedTuple):
    """Of each ray: t, u, v, the point, the face's unit normal, and whether it says enough to judge."""

    t: Floats
    u: Floats
    v: Floats
    point: Floats
    normal: Floats
    clear: NDArray[np.bool_]


def check_places(rng: Generator, count: int) -> list[dict[str, Any]]:
    """Rays at faces of a heap of triangles with whole corners, by each way of tracing."""
    mesh = _heap(rng)
    octree, brute = Octree.from_mesh(mesh), BruteForce.from_mesh(mesh)
    origins, directions = _rays(mesh, rng, count)
    found: dict[str, list[NDArray[np.bool_]]] = {}

    def ask(tracer: Octree | BruteForce, rows: Indices) -> NDArray[np.bool_]:
        o, d = origins[rows], directions[rows]
        hits = tracer.closest_hit(o, d)
        every = tracer.all_hits(o, d)
        both: dict[str, tuple[Any, Indices]] = {"": (hits, rows), " of all hits": (every, rows[every.ray])}
        for suffix, (who, ray) in both.items():
            kept = who.face >= 0
            exact = _exact(mesh, origins[ray], directions[ray], who.face)
            for what, good in _judged(who, exact, np.abs(mesh.vertices).max()).items():
                found.setdefault(what + suffix, []).append((good | ~exact.clear)[kept])
        return hits.face >= 0

    met = asked(ask, octree, brute, count)
    rows_ = [row(what, _JUDGE, np.concatenate(kept)) for what, kept in found.items()]
    return [
        *rows_,
        row("each ray aimed at a face hits one", _JUDGE, met),
        row("normals of faces of any size have unit length", "closed form", _sized()),
    ]


def _sized() -> NDArray[np.bool_]:
    """Triangles in planes of constant z, from denormals to sides that float64 cannot hold."""
    corner = np.array([(-1.0, -1.0, 0.5), (1.0, -1.0, 0.5), (-0.5, 1.0, 0.5)])
    corners = corner * 2.0 ** np.append(np.arange(-1070, 1023, 7), 1023)[:, None, None]
    kept: NDArray[np.bool_] = (loose(corners).face_normals() == [0.0, 0.0, 1.0]).all(axis=1)
    return kept


def _judged(who: Any, exact: _Exact, size: float) -> dict[str, NDArray[np.bool_]]:
    def near(given: Floats, wanted: Floats, unit: float = 1.0) -> NDArray[np.bool_]:
        off = np.abs(given - wanted)
        kept: NDArray[np.bool_] = off.max(axis=tuple(range(1, off.ndim)), initial=0.0) <= unit * _NEAR
        return kept

    return {
        "t is the distance in units of the direction": near(who.t, exact.t),
        "u and v are the weights of a face's second and third corner": near(who.u, exact.u) & near(who.v, exact.v),
        "points are where the rays hit the faces": near(who.points, exact.point, size),
        "normals have unit length and follow the winding": near(who.normals, exact.normal),
    }


def _heap(rng: Generator) -> Mesh:
    """300 triangles with whole corners, none of them thin."""
    corners = rng.integers(-60, 61, (4000, 1, 3)) + rng.integers(-12, 13, (4000, 3, 3))
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    longest = np.max([np.linalg.norm(corners[:, k] - corners[:, k - 1], axis=1) for k in range(3)], axis=0)
    corners = corners[area > 0.2 * longest**2][:300]
    return loose(corners)


def _rays(mesh: Mesh, rng: Generator, count: int) -> tuple[Floats, Floats]:
    """From sixteen whole places each at sixteen neighbouring points of one face, by 64ths of its sides."""
    group = np.arange(count) // 16
    corners = mesh.triangles[rng.integers(0, len(mesh.faces), group.max() + 1)][group]
    share = rng.integers(8, 24, (count, 2, 1))
    targets = (
        corners[:, 0]
        + (share[:, 0] * (corners[:, 1] - corners[:, 0]) + share[:, 1] * (corners[:, 2] - corners[:, 0])) / 64
    )
    origins = rng.integers(-100, 101, (group.max() + 1, 3)).astype(np.float64)[group]
    return origins, targets - origins


def _exact(mesh: Mesh, origins: Floats, directions: Floats, faces: Indices) -> _Exact:
    """In 64ths, whose products int64 holds: each number is then rounded once."""
    a, b, c = np.moveaxis(np.rint(64 * mesh.triangles[faces]).astype(np.int64), 1, 0)
    o, d = np.rint(64 * origins).astype(np.int64), np.rint(64 * directions).astype(np.int64)
    ab, ac, ao = b - a, c - a, o - a
    normal = np.cross(ab, ac)
    volume = _dot(normal, -d)
    parallel = volume == 0
    below = np.where(parallel, 1, volume).astype(np.float64)
    u, v = _dot(ao, np.cross(ac, -d)) / below, _dot(ab, np.cross(ao, -d)) / below
    t = _dot(normal, ao) / below
    length = np.linalg.norm(normal.astype(np.float64), axis=1)
    sine = np.abs(volume) / (length * np.linalg.norm(d.astype(np.float64), axis=1))
    point = (o + t[:, None] * d) / 64
    return _Exact(t, u, v, point, normal / length[:, None], sine >= _LEAST_SINE)


def _dot(a: NDArray[np.int64], b: NDArray[np.int64]) -> NDArray[np.int64]:
    total: NDArray[np.int64] = (a * b).sum(axis=1)
    return total

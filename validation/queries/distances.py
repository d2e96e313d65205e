"""Distances from solids: ours in ulp of the exact ones, and other libraries beside."""

import math
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import icosphere, torus
from renderer.octree import Octree
from validation.job import Job
from validation.oracle.distance import nearest, ulps_from_root
from validation.oracle.vectors import rational
from validation.queries.peers import OPEN3D, peers
from validation.queries.solids import solids

Floats = NDArray[np.float64]
_SEED = 2042
# The answer is the exact distance, rounded: half an ulp, and as little more as twice the digits leave.
ULPS = 0.51
# Or as far off, as a share of the distance to the face's farthest corner, where the distance itself is at most such a
# share: twice the digits do not tell on which side of an edge a point lies that is nearer to it than 2^-90, and that
# changes a distance of more than 2^-64 by less than its last digit.
BESIDE, _NEAR = 2.0**-90, 2.0**-64
# Others round each step: some ulp are no fault of theirs, of float32 where that is what they compute in.
_OTHERS_ULPS, _FLOAT32 = 16.0, 2.0**29
# NumPy's distances by which faces are chosen for exact arithmetic err by less than this share of the mesh's reach.
_MARGIN = 1e-9


def meshes() -> dict[str, Mesh]:
    """A ball and a ring where they stand, far away, tiny and flat; a star and loose faces, whose edges are sharp."""
    ball, ring = icosphere(2), torus(around=24, across=12)
    return {
        "ball": ball,
        "ring": ring,
        "star": Mesh(solids()[0].mesh().vertices * (np.pi * 1e-4), solids()[0].mesh().faces),
        "ring at 1e6": Mesh(ring.vertices * np.pi + 1e6, ring.faces),
        "ball of 1e-80": Mesh(ball.vertices * 1e-80, ball.faces),
        "ball of 1e100": Mesh(ball.vertices * 1e100, ball.faces),
        "loose faces": Mesh(np.random.default_rng(_SEED).normal(size=(36, 3)), np.arange(36).reshape(12, 3)),
        "flat ball": Mesh(ball.vertices * [1.0, 1.0, 1e-6], ball.faces),
    }


def points_about(mesh: Mesh, rng: Generator, count: int) -> Floats:
    """Points on faces, edges, their middles and corners, and from 1e-20 to 10 of the mesh's size away from these."""
    shares, kind = rng.dirichlet([1, 1, 1], count), rng.integers(0, 4, count)
    shares[kind == 1] = np.eye(3)[rng.integers(0, 3, int((kind == 1).sum()))]
    shares[kind == 2, 0] = 0.0
    shares[kind == 3] = [0.5, 0.5, 0.0]
    on = np.einsum("nk,nkd->nd", shares, mesh.triangles[rng.integers(0, len(mesh.faces), count)])
    away = 10.0 ** rng.uniform(-20, 1, (count, 1)) * (rng.random((count, 1)) < 0.7)
    points: Floats = on + rng.normal(size=(count, 3)) * away * mesh.extent.max()
    return points


def check_distances(count: int, job: Job) -> list[dict[str, Any]]:
    """A row for each mesh: the number of points, our largest error in ulp, and the wrong answers of others."""
    rows, rng = [], np.random.default_rng(_SEED)
    for name, mesh in meshes().items():
        job.step(f"queries: distance, {name}")
        points = points_about(mesh, rng, count)
        squares = [_least(mesh, point) for point in points]
        ours = Octree.from_mesh(mesh).closest_point(points)
        ulps = [ulps_from_root(d, square) for d, (square, _) in zip(ours.distance, squares, strict=True)]
        # Another face is as near once the distance is rounded; of those the lowest.
        faces = [face <= lowest for face, (_, lowest) in zip(ours.face, squares, strict=True)]
        # Or as far off as two lost signs leave it.
        roots = np.array([math.sqrt(square) for square, _ in squares])
        reach = np.abs(mesh.triangles[ours.face] - points[:, None]).max(axis=(1, 2))
        beside = (ours.distance <= _NEAR * reach) & (np.abs(ours.distance - roots) <= BESIDE * reach)
        close = (np.array(ulps) < ULPS) | beside
        right = close & np.array(faces) & ((ours.distance == 0.0) == [square == 0 for square, _ in squares])
        wrong = int((~(right & _is_closed(mesh, points, ours.distance))).sum())
        told = np.array(ulps)[ours.distance > _NEAR * reach]
        worst, others = float(told.max(initial=0.0)), _others(mesh, points, squares)
        rows.append({"subject": f"distance: {name}", "asked": count, "wrong": wrong, "ulps": worst, "beside": count,
                     "others": others})  # fmt: skip
    return rows


def _is_closed(mesh: Mesh, points: Floats, distance: Floats) -> NDArray[np.bool_]:
    """Whether each point finds the surface within its own distance, and nothing within less."""
    octree = Octree.from_mesh(mesh)
    # What is no distance is refused as a limit.
    limit = np.where(distance >= 0.0, distance, 0.0)
    within = octree.closest_point(points, max_distance=limit).distance
    less = octree.closest_point(points, max_distance=np.nextafter(limit, 0.0)).found
    return (within == distance) & ~(less & (distance > 0.0))


def _least(mesh: Mesh, point: Floats) -> tuple[Any, int]:
    """The exact least squared distance, and the lowest face that has it."""
    # Relative to the point and of size 1, so that no square overflows.
    corners = mesh.triangles - point
    reach = float(np.abs(corners).max())
    rough = _rough(corners / reach)
    near = np.flatnonzero(rough <= rough.min() + _MARGIN)
    square, lowest = nearest(
        rational([point.tolist()])[0], [rational(triangle.tolist()) for triangle in mesh.triangles[near]]
    )
    return square, int(near[lowest[0]])


def _rough(corners: Floats) -> Floats:
    """Distances of triangles (F, 3 corners, 3) from the origin: the least over their edges, and their planes' feet."""
    a, b, c = corners.transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    inside, least = np.ones(len(a), np.bool_), np.full(len(a), np.inf)
    for p, q in ((a, b), (b, c), (c, a)):
        side = q - p
        share = np.clip(-_dot(p, side) / np.maximum(_dot(side, side), 1e-300), 0.0, 1.0)
        least = np.minimum(least, np.linalg.norm(p + share[:, None] * side, axis=1))
        inside &= _dot(np.cross(side, -p), normal) >= 0.0
    square = _dot(normal, normal)
    height = np.abs(_dot(a, normal)) / np.sqrt(np.maximum(square, 1e-300))
    return np.where(inside & (square > 0.0), np.minimum(least, height), least)


def _dot(a: Floats, b: Floats) -> Floats:
    products: Floats = (a * b).sum(axis=1)
    return products


def _others(mesh: Mesh, points: Floats, squares: list[tuple[Any, int]]) -> dict[str, int]:
    """The number of distances of other libraries that are off by more than some ulp."""
    wrong = {}
    for name, peer in peers().items():
        found, most = (
            peer(mesh.vertices, mesh.faces).distance(points),
            _OTHERS_ULPS * (_FLOAT32 if name == OPEN3D else 1),
        )
        far = [not ulps_from_root(d, square) <= most for d, (square, _) in zip(found, squares, strict=True)]
        wrong[name] = sum(far)
    return wrong

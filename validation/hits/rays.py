"""Seeded families of rays around a mesh.

Every number of ``families`` is exact in float32, though stored as float64, so a float32 reference gets the very same
rays. The mesh should be exact too: see ``float32_exact``. Directions are not unit length unless stated.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64] | NDArray[np.int32]


@dataclass(frozen=True)
class RayFamily:
    """Rays of one family: ``origins`` and ``directions`` are float64 (n, 3); no direction is zero."""

    name: str
    origins: Floats
    directions: Floats

    def __len__(self) -> int:
        return len(self.origins)

    def select(self, rows: ArrayLike) -> "RayFamily":
        """The rays at ``rows`` (indices or a mask), under the same name."""
        index = np.asarray(rows)
        return RayFamily(self.name, self.origins[index], self.directions[index])


def float32_exact(values: ArrayLike) -> Floats:
    """``values`` rounded to float32 and stored as float64."""
    return np.asarray(values).astype(np.float32, order="C").astype(np.float64)


def families(vertices: Floats, faces: Ints, count: int, seed: int) -> tuple[RayFamily, ...]:
    """All ten families with ``count`` rays each, "on_surface" with a quarter.

    Equal arguments give equal rays; each family has its own seed.
    """
    makers: tuple[Callable[[Floats, int, Generator], RayFamily], ...] = (
        random_rays,
        axis_parallel_rays,
        edge_rays,
        vertex_rays,
        grazing_rays,
        from_inside_rays,
        _quarter_on_surface,
        far_away_rays,
    )
    if not len(faces):
        raise ValueError("faces: expected at least one face to aim rays at, got none")
    corners = np.asarray(vertices, dtype=np.float64)[np.asarray(faces, dtype=np.int64)]
    seeds = np.random.SeedSequence(seed).spawn(len(makers))
    seeded = (make(corners, count, np.random.default_rng(s)) for make, s in zip(makers, seeds, strict=True))
    points = corners.reshape(-1, 3)
    return (camera_rays(points, count), camera_square_rays(points, count), *seeded)


def camera_rays(vertices: Floats, count: int) -> RayFamily:
    """Rays of a pinhole camera that just sees all of ``vertices`` (V, 3), scanline by scanline; unit directions."""
    side = max(int(np.ceil(np.sqrt(count))), 1)
    row, column = np.divmod(np.arange(count), side)
    return _pinhole("camera", vertices, row, column, side)


def camera_square_rays(vertices: Floats, count: int) -> RayFamily:
    """The camera's rays in squares of 4 x 4 pixels: each 16 consecutive rays are close together in both directions."""
    squares = max(int(np.ceil(np.sqrt(count) / 4)), 1)  # along one side of the picture
    square, pixel = np.divmod(np.arange(count), 16)
    row, column = (4 * part + rest for part, rest in zip(divmod(square, squares), divmod(pixel, 4), strict=True))
    return _pinhole("camera_squares", vertices, row, column, 4 * squares)


def random_rays(corners: Floats, count: int, rng: Generator) -> RayFamily:
    """Half between two points on a sphere around the mesh's ``corners`` (F, 3, 3), half between points in its box."""
    centre, radius = _sphere(corners.reshape(-1, 3))
    from_sphere = centre + 1.1 * radius * _sphere_points(count, rng)
    to_sphere = centre + 1.1 * radius * _sphere_points(count, rng)
    lower, upper = _bounds(corners)
    from_box, to_box = rng.uniform(lower, upper, (2, count, 3))
    inside = (np.arange(count) % 2 == 1)[:, None]
    start, end = np.where(inside, from_box, from_sphere), np.where(inside, to_box, to_sphere)
    return _batch("random", start, end - start)


def axis_parallel_rays(corners: Floats, count: int, rng: Generator) -> RayFamily:
    """Along +-x, +-y, +-z with exact zeros of both signs; half share two or three coordinates with a vertex."""
    lower, upper = _bounds(corners)
    margin = 0.25 * (upper - lower)
    axis = np.arange(count) % 3
    sign = np.where(np.arange(count) // 3 % 2, -1.0, 1.0)
    ray = np.arange(count)

    origins = rng.uniform(lower - margin, upper + margin, (count, 3))
    on_vertex = rng.random(count) < 0.5
    origins[on_vertex] = _pick(corners.reshape(-1, 3), count, rng)[on_vertex]
    outside = np.where(sign > 0, (lower - margin)[axis], (upper + margin)[axis])
    moved = on_vertex & (rng.random(count) < 0.75)
    origins[ray[moved], axis[moved]] = outside[moved]

    directions = np.where(rng.random((count, 3)) < 0.5, -0.0, 0.0)
    directions[ray, axis] = sign
    return _batch("axis_parallel", origins, directions)


def edge_rays(corners: Floats, count: int, rng: Generator) -> RayFamily:
    """At random points of random edges, alternately from outside and from near the mesh's centre; t is about 1."""
    return _aimed("edge", corners, _edge_points(corners, count, rng), rng)


def vertex_rays(corners: Floats, count: int, rng: Generator) -> RayFamily:
    """At random vertices, alternately from outside and from near the mesh's centre; t is about 1."""
    return _aimed("vertex", corners, _pick(corners.reshape(-1, 3), count, rng), rng)


def leak_rays(vertices: Floats, faces: Ints, count: int, seed: int) -> tuple[RayFamily, RayFamily]:
    """From near the centre at points of edges and at vertices, ``count`` rays each, aimed in full float64.

    They are not float32-exact, and not for a float32 reference: a direction rounded to float32 passes its edge at a
    distance that float64 resolves easily, so only these rays test a float64 kernel's watertightness.
    """
    corners = np.asarray(vertices, dtype=np.float64)[np.asarray(faces, dtype=np.int64)]
    rng = np.random.default_rng(seed)
    batches = []
    for name, targets in (
        ("edge_leak", _edge_points(corners, count, rng)),
        ("vertex_leak", _pick(corners.reshape(-1, 3), count, rng)),
    ):
        origins = _near_centre(corners, count, rng)
        batches.append(RayFamily(name, origins, targets - origins))
    return batches[0], batches[1]


def grazing_rays(corners: Floats, count: int, rng: Generator) -> RayFamily:
    """From outside at random points of random faces, 1e-4 to 1e-1 radians (log-uniform) above their planes."""
    triangle = _pick(corners, count, rng)
    weights = rng.dirichlet((1.0, 1.0, 1.0), count)
    target = np.einsum("nk,nkj->nj", weights, triangle)
    normal = _unit(np.cross(triangle[:, 1] - triangle[:, 0], triangle[:, 2] - triangle[:, 0]))
    tangent = _unit(np.cross(normal, _sphere_points(count, rng)))
    angle = 10.0 ** rng.uniform(-4, -1, (count, 1))
    directions = np.cos(angle) * tangent - np.sin(angle) * normal
    return _batch("grazing", target - 2 * _sphere(corners.reshape(-1, 3))[1] * directions, directions)


def from_inside_rays(corners: Floats, count: int, rng: Generator) -> RayFamily:
    """From near the middle of the mesh's box in all directions: every ray hits a closed, star-shaped mesh."""
    return _batch("from_inside", _near_centre(corners, count, rng), _sphere_points(count, rng))


def on_surface_rays(corners: Floats, count: int, rng: Generator) -> RayFamily:
    """From random points of random faces, alternately in any direction and along the face; unit directions.

    A third begin at a vertex, where t = 0 is exact and counts; the others begin as near their face as float32 allows,
    on either side of it.
    """
    triangle = _pick(corners, count, rng)
    weights = rng.dirichlet((1.0, 1.0, 1.0), count)
    at_vertex = np.arange(count) % 3 == 0
    weights[at_vertex] = np.eye(3)[rng.integers(0, 3, int(at_vertex.sum()))]
    away = _sphere_points(count, rng)
    normal = np.cross(triangle[:, 1] - triangle[:, 0], triangle[:, 2] - triangle[:, 0])
    along = _unit(np.cross(_unit(normal), away))
    directions = np.where((np.arange(count) % 2 == 0)[:, None], away, along)
    return _batch("on_surface", np.einsum("nk,nkj->nj", weights, triangle), directions)


def _quarter_on_surface(corners: Floats, count: int, rng: Generator) -> RayFamily:
    # Every fourth ray gets another answer from a float32 reference than from us, and each of them takes an exact
    # verdict.
    return on_surface_rays(corners, -(-count // 4), rng)


def far_away_rays(corners: Floats, count: int, rng: Generator) -> RayFamily:
    """From 1e3 to 1e5 radii (log-uniform) away, alternately at points of the mesh's faces and its box; t is about 1."""
    centre, radius = _sphere(corners.reshape(-1, 3))
    distance = radius * 10.0 ** rng.uniform(3, 5, (count, 1))
    # Round first: the direction must start at the origin that the ray will have.
    origins = float32_exact(centre + distance * _sphere_points(count, rng))
    weights = rng.dirichlet((1.0, 1.0, 1.0), count)
    on_face = np.einsum("nk,nkj->nj", weights, _pick(corners, count, rng))
    in_box = rng.uniform(*_bounds(corners), (count, 3))
    targets = np.where((np.arange(count) % 2 == 0)[:, None], on_face, in_box)
    return _batch("far_away", origins, targets - origins)


def _edge_points(corners: Floats, count: int, rng: Generator) -> Floats:
    triangle = _pick(corners, count, rng)
    ray, first = np.arange(count), rng.integers(0, 3, count)
    along = rng.random((count, 1))
    points: Floats = (1 - along) * triangle[ray, first] + along * triangle[ray, (first + 1) % 3]
    return points


def face_rays(vertices: Floats, faces: Ints) -> RayFamily:
    """One ray at the centre of every face, from the face's own size above or below it, so that each must be found."""
    corners = np.asarray(vertices, dtype=np.float64)[np.asarray(faces, dtype=np.int64)]
    centre = corners.mean(axis=1)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.sqrt(np.linalg.norm(normal, axis=1, keepdims=True))
    side = np.where(np.arange(len(faces)) % 2 == 0, 1.0, -1.0)[:, None]
    origins = float32_exact(centre + side * size * _unit(normal))
    return _batch("face", origins, centre - origins)


def _pinhole(name: str, vertices: Floats, row: Ints, column: Ints, side: int) -> RayFamily:
    """Rays through the pixels (``row``, ``column``) of a picture of all ``vertices``, ``side`` pixels wide and high."""
    centre, radius = _sphere(vertices)
    forward = _unit(np.array([[-0.6, -0.45, -0.66]]))[0]
    right = _unit(np.cross(forward, [0.0, 1.0, 0.0])[None])[0]
    up = np.cross(right, forward)

    # The bounding sphere, 3 radii away, subtends a half angle of asin(1/3), so the picture contains it.
    half_width = np.tan(np.arcsin(1 / 3))
    x = half_width * ((2 * column + 1) / side - 1)
    y = half_width * (1 - (2 * row + 1) / side)
    directions = _unit(forward + x[:, None] * right + y[:, None] * up)
    return _batch(name, np.broadcast_to(centre - 3 * radius * forward, directions.shape), directions)


def _aimed(name: str, corners: Floats, targets: Floats, rng: Generator) -> RayFamily:
    count = len(targets)
    centre, radius = _sphere(corners.reshape(-1, 3))
    outside = centre + 2 * radius * _sphere_points(count, rng)
    inside = _near_centre(corners, count, rng)
    # Round first: the direction must start at the origin that the ray will have.
    origins = float32_exact(np.where((np.arange(count) % 2 == 0)[:, None], outside, inside))
    return _batch(name, origins, targets - origins)


def _batch(name: str, origins: Floats, directions: Floats) -> RayFamily:
    """Rays rounded to float32; a direction that is or rounds to zero (a target at its origin) becomes +z."""
    exact = float32_exact(directions)
    exact[~exact.any(axis=1)] = (0.0, 0.0, 1.0)
    return RayFamily(name, float32_exact(origins), exact)


def _near_centre(corners: Floats, count: int, rng: Generator) -> Floats:
    lower, upper = _bounds(corners)
    return rng.uniform(0.55 * lower + 0.45 * upper, 0.45 * lower + 0.55 * upper, (count, 3))


def _pick(rows: Floats, count: int, rng: Generator) -> Floats:
    return rows[rng.integers(0, len(rows), count)]


def _sphere_points(count: int, rng: Generator) -> Floats:
    return _unit(rng.standard_normal((count, 3)))


def _unit(vectors: Floats) -> Floats:
    """Unit vectors; zero vectors stay zero."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    unit: Floats = np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)
    return unit


def _bounds(corners: Floats) -> tuple[Floats, Floats]:
    points = corners.reshape(-1, 3)
    return points.min(axis=0), points.max(axis=0)


def _sphere(points: Floats) -> tuple[Floats, float]:
    """Centre of the bounds of ``points`` and the largest distance from it; 1 for a single point."""
    centre = (points.min(axis=0) + points.max(axis=0)) / 2
    return centre, float(np.linalg.norm(points - centre, axis=1).max()) or 1.0

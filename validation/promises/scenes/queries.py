"""Queries of points on scenes: inside, distance, winding and views of placed bodies, judged on their placed corners."""

from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.mesh.shapes import box
from validation.merged import Merged, made
from validation.meshes import tetrahedron
from validation.oracle import exact
from validation.oracle.inside import winding_number
from validation.oracle.placing import Body, placed
from validation.oracle.vectors import rational
from validation.promises.queries.nearest import exactly_near
from validation.promises.row import row

Bools = NDArray[np.bool_]
Floats = NDArray[np.float64]

_COUNT, _POINTS = 4, 50
# Metres east, north and up, whose roundings are as large as the tiny bodies' faces are thick.
_UTM = np.array([500_000.0, 5_400_000.0, 128.0])
_JUDGE = "rational arithmetic"
# What rounding may add for each face of a sum of solid angles (``RayScene.winding_number``).
_ROUNDED = 2.0**-44


def check_queries(rng: Generator) -> list[dict[str, Any]]:
    """Boxes and corners that overlap, near the origin, tiny, and far away."""
    found: dict[str, list[Bools]] = {}
    for size, offset in ((1.0, np.zeros(3)), (1e-6, np.zeros(3)), (1.0, _UTM)):
        bodies = [_body(mesh, size, offset, rng) for mesh in (box(), tetrahedron())]
        world = made(bodies)
        corners = placed(bodies)[0]
        points = np.concatenate([offset + size * rng.uniform(-3.0, 3.0, (_POINTS, 3)), corners[:: len(corners) // 8]])
        for name, kept in _judged(world, bodies, points).items():
            found.setdefault(name, []).append(kept)
    return [row(f"on a scene {name}", _JUDGE, np.concatenate(kept)) for name, kept in found.items()]


def _body(mesh: Any, size: float, offset: Floats, rng: Generator) -> Body:
    """Some of them mirror."""
    linear = size * np.linalg.qr(rng.normal(size=(_COUNT, 3, 3)))[0] @ np.diag([1.0, 2.0, 0.5])
    places = offset + size * rng.uniform(-1.5, 1.5, (_COUNT, 3))
    return Body(mesh.vertices, mesh.faces.astype(np.int64), np.concatenate([linear, places[:, :, None]], axis=2))


def _judged(world: Merged, bodies: list[Body], points: Floats) -> dict[str, Bools]:
    """The points with the right answer, for each query."""
    scene, (vertices, faces) = world.scene, placed(bodies)
    triangles = vertices[faces]
    exactly = [rational(triangle) for triangle in triangles.tolist()]
    numbers = [winding_number(point, exactly) for point in rational(points.tolist())]
    on = np.array([number is None for number in numbers])
    winding = np.array([number or 0 for number in numbers])
    others, free = np.roll(points, 1, axis=0), on | np.roll(on, 1)
    distance = scene.closest_point(points).distance
    wound = scene.winding_number(points, 0.0)
    steps = scene.count_steps(points, others - points)
    lines = exact.closest_hits(vertices, faces, points, others - points)
    blocked = [hit is not None and hit.t <= 1 for hit in lines]
    merged = scene.merged
    return {
        "inside is exact": scene.contains(points) == ((winding != 0) | on),
        "the surface is no part of what is inside without it": scene.contains(points, boundary=False)
        == ((winding != 0) & ~on),
        "inside is exact by the other rule": scene.contains(points, False, "even-odd") == ((winding % 2 == 1) & ~on),
        "distances and nearest faces are exact": exactly_near(world, triangles, points),
        "a signed distance is below 0 inside": scene.signed_distance(points)
        == np.where((winding != 0) & ~on, -distance, distance),
        "winding numbers count the bodies around a point": on | (np.abs(wound - winding) <= _ROUNDED * len(faces)),
        "a view is free where nothing lies between": (scene.visible(points, others) != blocked) | free,
        "rays that hit enter nodes and test triangles": np.array([hit is None for hit in lines])
        | ((steps.nodes > 1) & (steps.triangles > 0)),
        "the merged mesh has the placed corners": np.array(
            [np.array_equal(merged.vertices, vertices), np.array_equal(merged.faces, faces)]
        ),
    }

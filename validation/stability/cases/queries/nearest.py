"""Row 53 of the extreme cases: nearest points of meshes that are hard to search, judged by exact arithmetic."""

import numpy as np

from renderer import BruteForce, Mesh, Octree
from renderer.mesh.shapes import box, icosphere
from validation.oracle.distance import nearest, ulps_from_root
from validation.oracle.vectors import rational
from validation.promises.refused import refused
from validation.stability.cases.case import ExtremeCase, Outcome
from validation.stability.cases.judgement import SEED, Floats

# The exact distance, rounded: half an ulp, and as little more as twice the digits leave.
_ULPS = 0.51


def hard_meshes() -> dict[str, Mesh]:
    """Faces that are lines, points or twice there, slivers, touching solids, and a tetrahedron far away."""
    ball, cube = icosphere(1), box((-1, -1, -1), (1, 1, 1))
    lines = Mesh([[0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3]], [[0, 1, 1], [2, 2, 2], [0, 3, 0], [0, 1, 2]])
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    return {
        "lines and points": lines,
        "twice": Mesh.concatenate([cube, cube]),
        "touching": Mesh.concatenate([cube, box((1, -1, -1), (3, 1, 1))]),
        "slivers": Mesh(ball.vertices * [1, 1e-4, 1e-8], ball.faces),
        "far away": Mesh(corners + 1e9, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]),
    }


# Faces and points of which products of coordinates vanish in float64: on the face, beside it, and where sizes differ.
ALL_SIZES: tuple[tuple[list[list[float]], list[float]], ...] = (
    ([[0, 0, 0], [1, 0, 1], [0, 1, 0]], [0.5, 1e-300, 0.5]),
    ([[2e-13, 0, 1e-6], [-1e-112, -2e-116, -1e-106], [2e-46, 2, 1e-98]], [5e-14, 0.5, 2.5e-7]),
    ([[1, 1, -1], [1e-49, -1e-13, -1e-159], [1e-43, -2e-159, -2e-22]], [9.999999999999999e-18, -5e-14, -1e-22]),
    ([[1e19, 0, -2e19], [-3e-56, -2e-56, 2e-56], [-3e72, -2e72, 3e72]], [1e-11, 0, 2e19]),
)


def fan(count: int) -> Mesh:
    """``count`` faces around one corner, the last vertex."""
    angle = 2 * np.pi * np.arange(count) / count
    rim = np.stack([np.cos(angle), np.sin(angle), np.zeros(count)], axis=1)
    faces = np.stack([np.full(count, count), np.arange(count), (np.arange(count) + 1) % count], axis=1)
    return Mesh(np.concatenate([rim, [[0.0, 0.0, 0.5]]]), faces)


def wrong_distances(mesh: Mesh, points: Floats) -> int:
    """The number of points whose distance or face is not that of exact arithmetic."""
    triangles = [rational(triangle.tolist()) for triangle in mesh.triangles]
    expected = [nearest(point, triangles) for point in rational(points.tolist())]
    wrong = np.zeros(len(points), np.bool_)
    for queries in (Octree.from_mesh(mesh), BruteForce.from_mesh(mesh)):
        found = queries.closest_point(points)
        for i, (square, faces) in enumerate(expected):
            wrong[i] |= not ulps_from_root(float(found.distance[i]), square) < _ULPS or found.face[i] > faces[0]
    return int(wrong.sum())


def _nearest(quick: bool) -> Outcome:
    rng, wrong, asked = np.random.default_rng(SEED), 0, 0
    for mesh in hard_meshes().values():
        count = 15 if quick else 100
        on = mesh.triangles[rng.integers(0, len(mesh.faces), count), rng.integers(0, 3, count)]
        away = mesh.extent.max() * rng.normal(size=(count, 3)) * rng.choice([0.0, 1e-3, 1.0], (count, 1))
        wrong, asked = wrong + wrong_distances(mesh, on + away), asked + count
    for vertices, point in ALL_SIZES:
        wrong, asked = wrong + wrong_distances(Mesh(vertices, [[0, 1, 2]]), np.array([point])), asked + 1
    wheel = fan(1_000 if quick else 100_000)
    # At the hub, straight above it and below: the hub is the nearest point of all faces, or its slope is.
    hub = Octree.from_mesh(wheel).closest_point([[0, 0, 0.5], [0, 0, 0.75], [0, 0, 1e6]])
    wrong += hub.distance.tolist() != [0.0, 0.25, 1e6 - 0.5] or hub.face.tolist() != [0, 0, 0]
    said = refused(Octree.from_mesh(box()).closest_point, [[0.0, 0.0, 0.0], [0.0, np.nan, 0.0]]) or ""
    wrong += not (said.startswith("points: ") and said.endswith("in row 1"))
    return Outcome(f"{wrong} of {asked + 4:,} answers wrong", wrong == 0)


CASES: tuple[ExtremeCase, ...] = (
    ExtremeCase(
        53, "nearest points of faces that are lines, points or twice there, slivers, a fan; far; all sizes at once",
        "the exact distance, rounded, and the lowest of equal faces; NaN refused by its row", ("exact", "closed form"),
        "half an ulp, as the answer is rounded once", _nearest,
    ),
)  # fmt: skip

"""The closed interval [t_min, t_max], to the last place on either side, by planes whose t is exact."""

from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.octree import BruteForce, Octree
from validation.meshes import squares
from validation.promises.hits.ways import Indices, asked
from validation.promises.row import row

Floats = NDArray[np.float64]
_PLANES = 40
# x and y of a direction whose z is 1.
_SLOPES = np.array([(0.0, 0.0), (0.25, 0.125), (-0.5, 0.75), (0.875, -0.0625)])
_ABOVE, _BELOW = np.inf, -np.inf


def check_bounds(rng: Generator, count: int) -> list[dict[str, Any]]:
    """Intervals that begin and end at a plane, just before it and just behind it, by each way of tracing."""
    mesh, heights = _pile()
    octree, brute = Octree.from_mesh(mesh, leaf_size=4), BruteForce.from_mesh(mesh)
    plane = np.repeat(rng.integers(0, _PLANES - 1, -(-count // 16)), 16)[:count]
    directions = np.concatenate(
        [_SLOPES[np.repeat(rng.integers(0, 4, -(-count // 16)), 16)[:count]], np.ones((count, 1))], 1
    )
    origins = np.concatenate([rng.integers(-8, 9, (count, 2)) / 16, np.full((count, 1), -1.0)], 1)
    t0, t1 = heights[plane] + 1.0, heights[plane + 1] + 1.0
    cases = {
        "t_min and t_max at one hit": (t0, t0, plane),
        "t_min an ulp behind a hit": (np.nextafter(t0, _ABOVE), t1, plane + 1),
        "t_max an ulp before a hit": (t0, np.nextafter(t1, _BELOW), plane),
        "an ulp inside two hits": (np.nextafter(t0, _ABOVE), np.nextafter(t1, _BELOW), np.full(count, -1)),
        "an ulp outside a hit": (np.nextafter(t0, _BELOW), np.nextafter(t0, _ABOVE), plane),
    }
    found = []
    for name, (low, high, expected) in cases.items():
        alone = (high < t1) | (expected < 0)

        def ask(tracer: Octree | BruteForce, rows: Indices, low: Floats = low, high: Floats = high,
                expected: Indices = expected, alone: NDArray[np.bool_] = alone) -> NDArray[np.bool_]:  # fmt: skip
            o, d, least, most = origins[rows], directions[rows], low[rows], high[rows]
            face = tracer.closest_hit(o, d, t_min=least, t_max=most).face
            hit = tracer.any_hit(o, d, t_min=least, t_max=most)
            number = tracer.count_hits(o, d, t_min=least, t_max=most)
            met = np.where(face >= 0, face // 2, -1)
            there = expected[rows] >= 0
            kept: NDArray[np.bool_] = (met == expected[rows]) & (hit == there) & ((number == there) | ~alone[rows])
            return kept

        kept = asked(ask, octree, brute, count)
        found.append(row(f"[t_min, t_max] is closed: {name}", "dyadic planes", kept))
    return [
        *found,
        row("a t_min above 0, however small, leaves out a hit at 0", "dyadic planes", _started(count)),
    ]


def _started(count: int) -> NDArray[np.bool_]:
    """Rays that begin on a plane, of a usual mesh and of those that the tree scales up or down."""
    mesh, heights = _pile()
    plane = np.arange(count) // 16 % (_PLANES - 1)
    directions = np.concatenate([_SLOPES[plane % 4], np.ones((count, 1))], 1)
    origins = np.concatenate([np.arange(2 * count).reshape(-1, 2) % 17 / 16 - 0.5, heights[plane][:, None]], 1)
    kept = []
    for size in (1.0, 2.0**100, 2.0**-100):
        large = Mesh(mesh.vertices * size, mesh.faces)
        for least, expected in ((0.0, plane), (2.0**-1074, plane + 1)):

            def ask(tracer: Octree | BruteForce, rows: Indices, size: float = size, least: float = least,
                    expected: Indices = expected) -> NDArray[np.bool_]:  # fmt: skip
                face = tracer.closest_hit(origins[rows] * size, directions[rows], t_min=least).face
                met: NDArray[np.bool_] = np.where(face >= 0, face // 2, -1) == expected[rows]
                return met

            kept.append(asked(ask, Octree.from_mesh(large, leaf_size=4), BruteForce.from_mesh(large), count))
    return np.concatenate(kept)


def _pile() -> tuple[Mesh, Floats]:
    """Squares above each other, of two faces each, and their heights: 64ths, not evenly apart."""
    heights = np.cumsum(1 + np.arange(_PLANES) * 7 % 5) / 64.0
    corners = ((-9.0, -9.0), (9.0, -9.0), (9.0, 9.0), (-9.0, 9.0))
    return squares(np.array([[(x, y, z) for x, y in corners] for z in heights])), heights

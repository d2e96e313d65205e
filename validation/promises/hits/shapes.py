"""Arrays of rays and points in any shape and memory order: each element belongs to its index, as numpy broadcasts."""

from typing import Any, Literal

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.octree import BruteForce, Octree
from validation.meshes import loose
from validation.promises.row import row

Floats = NDArray[np.float64]
_FACES = 60
# Shapes of origins and of directions that make (5, 7) rays.
_SHAPES = (
    ((5, 7), (5, 7)), ((7,), (5, 7)), ((5, 1), (5, 7)), ((5, 7), (7,)), ((5, 1), (1, 7)), ((), (5, 7)), ((5, 7), ()),
)  # fmt: skip
Order = Literal["C", "F"]
_ORDERS: tuple[Order, ...] = ("C", "F")
_ROWS, _COLUMNS = 5, 7


def check_shapes(rng: Generator) -> list[dict[str, Any]]:
    """Rays in rows and columns, with bounds and faces of their own, beside the same rays one after another."""
    mesh = loose(rng.normal(size=(_FACES, 1, 3)) + rng.normal(size=(_FACES, 3, 3)))
    rays, near = [], []
    for tracer in (Octree.from_mesh(mesh), BruteForce.from_mesh(mesh)):
        for of_origins, of_directions in _SHAPES:
            for order in _ORDERS:
                origins = np.asarray(rng.normal(size=(*of_origins, 3)), order=order)
                directions = np.asarray(rng.normal(size=(*of_directions, 3)), order=order)
                bounds = [np.asarray(rng.uniform(0.0, most, (_ROWS, _COLUMNS)), order=order) for most in (0.5, 5.0)]
                rays += _kept(tracer, origins, directions, bounds)
        near += [kept for order in _ORDERS for kept in _near(tracer, rng, order)]
    return [
        row("rays of any shape and memory order keep their own answers", "single ray", np.array(rays)),
        row("points of any shape and memory order keep their own limits", "single point", np.array(near)),
    ]


def _kept(tracer: Octree | BruteForce, origins: Floats, directions: Floats, bounds: list[Floats]) -> list[bool]:
    shape = _ROWS, _COLUMNS
    o, d = (np.broadcast_to(one, (*shape, 3)).reshape(-1, 3).copy() for one in (origins, directions))
    low, high = (one.reshape(-1).copy() for one in bounds)
    together = tracer.closest_hit(origins, directions, t_min=bounds[0], t_max=bounds[1])
    every = tracer.all_hits(origins, directions, t_min=bounds[0], t_max=bounds[1])
    t, number = np.empty(len(o)), np.empty(len(o), np.int64)
    for k in range(len(o)):
        t[k] = tracer.closest_hit(o[k], d[k], t_min=low[k], t_max=high[k]).t
        number[k] = tracer.count_hits(o[k], d[k], t_min=low[k], t_max=high[k])
    return [np.array_equal(together.t, t.reshape(shape)), np.array_equal(every.counts, number.reshape(shape))]


def _near(tracer: Octree | BruteForce, rng: Generator, order: Order) -> list[bool]:
    """Points in rows and columns with limits of their own: more than one query orders at once."""
    points = np.asarray(2.0 * rng.normal(size=(8, 9, 3)), order=order)
    limits = np.asarray(rng.uniform(0.0, 2.0, (8, 9)), order=order)
    found = tracer.closest_point(points, limits).face
    alone = [[tracer.closest_point(points[i, j], limits[i, j]).face for j in range(9)] for i in range(8)]
    return [np.array_equal(found, alone)]

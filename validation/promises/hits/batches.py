"""Batches of every size around those at which work is cut, and trees refitted along every axis, by grids of squares.

Each ray's answer is known from its number, so no answer may come from another row, be lost or come twice.
"""

from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.octree import Octree
from validation.meshes import squares
from validation.promises.row import row

Floats = NDArray[np.float64]
# On either side of sixteen rays, of the least and the largest chunk, and of some of these.
SIZES = (1, 2, 15, 16, 17, 31, 33, 1023, 1024, 1025, 8191, 8192, 8193, 16384, 16385, 3 * 8192)
_SIDE = 64
# Coprime to the number of squares: neighbours in a batch are far apart on the grid.
_STRIDE = 2531


def check_batches(sizes: tuple[int, ...] = SIZES) -> list[dict[str, Any]]:
    """Each query with each size of batch, rays alike and rays apart, on one to three threads."""
    grid = _grid()
    octrees = [Octree.from_mesh(grid, threads=threads) for threads in (1, 2, 3)]
    found: dict[str, list[NDArray[np.bool_]]] = {}
    for size, stride, octree in product(sizes, (1, _STRIDE), octrees):
        for name, kept in _answers(octree, np.arange(size) * stride).items():
            found.setdefault(name, []).append(kept)
    return [row(f"batches of any size: {name}", "known answer", np.concatenate(kept)) for name, kept in found.items()]


def _answers(octree: Octree, number: NDArray[np.int64]) -> dict[str, NDArray[np.bool_]]:
    """The rays or points with the right answer, for each query. Every fifth one is beside the grid."""
    beside = number % 5 == 4
    square = number % _SIDE**2
    x, y = square % _SIDE + 0.75 + 2 * _SIDE * beside, square // _SIDE + 0.25
    height = 1.0 + number % 7
    origins = np.stack([x, y, height], 1)
    down = np.broadcast_to([0.0, 0.0, -1.0], origins.shape)
    face, t = np.where(beside, -1, 2 * square), np.where(beside, np.inf, height)
    hits = octree.closest_hit(origins, down)
    every = octree.all_hits(origins, down)
    rows = np.flatnonzero(~beside)
    near = octree.closest_point(origins)
    below = origins - [0.0, 0.0, 20.0]
    # A limit of its own for each row, which every other row's answer lies beyond.
    limit, within = height + np.where(number % 2, 0.5, -0.5), number % 2 == 1
    short = octree.closest_hit(origins, down, t_max=limit)
    return {
        "closest_hit": (hits.face == face) & (hits.t == t),
        "any_hit": octree.any_hit(origins, down) == ~beside,
        "count_hits": octree.count_hits(origins, down) == ~beside,
        "all_hits": np.atleast_1d(np.array_equal(every.ray, rows) and np.array_equal(every.face, face[rows])),
        "closest_point": (near.distance == height) & (near.face == face) | beside,
        "visible": octree.visible(origins, below) == beside,
        "t_max of each ray": short.hit == within & ~beside,
        "max_distance of each point": ((octree.closest_point(origins, limit).face >= 0) == within) | beside,
        "the dimensions of the rays": _shaped(octree, origins, down),
    }


def _shaped(octree: Octree, origins: Floats, down: Floats) -> NDArray[np.bool_]:
    """Whether answers to rays in two dimensions have these."""
    shape = (1, len(origins))
    hits = octree.closest_hit(origins[None], down[None], t_error=True)
    assert hits.t_error is not None
    number = octree.count_hits(origins[None], down[None])
    given = (
        hits.t,
        hits.face,
        hits.u,
        hits.v,
        hits.t_error,
        hits.hit,
        number,
        octree.closest_point(origins[None]).face,
    )
    whole = [one.shape == shape for one in given]
    return np.array([*whole, hits.points.shape == hits.normals.shape == (*shape, 3)])


def check_refits() -> list[dict[str, Any]]:
    """Trees refitted to meshes stretched, shrunk and moved along each axis, with rays along each axis."""
    found: dict[str, list[NDArray[np.bool_]]] = {name: [] for name in "xyz"}
    mesh = _lattice()
    for axis, name in enumerate("xyz"):
        for factor, shift in ((4.0, 0.0), (0.25, 0.0), (1.0, 37.0), (1.0, -37.0), (-1.0, 0.0)):
            moved = mesh.vertices.copy()
            moved[:, axis] = moved[:, axis] * factor + shift
            octree = Octree.from_mesh(mesh, leaf_size=4)
            octree.refit(moved)
            found[name] += [_meets_all(octree, moved, along) for along in range(3)]
    sizes: list[NDArray[np.bool_]] = []
    octree = Octree.from_mesh(mesh, leaf_size=4)
    for size in (2.0**100, 2.0**-100, 1.0):
        octree.refit(mesh.vertices * size)
        sizes += [_meets_all(octree, mesh.vertices * size, along, size) for along in range(3)]
    return [
        *(row(f"a refit along {name}, growing, shrinking and moving", "known answer", np.concatenate(kept))
          for name, kept in found.items()),
        row("a refit to sizes that the tree counts in other units", "known answer", np.concatenate(sizes)),
    ]  # fmt: skip


def _meets_all(octree: Octree, vertices: Floats, along: int, size: float = 1.0) -> NDArray[np.bool_]:
    """Whether a ray along an axis at each square that faces it meets that square, from just before it and from afar."""
    corners = vertices.reshape(-1, 4, 3)[along::3]
    middle = (3 * corners[:, 0] + corners[:, 1] + 2 * corners[:, 2] + 2 * corners[:, 3]) / 8
    directions = np.zeros_like(middle)
    directions[:, along] = 1.0
    face = np.arange(len(corners)) * 6 + 2 * along
    kept = []
    for t, sign in ((0.0625 * size, 1.0), (0.0625 * size, -1.0)):
        hits = octree.closest_hit(middle - t * sign * directions, sign * directions)
        kept.append((hits.face // 2 == face // 2) & (hits.t == t))
    number = octree.count_hits(middle - 1000.0 * size * directions, directions)
    return np.concatenate([*kept, number == _SIDE // 8])


def _grid() -> Mesh:
    """Squares of side 1 in the plane z = 0; square k has the faces 2 k, at its low x and high y, and 2 k + 1."""
    side = np.arange(_SIDE + 1.0)
    y, x = np.meshgrid(side, side, indexing="ij")
    vertices = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], 1)
    a = (np.arange(_SIDE)[:, None] * (_SIDE + 1) + np.arange(_SIDE)).ravel()
    b, c, d = a + 1, a + _SIDE + 2, a + _SIDE + 1
    return Mesh(vertices, np.stack([a, b, c, a, c, d], 1).reshape(-1, 3).astype(np.int32))


def _lattice() -> Mesh:
    """Squares of side 1/2 on an 8 x 8 x 8 lattice, across x, y and z at each place, none touching another."""
    count = _SIDE // 8
    corners = []
    for place in np.ndindex(count, count, count):
        for axis in range(3):
            u, v = np.eye(3)[(axis + 1) % 3] / 2, np.eye(3)[(axis + 2) % 3] / 2
            corner = 2.0 * np.array(place) + 0.25 * np.eye(3)[axis] + u / 4 + v / 4
            corners.append([corner, corner + u, corner + u + v, corner + v])
    return squares(np.array(corners))

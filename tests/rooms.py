"""Meshes whose pairs of faces see each other as is known."""

import numpy as np
from scipy.spatial.transform import Rotation

from renderer import Mesh, Octree
from renderer.studies.factors.pairs import exact_pairs

# Two triangles that see each other, one above the other.
FLOOR = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float)
CEILING = np.array([[0, 0, 1], [0, 1, 1], [1, 0, 1]], float)


def panel(corner, along, across, count):
    """A parallelogram of 2 count^2 triangles, (n, 3, 3), counter-clockwise from ``along`` to ``across``."""
    corner, along, across = (np.asarray(v, float) for v in (corner, along, across))
    steps = np.arange(count + 1) / count
    points = corner + steps[:, None, None] * along + steps[None, :, None] * across
    a, b, c, d = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
    return np.concatenate(
        [np.stack([a, b, c], axis=2).reshape(-1, 3, 3), np.stack([a, c, d], axis=2).reshape(-1, 3, 3)]
    )


def box(low, high, count, inward):
    """The six sides of a box, 2 count^2 triangles each, in a list."""
    low, size = np.asarray(low, float), np.asarray(high, float) - low
    x, y, z = np.diag(size)
    sides = [
        panel(low, x, y, count), panel(low + z, y, x, count), panel(low, y, z, count), panel(low + x, z, y, count),
        panel(low, z, x, count), panel(low + y, x, z, count),
    ]  # fmt: skip
    return sides if inward else [side[:, ::-1] for side in sides]


def mesh_of(triangles):
    """Triangles (n, 3, 3) that share no corners."""
    return Mesh(np.reshape(triangles, (-1, 3)), np.arange(3 * len(triangles)).reshape(-1, 3))


def turned(triangles, seed):
    """Triangles turned, and moved so that no coordinate is round."""
    rng = np.random.default_rng(seed)
    return triangles @ Rotation.random(rng=rng).as_matrix().T + rng.normal(size=3)


def all_pairs(count):
    """All pairs of numbers below ``count``, the lower first."""
    return np.stack(np.triu_indices(count, 1), axis=1).astype(np.int64)


def areas_of(triangles):
    return np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1) / 2


def normals_of(triangles):
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    return normals / np.linalg.norm(normals, axis=1)[:, None]


def points_on(triangles, rng):
    """A random point of each triangle."""
    u, v = rng.random((2, len(triangles), 1))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    return a + u * (b - a) + v * (c - a)


def seen_shares(octree, triangles, pairs, rays, rng):
    """For each pair, how many of its rays run before both faces, not edge-on, and how many of these hit nothing."""
    first, second = (np.repeat(pairs[:, k], rays) for k in range(2))
    p, q = points_on(triangles[first], rng), points_on(triangles[second], rng)
    normals = normals_of(triangles)
    edge_on = 1e-6 * np.abs(triangles).max()
    before = ((q - p) * normals[first]).sum(axis=1) > edge_on
    before &= ((p - q) * normals[second]).sum(axis=1) > edge_on
    open_ = before.copy()
    rows = np.flatnonzero(before)
    open_[rows] = octree.visible(p[rows], q[rows], first[rows], second[rows])
    return before.reshape(-1, rays).sum(axis=1), open_.reshape(-1, rays).sum(axis=1)


def known_of(triangles, pairs=None, kind=Octree, **options):
    pairs = all_pairs(len(triangles)) if pairs is None else pairs
    return pairs, *exact_pairs(kind(mesh_of(triangles))._built, pairs, 2, **options)


def furnished(seed):
    """A room with a box that stands on the floor, one in the air, and a screen."""
    shell = box((0, 0, 0), (4, 3, 2.5), 3, True)
    table = box((1, 1, 0), (2, 1.5, 0.75), 1, False)[1:]
    lamp = box((2.5, 1, 1.5), (2.75, 1.25, 1.75), 1, False)
    screen = box((3, 0, 0), (3.001, 1.5, 1.5), 1, False)
    triangles = np.concatenate([*shell, *table, *lamp, *screen])
    return turned(triangles, seed) if seed else triangles

"""Visibility around a ball: everything from its centre, nothing through it."""

from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import box, icosphere
from renderer.octree import BruteForce, Octree
from validation.meshes import loose, squares
from validation.promises.row import row

_COUNT = 2000
# Sizes of the ball and how far away it lies: rounding has moved points off their faces.
_BALLS = ((1.0, 0.0), (100.0, 0.0), (1e-3, 1.0), (1.0, 1e4), (1e6, 1e6))


def check_views(rng: Generator) -> list[dict[str, Any]]:
    """Points of a ball's faces from its centre, and points on either side of it from each other, both ways round."""
    seen, hidden = [], []
    for size, away in _BALLS:
        ball = icosphere(3)
        middle = away * np.array([1.0, -0.7, 0.4])
        mesh = Mesh(ball.vertices * size + middle, ball.faces)
        face, weights = rng.integers(0, len(mesh.faces), _COUNT), rng.dirichlet([1.0, 1.0, 1.0], _COUNT)
        points = (mesh.triangles[face] * weights[:, :, None]).sum(axis=1)
        for tracer in (Octree.from_mesh(mesh), BruteForce.from_mesh(mesh)):
            for faces in (None, face):
                seen += [tracer.visible(middle, points, reaching=faces), tracer.visible(points, middle, leaving=faces)]
            beyond = 3.0 * (points - middle)
            hidden += [~tracer.visible(middle + beyond, middle - beyond), ~tracer.visible(middle, middle + beyond)]
    return [
        row(
            "a ball's centre and each point of its surface see each other",
            "closed form",
            np.concatenate(seen),
        ),
        row("nothing is seen through a ball", "closed form", np.concatenate(hidden)),
        row("what is in front of a face, however near, hides what stands on it", "known answer", _covered()),
        row("each pair of points has the margin of its own coordinates", "known answer", _far()),
        row("what is nearer to an end than 2^-40 of both ends' coordinates hides nothing", "known answer", _room()),
        row("a point sees points at its own place", "known answer", _same(rng)),
        row("corners at 0.0 and -0.0 are at one place", "closed form", _closed()),
    ]


def _same(rng: Generator) -> NDArray[np.bool_]:
    """Corners, points of faces and points anywhere, each from itself; in a batch with others that see nothing."""
    ball = icosphere(2)
    points = np.concatenate([ball.vertices, ball.triangles.mean(axis=1), rng.uniform(-2.0, 2.0, (200, 3))])
    across = np.tile([[0.0, 0.0, -3.0], [0.0, 0.0, 3.0]], (len(points), 1, 1))
    ends, kept = np.stack([across, np.repeat(points[:, None], 2, axis=1)], axis=1), []
    for tracer in (Octree.from_mesh(ball), BruteForce.from_mesh(ball)):
        seen = tracer.visible(ends[:, :, 0], ends[:, :, 1])
        kept += [~seen[:, 0], seen[:, 1], tracer.visible(points, points)]
    return np.concatenate(kept)


def _closed() -> NDArray[np.bool_]:
    """A box of corners of its own for each face, with both zeros."""
    corners = box((0.0, -1.0, -1.0), (1.0, 1.0, 1.0)).triangles.reshape(-1, 3)
    corners[::2][corners[::2] == 0.0] = -0.0
    mesh = loose(corners)
    return np.array([len(mesh.open_edges) == 0, len(mesh.odd_edges) == 0])


def _covered() -> NDArray[np.bool_]:
    """A face over another and below a third: hidden and hiding, closer than 2^-40 of the coordinates too."""
    below, above = np.array([(-1.0, -1.0, 0.0), (3.0, -1.0, 0.0), (-1.0, 3.0, 0.0)]), np.array([0.0, 0.0, 1.0])
    kept = []
    for height in 2.0 ** -np.arange(2.0, 43.0):
        corners = np.concatenate([below, (below + above)[::-1], below + height * above])
        for tracer in (Octree, BruteForce):
            built = tracer.from_mesh(loose(corners))
            kept += [not built.visible(np.zeros(3), above, leaving=0, reaching=1)]
            kept += [bool(built.visible(height * above, above, leaving=2, reaching=1))]
    return np.array(kept)


def _room() -> NDArray[np.bool_]:
    """A point close behind a square and one farther behind it, each from the origin and the other way round."""
    mesh = squares(np.array([[(-1.0, -1.0, 1.0), (1.0, -1.0, 1.0), (1.0, 1.0, 1.0), (-1.0, 1.0, 1.0)]]))
    origin, close, behind = (np.array([0.25 * z, 0.125 * z, z]) for z in (0.0, 1.0 + 2.0**-42, 1.0 + 2.0**-38))
    kept = []
    for tracer in (Octree.from_mesh(mesh), BruteForce.from_mesh(mesh)):
        kept += [tracer.visible(origin, close), tracer.visible(close, origin)]
        kept += [~tracer.visible(origin, behind), ~tracer.visible(behind, origin)]
    return np.array(kept)


def _far() -> NDArray[np.bool_]:
    """Pairs before and behind a square, and in one batch with them pairs as far away as can be."""
    mesh = squares(np.array([[(-1.0, -1.0, 0.0), (1.0, -1.0, 0.0), (1.0, 1.0, 0.0), (-1.0, 1.0, 0.0)]]))
    below = np.array([[0.25, 0.125, -1.0], [5.0, 0.0, -1.0], [1e13, 0.0, -1e13]])
    seen, rows = np.array([False, True, True]), np.arange(60) % 3
    kept = []
    for tracer in (Octree.from_mesh(mesh), BruteForce.from_mesh(mesh)):
        kept.append(tracer.visible(below[rows], below[rows] * [1.0, 1.0, -1.0]) == seen[rows])
    return np.concatenate(kept)

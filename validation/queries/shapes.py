"""Fifty meshes of trimesh's makers, on a grid that keeps rays through their corners exact; and such rays."""

from collections.abc import Callable
from typing import Any

import numpy as np
import trimesh
from numpy.random import Generator
from numpy.typing import NDArray

from validation.queries.places import places_of_faces

Floats = NDArray[np.float64]
# The grid on which corners lie: with 16 steps to it, fourths of the way between two corners are exact too.
_GRID = 64.0
# Scales, powers of two, and offsets in steps of the grid: tiny, huge, far away. They change no exact answer.
_PLACES = ((2.0**-40, 0.0), (2.0**40, 0.0), (1.0, 2.0**20))


AS_MADE, MOVED = "as made", "tiny, huge, far"


def shapes() -> dict[str, list[Any]]:
    """Ten shapes as made and as soup, whose faces share no corner; and the ten tiny, huge and far away."""
    makers: Any = trimesh.creation
    rng = np.random.default_rng(48)
    inner = makers.box()
    inner.invert()
    made = [
        makers.box(extents=[1, 2, 3]),
        makers.icosphere(subdivisions=1, radius=3),
        makers.uv_sphere(radius=3, count=[6, 8]),
        makers.torus(3, 1, major_sections=8, minor_sections=6),
        makers.cylinder(1, 4, sections=12),
        makers.cone(2, 3, sections=9),
        makers.annulus(1, 2, 3, sections=8),
        trimesh.util.concatenate([makers.box(extents=[4, 4, 4]), inner]),
        makers.box(extents=[8, 8, 1 / _GRID]),
        trimesh.Trimesh(rng.uniform(-3, 3, (90, 3)), np.arange(90).reshape(30, 3), process=False),
    ]
    whole = [_on_grid(mesh) for mesh in made]
    soups = [(vertices[faces].reshape(-1, 3), np.arange(3 * len(faces)).reshape(-1, 3)) for vertices, faces in whole]
    return {
        AS_MADE: [_mesh(*arrays) for arrays in (*whole, *soups)],
        MOVED: [_mesh((vertices + offset) * scale, faces) for vertices, faces in whole for scale, offset in _PLACES],
    }


def _on_grid(mesh: Any) -> tuple[Floats, NDArray[np.int64]]:
    """Whole corners, and the faces that are no lines after that."""
    vertices, faces = np.round(np.asarray(mesh.vertices) * _GRID) * 16, np.asarray(mesh.faces, np.int64)
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return vertices, faces[np.cross(b - a, c - a).any(axis=1)]


def _mesh(vertices: Floats, faces: NDArray[np.int64]) -> Any:
    return trimesh.Trimesh(vertices, faces, process=False, validate=False)


def families() -> dict[str, Callable[[Any, Generator, int], tuple[Floats, Floats]]]:
    """By name a function of mesh, random generator and count that makes origins and directions, (count, 3) each."""
    return {
        "through corners, edges and faces": lambda mesh, rng, count: _aimed(mesh, rng, rng.integers(1, 9, (count, 1))),
        "from far away": lambda mesh, rng, count: _aimed(mesh, rng, rng.integers(2**16, 2**20, (count, 1))),
        "from the surface": lambda mesh, rng, count: _aimed(mesh, rng, np.zeros((count, 1))),
        "along the axes": _along_axes,
        "random": _random,
    }


def _aimed(mesh: Any, rng: Generator, steps: NDArray[Any]) -> tuple[Floats, Floats]:
    """Rays through corners, middles of edges and points of faces; fourths for slopes, so that float64 holds them."""
    count = len(steps)
    targets = places_of_faces(np.asarray(mesh.triangles), rng, count)
    directions = rng.integers(-4, 5, (count, 3)).astype(np.float64)
    directions[np.arange(count), rng.integers(0, 3, count)] = rng.choice([-4.0, 4.0], count)
    return targets - directions * steps * _unit(mesh), directions


def _along_axes(mesh: Any, rng: Generator, count: int) -> tuple[Floats, Floats]:
    """Rays along an axis level with corners, so in planes of faces too."""
    directions = np.zeros((count, 3))
    directions[np.arange(count), rng.integers(0, 3, count)] = rng.choice([-1.0, 1.0], count)
    corners = np.asarray(mesh.vertices)
    targets = np.stack([corners[rng.integers(0, len(corners), count), k] for k in range(3)], axis=1)
    return targets - directions * rng.integers(0, 9, (count, 1)) * 256 * _unit(mesh), directions


def _random(mesh: Any, rng: Generator, count: int) -> tuple[Floats, Floats]:
    """Rays from the box twice as large to points of the box."""
    low, high = np.asarray(mesh.bounds)
    ends = (low + high) / 2 + rng.uniform(-1, 1, (2, count, 3)) * (high - low) / 2
    return ends[0] * 2 - (low + high) / 2, ends[1] - ends[0] * 2 + (low + high) / 2


def _unit(mesh: Any) -> float:
    """The step of the mesh's grid: the power of two that its size is 2^9 to 2^10 of."""
    return float(2.0 ** (np.frexp(np.ptp(np.asarray(mesh.bounds), axis=0).max())[1] - 10))

"""Meshes whose corners and points meet in lines and planes exactly, with coordinates of all sizes."""

from collections.abc import Iterator

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

Floats = NDArray[np.float64]
# Powers of two of the numbers that coordinates of a mesh are drawn from: alike, unlike, and as unlike as can be.
_POWERS = ((0, 0, 0, 0), (0, -3, -30, -55), (0, -52, -120, -400), (0, -10, -600, -1000))
_FACES = np.array([(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])
_MESHES, _SOLIDS, _POINTS = 3, 3, 8
# As made, and where the tree has units of its own.
_SIZES = (1.0, 2.0**200, 2.0**-200)
_LEAST_SIDE = 2.0**-310


def heaps(rng: Generator) -> Iterator[tuple[Floats, Floats]]:
    """Faces (F, 3, 3) of some tetrahedra, four after another of each, and points (n, 3) that are hard to tell.

    Coordinates are drawn from few numbers, so that corners and points often share a line or a plane to the last digit;
    other points are on edges and planes but for their own rounding, or an ulp beside. Some tetrahedra are flat.
    """
    for j, powers in enumerate(_POWERS):
        for k in range(_MESHES):
            numbers = np.ldexp(rng.uniform(0.5, 1.0, 4), powers)
            numbers = np.concatenate([[0.0], numbers, -numbers])
            solids = rng.choice(numbers, (16 * _SOLIDS, 4, 3))[:, _FACES]
            # A tree takes faces whose second longest side is 0 or not too small.
            second = np.sort(np.ptp(solids, axis=2), axis=2)[:, :, 1]
            faces = solids[((second == 0.0) | (second > _LEAST_SIDE)).all(axis=1)][:_SOLIDS].reshape(-1, 3, 3)
            # Each axis is the shortest of some meshes.
            size = _SIZES[(j + k) % 3] * np.where(np.arange(3) == k % 3, 0.25, 1.0)
            points = _points(rng, faces, numbers) * size
            beside = np.nextafter(points[-_POINTS:], rng.choice([-np.inf, np.inf], (_POINTS, 3)))
            yield faces * size, np.concatenate([points, beside])


def _points(rng: Generator, faces: Floats, numbers: Floats) -> Floats:
    """Points on edges and planes but for rounding, at corners, and of the same numbers as these."""
    a, b, c = np.moveaxis(faces[rng.integers(0, len(faces), 3 * _POINTS)], 1, 0)
    s, t = rng.uniform(-0.25, 1.25, (2, len(a), 1))
    t[:_POINTS] = 0.0
    between = a + s * (b - a) + t * (c - a)
    # An axis of some is drawn, too: so they lie on lines across it.
    between[-_POINTS:, 1] = rng.choice(numbers, _POINTS)
    return np.concatenate([between, faces[:_POINTS, 0], rng.choice(numbers, (_POINTS, 3))])

"""Bounds on the error of t, judged by planes whose t is a quotient that float64 must round."""

import math
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.octree import BruteForce, Octree
from validation.meshes import squares
from validation.oracle.distance import way_from
from validation.promises.row import row

# Powers of two, of sizes and of t: usual, and denormal.
_SIZES = (0, 100, -330)
_TIMES = (*range(-4, 5), *range(-1028, -1010, 2))
# Shorter and longer directions are refused.
_SHORTEST, _LONGEST = -298, 697
_PLANES = 24
_CORNERS = ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))
_ALONG = 600
# The box is held to be wider by 2^-21 of its size, and to be met there t may change by ten times that and more.
_WIDER = Fraction(1, 1000)


def check_errors(rng: Generator) -> list[dict[str, Any]]:
    """Rays with directions so long that t is denormal, on meshes that the tree counts in other units too."""
    mesh, heights = _pile()
    kept = []
    for size in _SIZES:
        scaled = Mesh(np.ldexp(mesh.vertices, size), mesh.faces)
        times = [time for time in _TIMES if _SHORTEST <= size - time <= _LONGEST]
        for tracer in (Octree.from_mesh(scaled), BruteForce.from_mesh(scaled)):
            kept += [_bounded(tracer, np.ldexp(heights, size), math.ldexp(3.0, size - time)) for time in times]
    return [
        row("t_error bounds the error of t, also of denormal t", "integer arithmetic", np.concatenate(kept)),
        row("t_error belongs to the hit's own ray", "integer arithmetic", _own()),
        row(
            "t_error of a ray in a face's plane reaches to both ends of its box, and not beyond",
            "integer arithmetic",
            _along(rng),
        ),
    ]


def _bounded(tracer: Octree | BruteForce, heights: NDArray[np.float64], long: float) -> NDArray[np.bool_]:
    """Whether a ray from z = 0 along z, with a direction so long, meets all planes, each at its t."""
    found = tracer.all_hits([[heights[0] / 8, heights[0] / 4, 0.0]], [[0.0, 0.0, long]], contacts=False, t_error=True)
    assert found.t_error is not None
    exact = [Fraction(heights[face // 2]) / Fraction(long) for face in found.face.tolist()]
    near = [way_from(t, whole) <= error for t, whole, error in zip(found.t, exact, found.t_error, strict=True)]
    return np.array([*near, len(near) == len(heights)])


def _pile() -> tuple[Mesh, NDArray[np.float64]]:
    """Squares above each other, and their heights, of which few are binary fractions."""
    heights = 1.0 + np.arange(_PLANES) / 7.0
    return squares(np.array([[(x, y, z) for x, y in _CORNERS] for z in heights])), heights


def _own() -> NDArray[np.bool_]:
    """Rays one after another, short and long, which meet several planes, or none: some sizes of t's error apart."""
    mesh, heights = _pile()
    long = np.ldexp(3.0, np.arange(40) * 37 % 101 - 50)
    aside = np.arange(40) % 5 == 2
    origins = np.stack([0.125 + 9.0 * aside, np.full(40, 0.25), np.zeros(40)], 1)
    directions = np.stack([np.zeros(40), np.zeros(40), long], 1)
    kept = []
    for tracer in (Octree.from_mesh(mesh), BruteForce.from_mesh(mesh)):
        every = tracer.all_hits(origins, directions, contacts=False, t_error=True)
        first = tracer.closest_hit(origins, directions, t_error=True)
        assert every.t_error is not None and first.t_error is not None
        kept.append(_near(every.t, every.t_error, heights[every.face // 2], long[every.ray]))
        kept.append(_near(first.t[~aside], first.t_error[~aside], heights[first.face[~aside] // 2], long[~aside]))
        kept.append(np.array([len(every.t) == _PLANES * np.count_nonzero(~aside)]))
    return np.concatenate(kept)


def _near(
    t: NDArray[np.float64], error: NDArray[np.float64], height: NDArray[np.float64], long: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Whether each t is the quotient within its error, and the error not a thousand roundings."""
    off = [way_from(a, Fraction(h) / Fraction(d)) for a, h, d in zip(t, height, long, strict=True)]
    bounded = [bool(np.isfinite(e)) and x <= e for x, e in zip(off, error, strict=True)]
    kept: NDArray[np.bool_] = np.array(bounded, np.bool_) & (error <= 1e3 * np.spacing(t))
    return kept


def _along(rng: Generator) -> NDArray[np.bool_]:
    """Rays in the planes of faces with whole coordinates, which meet them if at all within the faces' boxes."""
    kept = []
    for _ in range(_ALONG):
        a, b, c = rng.integers(-9, 10, (3, 3)).astype(np.float64)
        i, j, k = rng.integers(-9, 10, 3)
        direction = i * (b - a) + j * (c - a)
        if not np.cross(b - a, c - a).any() or not direction.any():
            continue
        corners = np.array([a, b, c])
        origin = a - 20.0 * direction + (k % 3) * (b - a)
        hit = Octree(corners, [[0, 1, 2]]).closest_hit([origin], [direction], t_error=True)
        if hit.hit[0]:
            assert hit.t_error is not None
            if not (np.isfinite(hit.t[0]) and np.isfinite(hit.t_error[0])):
                kept.append(False)
                continue
            first, last = _passage(corners, origin, direction)
            t, error = Fraction(hit.t[0]), Fraction(hit.t_error[0])
            kept += [t - error <= first, last <= t + error, first > last or error <= max(t - first, last - t) + _WIDER]
    return np.array(kept)


def _passage(corners: NDArray[np.float64], origin: NDArray[np.float64], direction: NDArray[np.float64]
             ) -> tuple[Fraction, Fraction]:  # fmt: skip
    """The t at which a ray of whole numbers enters a face's box, and that at which it leaves it."""
    ways = [
        sorted(Fraction(int(end - o), int(d)) for end in (side.min(), side.max()))
        for side, o, d in zip(corners.T, origin, direction, strict=True)
        if d
    ]
    return max(way[0] for way in ways), min(way[1] for way in ways)

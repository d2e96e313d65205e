"""Signed distances of a box, which a closed form gives, and limits on them, one for each point."""

from typing import Any

import numpy as np
from numpy.random import Generator

from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import box
from renderer.octree import BruteForce, Octree
from validation.promises.row import row

_COUNT = 3000
_JUDGE = "closed form"


def check_signed(rng: Generator) -> list[dict[str, Any]]:
    """Points at whole 64ths within, on and around the box from -1 to 1: squares are exact, and roots round once."""
    points = rng.integers(-128, 129, (_COUNT, 3)) / 64.0
    beyond = np.abs(points) - 1.0
    outside = np.sqrt((np.maximum(beyond, 0.0) ** 2).sum(axis=1))
    expected = np.where(outside > 0.0, outside, beyond.max(axis=1))
    # At the distance, an ulp below it, and anywhere.
    limit = np.abs(expected) * rng.choice([1.0, 0.5, 2.0], _COUNT)
    below = rng.random(_COUNT) < 0.3
    limit[below] = np.maximum(np.nextafter(np.abs(expected[below]), -np.inf), 0.0)
    limited = np.where(np.abs(expected) <= limit, expected, np.copysign(np.inf, expected))
    mesh = box((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0))
    plain, cut = [], []
    for tracer in (Octree.from_mesh(mesh), BruteForce.from_mesh(mesh)):
        plain.append(tracer.signed_distance(points) == expected)
        cut.append(tracer.signed_distance(points, limit) == limited)
    pair = Mesh.concatenate([box((0.0, 0.0, 0.0), (2.0, 2.0, 2.0)), box((1.0, 1.0, 1.0), (3.0, 3.0, 3.0))])
    both = np.array([(1.5, 1.5, 1.5), (0.5, 0.5, 0.5), (2.5, 2.5, 2.5), (-0.5, 0.5, 0.5)])
    octree = Octree.from_mesh(pair)
    by_rule = [octree.signed_distance(both) == [-0.5, -0.5, -0.5, 0.5],
               octree.signed_distance(both, rule="even-odd") == [0.5, -0.5, -0.5, 0.5]]  # fmt: skip
    return [
        row("the rule decides the sign where boxes overlap", _JUDGE, np.concatenate(by_rule)),
        row("a signed distance is below 0 within, 0 on the surface, above 0 outside", _JUDGE, np.concatenate(plain)),
        row("beyond its limit a signed distance is infinite, with its sign", _JUDGE, np.concatenate(cut)),
    ]

"""Rays moved within float32's rounding, and what that does to a step: a search, and an envelope of its values."""

import numpy as np
from numpy.typing import NDArray

from validation.references.ray_tree import Node, Vector

# Mitsuba's hits are within some 3e-7 of the distance (``hits.compare.RTOL``), and so are its points and directions:
# 2^-21 is 4.8e-7.
STEP = 2.0**-21
# A search looks farther where it finds nothing: at grazing angles float32 errs by a multiple.
_SCALES = (1.0, 4.0, 16.0)
_TRIES = 96
# Rays of an envelope; and how far values may lie beyond it, as it is sampled in some directions alone.
_SAMPLES = 16
BEYOND = 4.0

_SEED = 20261126


def moved(node: Node, scale: float, count: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The ray of a node, moved ``count`` times by up to ``scale`` steps: origins and unit directions, (count, 3)."""
    return moved_ray(node.origin, node.direction, _reach(node), scale * STEP, count)


def moved_ray(
    origin: Vector, direction: Vector, reach: float, step: float, count: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """A ray moved by up to ``step`` of its reach, and turned by up to ``step``."""
    noise = np.random.default_rng(_SEED).uniform(-1.0, 1.0, (count, 6))
    size = step * (float(np.abs(origin).max()) + reach)
    directions = direction + step * noise[:, 3:]
    return origin + size * noise[:, :3], directions / np.linalg.norm(directions, axis=1, keepdims=True)


def searched(node: Node) -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Ever more and farther moved rays, for a search."""
    return [moved(node, scale, _TRIES) for scale in _SCALES]


def around(node: Node) -> list[Node]:
    """Nodes of moved rays, for an envelope."""
    origins, directions = moved(node, 1.0, _SAMPLES)
    return [
        Node(node.kind, node.depth, origin, direction, node.share)
        for origin, direction in zip(origins, directions, strict=True)
    ]


def _reach(node: Node) -> float:
    return node.t if np.isfinite(node.t) else 1.0

"""The ways by which a batch of rays may be traced: alone, a few, in packets, in streams, and by brute force."""

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from renderer.octree import BruteForce, Octree

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]


def ways(octree: Octree, brute: BruteForce, count: int) -> Iterator[tuple[str, Octree | BruteForce, list[Indices]]]:
    """Each way's name, who is asked, and the batches, as rows of ``count`` rays whose neighbours are alike.

    Sixteen rays alike travel as a packet; rays far apart, one after another in ``apart``, as a stream.
    """
    rows = np.arange(count)
    apart = np.concatenate([rows[k::97] for k in range(97)])
    yield "one by one", octree, [rows[i : i + 1] for i in range(0, count, max(1, count // 200))]
    yield "nine at a time", octree, [rows[i : i + 9] for i in range(0, count, max(9, count // 60))]
    yield "in packets", octree, [rows]
    yield "in streams", octree, [apart]
    yield "by brute force", brute, [rows]


def asked(
    ask: Callable[[Octree | BruteForce, Indices], NDArray[np.bool_]], octree: Octree, brute: BruteForce, count: int
) -> NDArray[np.bool_]:
    """The rays of all ways whose answers are as promised, by ``ask(tracer, rows)``."""
    return np.concatenate([ask(tracer, rows) for _, tracer, batches in ways(octree, brute, count) for rows in batches])

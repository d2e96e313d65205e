"""libigl's ``AABB`` and fast winding numbers as a contender for points: float64, all threads, trees kept between calls.

Its own ``signed_distance`` builds its tree in each call, which takes seconds in large meshes: here the two that it
consists of are asked.
"""

from functools import cached_property
from typing import Any

import igl
import numpy as np
from numpy.typing import NDArray

from renderer.system.threads import available_threads
from validation.benchmark.peers.contender import Faces, Floats, Peer, Points, Query, System


class LibiglPeer(Peer):
    """A tree of one mesh."""

    def __init__(self, vertices: Floats, faces: NDArray[np.int64]) -> None:
        self._mesh = vertices, faces
        self._tree = igl.AABB()
        self._tree.init(vertices, faces)

    @cached_property
    def _winding(self) -> Any:
        """The tree of winding numbers, built when it is first asked for."""
        tree = igl.FastWindingNumberBVH()
        tree.init(*self._mesh)
        return tree

    def contains(self, points: Points) -> Query:
        """Whether the winding number, which is approximate, is nearer to another number than to 0."""
        winding, p = self._winding, np.ascontiguousarray(points.points)
        return Query(lambda: winding.winding_number(p), lambda found: np.abs(found) > 0.5)

    def nearest(self, points: Points) -> Query:
        """Squared distance, face and closest point."""
        p = np.ascontiguousarray(points.points)
        return Query(lambda: self._tree.squared_distance(*self._mesh, p), lambda found: np.sqrt(found[0]))

    def signed(self, points: Points) -> Query:
        """Squared distance and winding number; ``read`` combines them."""
        winding, p = self._winding, np.ascontiguousarray(points.points)

        def trace() -> tuple[Any, Any]:
            return self._tree.squared_distance(*self._mesh, p)[0], winding.winding_number(p)

        return Query(trace, lambda found: np.where(np.abs(found[1]) > 0.5, -1.0, 1.0) * np.sqrt(found[0]))

    def touch(self) -> None:
        """Ask for one point."""
        self._tree.squared_distance(*self._mesh, np.zeros((1, 3)))


def systems() -> list[System]:
    """The one contender; it takes up to 0.2 ms a point on large meshes, and uses threads from 10,000 points on."""
    return [
        System("libigl", "libigl", available_threads(), "float64", _builder, most_rays=20_000, times_build=False)
    ]  # fmt: skip


def _builder(vertices: Floats, faces: Faces) -> Any:
    corners = faces.astype(np.int64)
    return lambda: LibiglPeer(vertices, corners)

"""Our octree as a contender: float64, with all threads and with one, and once for each split rule."""

import copy
from typing import Any

import numpy as np

from renderer.mesh.mesh import Mesh
from renderer.octree import Octree
from renderer.system.threads import available_threads
from renderer.tree.build import SPLITS
from validation.benchmark.peers.contender import Faces, Family, Floats, HitLists, Peer, Points, Query, System

OURS, OURS_ONE, OURS_TWO = "ours", "ours_one_thread", "ours_two_threads"


class Ours(Peer):
    """Queries of an octree, or those of a scene that it has too."""

    def __init__(self, octree: Any) -> None:
        self.octree = octree
        self._origin = np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]])

    def closest(self, rays: Family) -> Query:
        """Through ``Octree.closest_hit``, which includes its checks of the rays, as for every user."""
        return Query(lambda: self.octree.closest_hit(rays.origins, rays.directions, t_max=rays.t_max), lambda h: h.t)

    def any(self, rays: Family) -> Query:
        """Through ``Octree.any_hit``."""
        return Query(lambda: self.octree.any_hit(rays.origins, rays.directions, t_max=rays.t_max), lambda hit: hit)

    def all(self, rays: Family) -> Query:
        """Through ``Octree.all_hits``, which also tells contacts from hits."""
        return Query(
            lambda: self.octree.all_hits(rays.origins, rays.directions, t_max=rays.t_max),
            lambda hits: HitLists(hits.counts, hits.t, hits.face),
        )

    def count(self, rays: Family) -> Query:
        """Through ``Octree.count_hits``."""
        return Query(lambda: self.octree.count_hits(rays.origins, rays.directions, t_max=rays.t_max), lambda n: n)

    def contains(self, points: Points) -> Query:
        """Through ``Octree.contains``."""
        return Query(lambda: self.octree.contains(points.points), lambda inside: inside)

    def nearest(self, points: Points) -> Query:
        """Through ``Octree.closest_point``; the points themselves too, because all peers return them."""

        def trace() -> Any:
            found = self.octree.closest_point(points.points)
            return found, found.points

        return Query(trace, lambda found: found[0].distance)

    def signed(self, points: Points) -> Query:
        """Through ``Octree.signed_distance``."""
        return Query(lambda: self.octree.signed_distance(points.points), lambda distance: distance)

    def touch(self) -> None:
        """Trace one ray."""
        self.octree.closest_hit(*self._origin)

    def with_threads(self, threads: int) -> "Ours":
        """The same octree, not a copy, traced by so many threads."""
        other = copy.copy(self.octree)
        other.threads = threads
        return Ours(other)


def systems() -> list[System]:
    """Our contenders: all threads, and on the same octree one thread, and two where all are more."""
    found = [
        System(OURS, "ours", available_threads(), "float64", lambda v, f: _builder(v, f, {})),
        System(OURS_ONE, "ours, 1 thread", 1, "float64", lambda v, f: _builder(v, f, {"threads": 1}),
               times_build=False),
    ]  # fmt: skip
    if available_threads() > 2:
        found.append(System(OURS_TWO, "ours, 2 threads", 2, "float64", lambda v, f: _builder(v, f, {"threads": 2}),
                            times_build=False))  # fmt: skip
    return found


def builds() -> list[System]:
    """One contender for each split rule, for timing builds."""
    return [
        System(f"{OURS}_{split}", f"ours, {split}", available_threads(), "float64",
               lambda v, f, split=split: _builder(v, f, {"split": split}))  # type: ignore[misc]
        for split in SPLITS
    ]  # fmt: skip


def _builder(vertices: Floats, faces: Faces, options: dict[str, Any]) -> Any:
    mesh = Mesh(vertices, faces)
    return lambda: Ours(Octree.from_mesh(mesh, **options))

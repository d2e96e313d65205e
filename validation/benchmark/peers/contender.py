"""Interface of the benchmark's contenders: a system, its threads and limits, and its queries on one mesh."""

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Faces = NDArray[np.int32]


@dataclass(frozen=True)
class Family:
    """Named rays with an end: ``origins`` and ``directions`` (n, 3) float64, exact in float32.

    ``t_max`` is in units of |direction|, one for all rays: inf, or 1 for shadow rays, which end at their light.
    ``beyond`` says whether faces may lie behind that end, so that who does not know of it finds other hits.
    """

    name: str
    origins: Floats
    directions: Floats
    t_max: float = np.inf
    beyond: bool = False

    def __len__(self) -> int:
        return len(self.origins)

    def at_most(self, count: int) -> "Family":
        """``count`` rays evenly spread over the family, or all of it: the same share of them hits."""
        if count >= len(self):
            return self
        rows = _spread(len(self), count)
        return Family(self.name, self.origins[rows], self.directions[rows], self.t_max, self.beyond)


@dataclass(frozen=True)
class Points:
    """Named points (n, 3) float64, exact in float32."""

    name: str
    points: Floats

    def __len__(self) -> int:
        return len(self.points)

    def at_most(self, count: int) -> "Points":
        """``count`` points evenly spread over these, or all of them."""
        return self if count >= len(self) else Points(self.name, self.points[_spread(len(self), count)])


def _spread(length: int, count: int) -> NDArray[np.int64]:
    return np.linspace(0, length - 1, count).astype(np.int64)


class HitLists(NamedTuple):
    """All hits of n rays, m in all: ``counts`` (n,), and ``t`` and ``face`` (m,), sorted by ray, then t, then face."""

    counts: NDArray[np.int64]
    t: Floats
    face: NDArray[np.int64]

    @classmethod
    def sorted(cls, count: int, ray: NDArray[Any], t: NDArray[Any], face: NDArray[Any]) -> "HitLists":
        """Of ``count`` rays, from the ray, t and face of each hit in any order."""
        order = np.lexsort((face, t, ray))
        counts = np.bincount(ray.astype(np.int64), minlength=count)
        return cls(counts, t[order].astype(np.float64), face[order].astype(np.int64))


class Query(NamedTuple):
    """Rays or points already in the system's own arrays. Only ``trace`` is timed.

    read : converts ``trace``'s result to what ``Peer``'s method says.
    """

    trace: Callable[[], Any]
    read: Callable[[Any], Any]


class Peer:
    """A system with one mesh loaded. A query that it does not offer, or not for such rays, is None, as all are here."""

    def closest(self, rays: Family) -> Query | None:
        """Closest hits: t of each ray, float64 (n,), inf on a miss."""
        return None

    def any(self, rays: Family) -> Query | None:
        """Whether each ray hits anything up to ``rays.t_max``, bool (n,)."""
        return None

    def all(self, rays: Family) -> Query | None:
        """All hits of each ray: ``HitLists``."""
        return None

    def count(self, rays: Family) -> Query | None:
        """The number of hits of each ray, integers (n,)."""
        return None

    def contains(self, points: Points) -> Query | None:
        """Whether each point lies inside the mesh, which is closed, bool (n,)."""
        return None

    def nearest(self, points: Points) -> Query | None:
        """The closest point of the mesh to each point: its distance, float64 (n,)."""
        return None

    def signed(self, points: Points) -> Query | None:
        """The distance of each point from the mesh, which is closed, float64 (n,), negative inside."""
        return None

    def touch(self) -> None:
        """Trace one ray, so that systems that build on the first query have built."""
        raise NotImplementedError


@dataclass(frozen=True)
class System:
    """A contender before it has a mesh.

    load : converts vertices (V, 3) float64 and faces (F, 3) int32 to the system's own arrays; returns the build.
    most_rays, most_faces : a slow system gets fewer rays or points, spread evenly, no larger meshes; None: no limit.
    scope : the context in which ``load``'s result must be called; entered off the clock.
    times_build : whether the build is its own, and not another contender's with other threads.
    """

    name: str
    label: str
    threads: int
    precision: str
    load: Callable[[Floats, Faces], Callable[[], Peer]]
    most_rays: int | None = None
    most_faces: int | None = None
    times_build: bool = True
    scope: Callable[[], AbstractContextManager[Any]] = nullcontext

    def loaded(self, vertices: Floats, faces: Faces) -> Peer:
        """The system with this mesh, built."""
        build = self.load(vertices, faces)
        with self.scope():
            peer = build()
        peer.touch()
        return peer

    def takes(self, faces: int) -> bool:
        """Whether the system takes a mesh of so many faces."""
        return self.most_faces is None or faces <= self.most_faces

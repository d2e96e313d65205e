"""Interface of the benchmark's contenders: a system, its threads and limits, and its queries on one mesh."""

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Faces = NDArray[np.int32]


@dataclass(frozen=True)
class Family:
    """Named rays with an end: ``origins`` and ``directions`` (n, 3) float64, exact in float32.

    ``t_max`` is in units of |direction|, one for all rays: inf, or 1 for shadow rays, which end at their light.
    """

    name: str
    origins: Floats
    directions: Floats
    t_max: float = np.inf

    def __len__(self) -> int:
        return len(self.origins)

    def at_most(self, count: int) -> "Family":
        """``count`` rays evenly spread over the family, or all of it: the same share of them hits."""
        if count >= len(self):
            return self
        rows = np.linspace(0, len(self) - 1, count).astype(np.int64)
        return Family(self.name, self.origins[rows], self.directions[rows], self.t_max)


class Query(NamedTuple):
    """Rays already in the system's own arrays. Only ``trace`` is timed.

    read : converts ``trace``'s result to t of each ray, float64 (n,), inf on a miss; for any-hit queries to bool (n,).
    """

    trace: Callable[[], Any]
    read: Callable[[Any], NDArray[Any]]


class Peer(Protocol):
    """A system with one mesh loaded."""

    def closest(self, rays: Family) -> Query:
        """Closest hits."""

    def any(self, rays: Family) -> Query | None:
        """Whether each ray hits anything up to ``rays.t_max``; None where the system does not offer this query."""

    def touch(self) -> None:
        """Trace one ray, so that systems that build on the first query have built."""


@dataclass(frozen=True)
class System:
    """A contender before it has a mesh.

    load : converts vertices (V, 3) float64 and faces (F, 3) int32 to the system's own arrays; returns the build.
    most_rays, most_faces : a slow system gets fewer rays, spread evenly, and no larger meshes; None: no limit.
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

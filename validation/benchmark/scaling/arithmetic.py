"""How long a study takes on a cluster, by arithmetic from measured figures."""

from __future__ import annotations

from typing import NamedTuple

from renderer.checkpoints.study import PART
from validation.benchmark.scaling.figures import Figures, hops


class Estimate(NamedTuple):
    """Seconds of a study on a cluster.

    before, behind  what the driver does alone, the mesh's way and the tree
    workers         all parts, shared evenly by the workers
    driver          all parts, one after the other through the driver
    last            one part and a task's way: while the first is under way nobody has answered, and while the last is
                    computed the other workers wait
    filling         the driver's time until each worker has its first part
    """

    before: float
    workers: float
    driver: float
    last: float
    filling: float
    behind: float

    @property
    def seconds(self) -> float:
        """All: the parts take as long as what is busier, workers or driver."""
        busy = max(self.workers + self.filling / 2.0, self.driver)
        return self.before + busy + self.last + self.behind


def estimate(f: Figures, points: int, workers: int, size: int) -> Estimate:
    """A study of ``points`` in parts of ``size`` on ``workers`` of one thread, the driver on a processor of its own."""
    size = min(size, points)
    parts = -(-points // size)
    mean = points / parts
    busy = min(workers, parts)
    return Estimate(
        before=before(f, points, workers),
        workers=parts * f.computing(mean) / busy,
        driver=parts * f.driving(mean),
        last=f.computing(mean) / 2.0 + f.task,
        filling=busy * f.driving(mean) / 2.0,
        behind=f.joined * points,
    )


def before(f: Figures, points: int, workers: int) -> float:
    """Seconds until the first part can be computed: digests and order, the mesh's way, the tree on each worker."""
    return f.planned * points + f.start + hops(workers) * f.send + f.crowded * f.tree


def alone(f: Figures, points: int, size: int) -> float:
    """Seconds of the same study on one thread of one process, other threads of its machine as busy."""
    parts = -(-points // size)
    computing = f.tree + parts * f.part + f.point * points
    return f.planned * points + f.crowded * computing + f.joined * points


def efficiency(f: Figures, points: int, workers: int, seconds: float) -> float:
    """The time of one thread without a cluster, in parts as a run has them, over all workers' time."""
    return alone(f, points, PART) / (workers * seconds)


def fed(f: Figures, size: int) -> int:
    """How many workers one driver feeds: as many as compute a part while it handles one for each."""
    return int(f.computing(size) / f.driving(size))


def best(f: Figures, points: int, workers: int, sizes: range = range(10, 19)) -> tuple[int, Estimate]:
    """The part size, a power of two, that takes least time, and how much."""
    found = {1 << bits: estimate(f, points, workers, 1 << bits) for bits in sizes}
    size = min(found, key=lambda size: found[size].seconds)
    return size, found[size]

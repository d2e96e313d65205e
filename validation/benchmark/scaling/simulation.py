"""A study on a cluster, event by event: a driver that hands out parts and takes answers, and workers with queues.

Nothing is random: the parts take the measured times, one after the other and again from the first.
"""

from __future__ import annotations

import heapq
from collections import deque
from typing import Literal, NamedTuple

import numpy as np

from validation.benchmark.scaling.arithmetic import before
from validation.benchmark.scaling.figures import Figures

# As ``renderer.cluster.studies``: parts under way for each worker.
_AHEAD = 2


class Event(NamedTuple):
    """A part that reaches a worker, is computed there, or is back; ``order`` parts those of one moment."""

    seconds: float
    order: int
    kind: Literal["arrived", "computed", "back"]
    part: int
    worker: int


class Cluster:
    """The state of a run: the driver does one thing at a time, half of a part's work as it goes, half as it is back.

    Each part goes to the worker with the fewest, which computes one at a time in the order of arrival.
    """

    def __init__(self, f: Figures, points: int, workers: int, size: int, shared: bool) -> None:
        self.f, self.size = f, min(size, points)
        self.parts = -(-points // self.size)
        self.last = points - (self.parts - 1) * self.size
        self.begun = before(f, points, workers)
        self.free, self.sent, self.taken, self.shared = self.begun, 0, 0, shared
        self.pending = np.zeros(workers, np.int64)
        self.queues: list[deque[int]] = [deque() for _ in range(workers)]
        self.events: list[Event] = []
        self.order = 0

    def seconds(self) -> float:
        """Seconds until the driver has all parts."""
        for _ in range(min(self.parts, _AHEAD * len(self.pending))):
            self._send()
        while self.events:
            event = heapq.heappop(self.events)
            if event.kind == "arrived":
                self.queues[event.worker].append(event.part)
                if len(self.queues[event.worker]) == 1:
                    self._compute(event.seconds, event.worker)
            elif event.kind == "computed":
                self.queues[event.worker].popleft()
                self.pending[event.worker] -= 1
                self._at(event.seconds + self.f.task / 2.0, "back", event.part, event.worker)
                if self.queues[event.worker]:
                    self._compute(event.seconds, event.worker)
            else:
                self.free = max(self.free, event.seconds) + self._driving(event.part)
                self.taken += 1
                if self.sent < self.parts:
                    self._send()
        assert self.taken == self.parts
        return self.free

    def _points(self, part: int) -> int:
        return self.last if part == self.parts - 1 else self.size

    def _driving(self, part: int) -> float:
        return self.f.driving(self._points(part)) / 2.0

    def _send(self) -> None:
        part, worker = self.sent, int(self.pending.argmin())
        self.sent += 1
        self.pending[worker] += 1
        self.free += self._driving(part)
        self._at(self.free + self.f.task / 2.0, "arrived", part, worker)

    def _compute(self, now: float, worker: int) -> None:
        part = self.queues[worker][0]
        f, points = self.f, self._points(part)
        seconds = f.computing(points) * f.spread[part % len(f.spread)]
        # Where the driver has no processor of its own it takes its time from the workers.
        seconds += f.driving(points) if self.shared else 0.0
        self._at(now + seconds, "computed", part, worker)

    def _at(self, seconds: float, kind: Literal["arrived", "computed", "back"], part: int, worker: int) -> None:
        self.order += 1
        heapq.heappush(self.events, Event(seconds, self.order, kind, part, worker))


def simulate(f: Figures, points: int, workers: int, size: int, *, processors: int | None = None) -> float:
    """Seconds of a study on a cluster, tree included.

    processors   of one machine that driver and workers share; None: each has its own
    """
    shared = processors is not None and workers >= processors
    # One worker beside an idle driver has its machine's memory to itself.
    alone = processors is not None and workers < processors
    figures = f._replace(crowded=1.0) if alone else f
    return Cluster(figures, points, workers, size, shared).seconds() + f.joined * points

"""Calls of few rays: microseconds each, in our arrays and in the peers' own, in turn."""

import statistics
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from renderer.mesh.shapes import icosphere
from validation.benchmark.peers.contender import Family, System
from validation.benchmark.peers.ours import OURS, OURS_ONE
from validation.timing import RUNS, interleaved, ratio, timed

COUNTS = (1, 10, 100)
# Those whose users call few rays; Mitsuba's are compiled for many, trimesh's calls are in ``drop_in``.
PEERS = ("embree", "open3d")
# Calls that are timed together: some milliseconds.
_CALLS = 1_000


def measure(systems: Sequence[System], step: Callable[[str], None]) -> list[dict[str, Any]]:
    """A row for each of ``COUNTS``, on a sphere of 20,480 faces, for JSON.

    A peer of one thread is compared to ours on one, the others to ours on all.
    """
    mesh = icosphere(5)
    asked = {s.name: s for s in systems if s.name in (OURS, OURS_ONE, *PEERS)}
    beside = {name: OURS_ONE if asked[name].threads == 1 else OURS for name in PEERS if name in asked}
    peers = {name: s.loaded(mesh.vertices, mesh.faces) for name, s in asked.items()}
    rows = []
    for count in COUNTS:
        step(f"calls of {count}")
        rays = Family("few", np.tile([0.1, 0.2, 3.0], (count, 1)), np.tile([0.0, 0.0, -1.0], (count, 1)))
        queries = {name: query for name, peer in peers.items() if (query := peer.closest(rays)) is not None}
        found = interleaved({name: _clock(query.trace, _CALLS) for name, query in queries.items()}, RUNS)
        micros = {name: [1e6 * s / _CALLS for s in runs] for name, runs in found.items()}
        rows.append({
            "rays": count, "micros": micros, "median": {name: statistics.median(runs) for name, runs in micros.items()},
            "ratios": {name: ratio(micros[name], micros[own]) for name, own in beside.items()},
        })  # fmt: skip
    return rows


def _clock(call: Callable[[], Any], calls: int) -> Callable[[], float]:
    """Seconds of so many calls, after one that no clock sees: threads wake, caches fill."""

    def seconds() -> float:
        call()
        return timed(repeated)()

    def repeated() -> None:
        for _ in range(calls):
            call()

    return seconds

"""The measured figures that arithmetic and simulation start from."""

from __future__ import annotations

import json
import statistics
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from validation.benchmark.measures.cluster import RECORD


class Figures(NamedTuple):
    """Seconds, each of one thread or process.

    planned, joined       a point, on the driver: digest and order before the parts, the result behind them
    start                 the driver's own, of a run of one point
    send                  one hop of the mesh from a process to the next
    tree                  the tree, on one thread
    part, point           a part's computing: ``part + point * points``
    crowded               how many times longer where every processor computes
    worker, worker_point  what a part costs a worker besides, likewise
    driver, driver_point  what a part costs the driver and the scheduler
    task                  an empty task, there and back
    spread                the seconds of measured parts over their mean
    """

    planned: float
    joined: float
    start: float
    send: float
    tree: float
    part: float
    point: float
    crowded: float
    worker: float
    worker_point: float
    driver: float
    driver_point: float
    task: float
    spread: tuple[float, ...]

    def computing(self, points: float) -> float:
        """Seconds of a part of so many points on a worker, all processors busy."""
        return self.crowded * (self.part + self.point * points) + self.worker + self.worker_point * points

    def driving(self, points: float) -> float:
        """Seconds of the driver for a part of so many points."""
        return self.driver + self.driver_point * points


def read(path: Path = RECORD) -> dict[str, Any]:
    """The record."""
    record: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return record


def figures_of(record: Mapping[str, Any]) -> Figures:
    """The figures of a record: medians, and lines through the runs with parts of two sizes."""
    of = {name: statistics.median(values) for name, values in record["seconds"].items()}
    points, sizes = record["points"], (record["small"], record["size"])
    costs = [record["costs"][str(size)] for size in sizes]
    one = record["costs"]["one"]
    counts = [-(-points // size) for size in sizes]
    part, point = _line([sum(record["parts"][str(size)]) for size in sizes], counts, points)
    driver, driver_point = _line([c["driver"] - one["driver"] for c in costs], counts, points)
    # What the workers spend beyond what the same answers cost without a cluster.
    beyond = [c["workers"] - c["alone"] - (one["workers"] - one["alone"]) for c in costs]
    worker, worker_point = _line(beyond, counts, points)
    whole = record["parts"][str(record["size"])][: points // record["size"]]
    mean = statistics.fmean(whole)
    return Figures(
        planned=(of["planned"] - one["driver"]) / points, joined=of["joined"] / points, start=one["driver"],
        send=of["send_2"] / hops(2), tree=of["tree_1"], part=part, point=point,
        crowded=2.0 * of["call_2"] / of["call_1"], worker=worker, worker_point=worker_point,
        driver=driver, driver_point=driver_point, task=record["task"],
        spread=tuple(seconds / mean for seconds in whole),
    )  # fmt: skip


def hops(workers: int) -> int:
    """How often the mesh is sent on until all workers have it: to the scheduler, to a worker, and from each that has it
    to two others.
    """
    found, having = 2, 1
    while having < workers:
        found, having = found + 1, 3 * having
    return found


def _line(totals: list[float], counts: list[int], points: int) -> tuple[float, float]:
    """What a part and what a point costs, from the totals of two runs over the same points in more and in fewer parts.

    None is less than nothing: where rounding of clocks would say so, all is the points'.
    """
    part = max(0.0, (totals[0] - totals[1]) / (counts[0] - counts[1]))
    return part, max(0.0, totals[1] - part * counts[1]) / points

"""What a plot of error against run time is made of: fair seconds, the Pareto front and the log-log slope."""

import math
import statistics
import time
from collections.abc import Callable, Mapping, MutableMapping, Sequence
from typing import Any, TypeVar

import numpy as np

T = TypeVar("T")

RUNS = 5
# Seconds between calls. Some contenders' threads go on spinning for milliseconds after their work and take a processor
# from whoever comes next: behind Mitsuba's llvm variant, two threads of ours were as slow as one.
REST = 0.03


def interleaved(calls: Mapping[str, Callable[[], float]], runs: int, unseen: int = 1) -> dict[str, list[float]]:
    """Seconds of every call in each of ``runs`` rounds, after ``unseen`` rounds; all take turns.

    Each call returns its own seconds, see ``timed``. Whatever slows the machine for a while then slows every call
    alike. The unseen rounds pay for compilation and caches: 0 where all calls were made before.
    """
    rounds = [{name: _rested(call) for name, call in calls.items()} for _ in range(unseen + runs)][unseen:]
    return {name: [seconds[name] for seconds in rounds] for name in calls}


def median_seconds(calls: Mapping[str, Callable[[], float]], runs: int, unseen: int = 1) -> dict[str, float]:
    """The median of each call's seconds, see ``interleaved``."""
    return {name: statistics.median(seconds) for name, seconds in interleaved(calls, runs, unseen).items()}


def ratio(theirs: Sequence[float], ours: Sequence[float]) -> float:
    """How many times faster ours is: the median of the rounds' ratios, not the ratio of the medians."""
    return statistics.median(t / o for t, o in zip(theirs, ours, strict=True))


def timed(call: Callable[..., Any], *arguments: Any) -> Callable[[], float]:
    """A call without arguments that returns the seconds ``call(*arguments)`` takes."""

    def seconds() -> float:
        began = time.perf_counter()
        call(*arguments)
        return time.perf_counter() - began

    return seconds


def spending(costs: MutableMapping[str, float], name: str, call: Callable[..., T]) -> Callable[..., T]:
    """``call`` that adds the seconds it takes, from the outside, to ``costs[name]``."""

    def spent(*arguments: Any) -> T:
        began = time.perf_counter()
        found = call(*arguments)
        costs[name] = costs.get(name, 0.0) + time.perf_counter() - began
        return found

    return spent


def _rested(call: Callable[[], float]) -> float:
    time.sleep(REST)
    return call()


def front(points: Sequence[tuple[float, float]]) -> list[int]:
    """Rows of the Pareto front of (cost, error) points, both the smaller the better, cheapest first.

    A point is on the front unless another is no worse in both and better in one; equal points stay together. Raises
    ``ValueError`` for NaN, which compares with nothing.

    >>> front([(1.0, 9.0), (2.0, 3.0), (3.0, 3.0), (4.0, 1.0)])
    [0, 1, 3]
    """
    for row, point in enumerate(points):
        if math.isnan(point[0]) or math.isnan(point[1]):
            raise ValueError(f"points: expected numbers, got {point} in row {row}")
    chosen: list[int] = []
    for row in sorted(range(len(points)), key=lambda i: points[i]):
        # Sorted by cost, then error: only a strictly smaller error, or the last point again, is not dominated.
        if not chosen or points[row][1] < points[chosen[-1]][1] or points[row] == points[chosen[-1]]:
            chosen.append(row)
    return chosen


def slope(x: Sequence[float], y: Sequence[float]) -> float | None:
    """Exponent p of y = c x^p by least squares in log-log; pairs with a number <= 0, which has no logarithm, are
    left out. None where fewer than two different x remain.

    >>> round(slope([1.0, 4.0, 16.0], [8.0, 4.0, 2.0]), 12)
    -0.5
    """
    pairs = [(a, b) for a, b in zip(x, y, strict=True) if a > 0.0 and b > 0.0]
    if len({a for a, _ in pairs}) < 2:
        return None
    u, v = np.log(np.array(pairs)).T
    centred = u - u.mean()
    return float(centred @ v / (centred @ centred))

"""Contenders in turn: whatever slows the machine for a while then slows all of them alike."""

import statistics
import time
from collections.abc import Callable, Mapping, Sequence

RUNS = 5
# Seconds between calls. Some contenders' threads go on spinning for milliseconds after their work and take a processor
# from whoever comes next: behind Mitsuba's llvm variant, two threads of ours were as slow as one.
REST = 0.03


def interleaved(calls: Mapping[str, Callable[[], float]], runs: int = RUNS, unseen: int = 1) -> dict[str, list[float]]:
    """Seconds of every call in each of ``runs`` rounds, after ``unseen`` rounds for caches and compilation.

    Each call returns its own seconds, see ``validation.tradeoff.timed``.
    """
    rounds = [{name: _rested(call) for name, call in calls.items()} for _ in range(unseen + runs)][unseen:]
    return {name: [seconds[name] for seconds in rounds] for name in calls}


def _rested(call: Callable[[], float]) -> float:
    time.sleep(REST)
    return call()


def ratio(theirs: Sequence[float], ours: Sequence[float]) -> float:
    """How many times faster ours is: the median of the rounds' ratios, not the ratio of the medians."""
    return statistics.median(t / o for t, o in zip(theirs, ours, strict=True))

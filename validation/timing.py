"""Fair timing of several contenders: interleaved rounds, medians and ratios."""

import statistics
import time
from collections.abc import Callable, Mapping, MutableMapping, Sequence
from typing import Any, TypeVar

T = TypeVar("T")

RUNS = 5
# Seconds between calls. Some contenders' threads go on spinning for milliseconds after their work and take a processor
# from the next contender: after Mitsuba's llvm variant, two threads of ours were as slow as one.
REST = 0.03


def interleaved(calls: Mapping[str, Callable[[], float]], runs: int, unseen: int = 1) -> dict[str, list[float]]:
    """Seconds of every call in each of ``runs`` rounds, after ``unseen`` rounds; the calls take turns.

    Each call returns its own seconds, see ``timed``. A slow phase of the machine then slows every call alike. The
    unseen rounds pay for compilation and caches: 0 where all calls were made before.
    """
    rounds = [{name: _rested(call) for name, call in calls.items()} for _ in range(unseen + runs)][unseen:]
    return {name: [seconds[name] for seconds in rounds] for name in calls}


def median_seconds(calls: Mapping[str, Callable[[], float]], runs: int, unseen: int = 1) -> dict[str, float]:
    """The median of each call's seconds, see ``interleaved``."""
    return {name: statistics.median(seconds) for name, seconds in interleaved(calls, runs, unseen).items()}


def ratio(theirs: Sequence[float], ours: Sequence[float]) -> float:
    """The factor by which ours is faster: the median of the rounds' ratios, not the ratio of the medians."""
    return statistics.median(t / o for t, o in zip(theirs, ours, strict=True))


def timed(call: Callable[..., Any], *arguments: Any) -> Callable[[], float]:
    """A call without arguments that returns the seconds ``call(*arguments)`` takes."""

    def seconds() -> float:
        began = time.perf_counter()
        call(*arguments)
        return time.perf_counter() - began

    return seconds


def spending(costs: MutableMapping[str, float], name: str, call: Callable[..., T]) -> Callable[..., T]:
    """``call`` wrapped, so that it adds its seconds to ``costs[name]``."""

    def spent(*arguments: Any) -> T:
        began = time.perf_counter()
        found = call(*arguments)
        costs[name] = costs.get(name, 0.0) + time.perf_counter() - began
        return found

    return spent


def _rested(call: Callable[[], float]) -> float:
    """The call's seconds, after a rest."""
    time.sleep(REST)
    return call()

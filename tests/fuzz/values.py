"""What all kinds of fuzzing share: numbers at the ends of float64, what a clear error is, and a limit of time."""

import math
import re
import signal
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any

from pydantic import ValidationError

from renderer import SceneWarning
from renderer.arguments.limits import FARTHEST, LONGEST, SHORTEST

# A hundred times what the slowest valid input takes; beyond it something does not end.
SECONDS = 2.0


@dataclass(frozen=True)
class Kind:
    """How input ``index`` of a seed is made, and how it is checked.

    make     (seed, index) -> the input: bytes of a file, or plain values whose ``repr`` says all
    check    (folder, input, index) -> what came of it, in a word; anything wrong is an exception
    share    how many inputs it gets in a turn of all kinds
    """

    make: Callable[[int, int], Any]
    check: Callable[[Path, Any, int], str]
    share: int = 4

    def judge(self, folder: Path, given: Any, index: int) -> str:
        """``check`` within the limit of time, with warnings as errors, but for those of values that are allowed."""
        with time_limit(SECONDS), warnings.catch_warnings():
            warnings.simplefilter("error")
            warnings.simplefilter("ignore", SceneWarning)
            return self.check(folder, given, index)


def _beside(*values: float) -> list[float]:
    """Values and their neighbours."""
    return [y for x in values for y in (math.nextafter(x, 0.0), x, math.nextafter(x, math.inf))]


# Sizes, of either sign: no number at all, denormals, the ends of float32 and float64, and the ends of what is taken.
SIZES = [
    *(0.0, 0.0, 5e-324, 1e-320, 1e-310, 2.0**-1022, 1e-300, 1e-200, 1e-160, 1e-150, 1e-100, 1e-45, 1e-38, 1e-30, 1e-16),
    *(1e-8, 1e-3, 1.0, 2.0, 3.0, 90.0, 180.0, 360.0, 1e3, 1e8, 1e16, 1e18, 1e30, 1e37, 3e38, 1e39, 1e100, 1e150, 1e154),
    *(1e160, 1e200, 1e300, 1e308, 2.0**127, 2.0**128, 2.0**1023, math.nextafter(math.inf, 0.0)),
    *_beside(FARTHEST, SHORTEST, LONGEST, 2.0**-60, 2.0**60, 2.0**-126, 2.0**-149, 2.0**-330),
]
NOT_FINITE = [math.nan, math.inf, -math.inf]


def extreme(rng: Random, odds: float = 0.02) -> float:
    """A number at some end; with these odds one that is not finite."""
    if rng.random() < odds:
        return rng.choice(NOT_FINITE)
    if rng.random() < 0.3:
        return rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-308.0, 308.0)
    return rng.choice([-1.0, 1.0]) * rng.choice(SIZES)


def vector(rng: Random, wild: float = 0.3) -> tuple[float, float, float]:
    """Three numbers near 1, or, with the odds ``wild``, with one or all at some end."""
    values = [rng.gauss(0.0, 1.0) for _ in range(3)]
    if rng.random() < wild:
        match rng.randrange(4):
            case 0:
                values[rng.randrange(3)] = extreme(rng)
            case 1:
                values = [extreme(rng, 0.01) for _ in range(3)]
            case 2:
                size = abs(extreme(rng, 0.01))
                values = [x * size for x in values]
            case _:
                values = [0.0, -0.0, 0.0]
                values[rng.randrange(3)] = extreme(rng)
    return values[0], values[1], values[2]


def expect_clear(error: Exception) -> None:
    """An error of ours: one line that says what was expected, without the libraries below."""
    text = str(error)
    assert isinstance(error, ValueError) and not isinstance(error, ValidationError), repr(error)
    assert re.search("expected|unknown key|should have", text), f"says not what is wrong: {text!r}"
    assert "\n" not in text and len(text) < 2000, f"not one clear line: {text!r}"
    assert "pydantic" not in text and "Traceback" not in text, f"tells of a library: {text!r}"


@contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Raise ``TimeoutError`` after this many seconds; main thread only."""

    def stop(*_: object) -> None:
        raise TimeoutError(f"expected an end within {seconds} s")

    previous = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, previous)

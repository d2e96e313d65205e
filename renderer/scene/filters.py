"""Reconstruction filters: where the samples of a pixel lie, and how much each counts.

A pixel is the integral of the picture times a filter f(x) f(y) around the pixel's centre. Samples lie by the filter's
own distribution (filter importance sampling: Ernst, Stamminger and Greiner, 2006; Pharr, Jakob and Humphreys,
Physically Based Rendering, 4th edition, 8.8). So each pixel has rays of its own, and tiles need no margin.
"""

import math
from collections.abc import Callable
from functools import cache
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.scene.camera import sample_offsets

FilterName = Literal["box", "tent", "gaussian", "mitchell"]
# Halving an interval so often leaves an ulp.
_HALVINGS = 60
# The least number of samples along an axis of which some go to lobes below 0.
_WITH_LOBES = 4


class _Filter(NamedTuple):
    """An even filter of one axis, whose whole integral is 1.

    integral  that from 0 to x, for x from 0 to the radius
    zero      the filter is positive up to here, and negative from here to the radius
    radius    in pixels, as of Mitsuba's filter with its defaults
    """

    integral: Callable[[float], float]
    zero: float
    radius: float


def _tent(x: float) -> float:
    """Of 1 - x."""
    return x - 0.5 * x * x


def _gaussian(x: float) -> float:
    """Of exp(-2 x²) - exp(-8), a standard deviation of half a pixel, up to a factor."""
    return math.sqrt(math.pi / 8.0) * math.erf(math.sqrt(2.0) * x) - math.exp(-8.0) * x


def _mitchell(x: float) -> float:
    """Of Mitchell and Netravali's cubic with B = C = 1/3."""
    if x < 1.0:
        return (1.75 * x**4 - 4.0 * x**3 + 16.0 / 3.0 * x) / 6.0
    rest = 2.0 - x  # the outer piece is (2 - x)² (8 - 7 x) / 18
    return 0.5 - (7.0 / 4.0 * rest**4 - 2.0 * rest**3) / 18.0


_FILTERS = {
    "tent": _Filter(_tent, 1.0, 1.0),
    "gaussian": _Filter(lambda x: 0.5 * _gaussian(x) / _gaussian(2.0), 2.0, 2.0),
    "mitchell": _Filter(_mitchell, 8.0 / 7.0, 2.0),
}


def film_samples(name: str, samples: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Positions of samples from the pixel's top left corner, (samples, 2), and their weights (samples,), of mean 1.

    The middle one of an odd number is the pixel's centre. With one sample all filters are the same.
    """
    places = sample_offsets(samples)
    if name == "box":
        return places, np.ones(samples)
    across, weights = _along_axis(name, math.isqrt(samples))
    y, x = np.meshgrid(across, across, indexing="ij")
    return 0.5 + np.stack([x.ravel(), y.ravel()], axis=1), np.outer(weights, weights).ravel()


@cache
def _along_axis(name: str, count: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Samples along one axis from the pixel's centre, in order, and their weights.

    Each stands for a part of the filter, and lies where it halves the part's integral. Parts are equal, but for those
    of negative lobes: a lobe has its share of the samples, and at least one.
    """
    one = _FILTERS[name]
    main, lobe = one.integral(one.zero), one.integral(one.zero) - 0.5  # of the half to the right
    outer = max(1, round(count * lobe / (main + lobe) / 2.0)) if lobe > 0.0 and count >= _WITH_LOBES else 0
    inner = count - 2 * outer
    weight = 2.0 * (main if outer else 0.5) * count / inner
    right = [(_inverse(one, main * k / inner, 0.0, one.zero), weight) for k in range(1 + inner % 2, inner, 2)]
    right += [
        (_inverse(one, main - lobe * (k + 0.5) / outer, one.zero, one.radius), -lobe * count / outer)
        for k in range(outer)
    ]
    left = [(-place, share) for place, share in reversed(right)]
    places, weights = zip(*left, *[(0.0, weight)] * (inner % 2), *right, strict=True)
    return np.array(places), np.array(weights)


def _inverse(one: _Filter, integral: float, low: float, high: float) -> float:
    """The place between ``low`` and ``high`` up to which the filter has this integral."""
    rises = one.integral(high) > one.integral(low)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        below = one.integral(middle) < integral
        low, high = (middle, high) if below == rises else (low, middle)
    return low

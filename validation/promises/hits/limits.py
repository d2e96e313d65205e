"""The ends of the range of float64: the shortest and longest directions, and hits whose t would be infinite."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.octree import BruteForce, Octree
from validation.promises.refused import refuses
from validation.promises.row import row

# Powers of two of directions: those that are taken at last and those that are refused next.
_SHORTEST, _LONGEST = -300, 700
_JUDGE = "closed form"
_CORNERS = np.array([(-1.0, -1.0, 0.0), (3.0, -1.0, 0.0), (-1.0, 3.0, 0.0)])
# One ray alone, some, and packets.
_BATCHES = (1, 9, 64)


def check_limits() -> list[dict[str, Any]]:
    """Rays along -z at one face, whose t is a power of two."""
    lengths, overflows = [], []
    for tracer in (Octree, BruteForce):
        usual, huge = tracer(_CORNERS, [[0, 1, 2]]), tracer(np.ldexp(_CORNERS, 900), [[0, 1, 2]])
        for count in _BATCHES:
            lengths += [_taken(usual, power, count) for power in (_SHORTEST, _LONGEST)]
            lengths += [refuses(usual.closest_hit, *_rays(1.0, long, count)) for long in _beyond()]
            overflows += [_met(huge, power, count) for power in (-120, -123, -124, -125, -200, -250)]
    return [
        row("directions may be from 2^-300 to 2^700 long, ends included", _JUDGE, np.array(lengths)),
        row("a face that only an infinite t would reach is not hit", _JUDGE, np.array(overflows)),
    ]


def _beyond() -> tuple[float, float]:
    return float(np.nextafter(2.0**_SHORTEST, 0.0)), float(np.nextafter(2.0**_LONGEST, np.inf))


def _rays(height: float, long: float, count: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    return np.tile([0.0, 0.0, height], (count, 1)), np.tile([0.0, 0.0, -long], (count, 1))


def _taken(tracer: Octree | BruteForce, power: int, count: int) -> bool:
    try:
        found = tracer.closest_hit(*_rays(1.0, 2.0**power, count))
    except ValueError:
        return False
    return bool((found.t == 2.0**-power).all() and (found.face == 0).all())


def _met(tracer: Octree | BruteForce, power: int, count: int) -> bool:
    """Whether a ray from 2^900 above the face, with a direction 2^power long, meets it where t is a float64."""
    rays = _rays(2.0**900, 2.0**power, count)
    there, t = 900 - power < 1024, 2.0 ** (900 - power) if 900 - power < 1024 else np.inf
    found, each = tracer.closest_hit(*rays), tracer.all_hits(*rays)
    return bool(
        (found.t == t).all()
        and (found.hit == there).all()
        and (tracer.any_hit(*rays) == there).all()
        and (tracer.count_hits(*rays) == there).all()
        and each.t.tolist() == [t] * count * there
    )

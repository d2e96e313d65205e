"""Directions that stand for all of a hemisphere or sphere, each with the solid angle that it stands for.

All are fixed: nothing here is random. Hemispheres are about +z; azimuths run clockwise from +y, as a compass does
where x is east and y is north.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.counts import count_argument

Floats = NDArray[np.float64]

# The patches in each row of Tregenza's sky, from the horizon up; one more is the zenith's.
_TREGENZA = (30, 30, 24, 24, 18, 12, 6)
# The golden ratio less one: each direction is turned by so much of a turn against the one before.
_GOLDEN = (5.0**0.5 - 1.0) / 2.0
# So many that float64 places each of them: the fraction of i * _GOLDEN loses a digit where i gains one.
MOST = 1 << 24


class Pattern(NamedTuple):
    """Directions and what each stands for.

    directions  (k, 3) float64, unit vectors
    weights     (k,) float64, >= 0: solid angles in steradians; those of ``cosine_hemisphere`` times the cosine

    >>> import numpy as np
    >>> from renderer import Octree
    >>> from renderer.studies import Pattern, sky_view_factor
    >>> roof = Octree([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> sky = Pattern(directions=np.array([[0, 0, 1.0], [0.6, 0, 0.8]]), weights=np.array([4.0, 5.0]))
    >>> sky_view_factor(roof, [[0.25, 0.25, -1]], patches=sky)
    array([0.5])
    """

    directions: Floats
    weights: Floats


def tregenza() -> Pattern:
    """Tregenza's 145 patches of the sky: seven rows of 12 degrees, and a cap of 6 degrees around the zenith.

    Directions go to the patches' centres, row by row from the horizon, the first of each to +y. Weights are the
    patches' solid angles, 2 pi in all.

    Source: Tregenza, Subdivision of the sky hemisphere for luminance measurements, 1987.

    >>> import numpy as np
    >>> from renderer.studies import tregenza
    >>> tregenza().directions.shape, round(float(tregenza().weights.sum() / np.pi), 12)
    ((145, 3), 2.0)
    """
    return reinhart(1)


def reinhart(subdivision: int = 2) -> Pattern:
    """Reinhart's sky "MF:m": each row of Tregenza's as m rows of m times as many patches, 144 m^2 + 1 in all.

    The 7 m rows are equally high, and the cap around the zenith is half as high as they are: rows of 90 / (7 m + 1/2)
    degrees. Directions and weights as in ``tregenza``; m = 2 gives 577.

    Source: Bourgeois, Reinhart, Ward, A standard daylight coefficient model for dynamic daylighting simulations, 2008.

    >>> from renderer.studies import reinhart
    >>> [len(reinhart(m).weights) for m in (1, 2, 4)]
    [145, 577, 2305]
    """
    subdivision = count_argument("subdivision", subdivision, 1, 64)
    counts = np.repeat(_TREGENZA, subdivision) * subdivision
    step = np.pi / 2.0 / (len(counts) + 0.5)
    below = np.sin(step * np.arange(len(counts) + 1))
    rows = []
    for row, count in enumerate(counts):
        sine, cosine = _turns(int(count))
        level, height = np.cos(step * (row + 0.5)), np.sin(step * (row + 0.5))
        rows.append(np.stack([level * sine, level * cosine, np.full(count, height)], axis=1))
    areas = np.repeat(2.0 * np.pi * np.diff(below) / counts, counts)
    cap = 2.0 * np.pi * (1.0 - below[-1])
    return Pattern(np.concatenate([*rows, [[0.0, 0.0, 1.0]]]), np.append(areas, cap))


def fibonacci_hemisphere(count: int) -> Pattern:
    """``count`` directions, 1 to 2^24, of equal solid angle over the hemisphere, along a spiral from the horizon up.

    Source: Swinbank, Purser, Fibonacci grids: a novel approach to global modelling, 2006.

    >>> from renderer.studies import fibonacci_hemisphere
    >>> fibonacci_hemisphere(2).directions[:, 2]
    array([0.25, 0.75])
    """
    count = check_count("count", count)
    height = (np.arange(count) + 0.5) / count
    return Pattern(_spiral(height), np.full(count, 2.0 * np.pi / count))


def fibonacci_sphere(count: int) -> Pattern:
    """``count`` directions, 1 to 2^24, of equal solid angle over the whole sphere, along a spiral from -z to +z.

    Source: Swinbank, Purser, Fibonacci grids: a novel approach to global modelling, 2006.

    >>> from renderer.studies import fibonacci_sphere
    >>> fibonacci_sphere(4).directions[:, 2]
    array([-0.75, -0.25,  0.25,  0.75])
    """
    count = check_count("count", count)
    height = (2.0 * np.arange(count) + 1.0 - count) / count
    return Pattern(_spiral(height), np.full(count, 4.0 * np.pi / count))


def cosine_hemisphere(count: int) -> Pattern:
    """``count`` directions, 1 to 2^24, over the hemisphere, each of which stands for as much of the cosine.

    So close to the pole they are denser, and seen from above they are an even spiral over the unit disc. Weights are
    solid angle times cosine, pi in all.

    Source: Vogel, A better way to construct the sunflower head, 1979, for the disc.

    >>> from renderer.studies import cosine_hemisphere
    >>> (cosine_hemisphere(2).directions[:, 2] ** 2).round(12)
    array([0.25, 0.75])
    """
    count = check_count("count", count)
    height = np.sqrt((np.arange(count) + 0.5) / count)
    return Pattern(_spiral(height), np.full(count, np.pi / count))


def turned(directions: Floats, pole: Floats) -> Floats:
    """Directions (k, 3) about +z, turned so that z goes to ``pole`` (3,), which is not zero; a new array.

    Nothing is computed where z is there already. The turn about the pole depends on the pole alone.
    """
    z = pole / np.abs(pole).max()
    z = z / np.linalg.norm(z)
    if (z == (0.0, 0.0, 1.0)).all():
        return directions.copy()
    x = np.cross(np.eye(3)[np.abs(z).argmin()], z)
    x /= np.linalg.norm(x)
    y = np.cross(z, x)
    return directions[:, :1] * x + directions[:, 1:2] * y + directions[:, 2:] * z


def check_count(argument: str, count: Any) -> int:
    """``count``, a number of directions. Raises ``ValueError`` that names the argument for what is none."""
    return count_argument(argument, count, 1, MOST)


def _spiral(height: Floats) -> Floats:
    """Unit vectors (n, 3) of these heights, each turned by the golden angle against the one before."""
    turn = 2.0 * np.pi * np.modf(np.arange(len(height)) * _GOLDEN)[0]
    level = np.sqrt((1.0 - height) * (1.0 + height))
    return np.stack([level * np.sin(turn), level * np.cos(turn), height], axis=1)


def _turns(count: int) -> tuple[Floats, Floats]:
    """Sines and cosines of ``count`` equal parts of a turn: exact at quarters, and with the symmetries of the circle.

    Otherwise a direction along a wall would point a little into it.
    """
    quarter, rest = np.divmod(4 * np.arange(count), count)
    mirrored = 2 * rest > count
    angle = np.pi / 2.0 * (np.where(mirrored, count - rest, rest) / count)
    sine = np.sin(angle)
    cosine = np.where(2 * rest == count, sine, np.cos(angle))
    sine, cosine = np.where(mirrored, cosine, sine), np.where(mirrored, sine, cosine)
    turned = [(sine, cosine), (cosine, -sine), (-sine, -cosine), (-cosine, sine)]
    return np.choose(quarter, [s for s, _ in turned]) + 0.0, np.choose(quarter, [c for _, c in turned]) + 0.0

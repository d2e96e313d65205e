"""Patterns of directions that cover a hemisphere or sphere, each direction with its solid angle.

Nothing is random. Hemispheres are about +z; azimuths run clockwise from +y, as on a compass with x east and y north.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.counts import count_argument
from renderer.arguments.points import check_points
from renderer.arguments.types import ArrayLike
from renderer.errors import expect

Floats = NDArray[np.float64]

# The patches in each row of Tregenza's sky, from the horizon up; one more is the zenith's.
_TREGENZA = (30, 30, 24, 24, 18, 12, 6)
# The golden ratio less one: each direction is turned by so much of a turn against the one before.
_GOLDEN = (5.0**0.5 - 1.0) / 2.0
# So many that float64 places each of them: the fraction of i * _GOLDEN loses a digit where i gains one.
MOST = 1 << 24


class Pattern(NamedTuple):
    """Directions, and the weight of each.

    Parameters
    ----------
    directions : ndarray of float64, shape (k, 3)
        Unit vectors. Those of a hemisphere are about +z.
    weights : ndarray of float64, shape (k,)
        Numbers >= 0: solid angles in steradians. Those of `cosine_hemisphere` are multiplied by the cosine.

    See Also
    --------
    tregenza, reinhart, fibonacci_hemisphere, fibonacci_sphere, cosine_hemisphere

    Examples
    --------
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

    def about(self, normals: ArrayLike) -> Floats:
        """The directions turned about each normal: +z of the pattern goes to the normal.

        Parameters
        ----------
        normals : array_like, shape (..., 3)
            Vectors of any length except 0.

        Returns
        -------
        ndarray of float64, shape (..., k, 3)
            The k directions of each normal, as unit vectors if those of the pattern are. The normal +z leaves them
            as they are. The turn about any other normal depends on that normal alone.

        Raises
        ------
        ValueError
            If a normal is not finite or is 0.

        Examples
        --------
        >>> from renderer.studies import fibonacci_hemisphere
        >>> directions = fibonacci_hemisphere(3).about([[0, 0, 1], [0, 0, -1]])
        >>> directions.shape, directions[:, :, 2].round(2).tolist()
        ((2, 3, 3), [[0.17, 0.5, 0.83], [-0.17, -0.5, -0.83]])
        """
        rows, shape = check_points("normals", normals)
        zero = ~rows.any(axis=1)
        if zero.any():
            expect(False, "normals", "vectors that are not zero", f"{rows[zero][0].tolist()} in row {zero.argmax()}")
        z = rows / np.abs(rows).max(axis=1, keepdims=True)
        z /= np.linalg.norm(z, axis=1, keepdims=True)
        x = np.cross(np.eye(3)[np.abs(z).argmin(axis=1)], z)
        x /= np.linalg.norm(x, axis=1, keepdims=True)
        y = np.cross(z, x)
        level = (z == (0.0, 0.0, 1.0)).all(axis=1)
        x[level], y[level] = np.eye(3)[:2]
        a, b, c = np.asarray(self.directions, np.float64).T[:, :, None]
        return (a * x[:, None] + b * y[:, None] + c * z[:, None]).reshape(*shape, len(self.directions), 3)


def tregenza() -> Pattern:
    """Tregenza's 145 patches of the sky: seven rows of 12 degrees, and a cap of 6 degrees around the zenith.

    Returns
    -------
    Pattern
        Directions to the centres of the patches, row by row from the horizon up. The first of each row points to +y.
        Weights are the solid angles of the patches; their sum is 2 pi.

    References
    ----------
    Tregenza, Subdivision of the sky hemisphere for luminance measurements, 1987.

    Examples
    --------
    >>> import numpy as np
    >>> from renderer.studies import tregenza
    >>> tregenza().directions.shape, round(float(tregenza().weights.sum() / np.pi), 12)
    ((145, 3), 2.0)
    """
    return reinhart(1)


def reinhart(subdivision: int = 2) -> Pattern:
    """Reinhart's finer sky "MF:m": each row of Tregenza's becomes m rows of m times as many patches.

    Parameters
    ----------
    subdivision : int, default 2
        m, from 1 to 64. There are 144 m^2 + 1 patches: 577 for m = 2.

    Returns
    -------
    Pattern
        As of `tregenza`. The 7 m rows are equally high, and the cap around the zenith is half as high: a row has
        90 / (7 m + 1/2) degrees.

    Raises
    ------
    ValueError
        If `subdivision` is not such a number.

    References
    ----------
    Bourgeois, Reinhart, Ward, A standard daylight coefficient model for dynamic daylighting simulations, 2008.

    Examples
    --------
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
    """Directions of equal solid angle over the hemisphere about +z, along a spiral from the horizon up.

    Parameters
    ----------
    count : int
        The number of directions, from 1 to 2^24.

    Returns
    -------
    Pattern
        All weights are 2 pi / `count`.

    Raises
    ------
    ValueError
        If `count` is not such a number.

    References
    ----------
    Swinbank, Purser, Fibonacci grids: a novel approach to global modelling, 2006.

    Examples
    --------
    >>> from renderer.studies import fibonacci_hemisphere
    >>> fibonacci_hemisphere(2).directions[:, 2]
    array([0.25, 0.75])
    """
    count = check_count("count", count)
    height = (np.arange(count) + 0.5) / count
    return Pattern(_spiral(height), np.full(count, 2.0 * np.pi / count))


def fibonacci_sphere(count: int) -> Pattern:
    """Directions of equal solid angle over the whole sphere, along a spiral from -z to +z.

    Parameters
    ----------
    count : int
        The number of directions, from 1 to 2^24.

    Returns
    -------
    Pattern
        All weights are 4 pi / `count`.

    Raises
    ------
    ValueError
        If `count` is not such a number.

    References
    ----------
    Swinbank, Purser, Fibonacci grids: a novel approach to global modelling, 2006.

    Examples
    --------
    >>> from renderer.studies import fibonacci_sphere
    >>> fibonacci_sphere(4).directions[:, 2]
    array([-0.75, -0.25,  0.25,  0.75])
    """
    count = check_count("count", count)
    height = (2.0 * np.arange(count) + 1.0 - count) / count
    return Pattern(_spiral(height), np.full(count, 4.0 * np.pi / count))


def cosine_hemisphere(count: int) -> Pattern:
    """Directions over the hemisphere about +z whose density is proportional to the cosine.

    Seen from above they are an even spiral over the unit disc.

    Parameters
    ----------
    count : int
        The number of directions, from 1 to 2^24.

    Returns
    -------
    Pattern
        All weights are pi / `count`: solid angle times cosine.

    Raises
    ------
    ValueError
        If `count` is not such a number.

    References
    ----------
    Vogel, A better way to construct the sunflower head, 1979, for the disc.

    Examples
    --------
    >>> from renderer.studies import cosine_hemisphere
    >>> (cosine_hemisphere(2).directions[:, 2] ** 2).round(12)
    array([0.25, 0.75])
    """
    count = check_count("count", count)
    height = np.sqrt((np.arange(count) + 0.5) / count)
    return Pattern(_spiral(height), np.full(count, np.pi / count))


def turned(directions: Floats, pole: Floats) -> Floats:
    """Directions (k, 3) about +z, turned so that z goes to ``pole`` (3,), which is not zero; a new array."""
    z = pole / np.abs(pole).max()
    z = z / np.linalg.norm(z)
    if (z == (0.0, 0.0, 1.0)).all():
        return directions.copy()
    x = np.cross(np.eye(3)[np.abs(z).argmin()], z)
    x /= np.linalg.norm(x)
    y = np.cross(z, x)
    return directions[:, :1] * x + directions[:, 1:2] * y + directions[:, 2:] * z


def check_count(argument: str, count: Any) -> int:
    """``count`` as a number of directions."""
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

"""Directions to the sun from its azimuth and elevation."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.arrays import real_argument
from renderer.arguments.types import ArrayLike
from renderer.errors import expect
from renderer.studies.pole import pole_of

Floats = NDArray[np.float64]

# The least sine of the angle between north and up: at a smaller one rounding, 2^-52, would turn the compass by more
# than 2^-26, which is 0.003 arc seconds.
_LEAST_ANGLE = 2.0**-26


def sun_directions(
    azimuth: ArrayLike,
    elevation: ArrayLike,
    *,
    north: Literal["x", "y", "z"] | ArrayLike | None = None,
    up: Literal["x", "y", "z"] | ArrayLike = "z",
) -> Floats:
    """Unit vectors to the sun, from its azimuth and elevation in degrees, as `sun_hours` takes them.

    Columns of pvlib's `get_solarposition` go straight in: ``azimuth`` with ``apparent_elevation`` or ``elevation``. So
    do ``azimuth`` and ``altitude`` of Ladybug's suns.

    Parameters
    ----------
    azimuth : array_like, shape (...)
        Clockwise from north as seen from above: 0 is north, 90 east, 180 south and 270 west. Any number of turns.
    elevation : array_like, shape (...)
        The angle above the level horizon, from -90 to 90; below 0 the sun is down. Azimuth and elevation are broadcast
        together.
    north : {"x", "y", "z"} or array_like, shape (3,), optional
        The direction of north in the coordinates of the mesh, of which the part across `up` counts. By default +y with
        x east; or -z where `up` is "y", as y up and x east have it.
    up : {"x", "y", "z"} or array_like, shape (3,), default "z"

    Returns
    -------
    ndarray of float64, shape (..., 3)
        From the points to the sun. Exact where both angles are multiples of 90 degrees and `north` and `up` are axes.

    Raises
    ------
    ValueError
        If an argument is not as above. The message names the argument and the row.

    Examples
    --------
    South of a wall, whose shade the point is in while the sun is in the north. The last sun is down.

    >>> from renderer import Octree
    >>> from renderer.mesh.shapes import box
    >>> from renderer.studies import sun_directions, sun_hours
    >>> suns = sun_directions([90.0, 180.0, 270.0, 0.0, 0.0], [0.0, 45.0, 30.0, 45.0, -20.0])
    >>> suns[:2].round(3)
    array([[ 1.   ,  0.   ,  0.   ],
           [ 0.   , -0.707,  0.707]])
    >>> octree = Octree.from_mesh(box((-9, 1, 0), (9, 2, 9)))
    >>> sun_hours(octree, [[0, 0, 0]], None, suns, [1.0, 2.0, 4.0, 8.0, 16.0], up="z")
    array([6.])
    """
    east, ahead, top = _compass(north, up)
    turns, heights = real_argument("azimuth", azimuth), real_argument("elevation", elevation)
    try:
        shape = np.broadcast_shapes(turns.shape, heights.shape)
    except ValueError:
        shape = turns.shape
        expect(False, "elevation", f"a shape that goes with that of azimuth, {shape}", f"shape {heights.shape}")
    _expect_all("azimuth", turns, np.isfinite(turns), "finite numbers, in degrees")
    _expect_all("elevation", heights, np.abs(heights) <= 90.0, "degrees from -90 to 90")
    (sine, cosine), (height, level) = _sine_and_cosine(turns), _sine_and_cosine(heights)
    parts = (level * sine, east), (level * cosine, ahead), (np.broadcast_to(height, shape), top)
    # Adding 0.0 makes no vector have -0.0.
    return sum((part[..., None] * axis for part, axis in parts), start=np.zeros((*shape, 3)))


def _compass(north: str | ArrayLike | None, up: str | ArrayLike) -> tuple[Floats, Floats, Floats]:
    """Unit vectors to the east, north and up."""
    top = _unit(pole_of(up))
    if north is None:
        north = [0.0, 0.0, -1.0] if isinstance(up, str) and up == "y" else [0.0, 1.0, 0.0]
    given = _unit(pole_of(north, "north"))
    across = given - (given @ top) * top
    angle = float(np.linalg.norm(across))
    expect(angle >= _LEAST_ANGLE, "north", f"a direction across up, {top.tolist()}", f"{given.tolist()}")
    ahead = across / angle
    return np.cross(ahead, top), ahead, top


def _unit(vector: Floats) -> Floats:
    scaled = vector / np.abs(vector).max()
    unit: Floats = scaled / np.linalg.norm(scaled)
    return unit


def _sine_and_cosine(degrees: NDArray[np.generic]) -> tuple[Floats, Floats]:
    """Sine and cosine of angles in degrees, exact at multiples of 90: computed from the nearest of these."""
    rest = np.fmod(np.asarray(degrees, np.float64), 360.0)
    quarter = np.rint(rest / 90.0)
    # Both steps are exact (Sterbenz's lemma).
    angle = np.radians(rest - 90.0 * quarter)
    sine, cosine, turn = np.sin(angle), np.cos(angle), quarter.astype(np.int64) % 4
    return np.choose(turn, [sine, cosine, -sine, -cosine]), np.choose(turn, [cosine, -sine, -cosine, sine])


def _expect_all(argument: str, values: NDArray[np.generic], good: NDArray[np.bool_], expected: str) -> None:
    if not good.all():
        row = int((~good).argmax())
        expect(False, argument, expected, f"{values.reshape(-1)[row]} in row {row}")

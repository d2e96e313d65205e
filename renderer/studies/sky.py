"""The share of the sky that points see, and the hours of sun."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.counts import count_argument
from renderer.arguments.types import ArrayLike
from renderer.errors import expect
from renderer.queryable import Queries
from renderer.rayscene.scene import RayScene
from renderer.studies.directions import MOST, Pattern, fibonacci_hemisphere, reinhart, tregenza, turned
from renderer.studies.pole import pole_of
from renderer.studies.share import (
    check_directions,
    check_reach,
    check_request,
    check_weights,
    evaluate,
    lengths_of,
    limits_of,
)
from renderer.studies.sweep import Sky

Floats = NDArray[np.float64]

_DEFINITIONS = ("cosine", "geometric")


def sky_view_factor(
    octree: Queries | RayScene,
    points: ArrayLike,
    normals: ArrayLike | None = None,
    *,
    patches: int | Pattern = 145,
    definition: Literal["cosine", "geometric"] = "cosine",
    up: Literal["x", "y", "z"] | ArrayLike = "z",
    leaving: ArrayLike | None = None,
    max_distance: float = np.inf,
    transmittance: ArrayLike | None = None,
    threads: int | None = None,
    progress: bool = False,
    distance: float | None = None,
) -> Floats:
    """The sky view factor of each point, from 0 to 1.

    The sky is the hemisphere about `up`. A direction of it is open if it lies above the horizon of the point, d . n > 0
    for the unit normal n, and if its ray hits nothing. With `transmittance` it is open by the share of its ray that is
    left.

    Parameters
    ----------
    octree : Octree, BruteForce or RayScene
    points : array_like, shape (..., 3)
    normals : array_like, shape (..., 3) or (3,), optional
        As for `occlusion`. By default `up`, the normal of level ground.
    patches : int or Pattern, default 145
        How the sky is divided. 145: Tregenza's patches. 577: Reinhart's MF:2. Any other number up to 2^24: as many
        directions of equal solid angle, see `fibonacci_hemisphere`. Or a `Pattern` about +z, all of it with z > 0.
    definition : {"cosine", "geometric"}, default "cosine"
        "cosine": the share of the light of an even sky that falls on the plane of the point, 1/pi times the integral
        of d . n over the open directions d. It is 1 for a level point in the open, and (1 + cos b) / 2 for one tilted
        by b. "geometric": the share of the solid angle of the sky that is open, 1/(2 pi) times the integral of 1.
    up : {"x", "y", "z"} or array_like, shape (3,), default "z"
        The axis or direction that points up, to the middle of the sky.
    leaving : array_like of int, shape (...), optional
    max_distance : float, default inf
    transmittance : array_like, shape (F,), optional
    threads : int, optional
    progress : bool, default False
        As for `occlusion`.
    distance : float, optional
        The former name of `max_distance`.

    Returns
    -------
    ndarray of float64, shape (...)

    Raises
    ------
    ValueError
        If an argument is not as above. The message names the argument and the row.

    Notes
    -----
    One ray to its middle decides whether a patch is open. The result is the sum over the open patches divided by the
    sum over all. For "cosine" each patch counts its weight times abs(d . n) in both sums, as the patches and their
    opposites cover the sphere. So a level point in the open has 1 whatever the patches.

    References
    ----------
    Johnson, Watson, The determination of view-factors in urban canyons, 1984.

    Oke, Boundary Layer Climates, 1987.

    Examples
    --------
    >>> from renderer import Octree
    >>> from renderer.mesh.shapes import box
    >>> from renderer.studies import sky_view_factor
    >>> octree = Octree.from_mesh(box((0, -500, 0), (1, 500, 500)))
    >>> sky_view_factor(octree, [[9.0, 0, 900], [1.001, 0, 0.001]], patches=10000).round(2)
    array([1. , 0.5])

    Under an awning that lets a quarter of the light through.

    >>> awning = Octree.from_mesh(box((-900, -900, 2), (900, 900, 3)))
    >>> cloth = [0.5] * 12  # above and below
    >>> sky_view_factor(awning, [[0, 0, 0]], transmittance=cloth).round(4)
    array([0.25])
    """
    _expect_definition(definition)
    pole = pole_of(up)
    normals = pole if normals is None else normals
    request = check_request(octree, points, normals, leaving, threads, progress, transmittance)
    pattern = _patches(patches)
    directions = turned(pattern.directions, pole)
    # rule: cosine-of-patches
    cosine = definition == "cosine"
    values = pattern.weights / lengths_of(directions) if cosine else pattern.weights
    sky = Sky(directions, values, limits_of(check_reach(max_distance, distance), directions), False, cosine)
    return evaluate(request, sky, hidden=False, share=True)


def sun_hours(
    octree: Queries | RayScene,
    points: ArrayLike,
    normals: ArrayLike | None,
    sun_directions: ArrayLike,
    weights: ArrayLike | None = None,
    *,
    up: Literal["x", "y", "z"] | ArrayLike | None = None,
    leaving: ArrayLike | None = None,
    max_distance: float = np.inf,
    transmittance: ArrayLike | None = None,
    threads: int | None = None,
    progress: bool = False,
    distance: float | None = None,
) -> Floats:
    """The hours for which each point sees the sun: the sum of the weights of the sun positions that it sees.

    A point does not see a sun at or below its own horizon, nor one that the mesh hides. With `transmittance` the hours
    of a sun count by the share of its ray that is left.

    Parameters
    ----------
    octree : Octree, BruteForce or RayScene
    points : array_like, shape (..., 3)
    normals : array_like, shape (..., 3) or (3,), or None
        As for `occlusion`.
    sun_directions : array_like, shape (k, 3)
        From the points to the sun, in the coordinates of the mesh, one for each step of time, such as those of
        `sun_directions` from azimuth and elevation.
    weights : array_like, shape (k,), optional
        The hours of each step, >= 0. By default 1 each.
    up : {"x", "y", "z"} or array_like, shape (3,), optional
        The axis or direction that points up: suns at or below the level horizon then count nothing. By default they
        count like all others, and light walls from below where the mesh has no ground.
    leaving : array_like of int, shape (...), optional
    max_distance : float, default inf
    transmittance : array_like, shape (F,), optional
    threads : int, optional
    progress : bool, default False
        As for `occlusion`.
    distance : float, optional
        The former name of `max_distance`.

    Returns
    -------
    ndarray of float64, shape (...)
        In the unit of `weights`.

    Raises
    ------
    ValueError
        If an argument is not as above. The message names the argument and the row.

    Examples
    --------
    West of a wall, which hides the sun of the morning; the last sun is that of the night.

    >>> from renderer import Octree
    >>> from renderer.mesh.shapes import box
    >>> from renderer.studies import sun_hours
    >>> octree = Octree.from_mesh(box((0, -9, 0), (1, 9, 9)))
    >>> suns = [[1, 0, 1], [0, -1, 2], [-1, 0, 1], [0, 1, -2]]
    >>> sun_hours(octree, [[-2, 0, 0]], None, suns, [3.0, 4.0, 3.5, 13.5], up="z")
    array([7.5])
    """
    request = check_request(octree, points, normals, leaving, threads, progress, transmittance)
    suns = check_directions("sun_directions", sun_directions)
    hours = check_weights("weights", weights, len(suns))
    reach = check_reach(max_distance, distance)
    if up is not None:
        day = _scaled(suns) @ _scaled(pole_of(up)) > 0.0
        if not day.any():
            return np.zeros(request.shape)
        suns, hours = suns[day], hours[day]
    sky = Sky(suns, hours, limits_of(reach, suns), False, False)
    return evaluate(request, sky, hidden=False, share=False)


def _expect_definition(definition: str) -> None:
    known = isinstance(definition, str) and definition in _DEFINITIONS
    expect(known, "definition", f"one of {list(_DEFINITIONS)}", repr(definition))


def _scaled(vectors: Floats) -> Floats:
    """Vectors (..., 3) whose largest component is 1, so that products do not overflow."""
    return vectors / np.abs(vectors).max(axis=-1, keepdims=True)


def _patches(patches: int | Pattern) -> Pattern:
    """The patches of a sky about +z, by their number, or given, which are checked."""
    if isinstance(patches, Pattern):
        directions = check_directions("patches", patches.directions)
        below = ~(directions[:, 2] > 0.0)
        if below.any():
            row = int(below.argmax())
            expect(False, "patches", "directions above the horizon, z > 0", f"{directions[row].tolist()} in row {row}")
        weights = check_weights("patches", patches.weights, len(directions))
        expect(bool(weights.any()), "patches", "a weight that is not 0", "all 0")
        return Pattern(directions, weights)
    patches = count_argument("patches", patches, 1, MOST, ", or a Pattern")
    if patches in (145, 577):
        return tregenza() if patches == 145 else reinhart(2)
    return fibonacci_hemisphere(patches)

"""How much of the sky points see, and for how long the sun."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer.arguments.counts import count_argument
from renderer.errors import expect
from renderer.queryable import Queries
from renderer.studies.directions import MOST, Pattern, fibonacci_hemisphere, reinhart, tregenza, turned
from renderer.studies.share import (
    check_directions,
    check_request,
    check_weights,
    evaluate,
    lengths_of,
    limits_of,
)
from renderer.studies.sweep import Sky

Floats = NDArray[np.float64]

_DEFINITIONS = ("cosine", "geometric")
_UP = (0.0, 0.0, 1.0)


def sky_view_factor(
    octree: Queries,
    points: ArrayLike,
    normals: ArrayLike | None = None,
    *,
    patches: int | Pattern = 145,
    definition: Literal["cosine", "geometric"] = "cosine",
    up: ArrayLike = _UP,
    leaving: ArrayLike | None = None,
    distance: float = np.inf,
    threads: int | None = None,
    progress: bool = False,
) -> Floats:
    """The sky view factor of each point, (...) float64 from 0 to 1.

    The sky is the hemisphere of directions above the plane across ``up``; a direction of it is open where it is above
    the plane across the point's normal n, too, and its ray hits nothing.

    definition  "cosine": the share of the light of an even sky that falls on the point's own plane, 1/pi times the
                integral of d . n over the open directions d: 1 for a level point in the open, (1 + cos b) / 2 for one
                tilted by b. This is the view factor of radiation (Johnson and Watson, Oke)
                "geometric": the share of the sky's solid angle that is open, 1/(2 pi) times the integral of 1
    patches     145: Tregenza's; 577: Reinhart's MF:2; any other number: as many directions of equal solid angle,
                ``directions.fibonacci_hemisphere``; or a ``directions.Pattern`` of directions about +z, all with z > 0
    up          (3,), to the middle of the sky; +z of the patches goes there
    normals     as for ``occlusion``; None: ``up``, as of the level ground

    ``points``, ``leaving``, ``distance``, ``threads`` and ``progress`` as for ``occlusion``. Each patch is open or not
    as one ray to its middle says. Sums over open patches are divided by sums over all: for "cosine" of weight times
    |d . n|, as the patches and their opposites cover the sphere. So rounding apart a level point in the open has 1
    whatever the patches, and a wall 1/2 by "cosine" with Tregenza's or Reinhart's, which come in opposite pairs.
    Raises ``ValueError`` naming argument and row.

    Sources: Johnson, Watson, The determination of view-factors in urban canyons, 1984; Oke, Boundary Layer Climates,
    1987.

    >>> from renderer import Octree
    >>> from renderer.mesh.shapes import box
    >>> from renderer.studies import sky_view_factor
    >>> octree = Octree.from_mesh(box((0, -500, 0), (1, 500, 500)))
    >>> sky_view_factor(octree, [[9, 0, 900], [1.001, 0, 0.001]], patches=10000).round(2)
    array([1. , 0.5])
    """
    _expect_definition(definition)
    pole = _pole(up)
    request = check_request(octree, points, pole if normals is None else normals, leaving, threads, progress)
    pattern = _patches(patches)
    directions = turned(pattern.directions, pole)
    # rule: cosine-of-patches
    cosine = definition == "cosine"
    values = pattern.weights / lengths_of(directions) if cosine else pattern.weights
    sky = Sky(directions, values, limits_of(distance, directions), False, cosine)
    return evaluate(octree, request, sky, hidden=False, share=True)


def sun_hours(
    octree: Queries,
    points: ArrayLike,
    normals: ArrayLike | None,
    sun_directions: ArrayLike,
    weights: ArrayLike | None = None,
    *,
    leaving: ArrayLike | None = None,
    distance: float = np.inf,
    threads: int | None = None,
    progress: bool = False,
) -> Floats:
    """The hours for which each point sees the sun, (...) float64: the sum of the weights of the suns that it sees.

    sun_directions  (k, 3), from the points to the sun, as a library of sun positions gives them
    weights         (k,) >= 0, the hours that each direction stands for; None: 1 each

    A sun at or below the point's own horizon is not seen, nor is one that the mesh hides; see ``occlusion`` for this
    and the other arguments. A sun below the level ground is hidden by the ground only if the mesh has one, or the
    normals are level: leave it out. Sums are in the order of directions. Raises ``ValueError`` naming argument and row.

    >>> from renderer import Octree
    >>> from renderer.mesh.shapes import box
    >>> from renderer.studies import sun_hours
    >>> octree = Octree.from_mesh(box((0, -9, 0), (1, 9, 9)))
    >>> suns = [[-1, 0, 1], [0, -1, 2], [1, 0, 1]]  # morning, noon, evening; west of a wall
    >>> sun_hours(octree, [[2, 0, 0]], [0, 0, 1], suns, [3.0, 4.0, 3.5])
    array([7.5])
    """
    request = check_request(octree, points, normals, leaving, threads, progress)
    suns = check_directions("sun_directions", sun_directions)
    hours = check_weights("weights", weights, len(suns))
    sky = Sky(suns, hours, limits_of(distance, suns), False, False)
    return evaluate(octree, request, sky, hidden=False, share=False)


def _expect_definition(definition: str) -> None:
    known = isinstance(definition, str) and definition in _DEFINITIONS
    expect(known, "definition", f"one of {list(_DEFINITIONS)}", repr(definition))


def _pole(up: ArrayLike) -> Floats:
    """The direction of the middle of the sky."""
    rows = check_directions("up", np.reshape(up, (1, -1)) if np.ndim(up) == 1 else up)
    expect(len(rows) == 1, "up", "shape (3,)", f"shape {rows.shape}")
    return rows[0]


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

"""Ambient occlusion and openness of points."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.types import ArrayLike
from renderer.errors import expect
from renderer.queryable import Queries
from renderer.rayscene.scene import RayScene
from renderer.studies.directions import Pattern, check_count, cosine_hemisphere, fibonacci_sphere
from renderer.studies.share import StudyRequest, check_reach, check_request, evaluate, limits_of
from renderer.studies.sweep import Sky

Floats = NDArray[np.float64]


def ambient_occlusion(
    octree: Queries | RayScene,
    points: ArrayLike,
    normals: ArrayLike,
    *,
    samples: int = 256,
    max_distance: float = np.inf,
    transmittance: ArrayLike | None = None,
    leaving: ArrayLike | None = None,
    threads: int | None = None,
    progress: bool = False,
    distance: float | None = None,
) -> Floats:
    """The share of even light from all sides that reaches the plane of each point: 1 in the open, 0 shut in.

    Ambient light is multiplied by this factor. Some call 1 minus it the occlusion.

    Parameters
    ----------
    octree : Octree, BruteForce or RayScene
    points : array_like, shape (..., 3)
    normals : array_like, shape (..., 3) or (3,)
        As for `occlusion`, but not None.
    samples : int, default 256
        The number of directions, from 1 to 2^24: those of `cosine_hemisphere`, turned about each normal.
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
        1/pi times the integral of d . n over the open directions d of the hemisphere about the normal n. It is a whole
        number of samples over `samples`. With `transmittance` a direction is open by the share of its ray that is left.

    Raises
    ------
    ValueError
        If an argument is not as above.

    Notes
    -----
    Nothing is random. All points of one normal look in the same directions, so errors over a wall are smooth.

    Examples
    --------
    >>> from renderer import Octree
    >>> from renderer.mesh.shapes import box
    >>> from renderer.studies import ambient_occlusion
    >>> octree = Octree.from_mesh(box((0, -500, 0), (1, 500, 500)))
    >>> ambient_occlusion(octree, [[9.0, 0, 900], [1.001, 0, 0.001]], [0, 0, 1], samples=10000).round(2)
    array([1. , 0.5])
    """
    expect(normals is not None, "normals", "vectors", "None")
    request = check_request(octree, points, normals, leaving, threads, progress, transmittance)
    check_count("samples", samples)
    reach = check_reach(max_distance, distance)
    return _open_share(request, cosine_hemisphere(samples), reach, turned=True)


def openness(
    octree: Queries | RayScene,
    points: ArrayLike,
    *,
    samples: int = 1024,
    max_distance: float = np.inf,
    transmittance: ArrayLike | None = None,
    leaving: ArrayLike | None = None,
    threads: int | None = None,
    progress: bool = False,
    distance: float | None = None,
) -> Floats:
    """The share of all directions around each point in which nothing is hit: the open solid angle over 4 pi.

    Parameters
    ----------
    octree : Octree, BruteForce or RayScene
    points : array_like, shape (..., 3)
        A point on the surface sees out through the faces that hold it.
    samples : int, default 1024
        The number of directions, from 1 to 2^24, of equal solid angle: those of `fibonacci_sphere`.
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
        1 far from everything, 1/2 just above level ground, 0 inside a closed mesh. With `transmittance` a direction
        counts by the share of its ray that is left.

    Raises
    ------
    ValueError
        If an argument is not as above.

    Notes
    -----
    This is a solid angle. The topographic openness of terrain, a mean of horizon angles, is something else.

    Examples
    --------
    >>> from renderer import Octree
    >>> from renderer.mesh.shapes import box
    >>> from renderer.studies import openness
    >>> octree = Octree.from_mesh(box())
    >>> openness(octree, [[0.5, 0.5, 0.5], [0.5, 0.5, 1.0001], [0.5, 0.5, 1000]], samples=100)
    array([0. , 0.5, 1. ])
    """
    request = check_request(octree, points, None, leaving, threads, progress, transmittance)
    check_count("samples", samples)
    return _open_share(request, fibonacci_sphere(samples), check_reach(max_distance, distance), turned=False)


def _open_share(request: StudyRequest, pattern: Pattern, reach: float, *, turned: bool) -> Floats:
    """The share of a pattern's directions that is open."""
    directions = pattern.directions
    sky = Sky(directions, np.ones(len(directions)), limits_of(reach, directions), turned, False)
    return evaluate(request, sky, hidden=False, share=True)

"""How open points lie: to the light that comes from everywhere, and to all sides."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer.errors import expect
from renderer.queryable import Queries
from renderer.studies.directions import Pattern, check_count, cosine_hemisphere, fibonacci_sphere
from renderer.studies.share import StudyRequest, check_request, evaluate, limits_of
from renderer.studies.sweep import Sky

Floats = NDArray[np.float64]


def ambient_occlusion(
    octree: Queries,
    points: ArrayLike,
    normals: ArrayLike,
    *,
    samples: int = 256,
    distance: float = np.inf,
    leaving: ArrayLike | None = None,
    threads: int | None = None,
    progress: bool = False,
) -> Floats:
    """The share of even light from all sides that reaches each point's plane, (...) float64: 1 in the open, 0 shut in.

    So it is the factor that ambient light is multiplied by, 1/pi times the integral of d . n over the open directions d
    of the hemisphere about the point's normal n. Some call 1 less this the occlusion.

    samples   directions, 1 to 2^24: those of ``directions.cosine_hemisphere``, about each point's normal. They are the
              same for all points of one normal, so errors are smooth over a wall, not noise, and nothing is random
    distance  how far the mesh hides, in scene units

    ``points``, ``leaving``, ``threads`` and ``progress`` as for ``occlusion``, ``normals`` too, but not None. The share
    is a whole number of samples over all of them. Raises ``ValueError`` naming argument and row.

    >>> from renderer import Octree
    >>> from renderer.mesh.shapes import box
    >>> from renderer.studies import ambient_occlusion
    >>> octree = Octree.from_mesh(box((0, -500, 0), (1, 500, 500)))
    >>> ambient_occlusion(octree, [[9, 0, 900], [1.001, 0, 0.001]], [0, 0, 1], samples=10000).round(2)
    array([1. , 0.5])
    """
    expect(normals is not None, "normals", "vectors", "None")
    request = check_request(octree, points, normals, leaving, threads, progress)
    check_count("samples", samples)
    return _open_share(octree, request, cosine_hemisphere(samples), distance, turned=True)


def openness(
    octree: Queries,
    points: ArrayLike,
    *,
    samples: int = 1024,
    distance: float = np.inf,
    leaving: ArrayLike | None = None,
    threads: int | None = None,
    progress: bool = False,
) -> Floats:
    """The share of all directions around each point in which it sees out, (...) float64: the solid angle over 4 pi.

    It is 1 far from everything, 1/2 just above level ground, and 0 inside a closed mesh. A point on the surface sees
    out through the faces that hold it. This is no mean of horizon angles, as the topographic openness of terrain is.

    samples   directions, 1 to 2^24, of equal solid angle: those of ``directions.fibonacci_sphere``
    distance  how far the mesh hides, in scene units: nothing within it counts as open

    ``points``, ``leaving``, ``threads`` and ``progress`` as for ``occlusion``. Raises ``ValueError`` naming argument
    and row.

    >>> from renderer import Octree
    >>> from renderer.mesh.shapes import box
    >>> from renderer.studies import openness
    >>> octree = Octree.from_mesh(box())
    >>> openness(octree, [[0.5, 0.5, 0.5], [0.5, 0.5, 1.0001], [0.5, 0.5, 1000]], samples=100)
    array([0. , 0.5, 1. ])
    """
    request = check_request(octree, points, None, leaving, threads, progress)
    check_count("samples", samples)
    return _open_share(octree, request, fibonacci_sphere(samples), distance, turned=False)


def _open_share(octree: Queries, request: StudyRequest, pattern: Pattern, distance: float, *, turned: bool) -> Floats:
    """The share of a pattern's directions that is open."""
    directions = pattern.directions
    sky = Sky(directions, np.ones(len(directions)), limits_of(distance, directions), turned, False)
    return evaluate(octree, request, sky, hidden=False, share=True)

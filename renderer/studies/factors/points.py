"""View factors from points: what the plane of each sees of the surfaces of a scene."""

from __future__ import annotations

from typing import Literal

import numpy as np

from renderer.arguments.types import ArrayLike
from renderer.distance.on_surface import on_surface, places_of
from renderer.errors import expect
from renderer.queryable import Queries
from renderer.rayscene.scene import RayScene
from renderer.studies.factors.aim import senders_at
from renderer.studies.factors.assemble import warn_of_backs
from renderer.studies.factors.compute import check_effort
from renderer.studies.factors.result import PointFactors
from renderer.studies.factors.rows import Tracing, nothing_known
from renderer.studies.factors.sparse import scipy_sparse
from renderer.studies.factors.surfaces import check_surfaces
from renderer.studies.factors.tally import BACK, SKY
from renderer.studies.factors.work import AtOnce
from renderer.studies.share import check_request


def view_factors_from(
    octree: Queries | RayScene,
    points: ArrayLike,
    normals: ArrayLike,
    groups: ArrayLike | None = None,
    *,
    sides: Literal["front", "both"] = "front",
    transmittance: ArrayLike | None = None,
    rtol: float = 0.02,
    max_rays: int = 1 << 16,
    leaving: ArrayLike | None = None,
    threads: int | None = None,
    progress: bool = False,
) -> PointFactors:
    """View factors from the plane of each point to the faces of a scene, or to groups of them, and to the sky.

    For the mean radiant temperature of a person take the six directions of a cube as normals.

    Parameters
    ----------
    octree : Octree, BruteForce or RayScene
    points : array_like, shape (m, 3)
    normals : array_like, shape (m, 3) or (3,)
        As for `occlusion`, but not None.
    groups, sides, transmittance, rtol, max_rays
        As for `view_factors`.
    leaving : array_like of int, shape (m,), optional
    threads : int, optional
    progress : bool, default False
        As for `occlusion`.

    Returns
    -------
    PointFactors

    Raises
    ------
    ValueError
        If an argument is not as above. The message names the argument and the row.
    ImportError
        If SciPy is not installed.

    Warns
    -----
    UserWarning
        If a point sees backs of faces.

    Examples
    --------
    The middle of a room's floor sees a fifth of a wall and more of the ceiling.

    >>> from renderer import Octree
    >>> from renderer.mesh.shapes import box
    >>> from renderer.studies import view_factors_from
    >>> room = box()
    >>> octree = Octree(room.vertices, room.faces[:, ::-1])
    >>> walls = [0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5]
    >>> factors = view_factors_from(octree, [[0.5, 0.5, 0.0]], [0, 0, 1], walls, rtol=0.002)
    >>> factors.matrix.toarray().round(2)
    array([[0.19, 0.19, 0.19, 0.19, 0.  , 0.24]])
    """
    sparse = scipy_sparse()
    expect(normals is not None, "normals", "vectors", "None")
    request = check_request(octree, points, normals, leaving, threads, progress)
    expect(len(request.shape) == 1, "points", "shape (m, 3)", f"shape {(*request.shape, 3)}")
    mesh, tree = request.octree._built
    surfaces = check_surfaces(request.octree, groups, sides, transmittance)
    effort = check_effort(rtol, max_rays)
    places = request.places
    found = on_surface(tree, mesh, places.points, places.leaving, request.threads)
    planes = np.broadcast_to(places.normals, places.points.shape)
    senders = senders_at(found, places_of(mesh, places.points, found), planes, mesh)
    count, number = len(places.points), surfaces.number
    tracing = Tracing(request.octree._built, surfaces, senders, *effort, request.threads, request.progress)
    hits = AtOnce().rows("points", tracing, np.arange(count), nothing_known(count))
    inner = hits.targets < number
    where = (hits.rows[inner], hits.targets[inner])
    matrix = sparse.csr_array((hits.counts[inner] / hits.rays[where[0]], where), shape=(count, number))
    errors = sparse.csr_array((hits.errors[inner], where), shape=(count, number))
    backs = hits.share(number + BACK)
    warn_of_backs(backs)
    return PointFactors(matrix, hits.share(number + SKY), backs, errors, hits.rays)

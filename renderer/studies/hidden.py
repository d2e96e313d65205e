"""Directions that are hidden from points: by the mesh, or by the points' own horizons."""

from __future__ import annotations

from typing import Literal, overload

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.arrays import flag_argument
from renderer.arguments.types import ArrayLike
from renderer.errors import expect
from renderer.queryable import Queries
from renderer.rayscene.scene import RayScene
from renderer.studies.share import (
    check_directions,
    check_reach,
    check_request,
    check_weights,
    evaluate,
    evaluate_bits,
    limits_of,
)
from renderer.studies.sweep import Sky


@overload
def occlusion(
    octree: Queries | RayScene,
    points: ArrayLike,
    normals: ArrayLike | None,
    directions: ArrayLike,
    *,
    weights: ArrayLike | None = None,
    leaving: ArrayLike | None = None,
    packed: Literal[False] = False,
    max_distance: float = np.inf,
    transmittance: ArrayLike | None = None,
    threads: int | None = None,
    progress: bool = False,
    distance: float | None = None,
) -> NDArray[np.float64]: ...


@overload
def occlusion(
    octree: Queries | RayScene,
    points: ArrayLike,
    normals: ArrayLike | None,
    directions: ArrayLike,
    *,
    weights: ArrayLike | None = None,
    leaving: ArrayLike | None = None,
    packed: Literal[True],
    max_distance: float = np.inf,
    transmittance: ArrayLike | None = None,
    threads: int | None = None,
    progress: bool = False,
    distance: float | None = None,
) -> NDArray[np.uint8]: ...


@overload
def occlusion(
    octree: Queries | RayScene,
    points: ArrayLike,
    normals: ArrayLike | None,
    directions: ArrayLike,
    *,
    weights: ArrayLike | None = None,
    leaving: ArrayLike | None = None,
    packed: bool = False,
    max_distance: float = np.inf,
    transmittance: ArrayLike | None = None,
    threads: int | None = None,
    progress: bool = False,
    distance: float | None = None,
) -> NDArray[np.float64] | NDArray[np.uint8]: ...


def occlusion(
    octree: Queries | RayScene,
    points: ArrayLike,
    normals: ArrayLike | None,
    directions: ArrayLike,
    *,
    weights: ArrayLike | None = None,
    leaving: ArrayLike | None = None,
    packed: bool = False,
    max_distance: float = np.inf,
    transmittance: ArrayLike | None = None,
    threads: int | None = None,
    progress: bool = False,
    distance: float | None = None,
) -> NDArray[np.float64] | NDArray[np.uint8]:
    """The share of directions that is HIDDEN from each point, or one bit for each point and direction.

    A direction d is hidden if it lies at or below the horizon of the point, d . n <= 0 for the unit normal n, or if a
    ray in this direction hits the mesh. With `transmittance` the faces hide a part of it.

    Parameters
    ----------
    octree : Octree, BruteForce or RayScene
        A scene is searched as its ``merged`` mesh, whose memory grows with the copies.
    points : array_like, shape (..., 3)
        Finite; on the surface or not.
    normals : array_like, shape (..., 3) or (3,), or None
        One for each point or one for all, of any length except 0. None: no point has a horizon.
    directions : array_like, shape (k, 3)
        The same for all points, of any length that rays may have.
    weights : array_like, shape (k,), optional
        How much each direction counts: numbers >= 0, not all 0. By default all count the same.
    leaving : array_like of int, shape (...) or scalar, optional
        The face that each point lies on; -1 where it is not known, which is the default. See Notes.
    packed : bool, default False
        Return bits, not shares. There are no `weights` then.
    max_distance : float, default inf
        How far from a point a hit still counts, in scene units.
    transmittance : array_like, shape (F,), optional
        The share of a ray that each face lets through, from 0 to 1: 0 hides all, as every face does by default, and 1
        hides nothing. What is left of a ray is the product of the shares of all faces that it crosses. So are trees,
        shades and screens. There are no bits of it, so `packed` is an error then.
    threads : int, optional
        By default those of the octree.
    progress : bool, default False
        Show a bar on standard error if that is a terminal.
    distance : float, optional
        The former name of `max_distance`.

    Returns
    -------
    ndarray of float64, shape (...)
        The weights of the hidden directions over all weights: exactly 0 if all is open, exactly 1 if all is hidden.
        With `transmittance` a direction counts by the share of its ray that is lost.
    ndarray of uint8, shape (..., ceil(k / 8))
        If `packed`: a set bit for each hidden direction, in the order of ``numpy.unpackbits(..., axis=-1, count=k)``.

    Raises
    ------
    ValueError
        If an argument is not as above. The message names the argument and the row.

    Notes
    -----
    Points on the surface need no epsilon. A point is on the surface if it is within 32 roundings of float64 of its
    largest coordinate, or, if float32 holds all its coordinates, within 8 of its own roundings to float32. A point
    that is farther off, up to the error of float32, lies on the face that `leaving` names. Rays start at the nearest
    point of the face. A point as near to an edge or corner is on it, and so on all faces that meet there; for queries
    with `leaving` it is where its coordinates say.

    The normal says on which side of its faces a point lies: directions that lead through them to the other side are
    hidden. Without a normal the faces that hold the point hide nothing.

    A ray through an edge or corner crosses one of the faces that meet there. A ray that starts on a translucent face
    keeps all of it, unless it leads through that face to the other side. The mesh is divided into opaque and
    translucent faces, each with a tree, which are kept with the octree for the next study with the same numbers.

    The bits of a point depend neither on the threads nor on the other points. Memory is that of the points and of the
    result: rays are never written down.

    Examples
    --------
    >>> import numpy as np
    >>> from renderer import Octree
    >>> from renderer.mesh.shapes import box
    >>> from renderer.studies import occlusion
    >>> octree = Octree.from_mesh(box((0, 0, 0), (1, 1, 1)))
    >>> around = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> occlusion(octree, [[3, 0.5, 0.25], [9.0, 9, 9]], None, around)
    array([0.25, 0.  ])
    >>> bits = occlusion(octree, [[3, 0.5, 0.25]], [0, 0, 1], around, packed=True)
    >>> np.unpackbits(bits, axis=-1, count=4)
    array([[1, 1, 1, 0]], dtype=uint8)

    A box of foil that lets half of the light through each side: a ray through the box crosses two.

    >>> foil = [0.5] * 12
    >>> occlusion(octree, [[3, 0.5, 0.25]], None, around, transmittance=foil)
    array([0.1875])
    """
    bits = flag_argument("packed", packed)
    expect(not bits or transmittance is None, "transmittance", "None with packed, as bits have no shares", "an array")
    request = check_request(octree, points, normals, leaving, threads, progress, transmittance)
    directions = check_directions("directions", directions)
    limits = limits_of(check_reach(max_distance, distance), directions)
    if bits:
        expect(weights is None, "weights", "None, as bits have none", "an array")
        return evaluate_bits(request, Sky(directions, np.ones(len(directions)), limits, False, False))
    values = check_weights("weights", weights, len(directions))
    expect(bool(values.any()), "weights", "one that is not 0", "all 0")
    return evaluate(request, Sky(directions, values, limits, False, False), hidden=True, share=True)

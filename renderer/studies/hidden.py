"""Which directions are hidden from points: by the mesh, or by the points' own horizons."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer.arguments.arrays import flag_argument
from renderer.errors import expect
from renderer.queryable import Queries
from renderer.studies.share import check_directions, check_request, check_weights, evaluate, evaluate_bits, limits_of
from renderer.studies.sweep import Sky


def occlusion(
    octree: Queries,
    points: ArrayLike,
    normals: ArrayLike | None,
    directions: ArrayLike,
    *,
    weights: ArrayLike | None = None,
    leaving: ArrayLike | None = None,
    packed: bool = False,
    distance: float = np.inf,
    threads: int | None = None,
    progress: bool = False,
) -> NDArray[np.float64] | NDArray[np.uint8]:
    """The share of directions that is HIDDEN from each point, (...) float64 from 0 to 1; or one bit for each of them.

    A direction d is hidden if it is at the point's horizon or below, d . n <= 0 as float64 computes it of the unit
    normal n, or if a ray in direction d hits the mesh, see ``octree.any_hit``.

    points      (..., 3), finite
    normals     (..., 3) as points, or one (3,) for all; not zero, of any length; None: no point has a horizon
    directions  (k, 3), the same for all points, of any length as those of rays
    weights     (k,) >= 0, not all 0: what each direction counts; None: all the same
    leaving     the face that each point lies on, (...) or one for all, -1 where that is not known; None: -1 for all. A
                point is then on the surface where it is as near as 32 roundings of float64 of its largest coordinate;
                or, if all its coordinates are numbers of float32, where each is as near as 8 of its own roundings to
                float32. Rays start at the point of the face that is nearest: no epsilon is needed. The normal says on
                which side of the faces there the point is: directions that lead through them to another side are
                hidden. Without a normal the faces that hold the point hide nothing
    packed      True: (..., ceil(k / 8)) uint8 with a set bit for each hidden direction, in the order of
                ``numpy.unpackbits(..., axis=-1, count=k)``. There are no weights then
    distance    how far the mesh hides, in scene units
    threads     None: as many as the octree has; they share the points, of which each is one thread's
    progress    a bar on standard error when that is a terminal

    The share is the sum of the weights of the hidden directions over the sum of all, both in the order of directions:
    exactly 0 where all is open and 1 where all is hidden. A point's bits depend neither on threads nor on the other
    points. Nothing of the size n x k is made but the bits. Raises ``ValueError`` naming argument and row.

    >>> import numpy as np
    >>> from renderer import Octree
    >>> from renderer.mesh.shapes import box
    >>> from renderer.studies import occlusion
    >>> octree = Octree.from_mesh(box((0, 0, 0), (1, 1, 1)))
    >>> around = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, 0, 1]]
    >>> occlusion(octree, [[3, 0.5, 0.25], [9, 9, 9]], None, around)
    array([0.25, 0.  ])
    >>> bits = occlusion(octree, [[3, 0.5, 0.25]], [0, 0, 1], around, packed=True)
    >>> np.unpackbits(bits, axis=-1, count=4)
    array([[1, 1, 1, 0]], dtype=uint8)
    """
    request = check_request(octree, points, normals, leaving, threads, progress)
    directions = check_directions("directions", directions)
    limits = limits_of(distance, directions)
    if flag_argument("packed", packed):
        expect(weights is None, "weights", "None, as bits have none", "an array")
        return evaluate_bits(octree, request, Sky(directions, np.ones(len(directions)), limits, False, False))
    values = check_weights("weights", weights, len(directions))
    expect(bool(values.any()), "weights", "one that is not 0", "all 0")
    return evaluate(octree, request, Sky(directions, values, limits, False, False), hidden=True, share=True)

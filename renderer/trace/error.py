"""Sets the bounds of the errors of t of a query's hits; ``error_bounds`` finds them."""

import numpy as np
from numpy.typing import NDArray

from renderer.results.hits import AllHits, Hits
from renderer.system.threads import for_chunks
from renderer.trace.batch import CHUNK, RayBatch
from renderer.trace.error_bounds import bound_errors


def add_errors(
    hits: Hits | AllHits, rays: RayBatch, rows: NDArray[np.int64] | None, scale: float, threads: int
) -> None:
    """Set ``hits.t_error``: how far t may be from where each hit's ray meets its face.

    A ray nearly in its plane may pass it by and meet the plane elsewhere: then the bound holds for where the ray is
    within the face's box.
    ``rows`` are the rays of the hits; None says that each ray has a row of its own. ``scale`` is the tree's.
    """
    mesh, errors = hits._mesh, np.empty(len(hits.t))
    own = np.empty(0, np.int64) if rows is None else rows

    def bound(begin: int, end: int) -> None:
        bound_errors(mesh.vertices, mesh.faces, rays, own, hits.t, hits.face, errors, begin, end, scale)

    for_chunks(bound, len(errors), CHUNK, threads)
    hits.t_error = errors

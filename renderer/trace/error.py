"""Sets ``t_error`` of the hits of a query; ``error_bounds`` computes the bounds."""

import numpy as np
from numpy.typing import NDArray

from renderer.results.hits import AllHits, Hits
from renderer.system.threads import for_chunks
from renderer.trace.batch import CHUNK, RayBatch
from renderer.trace.error_bounds import bound_errors


def add_errors(
    hits: Hits | AllHits, rays: RayBatch, rows: NDArray[np.int64] | None, scale: float, threads: int
) -> None:
    """Set ``hits.t_error``, the bound of the error of each t.

    A ray nearly in a face's plane may hit by rounding alone. The bound then holds for the ray's interval inside the
    face's box. ``rows`` are the rays of the hits; None: one hit a ray. ``scale`` is the tree's.
    """
    mesh, errors = hits._mesh, np.empty(len(hits.t))
    own = np.empty(0, np.int64) if rows is None else rows

    def bound(begin: int, end: int) -> None:
        bound_errors(mesh.vertices, mesh.faces, rays, own, hits.t, hits.face, errors, begin, end, scale)

    for_chunks(bound, len(errors), CHUNK, threads)
    hits.t_error = errors

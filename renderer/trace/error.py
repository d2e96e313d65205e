"""Sets ``t_error`` of the hits of a query; ``error_bounds`` computes the bounds."""

import numpy as np
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.results.hits import AllHits, Hits
from renderer.system.spare import recycled
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
    hits.t_error = errors_of(hits._mesh, hits.face, hits.t, rays, rows, scale, threads)


def errors_of(
    mesh: Mesh,
    face: NDArray[np.int64],
    t: NDArray[np.float64],
    rays: RayBatch,
    rows: NDArray[np.int64] | None,
    scale: float,
    threads: int,
) -> NDArray[np.float64]:
    """The bounds of ``add_errors`` for hits at t on faces of a mesh, nan for face -1."""
    errors, own = recycled(len(t)), np.empty(0, np.int64) if rows is None else rows

    def bound(begin: int, end: int) -> None:
        bound_errors(mesh.vertices, mesh.faces, rays, own, t, face, errors, begin, end, scale)

    for_chunks(bound, len(errors), CHUNK, threads)
    return errors

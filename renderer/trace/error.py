"""Bounds of the rounding errors of t, for each hit from its own ray and face.

The errors are those of the triangle test of ``intersect``, term by term. Where a hit was in doubt, ``doubt.settled``
has moved t within the face's box.
"""

import numpy as np
from numpy.typing import NDArray

from renderer.trace.batch import RayBatch
from renderer.trace.hits import AllHits, Hits
from renderer.trace.intersect import DOUBT, ERROR, SLANT

Floats = NDArray[np.float64]
_ROUNDOFF = 2.0**-53
# The bound is itself computed with some roundings; boxes are wider than their faces and entered with float32's digits.
_MORE, _BOX = 1.0 + 2.0**-20, 2.0**-18


def add_errors(hits: Hits | AllHits, rays: RayBatch, rows: NDArray[np.int64], scale: float) -> None:
    """Set ``hits.t_error``: how far t may be from where each hit's ray meets its face.

    A ray nearly in its plane may pass it by and meet the plane elsewhere: then t lies within the face's box.
    ``rows`` are the rays that hit, one for each hit in order; ``scale`` is the tree's.
    """
    hit = hits.face >= 0
    face, t, mesh = hits.face[hit], hits.t[hit], hits._mesh
    origins, directions = (a[rows] if len(a) > 1 else a for a in (rays.origins, rays.directions))
    corners = mesh.vertices[mesh.faces[face]] * scale
    last = np.abs(directions).argmax(axis=1)
    turned = (last[:, None] + [1, 2, 0]) % 3
    every = np.broadcast_to(turned, (len(face), 3))
    directions = np.take_along_axis(np.broadcast_to(directions, every.shape), every, axis=1)
    away = np.take_along_axis(corners - (origins * scale)[:, None], every[:, None], axis=2)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        errors = _errors(away, directions, t * scale) / scale
    hits.t_error = np.full(len(hits.t), np.nan)
    hits.t_error[hit] = np.where(np.isnan(errors), np.inf, errors)


def _errors(away: Floats, directions: Floats, t: Floats) -> Floats:
    """Bounds from corners relative to origins, (k, 3 corners, 3), the direction's largest component last."""
    z, depth = away[:, :, 2], np.abs(directions[:, 2])
    x, y = (away[:, :, k] - (directions[:, k] / directions[:, 2])[:, None] * z for k in (0, 1))
    edges, error = _edges(x, y, np.abs(z))
    determinant, size = np.abs(edges.sum(axis=1)), np.abs(t)
    numerator = (error * np.abs(z)).sum(axis=1) + 4.0 * _ROUNDOFF * np.abs(edges * z).sum(axis=1)
    denominator = error.sum(axis=1) + 2.0 * _ROUNDOFF * np.abs(edges).sum(axis=1)
    across, along = np.abs(x).sum(axis=1) + np.abs(y).sum(axis=1), np.abs(z).sum(axis=1)
    product = across * (across + along)
    # Of a numerator in doubt no more is known than that settling has moved it by ERROR at most.
    doubt = size * depth * determinant <= 2.0 * DOUBT * product * along
    numerator += np.where(doubt, ERROR * product * along, 0.0)
    sure = (numerator + size * depth * denominator) / (determinant * depth) * _MORE + 3.0 * _ROUNDOFF * size
    spread = np.abs(z[:, 1] - z[:, 0]) + np.abs(z[:, 2] - z[:, 0])
    blurred = determinant * along <= 2.0 * np.maximum(product * along * DOUBT, product * spread * SLANT)
    within = ((away.max(axis=1) - away.min(axis=1)) / np.abs(directions)).min(axis=1) * (1.0 + _BOX) + _BOX * size
    return np.where(blurred, within, sure)


def _edges(x: Floats, y: Floats, z: Floats) -> tuple[Floats, Floats]:
    """The edge functions of sheared corners, (k, 3), and bounds of their errors; ``z`` without signs."""
    a, b = np.roll(np.arange(3), 1), np.roll(np.arange(3), -1)
    # A sheared coordinate is a difference, less a product of one with a quotient.
    dx, dy = 4.0 * _ROUNDOFF * (np.abs(x) + z), 4.0 * _ROUNDOFF * (np.abs(y) + z)
    first, second = x[:, a] * y[:, b], y[:, a] * x[:, b]
    error = np.abs(x[:, a]) * dy[:, b] + np.abs(y[:, b]) * dx[:, a] + np.abs(y[:, a]) * dx[:, b]
    error += np.abs(x[:, b]) * dy[:, a] + 2.0 * _ROUNDOFF * (np.abs(first) + np.abs(second))
    return first - second, error * _MORE

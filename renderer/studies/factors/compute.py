"""View factors of the surfaces of a scene: exact where two see each other whole, by rays elsewhere, and balanced."""

from __future__ import annotations

import math
import warnings
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.arrays import flag_argument, real_argument
from renderer.arguments.counts import count_argument
from renderer.arguments.types import ArrayLike
from renderer.errors import expect
from renderer.queryable import Queries
from renderer.rayscene.scene import RayScene
from renderer.studies.factors.aim import senders_of
from renderer.studies.factors.balance import Exchanges, balanced
from renderer.studies.factors.known import KnownPairs, known_of, pairs_worth
from renderer.studies.factors.result import ViewFactors, csr_array
from renderer.studies.factors.rows import BACK, FIRST_RAYS, SKY, RowHits, Tracing, nothing_known, trace_rows
from renderer.studies.factors.sparse import scipy_sparse
from renderer.studies.factors.surfaces import check_surfaces
from renderer.studies.share import octree_of
from renderer.system.threads import checked_threads

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# The rays of a row at most.
_MOST_RAYS = 1 << 24
# A row whose exact entries leave so little needs no rays: some roundings of their sum.
_WHOLE = 1e-9
# What may change of an exact entry beside others, where rays alone do not fill the rows.
_LITTLE = 1e-9


def view_factors(
    octree: Queries | RayScene,
    groups: ArrayLike | None = None,
    *,
    sides: Literal["front", "both"] = "front",
    transmittance: ArrayLike | None = None,
    rtol: float = 0.02,
    max_rays: int = 1 << 16,
    threads: int | None = None,
    progress: bool = False,
) -> ViewFactors:
    """View factors between the faces of a scene, or between groups of them, and from them to the sky.

    F_ij is the share of what surface i sends, the same from all its points and by the cosine law, that arrives at
    surface j. What meets no face goes to the sky.

    Parameters
    ----------
    octree : Octree, BruteForce or RayScene
    groups : array_like of int, shape (F,), optional
        The surface that each face belongs to, from 0 to n - 1: walls, buildings, materials. By default each face is a
        surface of its own.
    sides : {"front", "both"}, default "front"
        The sides on which faces send and receive. The front is the side from which corners run counter-clockwise.
    transmittance : array_like, shape (F,), optional
        The share of a ray, from 0 to 1, that each face lets through: of trees, shades and screens. Faces that let
        something through send and receive on both sides.
    rtol : float, default 0.02
        Rays are added to a surface until the standard error of each of its view factors is at most `rtol` times the
        largest of them.
    max_rays : int, default 65536
        Of a surface, from 256 to 2^24.
    threads : int, optional
        By default those of the octree.
    progress : bool, default False
        Show a bar on standard error if that is a terminal.

    Returns
    -------
    ViewFactors

    Raises
    ------
    ValueError
        If an argument is not as above, or if a surface has no area. The message names the argument and the row.
    ImportError
        If SciPy is not installed.

    Warns
    -----
    UserWarning
        If a surface sees backs of faces.

    Notes
    -----
    Pairs of faces that see each other whole have the exact value, if a ray costs more than that does. All others are
    estimated by rays whose points and directions are evenly spread, eight times, so that the eight results say how
    much they err. Then all entries that are not exact are changed, each within its error, until A_i F_ij = A_j F_ji and
    each row has the sum 1. The bits do not depend on the threads.

    References
    ----------
    Howell, Menguc, Daun, Siegel, Thermal Radiation Heat Transfer, 2020.

    Schroeder, Hanrahan, On the form factor between two polygons, 1993.

    Examples
    --------
    The floor of a room without a ceiling sees as much sky as it would see of a ceiling.

    >>> from renderer import Octree
    >>> from renderer.mesh.shapes import box
    >>> from renderer.studies import view_factors
    >>> room = box()
    >>> octree = Octree(room.vertices, room.faces[:10, ::-1])
    >>> factors = view_factors(octree, [0, 0, 1, 1, 2, 2, 3, 3, 4, 4])
    >>> factors.sky.round(4)
    array([0.2   , 0.2   , 0.2   , 0.2   , 0.1998])
    """
    sparse = scipy_sparse()
    searched = octree_of(octree)
    surfaces = check_surfaces(searched.mesh, groups, sides, transmittance)
    rtol, max_rays = check_effort(rtol, max_rays)
    workers = searched.threads if threads is None else checked_threads(threads)
    senders = senders_of(searched.mesh, surfaces)
    shown = flag_argument("progress", progress)
    tracing = Tracing(searched._built, surfaces, senders, rtol, max_rays, workers, shown)
    pairs = _known_pairs(tracing)
    left = surfaces.areas - pairs.sums(surfaces.number) > _WHOLE * surfaces.areas
    rows = np.flatnonzero(left)
    hits = trace_rows(tracing, rows, pairs.known(surfaces.areas))
    return _assembled(sparse, surfaces.areas, pairs, _spread(hits, rows, surfaces.number))


def check_effort(rtol: float, max_rays: int) -> tuple[float, int]:
    """The arguments that say how many rays there are."""
    given = real_argument("rtol", rtol)
    good = given.ndim == 0 and 0.0 < float(given) < math.inf
    expect(good, "rtol", "a number above 0", repr(rtol))
    return float(given), count_argument("max_rays", max_rays, FIRST_RAYS, _MOST_RAYS)


def _known_pairs(tracing: Tracing) -> KnownPairs:
    """The exact pairs: all of few faces; of many those whose rays would cost more."""
    number = tracing.surfaces.number
    worth = pairs_worth(tracing, None)
    if worth is None:
        few = tracing._replace(max_rays=FIRST_RAYS)
        worth = pairs_worth(tracing, trace_rows(few, np.arange(number), nothing_known(number)))
    return known_of(tracing, worth)


def _spread(hits: RowHits, rows: Integers, number: int) -> RowHits:
    """The hits of some rows as those of all; the others have none."""
    lengths, rays = np.zeros((2, number), np.int64)
    lengths[rows], rays[rows] = np.diff(hits.first), hits.rays
    return hits._replace(first=np.concatenate([[0], np.cumsum(lengths)]), rays=rays)


class _Counted(NamedTuple):
    """The entries that rays counted, each surface pair once: rows <= columns."""

    rows: Integers
    columns: Integers
    values: Floats
    freedom: Floats
    variance: Floats


def _counted(hits: RowHits, areas: Floats) -> _Counted:
    """The exchanges of pairs by the rays of both: their hits over the rays by area of both."""
    number = len(areas)
    rows = np.repeat(np.arange(number), np.diff(hits.first))
    inner = hits.targets < number
    rows, columns, counts = rows[inner], hits.targets[inner], hits.counts[inner]
    density = hits.rays / areas
    # The error of a row's own estimate, weighed as its rays are.
    spread = (hits.errors[inner] * hits.rays[rows]) ** 2
    low, high = np.minimum(rows, columns), np.maximum(rows, columns)
    order = np.argsort(low * number + high, kind="stable")
    low, high = low[order], high[order]
    begins = np.flatnonzero(np.diff(low * number + high, prepend=-1))
    low, high = low[begins], high[begins]
    both = np.where(low == high, density[low], density[low] + density[high])
    # rule: reciprocal-exchange
    values = np.add.reduceat(counts[order].astype(np.float64), begins) / both if len(begins) else np.empty(0)
    variance = np.add.reduceat(spread[order], begins) / both**2 if len(begins) else np.empty(0)
    return _Counted(low, high, values, 1.0 / both, variance)


def _outside(hits: RowHits, areas: Floats, target: int) -> Floats:
    """The exchange of each row with the sky or with backs."""
    number = len(areas)
    rows = np.repeat(np.arange(number), np.diff(hits.first))
    chosen = hits.targets == number + target
    counts = np.bincount(rows[chosen], hits.counts[chosen], number)
    return np.divide(counts * areas, hits.rays, out=np.zeros(number), where=hits.rays > 0)


def _assembled(sparse: object, areas: Floats, pairs: KnownPairs, hits: RowHits) -> ViewFactors:
    """The result: exact and counted entries, balanced."""
    number, counted = len(areas), _counted(hits, areas)
    sky, backs = _outside(hits, areas, SKY), _outside(hits, areas, BACK)
    outside_freedom = np.divide(areas, hits.rays, out=np.zeros(number), where=hits.rays > 0)
    rows, columns = np.concatenate([pairs.rows, counted.rows]), np.concatenate([pairs.columns, counted.columns])
    values = np.concatenate([pairs.values, counted.values])
    freedom = np.concatenate([np.zeros(len(pairs.rows)), counted.freedom])
    variance = np.concatenate([np.zeros(len(pairs.rows)), counted.variance])
    given = Exchanges(rows, columns, values, freedom, sky + backs, outside_freedom)
    found = balanced(given, areas)
    # What rays alone cannot fill: exact entries change as little as that leaves open.
    found = balanced(found._replace(freedom=np.maximum(freedom, _LITTLE * areas.mean())), areas)
    share = np.divide(found.outside, sky + backs, out=np.zeros(number), where=sky + backs > 0.0)
    _warn_of_backs(backs * share / areas)
    used = found.values > 0.0
    rows, columns, values, variance = rows[used], columns[used], found.values[used], variance[used]
    exchange = _symmetric(sparse, rows, columns, values, number)
    errors = _symmetric(sparse, rows, columns, np.sqrt(variance), number)
    errors.data /= np.repeat(areas, np.diff(errors.indptr))
    return ViewFactors(areas, exchange, sky * share / areas, backs * share / areas, errors, hits.rays)


def _symmetric(sparse: object, rows: Integers, columns: Integers, values: Floats, number: int) -> csr_array:
    """The symmetric matrix of entries with rows <= columns."""
    beside = rows != columns
    places = np.concatenate([rows, columns[beside]]), np.concatenate([columns, rows[beside]])
    return sparse.csr_array((np.concatenate([values, values[beside]]), places), shape=(number, number))


def _warn_of_backs(backs: Floats) -> None:
    seen = np.flatnonzero(backs)
    if len(seen):
        worst = int(backs.argmax())
        warnings.warn(
            f"octree: {len(seen)} of {len(backs)} surfaces see backs of faces, surface {worst} most: "
            f"{100.0 * backs[worst]:.3g} % of what it sends; turn these faces, or pass sides='both'",
            stacklevel=3,
        )

"""View factors of the surfaces of a scene: exact where two see each other whole, by rays elsewhere, and balanced."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.arrays import flag_argument, real_argument
from renderer.arguments.counts import count_argument
from renderer.arguments.types import ArrayLike
from renderer.errors import expect
from renderer.numerics.compressed import firsts_of
from renderer.queryable import Queries
from renderer.rayscene.scene import RayScene
from renderer.studies.factors.aim import REPLICATES, senders_of
from renderer.studies.factors.assemble import assembled, warn_of_backs
from renderer.studies.factors.free import without_matrix
from renderer.studies.factors.known import KnownPairs, known_of, pairs_worth
from renderer.studies.factors.result import ViewFactors
from renderer.studies.factors.rows import FIRST_RAYS, RowHits, Tracing, nothing_known
from renderer.studies.factors.sparse import scipy_sparse
from renderer.studies.factors.surfaces import check_surfaces
from renderer.studies.factors.work import AtOnce, Work
from renderer.studies.share import octree_of
from renderer.system.threads import checked_threads

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# The rays of a row at most.
_MOST_RAYS = 1 << 24
# A row whose exact entries leave so little needs no rays: some roundings of their sum.
_WHOLE = 1e-9


def view_factors(
    octree: Queries | RayScene,
    groups: ArrayLike | None = None,
    *,
    sides: Literal["front", "both"] = "front",
    transmittance: ArrayLike | None = None,
    rtol: float = 0.02,
    max_rays: int = 1 << 16,
    form: Literal["matrix", "rays"] = "matrix",
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
        Rays are added to a surface until the standard errors of all its view factors together, the root of the sum of
        their squares, are at most `rtol`: the share of what it sends that may arrive elsewhere.
    max_rays : int, default 65536
        Of a surface, from 256 to 2^24.
    form : {"matrix", "rays"}, default "matrix"
        "rays": keep no matrix, but the surface that each ray hits, for scenes of a million surfaces. Each has
        `max_rays` then, from 8 on, and `rtol` does not count. `exchange` multiplies vectors by ``@`` as the matrix
        does; there are no `errors`, and sums are 1 within 1e-9.
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
    expect(isinstance(form, str) and form in ("matrix", "rays"), "form", "'matrix' or 'rays'", repr(form))
    free = form == "rays"
    tracing = checked_tracing(
        octree, groups, sides=sides, transmittance=transmittance, rtol=rtol, max_rays=max_rays, threads=threads,
        progress=progress, least=REPLICATES if free else FIRST_RAYS,
    )  # fmt: skip
    found = without_matrix(tracing) if free else computed(tracing, AtOnce())
    warn_of_backs(found.backs)
    return found


def checked_tracing(
    octree: Queries | RayScene,
    groups: ArrayLike | None = None,
    *,
    sides: str = "front",
    transmittance: ArrayLike | None = None,
    rtol: float = 0.02,
    max_rays: int = 1 << 16,
    threads: int | None = None,
    progress: bool = False,
    least: int = FIRST_RAYS,
) -> Tracing:
    """The arguments of ``view_factors``, checked; ``least`` rays of a surface at least."""
    searched = octree_of(octree)
    surfaces = check_surfaces(searched, groups, sides, transmittance)
    rtol, max_rays = check_effort(rtol, max_rays, least)
    workers = searched.threads if threads is None else checked_threads(threads)
    senders = senders_of(searched.mesh, surfaces)
    shown = flag_argument("progress", progress)
    return Tracing(searched._built, surfaces, senders, rtol, max_rays, workers, shown)


def computed(tracing: Tracing, work: Work) -> ViewFactors:
    """The view factors. Each step of ``work`` depends on the arguments and on the steps before alone."""
    scipy_sparse()
    surfaces, pairs = tracing.surfaces, _known_pairs(tracing, work)
    left = surfaces.areas - pairs.sums(surfaces.number) > _WHOLE * surfaces.areas
    rows = np.flatnonzero(left)
    hits = work.rows("rows", tracing, rows, pairs.known(surfaces.number))
    return assembled(surfaces.areas, pairs, _spread(hits, rows, surfaces.number))


def check_effort(rtol: float, max_rays: int, least: int = FIRST_RAYS) -> tuple[float, int]:
    """The arguments that say how many rays there are."""
    given = real_argument("rtol", rtol)
    good = given.ndim == 0 and 0.0 < float(given) < math.inf
    expect(good, "rtol", "a number above 0", repr(rtol))
    return float(given), count_argument("max_rays", max_rays, least, _MOST_RAYS)


def _known_pairs(tracing: Tracing, work: Work) -> KnownPairs:
    """The exact pairs: all of few faces; of many those whose rays would cost more."""
    number = tracing.surfaces.number
    worth = pairs_worth(tracing, None)
    if worth is None:
        few = tracing._replace(max_rays=FIRST_RAYS)
        worth = pairs_worth(tracing, work.rows("survey", few, np.arange(number), nothing_known(number)))
    assert worth is not None
    return known_of(tracing, worth, work)


def _spread(hits: RowHits, rows: Integers, number: int) -> RowHits:
    """The hits of some rows as those of all; the others have none."""
    lengths, rays = np.zeros((2, number), np.int64)
    lengths[rows], rays[rows] = np.diff(hits.first), hits.rays
    return hits._replace(first=firsts_of(lengths), rays=rays)

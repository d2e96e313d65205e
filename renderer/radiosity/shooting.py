"""Radiosity that is there at once and becomes better: the brightest surface sends what it has not sent yet."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.arrays import flag_argument
from renderer.arguments.types import ArrayLike
from renderer.errors import expect
from renderer.queryable import Queries
from renderer.radiosity.solve import check_rtol
from renderer.radiosity.surfaces import check_channels, check_factors, check_sky, reject_rows
from renderer.rayscene.scene import RayScene
from renderer.studies.factors.aim import senders_of
from renderer.studies.factors.compute import check_effort
from renderer.studies.factors.result import ViewFactors
from renderer.studies.factors.rows import FIRST_RAYS, Tracing, nothing_known, trace_rows
from renderer.studies.factors.surfaces import check_surfaces
from renderer.studies.factors.tally import SKY
from renderer.studies.share import octree_of
from renderer.system.threads import checked_threads

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class Shot(NamedTuple):
    """The light that one surface has sent.

    Attributes
    ----------
    surface : int
        The surface that sent.
    unshot : float
        The power that has not been sent yet, over all that surfaces emit, or return of the sky's light.

    Examples
    --------
    >>> from renderer.radiosity import Shot
    >>> Shot(surface=3, unshot=0.25).unshot
    0.25
    """

    surface: int
    unshot: float


class _Row(NamedTuple):
    """The receivers (k,) of a surface's power, and the share of each (k,)."""

    surfaces: Ints
    shares: Floats


class _Rows(Protocol):
    """Rows of view factors on demand."""

    areas: Floats

    def row(self, surface: int) -> _Row:
        """The row of a surface; the same bits each time."""

    def sky(self) -> Floats:
        """The share of each row that the sky fills, (n,)."""


class Shooting(Iterator[Shot]):
    """An iterator whose steps each let the surface with the most unsent power send it; ``values`` improve as it goes.

    Parameters
    ----------
    scene : Octree, BruteForce, RayScene or ViewFactors
        What is traced, from the brightest surface alone; its faces are the surfaces. Or view factors that are known.
    emission, reflectance : array_like
        As for `radiosity`.
    sky : float or array_like, shape (3,), optional
        As for `radiosity`.
    rtol : float, default 1e-3
        The iteration ends when the unsent power is at most `rtol` times that which surfaces emit, or return of the
        sky's light.
    ray_rtol : float, default 0.02
    max_rays : int, default 65536
        The ``rtol`` and ``max_rays`` of `view_factors`, for the rays of one surface.
    threads : int, optional
        By default those of the octree.

    Raises
    ------
    ValueError
        If an argument is not as above. The message names the argument and the row.
    ImportError
        If SciPy is not installed.

    Notes
    -----
    Surface i sends its unsent radiosity u: surface j gets rho_j u F_ij A_i / A_j. The one with the most unsent power in
    all channels sends; of equal ones the first. It may send again later, by the same rays.

    Values only grow, towards those of `radiosity`. The power that is missing in them is at most the unsent power times
    max(rho) / (1 - max(rho)). Rows of rays are not balanced: with an octree the limit is that of its own rows, which
    differ from those of `view_factors` by their errors. Its shares of the sky are those of 256 rays from each face.

    References
    ----------
    Cohen, Chen, Wallace, Greenberg, A progressive refinement approach to fast radiosity image generation, 1988.

    Examples
    --------
    >>> from renderer import Octree
    >>> from renderer.mesh.shapes import box
    >>> from renderer.radiosity import Shooting
    >>> room = box()
    >>> inside = Octree(room.vertices, room.faces[:, ::-1])
    >>> shots = Shooting(inside, [0] * 10 + [1, 1], 0.5)
    >>> [next(shots).surface for _ in range(2)]
    [10, 11]
    >>> all(shot.unshot >= 0 for shot in shots)
    True
    >>> shots.values().shape
    (12, 3)
    """

    def __init__(
        self,
        scene: Queries | RayScene | ViewFactors,
        emission: ArrayLike,
        reflectance: ArrayLike,
        *,
        sky: ArrayLike | None = None,
        rtol: float = 1e-3,
        ray_rtol: float = 0.02,
        max_rays: int = 1 << 16,
        threads: int | None = None,
    ) -> None:
        self._rows: _Rows = (
            _Known(scene) if isinstance(scene, ViewFactors) else _Traced(scene, ray_rtol, max_rays, threads)
        )
        self._areas = self._rows.areas
        n = len(self._areas)
        emitted, rho = (
            np.array(np.broadcast_to(check_channels(name, values, n), (n, 3)))
            for name, values in (("emission", emission), ("reflectance", reflectance))
        )
        reject_rows("reflectance", "numbers less than 1", rho, rho >= 1.0)
        self._rho, self._rtol = rho, check_rtol(rtol)
        above = check_sky("sky", sky)
        self._values = emitted + rho * (self._rows.sky()[:, None] * above if above.any() else 0.0)
        self._unshot = self._values.copy()
        self._first = self._power()

    def __next__(self) -> Shot:
        power = self._unshot.sum(axis=1) * self._areas
        if power.sum() <= self._rtol * self._first:
            raise StopIteration
        brightest = int(power.argmax())
        surfaces, shares = self._rows.row(brightest)
        gain = self._rho[surfaces] * self._unshot[brightest]
        gain *= (shares * self._areas[brightest] / self._areas[surfaces])[:, None]
        # Before it receives: a group of faces may see itself.
        self._unshot[brightest] = 0.0
        self._values[surfaces] += gain
        self._unshot[surfaces] += gain
        return Shot(brightest, self._power() / self._first)

    def values(self, ambient: bool = False) -> Floats:
        """Return the radiosity of each surface so far.

        Parameters
        ----------
        ambient : bool, default False
            Add an estimate of what is still to come, for pictures: as if the unsent power were spread evenly over all
            surfaces, and reflected by their mean reflectance without end.

        Returns
        -------
        ndarray of float64, shape (n, 3)
            A new array.

        Examples
        --------
        >>> import numpy as np
        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> from renderer.radiosity import Shooting
        >>> room = box()
        >>> shots = Shooting(Octree(room.vertices, room.faces[:, ::-1]), 0.5, 0.5)
        >>> np.abs(shots.values(ambient=True) - 1.0).max() < 1e-9  # before any shot
        np.True_
        """
        if not flag_argument("ambient", ambient):
            return self._values.copy()
        weights = (self._areas / self._areas.sum())[:, None]
        unsent, mean = (weights * self._unshot).sum(axis=0), (weights * self._rho).sum(axis=0)
        return self._values + self._rho * (unsent / (1.0 - mean))

    def _power(self) -> float:
        return float((self._unshot.sum(axis=1) * self._areas).sum())


class _Known:
    """The rows of view factors."""

    def __init__(self, factors: ViewFactors) -> None:
        exchange = check_factors(factors)
        expect(
            factors.errors is not None,
            "scene",
            "an octree, or view factors with form='matrix'",
            "some without a matrix",
        )
        self.areas, self._sky, self._exchange = exchange.areas, exchange.sky, factors.exchange

    def row(self, surface: int) -> _Row:
        entries = slice(*self._exchange.indptr[surface : surface + 2].tolist())
        shares = self._exchange.data[entries] / self.areas[surface]
        return _Row(self._exchange.indices[entries].astype(np.int64), shares)

    def sky(self) -> Floats:
        return self._sky


class _Traced:
    """The rows of the faces of a scene, by rays."""

    def __init__(self, scene: Queries | RayScene, ray_rtol: float, max_rays: int, threads: int | None) -> None:
        searched = octree_of(scene)
        workers = searched.threads if threads is None else checked_threads(threads)
        surfaces = check_surfaces(searched, None, "front", None)
        senders = senders_of(searched.mesh, surfaces)
        self.areas = surfaces.areas
        self._tracing = Tracing(searched._built, surfaces, senders, *check_effort(ray_rtol, max_rays), workers, False)
        self._known = nothing_known(len(self.areas))

    def row(self, surface: int) -> _Row:
        hits = trace_rows(self._tracing, np.array([surface]), self._known)
        inner = hits.targets < len(self.areas)
        return _Row(hits.targets[inner], hits.counts[inner] / hits.rays[0])

    def sky(self) -> Floats:
        n = len(self.areas)
        return trace_rows(self._tracing._replace(max_rays=FIRST_RAYS), np.arange(n), self._known).share(n + SKY)

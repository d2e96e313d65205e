"""The radiosity of surfaces from their view factors."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.arrays import read_only, real_argument
from renderer.arguments.counts import count_argument
from renderer.arguments.types import ArrayLike
from renderer.errors import expect
from renderer.radiosity.surfaces import Exchange, check_channels, check_factors, check_sky, reject_rows
from renderer.radiosity.system import Solution, System, amplification_of, solved
from renderer.studies.factors.result import ViewFactors

Floats = NDArray[np.float64]


class Balance(NamedTuple):
    """The power that enters and leaves all surfaces together, red, green and blue.

    Attributes
    ----------
    emitted : ndarray of float64, shape (3,)
        What surfaces send themselves: the sum of A E.
    from_sky : ndarray of float64, shape (3,)
        What arrives from the sky.
    absorbed : ndarray of float64, shape (3,)
        What arrives and is not reflected.
    to_sky : ndarray of float64, shape (3,)
        What leaves the scene.

    Examples
    --------
    >>> from renderer import Octree
    >>> from renderer.mesh.shapes import box
    >>> from renderer.radiosity import radiosity
    >>> from renderer.studies import view_factors
    >>> balance = radiosity(view_factors(Octree.from_mesh(box())), emission=1.0, reflectance=0.5).balance
    >>> balance.emitted, balance.to_sky
    (array([6., 6., 6.]), array([6., 6., 6.]))
    """

    emitted: Floats
    from_sky: Floats
    absorbed: Floats
    to_sky: Floats

    @property
    def error(self) -> Floats:
        """Power that enters minus power that leaves, (3,): 0 but for the residual and rounding.

        Examples
        --------
        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> from renderer.radiosity import radiosity
        >>> from renderer.studies import view_factors
        >>> radiosity(view_factors(Octree.from_mesh(box())), emission=1.0, reflectance=0.5).balance.error
        array([0., 0., 0.])
        """
        return (self.emitted + self.from_sky) - (self.absorbed + self.to_sky)


@dataclass(frozen=True, eq=False)
class Radiosity:
    """The light that n surfaces send and receive.

    Attributes
    ----------
    values : ndarray of float64, shape (n, 3)
        The radiosity B of each surface: the power per area that leaves it, emitted and reflected. The radiance of a
        diffuse surface is B / pi.
    irradiance : ndarray of float64, shape (n, 3)
        The power per area that arrives at it.
    residual : float
        The largest error of E + rho H = B, for the irradiance H.
    bound : float
        No value is farther from that of the exact solution for these view factors. Errors of view factors come on top.
    iterations : int
        Of conjugate gradients.
    balance : Balance
        The energy of all surfaces together.

    See Also
    --------
    radiosity

    Examples
    --------
    >>> from renderer import Octree
    >>> from renderer.mesh.shapes import box
    >>> from renderer.radiosity import radiosity
    >>> from renderer.studies import view_factors
    >>> found = radiosity(view_factors(Octree.from_mesh(box())), 1.0, 0.5, sky=2.0)
    >>> found.values[10], found.irradiance[10], found.iterations
    (array([2., 2., 2.]), array([2., 2., 2.]), 0)
    """

    values: Floats
    irradiance: Floats
    residual: float
    bound: float
    iterations: int
    balance: Balance


def radiosity(
    factors: ViewFactors,
    emission: ArrayLike,
    reflectance: ArrayLike,
    *,
    sky: ArrayLike | None = None,
    rtol: float = 1e-6,
    max_iterations: int = 10_000,
) -> Radiosity:
    """Solve B = E + rho H for the radiosity B of diffuse surfaces, where H = F B + F_sky B_sky is their irradiance.

    Parameters
    ----------
    factors : ViewFactors
        Of n surfaces, as `view_factors` returns.
    emission : array_like, shape (n,) or (n, 3), or float
        E, the power per area that surfaces send themselves, >= 0: in all channels, or red, green and blue.
    reflectance : array_like, shape (n,) or (n, 3), or float
        rho, the share that they return, from 0 to less than 1.
    sky : float or array_like, shape (3,), optional
        The radiosity of the sky, >= 0: the irradiance of level ground under the open sky. By default it is black.
    rtol : float, default 1e-6
        The solution is accepted when its proven `bound` is at most `rtol` times its largest value.
    max_iterations : int, default 10000
        Of conjugate gradients.

    Returns
    -------
    Radiosity

    Raises
    ------
    ValueError
        If an argument is not as above. The message names the argument and the row. Also if rounding does not allow
        `rtol`, or if `max_iterations` is too low.
    ImportError
        If SciPy is not installed.

    Notes
    -----
    The part of a surface that sees backs of faces, ``factors.backs``, is taken to lie inside a body: it neither sends
    nor receives.

    SciPy's conjugate gradients solve the symmetric form of the system, in all channels at once. An iteration takes one
    product with the exchange: a sparse matrix, or an operator if view factors have ``form="rays"``. If rows have the
    sum 1, no error is larger than the largest residual over 1 - max(rho); the rounding of the residual is added to it.
    The last bits depend on NumPy's library of linear algebra and its threads.

    References
    ----------
    Goral, Torrance, Greenberg, Battaile, Modeling the interaction of light between diffuse surfaces, 1984.

    Examples
    --------
    In a closed room whose surfaces emit what they do not reflect, B is 1 everywhere.

    >>> import numpy as np
    >>> from renderer import Octree
    >>> from renderer.mesh.shapes import box
    >>> from renderer.radiosity import radiosity
    >>> from renderer.studies import view_factors
    >>> room = box()
    >>> factors = view_factors(Octree(room.vertices, room.faces[:, ::-1]))
    >>> reflectance = np.linspace(0.1, 0.9, 12)
    >>> found = radiosity(factors, 1.0 - reflectance, reflectance)
    >>> bool(np.abs(found.values - 1.0).max() <= found.bound <= 1e-6)
    True
    """
    exchange = check_factors(factors)
    n = len(exchange.areas)
    emitted, rho = check_channels("emission", emission, n), check_channels("reflectance", reflectance, n)
    reject_rows("reflectance", "numbers less than 1", rho, rho >= 1.0)
    above = check_sky("sky", sky)
    tolerance = check_rtol(rtol)
    most = count_argument("max_iterations", max_iterations, 1)
    from_sky = exchange.sky[:, None] * above
    system = System(exchange, emitted + rho * from_sky, rho)
    amplification = amplification_of(system)
    expect(amplification < math.inf, "factors", "rows whose sum is at most 1", f"{exchange.rows.max():.6g}")
    found = solved(system, amplification, tolerance, most)
    balance = _balance(exchange, emitted, rho, from_sky, found)
    values, irradiance = (_in_three(columns) for columns in (found.values, found.gathered + from_sky))
    return Radiosity(values, irradiance, found.residual, found.bound, found.iterations, balance)


def check_rtol(rtol: float) -> float:
    """The share of the largest value by which any may err. Raises ``ValueError`` unless it is in (0, 1)."""
    given = real_argument("rtol", rtol)
    expect(given.ndim == 0 and bool(0.0 < given < 1.0), "rtol", "a number between 0 and 1", repr(rtol))
    return float(given)


def _balance(exchange: Exchange, emitted: Floats, rho: Floats, from_sky: Floats, found: Solution) -> Balance:
    arriving = found.gathered + from_sky
    leaving = found.values * exchange.powers[:, None]
    powers = (
        exchange.powers[:, None] * emitted,
        exchange.powers[:, None] * from_sky,
        exchange.powers[:, None] * ((1.0 - rho) * arriving),
        exchange.sky[:, None] * leaving,
    )
    return Balance(*(_in_three(power.sum(axis=0)) for power in powers))


def _in_three(columns: Floats) -> Floats:
    """Columns (..., 1) or (..., 3) as three."""
    return read_only(np.array(np.broadcast_to(columns, (*columns.shape[:-1], 3))))

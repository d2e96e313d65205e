"""Radiative heat between grey, diffuse surfaces of known temperatures, and of those that no heat enters or leaves."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.arrays import read_only, real_argument
from renderer.arguments.counts import count_argument
from renderer.arguments.types import ArrayLike
from renderer.errors import expect
from renderer.radiosity.solve import check_rtol
from renderer.radiosity.surfaces import Exchange, check_factors, reject_rows
from renderer.radiosity.system import System, amplification_of, solved
from renderer.studies.factors.result import ViewFactors

Floats = NDArray[np.float64]

# The Stefan-Boltzmann constant in W / (m^2 K^4): CODATA 2018 and 2022, exact by the SI of 2019 but for its digits.
SIGMA = 5.670374419e-8
# Far above any star, and far below where fourth powers overflow.
_HOTTEST = 1e20
_KELVIN = f"numbers from 0 to {_HOTTEST:g} in kelvin, or NaN for adiabatic surfaces"


@dataclass(frozen=True, eq=False)
class Heat:
    """The radiative heat of n surfaces.

    Attributes
    ----------
    net : ndarray of float64, shape (n,)
        The power in W that each surface loses by radiation; negative where it gains. Areas are in m^2.
    flux : ndarray of float64, shape (n,)
        The same per area, in W / m^2.
    temperature : ndarray of float64, shape (n,)
        In K: as given, and as found for adiabatic surfaces.
    radiosity : ndarray of float64, shape (n,)
        What leaves each surface, emitted and reflected, in W / m^2.
    irradiance : ndarray of float64, shape (n,)
        What arrives at it, in W / m^2.
    to_sky : float
        The power in W that leaves for the sky, less what comes from there.
    bound : float
        No radiosity is farther from that of the exact solution for these view factors, in W / m^2.
    iterations : int
        Of conjugate gradients.

    See Also
    --------
    net_heat

    Examples
    --------
    >>> from renderer import Octree
    >>> from renderer.mesh.shapes import box
    >>> from renderer.radiosity import net_heat
    >>> from renderer.studies import view_factors
    >>> heat = net_heat(view_factors(Octree.from_mesh(box())), 0.9, 293.15, sky_temperature=263.15)
    >>> heat.flux[10].round(2), heat.net[10].round(2)
    (np.float64(132.17), np.float64(66.09))
    """

    net: Floats
    flux: Floats
    temperature: Floats
    radiosity: Floats
    irradiance: Floats
    to_sky: float
    bound: float
    iterations: int


def net_heat(
    factors: ViewFactors,
    emissivity: ArrayLike,
    temperature: ArrayLike,
    *,
    sky_temperature: float | None = None,
    rtol: float = 1e-9,
    max_iterations: int = 10_000,
) -> Heat:
    """The heat that grey, diffuse surfaces exchange by radiation.

    Parameters
    ----------
    factors : ViewFactors
        Of n surfaces, as `view_factors` returns, of a mesh in metres.
    emissivity : array_like, shape (n,), or float
        Greater than 0 and at most 1; 1 is black. That of an adiabatic surface does not matter.
    temperature : array_like, shape (n,), or float
        In kelvin, >= 0. NaN for an adiabatic surface, which radiates what it receives; its temperature is found.
    sky_temperature : float, optional
        In kelvin. By default the sky is at 0 K.
    rtol : float, default 1e-9
        The solution is accepted when the proven `bound` of radiosities is at most `rtol` times the largest.
    max_iterations : int, default 10000
        Of conjugate gradients.

    Returns
    -------
    Heat

    Raises
    ------
    ValueError
        If an argument is not as above. The message names the argument and the row. Also if adiabatic surfaces see
        nothing that has a temperature, if rounding does not allow `rtol`, or if `max_iterations` is too low.
    ImportError
        If SciPy is not installed.

    Notes
    -----
    A surface loses A e (sigma T^4 - H), for its irradiance H and emissivity e. Each has one temperature and one
    irradiance: cut large surfaces by `patches`. A gas between them is not there. The part of a surface that sees backs
    of faces, ``factors.backs``, is taken to lie inside a body: it neither sends nor receives.

    References
    ----------
    Howell, Menguc, Daun, Siegel, Thermal Radiation Heat Transfer, 2020, chapter 5.

    Tiesinga, Mohr, Newell, Taylor, CODATA recommended values of the fundamental physical constants: 2018, 2021.

    Examples
    --------
    The floor of a black room is warm, its ceiling cold, and no heat passes through its walls.

    >>> import numpy as np
    >>> from renderer import Octree
    >>> from renderer.mesh.shapes import box
    >>> from renderer.radiosity import net_heat
    >>> from renderer.studies import view_factors
    >>> room = box((0, 0, 0), (4, 3, 2.5))
    >>> factors = view_factors(Octree(room.vertices, room.faces[:, ::-1]), [0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5])
    >>> heat = net_heat(factors, 1.0, [np.nan, np.nan, np.nan, np.nan, 303.15, 293.15])
    >>> heat.net.round(1)
    array([   0. ,    0. ,    0. ,    0. ,  466.2, -466.2])
    >>> heat.temperature.round(2)
    array([298.28, 298.28, 298.28, 298.28, 303.15, 293.15])
    """
    exchange = check_factors(factors)
    n = len(exchange.areas)
    degrees = _column("temperature", temperature, n)
    adiabatic = np.isnan(degrees)
    reject_rows("temperature", _KELVIN, degrees, _is_no_kelvin(degrees))
    share = np.where(adiabatic, 0.0, _column("emissivity", emissivity, n))
    reject_rows("emissivity", "numbers > 0 and at most 1", share, ~(adiabatic | ((share > 0.0) & (share <= 1.0))))
    emitted = SIGMA * np.where(adiabatic, 0.0, degrees) ** 4
    above = exchange.sky * (SIGMA * _sky_kelvin(sky_temperature) ** 4)
    _expect_sources(exchange, adiabatic)
    rho = 1.0 - share
    system = System(exchange, (share * emitted + rho * above)[:, None], rho[:, None])
    amplification = amplification_of(system)
    expected = "adiabatic surfaces that see enough of others, and rows of view factors whose sum is at most 1"
    expect(amplification < math.inf, "factors", expected, "a system that is as good as singular")
    found = solved(system, amplification, check_rtol(rtol), count_argument("max_iterations", max_iterations, 1))
    leaving, arriving = found.values[:, 0], found.gathered[:, 0] + above
    flux = np.where(exchange.powers > 0.0, share * (emitted - arriving), 0.0) + 0.0  # without the sign of a zero
    degrees = np.where(adiabatic, (arriving / SIGMA) ** 0.25, degrees)
    to_sky = float((exchange.powers * (exchange.sky * leaving - above)).sum())
    net = read_only(exchange.powers * flux)
    flux, degrees, leaving, arriving = (read_only(row) for row in (flux, degrees, np.array(leaving), arriving))
    return Heat(net, flux, degrees, leaving, arriving, to_sky, found.bound, found.iterations)


def _column(argument: str, values: ArrayLike, n: int) -> Floats:
    """One number for all, or one a surface, (n,) float64. Raises ``ValueError``."""
    given = real_argument(argument, values)
    expect(given.shape in ((), (n,)), argument, f"one number or shape ({n},), one a surface", f"shape {given.shape}")
    return np.array(np.broadcast_to(given, (n,)), np.float64)


def _is_no_kelvin(degrees: Floats) -> NDArray[np.bool_]:
    return (degrees < 0.0) | (degrees > _HOTTEST)


def _sky_kelvin(degrees: float | None) -> float:
    given = real_argument("sky_temperature", 0.0 if degrees is None else degrees)
    good = given.ndim == 0 and bool(0.0 <= given <= _HOTTEST)
    expect(good, "sky_temperature", f"a number from 0 to {_HOTTEST:g} in kelvin, or None", repr(degrees))
    return float(given)


def _expect_sources(exchange: Exchange, adiabatic: NDArray[np.bool_]) -> None:
    """Raise ``ValueError`` for adiabatic surfaces that see nothing with a temperature, not even over others."""
    reached = ~adiabatic | (exchange.sky > 0.0)
    while True:
        seen = np.asarray(exchange.matrix @ reached.astype(np.float64)) > 0.0
        if not (seen & ~reached).any():
            break
        reached |= seen
    if not reached.all():
        row = int((~reached).argmax())
        expect(False, "temperature", "one for a surface that each adiabatic one sees", f"none for that of row {row}")

"""The linear system B = E + rho F B: its solution by conjugate gradients, and a bound of its error.

F is no symmetric matrix, but A F = S is, for the areas A. In the unknowns z = sqrt(A / rho) (B - E) the system becomes

    (1 - M) z = M sqrt(A / rho) E',   M = sqrt(rho / A) S sqrt(rho / A)

whose matrix is symmetric and positive definite: M has the eigenvalues of rho F, which are at most max(rho) if rows of F
have sums of at most 1. The condition number is at most (1 + max(rho)) / (1 - max(rho)). So the number of iterations
depends on rho, not on the number of surfaces.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.radiosity.surfaces import Exchange
from renderer.studies.factors.sparse import scipy_sparse

Floats = NDArray[np.float64]

# Enough for a condition number of 10^6: conjugate gradients gain a digit in about its root.
_TRIAL_ITERATIONS = 2000


class System(NamedTuple):
    """n surfaces in c channels: B = source + reflectance F B.

    source       (n, c): what surfaces send themselves, and what they return of the sky's
    reflectance  (n, c), >= 0
    """

    exchange: Exchange
    source: Floats
    reflectance: Floats


class Solution(NamedTuple):
    """The solution of a system.

    values      (n, c), B
    gathered    (n, c), F B
    residual    the largest |source + reflectance F B - B|, as computed
    bound       of the largest error of B
    iterations  of conjugate gradients
    """

    values: Floats
    gathered: Floats
    residual: float
    bound: float
    iterations: int


def solved(system: System, amplification: float, rtol: float, max_iterations: int) -> Solution:
    """The solution with ``bound`` <= ``rtol`` times its largest value.

    amplification  bounds the largest row sum of the inverse of 1 - reflectance F; see ``amplification_of``

    Raises ``ValueError`` naming ``rtol`` if rounding alone exceeds that, or ``max_iterations`` if there are not enough.
    """
    # By a power of two, so that no square overflows or vanishes.
    unit = 2.0 ** float(np.frexp(system.source.max(initial=0.0))[1])
    found = _solved(system._replace(source=system.source / unit), amplification, rtol, max_iterations)
    values, gathered, residual, bound, iterations = found
    return Solution(values * unit, gathered * unit, residual * unit, bound * unit, iterations)


def _solved(system: System, amplification: float, rtol: float, max_iterations: int) -> Solution:
    """``solved`` for sources whose largest is from 1/2 to 1, or all 0."""
    operator, wanted, weights = _symmetric(system)
    z, iterations, tolerance = np.zeros(wanted.size), 0, rtol
    while True:
        z, used = _iterate(operator, wanted, z, tolerance, max_iterations - iterations)
        iterations += used
        found = _with_bound(system, weights * z.reshape(wanted.shape), amplification, iterations)
        largest = float(found.values.max(initial=0.0))
        if found.bound <= rtol * largest:
            return found
        least = _rounding(system.exchange, largest) * amplification / largest
        if least > 0.5 * rtol:
            raise ValueError(f"rtol: expected at least {2.0 * least:.2g}, which rounding allows here, got {rtol:g}")
        if iterations >= max_iterations:
            expected = f"more iterations, as these leave a bound of {found.bound / largest:.2g} times the largest value"
            raise ValueError(f"max_iterations: expected {expected}, got {max_iterations}")
        # In the norm of conjugate gradients small surfaces weigh little.
        tolerance *= 0.5 * min(1.0, rtol * largest / found.bound)


def amplification_of(system: System) -> float:
    """A bound of the largest error of B for a residual of at most 1: of the row sums of the inverse of 1 - rho F.

    All terms of that inverse, 1 + rho F + (rho F)^2 + ..., are >= 0, so it is 1 / (1 - q) for the largest row sum q of
    rho F, if that is below 1. Otherwise any w >= 0 for which no entry of (1 - rho F) w is below d > 0 gives the bound
    max(w) / d (Varga, Matrix Iterative Analysis, 1962, on M-matrices). Infinite if no such w is found.
    """
    exchange = system.exchange
    q = float((system.reflectance * exchange.rows[:, None]).max(initial=0.0)) * (1.0 + exchange.slack)
    return 1.0 / (1.0 - q) if q < 1.0 else _by_trial(system._replace(source=np.ones((len(exchange.areas), 1))))


def _by_trial(system: System) -> float:
    """``amplification_of`` by the w of which (1 - rho F) w is about 1."""
    operator, wanted, weights = _symmetric(system)
    z = np.zeros(wanted.size)
    # Each tenth of the error costs some iterations; a system that needs more digits is as good as singular.
    for tolerance in (1e-2, 1e-4, 1e-6, 1e-8, 1e-10):
        z, _ = _iterate(operator, wanted, z, tolerance, _TRIAL_ITERATIONS)
        w = np.maximum(1.0 + weights * z.reshape(wanted.shape), 0.0)
        largest = float(w.max())
        least = float((w - system.reflectance * _gathered(system.exchange, w)).min())
        least -= _rounding(system.exchange, largest)
        if least > 0.5:
            return largest / least
    return math.inf


def _symmetric(system: System) -> tuple[object, Floats, Floats]:
    """The operator 1 - M on vectors of n c numbers, the right-hand side (n, c), and the weights that make z B - E'."""
    sparse, exchange = scipy_sparse(), system.exchange
    weights = np.sqrt(system.reflectance / exchange.areas[:, None])
    shape = np.broadcast_shapes(weights.shape, system.source.shape)
    weights = np.ascontiguousarray(np.broadcast_to(weights, shape))

    def times(z: Floats) -> Floats:
        # One product with the matrix for all channels.
        columns = z.reshape(shape)
        rows: Floats = columns - weights * np.asarray(exchange.matrix @ (weights * columns))
        return rows.reshape(-1)

    size = weights.size
    operator = sparse.linalg.LinearOperator((size, size), matvec=times, dtype=np.float64)
    wanted = weights * np.asarray(exchange.matrix @ np.ascontiguousarray(np.broadcast_to(system.source, shape)))
    return operator, wanted, weights


def _iterate(operator: object, wanted: Floats, start: Floats, tolerance: float, most: int) -> tuple[Floats, int]:
    """A better z by conjugate gradients, and the number of iterations."""
    count = 0

    def one_more(_: Floats) -> None:
        nonlocal count
        count += 1

    cg = scipy_sparse().linalg.cg
    z, _ = cg(operator, wanted.reshape(-1), x0=start, rtol=tolerance, atol=0.0, maxiter=most, callback=one_more)
    return z, count


def _with_bound(system: System, returned: Floats, amplification: float, iterations: int) -> Solution:
    """The solution from B - E' as found, which the exact one has nowhere below 0."""
    exchange, source = system.exchange, system.source
    values = source + np.maximum(returned, 0.0)
    gathered = _gathered(exchange, values)
    residual = float(np.abs((source - values) + system.reflectance * gathered).max(initial=0.0))
    bound = (residual + _rounding(exchange, float(values.max(initial=0.0)))) * amplification
    return Solution(values, gathered, residual, bound, iterations)


def _gathered(exchange: Exchange, values: Floats) -> Floats:
    """F B, (n, c)."""
    return np.asarray(exchange.matrix @ values) / exchange.areas[:, None]


def _rounding(exchange: Exchange, largest: float) -> float:
    """By how much rounding moves a residual: each of its terms is at most the largest value, or a row's share of it."""
    return exchange.slack * largest * max(1.0, float(exchange.rows.max(initial=0.0)))

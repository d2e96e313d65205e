"""Values and roots of polynomials whose coefficients run from the lowest power to the highest."""

import math
from collections.abc import Sequence
from functools import reduce

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

# Of an imaginary part, relative to its root: that of a double root of float64 coefficients.
_REAL = 1e-9


def polynomial(coefficients: Sequence[float], x: Floats) -> Floats:
    """The values at ``x``, by Horner's rule."""
    return reduce(lambda value, coefficient: value * x + coefficient, reversed(coefficients), np.zeros_like(x))


def least_positive_root(coefficients: Sequence[float]) -> float:
    """The least root above 0 of a polynomial whose value at 0 is 1; infinity if there is none.

    >>> round(least_positive_root((1.0, 0.0, -4.0)), 12), least_positive_root((1.0, 0.0, 4.0))
    (0.5, inf)
    """
    # NumPy takes the highest power first: these are the roots in 1 / x, whose highest power has the coefficient 1.
    inverses = np.roots(coefficients)
    real = inverses.real[(np.abs(inverses.imag) <= _REAL * np.abs(inverses)) & (inverses.real > 0.0)]
    return 1.0 / float(real.max()) if len(real) else math.inf

"""Errors of hits against exact ones: the error of t, relative and in ulp, as percentiles and as a histogram."""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from validation.oracle.exact import ExactHit

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

# Bins of relative errors: below 1e-17, which only the exact float64 reaches; decades; and 0.1 or more.
EXPONENTS = tuple(range(-17, 0))
_EDGES = (0.0, *(10.0**exponent for exponent in EXPONENTS), np.inf)


@dataclass(frozen=True)
class Truth:
    """Exact closest hits of n rays as arrays.

    ``t`` (n,) float64 is the exact distance rounded, inf on a miss, and ``rest`` (n,) is the exact distance minus it;
    ``faces`` (n,) holds all faces that attain it, none on a miss.
    """

    t: Floats
    rest: Floats
    faces: tuple[tuple[int, ...], ...]

    @property
    def hit(self) -> Bools:
        return np.isfinite(self.t)

    def select(self, rows: Ints) -> "Truth":
        """The exact hits of the rays at ``rows``."""
        return Truth(self.t[rows], self.rest[rows], tuple(self.faces[row] for row in rows.tolist()))


def truth(exact_hits: Sequence[ExactHit | None]) -> Truth:
    """The results of ``exact.closest_hits`` as arrays."""
    rounded = [np.inf if hit is None else float(hit.t) for hit in exact_hits]
    rest = [0.0 if hit is None else float(hit.t - Fraction(t)) for hit, t in zip(exact_hits, rounded, strict=True)]
    return Truth(np.array(rounded), np.array(rest), tuple(() if hit is None else hit.faces_at_t for hit in exact_hits))


@dataclass(frozen=True)
class ErrorSizes:
    """Rays by outcome, and errors of t over those that name a face at the exact distance.

    Percentiles are 0 without such rays. ``histogram`` counts relative errors in the bins of ``EXPONENTS``. An exact
    distance of 0 has no relative error and is left out of both.
    """

    rays: int
    missed: int
    false_hits: int
    other_face: int
    right_face: int
    relative_p50: float
    relative_p99: float
    relative_max: float
    ulp_p50: float
    ulp_p99: float
    ulp_max: float
    histogram: tuple[int, ...]


def error_sizes(t: Floats, face: Ints, exactly: Truth) -> ErrorSizes:
    """Errors of ``t`` (n,), inf on a miss, and ``face`` (n,), -1 on a miss; ``ulp`` are those of float64 at exact t."""
    both = np.flatnonzero((face >= 0) & exactly.hit)
    names_it = [named in exactly.faces[ray] for ray, named in zip(both.tolist(), face[both].tolist(), strict=True)]
    right = both[np.array(names_it, dtype=np.bool_)]
    rows = right[exactly.t[right] > 0]
    # Near the exact t the first difference is exact, so the result errs by a roundoff of the error itself.
    error = np.abs((t[rows] - exactly.t[rows]) - exactly.rest[rows])
    relative, ulp = error / exactly.t[rows], error / np.spacing(exactly.t[rows])
    return ErrorSizes(
        len(t),
        int(np.count_nonzero((face < 0) & exactly.hit)),
        int(np.count_nonzero((face >= 0) & ~exactly.hit)),
        len(both) - len(right),
        len(right),
        *percentiles(relative),
        *percentiles(ulp),
        tuple(np.histogram(relative, _EDGES)[0].tolist()),
    )


def percentiles(values: Floats) -> tuple[float, float, float]:
    """Median, 99th percentile and maximum; 0 for an empty array."""
    if not len(values):
        return 0.0, 0.0, 0.0
    p50, p99 = np.percentile(values, (50, 99))
    return float(p50), float(p99), float(values.max())

"""Extreme cases 1 to 32, 46, 49 and 50: hits."""

from validation.stability.cases import builds, edge_on, order, precision, rays, thin
from validation.stability.cases.case import ExtremeCase

CASES: tuple[ExtremeCase, ...] = (
    *rays.CASES,
    *precision.CASES,
    *builds.CASES,
    *order.CASES,
    *thin.CASES,
    *edge_on.CASES,
)

"""Extreme cases 1 to 32, 46 and 49: hits."""

from validation.stability.cases import builds, order, precision, rays, thin
from validation.stability.cases.case import ExtremeCase

CASES: tuple[ExtremeCase, ...] = (
    *rays.CASES,
    *precision.CASES,
    *builds.CASES,
    *order.CASES,
    *thin.CASES,
)

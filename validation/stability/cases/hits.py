"""Extreme cases 1 to 32, 46 and 49: hits."""

from validation.stability.cases import builds as extreme_builds
from validation.stability.cases import order as extreme_order
from validation.stability.cases import precision as extreme_precision
from validation.stability.cases import rays as extreme_rays
from validation.stability.cases import thin as extreme_thin
from validation.stability.cases.case import ExtremeCase

CASES: tuple[ExtremeCase, ...] = (
    *extreme_rays.CASES,
    *extreme_precision.CASES,
    *extreme_builds.CASES,
    *extreme_order.CASES,
    *extreme_thin.CASES,
)

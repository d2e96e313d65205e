"""Rows 1 to 32 and 46 of the extreme cases: everything about hits."""

from validation import extreme_builds, extreme_order, extreme_precision, extreme_rays
from validation.extreme import ExtremeCase

CASES: tuple[ExtremeCase, ...] = (
    *extreme_rays.CASES,
    *extreme_precision.CASES,
    *extreme_builds.CASES,
    *extreme_order.CASES,
)

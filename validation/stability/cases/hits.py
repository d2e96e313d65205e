"""Extreme cases 1 to 32, 46 and 49 to 54: hits and queries."""

from validation.stability.cases import builds, edge_on, order, precision, rays, thin
from validation.stability.cases.case import ExtremeCase
from validation.stability.cases.queries import contacts, crowded, inside, nearest

CASES: tuple[ExtremeCase, ...] = (
    *rays.CASES,
    *precision.CASES,
    *builds.CASES,
    *order.CASES,
    *thin.CASES,
    *edge_on.CASES,
    *inside.CASES,
    *contacts.CASES,
    *nearest.CASES,
    *crowded.CASES,
)

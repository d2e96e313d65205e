"""Spheres: beside a disc, beside another sphere, within another sphere."""

import numpy as np

from validation.oracle.view_factors.quadrature import integral


def to_disc(radius: float, distance: float) -> float:
    """F from a sphere to a disc whose axis goes through its centre, ``distance`` off (C-113).

    It is the share of all directions that the disc covers, seen from the centre, whatever the sphere's radius up to the
    distance.

    >>> to_disc(1.0, 1.0)
    0.146446609406726...
    """
    return float(0.5 * (1.0 - distance / np.hypot(distance, radius)))


def from_disc(sphere: float, disc: float, distance: float) -> float:
    """F from a disc to a sphere in front of it, by reciprocity."""
    return 4.0 * (sphere / disc) ** 2 * to_disc(disc, distance)


def element_to_sphere(angle: float, distance: float, radius: float) -> float:
    """F from a small plane area to a sphere, ``angle`` between its normal and the centre, ``distance`` > radius (B-38).

    Where the area's plane cuts the sphere only the part above it counts.
    """
    h = distance / radius
    cosine, sine = np.cos(angle), np.sin(angle)
    # How far the centre is above the plane, in radii.
    above = h * cosine
    if above >= 1.0:
        return float(cosine / (h * h))
    if above <= -1.0:
        return 0.0
    root = np.sqrt(h * h - 1.0)
    whole = np.arccos(np.clip(-root * cosine / sine, -1.0, 1.0))
    cut = np.arcsin(np.clip(root / (h * sine), -1.0, 1.0))
    return float(0.5 - cut / np.pi + (cosine * whole - root * np.sqrt(1.0 - above * above)) / (np.pi * h * h))


def to_sphere(radius: float, other: float, distance: float) -> float:
    """F from a sphere to another one, centres ``distance`` apart: the mean of ``element_to_sphere`` over it.

    The integral over the angle from the axis is numerical, to about 1e-12: it has pieces where nothing, a part, or
    all of the other sphere is above the element's plane.
    """

    def ring(turn: float) -> float:
        along, aside = distance - radius * np.cos(turn), radius * np.sin(turn)
        away = float(np.hypot(along, aside))
        cosine = (along * np.cos(turn) - aside * np.sin(turn)) / away
        return 0.5 * np.sin(turn) * element_to_sphere(float(np.arccos(np.clip(cosine, -1.0, 1.0))), away, other)

    # The other centre is distance cos(turn) - radius above an element's plane.
    ends = [np.arccos(np.clip((radius + side * other) / distance, -1.0, 1.0)) for side in (1.0, -1.0)]
    return integral(ring, [0.0, *map(float, ends)], count=80)


def within(inner: float, outer: float) -> tuple[float, float]:
    """F from a sphere to one within it, and to itself: (r / R)^2 and the rest, wherever the inner one is.

    What leaves a convex body within a closed one reaches the outer one: A1 F12 is the inner area.

    >>> within(1.0, 2.0)
    (0.25, 0.75)
    """
    share = (inner / outer) ** 2
    return share, 1.0 - share

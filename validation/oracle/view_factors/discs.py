"""Coaxial discs that face each other, also with a smaller disc between them."""

import numpy as np

from validation.oracle.view_factors.quadrature import integral


def coaxial(radius: float, other: float, distance: float) -> float:
    """F from a disc to another one (C-41): (X - sqrt(X^2 - 4 (r2 / r1)^2)) / 2, X = 1 + (1 + R2^2) / R1^2.

    Written without the difference, in which digits would cancel.

    >>> coaxial(1.0, 1.0, 1.0)
    0.381966011250105...
    """
    one, two = radius / distance, other / distance
    x, ratio = 1.0 + (1.0 + two * two) / (one * one), (other / radius) ** 2
    return float(2.0 * ratio / (x + np.sqrt(x * x - 4.0 * ratio)))


def element_to_disc(aside: float, radius: float, distance: float) -> float:
    """F from a small plane area, parallel to the disc and ``aside`` of its axis (B-13)."""
    return _arc(aside, radius, distance, np.pi)


def through_disc(radius: float, other: float, distance: float, between: float, share: float) -> float:
    """A1 F12 of the lines between two discs that pass through a third one of radius ``between``.

    The third one stands at the share 0 < ``share`` < 1 of the distance. A point at p of the first disc sees it cover,
    in the plane of the second one, a disc of radius between / share, centred p / share off the point's foot; the
    second disc's centre is p off. What the point sees of both is a lens, whose view factor is the contour integral
    over two arcs. The integral over p is numerical, to about 1e-12: pieces end where one of the circles begins to
    hold the other.
    """
    cover = between / share
    # The distance of the centres is p (1 / share - 1).
    spread = 1.0 / share - 1.0
    kinks = sorted(k for k in (abs(other - cover) / spread, (other + cover) / spread) if 0.0 < k < radius)
    return integral(
        lambda p: 2.0 * np.pi * p * _lens(p, other, p / share, cover, distance), [0.0, *kinks, radius], count=80
    )


def with_disc_between(radius: float, other: float, distance: float, between: float, share: float) -> float:
    """F from a disc to another one where a third disc hides a part; see ``through_disc``.

    >>> with_disc_between(1.0, 1.0, 2.0, 1.0, 0.5)
    0.0...
    """
    hidden = through_disc(radius, other, distance, between, share) / (np.pi * radius * radius)
    # A third disc as wide as both hides all, but for rounding.
    return max(0.0, coaxial(radius, other, distance) - hidden)


def _lens(first: float, radius: float, second: float, other: float, height: float) -> float:
    """F from an element to what two discs at this height share, centres ``first`` <= ``second`` off its foot."""
    apart = second - first
    if apart >= radius + other:
        return 0.0
    if apart <= abs(radius - other):
        return _arc(first, radius, height, np.pi) if radius < other else _arc(second, other, height, np.pi)
    crossing = (radius * radius - other * other - first * first + second * second) / (2.0 * apart)
    right = np.arccos(np.clip((crossing - first) / radius, -1.0, 1.0))
    left = np.arccos(np.clip((crossing - second) / other, -1.0, 1.0))
    # Of the farther circle the arc is that around its nearest point.
    return _arc(first, radius, height, right) + _arc(second, other, height, np.pi) - _arc(second, other, height, left)


def _arc(centre: float, radius: float, height: float, half: float) -> float:
    """The contour integral (x dy - y dx) / (2 pi (x^2 + y^2 + h^2)) over the arc from -half to half of a circle.

    The integrand is 1/2 + (r^2 - M / 2) / (M + N cos t), M = e^2 + r^2 + h^2, N = 2 e r.
    """
    m, n = centre * centre + radius * radius + height * height, 2.0 * centre * radius
    root = np.sqrt((m - n) * (m + n))
    angle = np.pi / 2.0 if half >= np.pi else np.arctan(np.sqrt((m - n) / (m + n)) * np.tan(half / 2.0))
    return float((half + (radius * radius - m / 2.0) * 4.0 / root * angle) / (2.0 * np.pi))

"""Two coaxial cylinders of equal length. Of endless ones the outer has F = r / R to the inner, the rest to itself."""

import numpy as np


def to_inner(inner: float, outer: float, length: float) -> float:
    """F from the inside of the outer cylinder to the inner one (C-91).

    >>> round(to_inner(1.0, 2.0, 1e6), 5)
    0.5
    """
    r, h = outer / inner, length / inner
    a, b = h * h + r * r - 1.0, h * h - r * r + 1.0
    root = np.sqrt((a + 2.0) ** 2 - 4.0 * r * r)
    part = root * np.arccos(b / (r * a)) + b * np.arcsin(1.0 / r) - np.pi * a / 2.0
    return float((1.0 - (np.arccos(b / a) - part / (2.0 * h)) / np.pi) / r)


def to_itself(inner: float, outer: float, length: float) -> float:
    """F from the inside of the outer cylinder to itself, past the inner one (C-92).

    >>> round(to_itself(1.0, 2.0, 1e6), 5)
    0.5
    """
    r, h = outer / inner, length / inner
    r2, long = r * r, np.sqrt(4.0 * r * r + h * h)
    turn = np.arcsin((4.0 * (r2 - 1.0) + h * h / r2 * (r2 - 2.0)) / (h * h + 4.0 * (r2 - 1.0)))
    part = long / h * turn - np.arcsin((r2 - 2.0) / r2) + np.pi / 2.0 * (long / h - 1.0)
    first = 1.0 - 1.0 / r + 2.0 / (np.pi * r) * np.arctan(2.0 * np.sqrt(r2 - 1.0) / h)
    return float(first - h / (2.0 * np.pi * r) * part)

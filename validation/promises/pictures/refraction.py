"""Refraction into denser matter, the most grazing too: the cosine that Fresnel's share comes from keeps all digits."""

from decimal import Decimal, localcontext
from typing import Any

import numpy as np
from numpy.random import Generator

from renderer.shade.shading import refract
from validation.promises.row import row

# Four roundings of a square, halved by the root, and the root's own.
_ROUNDING = 4 * 2.0**-53
_DIGITS = 60


def check_refraction(rng: Generator, count: int) -> list[dict[str, Any]]:
    """Directions from straight to 1e-8 beside the surface, and indices equal but for an ulp to four times the other."""
    kept = []
    for number in range(count):
        beside = 10.0 ** rng.uniform(-8.0, 0.0)
        n2 = 1.0 + (10.0 ** rng.uniform(-15.5, 0.5) if number % 2 else 2.0**-52)
        cosine = np.sin(beside)
        found = refract((float(np.cos(beside)), 0.0, float(-cosine)), (0.0, 0.0, 1.0), 1.0, float(n2))[0]
        kept.append(abs(found - _exact(float(cosine), float(n2))) <= _ROUNDING * found)
    return [row("the cosine of refracted light keeps its digits", "60-digit arithmetic", np.array(kept))]


def _exact(cosine: float, n2: float) -> float:
    with localcontext() as context:
        context.prec = _DIGITS
        eta = 1 / Decimal(n2)
        return float((1 - eta * eta * (1 - Decimal(cosine) ** 2)).sqrt())

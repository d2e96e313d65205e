"""The distance of two surface points that were clicked on, and a bound of its error."""

import math
from fractions import Fraction
from typing import Any, NamedTuple

from renderer.viewer.protocol import Measure, Pixel
from renderer.viewer.shown import ShownScene
from renderer.viewer.viewpoint import ray_through

# Beside the errors of t, as a share of the distance: components are rounded (2^-53), the hypotenuse errs by less than
# an ulp (2^-52), and decimals as a page writes them by half of one (2^-53).
_ROUNDED = 2.0**-51
# The bound itself is computed with a few roundings, and lengths of directions with two.
_MORE = 1.0 + 2.0**-40


class Spot(NamedTuple):
    """A surface point as a picture finds it: where the ray from ``origin`` is at ``t``, which errs by at most
    ``t_error``. All are float64.
    """

    origin: list[float]
    direction: list[float]
    t: float
    t_error: float

    @property
    def point(self) -> list[Fraction]:
        """The point, without rounding."""
        along = zip(self.origin, self.direction, strict=True)
        return [Fraction(o) + Fraction(self.t) * Fraction(d) for o, d in along]

    @property
    def error(self) -> float:
        """A bound of the distance from the point to where the exact ray hits the exact plane of its face."""
        return self.t_error * math.hypot(*self.direction)


class Distance(NamedTuple):
    """The vector between two points, its length, and the bound of the error of the length and of each component."""

    vector: list[float]
    length: float
    bound: float


def measured(shown: ShownScene, asked: Measure) -> dict[str, Any]:
    """The message for ``asked``: its points, null where a ray hits nothing, and the distance of two."""
    spots = [spot_at(shown, pixel) for pixel in asked.pixels]
    points = [None if spot is None else [float(x) for x in spot.point] for spot in spots]
    found = [spot for spot in spots if spot is not None]
    distance = distance_of(*found)._asdict() if len(found) == 2 else None
    return {"type": "measure", "seq": asked.seq, "scene": shown.id, "points": points, "distance": distance}


def spot_at(shown: ShownScene, pixel: Pixel) -> Spot | None:
    """The surface point that a pixel sees; None where it sees none."""
    origin, direction = ray_through(pixel)
    hits = shown.prepared.octree.closest_hit(origin[None], direction[None], t_error=True)
    if not hits.hit[0]:
        return None
    assert hits.t_error is not None
    return Spot(origin.tolist(), direction.tolist(), float(hits.t[0]), float(hits.t_error[0]))


def distance_of(one: Spot, other: Spot) -> Distance:
    """The way from ``one`` to ``other``.

    It is computed from the rays without rounding, so that coordinates far from the origin cost no digits, and rounded
    at the end. What remains is the error of each point along its ray: by the triangle inequality neither the vector
    nor its length errs by more than both together.
    """
    vector = [float(b - a) for a, b in zip(one.point, other.point, strict=True)]
    length = math.hypot(*vector)
    return Distance(vector, length, (one.error + other.error + _ROUNDED * length) * _MORE)

"""The tree of rays behind one camera ray, as a renderer traced it: hits, shadow rays and children."""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
Kind = Literal["camera", "reflected", "refracted"]


@dataclass
class Shadow:
    """A shadow ray in a unit direction, over a length; the radiance that it brings if nothing hides the light; and the
    face that hides it, where a renderer says so.
    """

    origin: Vector
    direction: Vector
    length: float
    radiance: Vector
    hidden: bool
    face: int = -1


@dataclass
class Node:
    """A ray in a unit direction, and what it hit.

    kind       "camera", "reflected" or "refracted"
    depth      bounces before it
    share      what the ray before it receives of its radiance, for each channel
    face       that it hit, in the order of the scene's instances; -1 on a miss
    t          the distance to it; inf on a miss
    point      where it hit; normal and shading are the unit normals there, on the side of the winding
    indices    of refraction before and beyond the surface, where a renderer says so and light passes
    own        radiance without lights: ambient light, or the background on a miss
    shadows    by the light's number, where the surface faces the light
    children   by kind
    """

    kind: Kind
    depth: int
    origin: Vector
    direction: Vector
    share: Vector
    face: int = -1
    t: float = np.inf
    point: Vector = field(default_factory=lambda: np.full(3, np.nan))
    normal: Vector = field(default_factory=lambda: np.full(3, np.nan))
    shading: Vector = field(default_factory=lambda: np.full(3, np.nan))
    indices: tuple[float, float] | None = None
    own: Vector = field(default_factory=lambda: np.zeros(3))
    shadows: dict[int, Shadow] = field(default_factory=dict)
    children: dict[Kind, "Node"] = field(default_factory=dict)

    def radiance(self) -> Vector:
        """The radiance against the ray."""
        lit = [shadow.radiance for shadow in self.shadows.values() if not shadow.hidden]
        return sum([*lit, *(child.share * child.radiance() for child in self.children.values())], self.own)

    def size(self) -> int:
        """The number of its rays, shadow rays included."""
        return 1 + len(self.shadows) + sum(child.size() for child in self.children.values())

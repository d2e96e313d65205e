"""The table of references for closest hits, behind one interface."""

from collections.abc import Callable
from functools import partial
from importlib import metadata
from typing import Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from validation.references import embree, igl, trimesh_rays
from validation.references.brute import Brute
from validation.references.embree import Embree
from validation.references.igl import Igl
from validation.references.mitsuba import hits as mitsuba_hits
from validation.references.mitsuba.hits import MitsubaHits
from validation.references.trimesh_rays import TrimeshRays

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class Caster(Protocol):
    """A hit query over one triangle mesh."""

    def closest_hit(self, origins: Floats, directions: Floats) -> tuple[Floats, Ints]:
        """Closest hits of rays (n, 3): ``t`` (n,), inf on a miss, and ``face`` (n,), -1 on a miss."""


class HitReference(NamedTuple):
    """A reference for hits.

    key         its name in records
    name        its name in the report
    version     of its package
    precision   of its hit test; a float32 reference rounds all its input
    most_rays   the largest number of rays that it gets from a family
    most_faces  the size of the largest mesh that it gets
    make        builds it from vertices, float64 (V, 3), and faces, (F, 3)
    stored      the precision of its t; None where it equals ``precision``
    """

    key: str
    name: str
    version: str
    precision: Literal["float32", "float64"]
    most_rays: int
    most_faces: int
    make: Callable[[Floats, NDArray[np.integer]], Caster]
    stored: Literal["float32", "float64"] | None = None


# More rays or faces than there are.
ALL = 10**9

# Measured a ray on two cores: Embree and libigl 1 us or less; Mitsuba from Python 1 to 5 us, and Embree, which finds
# its hits, has all rays anyway; brute force 2.5 ns a face; trimesh 0.2 ms at 2,000 faces and 10 ms at 16,000.
REFERENCES: tuple[HitReference, ...] = (
    HitReference("embree_robust", "Embree robust", embree.version(), "float32", ALL, ALL, Embree),
    HitReference(
        "embree_default", "Embree default", embree.version(), "float32", ALL, ALL, partial(Embree, robust=False)
    ),
    HitReference("igl", "libigl", igl.version(), "float64", ALL, ALL, Igl, stored="float32"),
    HitReference("mitsuba", "Mitsuba", mitsuba_hits.version(), "float32", 2_000, ALL, MitsubaHits),
    HitReference("trimesh", "trimesh", trimesh_rays.version(), "float64", 200, 2_000, TrimeshRays),
    HitReference("brute_force", "brute force", metadata.version("octree-renderer"), "float64", 300, 50_000, Brute),
)

"""The surfaces between which view factors are computed: faces or groups of them, and the sides that they send from."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.arrays import real_argument
from renderer.arguments.types import ArrayLike
from renderer.errors import expect
from renderer.mesh.mesh import Mesh
from renderer.queryable import Queries
from renderer.studies.factors.covered import twins_of
from renderer.studies.translucent import check_transmittance
from renderer.trace.batch import whole_numbers

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class Surfaces(NamedTuple):
    """n surfaces of the F faces of a mesh, checked.

    of_face        (F,) int64: the surface that each face belongs to
    areas          (n,) float64: the area that sends, of both sides where both send, times what is not let through
    weights        (F,) float64: the share of each face in that
    both           (F,) bool: whether a face sends from both sides
    transmittance  (F,) float64
    twin, covered  as of ``covered.Twins``; a face that is covered sends and receives nothing
    """

    of_face: Integers
    areas: Floats
    weights: Floats
    both: NDArray[np.bool_]
    transmittance: Floats
    twin: Integers
    covered: NDArray[np.bool_]

    @property
    def number(self) -> int:
        """The number of surfaces."""
        return len(self.areas)

    @property
    def two_sided(self) -> bool:
        """Whether all faces send from both sides."""
        return bool(self.both.all())


def check_surfaces(octree: Queries, groups: ArrayLike | None, sides: str, transmittance: ArrayLike | None) -> Surfaces:
    """The arguments of ``view_factors``, checked. Raises ``ValueError`` naming argument and row."""
    mesh, count = octree.mesh, len(octree.mesh.faces)
    expect(count > 0, "octree", "a mesh with faces", "none")
    shares = np.zeros(count) if transmittance is None else check_transmittance("transmittance", transmittance, count)
    known = isinstance(sides, str) and sides in ("front", "both")
    expect(known, "sides", "'front' or 'both'", repr(sides))
    of_face = np.arange(count) if groups is None else _check_groups(groups, count)
    both = (shares > 0.0) | (sides == "both")
    sizes = areas_of(mesh)
    # rule: area-that-sends
    weights = sizes * np.where(both, 2.0, 1.0) * (1.0 - shares)
    areas = np.asarray(np.bincount(of_face, weights), np.float64)
    empty = ~(areas > 0.0)
    if empty.any():
        row = int(empty.argmax())
        faces = np.flatnonzero(of_face == row)[:4].tolist()
        clear = f"1 for all faces of surface {row}"
        expect(not (sizes[of_face == row] > 0.0).any(), "transmittance", "less than 1 in each surface", clear)
        expect(False, "groups", "surfaces with an area", f"none in surface {row}, of the faces {faces}")
    expect(bool(np.isfinite(areas).all()), "octree", "areas below the largest float64", "larger ones")
    twins = twins_of(octree)
    return Surfaces(of_face, areas, weights, both, shares, twins.twin, twins.covered & ~both)


def areas_of(mesh: Mesh) -> Floats:
    """The areas of faces (F,), in the mesh's unit."""
    corners = mesh.vertices[mesh.faces]
    with np.errstate(over="ignore", invalid="ignore"):
        return 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)


def _check_groups(groups: ArrayLike, count: int) -> Integers:
    given: Integers = np.array(whole_numbers("groups", real_argument("groups", groups), (count,)), np.int64)
    below = given < 0
    if below.any():
        row = int(below.argmax())
        expect(False, "groups", "surfaces from 0 up for all faces", f"{given[row]} in row {row}")
    most = int(given.max())
    present = np.zeros(min(most, count) + 1, np.bool_)
    present[given[given < len(present)]] = True
    if most >= count or not present.all():
        missing = int((~present).argmax()) if not present.all() else count
        expect(False, "groups", "each surface from 0 to the largest", f"no face of surface {missing}")
    return given

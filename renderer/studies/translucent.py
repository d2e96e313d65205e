"""The faces of a mesh that let a share of the light through, such as trees, shades and screens.

They are divided from the others: opaque faces hide, and translucent faces have a tree of their own, in which rays are
traced through all that they cross. A face that lets all light through is in neither.
"""

from __future__ import annotations

from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.arrays import real_argument
from renderer.arguments.types import ArrayLike
from renderer.errors import expect
from renderer.mesh.mesh import Mesh
from renderer.octree import BruteForce, Octree
from renderer.queryable import Built, Queries

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class Division(NamedTuple):
    """A mesh divided by the transmittance of its faces.

    built          the mesh and the tree that are divided
    transmittance  (F,) float64, from 0 to 1
    opaque         the faces of transmittance 0; the whole mesh as given if that is all of them
    panes          the faces between 0 and 1, None if there is none
    shares         float64, the transmittance of each face of ``panes``
    in_opaque      (F + 1,) int64, the number of each face in ``opaque``, -1 for none; the last one is for no face
    in_panes       the same for ``panes``
    """

    built: Built
    transmittance: Floats
    opaque: Queries
    panes: Queries | None
    shares: Floats
    in_opaque: Integers
    in_panes: Integers


# The last division of each octree: the parts of a long study, and studies of the same shades, build its trees once.
_LAST: WeakKeyDictionary[Queries, Division] = WeakKeyDictionary()


def check_transmittance(argument: str, transmittance: ArrayLike, count: int) -> Floats:
    """The share of a ray that each of ``count`` faces lets through. Raises ``ValueError`` naming argument and row."""
    given = real_argument(argument, transmittance)
    expect(given.shape == (count,), argument, f"shape ({count},), one a face", f"shape {given.shape}")
    shares: Floats = np.array(given, np.float64)
    bad = ~((shares >= 0.0) & (shares <= 1.0))
    if bad.any():
        row = int(bad.argmax())
        expect(False, argument, "numbers from 0 to 1", f"{shares[row]} in row {row}")
    return shares


def divided(octree: Queries, transmittance: ArrayLike) -> Division:
    """The mesh of an octree divided by the transmittance (F,) of its faces. Raises as ``check_transmittance``."""
    built = octree._built
    shares = check_transmittance("transmittance", transmittance, len(built.mesh.faces))
    last = _LAST.get(octree)
    if last is not None and last.built is built and np.array_equal(last.transmittance, shares):
        return last
    division = _divide(octree, built, shares)
    _LAST[octree] = division
    return division


def _divide(octree: Queries, built: Built, shares: Floats) -> Division:
    opaque, panes = shares == 0.0, (shares > 0.0) & (shares < 1.0)
    return Division(
        built,
        shares,
        octree_over(octree, built.mesh, opaque) if not opaque.all() else _same(octree, built),
        octree_over(octree, built.mesh, panes) if panes.any() else None,
        shares[panes],
        _numbers(opaque),
        _numbers(panes),
    )


def octree_over(octree: Queries, mesh: Mesh, chosen: NDArray[np.bool_]) -> Queries:
    """Another of the octree's kind over some faces of its mesh, whose vertices it shares."""
    part = Mesh(mesh.vertices, mesh.faces[chosen])
    if isinstance(octree, BruteForce):
        return BruteForce.from_mesh(part, threads=octree.threads)
    return Octree.from_mesh(part, threads=octree.threads)


def _same(octree: Queries, built: Built) -> Queries:
    """Another reference to the same mesh and tree: a division that referred to its octree would keep it for good."""
    return Queries(*built, octree.threads)


def _numbers(chosen: NDArray[np.bool_]) -> Integers:
    return np.append(np.where(chosen, np.cumsum(chosen) - 1, -1), -1)

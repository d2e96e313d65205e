"""A mesh as a scene has it: where it stands, of which material, and with which normals."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from renderer.lazy import lazy
from renderer.mesh.mesh import Mesh

_IDENTITY = np.eye(4)
_NO_FACES = np.empty((0, 3), np.int32)
# The share of all that is added by which placed coordinates may differ.
_ROUNDED = 2.0**-45
# Corners up to here are placed without overflow.
_FARTHEST = 1e300
# Vertices that are placed together to see whether float32 holds them.
_TOGETHER = 1 << 12


@dataclass(frozen=True, eq=False)
class Instance:
    """One mesh of a scene with its material's name.

    source  the mesh before it is placed, which instances share
    smooth  whether normals are interpolated
    matrix  (4, 4), from the source to the world
    crease  the angle in degrees above which edges of a smooth mesh without normals stay sharp
    """

    source: Mesh
    material: str
    smooth: bool
    matrix: NDArray[np.float64] = field(default_factory=lambda: _IDENTITY)
    crease: float = 180.0

    def __post_init__(self) -> None:
        middle, reach = self._box
        if not (np.maximum(np.abs(middle), reach) < _FARTHEST).all():
            _ = self.mesh  # which raises for what float64 cannot hold

    @lazy
    def _box(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The middle of a box around the mesh in the world, and half its sides with room for rounding."""
        if not len(self.source.vertices):
            return np.zeros(3), np.zeros(3)
        lower, upper = self.source.bounds
        linear, move = self.matrix[:3, :3], self.matrix[:3, 3]
        with np.errstate(over="ignore", invalid="ignore"):
            middle = linear @ (lower / 2 + upper / 2) + move
            largest = np.maximum(np.abs(lower), np.abs(upper))
            return middle, np.abs(linear) @ (upper / 2 - lower / 2) + _ROUNDED * (np.abs(linear) @ largest + abs(move))

    def may_contain(self, point: NDArray[np.float64]) -> bool:
        """Whether a point in the world may be in the box around the mesh."""
        middle, reach = self._box
        return bool((np.abs(point - middle) <= reach + _ROUNDED * np.abs(point)).all())

    @lazy
    def _moves(self) -> bool:
        return not np.array_equal(self.matrix, _IDENTITY)

    @property
    def shares_normals(self) -> bool:
        """Whether the source has the normals that the mesh needs, if any: those of others are means in the world."""
        return not self.smooth or self.source.normals is not None

    @property
    def faces(self) -> int:
        """The number of faces."""
        return len(self.source.faces)

    def placed(self) -> Mesh:
        """The mesh in the world, with split vertices where smooth shading stops at sharp edges; ``mesh`` keeps it."""
        if "mesh" in self.__dict__:
            return self.mesh
        mesh = self.source.transformed(self.matrix) if self._moves else self.source
        return mesh if self.shares_normals or self.crease >= 180.0 else mesh.creased(self.crease)

    @lazy
    def mesh(self) -> Mesh:
        """``placed``, kept."""
        return self.placed()

    @lazy
    def normals(self) -> NDArray[np.float64]:
        """The file's own vertex normals, or else the mean of the faces around each vertex, (V, 3) float64."""
        return self.mesh.normals if self.mesh.normals is not None else self.mesh.vertex_normals()

    @lazy
    def is_float32(self) -> bool:
        """Whether float32 holds all vertices in the world."""
        if not self._moves:
            return self.source.is_float32
        pieces = np.array_split(self.source.vertices, range(_TOGETHER, len(self.source.vertices), _TOGETHER))
        return all(Mesh(piece, _NO_FACES).transformed(self.matrix).is_float32 for piece in pieces)

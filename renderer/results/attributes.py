"""Attributes at places on a mesh's faces: values of vertices and faces, colours, texture coordinates, parts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from renderer.mesh.mesh import Mesh
from renderer.mesh.parts import part_numbers
from renderer.mesh.values import Owner, interpolated

Values = ArrayLike | Mapping[int, ArrayLike]


class PlacesOnFaces:
    """Places on faces (...), of one mesh or several, with values that ``interpolate`` computes there."""

    __slots__ = ()
    face: NDArray[np.int64]
    interpolate: Callable[..., NDArray[np.float64]]

    def _vertex_values(self, name: str) -> Any:
        """An attribute of the meshes, as ``interpolate`` takes it; None if none has it."""
        raise NotImplementedError

    def take(self, values: Values) -> NDArray[np.float64]:
        """Return values of the faces at the places, as ``interpolate`` with ``on="faces"``.

        Parameters
        ----------
        values : array_like, shape (F, ...), or dict of int to array_like
            A row for each face; of a scene, for each object its values.

        Returns
        -------
        ndarray of float64, shape (..., ...)
            nan on a miss.

        Examples
        --------
        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> Octree(box()).closest_hit([[0.5, 0.25, 3], [5, 5, 5]], [0, 0, -1]).take(range(12))
        array([10., nan])
        """
        return self.interpolate(values, on="faces")

    @property
    def colors(self) -> NDArray[np.float64]:
        """The vertex colours at the places, (..., 3) float64; nan on a miss, and on meshes without colours.

        Examples
        --------
        >>> from renderer import Mesh, Octree
        >>> corners, faces = [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]
        >>> octree = Octree(Mesh(corners, faces, colors=[[1, 0, 0], [0, 1, 0], [0, 0, 1]]))
        >>> octree.closest_hit([0.25, 0.5, 3], [0, 0, -1]).colors
        array([0.25, 0.25, 0.5 ])
        """
        return self._interpolated("colors", 3)

    @property
    def texcoords(self) -> NDArray[np.float64]:
        """The texture coordinates at the places, (..., 2) float64; nan on a miss, and on meshes without them.

        Examples
        --------
        >>> from renderer import Mesh, Octree
        >>> corners, faces = [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]
        >>> octree = Octree(Mesh(corners, faces, texcoords=[[0, 0], [1, 0], [0, 1]]))
        >>> octree.closest_hit([0.25, 0.5, 3], [0, 0, -1]).texcoords
        array([0.25, 0.5 ])
        """
        return self._interpolated("texcoords", 2)

    def _interpolated(self, name: str, width: int) -> NDArray[np.float64]:
        values = self._vertex_values(name)
        if values is None:
            return np.full((*self.face.shape, width), np.nan)
        return self.interpolate(values, on="vertices")


class Attributes(PlacesOnFaces):
    """Places on faces (...), with the values of a mesh there; nan, and part -1, where ``face`` is -1."""

    __slots__ = ()
    u: NDArray[np.float64]
    v: NDArray[np.float64]
    _mesh: Mesh

    @property
    def part(self) -> NDArray[np.int64]:
        """The part of the mesh at each place, as an index of ``octree.mesh.parts``, (...) int64; -1 on a miss.

        Examples
        --------
        >>> from renderer import Mesh, Octree
        >>> from renderer.mesh.shapes import box
        >>> octree = Octree(Mesh.concatenate(box(), box((3, 0, 0), (4, 1, 1))))
        >>> octree.closest_hit([[0.5, 0.25, 3], [3.5, 0.25, 3], [5, 5, 5]], [0, 0, -1]).part
        array([ 0,  1, -1])
        >>> octree.closest_point([[0.5, 0.25, 3], [5, 0.5, 0.5]]).part
        array([0, 1])
        """
        return part_numbers(self._mesh.parts, self.face)

    def interpolate(self, values: ArrayLike, *, on: Owner | None = None) -> NDArray[np.float64]:
        """Return values of the mesh at the places: interpolated between vertices, or those of the faces.

        Parameters
        ----------
        values : array_like, shape (V, ...) or (F, ...)
            A number or a row of numbers for each vertex or each face of the mesh.
        on : {"vertices", "faces"}, optional
            What the values belong to. Needed only if the mesh has as many vertices as faces.

        Returns
        -------
        ndarray of float64, shape (..., ...)
            The shape of the places, then that of a row; nan on a miss.

        Raises
        ------
        ValueError
            If the number of rows is neither that of the vertices nor that of the faces.

        Examples
        --------
        >>> from renderer import Octree
        >>> from renderer.mesh.shapes import box
        >>> octree = Octree(box())
        >>> hits = octree.closest_hit([[0.5, 0.25, 3], [5, 5, 5]], [0, 0, -1])
        >>> hits.interpolate(octree.mesh.vertices[:, 0])
        array([0.5, nan])
        >>> hits.interpolate(range(12))
        array([10., nan])
        """
        return interpolated(self._mesh, self.face, self.u, self.v, values, on)

    def _vertex_values(self, name: str) -> Any:
        return getattr(self._mesh, name)

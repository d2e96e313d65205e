"""An immutable, checked triangle mesh: the one form in which geometry enters the renderer."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.arrays import plain_array, read_only, real_argument, real_array
from renderer.arguments.types import ArrayLike
from renderer.errors import MeshError
from renderer.lazy import lazy
from renderer.mesh.crease import Split
from renderer.mesh.edges import open_edges
from renderer.mesh.face_materials import checked_materials, joined_materials
from renderer.mesh.foreign import TriangleMesh, attributes_of, has_own_normals, has_triangles
from renderer.mesh.material import MeshMaterial
from renderer.mesh.mending import cancels, enclosed_share, joined, twins
from renderer.mesh.parts import Part, parts_of
from renderer.mesh.values import Owner

Float64Array = NDArray[np.float64]
Int32Array = NDArray[np.int32]

# A face's corners are int32, so no vertex beyond this one can be named.
MAX_VERTICES = 2**31 - 1


class RepairWarning(UserWarning):
    r"""The warning that a mesh file was loaded without its bad parts. It names the file and counts them.

    Examples
    --------
    >>> import warnings
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> from renderer import load_mesh
    >>> with TemporaryDirectory() as folder, warnings.catch_warnings(record=True) as caught:
    ...     warnings.simplefilter("always")
    ...     _ = Path(folder, "bad.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv nan 0 0\nf 1 2 3\nf 1 2 4\n")
    ...     faces = load_mesh(f"{folder}/bad.obj", repair=True).faces
    >>> faces.tolist(), [warning.category.__name__ for warning in caught]
    ([[0, 1, 2]], ['RepairWarning'])
    """


@dataclass(frozen=True, eq=False)
class Repairs:
    """Counts of the parts that ``Mesh.repaired`` left out or replaced; true if any is above 0.

    Attributes
    ----------
    dropped_faces : ndarray of int64, shape (n,)
        Rows of the given faces that name a missing vertex or one that is not finite.
    bad_vertices : ndarray of int64, shape (n,)
        Rows of the given vertices that are not finite.
    kept_faces : ndarray of int64, shape (F,)
        The row of each kept face in the given faces. ``kept_faces[hits.face[hits.hit]]`` are faces as given.
    bad_normals : ndarray of int64, shape (n,)
        Rows of the given normals that are not finite at a finite vertex. The mean of the faces around replaces them.

    Examples
    --------
    >>> from renderer import Mesh
    >>> mesh, repairs = Mesh.repaired([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 9], [0, 1, 2]])
    >>> print(repairs)
    dropped 1 of 2 faces; 0 vertices are not finite
    >>> repairs.kept_faces.tolist()
    [1]
    """

    dropped_faces: NDArray[np.int64]
    bad_vertices: NDArray[np.int64]
    kept_faces: NDArray[np.int64]
    bad_normals: NDArray[np.int64]

    def __bool__(self) -> bool:
        return len(self.dropped_faces) + len(self.bad_vertices) + len(self.bad_normals) > 0

    def __str__(self) -> str:
        dropped, bad = len(self.dropped_faces), len(self.bad_vertices)
        normals = f"; {len(self.bad_normals)} normals are not finite" if len(self.bad_normals) else ""
        return f"dropped {dropped} of {dropped + len(self.kept_faces)} faces; {bad} vertices are not finite{normals}"


@dataclass(frozen=True, eq=False, init=False)
class Mesh:
    """An immutable triangle mesh with checked arrays.

    The arrays are copied and made read-only. Meshes compare and hash by identity.

    Parameters
    ----------
    vertices : array_like, shape (V, 3)
        Finite positions, kept as float64.
    faces : array_like of int, shape (F, 3)
        Vertex numbers, counter-clockwise seen from outside, kept as int32. F may be 0.
    normals : array_like, shape (V, 3), optional
        Shading normals of any length, kept as float64.
    colors : array_like, shape (V, 3), optional
        RGB from 0 to 1, kept as float32. Those of a glTF file are linear; PLY and OBJ do not say, and most programs
        write sRGB. They are never converted.
    texcoords : array_like, shape (V, 2), optional
        Texture coordinates from the lower left, kept as float64.
    name : str, default ""
        Begins error messages, and names the part that the mesh becomes in ``Mesh.concatenate``.
    materials : sequence of MeshMaterial, optional
        What a file says about the look of its faces, kept as a tuple.
    face_materials : array_like of int, shape (F,), optional
        The row of each face's material, -1 where it has none; by default 0. Kept as int32, None without materials.

    Raises
    ------
    MeshError
        For a bad array. The message names the array, the expected value, the given one and its row.

    Examples
    --------
    >>> from renderer import Mesh
    >>> mesh = Mesh([[0, 0, 0], [1, 0, 0], [0, 2, 0]], [[0, 1, 2]])
    >>> mesh.face_normals().tolist()
    [[0.0, 0.0, 1.0]]
    >>> mesh.extent.tolist()
    [1.0, 2.0, 0.0]
    """

    vertices: Float64Array
    faces: Int32Array
    normals: Float64Array | None = None
    colors: NDArray[np.float32] | None = None
    texcoords: Float64Array | None = None
    name: str = ""
    materials: tuple[MeshMaterial, ...] = ()
    face_materials: Int32Array | None = None
    # () for one part, which has the mesh's name.
    _parts: tuple[Part, ...] = field(default=(), repr=False)

    def __init__(
        self,
        vertices: ArrayLike,
        faces: ArrayLike,
        normals: ArrayLike | None = None,
        colors: ArrayLike | None = None,
        texcoords: ArrayLike | None = None,
        name: str = "",
        materials: Sequence[MeshMaterial] = (),
        face_materials: ArrayLike | None = None,
        _parts: tuple[Part, ...] = (),
    ) -> None:
        if not isinstance(name, str):
            raise MeshError(f"name: expected a string, got {type(name).__name__}")
        object.__setattr__(self, "name", name)
        positions = _real_rows(name, "vertices", vertices, 3, np.float64)
        self._expect_finite("vertices", positions)
        object.__setattr__(self, "vertices", read_only(positions))
        object.__setattr__(self, "faces", read_only(self._checked_faces(faces)))
        given = {"normals": normals, "colors": colors, "texcoords": texcoords}
        for attribute, width, dtype in _VERTEX_ATTRIBUTES:
            values = given[attribute]
            rows = None if values is None else read_only(_real_rows(name, attribute, values, width, dtype))
            object.__setattr__(self, attribute, rows)
        self._check_attributes()
        try:
            give_materials(self, *checked_materials(materials, face_materials, len(self.faces)))
        except ValueError as error:
            raise self._error(str(error)) from None
        give_parts(self, _parts)

    def __reduce__(self) -> tuple[Any, ...]:
        """Copies and pickles are made by the constructor, which checks the arrays and makes them read-only."""
        given = (self.vertices, self.faces, self.normals, self.colors, self.texcoords, self.name)
        return Mesh, (*given, self.materials, self.face_materials, self._parts)

    def __repr__(self) -> str:
        name = f" {self.name!r}" if self.name else ""
        return f"<Mesh{name} of {len(self.faces):,} faces, {len(self.vertices):,} vertices>"

    @classmethod
    def _viewing(cls, arrays: Mapping[str, NDArray[Any]], name: str) -> Mesh:
        """A mesh over ``arrays`` themselves, which have its names, types and shapes: they are not copied.

        Values are checked as by the constructor. Nobody may write to their memory from then on.
        """
        mesh = object.__new__(cls)
        for attribute in ("vertices", "faces", *(attribute for attribute, _, _ in _VERTEX_ATTRIBUTES)):
            array = arrays.get(attribute)
            object.__setattr__(mesh, attribute, None if array is None else read_only(array))
        object.__setattr__(mesh, "name", name)
        give_materials(give_parts(mesh, ()), (), None)
        mesh._expect_finite("vertices", mesh.vertices)
        mesh._expect_indices(mesh.faces, len(mesh.vertices))
        mesh._check_attributes()
        return mesh

    @classmethod
    def from_trimesh(cls, mesh: TriangleMesh, name: str = "") -> Mesh:
        """Copy a ``trimesh.Trimesh``, or any object with ``vertices`` and ``faces``.

        Vertex colours and texture coordinates are copied too. Vertex normals are copied only if they differ from those
        that trimesh computes from the faces; ``Mesh.vertex_normals`` computes these. Face colours are not copied.

        Parameters
        ----------
        mesh : trimesh.Trimesh
            trimesh itself is not imported.
        name : str, default ""
            The name of the mesh.

        Returns
        -------
        Mesh

        Raises
        ------
        MeshError
            For other objects and for bad arrays.

        Examples
        --------
        >>> import trimesh
        >>> from renderer import Mesh
        >>> Mesh.from_trimesh(trimesh.creation.box()).faces.shape
        (12, 3)
        """
        if isinstance(mesh, Mesh):
            return replace(mesh, name=name or mesh.name)
        vertices, faces, attributes = foreign_arrays(mesh, name)
        return cls(vertices, faces, name=name, **attributes)

    def save(
        self,
        path: str | os.PathLike[str],
        values: ArrayLike | None = None,
        cmap: str = "viridis",
        *,
        on: Owner | None = None,
        limits: tuple[float, float] | None = None,
    ) -> None:
        """Write a binary PLY file, coloured by values if there are any.

        The file appears whole or not at all. It has no parts and no materials. With values, each face or vertex gets a
        colour, and the value itself as the property ``value``. Values that are not finite are grey.

        Parameters
        ----------
        path : str or path
            Must end in ``.ply``.
        values : array_like, shape (F,) or (V,), optional
            A value for each face or each vertex. Their colours replace the mesh's own in the file.
        cmap : {"viridis", "magma", "coolwarm", "gray"}, default "viridis"
            The colour map.
        on : {"faces", "vertices"}, optional
            What the values belong to. Needed only if the mesh has as many faces as vertices.
        limits : (float, float), optional
            The values at the two ends of the colour map; by default the least and the greatest finite value.

        Raises
        ------
        OSError
            If the file cannot be written.
        ValueError
            For a bad argument, which it names.

        Examples
        --------
        >>> import tempfile
        >>> from renderer import load_mesh
        >>> from renderer.mesh.shapes import box
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     box().save(f"{folder}/values.ply", values=range(12))
        ...     box().save(f"{folder}/box.ply")
        ...     load_mesh(f"{folder}/box.ply").faces.shape
        (12, 3)
        """
        from renderer.mesh.save import save_mesh  # which imports this module

        save_mesh(self, path, values, cmap, on, limits)

    @property
    def parts(self) -> tuple[Part, ...]:
        """The parts of the mesh: each has a ``name`` and a slice ``faces``, in the order of the faces.

        An OBJ file has a part for each group or object, a GLB file one for each node with a mesh, a text STL file one
        for each solid, and ``Mesh.concatenate`` makes one for each mesh. Any other mesh is one part. ``hits.part`` is
        an index of this tuple.

        Examples
        --------
        >>> from renderer import Mesh
        >>> from renderer.mesh.shapes import box, icosphere
        >>> [(part.name, part.faces) for part in Mesh.concatenate([box(), icosphere(0)]).parts]
        [('box', slice(0, 12, None)), ('icosphere', slice(12, 32, None))]
        """
        return self._parts or (Part(self.name, slice(0, len(self.faces))),)

    def _check_attributes(self) -> None:
        """Raise ``MeshError`` for what the vertices carry and is no row a vertex, not finite, or no colour."""
        for attribute, _, _ in _VERTEX_ATTRIBUTES:
            array = getattr(self, attribute)
            if array is not None:
                self._expect_finite(attribute, array)
                if len(array) != len(self.vertices):
                    raise self._error(f"{attribute}: expected a row a vertex, {len(self.vertices)}, got {len(array)}")
        if self.colors is not None:
            outside = (self.colors < 0) | (self.colors > 1)
            self._reject_rows("colors", self.colors, outside, "values in [0, 1]")

    def _error(self, message: str) -> MeshError:
        return _error(self.name, message)

    def _reject_rows(self, argument: str, array: NDArray[Any], bad: NDArray[np.bool_], expected: str) -> None:
        if bad.any():
            row = int(bad.any(axis=1).argmax())
            raise self._error(f"{argument}: expected {expected}, got {array[row].tolist()} in row {row}")

    def _expect_finite(self, argument: str, floats: NDArray[Any]) -> None:
        finite = np.isfinite(floats)
        if not finite.all():
            self._reject_rows(argument, floats, ~finite, "finite values")

    def _checked_faces(self, given: ArrayLike) -> Int32Array:
        # A copy, which no other thread can change once it is checked.
        faces = np.array(_index_rows(self.name, given), order="C")
        self._expect_indices(faces, len(self.vertices))
        return faces.astype(np.int32, copy=False)

    def _expect_indices(self, faces: NDArray[Any], vertex_count: int) -> None:
        if vertex_count > MAX_VERTICES:
            raise self._error(f"vertices: expected at most {MAX_VERTICES} rows, got {vertex_count}")
        if faces.size and (faces.min() < 0 or faces.max() >= vertex_count):
            row, corner = np.argwhere((faces < 0) | (faces >= vertex_count))[0]
            there = f"indices from 0 to {vertex_count - 1}" if vertex_count else "no faces, as there are no vertices"
            raise self._error(f"faces: expected {there}, got {faces[row, corner]} in row {row}")

    @lazy
    def bounds(self) -> tuple[Float64Array, Float64Array]:
        """The least and the greatest corner, each (3,) float64; (inf, -inf) without vertices.

        Examples
        --------
        >>> from renderer.mesh.shapes import box
        >>> lower, upper = box((0, 0, 0), (1, 2, 3)).bounds
        >>> lower, upper
        (array([0., 0., 0.]), array([1., 2., 3.]))
        """
        if len(self.vertices) == 0:
            return read_only(np.full(3, np.inf)), read_only(np.full(3, -np.inf))
        return read_only(self.vertices.min(axis=0)), read_only(self.vertices.max(axis=0))

    @property
    def extent(self) -> Float64Array:
        """The size along each axis, (3,) float64; 0 without vertices.

        Examples
        --------
        >>> from renderer.mesh.shapes import box
        >>> box((1, 1, 1), (2, 3, 4)).extent
        array([1., 2., 3.])
        """
        lower, upper = self.bounds
        return np.maximum(upper - lower, 0.0)

    @property
    def triangles(self) -> Float64Array:
        """The corners of the faces, (F, 3, 3) float64, a new array.

        Examples
        --------
        >>> from renderer import Mesh
        >>> mesh = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> mesh.triangles.tolist()
        [[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]]
        """
        return self.vertices[self.faces]

    @lazy
    def is_float32(self) -> bool:
        """Whether float32 holds every vertex exactly.

        Examples
        --------
        >>> from renderer.mesh.shapes import box
        >>> box((0, 0, 0), (0.5, 1, 1)).is_float32, box((0, 0, 0), (0.1, 1, 1)).is_float32
        (True, False)
        """
        with np.errstate(over="ignore", under="ignore"):
            return bool((self.vertices.astype(np.float32) == self.vertices).all())

    def face_normals(self) -> Float64Array:
        """Return the unit normals of the faces.

        Returns
        -------
        ndarray of float64, shape (F, 3)
            By the right-hand rule; zero for a face without area.

        Examples
        --------
        >>> from renderer import Mesh
        >>> mesh = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> mesh.face_normals()
        array([[0., 0., 1.]])
        """
        return face_normals(self.triangles)

    def vertex_normals(self) -> Float64Array:
        """Return the unit normals of the vertices: means of face normals, weighted by the face's angle at the vertex.

        Unlike weights by area, angles do not depend on how a flat region is cut into triangles.

        Returns
        -------
        ndarray of float64, shape (V, 3)
            Zero for a vertex that no face with area uses.

        References
        ----------
        Thürmer and Wüthrich, Computing Vertex Normals from Polygonal Facets, 1998.

        Examples
        --------
        >>> from renderer.mesh.shapes import box
        >>> box((-1, -1, -1), (1, 1, 1)).vertex_normals()[7].round(3)
        array([0.577, 0.577, 0.577])
        """
        return self._mean_normals(self.faces.ravel(), len(self.vertices))

    def creased(self, angle: float = 30.0) -> Mesh:
        """Return the mesh with normals that are smooth but for sharp edges.

        Vertices are split at edges where the normals of the faces differ by more than the angle. Edges with the same
        end positions are one edge, so faces that share no vertex, as in an STL file, are smooth too. Faces keep their
        order and corners.

        Parameters
        ----------
        angle : float, default 30
            From 0 to 180 degrees.

        Returns
        -------
        Mesh
            Its `normals` are means of the normals of faces, weighted by the face's angle at the vertex.

        Raises
        ------
        ValueError
            For another angle.

        Examples
        --------
        >>> from renderer.mesh.shapes import box, icosphere
        >>> len(box().vertices), len(box().creased().vertices)
        (8, 24)
        >>> len(icosphere(3).vertices) == len(icosphere(3).creased().vertices)
        True
        """
        split = Split(self, angle)
        means = self._mean_normals(split.group, int(split.group.max(initial=-1)) + 1)
        colors, texcoords = (None if a is None else a[split.vertices] for a in (self.colors, self.texcoords))
        normals = means[split.group_of_vertex]
        made = Mesh(self.vertices[split.vertices], split.faces, normals, colors, texcoords, self.name)
        return give_parts(give_materials(made, self.materials, self.face_materials), self._parts)

    def _mean_normals(self, group: NDArray[np.integer[Any]], count: int) -> Float64Array:
        """The unit normals, (count, 3), of groups of corners; ``group`` has the number of each corner's, (3 F,)."""
        x, y, z = (np.ascontiguousarray(self.vertices[:, axis])[self.faces.T] for axis in range(3))
        corners = [(x[k], y[k], z[k]) for k in range(3)]
        normals = _unit(_cross(*_scaled(_minus(corners[1], corners[0]), _minus(corners[2], corners[0]))))
        # Each edge once, as the way from a corner to the next; the way back is the same with other signs.
        edges = [_unit(_minus(corners[(k + 1) % 3], corners[k])) for k in range(3)]
        weighted = np.empty((3, *self.faces.shape))
        for corner in range(3):
            angle = _angle(edges[corner], edges[corner - 1])
            for axis in range(3):
                # rule: weight-by-angle
                weighted[axis, :, corner] = normals[axis] * angle
        sums = [np.bincount(group, along.ravel(), minlength=count).astype(np.float64) for along in weighted]
        return np.stack(_unit((sums[0], sums[1], sums[2])), axis=1)

    def welded(self, tolerance: float = 0.0) -> tuple[Mesh, int]:
        """Return the mesh with vertices at one place joined, and how many were left out.

        Faces keep their order and number. A joined vertex has the place, colour and texture coordinates of the first of
        them; normals are left out, since they differ where faces were apart.

        Parameters
        ----------
        tolerance : float, default 0.0
            The distance up to which vertices are joined, also by steps over others. 0 joins equal places alone.

        Returns
        -------
        mesh : Mesh
        left_out : int

        Raises
        ------
        MeshError
            For a tolerance that is negative, or no finite number.

        Examples
        --------
        >>> from renderer.mesh.shapes import box
        >>> apart = box().creased()
        >>> mesh, left_out = apart.welded()
        >>> len(apart.vertices), len(mesh.vertices), left_out
        (24, 8, 16)
        """
        given = real_argument("tolerance", tolerance)
        if given.ndim or not 0.0 <= given < np.inf:
            raise self._error(f"tolerance: expected a finite number of at least 0, got {tolerance!r}")
        first = joined(self.vertices, float(given)) if len(self.vertices) else np.empty(0, np.int64)
        kept = np.unique(first)
        colors, texcoords = (None if a is None else a[kept] for a in (self.colors, self.texcoords))
        faces = np.searchsorted(kept, first[self.faces])
        made = Mesh(self.vertices[kept], faces, None, colors, texcoords, self.name)
        give_materials(made, self.materials, self.face_materials)
        return give_parts(made, self.parts), len(self.vertices) - len(kept)

    def without_duplicates(self) -> tuple[Mesh, int]:
        """Return the mesh without faces that are there twice, turned or not, and how many were left out.

        Of faces with the same three corner positions, the first stays. Vertices stay as they are.

        Returns
        -------
        mesh : Mesh
        left_out : int

        Examples
        --------
        >>> from renderer import Mesh
        >>> from renderer.mesh.shapes import box
        >>> twice = Mesh.concatenate(box(), Mesh(box().vertices, box().faces[:, ::-1]))
        >>> mesh, left_out = twice.without_duplicates()
        >>> len(twice.faces), len(mesh.faces), left_out
        (24, 12, 12)
        """
        _, rows = np.unique(twins(self.vertices, self.faces).number, return_index=True)
        kept = np.sort(rows)
        made = Mesh(self.vertices, self.faces[kept], self.normals, self.colors, self.texcoords, self.name)
        give_materials(made, self.materials, self.face_materials, kept)
        ends = np.searchsorted(kept, [part.faces.stop for part in self.parts])
        parts = parts_of([part.name for part in self.parts], np.diff(ends, prepend=0).tolist())
        return give_parts(made, parts), len(self.faces) - len(kept)

    def is_closed(self) -> bool:
        """Return whether the faces bound a volume, so that ``Octree.contains`` takes the mesh.

        The mesh has faces, and each edge is passed as often in one direction as in the other. Edges with the same end
        positions are one edge, so a mesh whose faces share no vertices, as in an STL file, can be closed. Faces that
        are all there as often one way round as the other bound nothing.

        Returns
        -------
        bool

        See Also
        --------
        Mesh.open_edges : The edges where it is not closed.

        Examples
        --------
        >>> from renderer.mesh.shapes import box, grid
        >>> box().is_closed(), grid().is_closed()
        (True, False)
        """
        return len(self.faces) > 0 and len(self.open_edges) == 0 and not self._cancels

    @lazy
    def _cancels(self) -> bool:
        """Whether each face is there as often one way round as the other."""
        # Faces that cancel enclose nothing; what their sum rounds is far less than this share of the box.
        if abs(enclosed_share(self.bounds, self.triangles)) > 1e-6:
            return False
        return cancels(self.vertices, self.faces)

    @lazy
    def open_edges(self) -> NDArray[np.int64]:
        """The vertices of each edge that is passed more often in one direction than in the other, (k, 2) int64.

        Edges with the same end positions are one edge.

        Examples
        --------
        >>> from renderer import Mesh
        >>> from renderer.mesh.shapes import box
        >>> lidless = Mesh(box().vertices, box().faces[:-2])
        >>> lidless.open_edges.tolist(), box().open_edges.tolist()
        ([[4, 6], [7, 5], [5, 4], [6, 7]], [])
        """
        return open_edges(self.vertices, self.faces, oriented=True)

    @lazy
    def odd_edges(self) -> NDArray[np.int64]:
        """The vertices of each edge that an odd number of faces has, (k, 2) int64.

        Edges with the same end positions are one edge.

        Examples
        --------
        >>> from renderer import Mesh
        >>> mesh = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> mesh.odd_edges.tolist()
        [[0, 1], [1, 2], [2, 0]]
        >>> Mesh(mesh.vertices, [[0, 1, 2], [0, 1, 2]]).odd_edges.tolist()
        []
        """
        return open_edges(self.vertices, self.faces, oriented=False)

    def transformed(self, matrix: ArrayLike) -> Mesh:
        """Return a copy moved by an affine map.

        Normals are transformed by the inverse transpose and get unit length. If the map mirrors, each face is turned
        round, so that outside stays outside.

        Parameters
        ----------
        matrix : array_like, shape (4, 4)
            Applied to column vectors. Its last row is 0 0 0 1.

        Returns
        -------
        Mesh

        Raises
        ------
        MeshError
            For any other matrix, and where float64 cannot hold the result.

        Examples
        --------
        >>> from renderer.mesh.shapes import box
        >>> moved = box().transformed([[2, 0, 0, 5], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
        >>> [corner.tolist() for corner in moved.bounds]
        [[5.0, 0.0, 0.0], [7.0, 1.0, 1.0]]
        """
        expected = "matrix: expected a finite affine (4, 4) with last row 0 0 0 1"
        try:
            given = real_array(matrix)
        except ValueError as error:
            raise self._error(f"matrix: {error}") from error
        if given.shape != (4, 4):
            raise self._error(f"{expected}, got shape {given.shape}")
        with np.errstate(over="ignore", invalid="ignore"):  # what float64 cannot hold is rejected just below
            affine = given.astype(np.float64)
        if not np.isfinite(affine).all() or affine[3].tolist() != [0, 0, 0, 1]:
            raise self._error(f"{expected}, got {affine.tolist()}")
        linear = affine[:3, :3]
        with np.errstate(divide="ignore"):  # of a singular map
            mirrors = np.linalg.slogdet(linear).sign < 0  # the determinant itself may overflow or vanish
        # All products are term by term: those of matrices have other bits on other processors.
        normals = None
        if self.normals is not None:
            # The cofactors are det times the inverse transpose, and exist for a singular map too.
            columns = np.ldexp(linear, -np.frexp(np.abs(linear).max())[1]).T
            cofactors = np.stack([np.cross(columns[(k + 1) % 3], columns[(k + 2) % 3]) for k in range(3)])
            x, y, z = self.normals.T
            turned = _unit(tuple((x * a + y * b) + z * c for a, b, c in cofactors.T))
            normals = np.stack(turned, axis=1) * (-1.0 if mirrors else 1.0)
        faces = self.faces[:, [0, 2, 1]] if mirrors else self.faces
        with np.errstate(over="ignore", invalid="ignore"):  # the constructor rejects it with its row
            x, y, z = self.vertices.T
            vertices = np.stack([((x * a + y * b) + z * c) + d for a, b, c, d in affine[:3]], axis=1)
        return replace(self, vertices=vertices, faces=faces, normals=normals)

    @overload
    @classmethod
    def concatenate(cls, meshes: Iterable[Mesh], name: str = "") -> Mesh: ...
    @overload
    @classmethod
    def concatenate(cls, meshes: Mesh, *more: Mesh, name: str = "") -> Mesh: ...
    @classmethod
    def concatenate(cls, meshes: Mesh | Iterable[Mesh], *more: Any, name: str = "") -> Mesh:
        """Return one mesh of all vertices and faces, in order, with a part for each mesh.

        Normals, colours and texture coordinates stay only if all the meshes have them. Equal materials become one.

        Parameters
        ----------
        meshes : iterable of Mesh, or Mesh
            ``concatenate([a, b])`` and ``concatenate(a, b)`` are the same.
        *more : Mesh
            The other meshes, if the first argument is one.
        name : str, default ""
            The name of the new mesh.

        Returns
        -------
        Mesh

        Raises
        ------
        MeshError
            For anything that is no mesh.

        Examples
        --------
        >>> from renderer import Mesh
        >>> from renderer.mesh.shapes import box
        >>> two = Mesh.concatenate([box(), box((3, 0, 0), (4, 1, 1))])
        >>> len(two.vertices), len(two.faces), two.extent.tolist(), len(two.parts)
        (16, 24, [4.0, 1.0, 1.0], 2)
        """
        if not isinstance(meshes, Mesh) and len(more) == 1 and isinstance(more[0], str):
            return cls.concatenate(meshes, name=more[0])  # concatenate([a, b], "name")
        given = _listed(meshes, more, name)
        if not given:
            return cls(np.empty((0, 3)), np.empty((0, 3), np.int32), name=name)
        starts = np.cumsum([0] + [len(part.vertices) for part in given[:-1]])
        attributes: dict[str, Any] = {}
        for attribute, _, _ in _VERTEX_ATTRIBUTES:
            arrays = [getattr(part, attribute) for part in given]
            if all(array is not None for array in arrays):
                attributes[attribute] = np.concatenate(arrays)
        faces = np.concatenate([part.faces + start for part, start in zip(given, starts, strict=True)])
        mesh = cls(np.concatenate([part.vertices for part in given]), faces, name=name, **attributes)
        give_materials(mesh, *joined_materials([(p.materials, p.face_materials, len(p.faces)) for p in given]))
        return give_parts(mesh, parts_of([part.name for part in given], [len(part.faces) for part in given]))

    @classmethod
    def repaired(
        cls,
        vertices: ArrayLike,
        faces: ArrayLike,
        normals: ArrayLike | None = None,
        colors: ArrayLike | None = None,
        texcoords: ArrayLike | None = None,
        name: str = "",
        materials: Sequence[MeshMaterial] = (),
        face_materials: ArrayLike | None = None,
    ) -> tuple[Mesh, Repairs]:
        """Return the mesh of the good faces, in their order, and what was left out.

        A face is dropped if it names a missing vertex, or one that is not finite. Such a vertex keeps its row, so that
        indices keep their meaning, but moves to 0 with all its attributes. A normal that is not finite becomes the mean
        of the faces around its vertex. Input without faults gives the same mesh as ``Mesh`` does.

        Parameters
        ----------
        vertices, faces, normals, colors, texcoords, name, materials, face_materials
            As for ``Mesh``.

        Returns
        -------
        mesh : Mesh
        repairs : Repairs

        Raises
        ------
        MeshError
            For other faults: wrong shapes and types, colours and texture coordinates that are not finite.

        Examples
        --------
        >>> import numpy as np
        >>> from renderer import Mesh
        >>> mesh, repairs = Mesh.repaired([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, np.nan, 0]], [[0, 1, 3], [0, 1, 2]])
        >>> mesh.faces.tolist(), mesh.vertices[3].tolist(), repairs.bad_vertices.tolist()
        ([[0, 1, 2]], [0.0, 0.0, 0.0], [3])
        """
        if not isinstance(name, str):
            raise MeshError(f"name: expected a string, got {type(name).__name__}")
        positions = _real_rows(name, "vertices", vertices, 3, np.float64)
        finite = np.isfinite(positions).all(axis=1)
        positions[~finite] = 0.0
        indices = _index_rows(name, faces)
        in_range = ((indices >= 0) & (indices < len(positions))).all(axis=1)
        kept = np.zeros(len(indices), np.bool_)
        kept[in_range] = finite[indices[in_range]].all(axis=1)
        attributes: dict[str, Any] = {"normals": normals, "colors": colors, "texcoords": texcoords}
        for attribute, width, dtype in _VERTEX_ATTRIBUTES:
            if attributes[attribute] is not None:
                rows = _real_rows(name, attribute, attributes[attribute], width, dtype)
                if len(rows) == len(positions):  # the constructor rejects any other length
                    rows[~finite] = 0.0
                attributes[attribute] = rows
        lost, given = np.zeros(0, np.bool_), attributes["normals"]
        if given is not None and len(given) == len(positions):
            lost = ~np.isfinite(given).all(axis=1)
            if lost.any():
                given[lost] = cls(positions, indices[kept], name=name).vertex_normals()[lost]
        repairs = Repairs(*(read_only(np.flatnonzero(rows).astype(np.int64)) for rows in (~kept, ~finite, kept, lost)))
        mesh = cls(positions, indices[kept], name=name, **attributes)
        try:
            looks = checked_materials(materials, face_materials, len(indices))
        except ValueError as error:
            raise _error(name, str(error)) from None
        return give_materials(mesh, *looks, repairs.kept_faces), repairs


def give_parts(mesh: Mesh, parts: tuple[Part, ...]) -> Mesh:
    """The mesh with its parts, while it is being made; parts that do not end with its last face are of another one."""
    fit = bool(parts) and parts[-1].faces.stop == len(mesh.faces)
    object.__setattr__(mesh, "_parts", parts if fit else ())
    return mesh


def give_materials(
    mesh: Mesh,
    materials: tuple[MeshMaterial, ...],
    face_materials: Int32Array | None,
    kept: NDArray[np.int64] | None = None,
) -> Mesh:
    """The mesh with checked materials, while it is being made; ``kept`` are its faces among those that have them."""
    rows = face_materials if kept is None or face_materials is None else read_only(face_materials[kept])
    object.__setattr__(mesh, "materials", materials)
    object.__setattr__(mesh, "face_materials", rows)
    return mesh


def foreign_arrays(mesh: TriangleMesh, name: str = "") -> tuple[Any, Any, dict[str, Any]]:
    """Vertices, faces and attributes of a mesh of another library; see ``Mesh.from_trimesh``."""
    if not has_triangles(mesh):
        hint = "; scene.to_mesh() makes one of a scene" if hasattr(mesh, "to_mesh") else ""
        got = f"{type(mesh).__module__}.{type(mesh).__name__}{hint}"
        raise _error(name, f"mesh: expected an object with vertices and faces, as a trimesh.Trimesh, got {got}")
    attributes = attributes_of(mesh)
    if attributes["normals"] is not None and not has_own_normals(mesh, attributes["normals"]):
        attributes["normals"] = None
    return mesh.vertices, mesh.faces, attributes


def _listed(meshes: Any, more: tuple[Any, ...], name: str) -> list[Mesh]:
    """The arguments of ``Mesh.concatenate`` as a list, checked."""
    expected = "meshes: expected an iterable of Mesh, got"
    if isinstance(meshes, Mesh):
        given = [meshes, *more]
    else:
        try:
            given = list(meshes)
        except TypeError:  # also of what claims to be iterable and is not, as an array without dimensions
            raise _error(name, f"{expected} {type(meshes).__name__}") from None
        if more:
            raise _error(name, f"{expected} {type(meshes).__name__} before {type(more[0]).__name__}")
    for row, part in enumerate(given):
        if not isinstance(part, Mesh):
            raise _error(name, f"{expected} {type(part).__name__} in row {row}")
    return given


def face_normals(corners: Float64Array) -> Float64Array:
    """Unit normals of triangles (n, 3 corners, 3), (n, 3) float64; zero for one without area.

    The edges are scaled by powers of two first, so that triangles of any size have one.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        first, second = (_columns(corners[:, k] - corners[:, 0]) for k in (1, 2))
        normals = np.stack(_unit(_cross(*_scaled(first, second))), axis=1)
    # Sides beyond float64: a quarter of such a triangle has the same normal.
    beyond = ~np.isfinite(normals).all(axis=1)
    if beyond.any():
        normals[beyond] = face_normals(corners[beyond] * 0.25)
    return normals


_VERTEX_ATTRIBUTES: tuple[tuple[str, int, type[np.floating]], ...] = (
    ("normals", 3, np.float64),
    ("colors", 3, np.float32),
    ("texcoords", 2, np.float64),
)


def _error(name: str, message: str) -> MeshError:
    return MeshError(f"{name}: {message}" if name else message)


def _rows(name: str, argument: str, values: Any, width: int) -> NDArray[Any]:
    try:
        array = plain_array(values) if argument == "faces" else real_array(values)
    except ValueError as error:
        raise _error(name, f"{argument}: {error}") from error
    if array.shape == (0,):
        array = array.reshape(0, width)
    if array.ndim != 2 or array.shape[1] != width:
        raise _error(name, f"{argument}: expected shape (n, {width}), got {array.shape}")
    return array


def _real_rows(name: str, argument: str, values: Any, width: int, dtype: type[np.floating]) -> NDArray[Any]:
    """A new (n, width) array of ``dtype``; numbers that it cannot hold are inf."""
    array = _rows(name, argument, values, width)
    if not array.size:
        return np.empty((0, width), dtype)
    # Overflow gives inf and a signalling NaN gives NaN: the caller looks for both, so neither need warn.
    with np.errstate(over="ignore", invalid="ignore"):
        return np.array(array, dtype=dtype, order="C")


def _index_rows(name: str, faces: Any) -> NDArray[Any]:
    """(F, 3) of any integer type, not checked for range."""
    array = _rows(name, "faces", faces, 3)
    if array.size == 0:
        return np.empty((0, 3), np.int32)
    if array.dtype.kind not in "iu":
        raise _error(name, f"faces: expected integers, got dtype {array.dtype}")
    return array


# Vectors by component, (n,) float64 each: NumPy works along contiguous columns several times faster than along rows of
# three. Sums of three are written out, because what einsum makes of them depends on the processor.
_Columns = tuple[Float64Array, Float64Array, Float64Array]


def _columns(vectors: Float64Array) -> _Columns:
    return vectors[:, 0], vectors[:, 1], vectors[:, 2]


def _minus(a: _Columns, b: _Columns) -> _Columns:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _cross(a: _Columns, b: _Columns) -> _Columns:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _scaled(*vectors: _Columns) -> list[_Columns]:
    """Vectors over a power of two near each row's largest component: products neither overflow nor vanish."""
    largest = np.maximum.reduce([np.abs(column) for vector in vectors for column in vector])
    exponent = -np.frexp(largest)[1]
    if np.abs(exponent).max(initial=0) > 1000:  # beyond the powers of two in float64
        return [(np.ldexp(x, exponent), np.ldexp(y, exponent), np.ldexp(z, exponent)) for x, y, z in vectors]
    factor = np.ldexp(1.0, exponent)
    return [(x * factor, y * factor, z * factor) for x, y, z in vectors]


def _length(a: _Columns) -> Float64Array:
    length: Float64Array = np.sqrt((a[0] * a[0] + a[2] * a[2]) + a[1] * a[1])
    return length


def _unit(vectors: _Columns) -> _Columns:
    """Vectors at unit length; zero stays zero."""
    ((x, y, z),) = _scaled(vectors)
    length = _length((x, y, z))
    length[length == 0.0] = 1.0
    return x / length, y / length, z / length


def _angle(a: _Columns, b: _Columns) -> Float64Array:
    """The angle between the unit vectors a and -b, 0 where one is zero."""
    # 2 atan2(|a - c|, |a + c|) is accurate for every angle, as acos(a . c) is not (Kahan 2006); here c = -b.
    plus = (a[0] + b[0], a[1] + b[1], a[2] + b[2])
    angle: Float64Array = 2 * np.arctan2(_length(plus), _length(_minus(a, b)))
    return angle

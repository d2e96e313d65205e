"""Points on the faces of a mesh, for studies."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.counts import count_argument
from renderer.errors import expect
from renderer.mesh.mesh import Mesh

Floats = NDArray[np.float64]


class FacePoints(NamedTuple):
    """Points as studies take them: `points`, `normals`, and `faces` for the argument `leaving`.

    Attributes
    ----------
    points : ndarray of float64, shape (n, 3)
    normals : ndarray of float64, shape (n, 3)
        Unit vectors. Those of faces point to the side from which corners run counter-clockwise.
    faces : ndarray of int64, shape (n,)
        The face of each point; -1 for a point on no known face.

    See Also
    --------
    face_points, sample_points, grid_points

    Examples
    --------
    >>> from renderer.mesh.shapes import grid
    >>> from renderer.studies import face_points
    >>> places = face_points(grid(size=(3, 3)))
    >>> places.points, places.faces
    (array([[ 0.5,  0. ,  0.5],
           [-0.5,  0. , -0.5]]), array([0, 1]))
    """

    points: Floats
    normals: Floats
    faces: NDArray[np.int64]


def face_points(mesh: Mesh) -> FacePoints:
    """The centroid of each face that has an area.

    Parameters
    ----------
    mesh : Mesh

    Returns
    -------
    FacePoints
        Points, normals and faces, in the order of faces. Faces without area are left out.

    Raises
    ------
    ValueError
        If `mesh` is not a `Mesh`.

    Notes
    -----
    There are no points at vertices: a vertex has no normal of its own, and studies need one to know its side.

    Examples
    --------
    >>> from renderer import Octree
    >>> from renderer.mesh.shapes import box
    >>> from renderer.studies import face_points, sky_view_factor
    >>> octree = Octree.from_mesh(box())
    >>> points, normals, faces = face_points(octree.mesh)
    >>> sky_view_factor(octree, points, normals, leaving=faces).round(3)
    array([0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0. , 0. , 1. , 1. ])
    """
    expect(isinstance(mesh, Mesh), "mesh", "a renderer.Mesh", type(mesh).__name__)
    normals = mesh.face_normals()
    faces = np.flatnonzero(normals.any(axis=1))
    corners = mesh.vertices[mesh.faces[faces]]
    first = corners[:, 0]
    # As an offset from a corner, so that little is rounded far from the origin.
    with np.errstate(over="ignore"):
        points = first + ((corners[:, 1] - first) / 3.0 + (corners[:, 2] - first) / 3.0)
    return FacePoints(points, normals[faces], faces)


def sample_points(mesh: Mesh, count: int, *, seed: int = 0) -> FacePoints:
    """Random points on the surface, uniform by area.

    Parameters
    ----------
    mesh : Mesh
        With at least one face that has an area.
    count : int
        The number of points, >= 0.
    seed : int, default 0
        A number >= 0. The same seed gives the same points.

    Returns
    -------
    FacePoints
        `count` points that do not depend on each other, with the normals and numbers of their faces.

    Raises
    ------
    ValueError
        If no face has an area, or if `count` or `seed` is not such a number.

    Examples
    --------
    The mean over a surface is the mean over such points: half of a box's six sides look at the sky.

    >>> from renderer import Octree
    >>> from renderer.mesh.shapes import box
    >>> from renderer.studies import sample_points, sky_view_factor
    >>> octree = Octree.from_mesh(box())
    >>> points, normals, faces = sample_points(octree.mesh, 10_000, seed=1)
    >>> sky_view_factor(octree, points, normals, leaving=faces).mean().round(2)
    np.float64(0.5)
    """
    expect(isinstance(mesh, Mesh), "mesh", "a renderer.Mesh", type(mesh).__name__)
    count, seed = count_argument("count", count), count_argument("seed", seed)
    rng = np.random.default_rng(seed)
    ends = np.cumsum(face_areas(mesh))
    expect(len(ends) > 0 and bool(ends[-1] > 0.0), "mesh", "a face that has an area", "none")
    # The last end is kept off by rounding at most, and faces without area have no stretch of their own.
    faces = np.searchsorted(ends, np.minimum(rng.random(count) * ends[-1], np.nextafter(ends[-1], 0.0)), side="right")
    # Uniform in a parallelogram, whose far half is folded back.
    u, v = rng.random((2, count))
    far = u + v > 1.0
    u[far], v[far] = 1.0 - u[far], 1.0 - v[far]
    corners = mesh.vertices[mesh.faces[faces]]
    first = corners[:, 0]
    points = first + (u[:, None] * (corners[:, 1] - first) + v[:, None] * (corners[:, 2] - first))
    return FacePoints(points, mesh.face_normals()[faces], faces.astype(np.int64))


def face_areas(mesh: Mesh) -> Floats:
    """The areas of faces (F,), in a unit of area that the mesh's size fixes; they neither overflow nor vanish."""
    corners = mesh.vertices[mesh.faces]
    sides = corners[:, 1:] - corners[:, :1]
    sides *= 2.0 ** -np.frexp(np.abs(sides).max(initial=0.0))[1].astype(np.float64)
    return np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)

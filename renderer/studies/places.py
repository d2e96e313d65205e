"""Places of a mesh that studies are made for."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.errors import expect
from renderer.mesh.mesh import Mesh


class FacePoints(NamedTuple):
    """Points on faces, as studies take them: ``points`` and ``normals``, and ``faces`` as ``leaving``.

    points, normals  (n, 3) float64; normals are unit vectors to the outer side, from which corners run
                     counter-clockwise
    faces            (n,) int64

    >>> from renderer.mesh.shapes import grid
    >>> from renderer.studies import face_points
    >>> places = face_points(grid(size=(3, 3)))
    >>> places.points, places.faces
    (array([[ 0.5,  0. ,  0.5],
           [-0.5,  0. , -0.5]]), array([0, 1]))
    """

    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    faces: NDArray[np.int64]


def face_points(mesh: Mesh) -> FacePoints:
    """The centroid of each face that has an area, its normal and its number.

    A vertex has no normal of its own, by which studies know its side: so there are no points at vertices.

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

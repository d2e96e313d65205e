"""Discs, balls and shells of flat faces, with the radii of the round shapes that they lie between."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import icosphere


class Radii(NamedTuple):
    """The largest round shape within the faces, and the smallest around them."""

    within: float
    around: float


def disc(radius: float, height: float, up: bool, sides: int) -> tuple[Mesh, Radii]:
    """A regular polygon across z, its front up or down."""
    ring = _ring(radius, height, sides)
    corners = np.concatenate([[[0.0, 0.0, height]], ring])
    k = np.arange(sides)
    faces = np.stack([np.zeros(sides, np.int64), 1 + k, 1 + (k + 1) % sides], axis=1)
    return Mesh(corners, faces if up else faces[:, ::-1]), Radii(radius * np.cos(np.pi / sides), radius)


def shell(radius: float, height: float, outward: bool, sides: int) -> tuple[Mesh, Radii]:
    """The sides of a prism about z from 0 to ``height``, without its ends."""
    corners = np.concatenate([_ring(radius, 0.0, sides), _ring(radius, height, sides)])
    a = np.arange(sides)
    b = (a + 1) % sides
    faces = np.concatenate([np.stack([a, b, sides + b], axis=1), np.stack([a, sides + b, sides + a], axis=1)])
    return Mesh(corners, faces if outward else faces[:, ::-1]), Radii(radius * np.cos(np.pi / sides), radius)


def ball(radius: float, centre: tuple[float, float, float], level: int, outward: bool = True) -> tuple[Mesh, Radii]:
    """An icosphere, whose corners lie on the sphere."""
    own = icosphere(level)
    corners = own.triangles
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    within = float(np.einsum("ij,ij->i", normals, corners[:, 0]).min())
    faces = own.faces if outward else own.faces[:, ::-1]
    return Mesh(own.vertices * radius + centre, faces), Radii(radius * within, radius)


def _ring(radius: float, height: float, sides: int) -> NDArray[np.float64]:
    angle = 2.0 * np.pi * np.arange(sides) / sides
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(sides, height)], axis=1)

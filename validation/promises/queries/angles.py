"""Winding numbers of open meshes, near their faces too: by solid angles in whole numbers, and on which side of 1/2."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.octree import Octree
from validation.meshes import loose
from validation.oracle.vectors import dot, relative, volume
from validation.promises.queries.heaps import heaps
from validation.promises.row import row

Floats = NDArray[np.float64]
_JUDGE = "integer arithmetic"
# Bits of a length behind the whole number's. What tells an angle is as small as the square of the least distance, so
# these are more than there are between two sizes of float64.
_BITS = 1200
# Of a turn, for each face: what ``solid_angle`` says that its angle errs by.
_OF_A_FACE = 2.0**-44
_SINGLE, _PLACES = 12, 40
_TOLERANCES = (0.3, 1e-2, 1e-3, 1e-5, 1e-8, 1e-11)


def check_angles(rng: Generator) -> list[dict[str, Any]]:
    """Points on and beside corners, edges and planes of loose faces, with coordinates of all sizes."""
    kept = []
    for faces, points in heaps(rng):
        # Three of four faces: open.
        some = faces[np.arange(len(faces)) % 4 != 0]
        exact = np.array([turns(point, some) for point in points])
        octree = Octree.from_mesh(loose(some))
        for tolerance in (0.0, 1e-9):
            off = np.abs(octree.winding_number(points, tolerance) - exact)
            kept.append(off <= tolerance + _OF_A_FACE * len(some))
    return [
        row("winding numbers near faces, on their edges and in their planes", _JUDGE, np.concatenate(kept)),
        row("winding numbers beside edges, from near to far", _JUDGE, _beside(rng)),
    ]


def _beside(rng: Generator) -> NDArray[np.bool_]:
    """Single faces, and points beside their edges at distances of all powers of ten."""
    kept = []
    for _ in range(_SINGLE):
        face = rng.normal(size=(1, 3, 3))
        share, across = rng.uniform(-0.1, 1.1, (_PLACES, 1)), rng.normal(size=(_PLACES, 3))
        points = face[0, 0] + share * (face[0, 1] - face[0, 0]) + 10.0 ** rng.uniform(-12.0, 0.0, (_PLACES, 1)) * across
        exact = np.array([turns(point, face) for point in points])
        given = Octree(face[0], [[0, 1, 2]]).winding_number(points, 0.0)
        kept.append(np.abs(given - exact) <= _OF_A_FACE)
    return np.concatenate(kept)


def turns(point: Floats, triangles: Floats) -> float:
    """The winding number of triangles (F, 3, 3) around a point: by van Oosterom and Strackee, rounded at the end."""
    return math.fsum(_angle(face) for face in relative(point.tolist(), triangles.tolist())[0]) / (2.0 * math.pi)


def _angle(face: Sequence[Sequence[int]]) -> float:
    """Half the solid angle of a face from the origin; 0 in its plane."""
    over = volume(face)
    if over == 0:
        return 0.0
    a, b, c = face
    la, lb, lc = (math.isqrt(dot(x, x) << 2 * _BITS) for x in face)
    rest = la * lb * lc + ((dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb) << 2 * _BITS)
    over <<= 3 * _BITS
    # As float64 holds them: what the smaller one loses is nothing beside the larger.
    less = max(0, over.bit_length() - 1000, rest.bit_length() - 1000)
    return math.atan2(over >> less, rest >> less)


def check_halves(rng: Generator) -> list[dict[str, Any]]:
    """A cube of many faces without a lid: inside it winding numbers are above 1/2, and before the opening below."""
    sides, near = [], []
    for axis in range(3):
        mesh = _lidless(axis)
        octree = Octree.from_mesh(mesh)
        height = np.repeat(2.0 ** -np.arange(2.0, 42.0), 4) * np.tile([1.0, -1.0], 80)
        points = np.concatenate([rng.uniform(0.2, 0.8, (160, 2)), 1.0 + height[:, None]], axis=1)
        points = np.roll(points, axis + 1, axis=1)
        sides.append(octree.contains(points, winding=True) == (height < 0.0))
        flat = np.roll(np.concatenate([rng.uniform(0.2, 0.8, (9, 2)), np.zeros((9, 1))], axis=1), axis + 1, axis=1)
        sides += [octree.contains(flat, boundary=on, winding=True) == on for on in (True, False)]
        points = rng.uniform(-1.0, 2.0, (20, 3))
        exact = np.array([turns(point, _large(axis)) for point in points])
        near += [np.abs(octree.winding_number(points, most) - exact) <= most for most in _TOLERANCES]
    return [
        row("inside a mesh with a hole the winding number is above 1/2", "closed form", np.concatenate(sides)),
        row("winding numbers are within any tolerance", _JUDGE, np.concatenate(near)),
    ]


def _large(axis: int) -> Floats:
    """The unit cube's faces (10, 3, 3), seen from outside counter-clockwise, without the lid at 1 of an axis."""
    faces = []
    for side in range(3):
        for end in (0.0, 1.0):
            u, v, w = np.roll(np.eye(3), -side, axis=0)[[1, 2, 0]]
            a = end * w
            u, v = (u, v) if end else (v, u)
            if (side, end) != (axis, 1.0):
                faces += [(a, a + u, a + u + v), (a, a + u + v, a + v)]
    return np.array(faces)


def _lidless(axis: int, cuts: int = 3) -> Mesh:
    """The same in 4^cuts times as many faces: each is cut into four at the middles of its sides."""
    faces = _large(axis)
    for _ in range(cuts):
        a, b, c = np.moveaxis(faces, 1, 0)
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        faces = np.concatenate([np.stack(three, 1) for three in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    return loose(faces)

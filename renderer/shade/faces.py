"""Reading the faces of a picture: those of one mesh, or of meshes with many instances."""

import math
from typing import Any, NamedTuple

import numpy as np

from renderer.jit.decorators import inlined, kernel
from renderer.numerics.double_double import power_below
from renderer.numerics.simd import float64_pointer, load, maximum, offset
from renderer.numerics.vec3 import add, cross, largest_component, row3, scale
from renderer.trace.instances import FIRST_FACE, INSTANCE_WORDS, column_of, instance_with, placed_corners, placed_face

# A face of an instance as one number: the instance, from 1 on, above the bits of the face in its mesh.
_FACE_BITS = 32
_FACE = (1 << _FACE_BITS) - 1
# Shorter normals are made longer first, since a power of two near their length may have no reciprocal.
_SMALL = 2.0**-500


class FaceWays(NamedTuple):
    """The kernels by which faces are read. They are chosen when a picture's kernel is compiled.

    at        at(scene, face): what the others take for a face
    corners   corners(scene, at): its corners, as tuples
    normals   normals(scene, at): the normals of its corners, of any length
    texcoords texcoords(scene, at): the texture coordinates u and v of its corners, six numbers
    tints     tints(scene, at): the colours of its corners
    row       row(scene, at): its row of ``material``, ``smooth`` and ``touching``
    touches   touches(scene, face): whether it may coincide with another, one of which transmits light
    """

    at: Any
    corners: Any
    normals: Any
    texcoords: Any
    tints: Any
    row: Any
    touches: Any


@inlined
def _face(scene, face):
    return face


@inlined
def _corners(scene, face):
    a, b, c = row3(scene.faces, face)
    return row3(scene.vertices, a), row3(scene.vertices, b), row3(scene.vertices, c)


@inlined
def _normals(scene, face):
    a, b, c = row3(scene.faces, face)
    return row3(scene.normals, a), row3(scene.normals, b), row3(scene.normals, c)


@inlined
def _texcoords(scene, face):
    a, b, c = row3(scene.faces, face)
    return _pairs(scene.texcoords, a, b, c)


@inlined
def _pairs(texcoords, a, b, c):
    return (
        load(texcoords, 2 * a), load(texcoords, 2 * a + 1), load(texcoords, 2 * b), load(texcoords, 2 * b + 1),
        load(texcoords, 2 * c), load(texcoords, 2 * c + 1),
    )  # fmt: skip


@inlined
def _tints(scene, face):
    a, b, c = row3(scene.faces, face)
    return row3(scene.tints, a), row3(scene.tints, b), row3(scene.tints, c)


@inlined
def _touches(scene, face):
    return load(scene.touching, scene.ways.row(scene, scene.ways.at(scene, face))) != 0


MERGED = FaceWays(_face, _corners, _normals, _texcoords, _tints, _face, _touches)


@inlined
def _place(scene, face):
    number = instance_with(scene.placed.words, scene.placed.instance_count, face)
    first = load(scene.placed.words, (number - 1) * INSTANCE_WORDS + FIRST_FACE)
    return (number << _FACE_BITS) | (face - first)


@inlined
def _placed_corners(scene, at):
    return placed_corners(scene.placed, at >> _FACE_BITS, at & _FACE)


@kernel
def _placed_normals(scene, at):
    of = placed_face(scene.placed, at >> _FACE_BITS, at & _FACE)
    # The rows of normals are addresses: each mesh has its own.
    normals = float64_pointer(load(scene.normals, (at >> _FACE_BITS) - 1))
    a, b, c = row3(normals, of.a), row3(normals, of.b), row3(normals, of.c)
    if not _moves(of.matrix):
        return a, b, c
    turn = _turn_of(of.matrix, of.mirrors)
    return _turned(turn, a), _turned(turn, b), _turned(turn, c)


@inlined
def _own_rows(values, at):
    """The row from which a placed mesh's vertices have their values; the places of all come before them."""
    return offset(values, np.int64(load(values, (at >> _FACE_BITS) - 1)))


@inlined
def _placed_texcoords(scene, at):
    of = placed_face(scene.placed, at >> _FACE_BITS, at & _FACE)
    return _pairs(_own_rows(scene.texcoords, at), of.a, of.b, of.c)


@inlined
def _placed_tints(scene, at):
    of = placed_face(scene.placed, at >> _FACE_BITS, at & _FACE)
    tints = _own_rows(scene.tints, at)
    return row3(tints, of.a), row3(tints, of.b), row3(tints, of.c)


@inlined
def _moves(matrix):
    """Whether a matrix is not the identity."""
    moves = False
    for k in range(12):
        moves = moves or load(matrix, k) != (1.0 if k % 5 == 0 else 0.0)
    return moves


@inlined
def _turn_of(matrix, mirrors):
    """The rows by which ``Mesh.transformed`` turns normals, which are cofactors over a power of two, and the sign."""
    largest = 0.0
    for k in range(12):
        largest = maximum(largest, abs(load(matrix, k))) if k % 4 != 3 else largest
    shrink = 0.5 / power_below(largest)
    x, y, z = column_of(matrix, 0, shrink), column_of(matrix, 1, shrink), column_of(matrix, 2, shrink)
    return cross(y, z), cross(z, x), cross(x, y), -1.0 if mirrors else 1.0


@inlined
def _turned(turn, n):
    """A normal, turned and at unit length, in the order of sums of ``Mesh.transformed``."""
    x, y, z, sign = turn
    m = add(add(scale(x, n[0]), scale(y, n[1])), scale(z, n[2]))
    largest = largest_component(m)
    if largest == 0.0:
        return m
    if largest < _SMALL:
        m, largest = scale(m, 1.0 / _SMALL), largest / _SMALL
    u, v, w = scale(m, 1.0 / power_below(largest))
    length = math.sqrt((u * u + w * w) + v * v)
    return (sign * (u / length), sign * (v / length), sign * (w / length))


@inlined
def _instance_row(scene, at):
    return (at >> _FACE_BITS) - 1


PLACED = FaceWays(_place, _placed_corners, _placed_normals, _placed_texcoords, _placed_tints, _instance_row, _touches)

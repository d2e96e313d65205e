"""Winding numbers from afar: what the series of octants leave out, and what their bounds say of it, by all faces.

Groups of faces stand so far apart that each is one octant of the tree's first node, whose centre and radius are known.
"""

import math
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.inside.moments import moments_of
from renderer.inside.multipoles import COEFFICIENTS, RADIUS, SIZE, SPREAD, see_octants, sum_lanes
from renderer.jit.decorators import kernel
from renderer.mesh.mesh import Mesh
from renderer.numerics.simd import pointer
from renderer.octree import Octree
from renderer.trace.point import Point
from validation.meshes import loose
from validation.promises.row import row

Floats = NDArray[np.float64]
_JUDGE = "direct sums"
# The order of the series. Groups stand so far apart, in units of their size, that others hardly count.
_ORDER = 6
_APART = 4096.0
# Faces of a group, and how unlike they are: leaves of a block and of three, a node, and a node of nodes.
_FACES = ((4, 1.0), (10, 0.01), (24, 1.0), (160, 1.0))
# The distance of a group, in radii: from the last on order 6 is 2^6 times as much as what is left out.
_RADII = (4.0, 32.0, 256.0)
# A face's own numbers err by some 2^-48 of its size, both here and there; the least error that is sought is 2^-40.
_ROUNDING = 2.0**-45
# Of a radius, towards the point: from far away to where a series may still be used.
_NEARNESS = np.array([0.1, 0.2, 0.35, 0.5, 0.6, 0.7, 0.74])
# How much a bound may be above what it bounds: what the farther of two faces adds, 8^-5 of it, and their widths.
_SLACK = 1.001
# Their sides in units of the radius.
_SIDE = 2.0**-8
# Copies of the nearer face, and the size of leaves: groups are a leaf, a node, and a node of several leaves.
_LINES = ((1, 2), (1, 1), (8, 4))
# How much more a radius and a spread may be than they must, and what the places of groups, at 2^12, leave of these.
_MORE, _LESS = 1.0 + 2.0**-28, 1.0 - 2.0**-36


def check_series(rng: Generator) -> list[dict[str, Any]]:
    """Series against all faces: within what a series leaves out at most, as the theory has it."""
    found = [_series_kept(rng, *kind) for kind in _FACES]
    near, told = (np.concatenate(one) for one in zip(*found, strict=True))
    return [
        row("a series errs by no more than the bound of higher orders", _JUDGE, near),
        row("an octant has the radius, the size and the spread of its faces", "direct sums", told),
        *_bounds(rng),
    ]


def _series_kept(rng: Generator, count: int, unlike: float) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Of eight groups of one kind: points around each in random directions, and the octants that they are."""
    body = _body(rng, count, unlike)
    reach, mesh = np.linalg.norm(body, axis=2), loose(body[None] + _places()[:, None, None])
    octree = Octree.from_mesh(mesh, leaf_size=32)
    ways = rng.normal(size=(8, len(_RADII), 3, 3))
    ways /= np.linalg.norm(ways, axis=3, keepdims=True)
    away = np.array(_RADII)[:, None] * reach.max()
    points = (_places()[:, None, None] + away[..., None] * ways).reshape(-1, 3)
    distance = np.broadcast_to(away, ways.shape[:3]).ravel()
    ours, (_, area, size) = octree.winding_number(points, 1.0), _parts(body)
    q = reach.max() / distance
    powers = (area[:, None] * reach**_ORDER).sum() / 3.0 / distance**_ORDER
    left_out = powers * (_ORDER + 1 - _ORDER * q) / (1.0 - q) ** 2
    allowed = (1.01 * left_out + _ROUNDING * size.sum()) / (4.0 * np.pi * distance**2)
    near = np.abs(ours - winding(points, mesh.triangles)) <= allowed
    # What the tree has of the groups, in units of its own.
    of_octants = moments_of(octree.tree, 1)[: 8 * COEFFICIENTS].reshape(COEFFICIENTS, 8)
    radius, sizes, spread = of_octants[[RADIUS, SIZE, SPREAD]] / [[octree.tree.scale], [1.0], [1.0]]
    told = _within(radius, reach.max()) & _within(sizes, size.sum() / (4.0 * np.pi * radius**2))
    told &= _within(spread, (area[:, None] * reach**_ORDER).sum() / (3.0 * size.sum() * radius**_ORDER))
    return near, told


def _within(given: Floats, least: float | Floats) -> NDArray[np.bool_]:
    """Whether numbers are not less than they must be, nor much more."""
    kept: NDArray[np.bool_] = (given >= _LESS * least) & (given <= _MORE * least)
    return kept


def _bounds(rng: Generator) -> list[dict[str, Any]]:
    """Of each group two small faces in a line with the point, the farther from it eight times as large: of those all
    that a series leaves out has one sign, so its bound is hardly more than its error.
    """
    found = [_bounds_kept(rng, copies, leaf_size) for copies, leaf_size in _LINES]
    kept, asked = (np.concatenate(one) for one in zip(*found, strict=True))
    return [
        row("the bound of a series is its worst error, and no more", _JUDGE, kept),
        row("a series is used exactly where its bound is within the share", _JUDGE, asked),
    ]


def _bounds_kept(rng: Generator, copies: int, leaf_size: int) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Of such groups of one kind, whether each bound is right, and whether series are used as they should be."""
    mesh, points, away = _in_line(rng, copies)
    octree = Octree.from_mesh(mesh, leaf_size=leaf_size)
    moments, scale, found = moments_of(octree.tree, 1), octree.tree.scale, np.zeros((len(points), 3))
    _see_root(moments, scale * points, np.full(len(points), 1e9), found)
    error = np.abs(winding(points, mesh.triangles) - found[:, 0])
    kept = (error <= found[:, 1]) & (found[:, 1] <= _SLACK * error) & (found[:, 2] == 0)
    # A share is a bound over area / (4 pi R^2).
    share = error * 4.0 * np.pi * away**2 / (4.5 * _SIDE**2)
    _see_root(moments, scale * points, _SLACK * share, found)
    used = found[:, 2] == 0
    _see_root(moments, scale * points, share / _SLACK, found)
    return kept, used & (found[:, 2] != 0)


def _in_line(rng: Generator, copies: int) -> tuple[Mesh, Floats, Floats]:
    """Eight groups of faces across an axis, points on these axes, and how far they are from their groups' centres.

    The radius is 1; the areas are 1/2 and 4 squares of _SIDE, the latter of so many copies of a face.
    """
    across, _ = np.linalg.qr(rng.normal(size=(8, 3, 3)))
    axis, u, v = np.moveaxis(across, 2, 0)
    # Corners whose mean is 0.
    corners = np.array([(-1.0, -1.0), (2.0, -1.0), (-1.0, 2.0)]) / 3.0 * _SIDE
    flat = corners[:, :1] * u[:, None] + corners[:, 1:] * v[:, None]
    near, far = axis[:, None] + flat, -axis[:, None] / 8.0 + math.sqrt(8.0 / copies) * flat
    faces = np.stack([near] + copies * [far], 1)
    # The face that is farther from the centre is the first of some groups and the last of the others.
    faces[::2] = faces[::2, ::-1]
    faces += _places()[:, None, None]
    away = np.broadcast_to(1.0 / _NEARNESS, (8, len(_NEARNESS)))
    points = _places()[:, None] + away[..., None] * axis[:, None]
    return loose(faces), points.reshape(-1, 3), away.ravel()


@kernel
def _see_root(rows: Any, points: Any, shares: Any, found: Any) -> None:
    """Write the sums of the first node's octants, their bounds, and the bits of octants too near, (n, 3)."""
    for i in range(len(points)):
        point = Point(0, 4, 8, points[i, 0], points[i, 1], points[i, 2])
        bits, value, bound = see_octants(pointer(rows), 0, point, shares[i])
        found[i, 0], found[i, 1], found[i, 2] = sum_lanes(value), sum_lanes(bound), bits


def winding(points: Floats, triangles: Floats) -> Floats:
    """Winding numbers by the solid angles of all faces, each to float64's digits of its size over R^2."""
    total = np.empty(len(points))
    normal, _, _ = _parts(triangles)
    for i, point in enumerate(points):
        a, b, c = np.moveaxis(triangles - point, 1, 0)
        la, lb, lc = (np.linalg.norm(x, axis=1) for x in (a, b, c))
        rest = la * lb * lc + _dot(a, b) * lc + _dot(b, c) * la + _dot(c, a) * lb
        total[i] = math.fsum(np.arctan2(2.0 * _dot(a, normal), rest)) / (2.0 * np.pi)
    return total


def _parts(triangles: Floats) -> tuple[Floats, Floats, Floats]:
    """Of each face: its area along its normal, its area, and half the product of its first two sides."""
    b, c = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    normal = np.cross(b, c) / 2.0
    return normal, np.linalg.norm(normal, axis=1), np.linalg.norm(b, axis=1) * np.linalg.norm(c, axis=1) / 2.0


def _dot(a: Floats, b: Floats) -> Floats:
    products: Floats = (a * b).sum(axis=1)
    return products


def _body(rng: Generator, count: int, unlike: float) -> Floats:
    """Faces (count, 3, 3) in pairs that mirror each other in 0, which is their centre. Half of the pairs are turned
    to each other, so that orders even and odd tell something of them.
    """
    half = rng.normal(size=(1, 3, 3)) + unlike * rng.normal(size=(count // 2, 3, 3))
    half -= 0.9 * half.mean(axis=1, keepdims=True)
    other = -half
    other[::2] = other[::2, [0, 2, 1]]
    return np.concatenate([half, other])


def _places() -> Floats:
    """The centres of eight groups, (8, 3)."""
    return _APART * np.array(list(np.ndindex(2, 2, 2)), np.float64)

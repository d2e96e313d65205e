"""Bodies for rays that start on surfaces: convex and not, wedges of all angles, rasters, needles, seams, coinciding."""

import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import box, icosphere, lattice_faces

Floats = NDArray[np.float64]

ANGLES = (0.1, 1.0, 10.0, 45.0, 60.0, 89.9, 90.0, 120.0, 179.0, 179.9, 180.1, 181.0, 270.0, 300.0, 350.0, 359.0)
# Size and offset, both with a rounding of every digit; each leaves the bodies their shape.
PLACES = ((1e-6, 0.0), (1e9, 0.0), (1.0, 1e6), (1e-3, 1e3), (1e3, 1e9))
_AWAY = np.array([1.0, -0.75, 0.375])
# An orthogonal matrix with no structure.
_TURN = np.linalg.qr(np.array([[2.0, 3.0, 1.0], [-1.0, 2.0, 5.0], [4.0, -1.0, 1.0]]))[0]


class Body(NamedTuple):
    """A mesh with the name of its family; ``closed``: its faces look outwards, and no ray from inside misses it."""

    family: str
    mesh: Mesh
    closed: bool


def bodies() -> Iterator[Body]:
    """All bodies, family by family."""
    sound = [tetrahedron(), Mesh(*_box()), turned(Mesh(*_box())), icosphere(1), notched()]
    for mesh in sound:
        yield Body("closed bodies", mesh, True)
    for degrees in ANGLES:
        yield Body("prisms", prism(degrees), True)
        yield Body("prisms", turned(prism(degrees)), True)
    yield Body("rasters", raster(7), False)
    yield Body("rasters", turned(raster(7)), False)
    for mesh in (*sound, prism(300.0)):
        yield Body("seams", soup(mesh), True)
    for power in (10, 26, 40):
        yield Body("needles", needle(2.0**-power), True)
        yield Body("needles", turned(needle(2.0**-power)), True)
    for mesh in (stack(), boxes_side_by_side(), soup(stack()), turned(stack())):
        yield Body("coinciding faces", mesh, False)
    for mesh in standing():
        yield Body("walls that stand on faces", mesh, False)
        yield Body("walls that stand on faces", soup(mesh), False)
    for scale, offset in PLACES:
        for mesh in (sound[0], sound[2], notched(), prism(60.0), prism(300.0)):
            yield Body("places", Mesh(mesh.vertices * scale + offset * _AWAY, mesh.faces), True)


def turned(mesh: Mesh) -> Mesh:
    """The mesh turned about the origin: four corners of a square are then in no common plane."""
    return Mesh(mesh.vertices @ _TURN.T, mesh.faces)


def soup(mesh: Mesh) -> Mesh:
    """Each face with vertices of its own, of equal bits."""
    return Mesh(mesh.vertices[mesh.faces].reshape(-1, 3), np.arange(mesh.faces.size, dtype=np.int32).reshape(-1, 3))


def tetrahedron() -> Mesh:
    """One without two equal angles."""
    corners = np.array([[0.1, 0.2, 0.3], [1.3, 0.1, 0.2], [0.4, 1.7, 0.1], [0.3, 0.4, 1.1]])
    return Mesh(corners, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], np.int32))


def prism(degrees: float) -> Mesh:
    """A prism over an arc and its centre, so that its edge along z has the angle; above 180 degrees it is a notch."""
    parts = max(1, math.ceil(degrees / 75.0))
    angles = np.radians(degrees) * np.arange(parts + 1) / parts
    rim = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    outline = np.concatenate([[[0.0, 0.0]], rim])
    count = len(outline)
    low = np.concatenate([outline, np.zeros((count, 1))], axis=1)
    faces = []
    for k in range(count):
        other = (k + 1) % count
        faces += [[k, other, count + other], [k, count + other, count + k]]
    for k in range(1, count - 1):
        faces += [[0, k + 1, k], [count, count + k, count + k + 1]]
    return Mesh(np.concatenate([low, low + np.array([0.0, 0.0, 1.0])]), np.array(faces, np.int32))


def notched() -> Mesh:
    """A sphere of 80 faces with hills: corners with edges of both kinds."""
    ball = icosphere(1)
    x, y, z = 6.0 * ball.vertices.T
    factors = 1.0 + 0.3 * np.sin(x) * np.sin(y + 1.0) * np.sin(z + 2.0)
    return Mesh(ball.vertices * factors[:, None], ball.faces)


def raster(size: int) -> Mesh:
    """A height field of size x size samples."""
    row, column = np.divmod(np.arange(size * size), size)
    heights = np.random.default_rng(size).integers(-8, 9, size * size) / 8.0
    squares = lattice_faces(size, size)
    return Mesh(np.stack([column, row, heights], axis=1).astype(np.float64), squares)


def needle(width: float) -> Mesh:
    """A tetrahedron of length 1 and a small width."""
    corners = np.array([[0.0, 0.0, 0.0], [0.3 * width, width, 0.0], [width, 0.2 * width, 0.1 * width], [0.1, 0.2, 1.0]])
    return Mesh(corners, np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]], np.int32))


def stack() -> Mesh:
    """Coinciding triangles, wound both ways, among others at the same corners."""
    corners = np.array([[0, 0, 0], [4, 0, 0], [0, 4, 0], [1, 1, 3], [2, 1, -3], [-3, -1, 0]], float)
    faces = [[0, 3, 1], [1, 0, 2], [0, 1, 2], [1, 4, 2], [2, 0, 1], [0, 5, 1], [0, 2, 1], [3, 2, 1]]
    return Mesh(corners, np.array(faces, np.int32))


def standing() -> list[Mesh]:
    """Walls whose feet lie within other faces: edges and corners there are no corners of those."""
    ground = np.array([[-10, -10, 0], [30, -10, 0], [-10, 30, 0]], float), np.array([[0, 1, 2]])
    wall = np.array([[0, -2, 0], [0, 2, 0], [0, 2, 4], [0, -2, 4]], float), np.array([[0, 1, 2], [0, 2, 3]])
    house = (_box()[0] * [4.0, 4.0, 8.0] + [2.0, 2.0, 0.0], _box()[1])
    higher = (_box()[0] * [8.0, 8.0, 12.0] + [6.0, 2.0, 0.0], _box()[1])
    # A prism balanced on its edge, and a fin that touches a fan of four faces with a corner.
    edge = np.array([[0, -1, 0], [0, 1, 0], [-1, -1, 1], [-1, 1, 1], [1, -1, 1], [1, 1, 1]], float)
    balanced = edge, np.array([[0, 1, 3], [0, 3, 2], [0, 4, 5], [0, 5, 1], [2, 3, 5], [2, 5, 4], [0, 2, 4], [1, 5, 3]])
    tips = np.array([[0, 0, 0], [0, 1, 1], [0, 1, 2], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]], float)
    fin = Mesh(tips, np.array([[0, 1, 2], [0, 3, 4], [0, 4, 5], [0, 5, 6], [0, 6, 3]], np.int32))
    together = ([ground, wall], [wall, ground], [ground, house], [house, ground], [house, higher], [higher, house])
    return [fin, *(_joined(parts) for parts in (*together, [ground, balanced], [balanced, ground]))]


def _joined(parts: Sequence[tuple[Floats, NDArray[Any]]]) -> Mesh:
    """One mesh of the vertices and faces of some."""
    firsts = np.cumsum([0, *(len(vertices) for vertices, _ in parts[:-1])])
    faces = [faces + first for (_, faces), first in zip(parts, firsts, strict=True)]
    return Mesh(np.concatenate([vertices for vertices, _ in parts]), np.concatenate(faces).astype(np.int32))


def boxes_side_by_side() -> Mesh:
    """Two boxes with a common side, which the two divide alike or not, and a third that touches both along edges."""
    vertices, faces = _box()
    moved = [vertices, vertices + np.array([1.0, 0.0, 0.0]), vertices + np.array([1.0, 1.0, 0.0])]
    return Mesh(np.concatenate(moved), np.concatenate([faces + len(vertices) * k for k in range(3)]).astype(np.int32))


def _box() -> tuple[Floats, NDArray[np.int32]]:
    mesh = box()
    return np.asarray(mesh.vertices, np.float64), mesh.faces

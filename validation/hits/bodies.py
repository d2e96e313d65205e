"""Bodies for rays that start on surfaces: convex and not, wedges of all angles, rasters, needles, seams, coinciding."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import box, icosphere, lattice_faces
from validation.meshes import AWAY, hilly, loose, prism, tetrahedron, turned

Floats = NDArray[np.float64]

ANGLES = (0.1, 1.0, 10.0, 45.0, 60.0, 89.9, 90.0, 120.0, 179.0, 179.9, 180.1, 181.0, 270.0, 300.0, 350.0, 359.0)
# Size and offset, both with a rounding of every digit; each leaves the bodies their shape.
PLACES = ((1e-6, 0.0), (1e9, 0.0), (1.0, 1e6), (1e-3, 1e3), (1e3, 1e9))


class Body(NamedTuple):
    """A mesh with the name of its family; ``closed``: its faces look outwards, and no ray from inside misses it."""

    family: str
    mesh: Mesh
    closed: bool


def bodies() -> Iterator[Body]:
    """All bodies, family by family."""
    sound = [tetrahedron(), box(), turned(box()), icosphere(1), hilly(1)]
    for mesh in sound:
        yield Body("closed bodies", mesh, True)
    for degrees in ANGLES:
        yield Body("prisms", prism(degrees), True)
        yield Body("prisms", turned(prism(degrees)), True)
    yield Body("rasters", raster(7), False)
    yield Body("rasters", turned(raster(7)), False)
    for mesh in (*sound, prism(300.0)):
        yield Body("seams", loose(mesh.triangles), True)
    for power in (10, 26, 40):
        yield Body("needles", needle(2.0**-power), True)
        yield Body("needles", turned(needle(2.0**-power)), True)
    for mesh in (stack(), boxes_side_by_side(), loose(stack().triangles), turned(stack())):
        yield Body("coinciding faces", mesh, False)
    for mesh in standing():
        yield Body("walls that stand on faces", mesh, False)
        yield Body("walls that stand on faces", loose(mesh.triangles), False)
    for scale, offset in PLACES:
        for mesh in (sound[0], sound[2], hilly(1), prism(60.0), prism(300.0)):
            yield Body("places", Mesh(mesh.vertices * scale + offset * AWAY, mesh.faces), True)


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
    ground = Mesh([[-10, -10, 0], [30, -10, 0], [-10, 30, 0]], [[0, 1, 2]])
    wall = Mesh([[0, -2, 0], [0, 2, 0], [0, 2, 4], [0, -2, 4]], [[0, 1, 2], [0, 2, 3]])
    house, higher = box((2, 2, 0), (6, 6, 8)), box((6, 2, 0), (14, 10, 12))
    # A prism balanced on its edge, and a fin that touches a fan of four faces with a corner.
    edge = [[0, -1, 0], [0, 1, 0], [-1, -1, 1], [-1, 1, 1], [1, -1, 1], [1, 1, 1]]
    balanced = Mesh(edge, [[0, 1, 3], [0, 3, 2], [0, 4, 5], [0, 5, 1], [2, 3, 5], [2, 5, 4], [0, 2, 4], [1, 5, 3]])
    tips = np.array([[0, 0, 0], [0, 1, 1], [0, 1, 2], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]], float)
    fin = Mesh(tips, np.array([[0, 1, 2], [0, 3, 4], [0, 4, 5], [0, 5, 6], [0, 6, 3]], np.int32))
    together = ([ground, wall], [wall, ground], [ground, house], [house, ground], [house, higher], [higher, house])
    return [fin, *map(Mesh.concatenate, (*together, [ground, balanced], [balanced, ground]))]


def boxes_side_by_side() -> Mesh:
    """Two boxes with a common side, which the two divide alike or not, and a third that touches both along edges."""
    return Mesh.concatenate([box((x, y, 0.0), (x + 1.0, y + 1.0, 1.0)) for x, y in ((0, 0), (1, 0), (1, 1))])

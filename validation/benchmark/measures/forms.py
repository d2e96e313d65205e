"""Meshes of other kinds than the series: where a tree that suits spheres may not suit them.

Each maker takes a number of faces, makes about so many, always the same for one number, and is exact in float32. The
form is the same at every size, but for ``city``, which has more and smaller blocks, and ``soup``, whose faces shrink
so that as many rays pass through it.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import box, lattice_faces
from validation.benchmark.peers.contender import Faces, Floats
from validation.hits.rays import float32_exact

_SEED = 23
# Of a tube: its length over its width, and where it points: along no axis, and across the camera's view.
_LONG, _ALONG = 40.0, np.array([0.62, 0.48, -0.62])
# Of a soup: the mean edge over the square root of the volume a face has, so that a ray passes about half of its width.
_EDGE = 3.5


def scan(faces: int) -> Mesh:
    """One closed blob as a scanner gives it: details of many sizes, and small faces beside large ones."""
    rows = max(2, round((1.0 + (1.0 + faces) ** 0.5) / 2.0))
    columns = 2 * rows
    # Angles that advance by unequal steps: neighbouring parts differ up to sevenfold in the size of their faces.
    down, round_ = np.arange(1, rows) / rows, np.arange(columns) / columns
    polar = np.pi * (down + 0.09 * np.sin(2.0 * np.pi * down) + 0.02 * np.sin(6.0 * np.pi * down))
    azimuth = 2.0 * np.pi * (round_ + 0.12 * np.sin(2.0 * np.pi * round_))
    ring = np.sin(polar)[:, None]
    sides = np.stack([ring * np.cos(azimuth), np.broadcast_to(np.cos(polar)[:, None], (rows - 1, columns)),
                      ring * np.sin(azimuth)], axis=-1)  # fmt: skip
    points = np.concatenate([sides.reshape(-1, 3), [[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]]])
    points *= np.array([1.0, 0.8, 0.6]) * (1.0 + 0.35 * _details(points, 3.0, 300.0))[:, None]
    return _named("scan", points, _capped(rows - 1, columns), faces)


def thin(faces: int) -> Mesh:
    """A closed tube, forty times as long as wide, that lies obliquely in its box: most rays through the box miss."""
    columns = max(3, round((faces * np.pi / (2.0 * _LONG)) ** 0.5))
    rows = max(2, round(faces / (2 * columns)))
    along = np.linspace(-0.5, 0.5, rows)[:, None]
    angle = np.arange(columns) * (2.0 * np.pi / columns)
    # Ribs, so that some rays from the tube meet it again.
    width = (1.0 + 0.25 * np.sin(200.0 * along)) / (2.0 * _LONG)
    # Along y, bent a little, with its ends at the poles of ``_capped``.
    tube = np.stack([width * np.cos(angle) + 0.01 * np.sin(5.0 * along), np.broadcast_to(-along, (rows, columns)),
                     width * np.sin(angle)], axis=-1)  # fmt: skip
    ends = np.array([[0.01 * np.sin(-2.5), 0.5, 0.0], [0.01 * np.sin(2.5), -0.5, 0.0]])
    points = np.concatenate([tube.reshape(-1, 3), ends])
    up = _ALONG / np.linalg.norm(_ALONG)
    right = np.cross(up, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    return _named("thin", 2.0 * points @ np.stack([right, up, np.cross(right, up)]), _capped(rows, columns), faces)


def terrain(faces: int) -> Mesh:
    """A height field over a square, open below: hills of many sizes."""
    side = max(1, round((faces / 2.0) ** 0.5))
    z, x = np.meshgrid(np.linspace(1.0, -1.0, side + 1), np.linspace(-1.0, 1.0, side + 1), indexing="ij")
    flat = np.stack([x.ravel(), np.zeros(x.size), z.ravel()], axis=-1)
    flat[:, 1] = 0.4 * _details(flat, 2.0, 400.0)
    return _named("terrain", flat, lattice_faces(side + 1, side + 1), faces)


def city(faces: int) -> Mesh:
    """Blocks of twelve faces each, of different heights, in a grid of streets, and two large faces as their ground."""
    side = max(1, round(((faces - 2) / 12.0) ** 0.5)) if faces > 2 else 1
    count, cell = side * side, 2.0 / side
    rng = np.random.default_rng(_SEED)
    row, column = np.divmod(np.arange(count), side)
    middle = -1.0 + cell * (np.stack([column, row], axis=-1) + 0.5)
    half = 0.5 * cell * rng.uniform(0.45, 0.85, (count, 2))
    height = cell * np.minimum(rng.lognormal(0.0, 0.7, count), 6.0)
    # A little below the ground, so that no face lies in it.
    lower = np.stack([middle[:, 0] - half[:, 0], np.full(count, -0.05 * cell), middle[:, 1] - half[:, 1]], axis=-1)
    upper = np.stack([middle[:, 0] + half[:, 0], height, middle[:, 1] + half[:, 1]], axis=-1)
    unit = box()
    corners = lower[:, None] + unit.vertices[None] * (upper - lower)[:, None]
    blocks = (8 * np.arange(count)[:, None, None] + unit.faces[None]).reshape(-1, 3)
    ground = np.array([[-1.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, -1.0], [-1.0, 0.0, -1.0]])
    below = 8 * count + np.array([[0, 1, 2], [0, 2, 3]])
    return _named("city", np.concatenate([corners.reshape(-1, 3), ground]), np.concatenate([blocks, below]), faces)


def soup(faces: int) -> Mesh:
    """Triangles at random in a cube, their sizes from a fifth of the mean to five times it; none shares a vertex."""
    count = max(1, faces)
    rng = np.random.default_rng(_SEED)
    size = _EDGE * count**-0.5 * np.exp(rng.uniform(-np.log(5.0), np.log(5.0), (count, 1, 1)))
    corners = rng.uniform(-1.0, 1.0, (count, 1, 3)) + 0.5 * size * rng.standard_normal((count, 3, 3))
    return _named("soup", corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3), faces)


FORMS: dict[str, Callable[[int], Mesh]] = {make.__name__: make for make in (scan, thin, terrain, city, soup)}


def short(faces: int) -> str:
    """A number of faces in a mesh's name: 100k, 1m."""
    return f"{faces // 1_000_000}m" if faces >= 1_000_000 else f"{faces // 1_000}k" if faces >= 1_000 else str(faces)


def _capped(rows: int, columns: int) -> Faces:
    """Faces of a tube of ``rows`` rings from the first pole down to the second; the poles are the last two vertices."""
    # Rings run the other way round than columns to the right, seen from outside.
    sides = lattice_faces(rows, columns, wrap_columns=True)
    here = np.arange(columns)
    beside, last = (here + 1) % columns, (rows - 1) * columns
    top = np.stack([np.full(columns, rows * columns), here, beside], axis=-1)
    end = np.stack([np.full(columns, rows * columns + 1), last + beside, last + here], axis=-1)
    return np.concatenate([sides, top[:, ::-1], end[:, ::-1]]).astype(np.int32)


def _details(points: Floats, coarsest: float, finest: float) -> Floats:
    """Seeded waves of many lengths, the shorter the lower, between about -1 and 1."""
    rng = np.random.default_rng(_SEED)
    height = np.zeros(len(points))
    for number in np.geomspace(coarsest, finest, 32):
        wave = rng.normal(size=3)
        wave *= number / np.linalg.norm(wave)
        height += np.sin(points @ wave + rng.uniform(0.0, 2.0 * np.pi)) / number
    return height


def _named(kind: str, points: Floats, faces: NDArray[np.integer], asked: int) -> Mesh:
    return Mesh(float32_exact(points), faces.astype(np.int32), name=f"{kind}_{short(asked)}")

"""Every bit of occlusion at points of the surface itself: vertices, and centroids through float32.

No face is named: a point's normal says in which region around it rays start. Starts that are lifted off the surface
must see the same, but for what the lift changes: where they differ, and on a sample of the others, exact arithmetic
says who is right.
"""

from collections.abc import Callable
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import box, icosphere, lattice_faces
from renderer.octree import Octree
from renderer.studies import face_points, fibonacci_sphere, occlusion, sky_view_factor
from validation.oracle.starts import Start, Surface
from validation.oracle.vectors import whole_vector

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
_SEED = 2046
# Lifted by so much of the largest coordinate: above what float32 rounds off, and so little that it changes few bits.
_LIFT = 2.0**-21
# Rounding decides on which side of its horizon a direction lies: nearer to it than this, either will do.
_LEVEL = 1e-12
# Of the bits on which both agree, so many are judged too.
_SAMPLE = 300
# Points of a mesh, drawn from all: exact arithmetic finds the faces around each that is judged.
_QUICK, _FULL = 200, 1500
_DIRECTIONS, _ALONG = 64, 24


class Places(NamedTuple):
    """Points on the surface with unit normals, a face that holds each, and its exact start."""

    points: Floats
    normals: Floats
    faces: Ints
    start: Callable[[Surface, int], Start]


def _raster() -> Mesh:
    """Random heights over a lattice."""
    size, rng = 40, np.random.default_rng(_SEED)
    row, column = np.divmod(np.arange(size * size), size)
    return Mesh(np.stack([column, row, 1.5 * rng.random(size * size)], axis=1), lattice_faces(size, size))


def _scan() -> Mesh:
    """A bumpy ball far from the origin, whose vertices went through float32."""
    ball, rng = icosphere(3), np.random.default_rng(_SEED + 1)
    vertices = ball.vertices * (1.0 + 0.03 * rng.normal(size=(len(ball.vertices), 1))) * 3.0 + [40.0, -70.0, 12.0]
    return Mesh(vertices.astype(np.float32).astype(np.float64), ball.faces)


def _spire() -> Mesh:
    """A star of 48 faces around a tip, and as many around a dent below."""
    count, rng = 48, np.random.default_rng(_SEED + 2)
    turn, reach = 2.0 * np.pi * np.arange(count) / count, rng.uniform(0.6, 1.4, count)
    rim = np.stack([reach * np.cos(turn), reach * np.sin(turn), 0.2 * rng.random(count)], axis=1)
    k, other = np.arange(count), np.roll(np.arange(count), -1)
    tip, dent = np.full(count, count), np.full(count, count + 1)
    faces = np.concatenate([np.stack([k, other, tip], axis=1), np.stack([other, k, dent], axis=1)])
    return Mesh(np.concatenate([rim, [[0.0, 0.0, 1.5], [0.0, 0.0, 0.5]]]), faces)


MESHES: dict[str, Callable[[], Mesh]] = {
    "raster": _raster,
    "box": box,
    "ball": lambda: icosphere(3),
    "scan": _scan,
    "spire": _spire,
}


def _vertices(mesh: Mesh) -> Places:
    normals = mesh.vertex_normals()
    points = np.asarray(mesh.vertices, np.float64)

    def start(surface: Surface, row: int) -> Start:
        x, y, z = map(Fraction, points[row].tolist())
        return Start((x, y, z))

    faces = np.zeros(len(points), np.int64)
    faces[mesh.faces.ravel()] = np.repeat(np.arange(len(mesh.faces)), 3)
    return Places(points, normals, faces, start)


def _centroids(mesh: Mesh) -> Places:
    exact, normals, faces = face_points(mesh)
    points = exact.astype(np.float32).astype(np.float64)
    return Places(points, normals, faces, lambda surface, row: surface.start_near(int(faces[row]), points[row]))


KINDS: dict[str, Callable[[Mesh], Places]] = {"vertices": _vertices, "centroids through float32": _centroids}
# Which points of which meshes.
CHECKS = tuple((name, kind) for kind in KINDS for name in MESHES)


def check_corners(index: int, quick: bool) -> dict[str, Any]:
    """A row: the number of bits, those that a lifted start has otherwise, those judged, the wrong ones, and the
    points whose share of the sky is another one where their face is named.
    """
    name, kind = CHECKS[index]
    mesh = MESHES[name]()
    octree, places, rng = Octree.from_mesh(mesh), KINDS[kind](mesh), np.random.default_rng([_SEED, index])
    face = octree.closest_point(places.points).face
    sky = sky_view_factor(octree, places.points, places.normals)
    named = sky_view_factor(octree, places.points, places.normals, leaving=face)
    most = _QUICK if quick else _FULL
    rows = np.sort(rng.permutation(len(places.points))[:most])
    points, normals = places.points[rows], places.normals[rows]
    ways = _ways(mesh, places.faces[rows], rng)
    ours = _hidden(octree, points, normals, ways)
    lifted = _hidden(octree, points + _LIFT * float(np.abs(points).max()) * normals, normals, ways)
    height = normals @ ways.T
    point, way = np.nonzero(height > _LEVEL)
    differing = np.flatnonzero((ours != lifted)[point, way])
    judged = np.union1d(differing, rng.choice(len(point), min(_SAMPLE, len(point)), replace=False))
    surface = Surface(mesh.vertices, mesh.faces)
    starts = {row: places.start(surface, int(rows[row])) for row in np.unique(point[judged]).tolist()}
    asked = [starts[row] for row in point[judged].tolist()]
    truth = hidden_by_law(surface, asked, normals[point[judged]], ways[way[judged]])
    below = int((~ours[height < -_LEVEL]).sum())
    wrong = int((ours[point[judged], way[judged]] != truth).sum()) + below
    return {"subject": f"{kind} of {name}", "asked": ours.size, "differing": len(differing), "judged": len(judged),
            "wrong": wrong, "points": len(sky), "unlike": int((sky != named).sum()),
            "hidden": float(ours.mean())}  # fmt: skip


def _ways(mesh: Mesh, faces: Ints, rng: np.random.Generator) -> Floats:
    """Directions all around, and some along faces and their edges, of which rounding cannot tell the side."""
    around = fibonacci_sphere(_DIRECTIONS - _ALONG).directions @ np.linalg.qr(rng.normal(size=(3, 3)))[0]
    corners = mesh.triangles[rng.choice(faces, _ALONG)]
    shares = np.where(rng.random((_ALONG, 2)) < 0.25, 0.0, rng.uniform(-1.0, 1.0, (_ALONG, 2)))
    shares[~shares.any(axis=1)] = (0.0, 1.0)
    along = np.einsum("nk,nkx->nx", shares, corners[:, 1:] - corners[:, :1])
    return np.concatenate([around, along / np.linalg.norm(along, axis=1, keepdims=True)])


def _hidden(octree: Octree, points: Floats, normals: Floats, ways: Floats) -> NDArray[np.bool_]:
    packed: Any = occlusion(octree, points, normals, ways, packed=True)
    return np.unpackbits(packed, axis=-1, count=len(ways)).astype(np.bool_)


def hidden_by_law(surface: Surface, starts: list[Start], normals: Floats, ways: Floats) -> NDArray[np.bool_]:
    """Whether each ray leads out of the region of its normal, or meets a face that does not hold its start."""
    hidden, left = np.zeros(len(starts), np.bool_), []
    for row, start in enumerate(starts):
        held = surface.holding(start.place)
        regions = surface.regions(held)
        hidden[row] = not regions.around(whole_vector(normals[row])) & regions.around(whole_vector(ways[row]))
        # Of a start that names a face and no side, no face that holds it stops the ray.
        left.append(Start(start.place, held[0][0]))
    goes = np.flatnonzero(~hidden)
    firsts = surface.each([left[row] for row in goes], ways[goes], [0] * len(goes), [False] * len(goes))
    hidden[goes] = [found[0].t is not None for found in firsts]
    return hidden

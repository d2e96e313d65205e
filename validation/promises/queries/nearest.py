"""Nearest faces where several are as near, or nearer by an ulp: at shared edges, around a point, and in heaps."""

import math
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.octree import BruteForce, Octree
from validation.meshes import loose
from validation.oracle.distance import squared_distance, ulps_from_root
from validation.oracle.vectors import relative
from validation.promises.queries.heaps import heaps
from validation.promises.row import row

Floats = NDArray[np.float64]
_JUDGE = "integer arithmetic"
# The exact distance, rounded: half an ulp, and as little more as twice the digits leave. Where it is 2^-64 of the
# farthest corner's or less it may be off by 2^-90 of that.
_ULPS, _NEAR, _BESIDE = 0.51, 2.0**-64, 2.0**-90
# Nearer than this share of it the distance may be 0.
_VANISHING = Fraction(1, 2**900)
# Where the nearest point is, as a share of the farthest corner's distance: u and v are quotients of float64.
_OF_REACH = 2.0**-40
_WEDGES, _PLACES = 64, 128
# The distance of a point from an edge, in powers of two of the edge: below 2^-41 products are computed with all digits.
_AWAY = -41.5, -39.0
_SHELLS, _FACES = 20, 48
_CORNER = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
_ABOVE = np.array([0.0, 0.0, 1.0])
_ORIGIN = (0, 0, 0)
_LARGE, _LEAST = 2.0**59 * np.stack([_CORNER, _CORNER + _ABOVE]), 2.0**-1074

# A large face and a small one nearly in its plane, and a point before both: their distances differ by an ulp, and the
# bounds by which faces are left out err by more.
_LEANING = np.array([
    [(-33.045207447741646, -5.013606521600748, -84.77900009878255),
     (32.77017724576062, 4.072627005254626, 81.9440398516141),
     (-19.68169045633817, 228.4636867949619, -98.12259778035029)],
    [(-0.1375151009905126, -0.4704897581730612, -1.4174801235842267),
     (-0.1355058600102527, -0.4702123696438687, -1.4123903293699733),
     (-0.1387084073346819, -0.4565117519225552, -1.423384636223686)],
])  # fmt: skip
_BEFORE = np.array([-0.03553295781744778, -0.47430636909892143, -1.4574451842178437])


def check_nearest(rng: Generator) -> list[dict[str, Any]]:
    """Distances, faces and nearest points."""
    heap, shell = [], []
    for faces, points in heaps(rng):
        for asked in (Octree.from_mesh(loose(faces)), BruteForce.from_mesh(loose(faces))):
            heap.append(exactly_near(asked, faces, points[::4]))
    # So near a corner of a face so large that the way vanishes in units of the face.
    heap.append(
        exactly_near(Octree.from_mesh(loose(_LARGE)), _LARGE, np.array(list(np.ndindex(3, 3, 3)))[1:] * _LEAST - _LEAST)
    )
    heap.append(exactly_near(Octree.from_mesh(loose(_LEANING)), _LEANING, _BEFORE + np.spacing(_BEFORE) * _steps(rng)))
    for _ in range(_SHELLS):
        faces = _shell(rng)
        shell.append(exactly_near(Octree.from_mesh(loose(faces)), faces, np.zeros((1, 3))))
    return [
        row("the nearest face and its distance, whatever the sizes of coordinates", _JUDGE, np.concatenate(heap)),
        row("the nearest of faces whose distances differ by some ulp", _JUDGE, np.concatenate(shell)),
        row("of two faces whose common edge is nearest, the lower is reported", "known answer", _edges_kept(rng)),
        row("beyond max_distance nothing is reported", "closed form", _beyond(rng)),
    ]


def _beyond(rng: Generator) -> NDArray[np.bool_]:
    """Points above a face, another is far away, with limits near their heights: one a point, and one for all."""
    heights = rng.uniform(1.0, 2.0, _PLACES)
    points = np.stack([np.full(_PLACES, 0.25), np.full(_PLACES, 0.25), heights], 1)
    octree, kept = Octree.from_mesh(loose(np.stack([_CORNER, _CORNER + 1e3]))), []
    for limit in (heights * rng.choice([0.5, 0.999, 1.001], _PLACES), *rng.uniform(1.0, 2.0, 3)):
        found = octree.closest_point(points, limit)
        told = [~np.isnan(found.u), ~np.isnan(found.v), ~np.isnan(found.points).any(axis=1), found.face == 0]
        kept += [(flags == (heights <= limit)) for flags in (*told, found.found, np.isfinite(found.distance))]
        kept.append(np.isinf(found.distance) | (found.distance == heights))
    return np.concatenate(kept)


def _steps(rng: Generator) -> NDArray[np.int64]:
    """No step, and some small ones."""
    return np.concatenate([np.zeros((1, 3), np.int64), rng.integers(-3, 4, (60, 3))])


def exactly_near(asked: Any, faces: Floats, points: Floats) -> NDArray[np.bool_]:
    """The answers with the exact distance, no higher face than the lowest nearest, and a point at that distance."""
    found = asked.closest_point(points)
    squares, lowest = zip(*(_nearest(point, faces) for point in points), strict=True)
    reach, other = (np.abs(faces[list(face)] - points[:, None]).max(axis=(1, 2)) for face in (found.face, lowest))
    ulps = np.array([ulps_from_root(d, square) for d, square in zip(found.distance, squares, strict=True)])
    roots = np.array([math.sqrt(square) for square in squares])
    # Either face may have been measured that far off.
    most = np.maximum(reach, other)
    beside = (found.distance <= _NEAR * most) & (np.abs(found.distance - roots) <= _BESIDE * most)
    way = np.linalg.norm((found.points - points) / reach[:, None], axis=1)
    kept: NDArray[np.bool_] = ((ulps < _ULPS) & (found.face <= lowest)) | beside
    # 0 on the surface, and else only where the promise lets it be.
    least = [(Fraction(size) * _VANISHING) ** 2 for size in most.tolist()]
    tiny = [square <= one for square, one in zip(squares, least, strict=True)]
    kept &= np.where(found.distance == 0.0, tiny, np.array([square != 0 for square in squares]))
    # The coordinates of the nearest point are rounded too.
    rounded = np.spacing(np.abs(points).max(axis=1)) / reach
    return kept & (np.abs(way - found.distance / reach) <= _OF_REACH + 4.0 * rounded)


def _nearest(point: Floats, faces: Floats) -> tuple[Fraction, int]:
    """The least squared distance, and the lowest face that has it."""
    whole, unit = relative(point.tolist(), faces.tolist())
    squares = [squared_distance(_ORIGIN, face) for face in whole]
    least = min(squares)
    return least / unit**2, squares.index(least)


def _edges_kept(rng: Generator) -> NDArray[np.bool_]:
    """Pairs of faces along an edge, seen from so near it that its distance loses digits on the way.

    Edges are parallel to z, in planes of constant x or y, and others. Points have smaller coordinates than corners, so
    that differences lose digits too.
    """
    kind = np.arange(_WEDGES) % 4
    way = rng.uniform(0.9, 1.0, (_WEDGES, 3)) * rng.choice([-1.0, 1.0], (_WEDGES, 3))
    way[kind <= 1, 0], way[(kind == 0) | (kind == 2), 1] = 0.0, 0.0
    centre = rng.uniform(-1.0, 1.0, (_WEDGES, 3)) / 64.0
    a, b = (centre + way * share for share in (-0.4999, 0.4999))
    long = np.linalg.norm(way, axis=1)[:, None]
    out = np.cross(way, rng.normal(size=(_WEDGES, 3)))
    out /= np.linalg.norm(out, axis=1)[:, None]
    across = np.cross(way / long, out)
    faces = np.stack([a, b, centre - out + across, b, a, centre - out - across], 1).reshape(-1, 3, 3)
    share = rng.uniform(0.49, 0.51, (_WEDGES, _PLACES, 1))
    away = 2.0 ** rng.uniform(*_AWAY, (_WEDGES, _PLACES, 1)) * long[:, None]
    points = a[:, None] + share * (b - a)[:, None] + away * out[:, None]
    # No other wedge comes so near.
    found = Octree.from_mesh(loose(faces)).closest_point(points)
    kept: NDArray[np.bool_] = (found.face == 2 * np.arange(_WEDGES)[:, None]).ravel()
    return kept


def _shell(rng: Generator) -> Floats:
    """Faces that are all at a distance of 1 from the origin, but for rounding: at corners, at edges and within."""
    faces = rng.normal(size=(_FACES, 3, 3)) + 2.0 * rng.normal(size=(_FACES, 1, 3))
    whole, unit = relative(_ORIGIN, faces.tolist())
    distance: Floats = np.sqrt([float(squared_distance(_ORIGIN, face) / unit**2) for face in whole])
    return faces / distance[:, None, None]

"""Polygons of files, notched, with corners in line, touching themselves: their triangles, by whole numbers.

Triangles that are all wound as a polygon is, have its area together, and lie over a point as often as the polygon winds
around it, cover it as they should.
"""

import warnings
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.mesh.load import load_mesh
from renderer.mesh.mesh import RepairWarning
from validation.promises.row import row

Whole = NDArray[np.int64]
Bools = NDArray[np.bool_]
# On so few places, corners in line, corners on edges and edges that cross are as frequent as what is simple.
_GRID, _LENGTHS = 5, (4, 5, 6, 7, 8)
# Beside polygons that reach so far, on no line through places of the grid, all that lies on it counts as flat at first.
_FAR = 2**21 * np.array([(7, 5), (-5, 7), (-7, -6), (5, -9)])
# More corners than fit a list that is searched from end to end.
_MANY = 4096
# So many points of each polygon's box, on places that are so much finer than those of corners.
_POINTS, _UNIT = 100, 64
# The axes of a plane as whole numbers: upright and turned, seen from in front and from behind, and tilted.
_FRAMES = np.array([
    [(1, 0, 0), (0, 1, 0)], [(0, 0, 1), (0, 1, 0)], [(0, 1, 0), (0, 0, 1)], [(0, 0, 1), (1, 0, 0)],
    [(1, 2, 2), (2, 1, -2)], [(2, 1, -2), (2, -2, 1)], [(-2, 2, -1), (2, 1, -2)], [(3, -4, 0), (0, 0, 5)],
])  # fmt: skip
_JUDGE = "integer arithmetic"


def check_outlines(rng: Generator, count: int) -> list[dict[str, Any]]:
    """Of ``count`` random polygons of each length the simple ones and some others, and long ones; in planes of all
    tilts, near and far, large and small.
    """
    outlines = [outline for length in _LENGTHS for outline in _random(rng, count, length)]
    outlines += _long(rng)
    covered, kept, touching = [], [], []
    for outline, triangles in zip(outlines, _loaded(outlines, rng), strict=True):
        fan = _fan(len(outline))
        points = _samples(outline, rng)
        if _covers(outline, fan, points):
            kept.append(np.array_equal(triangles, fan))
        elif len(outline) > max(_LENGTHS) or not _meetings(outline[None])[0][0]:
            covered.append(_covers(outline, triangles, points))
        else:
            touching.append(np.array_equal(triangles, fan) or _covers(outline, triangles, points))
    return [
        row("triangles cover a notched polygon once, wound as it is", _JUDGE, np.array(covered)),
        row("a polygon keeps its fan where the fan is right", _JUDGE, np.array(kept)),
        row("a polygon that touches itself is covered as it winds, or keeps its fan", _JUDGE, np.array(touching)),
    ]


def _random(rng: Generator, count: int, length: int) -> Whole:
    """Polygons on the grid, and those with two corners far from it, whose edges do not cross; of those that touch
    themselves a few.
    """
    outlines = rng.integers(0, _GRID, (count, length, 2))
    outlines[::2, -2:] = rng.choice(_FAR, (len(outlines[::2]), 2))
    touching, crossing = _meetings(outlines)
    return np.concatenate([outlines[~touching], outlines[touching & ~crossing][: count // 10]])


def _long(rng: Generator) -> list[Whole]:
    """Two ridges, one above the other, and a spiral: wound either way, from several first corners."""
    shapes = [_ridges(rng, 40), _ridges(rng, 41), _spiral()]
    some = [
        np.roll(shape[::way], shift, axis=0)
        for shape in shapes
        for way in (1, -1)
        for shift in range(0, len(shape), len(shape) // 7)
    ]
    return [*some, _ridges(rng, _MANY), _ridges(rng, _MANY + 1)]


def _ridges(rng: Generator, length: int) -> Whole:
    """A polygon that every upright line meets at most twice."""
    below, above = length // 2, length - length // 2
    low = np.stack([np.arange(below), rng.integers(0, 5, below)], 1)
    high = np.stack([np.arange(above), rng.integers(5, 10, above)], 1)
    return np.concatenate([low, high[::-1]])


def _spiral() -> Whole:
    """A way inwards along a square spiral whose arms are 2 apart, and a way back, 1 beside it."""
    steps = np.array([(1, 0), (0, 1), (-1, 0), (0, -1)])
    inwards = np.array([(-1, 1), (-1, -1), (1, -1), (1, 1)])
    lengths = [14, 14, *np.repeat(np.arange(14, 2, -2), 2)[1:]]
    turns = np.arange(len(lengths)) % 4
    way = np.cumsum(steps[turns] * np.array(lengths)[:, None], axis=0)
    back = way + inwards[turns]
    return np.concatenate([[(0, 0)], way, back[::-1], [(0, 1)]])


def _loaded(outlines: list[Whole], rng: Generator) -> list[Whole]:
    """The triangles of each polygon, numbers of its corners, after they were written to a file and read."""
    lines, starts = [], np.cumsum([0, *map(len, outlines)])
    frames = _FRAMES[rng.integers(0, len(_FRAMES), len(outlines))]
    shifts = rng.integers(-(2**20), 2**20, (len(outlines), 3)) * rng.integers(0, 2, (len(outlines), 1))
    scales = 2.0 ** rng.integers(-20, 20, len(outlines))
    for outline, frame, shift, scale in zip(outlines, frames, shifts, scales, strict=True):
        # Float64 holds these numbers: what is written is in one plane exactly.
        lines += [f"v {x!r} {y!r} {z!r}" for x, y, z in (scale * (outline @ frame + shift)).tolist()]
    lines += [f"g {a}\nf " + " ".join(map(str, range(a + 1, b + 1))) for a, b in pairwise(starts)]
    with TemporaryDirectory(prefix="outlines-") as folder:
        path = Path(folder) / "outlines.obj"
        path.write_text("\n".join(lines), encoding="ascii")
        with warnings.catch_warnings():
            # Polygons that cannot be cut are named; here they are judged.
            warnings.simplefilter("ignore", RepairWarning)
            mesh = load_mesh(path)
    parts = {int(part.name): mesh.faces[part.faces].astype(np.int64) for part in mesh.parts}
    return [parts.get(int(start), np.empty((0, 3), np.int64)) - start for start in starts[:-1]]


def _fan(length: int) -> Whole:
    return np.array([(0, k, k + 1) for k in range(1, length - 1)])


def _samples(outline: Whole, rng: Generator) -> Whole:
    """Points of the outline's box, in units of which places are ``_UNIT`` apart, on no line through two corners."""
    corners = _UNIT * outline
    points = rng.integers(corners.min(axis=0), corners.max(axis=0) + 1, (_POINTS, 2))
    if len(outline) > max(_LENGTHS):
        return points[points[:, 0] % _UNIT != 0]  # of long ones no triangle is flat but upright
    first, second = np.triu_indices(len(outline), 1)
    sides = _turn(corners[first][:, None], corners[second][:, None], points[None])
    return points[(sides != 0).all(axis=0)]


def _covers(outline: Whole, triangles: Whole, points: Whole) -> bool:
    """Whether triangles (m, 3) of an outline (n, 2) are wound as it is, have its area together, and lie over each point
    as often as it winds around it.
    """
    corners = _UNIT * outline
    areas, whole = _turn(*np.moveaxis(corners[triangles], 1, 0)), _turn(*np.moveaxis(corners[_fan(len(outline))], 1, 0))
    sign = np.sign(whole.sum())
    if (areas * sign < 0).any() or areas.sum() != whole.sum():
        return False
    over = np.zeros(len(points), np.int64)
    for triangle in triangles[areas != 0]:
        over += _winding(corners[triangle], points)
    return bool((over == _winding(corners, points)).all())


def _winding(ring: Whole, points: Whole) -> Whole:
    """The winding number of a ring (n, 2) around each point."""
    a, b = ring[:, None], np.roll(ring, -1, axis=0)[:, None]
    side = _turn(a, b, points[None])
    up = (a[..., 1] <= points[:, 1]) & (b[..., 1] > points[:, 1]) & (side > 0)
    down = (b[..., 1] <= points[:, 1]) & (a[..., 1] > points[:, 1]) & (side < 0)
    wound: Whole = up.sum(axis=0) - down.sum(axis=0)
    return wound


def _turn(a: Whole, b: Whole, c: Whole) -> Whole:
    ab, ac = b - a, c - a
    turn: Whole = ab[..., 0] * ac[..., 1] - ab[..., 1] * ac[..., 0]
    return turn


def _meetings(outlines: Whole) -> tuple[Bools, Bools]:
    """Whether any two edges of an outline, neighbours left out, share a point, and whether any cross there."""
    count, length, _ = outlines.shape
    touching, crossing = np.zeros(count, np.bool_), np.zeros(count, np.bool_)
    for first in range(length):
        for second in range(first + 2, min(length, length + first - 1)):
            a, b = outlines[:, first], outlines[:, first + 1]
            c, d = outlines[:, second], outlines[:, (second + 1) % length]
            apart = (np.maximum(a, b) < np.minimum(c, d)) | (np.maximum(c, d) < np.minimum(a, b))
            sides, others = _sides(a, b, c, d), _sides(c, d, a, b)
            touching |= ~apart.any(axis=1) & (sides <= 0) & (others <= 0)
            crossing |= (sides < 0) & (others < 0)
    return touching, crossing


def _sides(a: Whole, b: Whole, c: Whole, d: Whole) -> Whole:
    """1 where c and d lie on the same side of the line through a and b, -1 where on either side, else 0."""
    sides: Whole = np.sign(_turn(a, b, c)) * np.sign(_turn(a, b, d))
    return sides

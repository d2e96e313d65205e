"""Polygons of files, notched, with corners in line, crossing or touching themselves: their triangles, by whole numbers.

Triangles that are all wound as a simple polygon is, and whose edges cancel but for its outline, cover it exactly once.
"""

from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.mesh.load import load_mesh
from validation.promises.row import row

Whole = NDArray[np.int64]
Bools = NDArray[np.bool_]
# On so few places, corners in line, corners on edges and edges that cross are as frequent as what is simple.
_GRID, _LENGTHS = 5, (4, 5, 6, 7, 8)
# Beside polygons that reach so far, on no line through places of the grid, all that lies on it counts as flat at first.
_FAR = 2**21 * np.array([(7, 5), (-5, 7), (-7, -6), (5, -9)])
# The most corners of a polygon that is cut otherwise than into a fan.
_MOST = 4096
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
    triangles = _loaded(outlines, rng)
    alike: dict[int, list[int]] = {}
    for number, outline in enumerate(outlines):
        alike.setdefault(len(outline), []).append(number)
    covered, kept = [], []
    for length, numbers in alike.items():
        some, cut = np.stack([outlines[k] for k in numbers]), np.stack([triangles[k] for k in numbers])
        fan = np.broadcast_to(_fan(length), cut.shape)
        # The long ones are simple as they are made.
        notched = ~_meetings(some)[0] if length <= max(_LENGTHS) else np.full(len(numbers), length <= _MOST)
        notched &= ~_covers(some, fan, 0)
        covered.append(_covers(some, cut, 1)[notched])
        kept.append((cut == fan).all(axis=(1, 2))[~notched])
    return [
        row("triangles cover a notched polygon once, wound as it is", _JUDGE, np.concatenate(covered)),
        row("a polygon keeps its fan where the fan is right or nothing is", _JUDGE, np.concatenate(kept)),
    ]


def _random(rng: Generator, count: int, length: int) -> Whole:
    """Polygons on the grid, and those with two corners far from it. Of those that are not simple a few, mostly such
    whose edges touch without crossing.
    """
    outlines = rng.integers(0, _GRID, (count, length, 2))
    outlines[::2, -2:] = rng.choice(_FAR, (len(outlines[::2]), 2))
    touching, crossing = _meetings(outlines)
    others = outlines[touching & ~crossing][: count // 10], outlines[crossing][: count // 50]
    return np.concatenate([outlines[~touching], *others])


def _long(rng: Generator) -> list[Whole]:
    """Two ridges, one above the other, and a spiral: wound either way, from several first corners."""
    shapes = [_ridges(rng, 40), _ridges(rng, 41), _spiral()]
    some = [
        np.roll(shape[::way], shift, axis=0)
        for shape in shapes
        for way in (1, -1)
        for shift in range(0, len(shape), len(shape) // 7)
    ]
    return [*some, _ridges(rng, _MOST), _ridges(rng, _MOST + 1)]


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
    lines += ["f " + " ".join(map(str, range(a + 1, b + 1))) for a, b in pairwise(starts)]
    with TemporaryDirectory(prefix="outlines-") as folder:
        path = Path(folder) / "outlines.obj"
        path.write_text("\n".join(lines), encoding="ascii")
        faces = load_mesh(path).faces.astype(np.int64)
    cuts = np.cumsum([len(outline) - 2 for outline in outlines])[:-1]
    return [part - start for part, start in zip(np.split(faces, cuts), starts[:-1], strict=True)]


def _fan(length: int) -> Whole:
    return np.array([(0, k, k + 1) for k in range(1, length - 1)])


def _covers(outlines: Whole, triangles: Whole, least: int) -> Bools:
    """Whether the triangles (m, n - 2, 3) of each outline (m, n, 2) are wound as it is, with twice an area of at least
    ``least``, and all edges but those of the outline cancel.
    """
    count, length, _ = outlines.shape
    fan = np.broadcast_to(_fan(length), triangles.shape)
    sign = np.sign(_doubled(outlines, fan).sum(axis=1))
    wound = (_doubled(outlines, triangles) * sign[:, None] >= least).all(axis=1)
    # With the outline backwards, there are as many edges each way.
    ring = np.broadcast_to(np.stack([np.roll(np.arange(length), -1), np.arange(length)], 1), (count, length, 2))
    edges = np.concatenate([triangles[:, :, [0, 1]], triangles[:, :, [1, 2]], triangles[:, :, [2, 0]], ring], axis=1)
    there, back = edges[:, :, 0] * length + edges[:, :, 1], edges[:, :, 1] * length + edges[:, :, 0]
    kept: Bools = wound & (np.sort(there, axis=1) == np.sort(back, axis=1)).all(axis=1)
    return kept


def _doubled(outlines: Whole, triangles: Whole) -> Whole:
    """Twice the area of each triangle, positive where it turns left."""
    a, b, c = (np.take_along_axis(outlines, triangles[:, :, k, None], axis=1) for k in range(3))
    return _turn(a, b, c)


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

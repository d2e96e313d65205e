"""All hits of rays down piles of fans: more than memory is laid out for, at corners, at edges and between."""

from itertools import product
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.octree import BruteForce, Octree
from renderer.results.hits import AllHits
from validation.promises.row import row

Floats = NDArray[np.float64]
_JUDGE = "known answer"
# Fans of a pile, and how often each ray comes. A ray meets fewer blocks than are listed for it, as many, some more, and
# so many that its hits need more memory; some rays are more than are searched for together.
_PILES = ((1, 1), (16, 2), (33, 17), (250, 1))
# Of points, in units of the last fan's place: u and v are quotients of float64.
_NEAR = 2.0**-45
_RIM = np.array([(4, 0), (4, 4), (0, 4), (-4, 4), (-4, 0), (-4, -4), (0, -4), (4, -4)], np.float64)
# So the rays go: four down for each step aside.
_WAY = np.array([1.0, 2.0, -4.0])
# t_min, t_max, the most hits, and how far back a ray starts: so far that float32 cannot hold where it ends.
_FAR = 2.0**25 + 1.0
_BOUNDS = ((0.0, np.inf, None, 0.0), (3.0, 32.0, None, 0.0), (0.0, np.inf, 1, 0.0), (2.0, 40.0, 7, 0.0),
           (2.0, 36.0, None, _FAR), (3.0, 248.0, None, _FAR))  # fmt: skip


def check_piles(rng: Generator) -> list[dict[str, Any]]:
    """Every hit and every contact, all of them or the first, within any bounds, by a tree and by brute force."""
    found: dict[bool, list[NDArray[np.bool_]]] = {True: [], False: []}
    for axis, (count, times) in enumerate(_PILES):
        # Shuffled, and every fifth fan lies in another.
        order = rng.permutation(count)
        t = np.where(order % 5 == 4, order - 1, order) + 2.0
        mesh, origins = _pile(t, times)
        mesh, origins = Mesh(np.roll(mesh.vertices, axis, axis=1), mesh.faces), np.roll(origins, axis, axis=1)
        for asked, contacts in product((Octree.from_mesh(mesh), BruteForce.from_mesh(mesh)), (True, False)):
            for least, most, kept, back in _BOUNDS:
                way = np.roll(_WAY, axis)
                rays, limits = (origins - back * way, way), (least + back, most + back)
                hits = asked.all_hits(*rays, *limits, contacts=contacts, max_hits=kept)
                number = asked.count_hits(*rays, *limits, contacts=contacts)
                right = _right(hits, number, _expected(t + back, contacts, *limits) * times, kept)
                places = rays[0][hits.ray] + hits.t[:, None] * rays[1]
                near = np.abs(hits.points - places).max(axis=1) <= _NEAR * np.abs(mesh.vertices).max()
                found[contacts] += [right, near]
    return [
        row(f"all hits of a pile, {name}, by t, then face", _JUDGE, np.concatenate(found[contacts]))
        for contacts, name in ((True, "one for each edge and corner"), (False, "each face's"))
    ]


def _pile(t: Floats, times: int) -> tuple[Mesh, Floats]:
    """Fans of eight faces around a corner, which rays meet at these ``t``, and the rays' origins, each so many times.

    The rays pass within the eight faces, at the edges between them, at the corner, and outside. The corner that a face
    begins with is the fan's in some and not in others.
    """
    ring = np.concatenate([[(0.0, 0.0)], _RIM])
    places = np.concatenate([ring, np.zeros((9, 1))], axis=1)
    corners = np.array([np.roll((0, k + 1, (k + 1) % 8 + 1), k) for k in range(8)])
    faces = np.arange(len(t))[:, None, None] * 9 + corners
    mesh = Mesh((places + t[:, None, None] * _WAY).reshape(-1, 3), faces.reshape(-1, 3).astype(np.int32))
    within = (_RIM + np.roll(_RIM, -1, axis=0)) / 4.0
    starts = np.concatenate([within, _RIM / 2.0, [(0.0, 0.0), (9.0, 0.0)]])
    return mesh, np.tile(np.concatenate([starts, np.zeros((18, 1))], axis=1), (times, 1))


def _expected(t: Floats, contacts: bool, least: float, most: float) -> list[list[tuple[float, int]]]:
    """The rows (t, face) of the eighteen rays."""
    met = [[k] for k in range(8)] + [[(k - 1) % 8, k] for k in range(8)] + [list(range(8)), []]
    expected = []
    for some in met:
        rows = sorted((at, 8 * fan + k) for fan, at in enumerate(t.tolist()) for k in some if least <= at <= most)
        if contacts and len(some) > 1:
            # At an edge or a corner of one place, the first; fans in one place have theirs in one.
            rows = [now for now, last in zip(rows, [(-1.0, 0), *rows], strict=False) if now[0] != last[0]]
        expected.append(rows)
    return expected


def _right(
    hits: AllHits, number: NDArray[np.int64], expected: list[list[tuple[float, int]]], kept: int | None
) -> NDArray[np.bool_]:
    """Of which rays all rows are right, and the number of all."""
    told, ends = list(zip(hits.t.tolist(), hits.face.tolist(), strict=True)), hits.offsets.tolist()
    right = [told[ends[i] : ends[i + 1]] == rows[:kept] for i, rows in enumerate(expected)]
    return np.array(right) & (number == [len(rows) for rows in expected])

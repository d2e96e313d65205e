"""Open edges: piles of faces, some doubled, tripled or turned, counted edge by edge."""

from collections import Counter
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import box
from renderer.octree import Octree
from validation.promises.refused import refuses
from validation.promises.row import row

_JUDGE = "direct count"
_PILES, _FACES, _PLACES = 150, 8, 5
_ANYWHERE = (9.0, 9.0, 9.0)
Edge = tuple[int, int]


def check_edges(rng: Generator) -> list[dict[str, Any]]:
    """Random faces of few places, so that edges are shared by none to many; and copies of a closed box."""
    closed: list[bool] = []
    opened: list[bool] = []
    asked: list[bool] = []
    for number, faces in enumerate((*_piles(rng), *_boxes())):
        last, at = int(faces.max()), faces
        places = rng.normal(size=(last + 1, 3))
        # Vertices at one position count as one: every other time the last vertex is where the first one is.
        if number % 2:
            places[last], at = places[0], np.where(faces == last, 0, faces)
        mesh = Mesh(places, faces)
        odd, one_way = _open(_passed(at))
        nothing = _cancel(at)
        closed.append(mesh.is_closed() == (not one_way and not nothing))
        opened += [_edges(mesh.odd_edges, at, faces) == odd, _edges(mesh.open_edges, at, faces) == one_way]
        octree = Octree.from_mesh(mesh)
        asked += [
            refuses(octree.contains, _ANYWHERE, rule=rule) == bool(faulty)
            for rule, faulty in (("even-odd", odd), ("nonzero", one_way or nothing))
        ]
    return [
        row(
            "a mesh is closed where each edge is passed as often either way, and not each face is there both ways",
            _JUDGE,
            np.array(closed),
        ),
        row("open and odd edges are those that faces leave open", _JUDGE, np.array(opened)),
        row("contains refuses a surface that its rule finds open or nothing", _JUDGE, np.array(asked)),
        row("no rule but nonzero is accepted together with winding, and no unknown rule", "known answer", _ruled()),
    ]


def _ruled() -> NDArray[np.bool_]:
    octree, kept = Octree.from_mesh(box()), []
    for ask in (octree.contains, octree.signed_distance):
        for rule, winding, taken in (
            ("nonzero", True, True), ("even-odd", True, False), ("even-odd", False, True), ("nonzero", False, True),
            ("odd", False, False), ("odd", True, False), ("nonzero", 1, False), (None, False, False),
        ):  # fmt: skip
            kept.append(refuses(ask, _ANYWHERE, rule=rule, winding=winding) != taken)
    return np.array(kept)


def _passed(faces: NDArray[np.int64]) -> Counter[Edge]:
    """The number of times that each edge is passed each way; one from a place to itself bounds nothing."""
    pairs = ((int(a), int(b)) for f in faces for a, b in zip(f, np.roll(f, -1), strict=True))
    return Counter(pair for pair in pairs if pair[0] != pair[1])


def _piles(rng: Generator) -> list[NDArray[np.int64]]:
    """Faces of three different places; the first is there once to four times."""
    found = []
    for number in range(_PILES):
        faces = np.array([rng.permutation(_PLACES)[:3] for _ in range(rng.integers(1, _FACES))])
        found.append(np.concatenate([faces, np.repeat(faces[:1], number % 4, axis=0)]))
    return found


def _boxes() -> list[NDArray[np.int64]]:
    """A closed box, twice and three times the same, turned, and twice with one turned."""
    faces = np.asarray(box().faces, np.int64)
    turned = faces[:, ::-1]
    return [faces, turned, *(np.concatenate(some) for some in ((faces, faces), (faces, turned), (faces,) * 3))]


def _open(passed: Counter[Edge]) -> tuple[set[Edge], set[Edge]]:
    """The edges that an odd number of faces has, and those that are not passed as often one way as the other."""
    edges = {(min(edge), max(edge)) for edge in passed}
    odd = {(a, b) for a, b in edges if (passed[a, b] + passed[b, a]) % 2}
    return odd, {(a, b) for a, b in edges if passed[a, b] != passed[b, a]}


def _cancel(faces: NDArray[np.int64]) -> bool:
    """Whether each face is there as often one way round as the other, from whichever corner."""
    rounds = Counter(min(tuple(np.roll(face, -k).tolist()) for k in range(3)) for face in faces)
    turned = Counter(min(tuple(np.roll(face[::-1], -k).tolist()) for k in range(3)) for face in faces)
    return rounds == turned


def _edges(rows: NDArray[np.int64], at: NDArray[np.int64], faces: NDArray[np.int64]) -> set[Edge]:
    """Edges of vertices as edges of the places that the vertices are at."""
    place = dict(zip(faces.ravel().tolist(), at.ravel().tolist(), strict=True))
    return {(min(place[a], place[b]), max(place[a], place[b])) for a, b in rows.tolist()}

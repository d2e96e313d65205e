"""Rows 1 to 32, 46 and 49 to 54 of the extreme cases: each judgement fails when what it judges is broken."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from cases import cases
from remembered import remembered

from renderer import Hits, Mesh, Octree
from validation.oracle import exact
from validation.stability.cases import builds, judgement, rays
from validation.stability.cases.hits import CASES
from validation.stability.cases.queries import crowded

ROWS = {case.number: case for case in CASES}
Break = Callable[[Hits], Hits]


class Unasked:
    """In Embree's place: the table shows what it says, and no row is judged by it."""

    def __init__(self, *mesh: Any, **mode: Any) -> None: ...

    def closest_hit(self, origins: Any, directions: Any) -> tuple[Any, Any]:
        return np.full(len(origins), np.inf), np.full(len(origins), -1)


@pytest.fixture(scope="module", autouse=True)
def _truth() -> Iterator[None]:
    """Exact arithmetic is asked once for rays that are judged several times; Embree is not asked."""
    once = remembered(exact.closest_hits, lambda *rays: tuple((given.dtype, given.tobytes()) for given in rays))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(exact, "closest_hits", once)
        for module in (builds, judgement):
            patch.setattr(module, "Embree", Unasked)
        yield


def test_the_table_has_every_row_once_and_in_order():
    assert [case.number for case in CASES] == [*range(1, 33), 46, 49, 50, 51, 52, 53, 54]


def broken(monkeypatch: pytest.MonkeyPatch, spoil: Break) -> None:
    """Octrees, but not brute force, answer what ``spoil`` makes of the right hits."""
    right = Octree.closest_hit
    monkeypatch.setattr(Octree, "closest_hit", lambda *ray, **bounds: spoil(right(*ray, **bounds)))


def a_hit_lost(hits: Hits) -> Hits:
    rows = np.flatnonzero(hits.hit)
    t, face, u, v = hits.t.copy(), hits.face.copy(), hits.u.copy(), hits.v.copy()
    lost = rows[len(rows) // 2 : len(rows) // 2 + 1]
    t[lost], face[lost], u[lost], v[lost] = np.inf, -1, np.nan, np.nan
    return replace(hits, t=t, face=face, u=u, v=v)


def t_an_ulp_off(hits: Hits) -> Hits:
    return replace(hits, t=np.nextafter(hits.t, np.inf))


def t_as_rough_as_float32(hits: Hits) -> Hits:
    """Relative, because some rows go beyond float32's range."""
    return replace(hits, t=hits.t * (1 + 2.0**-22))


def another_duplicate(hits: Hits) -> Hits:
    return replace(hits, face=np.where(hits.hit, hits.face + 1, -1))


def everything_hit(hits: Hits) -> Hits:
    hit = hits.hit
    filled = [np.where(hit, a, b) for a, b in ((hits.t, 1.0), (hits.face, 0), (hits.u, 0.25), (hits.v, 0.25))]
    return Hits(*filled, hits._mesh)


@cases(
    "spoil, rows",
    [
        (a_hit_lost, (1, 2, 3, 4, 5, 6, 8, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 24, 26, 29, 30, 31)),
        (t_an_ulp_off, (4, 5, 6, 13, 20, 21, 22, 23, 24, 26, 30, 31)),
        (t_as_rough_as_float32, (3, 14, 16, 18, 19, 29)),
        (another_duplicate, (18, 19, 21, 30)),
        (everything_hit, (7, 9, 25, 28, 26)),
    ],
)
def test_the_row_fails_when_the_octree_is_broken(monkeypatch, spoil: Break, rows: tuple[int, ...]):
    broken(monkeypatch, spoil)
    if spoil in (t_an_ulp_off, t_as_rough_as_float32, another_duplicate):  # every hit is wrong: a few rays see it
        sound = builds.ray_batch
        monkeypatch.setattr(builds, "ray_batch", lambda *some: sound(*some).select(np.arange(len(sound(*some)))[:60]))
    if spoil is everything_hit:  # of hits in a plane, all but a few are taken for permitted: they must be seen anyhow
        few, permitted = iter(range(60)), rays._permitted
        monkeypatch.setattr(rays, "_permitted", lambda *hit: next(few, None) is None or permitted(*hit))
    assert [row for row in rows if ROWS[row].run(True).holds] == []


def test_row_11_fails_where_the_interval_is_open(monkeypatch):
    right = Octree.closest_hit

    def open_interval(self, origins, directions, t_min=0.0, t_max=np.inf):
        return right(self, origins, directions, np.nextafter(t_min, np.inf), t_max)

    monkeypatch.setattr(Octree, "closest_hit", open_interval)
    assert not ROWS[11].run(True).holds


@pytest.mark.parametrize("row", [26, 27])
def test_bad_meshes_must_be_refused(monkeypatch, row):
    def mend(self, *given, **named):
        """Accept what came, as a mesh that silently drops the bad does."""
        object.__setattr__(self, "vertices", np.eye(3))
        object.__setattr__(self, "faces", np.array([[0, 1, 2]], np.int32))

    monkeypatch.setattr(Mesh, "__init__", mend)
    assert not ROWS[row].run(True).holds


@cases("query", ["contains", "count_hits", "all_hits", "winding_number", "signed_distance"])
def test_row_54_fails_on_a_wrong_answer_at_the_corner_of_many_faces(monkeypatch, query):
    right = getattr(Octree, query)

    def spoiled(*arguments, **options):
        found = right(*arguments, **options)
        if query == "contains":
            return ~found
        if query == "all_hits":
            found.face[-1:] += 1
            return found
        return found + 1

    monkeypatch.setattr(Octree, query, spoiled)
    assert crowded.wrong_at_spindle(100) > 0

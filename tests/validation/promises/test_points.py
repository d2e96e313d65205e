"""Each check of answers about points and piles finds what is broken."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from renderer.mesh.mesh import Mesh
from renderer.octree import Octree
from validation.promises.queries import angles, edges, inside, nearest, piles, series, signed, views

CHECKS: dict[str, Callable[[np.random.Generator], list[dict[str, Any]]]] = {
    "inside": inside.check_inside,
    "edges": edges.check_edges,
    "angles": angles.check_angles,
    "halves": angles.check_halves,
    "series": series.check_series,
    "nearest": nearest.check_nearest,
    "signed": signed.check_signed,
    "views": views.check_views,
    "piles": piles.check_piles,
}


EXACT: dict[tuple[bytes, bytes], Any] = {}
exactly = nearest._nearest


def exactly_once(point: Any, faces: Any) -> Any:
    """The nearest face by exact arithmetic, which is asked with the same numbers in several tests."""
    asked = point.tobytes(), faces.tobytes()
    if asked not in EXACT:
        EXACT[asked] = exactly(point, faces)
    return EXACT[asked]


@pytest.fixture(autouse=True)
def _truth(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(nearest, "_nearest", exactly_once)


def rows(name: str) -> list[dict[str, Any]]:
    return CHECKS[name](np.random.default_rng(5))


def broken(name: str) -> set[str]:
    """The first words of the promises that a check finds broken."""
    return {" ".join(row["promise"].split()[:3]) for row in rows(name) if row["broken"]}


def changed(monkeypatch: pytest.MonkeyPatch, name: str, change: Callable[[Any], Any]) -> None:
    """Let ``change`` alter what a query answers."""
    sound = getattr(Octree, name)
    monkeypatch.setattr(Octree, name, lambda self, *given, **options: change(sound(self, *given, **options)))


def test_one_point_on_the_wrong_side_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    def wrong(answers: Any) -> Any:
        answers[3] = ~answers[3]
        return answers

    changed(monkeypatch, "contains", wrong)
    assert broken("inside") == {"inside is exact,", "points a float32"} and broken("halves") == {"inside a mesh"}


def test_winding_numbers_a_little_off_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    changed(monkeypatch, "winding_number", lambda numbers: numbers * (1.0 + 1e-9))
    assert broken("angles") == {"winding numbers near", "winding numbers beside"}
    assert broken("halves") == {"winding numbers are"}
    assert broken("series") == {"a series errs"}


def test_bounds_that_are_too_small_or_too_large_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    sound = series.moments_of
    for row, factor in ((series.SPREAD, 0.99), (series.SPREAD, 1.01), (series.SIZE, 1.01)):

        def changed_moments(tree: Any, threads: int, row: int = row, factor: float = factor) -> Any:
            moments = sound(tree, threads).copy()
            moments[8 * row : 8 * row + 8] *= factor
            return moments

        monkeypatch.setattr(series, "moments_of", changed_moments)
        expected = {"the bound of", "an octant has"} | ({"a series is"} if row == series.SPREAD else set())
        assert broken("series") == expected


def test_another_face_and_another_distance_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    def another(found: Any) -> Any:
        found.face[:] = np.where(found.face % 2 == 0, found.face + 1, found.face)
        return found

    def farther(found: Any) -> Any:
        found.distance[:] = np.nextafter(found.distance, np.inf)
        return found

    with monkeypatch.context() as patch:
        changed(patch, "closest_point", another)
        assert {"of two faces", "beyond max_distance nothing"} <= broken("nearest")
    changed(monkeypatch, "closest_point", farther)
    assert {"the nearest face", "the nearest of"} <= broken("nearest")


def test_hits_in_another_order_and_places_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    def turned(found: Any) -> Any:
        found.face[:] = found.face[::-1].copy()
        return found

    def moved(found: Any) -> Any:
        found.u[:] += 1e-12
        return found

    for change in (turned, moved):
        with monkeypatch.context() as patch:
            changed(patch, "all_hits", change)
            assert broken("piles") == {"all hits of"}


def test_a_sign_that_is_lost_beyond_the_limit_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    changed(monkeypatch, "signed_distance", lambda found: np.where(np.isinf(found), np.inf, found))
    assert broken("signed") == {"beyond its limit"}


def test_the_other_sign_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    changed(monkeypatch, "signed_distance", lambda found: -found)
    assert "a signed distance" in broken("signed")


def test_a_ball_that_hides_itself_and_one_that_hides_nothing_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(views, "_COUNT", 200)  # every answer is changed
    with monkeypatch.context() as patch:
        changed(patch, "visible", lambda found: found & False)
        assert broken("views") == {"a ball's centre", "what is in", "what is nearer", "a point sees", "each pair of"}
    changed(monkeypatch, "visible", lambda found: found | True)
    assert broken("views") == {"nothing is seen", "what is in", "what is nearer", "a point sees", "each pair of"}


def test_edges_that_are_counted_otherwise_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(Mesh, "is_closed", lambda mesh: not len(mesh.odd_edges))
        assert broken("edges") == {"a mesh is", "contains refuses a"}  # which looks there
    with monkeypatch.context() as patch:
        patch.setattr(Mesh, "open_edges", property(lambda mesh: mesh.odd_edges))
        assert "open and odd" in broken("edges")
    monkeypatch.setattr(Octree, "contains", lambda *given, **options: np.zeros(1, np.bool_))
    assert broken("edges") == {"contains refuses a", "no rule but"}

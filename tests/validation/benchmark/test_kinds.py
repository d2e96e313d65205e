"""Which of a contender's answers count as differing: those beyond rounding, and no others."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from renderer.mesh.shapes import box
from renderer.octree import Octree
from validation.benchmark.measures.kinds import KINDS, rounding
from validation.benchmark.peers.contender import Family, HitLists, Points

# The largest coordinate of the box and of all that is asked here is 4: limits are 2^-18.
LIMIT = 2.0**-18
RAYS = Family("some", np.array([[0.25, 0.5, 4.0], [0.25, 0.5, 0.5], [3.0, 3.0, 3.0]]), np.array([[0.0, 0.0, -2.0]] * 3))
POINTS = Points("some", np.array([[0.25, 0.5, 0.75], [0.25, 0.5, 1.0 + LIMIT / 2], [0.25, 0.5, 4.0]]))


@pytest.fixture(scope="module")
def octree() -> Octree:
    return Octree.from_mesh(box())


def differing(octree: Octree, kind: str, ours: Any, theirs: Any) -> list[bool]:
    asked = POINTS if KINDS[kind].families[0] in ("wide", "box", "near") else RAYS
    found: list[bool] = KINDS[kind].differing(octree, asked, ours, theirs).tolist()
    return found


def test_the_limit_is_a_share_of_the_largest_coordinate(octree: Octree) -> None:
    assert rounding(octree, RAYS.origins) == rounding(octree, POINTS.points) == LIMIT
    assert rounding(octree, np.array([[-8.0, 0.0, 0.0]])) == 2 * LIMIT


@pytest.mark.parametrize(
    ("kind", "ours", "theirs", "expected"),
    [
        ("closest", [1.0, 0.25, np.inf], [1.5, 0.25, np.inf], [False, False, False]),
        ("closest", [1.0, 0.25, np.inf], [np.inf, 0.25, 7.0], [True, False, True]),
        ("any", [True, True, False], [True, False, False], [False, True, False]),
        ("count", [2, 1, 0], [3, 1, 1], [True, False, True]),
        ("nearest", [0.25, 0.0, 3.0], [0.25 + 0.9 * LIMIT, 0.0, 3.0 - 0.9 * LIMIT], [False, False, False]),
        ("nearest", [0.25, 0.0, 3.0], [0.25 + 1.1 * LIMIT, np.nan, 3.0 - 1.1 * LIMIT], [True, True, True]),
        ("signed", [-0.25, 0.25 * LIMIT, 3.0], [0.25, -0.25 * LIMIT, 3.0], [True, False, False]),
    ],
)
def test_numbers_and_flags(octree: Octree, kind: str, ours: Any, theirs: Any, expected: list[bool]) -> None:
    assert differing(octree, kind, np.array(ours), np.array(theirs)) == expected


def test_a_point_on_another_side_differs_unless_it_is_at_the_surface(octree: Octree) -> None:
    ours = octree.contains(POINTS.points)
    assert ours.tolist() == [True, False, False]
    assert differing(octree, "contains", ours, ours) == [False, False, False]
    # The second lies half a limit above the box.
    assert differing(octree, "contains", ours, ~ours) == [True, False, True]


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (lambda n, t, f: (n, t, f), [False, False, False]),
        (lambda n, t, f: (n, t + 0.4 * LIMIT, f), [False, False, False]),  # directions are 2 long
        (lambda n, t, f: (n, t + 0.6 * LIMIT, f), [True, True, False]),
        (lambda n, t, f: (n, t + np.array([0, 0.6 * LIMIT, 0]), f), [True, False, False]),
        (lambda n, t, f: (n - np.array([1, 0, 0]), t[1:], f[1:]), [True, False, False]),
        (lambda n, t, f: (n + np.array([0, 0, 1]), np.append(t, 1.0), np.append(f, 0)), [False, False, True]),
        (lambda n, t, f: (n, t, 0 * f), [False, False, False]),  # which face is not asked
    ],
)
def test_lists_of_hits(octree: Octree, change: Callable[..., Any], expected: list[bool]) -> None:
    hits = octree.all_hits(RAYS.origins, RAYS.directions)
    ours = HitLists(hits.counts, hits.t, hits.face)
    assert ours.counts.tolist() == [2, 1, 0]
    assert differing(octree, "all", ours, HitLists(*change(*ours))) == expected


def test_a_grazing_hit_may_be_off_along_the_ray_but_not_above_the_face(octree: Octree) -> None:
    # At a slope of 1/4.5 onto the top, 4.6 limits along the ray are one above it.
    rays = Family("one", np.array([[-4.0, 0.5, 2.0]]), np.array([[4.5, 0.0, -1.0]]))
    hits = octree.all_hits(rays.origins, rays.directions)
    ours, kind = HitLists(hits.counts, hits.t, hits.face), KINDS["all"]
    assert ours.t.tolist() == pytest.approx([1.0, 10 / 9]) and rounding(octree, rays.origins) == LIMIT
    for off, expected in ((0.9, False), (1.1, True)):
        theirs = ours._replace(t=ours.t + np.array([off * LIMIT, 0.0]))
        assert kind.differing(octree, rays, ours, theirs).tolist() == [expected]

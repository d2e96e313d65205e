"""Every query of points with every argument, alone and together with others, against slow twins in plain NumPy.

Points are multiples of 1/4, so many lie on faces, edges and corners, distances tie, and nothing is rounded but the
square root of a distance.
"""

import inspect
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from array_forms import FORMS, forms, shaped, shapes_of
from hypothesis import given, settings
from hypothesis import strategies as st
from twins import CUBES, MESH, Flags, Floats, Integers, dot, holding, meetings, nearest_places

from renderer import BruteForce, Mesh, Octree
from renderer.mesh.shapes import box
from renderer.queryable import Queries

pytestmark = pytest.mark.judges(
    "BruteForce.closest_point", "BruteForce.contains", "BruteForce.signed_distance", "BruteForce.visible",
    "BruteForce.winding_number", "Octree.closest_point", "Octree.contains", "Octree.signed_distance", "Octree.visible",
    "Octree.winding_number",
)  # fmt: skip


# The cubes of the other twins, and one that is turned inside out.
TURNED = box((12.0, 0.0, 0.0), (14.0, 2.0, 2.0))
SOLIDS = Mesh.concatenate([MESH, Mesh(TURNED.vertices, TURNED.faces[:, ::-1])])
CORNERS = SOLIDS.triangles
ALL_CUBES = [*CUBES, ((12.0, 0.0, 0.0), 2.0)]
SIGNS = np.array([1, 1, 1, -1])
TARGETS = {
    "octree": Octree.from_mesh(SOLIDS, threads=1),
    "sah": Octree.from_mesh(SOLIDS, split="sah", leaf_size=1, threads=3),
    "brute force": BruteForce.from_mesh(SOLIDS, threads=2),
}
SEEDS = st.integers(0, 2**20)
COUNTS = st.sampled_from([1, 2, 40, 301])


def in_cubes(points: Floats) -> Floats:
    """The share (n, cubes) of a small ball about each point that lies in each cube: 1/2 on a face, 1/8 at a corner."""
    shares = []
    for lower, side in ALL_CUBES:
        within = (points >= lower).all(axis=1) & (points <= np.add(lower, side)).all(axis=1)
        ends = ((points == lower) | (points == np.add(lower, side))).sum(axis=1)
        shares.append(np.where(within, 0.5**ends, 0.0))
    return np.stack(shares, axis=1)


def inside(points: Floats, boundary: bool = True, rule: str = "nonzero", winding: bool = False, **_: Any) -> Any:
    shares = in_cubes(points)
    whole = shares == 1.0
    turns = (whole * SIGNS).sum(axis=1)
    found = whole.sum(axis=1) % 2 == 1 if rule == "even-odd" else turns > 0 if winding else turns != 0
    return np.where(((shares > 0.0) & ~whole).any(axis=1), boundary, found)


def nearest(points: Floats, max_distance: Any = np.inf, **_: Any) -> tuple[Floats, Integers, Floats]:
    """Distance, face and place, inf, -1 and nan beyond the largest distance."""
    places = nearest_places(CORNERS, points)
    squares = dot(places - points[:, None], places - points[:, None])
    face, rows = squares.argmin(axis=1), np.arange(len(points))
    distance, place = np.sqrt(squares[rows, face]), places[rows, face]
    near = distance <= np.ravel(max_distance)
    return np.where(near, distance, np.inf), np.where(near, face, -1), np.where(near[:, None], place, np.nan)


def check_contains(got: Any, points: Floats, shape: Any, options: dict[str, Any]) -> None:
    np.testing.assert_array_equal(got, inside(points, **options).reshape(shape), strict=True)


def check_winding_number(got: Any, points: Floats, shape: Any, options: dict[str, Any]) -> None:
    assert got.shape == shape
    bound = options.get("tolerance", 1e-3) + len(CORNERS) * 2.0**-44
    np.testing.assert_allclose(got.ravel(), (in_cubes(points) * SIGNS).sum(axis=1), rtol=0, atol=bound)


def check_closest_point(got: Any, points: Floats, shape: Any, options: dict[str, Any]) -> None:
    distance, face, place = nearest(points, **options)
    np.testing.assert_array_equal(got.face, face.reshape(shape), strict=True)
    np.testing.assert_array_equal(got.points, place.reshape((*shape, 3)), strict=True)
    np.testing.assert_array_max_ulp(got.distance.ravel(), distance, 1)


def check_signed_distance(got: Any, points: Floats, shape: Any, options: dict[str, Any]) -> None:
    assert got.shape == shape
    sign = np.where(inside(points, **options), -1.0, 1.0)
    np.testing.assert_array_max_ulp(got.ravel(), nearest(points, **options)[0] * sign + 0.0, 1)


CHECKS = {
    "contains": check_contains,
    "winding_number": check_winding_number,
    "closest_point": check_closest_point,
    "signed_distance": check_signed_distance,
}


@st.composite
def distances(draw: Any, shape: tuple[int, ...]) -> Any:
    """One largest distance, or one for each point."""
    ends = [0.0, 0.25, 1.0, 2.0, np.inf]
    if draw(st.booleans()):
        return draw(st.sampled_from(ends))
    return np.random.default_rng(draw(SEEDS)).choice(ends, shape)


OPTIONS: dict[str, Any] = {
    "boundary": lambda shape: st.booleans(),
    "rule": lambda shape: st.sampled_from(["nonzero", "even-odd"]),
    "winding": lambda shape: st.booleans(),
    "tolerance": lambda shape: st.sampled_from([0.0, 1e-9, 0.02, 1]),
    "max_distance": distances,
}


@pytest.mark.parametrize("query", CHECKS)
@given(st.data())
@settings(max_examples=50)
def test_a_query_answers_as_its_slow_twin(query: str, data: st.DataObject) -> None:
    rng, count = np.random.default_rng(data.draw(SEEDS)), data.draw(COUNTS)
    shape, reach = data.draw(shapes_of(count)), data.draw(st.sampled_from([28, 60]))  # where two cubes cross, and all
    points = rng.integers(-4, reach, (count, 3)) / 4.0
    weights = rng.multinomial(8, [1 / 3] * 3, count) / 8.0
    on = (CORNERS[rng.integers(0, len(CORNERS), count)] * weights[:, :, None]).sum(axis=1)
    points = np.where(rng.random((count, 1)) < 0.4, on, points)
    asked = inspect.signature(getattr(Queries, query)).parameters.keys() - {"self", "points"}
    chosen = data.draw(st.sets(st.sampled_from(sorted(asked))))
    options = {name: data.draw(OPTIONS[name](shape)) for name in sorted(chosen)}
    if options.get("winding") and "rule" in options:
        options["rule"] = "nonzero"  # no other goes with it
    given = {n: FORMS[data.draw(forms)](v) if type(v) is np.ndarray else v for n, v in options.items()}
    target = TARGETS[data.draw(st.sampled_from(sorted(TARGETS)))]
    got = getattr(target, query)(FORMS[data.draw(forms)](shaped(shape, points)), **given)
    CHECKS[query](got, points, shape, options)


@given(st.data())
@settings(max_examples=30)
def test_points_see_each_other_as_their_slow_twins(data: st.DataObject) -> None:
    """No face that holds an end hides anything, any other one that the way meets does."""
    rng, count = np.random.default_rng(data.draw(SEEDS)), data.draw(COUNTS)
    shape, held = data.draw(shapes_of(count)), []
    ends = rng.integers(-4, 60, (2, count, 3)) / 4.0
    corners = CORNERS[rng.integers(0, len(CORNERS), (2, count))]
    on = (corners * (rng.multinomial(8, [1 / 3] * 3, (2, count)) / 8.0)[..., None]).sum(axis=2)
    ends = np.where(rng.random((2, count, 1)) < 0.5, on, ends)
    if data.draw(st.booleans()):
        ends[data.draw(st.integers(0, 1))] = ends[0, 0]  # one place, given once
    options: dict[str, Any] = {}
    asked = ends.copy()
    for name, points, beside in zip(("leaving", "reaching"), ends, asked, strict=True):
        of_end = holding(CORNERS, points)
        held.append(of_end)
        if data.draw(st.booleans()):
            # The last of the faces that hold it, where it is told.
            last = np.where(of_end.any(axis=1), len(CORNERS) - 1 - of_end[:, ::-1].argmax(axis=1), -1)
            told = np.where(rng.random(count) < 0.7, last, -1)
            options[name] = FORMS[data.draw(forms)](shaped(shape, told))
            # So far off that nothing but the face's number tells that they are on it.
            alone = (told >= 0) & (of_end.sum(axis=1) == 1)
            beside[alone] += SOLIDS.face_normals()[told[alone]] * rng.choice([-(2.0**-24), 2.0**-24], (alone.sum(), 1))
    way = ends[1] - ends[0]
    apart = way.any(axis=1)
    hides = [met & ~held[0] & ~held[1] for met in met_between(ends[0], np.where(apart[:, None], way, 1.0))]
    expected = ~(hides[0].any(axis=1) & apart)
    told = hides[0].any(axis=1) == hides[1].any(axis=1)  # a way that only touches an edge is as rounding has it
    a, b = (FORMS[data.draw(forms)](shaped(shape, points)) for points in asked)
    seen = TARGETS[data.draw(st.sampled_from(sorted(TARGETS)))].visible(a, b, **options)
    assert seen.shape == shape
    np.testing.assert_array_equal(seen.ravel()[told], expected[told])


def met_between(points: Floats, ways: Floats) -> Iterator[Flags]:
    """Which faces (n, F) are met at t from 0 to 1: at first their edges too, then their insides alone."""
    for edges in (True, False):
        t = meetings(CORNERS, points, ways, edges)
        yield (t >= 0.0) & (t <= 1.0)


def test_every_query_of_points_has_a_twin() -> None:
    queries = {name for name, thing in vars(Queries).items() if callable(thing) and not name.startswith("_")}
    of_points = {name for name in queries if "points" in inspect.signature(getattr(Queries, name)).parameters}
    assert of_points == {*CHECKS, "visible"}
    assert inspect.signature(Queries.visible).parameters.keys() == {"self", "points", "targets", "leaving", "reaching"}

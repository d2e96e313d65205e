"""The exact judge of rays that start on a surface: against closed forms, and against itself by other ways."""

import math
from fractions import Fraction
from itertools import pairwise, product

import numpy as np
import pytest
from cases import cases

from validation.oracle import exact
from validation.oracle.cones import Regions, cone_at
from validation.oracle.distance import squared_distance
from validation.oracle.fans import Fan
from validation.oracle.starts import First, Start, Surface, first_hit, start_near, start_on, stopped
from validation.oracle.vectors import dot, rational

ZERO = Fraction(0)
WAYS = [way for way in product((-1, 0, 2), repeat=3) if any(way)]
# Each side of a unit cube as two triangles, wound outwards.
SQUARES = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]


def cube(low=(0, 0, 0), size=2):
    corners = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], float) * size + low
    return corners, np.array([face for a, b, c, d in SQUARES for face in ((a, b, c), (a, c, d))])


def joined(*meshes):
    firsts = np.cumsum([0, *(len(vertices) for vertices, _ in meshes)])
    return np.concatenate([v for v, _ in meshes]), np.concatenate(
        [faces + first for (_, faces), first in zip(meshes, firsts, strict=False)]
    )


def normals(vertices, faces):
    return np.cross(vertices[faces[:, 1]] - vertices[faces[:, 0]], vertices[faces[:, 2]] - vertices[faces[:, 0]])


def place(*point):
    return tuple(map(Fraction, point))


def held(surface, point):
    return [face for face, _ in surface.holding(point)]


def test_a_cube_from_its_corners_edges_and_sides_inwards_is_its_octant_its_quarter_and_its_half():
    vertices, faces = cube()
    surface, outwards = Surface(vertices, faces), normals(vertices, faces)
    for point in product((0, 1, 2), (0, Fraction(1, 3), 2), (0, 2)):
        at = held(surface, place(*point))
        for face, way in product(at, WAYS):
            leads = [f for f in at if outwards[f] @ way > 0]
            (found,) = surface.first(Start(place(*point), face), way, -1)
            if leads:
                assert found == First(ZERO, leads[0], (leads[0],))
                continue
            ends = [(Fraction(2 * (w > 0)) - p) / w for p, w in zip(place(*point), way, strict=True) if w]
            assert found.t == min(end for end in ends if end > 0) and found.face not in at


def test_a_cube_from_its_corners_edges_and_sides_outwards_is_the_rest():
    vertices, faces = cube()
    surface, outwards = Surface(vertices, faces), normals(vertices, faces)
    for point in product((0, 1, 2), (0, Fraction(1, 3), 2), (0, 2)):
        at = held(surface, place(*point))
        for face, way in product(at, WAYS):
            (found,) = surface.first(Start(place(*point), face), way, 1)
            leads = [outwards[f] @ way for f in at]
            if max(leads) != 0:
                assert found == (First(ZERO, at[0], (at[0],)) if max(leads) < 0 else First(None, -1, ()))
            else:
                # Along a side it may end at the edge of the next, which is closed.
                assert found.face not in at and found.t != 0


@cases("degrees", [0.1, 1.0, 30.0, 90.0, 179.9, 180.1, 270.0, 300.0, 359.0])
def test_a_prism_is_a_wedge_at_its_edge(degrees):
    """Two walls from the z axis: along x and turned by the angle. Inside is what lies between."""
    angle = math.radians(degrees)
    c, s = math.cos(angle), math.sin(angle)
    vertices = np.array([[0, 0, 0], [0, 0, 1], [1, 0, 0], [1, 0, 1], [c, s, 0], [c, s, 1]])
    faces = [[0, 2, 3], [0, 3, 1], [0, 5, 4], [0, 1, 5]]
    ceiling = [[1, 3, 5], [0, 4, 2]]  # closed against each other by nothing: the sides stay open far away
    surface = Surface(vertices, faces + ceiling)
    rng = np.random.default_rng(3)
    outwards = [[Fraction(0), Fraction(-1)], [-Fraction(s), Fraction(c)]]
    for start, turn in product((surface.start_on(1, 0.0, 0.5), surface.start_on(3, 0.25, 0.0)), range(60)):
        way = rng.normal(size=3) if turn % 4 else np.array([c, s, rng.normal()])
        leads = [n[0] * Fraction(way[0]) + n[1] * Fraction(way[1]) for n in outwards]
        inside = max(leads) <= 0 if degrees < 180 else min(leads) <= 0
        outside = max(leads) >= 0 if degrees < 180 else min(leads) >= 0
        for side, free in ((-1, inside), (1, outside)):
            stops = [f for f, lead in zip((1, 3), leads, strict=True) if -side * lead > 0]
            found = surface.first(start, way, side)
            if free:
                assert all(one.face not in (1, 3) for one in found)
            else:
                assert found == [First(ZERO, stops[0], (stops[0],))]


def test_two_cubes_that_touch_along_an_edge_leave_four_wedges():
    vertices, faces = joined(cube((0, 0, 0)), cube((-2, -2, 0)))
    surface, along = Surface(vertices, faces), normals(vertices, faces)
    point = place(0, 0, Fraction(1, 3))
    at = held(surface, point)
    assert len(at) == 4
    for face, side, way in product(at, (-1, 1), WAYS):
        # Each wedge is a quarter; the one beside the face is where its own side and its own half are.
        middle = vertices[faces[face]].mean(axis=0) * [1, 1, 0]
        beside = np.sign(middle + side * along[face])[:2]
        stops = [f for f in at if way_beyond(along[f], way, beside)]
        (found,) = surface.first(Start(point, face), way, side)
        if all(beside * way[:2] >= 0):
            assert found.face not in at
        else:
            assert found == First(ZERO, stops[0], (stops[0],)), (face, side, way)


def way_beyond(normal, way, quarter):
    """Whether a wall of a quarter, known by its normal, has the quarter on one side and a direction on the other.

    The wall x = 0 of the cubes has y of the cube's sign; which quarters it borders follows from that.
    """
    axis = int(np.abs(normal[:2]).argmax())
    # The first cube is where both are positive, its normals look to the negative; the second is the other way.
    half = -np.sign(normal[axis])
    return quarter[1 - axis] == half and quarter[axis] * way[axis] < 0


def test_two_cubes_that_touch_at_a_corner_leave_one_outside():
    vertices, faces = joined(cube((0, 0, 0)), cube((-2, -2, -2)))
    surface = Surface(vertices, faces)
    at = held(surface, place(0, 0, 0))
    first, second = [f for f in at if f < 12], [f for f in at if f >= 12]
    for face, way in product(at, WAYS):
        (found,) = surface.first(Start(place(0, 0, 0), face), way, 1)
        if min(way) > 0:
            assert found == First(ZERO, first[0], (first[0],))
        elif max(way) < 0:
            assert found == First(ZERO, second[0], (second[0],))
        else:
            assert found.face not in at


def test_two_cubes_with_a_common_side_have_three_regions_there():
    """Between coinciding faces there is nothing: turned back, both are behind; through one, the next is ahead."""
    vertices, faces = joined(cube((0, 0, 0)), cube((2, 0, 0)))
    surface = Surface(vertices, faces)
    point = place(2, Fraction(1, 2), Fraction(1, 3))
    low, high = held(surface, point)
    assert low < 12 <= high
    ahead, back = (1, 0, 0), (-1, 0, 0)
    # The face of the first cube looks to the second, that of the second to the first.
    assert surface.first(Start(point, low), ahead, -1) == [First(ZERO, low, (low,))]
    assert surface.first(Start(point, low), back, -1)[0].t == 2
    assert surface.first(Start(point, low), ahead, 1)[0].t == 2
    assert surface.first(Start(point, low), ahead, 1, True) == [First(ZERO, high, (high,))]
    assert surface.first(Start(point, high, low), ahead, -1, True)[0].t == 2
    assert surface.first(Start(point, high, low), back, 1, True)[0].t == 2
    assert surface.first(Start(point, low), back, -1, True) == [First(ZERO, high, (high,))]
    # Along the common side no face is ahead.
    assert surface.first(Start(point, low), (0, 1, 0), 1, True)[0].face not in (low, high)


def test_coinciding_faces_come_one_after_the_other_each_once():
    corners = np.array([[0, 0, 0], [4, 0, 0], [0, 4, 0]], float)
    wound = [[0, 1, 2], [1, 0, 2], [2, 0, 1], [2, 1, 0]]
    surface = Surface(np.concatenate([corners, corners + np.array([0, 0, 1])]), [*wound, [3, 4, 5]])
    point, way = start_on(corners, 0.25, 0.25), (0, 0, 1)
    for sign, far in ((1, First(Fraction(1), 4, (4,))), (-1, First(None, -1, ()))):
        found, met = surface.first(Start(point), np.array(way) * sign)[0], []
        while found.t == 0:
            met.append(found.face)
            side = sign * (1 if wound[found.face] in ([0, 1, 2], [2, 0, 1]) else -1)
            assert surface.first(Start(point, found.face), np.array(way) * sign, -side) == [First(ZERO, 0, (0,))]
            (found,) = surface.first(Start(point, found.face, met[0]), np.array(way) * sign, side, True)
        assert met == [0, 1, 2, 3] and found == far


def test_partly_coinciding_faces_stop_a_ray_only_where_they_overlap():
    """At the origin the first face covers the quarter x, y > 0, the second that of y > |x|: half of each is common."""
    corners = np.array([[0, 0, 0], [4, 0, 0], [0, 4, 0], [4, 4, 0], [-4, 4, 0]], float)
    surface = Surface(corners, [[0, 1, 2], [0, 3, 4]])
    # By where the first was passed, the second is ahead or not.
    found = surface.first(Start(place(0, 0, 0), 0), (0, 0, 1), 1, True)
    assert set(found) == {First(ZERO, 1, (1,)), First(None, -1, ())}
    with pytest.raises(ValueError, match="start: expected one region"):
        first_hit(corners, [[0, 1, 2], [0, 3, 4]], Start(place(0, 0, 0), 0), [0, 0, 1], 1, True)
    # The point (1, 2, 0) lies within both.
    inner = start_on(corners[:3], 0.25, 0.5)
    assert surface.first(Start(inner, 0), (0, 0, 1), 1, True) == [First(ZERO, 1, (1,))]


def test_an_open_fan_is_one_region():
    rim = np.array([[3, 0, 1], [0, 3, -1], [-3, 0, 1], [0, -3, 2]], float)
    vertices = np.concatenate([[[0, 0, 0]], rim])
    closed = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]]
    for left_out in range(4):
        surface = Surface(vertices, closed[:left_out] + closed[left_out + 1 :])
        for face, side, way in product(range(3), (-1, 1), WAYS):
            assert surface.first(Start(place(0, 0, 0), face), way, side) == [First(None, -1, ())]
    surface = Surface(vertices, closed)
    assert all(surface.first(Start(place(0, 0, 0), f), (0, 0, 1), -1)[0].face == 0 for f in range(4))


def test_where_faces_cross_each_region_has_its_answer():
    """A wall stands on the middle of a floor: above the floor there are two regions."""
    corners = np.array([[-4, -4, 0], [4, -4, 0], [0, 8, 0], [0, -2, 0], [0, 2, 0], [0, 0, 4]], float)
    surface = Surface(corners, [[0, 1, 2], [3, 4, 5]])
    for way in ((1, 0, 1), (-1, 0, 1)):
        assert set(surface.first(Start(place(0, 0, 0), 0), way, 1)) == {First(ZERO, 1, (1,)), First(None, -1, ())}
    assert surface.first(Start(place(0, 0, 0), 0), (0, 0, 1), 1) == [First(None, -1, ())]
    assert surface.first(Start(place(0, 0, 0), 0), (1, 0, -1), -1) == [First(None, -1, ())]
    # From the wall to the right only the right is above; below the floor is behind the floor.
    toward = surface.regions(surface.holding(place(0, 0, 0))).cones[1].side((1, 0, 0))
    assert surface.first(Start(place(0, 0, 0), 1), (1, 0, 1), toward) == [First(None, -1, ())]
    assert surface.first(Start(place(0, 0, 0), 1), (-1, 0, 1), toward) == [First(ZERO, 1, (1,))]
    assert surface.first(Start(place(0, 0, 0), 1), (1, 0, -1), toward) == [First(ZERO, 0, (0,))]


def star(count, rng):
    """The corner of a closed fan around the z axis, convex nowhere, as cones."""
    angles = np.sort(rng.choice(360, count, replace=False)) * np.pi / 180
    rim = np.stack([np.cos(angles), np.sin(angles), rng.uniform(-1, 1, count)], 1)
    rim = [tuple(int(x) for x in row) for row in np.round(rim * 50 + 0.25)]
    ordered = [(k, (a, b)[:: rng.choice([-1, 1])]) for k, (a, b) in enumerate(pairwise([*rim, rim[0]]))]
    return [cone_at(k, [(0, 0, 0), *pair], [True, False, True]) for k, pair in ordered]


@cases("seed", range(8))
def test_cells_and_parity_tell_the_regions_of_a_closed_fan_apart_alike(seed):
    rng = np.random.default_rng(seed)
    cones = star(int(rng.integers(4, 12)), rng)
    regions, fan = Regions(cones), Fan(cones)
    ways = [*map(tuple, rng.integers(-9, 10, (40, 3)).tolist()), *WAYS[::7], *(c.first for c in cones)]
    ways += [tuple(a + b for a, b in zip(c.first, c.last, strict=True)) for c in cones]
    for face, way, side in product(range(len(cones)), ways, (-1, 1)):
        if any(way):
            assert stopped(regions, face, way, side, False) == stopped(fan, face, way, side, False)


def test_places_are_nearest_and_those_who_hold_them_are_at_no_distance():
    rng = np.random.default_rng(5)
    for _ in range(200):
        corners = rng.integers(-4, 5, (3, 3)).astype(float)
        given = rng.integers(-6, 7, 3).astype(float)
        found, triangle = start_near(corners, given), rational(corners.tolist())
        assert squared_distance(found, triangle) == 0
        way = [a - Fraction(b) for a, b in zip(found, given.tolist(), strict=True)]
        assert dot(way, way) == squared_distance(*rational([given.tolist()]), triangle)
    # Of barycentrics that rounding has put outside the two that are left are shares: 3/5 and 2/5.
    assert start_on([[0, 0, 0], [4, 0, 0], [0, 4, 0]], 0.75, 0.5) == (Fraction(12, 5), Fraction(8, 5), 0)
    vertices, faces = rng.integers(0, 4, (40, 3)).astype(float), rng.integers(0, 40, (120, 3))
    surface, found = Surface(vertices, faces), 0
    flat = [not row.any() for row in normals(vertices, faces)]
    for point in rng.integers(0, 13, (60, 3)):
        at = tuple(Fraction(int(x), 4) for x in point)
        on = [f for f in range(120) if not flat[f] and squared_distance(at, rational(vertices[faces[f]].tolist())) == 0]
        assert held(surface, at) == on
        found += len(on)
    assert found > 20


def test_without_a_side_it_is_exact_arithmetic_without_the_faces_that_hold_the_start():
    rng = np.random.default_rng(6)
    vertices, faces = rng.integers(0, 5, (60, 3)).astype(float), rng.integers(0, 60, (150, 3))
    surface = Surface(vertices, faces)
    some = [f for f in range(150) if normals(vertices, faces[f : f + 1]).any()]
    stopped_at_once = 0
    for k in range(300):
        face = some[k % len(some)]
        start = surface.start_on(face, 0.0, 1.0) if k % 2 else surface.start_on(face, 0.5, 0.25)
        way, origin = rng.integers(-4, 5, 3) + np.array([0, 0, 0.5]), [float(x) for x in start.place]
        at = set(held(surface, start.place))
        left = exact.closest_hit(vertices, faces, origin, way, candidates=[f for f in range(150) if f not in at])
        named, free = surface.first(start, way), surface.first(Start(start.place), way)
        assert named == [First(None, -1, ()) if left is None else First(left.t, left.face, left.faces_at_t)]
        every = exact.closest_hit(vertices, faces, origin, way)
        assert free == [First(None, -1, ()) if every is None else First(every.t, every.face, every.faces_at_t)]
        stopped_at_once += free[0].t == 0
    assert stopped_at_once > 100


def test_many_at_once_and_without_the_filter_are_the_same_wherever_they_lie(monkeypatch):
    rng = np.random.default_rng(7)
    for scale, offset in ((1.0, 0.0), (1e-6, 1e3), (1e9, -1e9)):
        vertices, faces = rng.normal(size=(40, 3)) * scale + offset, rng.integers(0, 40, (60, 3))
        surface = Surface(vertices, faces)
        starts = [surface.start_on(k % 60, *rng.uniform(0, 0.5, 2)) for k in range(150)]
        starts += [surface.start_near(k % 60, vertices[k % 40] + scale * 0.1) for k in range(50)]
        ways, sides = rng.normal(size=(200, 3)), rng.integers(-1, 2, 200)
        through = rng.random(200) < 0.5
        found = surface.each(starts, ways, sides, through)
        assert sum(one[0].t is not None for one in found) > 20
        with monkeypatch.context() as changed:
            changed.setattr(surface, "possible", lambda places, _: [np.arange(60)] * len(places))
            assert surface.each(starts, ways, sides, through) == found
        assert [surface.first(*ray) for ray in zip(starts, ways, sides, through, strict=True)] == found


def test_starts_that_are_on_no_face_are_refused():
    vertices, faces = cube()
    with pytest.raises(ValueError, match="start: expected a point of face 3"):
        Surface(vertices, faces).first(Start(place(1, 1, 1), 3), (0, 0, 1), 1)
    # A face without area has no sides.
    thin = Surface([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1]], [[0, 1, 2], [3, 4, 5]])
    assert thin.first(thin.start_on(0, 0.25, 0.0), (0.25, 0.25, 1), 1) == [First(Fraction(1), 1, (1,))]

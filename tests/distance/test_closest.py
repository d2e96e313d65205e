"""Nearest points of meshes: against exact arithmetic, and every answer the same however it is asked."""

import numpy as np
import pytest
from cases import cases
from hypothesis import given, settings
from hypothesis import strategies as st
from meshes import make_mesh

from renderer import BruteForce, Mesh, Octree
from renderer.distance import closest
from renderer.distance.face_distance import _rounded
from renderer.distance.nearest import LISTED
from renderer.distance.rational import nearest_exactly
from renderer.inside import contains as inside
from renderer.mesh.shapes import box, icosphere, torus
from validation.oracle.distance import nearest, ulps_from_root
from validation.oracle.vectors import rational, relative
from validation.queries.distances import points_about
from validation.stability.cases.queries.inside import closed_solids

pytestmark = pytest.mark.judges(
    "BruteForce.closest_point", "ClosestPoints", "ClosestPoints.found", "ClosestPoints.points", "Octree.closest_point"
)


SOLIDS = closed_solids()
FIELDS = ("distance", "face", "u", "v")


def exactly(point, mesh, faces=None):
    """The least squared distance, and the faces that have it; of all or of some, without those that are too far off."""
    faces = np.arange(len(mesh.faces)) if faces is None else np.asarray(faces)
    # Of size 1, so that no square overflows: no nearer than their boxes, and no farther than their corners.
    corners = mesh.triangles[faces] - point
    corners /= np.abs(corners).max() or 1.0
    beyond = np.maximum(np.maximum(corners.min(axis=1), -corners.max(axis=1)), 0.0)
    most = np.linalg.norm(corners, axis=2).min()
    near = faces[np.linalg.norm(beyond, axis=1) <= most + 1e-9]
    triangles, unit = relative(point.tolist(), mesh.triangles[near].tolist())
    square, least = nearest([0, 0, 0], triangles)
    return square / unit**2, near[least].tolist()


def assert_nearest(mesh, points):
    """Each distance is the exact one, rounded, and the face the first that is so near; returns both faces."""
    found, first = Octree.from_mesh(mesh).closest_point(points), []
    for i, point in enumerate(points):
        square, faces = exactly(point, mesh)
        # Half an ulp for the last rounding, and as little as twice the digits leave.
        assert ulps_from_root(found.distance[i], square) < 0.51
        if found.face[i] != faces[0]:
            # Another face is as near when rounded.
            other, _ = exactly(point, mesh, [found.face[i]])
            assert ulps_from_root(found.distance[i], other) < 0.51 and found.face[i] < faces[0]
        first.append(faces[0])
    return found.face.tolist(), first


@cases("name", SOLIDS)
def test_distances_are_the_exact_ones_rounded(name):
    assert_nearest(SOLIDS[name], points_about(SOLIDS[name], np.random.default_rng(5), 25))


@settings(max_examples=15)
@given(st.integers(0, 2**30), st.sampled_from([1e-80, 1e-6, np.pi, 1e200]), st.sampled_from([0.0, 1e6]))
def test_at_any_size_and_place(seed, scale, offset):
    rng = np.random.default_rng(seed)
    solid = list(SOLIDS.values())[seed % len(SOLIDS)]
    mesh = Mesh(solid.vertices * scale + offset * scale * rng.random(3), solid.faces[:40])
    assert_nearest(mesh, points_about(mesh, rng, 8))


@settings(max_examples=15)
@given(st.integers(0, 2**30), st.sampled_from([1.0, 0.25]))
def test_faces_of_whole_numbers_with_lines_and_points_among_them(seed, step):
    """Distances tie often here, and many points lie on faces, on lines of edges, and above corners."""
    rng = np.random.default_rng(seed)
    corners = rng.integers(-3, 4, (30, 3)).astype(float)
    mesh = Mesh(corners, rng.integers(0, 30, (30, 3)))
    points = rng.integers(-4, 5, (20, 3)) * step
    found, first = assert_nearest(mesh, points)
    assert found == first


def test_needles_err_by_no_more_than_promised():
    """Needles 1e-15 wide: 2^-90 of the reach, 1e-27, is what is left beside an edge."""
    rng = np.random.default_rng(3)
    mesh = Mesh(rng.normal(size=(60, 3)) * [1, 1e-15, 1e-15], rng.integers(0, 60, (60, 3)))
    points = points_about(mesh, rng, 150)
    found = Octree.from_mesh(mesh).closest_point(points)
    reach = np.abs(points[:, None] - mesh.vertices).max(axis=(1, 2))
    for i, point in enumerate(points):
        square, _ = exactly(point, mesh)
        exact = ulps_from_root(found.distance[i], square)
        assert exact < 0.51 or abs(found.distance[i] - float(square) ** 0.5) < 2.0**-90 * reach[i]
        assert (found.distance[i] == 0.0) == (square == 0)


@pytest.mark.parametrize("mesh", [torus(), make_mesh("lattice", 3, 300)], ids=["torus", "lattice"])
def test_trees_threads_batches_and_shapes_change_nothing(mesh):
    mesh = mesh if isinstance(mesh, Mesh) else Mesh(*mesh)
    points = points_about(mesh, np.random.default_rng(2), 3000)
    expected = Octree.from_mesh(mesh, threads=1).closest_point(points)
    order = np.random.default_rng(1).permutation(len(points))
    for queries in (
        Octree.from_mesh(mesh, split="sah"),
        Octree.from_mesh(mesh, leaf_size=32),
        BruteForce.from_mesh(mesh),
    ):
        found, shuffled = queries.closest_point(points), queries.closest_point(points[order])
        for name in FIELDS:
            np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))
            np.testing.assert_array_equal(getattr(shuffled, name), getattr(expected, name)[order])
    shaped = Octree.from_mesh(mesh).closest_point(points.reshape(30, 100, 3))
    np.testing.assert_array_equal(shaped.distance, expected.distance.reshape(30, 100))
    np.testing.assert_array_equal(shaped.points, expected.points.reshape(30, 100, 3))
    one = Octree.from_mesh(mesh).closest_point(points[0])
    assert one.distance.shape == () and one.points.shape == (3,) and one.distance == expected.distance[0]
    none = Octree.from_mesh(mesh).closest_point(np.empty((0, 3)))
    assert none.distance.shape == (0,) and none.points.shape == (0, 3)


def test_the_centre_of_a_ball_is_as_near_to_more_faces_than_are_listed_at_once():
    ball = icosphere(2)
    mesh = Mesh(ball.vertices, ball.faces)
    assert len(mesh.faces) > LISTED
    assert_nearest(mesh, np.zeros((1, 3)))


def test_max_distance_is_closed_and_finds_nothing_beyond():
    octree, points = Octree.from_mesh(box()), np.array([[0.5, 0.5, 3.0], [0.5, 0.5, 1.25], [0.5, 0.5, 0.9]])
    below = octree.closest_point(points, max_distance=[np.nextafter(2.0, 0.0), 0.25, 0.0])
    assert below.found.tolist() == [False, True, False]
    assert below.distance.tolist() == [np.inf, 0.25, np.inf] and below.face.tolist()[::2] == [-1, -1]
    assert np.isnan(below.u[0]) and np.isnan(below.v[0]) and np.isnan(below.points[0]).all()
    assert octree.closest_point(points, max_distance=2.0).found.all()
    assert octree.closest_point(points[:1], max_distance=0.0).distance.tolist() == [np.inf]
    on = octree.closest_point([[0.5, 0.25, 1.0]], max_distance=0.0)
    assert on.distance.tolist() == [0.0]


@cases(
    ("arguments", "said"),
    [
        ({"points": [[0.0, 0.0]]}, r"points: expected shape \(\.\.\., 3\), got shape \(1, 2\)"),
        ({"points": [[0, 0, 0], [0, np.nan, 0]]}, r"points: expected finite .*, got \[0\.0, nan, 0\.0\] in row 1"),
        ({"points": [[0, 0, 1e39]]}, r"points: expected finite numbers within 8\.51e\+37, got .* in row 0"),
        ({"points": [[0, 0, 0]], "max_distance": -1.0}, r"max_distance: expected numbers from 0, got -1\.0 in row 0"),
        ({"points": [[0, 0, 0]] * 3, "max_distance": [1.0, 2.0]}, "max_distance: expected a number or a shape"),
        ({"points": [[0, 0, 0]], "max_distance": np.nan}, "max_distance: expected numbers from 0, got nan in row 0"),
    ],
)
def test_bad_input_is_named(arguments, said):
    with pytest.raises(ValueError, match=said):
        Octree.from_mesh(box()).closest_point(**arguments)


def test_an_empty_mesh_is_refused():
    with pytest.raises(ValueError, match="mesh: expected faces, got none"):
        Octree(np.empty((0, 3)), np.empty((0, 3), int)).closest_point([[0.0, 0.0, 0.0]])


@pytest.mark.parametrize(
    ("vertices", "point"),
    [
        ([[0, 0, 0], [-1, 0, 0], [0, 0, 2.0**-40]], [-(2.0**-52), 0, 2.0**-41]),
        ([[0, 0, 0], [-1, 0, 0], [0, 0, 2.0**-40]], [-(2.0**-52), -(2.0**-80), 2.0**-41]),
        ([[0, 0, 0], [-70368744177664.0, 0, 0], [0, 0, 2.0**-8]], [-(2.0**-14), 0, 2.0**-9]),
    ],
)
def test_a_short_edge_takes_no_more_room_than_a_long_one(vertices, point):
    """A point was taken as on an edge by a share of the edge's length, not of its distance from it."""
    mesh = Mesh(vertices, [[0, 1, 2]])
    square, _ = nearest(rational([point])[0], [rational(mesh.triangles[0])])
    assert ulps_from_root(float(Octree.from_mesh(mesh).closest_point(point).distance), square) < 0.51


def test_faces_in_one_plane_are_equally_far_in_the_middle_of_two_numbers():
    vertices = [[4.7, -5.9, 1 / 3], [-8.1, 6.2, 1 / 3], [3.3, 7.6, 1 / 3],
                [4.8, 4.3, 1 / 3], [3.8, -3.7, 1 / 3], [-8.2, 4.8, 1 / 3]]  # fmt: skip
    point = [0.1046308468680315, 0.27339117115185557, 1.0000000000000002]
    alone = [Octree(vertices, [face]).closest_point(point).distance for face in ([0, 1, 2], [3, 4, 5])]
    assert alone[0] == alone[1]
    assert Octree(vertices, [[0, 1, 2], [3, 4, 5]]).closest_point(point).face == 0


@pytest.mark.parametrize("query", ["closest_point", "contains"])
def test_work_without_end_is_cut_where_control_c_is_heard(query, monkeypatch):
    """A chunk of points that each lie on thousands of faces had kept Ctrl-C waiting for a minute."""
    copies = Octree(box().vertices, np.tile(box().faces, (500, 1)), threads=1)
    points = np.random.default_rng(0).random((200, 1)) * np.ones(3)
    module = closest if query == "closest_point" else inside
    calls = []
    name = "find_nearest" if query == "closest_point" else "count_crossings"
    kernel = getattr(module, name)

    def counted(*arguments):
        calls.append(kernel(*arguments))
        return calls[-1]

    monkeypatch.setattr(module, name, counted)
    found = getattr(copies, query)(points)
    assert len(calls) > 5 and calls == sorted(set(calls)) and calls[-1] == len(points)
    monkeypatch.undo()
    one = getattr(Octree.from_mesh(box()), query)(points)
    if query == "contains":
        np.testing.assert_array_equal(found, one)
    else:
        np.testing.assert_array_equal(found.distance, one.distance)
        np.testing.assert_array_equal(found.face, one.face)


def test_on_the_face_beside_an_edge_the_distance_is_0():
    octree = Octree([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    assert octree.closest_point([[0.25, 2.0**-95, 0.0], [0.25, -(2.0**-95), 0.0]]).distance.tolist() == [0.0, 2.0**-95]


@cases(
    ("vertices", "point"),
    [
        (
            [
                [-0.8170003574125848, 0.34992861085809795, -1.1586510068862494],
                [0.8700737035547846, -0.7334418831463413, 0.5136471791306236],
                [0.2501666530005858, 0.39196964694146097, -0.042938596098457134],
            ],
            [0.35683093977876335, 1e-290, 0.03704459807587124],
        ),
        ([[0, 0, 0], [1, 0, 1], [0, 1, 0]], [0.5, 1e-300, 0.5]),
        ([[0, -2e-29, 0], [0, 1, 1], [0, -2e-27, -2]], [0, 1e-305, -1e-35]),
        ([[-1, -1e-32, 0], [-2e-40, 2, 2], [2, 2e-166, 0]], [1e-265, 2 / 3, 2 / 3]),
        ([[2e-13, 0, 1e-6], [-1e-112, -2e-116, -1e-106], [2e-46, 2, 1e-98]], [5e-14, 0.5, 2.5e-7]),
        ([[1, 1, -1], [1e-49, -1e-13, -1e-159], [1e-43, -2e-159, -2e-22]], [9.999999999999999e-18, -5e-14, -1e-22]),
        ([[1e19, 0, -2e19], [-3e-56, -2e-56, 2e-56], [-3e72, -2e72, 3e72]], [1e-11, 0, 2e19]),
        ([[0, 0, 0], [1e100, 0, 0], [0, 1e100, 0]], [5e-324, 5e-324, 5e-324]),
    ],
)
def test_coordinates_of_all_sizes_are_told_apart_exactly(vertices, point):
    """Where products vanished, distances were off by up to 2,037 ulp, 0 off the surface, and not 0 on it."""
    square = nearest(rational([point])[0], [rational(vertices)])[0]
    for accelerator in (Octree, BruteForce):
        queries = accelerator(vertices, [[0, 1, 2]])
        found = queries.closest_point(point)
        assert ulps_from_root(float(found.distance), square) <= 0.5 and found.face == 0
        assert queries.closest_point(point, max_distance=found.distance).found
        if found.distance > 0.0:
            less = queries.closest_point(point, max_distance=np.nextafter(found.distance, 0.0))
            assert (less.distance, less.face) == (np.inf, -1) and np.isnan(less.u)
            # One limit a point, in whatever order and dimensions: each is held to its own.
            limits = np.array([np.inf, np.nextafter(found.distance, 0.0), found.distance])
            for order in ([0, 1, 2], [1, 2, 0], [2, 0, 1]):
                rows = queries.closest_point([[point]] * 3, max_distance=limits[order][:, None])
                np.testing.assert_array_equal(rows.found, np.not_equal(order, 1)[:, None])
                np.testing.assert_array_equal(rows.distance[rows.found], found.distance)


def test_rational_arithmetic_says_what_float64_says():
    """It is asked where float64 cannot tell, so here it is asked all: also where edges and corners are nearest."""
    rng = np.random.default_rng(4)
    for mesh in (SOLIDS["integers"], SOLIDS["nested boxes"], Mesh(*make_mesh("soup", 1, 30))):
        points = np.concatenate([points_about(mesh, rng, 30), rng.integers(-3, 4, (30, 3))])
        found = Octree.from_mesh(mesh).closest_point(points)
        for i, point in enumerate(points):
            # In units that hold no point nothing is told by float64.
            scale = 2.0**-1060
            distance, u, v, face = nearest_exactly(point, mesh.triangles, scale)
            assert (distance, face) == (found.distance[i], found.face[i])
            assert abs(u - found.u[i]) < 1e-9 and abs(v - found.v[i]) < 1e-9


@cases(
    "points",
    [
        ((0.72, 0, 0), (0.7, 0.7, 0.7)),
        ((0.7, 0.7, 0.7), (0.72, 0, 0)),
        ((0.1, 0.1, 0.1), (0.72, 0, 0)),
        ((0.7, 0, 0), (1e-3, 0, 0)),
    ],
)
@cases("unit", [2.0**-537, 2.0**-540, 2.0**-530])
def test_faces_whose_squared_distances_vanish_are_told_apart(points, unit):
    """Their bounds were none: the farther of two faces was named, at 1.7 times the least distance."""
    tiny = np.array(points) * unit
    vertices = np.concatenate([[[1, 1, 1], [1, 2, 1], [1, 1, 2]], tiny])
    faces = [[0, 1, 2], [3, 3, 3], [4, 4, 4]]
    least = min(np.linalg.norm(np.array(points), axis=1)) * unit
    for accelerator in (Octree, BruteForce):
        found = accelerator(vertices, faces).closest_point([0.0, 0.0, 0.0])
        assert found.distance == pytest.approx(least, rel=1e-15)


@cases(("head", "steps"), [(1.0 + 2.0**-52, 1), (1.0 + 2.0**-51, 0)])
@cases("side", [1.0, -1.0])
def test_what_is_halfway_but_for_lost_digits_goes_to_the_even_neighbour(head: float, steps: int, side: float) -> None:
    """Two faces in one plane may have such a distance, and the digits that they lose differ."""
    for lost in (0.0, 2.0**-150, 2.0**-144):
        assert _rounded((head, side * (2.0**-53 - lost))) == head + side * steps * 2.0**-52
    assert _rounded((head, side * (2.0**-53 - 2.0**-80))) == head

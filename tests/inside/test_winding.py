"""Winding numbers: against exact and higher precision, analytic values and libigl, and within the bound they have."""

import gc
import pickle
import weakref

import numpy as np
import pytest
from cases import cases
from hypothesis import given, settings
from hypothesis import strategies as st
from meshes import KINDS, make_mesh

from renderer import BruteForce, Mesh, Octree
from renderer.inside.moments import moments_of
from renderer.inside.winding_search import _FIRST, _point_at, _Query, _search
from renderer.jit.decorators import kernel
from renderer.mesh.shapes import box, icosphere, lattice_faces, torus
from renderer.numerics.simd import local_doubles, offset, pointer
from renderer.trace.trees import tree_pointers
from renderer.trace.walk import stack_size
from validation.stability.cases.queries.inside import closed_solids, points_at, winding_numbers

pytestmark = pytest.mark.judges("BruteForce.winding_number", "Octree.contains", "Octree.winding_number")


SOLIDS = closed_solids()
TOLERANCES = (0.3, 1e-2, 1e-3, 1e-6, 1e-10, 0.0)
# What a face that counts alone errs by.
ROUNDING = 2.0**-44


def reference(mesh, points):
    """Winding numbers in long double; a face in whose plane the point lies counts 0."""
    triangles, numbers = np.longdouble(mesh.triangles), np.empty(len(points), np.longdouble)
    for i, point in enumerate(np.longdouble(points)):
        a, b, c = (triangles - point).transpose(1, 0, 2)
        i_a, i_b, i_c = (np.sqrt((x * x).sum(axis=1)) for x in (a, b, c))
        volume = (a * np.cross(b, c)).sum(axis=1)
        rest = i_a * i_b * i_c + (a * b).sum(1) * i_c + (b * c).sum(1) * i_a + (c * a).sum(1) * i_b
        numbers[i] = np.arctan2(volume, np.where(volume == 0, 1, rest)).sum() / (2 * np.arccos(np.longdouble(-1)))
    return numbers


def open_meshes():
    """Meshes with holes: half a ball, a box without a lid, and a ball of single faces, shaken, some of them lost."""
    ball, rng = icosphere(3), np.random.default_rng(4)
    triangles = ball.triangles[rng.random(len(ball.faces)) < 0.9]
    shaken = triangles + 0.02 * rng.normal(size=triangles.shape)
    return {
        "half a ball": Mesh(ball.vertices, ball.faces[ball.triangles.mean(axis=1)[:, 2] > 0]),
        "box without a lid": Mesh(box().vertices, box().faces[:-2]),
        "shaken ball": Mesh(shaken.reshape(-1, 3), np.arange(3 * len(shaken)).reshape(-1, 3)),
        "half a torus": Mesh(torus().vertices, torus().faces[: len(torus().faces) // 2]),
    }


OPEN = open_meshes()


def around(mesh, rng, count):
    lower, upper = mesh.bounds
    return (lower + upper) / 2 + (upper - lower) * rng.uniform(-0.7, 0.7, (count, 3))


# --- what it is -----------------------------------------------------------------------------------------------


@cases("name", SOLIDS)
def test_around_closed_meshes_it_is_the_exact_integer(name):
    """At points anywhere, in planes of corners, and one ulp beside corners, edges and faces."""
    mesh = SOLIDS[name]
    points = points_at(mesh, np.random.default_rng(11), 8)
    exact = winding_numbers(mesh, points)
    on = np.array([number is None for number in exact])
    numbers = np.array([0 if number is None else number for number in exact])
    for accelerator in (Octree.from_mesh(mesh), BruteForce.from_mesh(mesh), Octree.from_mesh(mesh, split="sah")):
        np.testing.assert_allclose(accelerator.winding_number(points)[~on], numbers[~on], rtol=0, atol=1e-3)
        np.testing.assert_allclose(accelerator.winding_number(points, 0)[~on], numbers[~on], rtol=0, atol=1e-11)
        np.testing.assert_array_equal(accelerator.contains(points, winding=True), (numbers > 0) | on)
        np.testing.assert_array_equal(accelerator.contains(points, False, winding=True), (numbers > 0) & ~on)


def check_numbers(vertices, faces, points, expected):
    """Winding numbers within their rounding, and sides, of points off the surface of a closed mesh."""
    expected = np.asarray(expected)
    for accelerator in (Octree(vertices, faces), BruteForce(vertices, faces), Octree(vertices, faces, leaf_size=1)):
        for tolerance in (0.0, 1e-3):
            error = np.abs(accelerator.winding_number(points, tolerance) - expected)
            assert error.max() <= tolerance + ROUNDING * len(faces)
        np.testing.assert_array_equal(accelerator.contains(points, winding=True), expected > 0.5)
        distance = accelerator.signed_distance(points, winding=True)
        np.testing.assert_array_equal(np.sign(distance), np.where(expected > 0.5, -1, 1))


@cases("wide", [1e-10, 1e-15, 1e-20, 1e-60])
def test_in_and_around_needles(wide):
    """Boxes a thousandth or less of a rounding wide: from within, all long edges are near at once."""
    rng, size = np.random.default_rng(0), np.array([wide, 1.0, wide])
    inside = rng.uniform(-0.9, 0.9, (100, 3))
    outside = rng.uniform(1.1, 3, (100, 3)) * rng.choice([-1, 1], (100, 3))
    beside = np.where(np.arange(3) == 1, inside, outside)
    points = np.concatenate([[[0.0, 0.0, 0.0]], inside, outside, beside]) * size
    cube = box((-1, -1, -1), (1, 1, 1))
    check_numbers(cube.vertices * size, cube.faces, points, np.repeat([1, 0], [101, 200]))


@cases("bits", [60, 80, 100, 150, 500, 530, 600, 700, 900, 1000, 1060])
def test_at_any_nearness_to_edges_and_corners(bits):
    d = 2.0**-bits
    within = [
        [0.3, d, d],
        [0.3, d, 1.75 * d],
        [d, 1.25 * d, 0.75 * d],
        [d, d, d],
        [0.25, 0.5, d],
        [d, 0.75, 1.0 - 2**-53],
    ]
    without = [[0.3, -d, 1.75 * d], [0.7, -d, -0.5 * d], [-d, d, d], [-d, -d, -1.5 * d], [0.25, 0.5, -d]]
    check_numbers(box().vertices, box().faces, within + without, np.repeat([1, 0], [len(within), len(without)]))


def test_at_coordinates_that_the_trees_units_do_not_hold():
    size, d = 2.0**1000, 2.0**-80
    points = [[0.25 * size, d, d], [d, 1.5 * d, d], [0.25 * size, -d, d], [-d, d, d], [5e307, d, -5e307]]
    check_numbers(box().vertices * size, box().faces, points, [1, 1, 0, 0, 0])


@cases("bits", [54, 80, 100, 200, 600])
def test_near_an_edge_askew(bits):
    """An edge through the origin along no axis: the exact sides of the two faces that meet there tell."""
    vertices = np.array([[-3.0, -1, -2], [3, 1, 2], [0.5, 3, 0], [0.25, 1, 3]])
    faces = np.array([[0, 1, 2], [1, 0, 3], [2, 1, 3], [0, 2, 3]])
    points = np.random.default_rng(0).uniform(-1, 1, (100, 3)) * 2.0**-bits
    mesh = Mesh(vertices, faces)
    expected = winding_numbers(mesh, points)
    if min(expected) < 0:
        mesh, expected = Mesh(vertices, faces[:, ::-1]), [-number for number in expected]
    assert 10 < sum(expected) < 90
    check_numbers(mesh.vertices, mesh.faces, points, expected)


def test_beside_a_sliver_of_one_rounding():
    third, most = 0.3333333333333333, 0.9999999999999996
    vertices = [[0.33333333333333354, third, 1.0], [0.33333333333333354, third, most]]
    vertices += [[most, 0.09999999999999956, -0.7000000000000002], [most, 0.9999999999999998, third]]
    faces = np.array([[0, 1, 2], [2, 1, 3], [0, 2, 3], [1, 0, 3]])
    check_numbers(vertices, faces, [[0.6666666666666665, 0.21666666666666645, 0.1499999999999997]], [0])


def test_in_the_planes_of_faces_nearer_than_products_hold():
    """On a face a point counts the mean of its sides, also where rational arithmetic tells so."""
    d = 2.0**-900
    points = [[d, d, 0.0], [d, 0.0, 0.0], [0.0, 0.0, 0.0], [-d, d, 0.0]]
    for accelerator in (Octree.from_mesh(box()), BruteForce.from_mesh(box())):
        numbers = accelerator.winding_number(points, 0)
        np.testing.assert_allclose(numbers, [0.5, 0.25, 0.125, 0.0], rtol=0, atol=1e-15)


@cases("name", OPEN)
def test_around_open_meshes_it_is_within_the_tolerance(name):
    mesh = OPEN[name]
    points = around(mesh, np.random.default_rng(6), 300)
    expected = reference(mesh, points)
    for accelerator in (Octree.from_mesh(mesh), Octree.from_mesh(mesh, split="sah", leaf_size=32)):
        for tolerance in TOLERANCES:
            error = np.abs(accelerator.winding_number(points, tolerance) - expected).max()
            assert error <= tolerance + ROUNDING * len(mesh.faces)
    brute = BruteForce.from_mesh(mesh)
    assert np.abs(brute.winding_number(points) - expected).max() <= ROUNDING * len(mesh.faces)
    clear = np.abs(expected - 0.5) > 1e-12
    inside = Octree.from_mesh(mesh).contains(points, winding=True)
    np.testing.assert_array_equal(inside[clear], expected[clear] > 0.5)
    np.testing.assert_array_equal(brute.contains(points, winding=True)[clear], expected[clear] > 0.5)
    assert inside.any() and not inside.all()


@settings(max_examples=40)
@given(st.sampled_from(sorted(KINDS)), st.integers(0, 2**20), st.integers(1, 200), st.sampled_from([1, 4, 32]))
def test_of_any_faces_it_is_within_the_tolerance(kind, seed, count, leaf_size):
    mesh = Mesh(*make_mesh(kind, seed, count))
    points = around(mesh, np.random.default_rng(seed), 30) + np.random.default_rng(seed).normal(size=3) * 1e-3
    expected, octree = reference(mesh, points), Octree.from_mesh(mesh, leaf_size=leaf_size)
    for tolerance in (0.3, 1e-3, 1e-8, 0.0):
        error = np.abs(octree.winding_number(points, tolerance) - expected).max()
        assert error <= tolerance + ROUNDING * len(mesh.faces)


def test_of_a_disc_on_its_axis_analytically():
    """A wheel of n faces lies between the circles of radius cos(pi / n) and 1."""
    n = 4096
    angles = np.arange(n) * (2 * np.pi / n)
    rim = np.stack([np.cos(angles), np.sin(angles), np.zeros(n)], axis=1)
    faces = np.stack([np.full(n, n), np.arange(n), (np.arange(n) + 1) % n], axis=1)
    octree = Octree(np.concatenate([rim, np.zeros((1, 3))]), faces)
    heights = np.concatenate([-np.geomspace(1e-3, 1e3, 50), np.geomspace(1e-3, 1e3, 50)])
    points = np.stack([np.zeros(100), np.zeros(100), heights], axis=1)
    expected = -np.sign(heights) / 2 * (1 - np.abs(heights) / np.hypot(heights, 1))
    for tolerance in (1e-2, 1e-5, 0):
        error = np.abs(octree.winding_number(points, tolerance) - expected).max()
        assert error <= tolerance + (np.pi / n) ** 2


@pytest.mark.parametrize("offset", [1.0, 1e6])
def test_from_one_rounding_beside_a_face_to_the_other_it_falls_by_one(offset):
    """Across faces and their edges by one; in the open side of a box it is continuous."""
    mesh = Mesh(box().vertices + offset, box().faces[:-2])
    octree = Octree.from_mesh(mesh)
    on = np.array([[0.5, 0.0, 0.5], [0.0, 0.0, 0.5], [0.5, 0.5, 1.0]]) + offset
    below, above = np.nextafter(on, -np.inf), np.nextafter(on, np.inf)
    falls = octree.winding_number(above, 0) - octree.winding_number(below, 0)
    np.testing.assert_allclose(falls, [1.0, 1.0, 0.0], rtol=0, atol=1e-8)
    np.testing.assert_array_equal(octree.contains(on, False, winding=True)[:2], [False, False])
    np.testing.assert_array_equal(octree.contains(above, winding=True)[:2], [True, True])
    np.testing.assert_array_equal(octree.contains(below, winding=True)[:2], [False, False])


@cases("scale", [1e-200, 1e-5, 1e5, 1e250])
def test_scaled_by_a_power_of_two_it_has_the_same_bits(scale):
    power, mesh = 2.0 ** round(np.log2(scale)), OPEN["shaken ball"]
    points = around(mesh, np.random.default_rng(2), 300)
    numbers = Octree.from_mesh(mesh).winding_number(points, 1e-4)
    scaled = Octree(mesh.vertices * power, mesh.faces).winding_number(points * power, 1e-4)
    np.testing.assert_allclose(scaled, numbers, rtol=0, atol=1e-12)


@pytest.mark.parametrize("size", [1e-5, 1e-20, 1e-98])
def test_a_ball_of_any_size_beside_a_face_counts(size):
    ball = icosphere(2)
    vertices = np.concatenate([ball.vertices * size, [[2.0, 0, 0], [3, 0, 0], [2, 1, 0]]])
    octree = Octree(vertices, np.concatenate([ball.faces, len(ball.vertices) + np.arange(3)[None]]))
    rng = np.random.default_rng(3)
    points = rng.normal(size=(300, 3))
    away = 10.0 ** rng.uniform(-1, 2, 300)
    points *= size * (away / np.linalg.norm(points, axis=1))[:, None]
    clear, beside = np.abs(away - 1) > 0.05, octree.winding_number([[0.0, 0.0, -9.0 * size]], 0)
    np.testing.assert_allclose(octree.winding_number(points)[clear], (away < 1)[clear] + beside, rtol=0, atol=1e-3)


def test_far_away_it_is_0_at_any_coordinates():
    for scale in (1e-310, 1.0, 1e300):
        octree = Octree(OPEN["half a ball"].vertices * scale, OPEN["half a ball"].faces)
        points = [[1e308, -1e308, 1e308], [0, 0, -1e308], [1e306, 0, 0]]
        assert np.abs(octree.winding_number(points, 1e-9)).max() < 1e-9
        assert not octree.contains(points, winding=True).any()


# --- the bound ------------------------------------------------------------------------------------------------


@kernel
def search_all(descriptor, rows, points, share, out, stack):
    """The winding number and its bound of each point, in the rows of ``out`` (n, 2)."""
    tree, rows, stack, parts = tree_pointers(descriptor), pointer(rows), pointer(stack), local_doubles()
    for i in range(len(points)):
        point = _point_at(tree, offset(pointer(points), 3 * i))
        out[i, 0], out[i, 1], _ = _search(tree, _Query(rows, point, share, parts), stack)


def errors_and_bounds(mesh, points, share, right=None):
    """``right`` are the winding numbers, where a test has them already."""
    tree, out = Octree.from_mesh(mesh).tree, np.empty((len(points), 2))
    search_all(tree.descriptor, moments_of(tree, 1), points, share, out, np.empty(stack_size(tree.depth), np.int64))
    right = reference(mesh, points) if right is None else right
    return np.abs(np.float64(out[:, 0] - right)), out[:, 1]


def two_spots():
    """Two small faces that look along the z axis. The smaller one has almost all of their series' higher orders."""
    corners = np.array([[1.0, 0.0, 0.0], [-0.5, 0.75**0.5, 0.0], [-0.5, -(0.75**0.5), 0.0]])
    return Mesh(np.concatenate([1e-2 * corners, 1e-4 * corners + np.array([0, 0, 1])]), [[0, 1, 2], [3, 4, 5]])


@cases("name, mesh", {**OPEN, "ball": icosphere(3), "spots": two_spots()}.items())
def test_the_bound_is_never_exceeded(name, mesh):
    points = around(mesh, np.random.default_rng(1), 120) * (1 if name != "spots" else 9)
    right = reference(mesh, points)
    for share in (4.0, 1.0, 0.1, 1e-3, 1e-6, 1e-9):
        error, bound = errors_and_bounds(mesh, points, share, right)
        assert (error <= bound + 1e-14).all(), share


@pytest.mark.parametrize("share", [1.0, 1e-2, 1e-4])
def test_the_bound_is_not_absurdly_loose(share):
    """Nine tenths of it come true at best; where many faces help each other out, hundredths: errors have signs."""
    error, bound = errors_and_bounds(two_spots(), np.arange(2.0, 9.0)[:, None] * [0, 0, 1], 4.0)
    assert (error >= 0.9 * bound).all() and (bound > 0).all()
    mesh = OPEN["half a ball"]
    error, bound = errors_and_bounds(mesh, around(mesh, np.random.default_rng(2), 300), share)
    told = bound > 0
    assert told.mean() > 0.9 and (error[told] / bound[told]).max() > 0.02
    assert np.median(error[told] / bound[told]) > 2e-3


def test_a_search_whose_bound_exceeds_the_tolerance_is_not_the_answer():
    """Around eight balls in one place the bounds of as many faces add up."""
    tolerance, mesh = 1e-2, Mesh(icosphere(3).vertices, icosphere(3).faces.repeat(8, axis=0))
    points = around(mesh, np.random.default_rng(3), 300) * 3
    tree, out = Octree.from_mesh(mesh).tree, np.empty((len(points), 2))
    stack = np.empty(stack_size(tree.depth), np.int64)
    search_all(tree.descriptor, moments_of(tree, 1), points, _FIRST * tolerance, out, stack)
    good = out[:, 1] <= tolerance
    numbers = Octree.from_mesh(mesh).winding_number(points, tolerance)
    assert good.any() and (~good).any()
    np.testing.assert_array_equal(numbers[good], out[good, 0])
    assert (numbers[~good] != out[~good, 0]).all()


def test_a_side_of_one_half_is_not_told_within_the_bound():
    """In the opening of a bowl with a flat rim, where the number is 1/2 but for the distance from the rim's plane."""
    up, around_it = np.linspace(0, np.pi / 2, 13)[:, None], np.linspace(0, 2 * np.pi, 48, endpoint=False)
    bowl = [np.cos(up) * np.cos(around_it), np.cos(up) * np.sin(around_it), np.sin(up) * np.ones(48)]
    mesh = Mesh(np.stack(bowl, axis=-1).reshape(-1, 3), lattice_faces(13, 48, wrap_columns=True))
    rng = np.random.default_rng(0)
    points = np.concatenate([rng.uniform(-0.6, 0.6, (400, 2)), 10.0 ** rng.uniform(-9, -1, (400, 1))], axis=1)
    points[:, 2] *= rng.choice([-1, 1], 400)
    np.testing.assert_array_equal(Octree.from_mesh(mesh).contains(points, winding=True), points[:, 2] > 0)


def test_a_tolerance_is_used_and_not_undercut_by_far():
    mesh = OPEN["half a ball"]
    points = around(mesh, np.random.default_rng(9), 200)
    expected, octree = reference(mesh, points), Octree.from_mesh(mesh)
    errors = [np.abs(octree.winding_number(points, tolerance) - expected).max() for tolerance in (1e-2, 1e-4, 1e-6)]
    assert all(1e-4 < error / tolerance < 1 for error, tolerance in zip(errors, (1e-2, 1e-4, 1e-6), strict=True))


# --- how it is asked ------------------------------------------------------------------------------------------


def test_threads_batches_order_and_shapes_change_no_bit():
    mesh, rng = OPEN["shaken ball"], np.random.default_rng(3)
    points = around(mesh, rng, 3000)
    one, octree = Octree.from_mesh(mesh, threads=1), Octree.from_mesh(mesh, threads=3)
    numbers, inside = one.winding_number(points), one.contains(points, winding=True)
    np.testing.assert_array_equal(octree.winding_number(points), numbers)
    np.testing.assert_array_equal(octree.winding_number(points.reshape(30, 100, 3)), numbers.reshape(30, 100))
    np.testing.assert_array_equal(octree.contains(points.reshape(30, 100, 3), winding=True), inside.reshape(30, 100))
    order = rng.permutation(len(points))
    np.testing.assert_array_equal(octree.winding_number(points[order]), numbers[order])
    np.testing.assert_array_equal(octree.contains(points[order], winding=True), inside[order])
    assert octree.winding_number(points[7]).shape == () and octree.winding_number(points[7]) == numbers[7]
    assert octree.winding_number(np.empty((0, 3))).shape == (0,)
    assert octree.contains(np.empty((4, 0, 3)), winding=True).shape == (4, 0)


def test_sums_over_many_faces_stop_and_go_on():
    """Each returns to Python, so that Ctrl-C is heard; half of these points have to sum over all faces."""
    mesh = icosphere(5)
    mesh = Mesh(mesh.vertices, mesh.faces[mesh.triangles.mean(axis=1)[:, 2] > 0].repeat(2, axis=0))
    points = around(mesh, np.random.default_rng(1), 40)
    octree, brute = Octree.from_mesh(mesh), BruteForce.from_mesh(mesh)
    assert octree.tree.has_nodes and len(octree.tree.faces) > 4 * 4096
    exact = octree.winding_number(points, 0)
    np.testing.assert_allclose(exact, brute.winding_number(points), rtol=0, atol=1e-12)
    assert len(np.unique(exact)) == len(points)
    np.testing.assert_array_equal(octree.contains(points, winding=True), brute.contains(points, winding=True))


def test_moments_are_kept_with_the_tree_and_left_out_of_its_copies():
    octree = Octree.from_mesh(OPEN["shaken ball"])
    bare = len(pickle.dumps(octree))
    moments = moments_of(octree.tree, 1)
    assert moments_of(octree.tree, 2) is moments and len(pickle.dumps(octree)) == bare
    copy, points = pickle.loads(pickle.dumps(octree)), np.random.default_rng(0).normal(size=(50, 3))
    np.testing.assert_array_equal(copy.winding_number(points), octree.winding_number(points))
    gone = weakref.ref(moments)
    del octree, moments
    gc.collect()
    assert gone() is None


def test_boundary_of_an_open_mesh():
    """A point on a face gets the answer of ``boundary``, whatever its number; one in the hole is none of them."""
    mesh = Mesh(box().vertices, box().faces[:-2])
    points = [[0.25, 0.5, 0.0], [0.5, 0.5, 0.0], [0.0, 0.0, 0.5], [1.0, 1.0, 1.0], [0.5, 0.0, 1.0]]
    hole = [[0.5, 0.5, 0.99], [0.5, 0.5, 1.5]]
    for accelerator in (Octree.from_mesh(mesh), BruteForce.from_mesh(mesh)):
        assert accelerator.contains(points, winding=True).all()
        assert not accelerator.contains(points, boundary=False, winding=True).any()
        assert accelerator.contains(hole, winding=True).tolist() == [True, False]
        assert accelerator.contains(hole, boundary=False, winding=True).tolist() == [True, False]


def test_signed_distances_of_an_open_mesh():
    octree = Octree(box().vertices, box().faces[:-2])
    points = [[0.5, 0.5, 0.25], [0.5, 0.5, -1.0], [1.0, 0.5, 0.5], [0.5, 0.5, 3.0]]
    np.testing.assert_allclose(octree.signed_distance(points, winding=True), [-0.25, 1.0, 0.0, np.hypot(2.0, 0.5)])
    with pytest.raises(ValueError, match="mesh: expected a closed mesh"):
        octree.signed_distance(points)
    with pytest.raises(ValueError, match="winding: expected True or False"):
        octree.signed_distance(points, winding=1)


# --- what is refused ------------------------------------------------------------------------------------------


def test_winding_numbers_leave_no_other_rule():
    octree = Octree.from_mesh(box())
    for ask in (octree.contains, octree.signed_distance):
        with pytest.raises(
            ValueError, match=r"^rule: expected the default with winding=True, 'nonzero', got 'even-odd'"
        ):
            ask([[0, 0, 0]], rule="even-odd", winding=True)


def test_without_faces():
    for accelerator in (Octree, BruteForce):
        none = accelerator(np.empty((0, 3)), np.empty((0, 3), int))
        assert none.winding_number([[0, 0, 0], [1, 2, 3]]).tolist() == [0.0, 0.0]
        with pytest.raises(ValueError, match="mesh: expected faces, got none"):
            none.contains([[0.0, 0.0, 0.0]], winding=True)
        # Faces of no area count nothing, even where they are.
        point = accelerator([[1, 2, 3]] * 3, [[0, 1, 2]])
        assert point.winding_number([[0, 0, 0], [1, 2, 3]]).tolist() == [0.0, 0.0]

"""Points inside closed meshes: against exact arithmetic, and every answer the same however it is asked."""

from fractions import Fraction

import numpy as np
import pytest
from cases import cases
from hypothesis import given, settings
from hypothesis import strategies as st

from renderer import BruteForce, Mesh, Octree
from renderer.inside.crossings import count_crossings
from renderer.inside.rational import _on_upright
from renderer.mesh.shapes import box, torus
from renderer.trace.layout import CHILDREN, NODE_WORDS, Tree
from renderer.trace.walk import stack_size
from validation.oracle.inside import winding_number
from validation.oracle.vectors import rational
from validation.stability.cases.queries.inside import closed_solids, points_at, winding_numbers

pytestmark = pytest.mark.judges(
    "BruteForce.contains", "BruteForce.tree", "Mesh.odd_edges", "Mesh.open_edges", "Octree.contains"
)


MESHES = closed_solids()


@cases("name", MESHES)
def test_every_answer_is_that_of_exact_arithmetic(name):
    mesh, rng = MESHES[name], np.random.default_rng(7)
    points = points_at(mesh, rng, 4)
    winding = winding_numbers(mesh, points)
    on = np.array([w is None for w in winding])
    inside = np.array([w is not None and w != 0 for w in winding])
    odd = np.array([w is not None and w % 2 == 1 for w in winding])
    assert on.any() and inside.any() and (~on & ~inside).any()
    for accelerator in (Octree.from_mesh(mesh), BruteForce.from_mesh(mesh), Octree.from_mesh(mesh, split="sah")):
        np.testing.assert_array_equal(accelerator.contains(points), inside | on)
        np.testing.assert_array_equal(accelerator.contains(points, boundary=False), inside & ~on)
        np.testing.assert_array_equal(accelerator.contains(points, boundary=False, rule="even-odd"), odd & ~on)


@settings(max_examples=12)
@given(st.integers(0, 2**30), st.sampled_from([1e-6, 1.0, 1e6]), st.sampled_from([0.0, 1e6]))
def test_moved_and_scaled_solids_are_judged_exactly(seed, scale, offset):
    rng = np.random.default_rng(seed)
    mesh = list(MESHES.values())[seed % len(MESHES)]
    mesh = Mesh(mesh.vertices * scale + offset * rng.random(3), mesh.faces)
    points = points_at(mesh, rng, 1)
    winding = winding_numbers(mesh, points)
    octree = Octree.from_mesh(mesh)
    np.testing.assert_array_equal(octree.contains(points), [w is None or w != 0 for w in winding])
    np.testing.assert_array_equal(octree.contains(points, boundary=False), [w is not None and w != 0 for w in winding])


def test_threads_batches_and_shapes_change_nothing():
    mesh, rng = torus(), np.random.default_rng(3)
    points = points_at(mesh, rng, 300)
    expected = Octree.from_mesh(mesh, threads=1).contains(points)
    octree = Octree.from_mesh(mesh, threads=2)
    np.testing.assert_array_equal(octree.contains(points), expected)
    np.testing.assert_array_equal(octree.contains(points.reshape(-1, 100, 3)), expected.reshape(-1, 100))
    assert octree.contains(points[0]).shape == () and octree.contains(np.empty((0, 3))).shape == (0,)
    order = rng.permutation(len(points))
    np.testing.assert_array_equal(octree.contains(points[order]), expected[order])


@pytest.mark.parametrize(("rule", "count"), [("nonzero", 3), ("even-odd", 3)])
def test_an_open_mesh_has_no_inside(rule, count):
    mesh = box()
    with pytest.raises(ValueError, match=rf"mesh: expected a .*, got {count} open edges, the first from \[.*\] to \["):
        Octree(mesh.vertices, mesh.faces[1:]).contains([[0.5, 0.5, 0.5]], rule=rule)


def test_faces_turned_at_will_are_closed_for_even_odd_alone():
    mesh = box((-1, -1, -1), (1, 1, 1))
    faces = mesh.faces.copy()
    faces[::2] = faces[::2, ::-1]
    octree = Octree(mesh.vertices, faces)
    assert octree.contains([[0.1, 0.2, 0.3], [3, 0, 0]], rule="even-odd").tolist() == [True, False]
    with pytest.raises(ValueError, match="mesh: expected a closed mesh"):
        octree.contains([[0.1, 0.2, 0.3]])


def test_an_empty_mesh_and_an_unknown_rule_are_refused():
    with pytest.raises(ValueError, match="mesh: expected faces, got none"):
        Octree(np.empty((0, 3)), np.empty((0, 3), int)).contains([[0.0, 0.0, 0.0]])
    with pytest.raises(ValueError, match="rule: expected one of"):
        Octree.from_mesh(box()).contains([[0.0, 0.0, 0.0]], rule="odd")


def test_the_oracle_knows_a_box():
    triangles = [rational(triangle.tolist()) for triangle in MESHES["box"].triangles]
    for point, expected in (((0, 0, 0), 1), ((1, 0, 0), None), ((1, 1, 1), None), ((2, 0, 0), 0)):
        assert winding_number([Fraction(x) for x in point], triangles) == expected


def test_the_deepest_tree_has_a_stack_that_holds_its_column():
    """The stack had lain in the kernel's frame, for 500 octants; here 576 wait at once."""
    levels = 82
    nodes = np.zeros((levels, NODE_WORDS), np.float32)
    nodes[:, :CHILDREN].reshape(levels, 3, 2, 8)[:, :, 0], nodes[:, :CHILDREN].reshape(levels, 3, 2, 8)[:, :, 1] = -9, 9
    links = nodes.view(np.int32)
    links[:, CHILDREN : CHILDREN + 8] = -1  # the tree's first block
    links[:-1, CHILDREN + 7] = np.arange(1, levels)
    corners = np.array([[-4.0, -4.0, 1.0], [4.0, -4.0, 1.0], [0.0, 4.0, 1.0]])
    flat = BruteForce(corners, [[0, 1, 2]]).tree
    tree = Tree(nodes.ravel(), flat.blocks, flat.faces, levels)
    counted, rows = np.zeros(1, np.int32), np.zeros(1, np.int64)
    stack = np.full(stack_size(levels) + 8, -7, np.int64)
    assert count_crossings(tree.descriptor, np.zeros((1, 3)), 2, -1.0, rows, counted, stack, 0) == 1
    assert counted.tolist() == [7 * levels + 1]
    assert (stack[-8:] == -7).all() and (stack[500:-8] != -7).any()


TETRAHEDRON = [(0, 1, 2), (0, 2, 3), (0, 3, 1), (1, 3, 2)]


@pytest.mark.parametrize(
    ("vertices", "point"),
    [
        (
            [
                [2.24525504e-316, -2.7133658e-316, -2.58718795e-316],
                [3.7686394e-316, 1.0113675e-316, 0.5],
                [-5.2599764e-316, -1.0, 0.2],
                [-1.0, -0.1, 0.3],
            ],
            [1.7279163e-316, -0.21554341831003698, 0.404266547588439],
        ),
        (
            [
                [7.333203929232191e-286, 0.0, -2.2345715630123243e-286],
                [-2.0404438073251352e-287, 2.028240960365167e31, -2.435064557410902e-288],
                [4.056481920730334e31, 8.112963841460669e30, 1.1493845419600659e-285],
                [4.0564819207303343e30, 1.2169445762191002e31, 4.056481920730334e31],
            ],
            [1.373307914066658e30, 3.579981410714537e30, -1.409615782665431e-286],
        ),
    ],
)
def test_signs_whose_products_vanish_are_not_believed(vertices, point):
    """The bound of a sign's rounding left out what a product loses where it vanishes."""
    triangles = [rational([vertices[i] for i in face]) for face in TETRAHEDRON]
    expected = winding_number(rational([point])[0], triangles) != 0
    assert Octree(vertices, TETRAHEDRON).contains([point]) == expected
    assert BruteForce(vertices, TETRAHEDRON).contains([point]) == expected


def test_a_volume_whose_last_bits_vanish_is_not_believed():
    """Products of three parts lost bits below the least denormal: the origin, inside, was taken as on a face."""
    corners = [
        ["-0x1.aa5e6309459a8p-319", "-0x1.9347e59b849dcp-319", "0x1.c511f3115e084p-319"],
        ["0x1.7bf564d7775c8p-319", "0x1.60f7cbc481550p-319", "-0x1.f3fbd0a4c2cccp-319"],
        ["-0x1.e42a2f418f070p-321", "-0x1.c021eb1e51da0p-321", "0x1.4ad8fcd035a40p-320"],
        ["0x1.3333333333333p-2", "0x1.999999999999ap-2", "0x1.ccccccccccccdp-1"],
    ]
    vertices = [[float.fromhex(x) for x in corner] for corner in corners]
    faces = [[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]]
    origin = [0.0, 0.0, 0.0]
    triangles = [rational([vertices[i] for i in face]) for face in faces]
    assert winding_number(rational([origin])[0], triangles) == 1
    for accelerator in (Octree, BruteForce):
        queries = accelerator(vertices, faces)
        assert queries.contains(origin, boundary=False) and queries.contains(origin, winding=True)
        assert queries.signed_distance(origin) < 0.0


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_points_with_one_tiny_coordinate_need_no_rational_arithmetic(monkeypatch, axis):
    """A point at 1e-310 took 2.5 ms: products with what lies at 1 vanish. The axis is stretched now."""
    # An octahedron: its edges lie in the planes that the points nearly lie in.
    vertices = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0], [0, -1, 0], [0, 0, -1]]
    faces = [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]]
    octree = Octree(vertices, faces)
    points = np.random.default_rng(310).uniform(-1.1, 1.1, (60, 3))
    points[:, axis] = 1e-310
    monkeypatch.setattr("renderer.inside.contains.crossings_of", lambda *_: pytest.fail("told by rational arithmetic"))
    inside = octree.contains(points)
    triangles = [rational(triangle.tolist()) for triangle in octree.mesh.triangles]
    expected = [winding_number(point, triangles) for point in rational(points)]
    assert inside.tolist() == [number != 0 for number in expected] and 0 < inside.sum() < 60


def test_points_on_faces_whose_products_vanish_are_on_them():
    vertices = [
        [2.24525504e-316, -2.7133658e-316, -2.58718795e-316],
        [3.7686394e-316, 1.0113675e-316, 0.5],
        [-5.2599764e-316, -1.0, 0.2],
        [-1.0, -0.1, 0.3],
    ]
    for queries in (Octree(vertices, TETRAHEDRON), BruteForce(vertices, TETRAHEDRON)):
        assert queries.contains(vertices).all() and not queries.contains(vertices, boundary=False).any()


def test_a_face_that_is_a_line_ends_where_it_ends():
    mesh = box()
    a, b = int((mesh.vertices == 0).all(axis=1).argmax()), int((mesh.vertices == 1).all(axis=1).argmax())
    for accelerator in (Octree, BruteForce):
        queries = accelerator(mesh.vertices, [*mesh.faces, (a, b, a)])
        assert queries.contains([[0.5] * 3, [2.0] * 3, [-1.0] * 3]).tolist() == [True, False, False]


def test_coordinates_that_vanish_beside_a_huge_mesh_are_not_on_it():
    points = np.full((3, 3), 0.5e100)
    np.fill_diagonal(points, 5e-324)
    for accelerator in (Octree, BruteForce):
        assert accelerator(box().vertices * 1e100, box().faces).contains(points, boundary=False).all()


@pytest.mark.parametrize("accelerator", [Octree, BruteForce])
def test_points_amid_many_solids_keep_control_c_waiting_for_milliseconds(monkeypatch, accelerator):
    """Only exact tests were counted as work: a million points amid 3,000 tetrahedra kept it waiting for 20 seconds."""
    rng = np.random.default_rng(0)
    faces = (np.array(TETRAHEDRON) + 4 * np.arange(1000)[:, None, None]).reshape(-1, 3)
    solids, calls = accelerator(rng.normal(size=(4000, 3)), faces, threads=1), []

    def counted(*arguments):
        calls.append(count_crossings(*arguments))
        return calls[-1]

    monkeypatch.setattr("renderer.inside.contains.count_crossings", counted)
    solids.contains(rng.uniform(-1.2, 1.2, (4000, 3)))
    assert len(calls) > 5 and calls[-1] == 4000


@cases(("heights", "on"), [((-1, 1, 2), True), ((0, 1, 2), True), ((1, 2, 3), False), ((0, 0, 0), True)])
def test_a_point_on_an_upright_face_without_an_area_is_on_it(heights, on):
    """In rational arithmetic; corners relative to the point."""
    a, b, c = ((Fraction(0), Fraction(0), Fraction(height)) for height in heights)
    assert _on_upright(a, b, c) is on

"""View factors by closed forms and laws; groups, sides, what is let through, and points."""

import numpy as np
import pytest
from cases import cases
from hypothesis import given, settings
from hypothesis import strategies as st

from renderer import BruteForce, Octree
from renderer.mesh.shapes import box, grid, icosphere
from renderer.studies import view_factors, view_factors_from

pytest.importorskip("scipy")
pytestmark = pytest.mark.judges(
    "studies.view_factors", "studies.view_factors_from", "studies.ViewFactors", "studies.PointFactors"
)

# Of a unit cube: a wall to the one opposite (Howell C-11) and to one beside it (C-14).
OPPOSITE, BESIDE = 0.19982489569838746, 0.20004377607540316
WALLS = np.repeat(np.arange(6), 2)


def inward(mesh):
    """The mesh seen from within."""
    return Octree(mesh.vertices, mesh.faces[:, ::-1])


def joined(*meshes):
    """Meshes as one, without welding."""
    begins = np.cumsum([0] + [len(vertices) for vertices, _ in meshes])
    faces = [faces + begin for (_, faces), begin in zip(meshes, begins, strict=False)]
    return np.concatenate([vertices for vertices, _ in meshes]), np.concatenate(faces)


def room(cut, column=True):
    """A unit room whose walls are cut into 2 cut^2 faces each, with a column in it."""
    parts = []
    for axis in range(3):
        for side in (0.0, 1.0):
            wall = grid(cut, cut)
            square = wall.vertices[:, [0, 2]] + 0.5
            vertices = np.insert(square, axis, side, axis=1)
            centre, (a, b, c) = np.full(3, 0.5), vertices[wall.faces[0]]
            turned = np.dot(np.cross(b - a, c - a), centre - a) < 0
            parts.append((vertices, wall.faces[:, ::-1] if turned else wall.faces))
    if column:
        inner = box((0.4, 0.45, 0.2), (0.6, 0.55, 0.8))
        parts.append((inner.vertices, inner.faces))
    return joined(*parts)


def check_laws(found):
    """Reciprocity exactly, no negative entry, and sums of 1."""
    exchange = found.exchange.toarray()
    np.testing.assert_array_equal(exchange, exchange.T)
    assert exchange.min() >= 0.0 and found.sky.min() >= 0.0 and found.backs.min() >= 0.0
    np.testing.assert_allclose(found.matrix.sum(axis=1) + found.sky + found.backs, 1.0, rtol=0, atol=1e-12)


def test_the_walls_of_a_cube_are_exact():
    found = view_factors(inward(box()), WALLS)
    check_laws(found)
    matrix = found.matrix.toarray()
    assert (np.diag(matrix) == 0.0).all() and (found.sky == 0.0).all() and (found.rays == 0).all()
    opposite = np.isclose(matrix, OPPOSITE, rtol=0, atol=1e-9)
    beside = np.isclose(matrix, BESIDE, rtol=0, atol=1e-9)
    assert (opposite.sum(axis=1) == 1).all() and (beside.sum(axis=1) == 4).all()


@cases("searched", [Octree, BruteForce])
@cases("column", [False, True])
def test_laws_hold_by_rays(searched, column):
    vertices, faces = room(3, column)
    check_laws(view_factors(searched(vertices, faces), rtol=0.3, max_rays=512))


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_laws_hold_in_any_scene(seed):
    rng = np.random.default_rng(seed)
    vertices = rng.normal(size=(20, 1, 3)) + 0.5 * rng.normal(size=(20, 3, 3))
    octree = Octree(vertices.reshape(-1, 3), np.arange(60).reshape(-1, 3))
    groups = rng.integers(0, 4, 20)
    groups[:4] = np.arange(4)
    shares = np.where(rng.random(20) < 0.3, rng.random(20), 0.0)
    check_laws(view_factors(octree, groups, sides="both", transmittance=shares, max_rays=1024))


def test_the_bits_are_the_same_for_any_number_of_threads():
    octree = Octree(*room(3))
    one, other = (view_factors(octree, threads=threads, max_rays=1024) for threads in (1, 5))
    for name in ("indptr", "indices", "data"):
        np.testing.assert_array_equal(getattr(one.exchange, name), getattr(other.exchange, name))
    np.testing.assert_array_equal(one.rays, other.rays)


def test_a_ball_in_a_ball():
    """The inner one sees nothing but the outer; of what the outer sends, the share of the areas arrives at the inner.

    Both are polyhedra of the same shape, so the formula of spheres, F = (r / R)^2, holds for their areas;
    and as no ray of the inner one hits anything else, balance makes it exact.
    """
    small, large = icosphere(3), icosphere(3)
    vertices, faces = joined((0.4 * small.vertices, small.faces), (large.vertices, large.faces[:, ::-1]))
    count = len(small.faces)
    found = view_factors(Octree(vertices, faces), np.repeat([0, 1], count))
    check_laws(found)
    np.testing.assert_allclose(found.matrix.toarray(), [[0.0, 1.0], [0.16, 0.84]], rtol=0, atol=1e-12)


def test_a_sphere_sees_itself_by_the_share_of_its_area():
    """From any face of a sphere seen from within, each part of it has the share of its area (Howell C-120).

    The faces of the polyhedron are 1/32 of a radius off the sphere at most, and seen from there
    their size errs by up to a tenth.
    """
    mesh = icosphere(2)
    found = view_factors(inward(mesh), rtol=0.02)
    check_laws(found)
    shares = found.areas / found.areas.sum()
    far = ~np.isin(mesh.faces, mesh.faces[0]).any(axis=1)
    off = np.abs(found.matrix.toarray()[0, far] - shares[far])
    # Rays of both hit: counts err by their roots.
    counted = np.sqrt(shares[far] / (2 * found.rays.min()))
    assert (off < 5.0 * counted + 0.1 * shares[far]).all()


def test_plates_that_send_from_both_sides_are_exact_too():
    plates = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    vertices, faces = joined((plates, faces), (plates + np.eye(3)[2], faces))
    found = view_factors(Octree(vertices, faces), [0, 0, 1, 1], sides="both")
    check_laws(found)
    assert found.areas.tolist() == [2.0, 2.0]
    assert found.matrix[0, 1] == pytest.approx(0.5 * OPPOSITE, rel=1e-9)


@cases("share", [0.0, 0.25, 0.75])
def test_a_screen_lets_its_share_through(share):
    """Half way between two squares hangs a screen, larger than any line between them needs."""
    plates = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    wide = 4.0 * (plates - [0.5, 0.5, 0]) + [0.5, 0.5, 0.5]
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    vertices, faces = joined((plates, faces), (plates + np.eye(3)[2], faces[:, ::-1]), (wide, faces))
    groups = np.repeat([0, 1, 2], 2)
    found = view_factors(
        Octree(vertices, faces), groups, transmittance=np.where(groups == 2, share, 0.0), rtol=0.01, sides="both"
    )
    check_laws(found)
    # Of both sides of a plate one looks at the screen.
    assert found.matrix[0, 1] == pytest.approx(0.5 * share * OPPOSITE, abs=4.0 * found.errors[0, 1] + 1e-12)
    assert found.areas.tolist() == [2.0, 2.0, 2.0 * 16.0 * (1.0 - share)]


@cases("first", [0, 1])
def test_both_sides_of_a_plate_are_seen_each_from_its_side(first):
    """Half way between two squares, whichever side is listed first: as of two plates a little apart."""
    plates = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    up = np.array([[0, 1, 2], [0, 2, 3]])
    sides = [(0.5 * plates + [0.25, 0.25, 0.5], up), (0.5 * plates + [0.25, 0.25, 0.5], up[:, ::-1])]
    outer = (plates, up), (plates + np.eye(3)[2], up[:, ::-1])
    groups = np.repeat([0, 1, *((2, 3) if first == 0 else (3, 2))], 2)
    thin = view_factors(Octree(*joined(*outer, *(sides if first == 0 else sides[::-1]))), groups, rtol=0.005)
    apart = [(sides[0][0] + [0, 0, 1e-6], up), sides[1]]
    thick = view_factors(Octree(*joined(*outer, *apart)), np.repeat(np.arange(4), 2), rtol=0.005)
    check_laws(thin)
    assert (thin.backs == 0.0).all()
    off = np.abs(thin.matrix.toarray() - thick.matrix.toarray())
    assert (off <= 5.0 * np.hypot(thin.errors.toarray(), thick.errors.toarray()) + 1e-5).all()


def test_an_underside_exchanges_nothing_with_what_lies_below_the_floor():
    """A block on a floor, and a plate below that faces up: the underside is covered, whichever way its pairs are found.

    After a refit that lifts the block off the floor, its underside sees the floor.
    """
    plates = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    up = np.array([[0, 1, 2], [0, 2, 3]])
    block, floor = box((0.25, 0.25, 0.0), (0.75, 0.75, 0.5)), (4.0 * plates - [1.5, 1.5, 0.0], up)
    vertices, faces = joined(floor, (plates - np.eye(3)[2], up), (block.vertices, block.faces))
    bottom = np.flatnonzero(block.face_normals()[:, 2] < -0.5)
    groups = np.concatenate([[0, 0, 1, 1], np.where(np.isin(np.arange(12), bottom), 3, 2)])
    octree = Octree(vertices, faces)
    with pytest.warns(UserWarning, match="see backs"):
        found = view_factors(octree, groups)
    assert found.exchange.toarray()[3].tolist() == [0.0] * 4 and found.backs[3] == 1.0
    moved = vertices + np.where(np.arange(len(vertices)) >= 8, 0.5, 0.0)[:, None] * np.eye(3)[2]
    octree.refit(moved)
    with pytest.warns(UserWarning, match="see backs"):
        lifted = view_factors(octree, groups)
    assert lifted.backs[3] == 0.0 and lifted.matrix[3, 0] > 0.5


def test_errors_of_like_surfaces_do_not_add_up():
    """Of 40 equal pairs of plates, far from each other, a block between them: the mean errs less than each."""
    plates = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    up = np.array([[0, 1, 2], [0, 2, 3]])
    block = box((0.3, 0.4, 0.4), (0.6, 0.7, 0.6))
    parts = [(plates, up), (plates + np.eye(3)[2], up[:, ::-1]), (block.vertices, block.faces)]
    meshes = [(vertices + 100.0 * k * np.eye(3)[0], faces) for k in range(40) for vertices, faces in parts]
    groups = np.concatenate([3 * k + np.repeat([0, 1, 2], [2, 2, 12]) for k in range(40)])
    found = view_factors(Octree(*joined(*meshes)), groups, rtol=1e-9, max_rays=1024)
    entries = found.matrix.toarray()[np.arange(0, 120, 3), np.arange(1, 120, 3)]
    exact = view_factors(Octree(*joined(*parts)), groups[:16], rtol=5e-4, max_rays=1 << 20)
    error = found.errors.toarray()[0, 1]
    assert abs(entries.mean() - exact.matrix[0, 1]) < 4.0 * error / np.sqrt(40) + exact.errors[0, 1]
    assert 0.4 * error < entries.std() < 2.5 * error


def test_pairs_save_no_more_rays_than_there_are():
    """However small the error that is wished for: 256 rays are cheaper than 100,000 pairs of faces."""
    vertices, faces = room(8, column=False)
    groups = np.repeat(np.arange(6), 128)
    assert view_factors(Octree(vertices, faces), groups, rtol=1e-6, max_rays=256).rays.tolist() == [256] * 6


def test_backs_are_counted_apart_with_a_warning():
    """Two plates face each other; one of them is turned away."""
    plates = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    vertices, faces = joined((plates, faces), (plates + np.eye(3)[2], faces))
    octree, groups = Octree(vertices, faces), [0, 0, 1, 1]
    with pytest.warns(UserWarning, match="surface 0 most"):
        found = view_factors(octree, groups, rtol=0.005)
    check_laws(found)
    assert found.exchange.nnz == 0
    assert found.backs == pytest.approx([OPPOSITE, 0.0], abs=0.02)


def test_points_see_the_corner_of_a_room_by_lamberts_formula():
    """A corner of a unit square seen from a point below it, at right angles to its plane (Howell B-3)."""
    octree = inward(box())
    # From the middle of the floor, the ceiling is four squares of side 1/2, each at the distance 1.
    a = 0.5
    root = np.sqrt(1.0 + a * a)
    corner = (a / root * np.arctan(a / root)) / np.pi
    found = view_factors_from(octree, [[0.5, 0.5, 0.0], [0.5, 0.5, 1e-9]], [0, 0, 1], WALLS, rtol=1e-3)
    ceiling = int(np.flatnonzero(np.isclose(found.matrix.toarray()[0], 4.0 * corner, atol=0.02))[0])
    for k in range(2):
        assert found.matrix[k, ceiling] == pytest.approx(4.0 * corner, abs=4.0 * found.errors[k, ceiling])
    assert (found.sky == 0.0).all()
    np.testing.assert_allclose(found.matrix.sum(axis=1), 1.0, atol=1e-12)


@cases(
    ("arguments", "message"),
    [
        ({"groups": [0] * 11}, "groups: expected"),
        ({"groups": [-1] + [0] * 11}, "groups: expected surfaces from 0 up for all faces, got -1 in row 0"),
        ({"groups": [0] * 11 + [2]}, "groups: expected each surface from 0 to the largest, got no face of surface 1"),
        ({"groups": [0] * 11 + [99]}, "groups: expected each surface from 0 to the largest, got no face of surface 1"),
        ({"groups": [0.5] * 12}, "groups: expected"),
        ({"sides": "back"}, "sides: expected 'front' or 'both', got 'back'"),
        ({"transmittance": [0.5]}, "transmittance: expected shape \\(12,\\), one a face"),
        ({"transmittance": [0.5] * 11 + [-0.1]}, "transmittance: expected numbers from 0 to 1, got -0.1 in row 11"),
        ({"transmittance": [np.nan] * 12}, "transmittance: expected numbers from 0 to 1, got nan in row 0"),
        (
            {"transmittance": [0.0] * 11 + [1.0]},
            "transmittance: expected less than 1 in each surface, got 1 for",
        ),
        ({"rtol": 0.0}, "rtol: expected a number above 0, got 0.0"),
        ({"rtol": np.nan}, "rtol: expected a number above 0, got nan"),
        ({"max_rays": 255}, "max_rays: expected"),
        ({"max_rays": 7, "form": "rays"}, "max_rays: expected"),
        ({"form": "dense"}, "form: expected 'matrix' or 'rays', got 'dense'"),
    ],
)
def test_bad_input_is_named(arguments, message):
    with pytest.raises(ValueError, match=message):
        view_factors(Octree.from_mesh(box()), **arguments)


def test_rays_in_place_of_a_matrix_are_a_balanced_exchange():
    vertices, faces = room(4)
    octree = Octree(vertices, faces[2:])  # with a hole
    exact, found = (
        view_factors(octree, **keywords) for keywords in ({"rtol": 0.005}, {"form": "rays", "max_rays": 256})
    )
    number = len(faces) - 2
    product = found.exchange @ np.eye(number)
    np.testing.assert_allclose(product, product.T, rtol=1e-12, atol=0)
    sums = product.sum(axis=1) / found.areas + found.sky + found.backs
    np.testing.assert_allclose(sums, 1.0, rtol=0, atol=2e-9)
    x = np.linspace(0, 1, number)
    # The mean of 256 rays of numbers up to 1 errs by at most 1 / 32 in four of five rows, and less by low discrepancy.
    off = np.abs(found.exchange @ x - exact.exchange @ x) / found.areas
    assert off.max() < 0.1 and np.sqrt((off**2).mean()) < 1 / 32
    np.testing.assert_allclose(found.exchange @ x, (found.exchange @ np.stack([x, x], axis=1))[:, 1], rtol=1e-14)
    with pytest.raises(ValueError, match=r"x: expected shape \(\d+,\) or"):
        found.exchange @ np.ones(1)
    with pytest.raises(ValueError, match="matrix: expected view factors with form='matrix'"):
        found.matrix  # noqa: B018


def test_a_face_without_area_is_named():
    octree = Octree([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2], [0, 1, 1]])
    with pytest.raises(ValueError, match=r"groups: expected surfaces with an area, got none in surface 1, .*\[1\]"):
        view_factors(octree)
    assert view_factors(octree, [0, 0]).areas.tolist() == [0.5]

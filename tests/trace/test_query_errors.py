"""Bad input is refused where it enters: the error names the argument, what was expected, what came, and the row."""

import numpy as np
import pytest
from cases import cases

from renderer.errors import MeshError
from renderer.octree import BruteForce, Octree

pytestmark = pytest.mark.judges("BruteForce", "Octree", "Octree.any_hit", "Octree.closest_hit", "Octree.from_mesh")


VERTICES = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
FACES = [[0, 1, 2]]
ACCELERATORS = [Octree(VERTICES, FACES), BruteForce(VERTICES, FACES)]
GOOD = np.ones((4, 3))


def short(value):
    """A test's name for a bad value."""
    return repr(value)[:24]


def with_row(row, value):
    array = GOOD.copy()
    array[row] = value
    return array


def refused(call, *parts):
    with pytest.raises(ValueError) as caught:
        call()
    message = str(caught.value)
    assert "expected" in message and "got" in message
    for part in parts:
        assert part in message
    return message


@pytest.mark.parametrize("accelerator", ACCELERATORS, ids=["octree", "brute"])
@pytest.mark.parametrize("query", ["closest_hit", "any_hit"])
class TestRays:
    @pytest.mark.parametrize(
        "bad", [np.nan, np.inf, -np.inf, [0, np.nan, 0], [0, 0, -np.inf], [np.inf, -np.inf, 0], [np.nan, np.inf, 0]]
    )
    @pytest.mark.parametrize("row", [0, 2, 3])
    def test_origins_and_directions_must_be_finite(self, accelerator, query, bad, row):
        call = getattr(accelerator, query)
        assert refused(lambda: call(with_row(row, bad), GOOD), f"row {row}", "finite").startswith("origins: ")
        assert refused(lambda: call(GOOD, with_row(row, bad)), f"row {row}", "finite").startswith("directions: ")

    @pytest.mark.parametrize("zero", [0.0, -0.0, [0.0, -0.0, 0.0]])
    @pytest.mark.parametrize("row", [0, 2, 3])
    def test_directions_must_not_be_zero(self, accelerator, query, zero, row):
        call = getattr(accelerator, query)
        assert refused(lambda: call(GOOD, with_row(row, zero)), f"row {row}", "zero").startswith("directions: ")

    @pytest.mark.parametrize("far", [1e39, -1e39, 2.0**127, 1e300])
    @pytest.mark.parametrize("row", [0, 3])
    def test_origins_keep_to_the_coordinates_that_vertices_keep_to(self, accelerator, query, far, row):
        # Boxes are float32: beyond its range inf - inf would enter octants that are empty.
        call = getattr(accelerator, query)
        assert refused(lambda: call(with_row(row, [0, far, 0]), GOOD), f"row {row}").startswith("origins: ")

    def test_the_first_bad_row_is_named(self, accelerator, query):
        directions = GOOD.copy()
        directions[[1, 3]] = 0
        refused(lambda: getattr(accelerator, query)(GOOD, directions), "directions", "row 1")
        refused(lambda: getattr(accelerator, query)(with_row(2, np.nan), directions), "directions", "row 1")

    def test_a_bad_row_is_found_in_a_large_batch(self, accelerator, query):
        directions = np.ones((100_000, 3))
        directions[99_999] = np.nan
        refused(lambda: getattr(accelerator, query)(np.ones((100_000, 3)), directions), "directions", "row 99999")

    @pytest.mark.parametrize(
        "bad",
        [
            np.ones(4), np.ones((4, 2)), np.ones((3, 4)), np.ones((4, 3, 1)), 1.0, [], None, "abc",
            [["a", "b", "c"]] * 4,
            np.ones((4, 3), bool), np.ones((4, 3), complex), np.full((4, 3), None), [[1, 2, 3], [1, 2]], {"x": 1},
            np.zeros((4, 3), "datetime64[s]"), [[10**400, 0, 0]] * 4,
        ],
        ids=short,
    )  # fmt: skip
    def test_shapes_and_types(self, accelerator, query, bad):
        call = getattr(accelerator, query)
        assert refused(lambda: call(bad, GOOD)).startswith("origins: ")
        assert refused(lambda: call(GOOD, bad)).startswith("directions: ")

    def test_lengths_must_agree(self, accelerator, query):
        call = getattr(accelerator, query)
        refused(lambda: call(GOOD, np.ones((3, 3))), "directions", "4", "3")
        refused(lambda: call(np.ones((2, 3)), GOOD), "directions", "2", "4")
        refused(lambda: call(np.empty((0, 3)), GOOD), "directions", "0", "4")

    @pytest.mark.parametrize("name", ["t_min", "t_max"])
    @pytest.mark.parametrize(
        "bad", [np.ones(3), np.ones((4, 1)), np.ones((1, 4)), [1.0], [], "a", None, True, 1j, [[1], [1, 2]]], ids=short
    )
    def test_bounds_have_one_value_or_one_a_ray(self, accelerator, query, name, bad):
        assert refused(lambda: getattr(accelerator, query)(GOOD, GOOD, **{name: bad})).startswith(f"{name}: ")

    @pytest.mark.parametrize("name", ["t_min", "t_max"])
    @pytest.mark.parametrize("bad", [np.nan, -1.0, -5e-324, -np.inf])
    def test_bounds_are_numbers_from_zero(self, accelerator, query, name, bad):
        call = getattr(accelerator, query)
        assert refused(lambda: call(GOOD, GOOD, **{name: bad})).startswith(f"{name}: ")
        each = np.ones(4)
        each[2] = bad
        assert refused(lambda: call(GOOD, GOOD, **{name: each}), "row 2").startswith(f"{name}: ")

    def test_t_min_is_finite(self, accelerator, query):
        call = getattr(accelerator, query)
        assert refused(lambda: call(GOOD, GOOD, np.inf), "inf").startswith("t_min: ")
        assert refused(lambda: call(GOOD, GOOD, np.array([0, 1, np.inf, 0])), "inf", "row 2").startswith("t_min: ")

    def test_what_is_unusual_but_right_is_taken(self, accelerator, query):
        call = getattr(accelerator, query)
        for low, high in ((-0.0, np.inf), (np.float32(0.5), 3), (np.array(1), [1, 2, 3, np.inf]), (5, 1)):
            call(GOOD, GOOD, low, high)
        call(GOOD * 2.0**126, -GOOD)
        call([[1, 2, 3]], np.array([[0, 0, 1]], np.uint8), [0.0], [1.0])


@cases(
    "options",
    [
        {"split": "SAH"},
        {"split": ""},
        {"split": None},
        {"split": 0},
        {"split": ["sah"]},
        {"leaf_size": 0},
        {"leaf_size": 33},
        {"leaf_size": -1},
        {"leaf_size": 4.0},
        {"leaf_size": "4"},
        {"leaf_size": None},
        {"leaf_size": True},
        {"leaf_size": np.nan},
        {"leaf_size": [4]},
        {"max_depth": 0},
        {"max_depth": 65},
        {"max_depth": -3},
        {"max_depth": 8.5},
        {"max_depth": True},
        {"max_depth": None},
        {"max_depth": np.array([3, 4])},
        {"threads": 0},
        {"threads": -1},
        {"threads": 1.5},
        {"threads": "2"},
        {"threads": True},
        {"threads": [2]},
    ],
)
def test_options(options):
    (name,) = options
    assert refused(lambda: Octree(VERTICES, FACES, **options)).startswith(f"{name}: ")
    assert refused(lambda: Octree.from_mesh(ACCELERATORS[0].mesh, **options)).startswith(f"{name}: ")
    if name == "threads":
        assert refused(lambda: BruteForce(VERTICES, FACES, **options)).startswith("threads: ")


def test_options_may_be_numpy_integers():
    for kind in (np.int8, np.int32, np.int64, np.uint8):
        octree = Octree(VERTICES, FACES, leaf_size=kind(2), max_depth=kind(3), threads=kind(2))
        assert octree.any_hit([[0.25, 0.25, 1]], [[0, 0, -1]]).all()


def test_options_are_keywords():
    with pytest.raises(TypeError):
        Octree(VERTICES, FACES, "sah")


@cases("accelerator", [Octree, BruteForce])
@cases(
    "vertices, faces, parts",
    [
        ([*VERTICES, [0, np.nan, 0]], FACES, ("vertices", "row 3")),
        ([*VERTICES, [0, np.inf, 0]], FACES, ("vertices", "row 3")),
        (VERTICES, [[0, 1, 2], [0, 1, 99]], ("faces", "99", "row 1")),
        (VERTICES, [[0, 1, -1]], ("faces", "-1", "row 0")),
        (VERTICES, [[0, 1, 3]], ("faces", "3", "row 0")),
        (VERTICES, [[0.0, 1.0, 2.0]], ("faces", "float64")),
        (VERTICES, [[0, 1]], ("faces", "(1, 2)")),
        ([[0, 0], [1, 1]], [[0, 1, 1]], ("vertices", "(2, 2)")),
        ([], FACES, ("faces", "row 0")),
        ([[0, 0, 0], [1e-300, 0, 0], [0, -1e300, 0]], FACES, ("vertices", "row 1")),
    ],
)
def test_meshes(accelerator, vertices, faces, parts):
    with pytest.raises(MeshError) as caught:
        accelerator(vertices, faces)
    assert "expected" in str(caught.value) and all(part in str(caught.value) for part in parts)

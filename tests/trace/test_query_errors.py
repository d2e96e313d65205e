"""Bad rays and options are refused where they enter: the error names the argument, what was expected, and the row."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from cases import cases

from renderer.errors import MeshError
from renderer.mesh.shapes import icosphere
from renderer.octree import BruteForce, Octree
from renderer.trace import closest

pytestmark = pytest.mark.judges("BruteForce", "Octree", "Octree.any_hit", "Octree.closest_hit", "Octree.from_mesh")


VERTICES = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
FACES = [[0, 1, 2]]
ACCELERATORS = [Octree(VERTICES, FACES), BruteForce(VERTICES, FACES)]
QUERIES = [getattr(accelerator, name) for accelerator in ACCELERATORS for name in ("closest_hit", "any_hit")]
GOOD = np.ones((4, 3))


def with_row(row: int, value: Any) -> Any:
    array = GOOD.copy()
    array[row] = value
    return array


# What is expected of the named argument, and the rays or bounds that are not so.
BAD: list[tuple[str, dict[str, Any]]] = [
    (r"origins: expected finite .* in row 2", {"origins": with_row(2, [0, np.nan, 0])}),
    (r"origins: expected finite .* in row 3", {"origins": with_row(3, np.inf)}),
    (r"origins: .* in row 0", {"origins": with_row(0, [0, -1e39, 0])}),  # inf - inf would enter empty octants
    (r"origins: .* in row 3", {"origins": with_row(3, [0, 2.0**127, 0])}),
    (r"directions: expected finite, non-zero .* in row 2", {"directions": with_row(2, [0, 0, -np.inf])}),
    (r"directions: expected finite, non-zero .* in row 3", {"directions": with_row(3, [0.0, -0.0, 0.0])}),
    (r"directions: .* \(4, 3\), got shape \(3, 3\)", {"directions": np.ones((3, 3))}),
    (r"origins: ", {"origins": [[1, 2, 3], [1, 2]]}),
    (r"origins: ", {"origins": np.ones((4, 3), bool)}),
    (r"origins: ", {"origins": [[10**400, 0, 0]] * 4}),
    (r"t_min: .* in row 2", {"t_min": np.array([0, 1, np.inf, 0])}),
    (r"t_min: .*inf", {"t_min": np.inf}),
]


@cases("query", QUERIES)
@cases(("said", "changed"), BAD)
def test_bad_rays_are_named_by_their_row(query: Any, said: str, changed: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=rf"^(?:{said})"):
        query(**{"origins": GOOD, "directions": GOOD, **changed})


@cases("query", QUERIES)
def test_the_first_bad_row_is_named_in_a_batch_of_any_size(query: Any) -> None:
    directions = GOOD.copy()
    directions[[1, 3]] = 0
    many = np.ones((100_000, 3))
    many[99_999] = np.nan
    few, some = (GOOD, directions, 1), (np.ones((100, 3)), np.tile(directions, (25, 1)), 1)
    for origins, bad, row in (few, (with_row(2, np.nan), directions, 1), some, (GOOD[0], many, 99_999)):
        with pytest.raises(ValueError, match=rf"^directions: .* in row {row}$"):
            query(origins, bad)


@cases("query", ["closest_hit", "any_hit"])
def test_the_first_bad_row_is_named_if_a_later_chunk_ends_first(query: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def backwards(work: Any, count: int, size: int, threads: int) -> None:
        for begin in reversed(range(0, count, size)):
            list(work(begin, min(begin + size, count)))

    monkeypatch.setattr(closest, "for_chunks", backwards)
    directions = np.ones((20_000, 3))
    directions[[7, 19_999]] = 0
    with pytest.raises(ValueError, match=r"^directions: .* in row 7$"):
        getattr(ACCELERATORS[0], query)(np.ones((20_000, 3)), directions)


@cases("query", QUERIES)
@cases("name", ["t_min", "t_max"])
@cases("bad", [np.nan, -1.0, -5e-324, -np.inf])
def test_bounds_are_numbers_from_zero(query: Any, name: str, bad: float) -> None:
    for given in (bad, np.array([1.0, 1.0, bad, 1.0])):
        with pytest.raises(ValueError, match=rf"^{name}: .* in row {2 if np.ndim(given) else 0}"):
            query(GOOD, GOOD, **{name: given})


@cases("query", QUERIES)
def test_what_is_unusual_but_right_is_taken(query: Any) -> None:
    for low, high in ((-0.0, np.inf), (np.float32(0.5), 3), (np.array(1), [1, 2, 3, np.inf]), (5, 1)):
        query(GOOD, GOOD, low, high)
    query(GOOD * 2.0**126, -GOOD)
    query([[1, 2, 3]], np.array([[0, 0, 1]], np.uint8), [0.0], [1.0])


@cases("accelerator", [Octree, BruteForce])
@cases(("low", "high"), [(2.0, 1.0), (np.finfo(float).max, 0.0), (np.full(4, 9.0), np.full(4, 8.5))])
def test_an_interval_without_numbers_holds_no_hit(accelerator: Any, low: Any, high: Any) -> None:
    ball = accelerator.from_mesh(icosphere(1))
    hits = ball.closest_hit(-9.0 * GOOD, GOOD, low, high)
    assert ball.any_hit(-9.0 * GOOD, GOOD).all() and (hits.face == -1).all() and np.isinf(hits.t).all()
    assert not ball.any_hit(-9.0 * GOOD, GOOD, low, high).any()


def bad_options() -> Iterator[tuple[str, Any]]:
    yield from (("split", bad) for bad in ("SAH", "", None, ["sah"]))
    yield from (("leaf_size", bad) for bad in (0, 33, 4.0, "4", None, True, np.nan, [4]))
    yield from (("max_depth", bad) for bad in (0, 65, 8.5, True, None, np.array([3, 4])))
    yield from (("threads", bad) for bad in (0, -1, 1.5, "2", True, [2]))


@cases(("name", "bad"), bad_options())
def test_options(name: str, bad: Any) -> None:
    builds = [lambda **options: Octree(VERTICES, FACES, **options)]
    builds += [lambda **options: BruteForce(VERTICES, FACES, **options)] if name == "threads" else []
    for build in builds:
        with pytest.raises(ValueError, match=rf"^{name}: expected .*, got "):
            build(**{name: bad})


def test_options_may_be_numpy_integers_and_are_keywords() -> None:
    for kind in (np.int8, np.int32, np.int64, np.uint8):
        octree = Octree(VERTICES, FACES, leaf_size=kind(2), max_depth=kind(3), threads=kind(2))
        assert octree.any_hit([[0.25, 0.25, 1]], [[0, 0, -1]]).all()
    with pytest.raises(TypeError):
        Octree(VERTICES, FACES, "sah")  # type: ignore[misc]


@cases("accelerator", [Octree, BruteForce])
@cases(
    ("vertices", "faces", "said"),
    [
        ([*VERTICES, [0, np.nan, 0]], FACES, "vertices: .* in row 3"),
        (VERTICES, [[0, 1, 2], [0, 1, 99]], "faces: .*99.* in row 1"),
        (VERTICES, [[0, 1, -1]], "faces: .*-1.* in row 0"),
        (VERTICES, [[0.0, 1.0, 2.0]], "faces: .*float64"),
        ([[0, 0], [1, 1]], [[0, 1, 1]], r"vertices: .*\(2, 2\)"),
        ([[0, 0, 0], [1e-300, 0, 0], [0, -1e300, 0]], FACES, "vertices: .* in row 1"),
    ],
)
def test_meshes(accelerator: Any, vertices: Any, faces: Any, said: str) -> None:
    with pytest.raises(MeshError, match=f"^{said}"):
        accelerator(vertices, faces)

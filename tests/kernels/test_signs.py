"""Signs of areas and volumes say what exact arithmetic says, or that they do not know."""

from fractions import Fraction

import numpy as np

from renderer.jit.decorators import kernel
from renderer.numerics.expansions import PARTS
from renderer.numerics.predicates import UNDECIDED, lies_within
from renderer.numerics.simd import pointer


@kernel
def _lie_within(rows, parts, found):
    """``lies_within`` of rows (n, 12): the corners of a face and a point."""
    for i in range(len(rows)):
        a, b = (rows[i, 0], rows[i, 1], rows[i, 2]), (rows[i, 3], rows[i, 4], rows[i, 5])
        c, p = (rows[i, 6], rows[i, 7], rows[i, 8]), (rows[i, 9], rows[i, 10], rows[i, 11])
        found[i] = lies_within(a, b, c, p, pointer(parts))


def is_within(a: tuple[float, ...], b: tuple[float, ...], c: tuple[float, ...], p: tuple[float, ...]) -> bool:
    """Whether a point (x, y) lies in a closed triangle of some area."""

    def area(u: tuple[float, ...], v: tuple[float, ...]) -> Fraction:
        (ux, uy), (vx, vy), (px, py) = ([Fraction(x) for x in point] for point in (u, v, p))
        return (ux - px) * (vy - py) - (uy - py) * (vx - px)

    areas = area(b, c), area(c, a), area(a, b)
    return all(x >= 0 for x in areas) or all(x <= 0 for x in areas)


def test_a_point_beside_coordinates_of_all_sizes_is_on_a_face_or_not_or_that_is_not_known() -> None:
    """One side of three whose area leaves float64's range makes the answer unknown."""
    rng = np.random.default_rng(5)
    sizes = np.array([0.0, 1.0, 1e-300, 1e-200, 1e-140, 1e-100, 1e100, 1e140])
    flat = rng.choice(sizes, (2000, 4, 2)) * rng.choice([-1.0, 1.0, 3.0], (2000, 4, 2))
    for axis in range(3):
        rows, found = np.insert(flat, axis, 0.0, axis=2).reshape(-1, 12), np.empty(2000, np.int64)
        _lie_within(rows, np.empty(2 * PARTS), found)
        exact = [tuple(map(tuple, face)) for face in flat.tolist()]
        area = [is_area(*corners[:3]) for corners in exact]
        told = (found != UNDECIDED) & area
        assert 100 < told.sum() < 1900
        true = np.array([is_within(*face) for face in exact])
        np.testing.assert_array_equal(found[told] == 1, true[told])
        assert 10 < true[told].sum() < told.sum() - 10


def is_area(a: tuple[float, ...], b: tuple[float, ...], c: tuple[float, ...]) -> bool:
    """Whether a triangle has an area."""
    (ax, ay), (bx, by), (cx, cy) = ([Fraction(x) for x in point] for point in (a, b, c))
    return (bx - ax) * (cy - ay) != (by - ay) * (cx - ax)

"""The exact signs at edges: against rational arithmetic, where products vanish too."""

from fractions import Fraction

import numpy as np
from cases import cases
from hypothesis import example, given
from hypothesis import strategies as st

from renderer.trace.edge_signs import EdgeSides, passes_within, products_sign

# Products of these may vanish or be denormal, but none overflows, as no product of a ray's and a face's does.
NUMBERS = st.floats(-(2.0**500), 2.0**500)


def sign(x):
    return (x > 0) - (x < 0)


@given(NUMBERS, NUMBERS, NUMBERS, NUMBERS)
@example(5e-324, 5e-324, 0.0, 1.0)
@example(5e-324, 5e-324, 1e-323, 5e-324)
@example(5e-324, -5e-324, 5e-324, 5e-324)
@example(2.0**-1074, 2.0**500, 2.0**-500, 2.0**-74)
def test_any_numbers(a, b, c, d):
    assert products_sign(a, b, c, d) == sign(Fraction(a) * Fraction(b) - Fraction(c) * Fraction(d))


@given(st.integers(0, 2**32 - 1), st.sampled_from([1.0, 2.0**-300, 2.0**-520, 2.0**-537]))
def test_products_that_rounding_makes_one(seed, scale):
    """(x + i u)(y + j u) for small i and j are within some roundings of each other; many round to one float64."""
    rng = np.random.default_rng(seed)
    x, y = scale * (1.0 + rng.random(2))
    steps = rng.integers(-2, 3, 4)
    a, b, c, d = (p + int(k) * float(np.spacing(p)) for p, k in zip((x, y, x, y), steps, strict=True))
    exact = Fraction(a) * Fraction(b) - Fraction(c) * Fraction(d)
    assert products_sign(a, b, c, d) == sign(exact) == -products_sign(c, d, a, b) == -products_sign(a, -b, c, -d)


@cases(
    ("sides", "within"),
    [
        ((1, 1, 1), 1),
        ((-1, -1, -1), 1),
        ((1, 0, 1), 1),
        ((0, 0, -1), 1),
        ((0, 0, 0), 0),
        ((1, -1, 1), 0),
        ((0, 1, -1), 0),
    ],
)
def test_a_face_is_closed_and_has_no_side_in_its_plane(sides, within):
    assert passes_within(EdgeSides(*sides)) == bool(within)

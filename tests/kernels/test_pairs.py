"""Pairs of float64 against fractions: what is exact is exact, and the rest errs by less than 2^-100 of its terms."""

from fractions import Fraction

import numpy as np
from cases import cases
from hypothesis import given
from hypothesis import strategies as st
from numba import njit

from renderer.numerics import double_double as pairs

# Products and their roundings must be normal numbers: users scale first.
NUMBERS = st.floats(-(2.0**60), 2.0**60).filter(lambda x: x == 0.0 or abs(x) > 2.0**-60)


@njit
def call(function, a, b):
    return function(a, b)


def as_pair(x, y):
    """A pair near x whose tail is a rounding of it."""
    return (x, float(x * 2.0**-54 * np.sin(y)))


def value(pair):
    return Fraction(pair[0]) + Fraction(pair[1])


@given(NUMBERS, NUMBERS)
def test_a_difference_is_exact(a, b):
    assert value(call(pairs.difference, a, b)) == Fraction(a) - Fraction(b)


@given(NUMBERS, NUMBERS)
def test_a_product_of_two_numbers_is_exact(a, b):
    assert value(call(pairs.product, (a, 0.0), (b, 0.0))) == Fraction(a) * Fraction(b)


@given(NUMBERS, NUMBERS, NUMBERS, NUMBERS)
def test_pairs_err_by_less_than_2_to_the_minus_100(a, b, c, d):
    p, q = as_pair(a, b), as_pair(c, d)
    for function, exact in ((pairs.plus, value(p) + value(q)), (pairs.minus, value(p) - value(q))):
        assert abs(value(call(function, p, q)) - exact) <= Fraction(1, 2**100) * (abs(value(p)) + abs(value(q)))
    exact = value(p) * value(q)
    assert abs(value(call(pairs.product, p, q)) - exact) <= Fraction(1, 2**100) * abs(exact)


@given(st.lists(NUMBERS, min_size=6, max_size=6))
def test_vectors_of_pairs(numbers):
    a, b = numbers[:3], numbers[3:]
    exact = [Fraction(x) for x in a], [Fraction(x) for x in b]
    (a0, a1, a2), (b0, b1, b2) = exact
    p, q = call_one(tuple(a)), call_one(tuple(b))
    size = sum(abs(x) for x in exact[0]) * sum(abs(x) for x in exact[1])
    assert abs(value(call(pairs.dot_pairs, p, q)) - (a0 * b0 + a1 * b1 + a2 * b2)) <= size / 2**100
    right = a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0
    for got, expected in zip(call(pairs.cross_pairs, p, q), right, strict=True):
        assert abs(value(got) - expected) <= size / 2**100


@njit
def call_one(vector):
    return pairs.as_pairs(vector)


@cases("x", [1.0, 1.5, 2.0**-1022, 3e-300, 2.0 - 2.0**-52, 1e308])
def test_the_power_of_two_below(x):
    below = power(x)
    assert below <= x < 2.0 * below
    assert np.frexp(below)[0] == 0.5


@njit
def power(x):
    return pairs.power_below(x)

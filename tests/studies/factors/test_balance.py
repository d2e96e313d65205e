"""Balanced exchanges: the sums of rows, symmetry, what is exact, and how little changes."""

import numpy as np
import pytest

from renderer.studies.factors.balance import Exchanges, balanced

pytest.importorskip("scipy")


def sums(found, number):
    """The sums of rows."""
    beside = np.where(found.rows == found.columns, 0.0, found.values)
    ends = np.bincount(found.rows, found.values, number) + np.bincount(found.columns, beside, number)
    return ends + found.outside


def exchanges(seed, number=12):
    """Exchanges that are balanced, with some on the diagonal, and the areas."""
    rng = np.random.default_rng(seed)
    rows, columns = np.triu_indices(number)
    values = rng.random(len(rows)) * (rng.random(len(rows)) < 0.7)
    outside = rng.random(number)
    found = Exchanges(rows, columns, values, np.ones(len(rows)), outside, np.ones(number))
    return found, sums(found, number)


@pytest.mark.parametrize("seed", range(5))
def test_rows_get_the_sums_of_their_areas(seed):
    given, areas = exchanges(seed)
    rng = np.random.default_rng(seed + 100)
    noisy = given._replace(
        values=given.values * rng.uniform(0.7, 1.4, len(given.values)), outside=given.outside * rng.uniform(0.7, 1.4, 12)
    )
    found = balanced(noisy, areas)
    np.testing.assert_allclose(sums(found, 12), areas, rtol=1e-13)
    assert (found.values >= 0.0).all() and ((found.values == 0.0) == (noisy.values == 0.0)).all()
    # Each row moves its entries together, so they come nearer to what was disturbed.
    assert np.abs(found.values - given.values).sum() < np.abs(noisy.values - given.values).sum()


def test_what_has_no_freedom_keeps_its_bits():
    given, areas = exchanges(1)
    exact = np.arange(len(given.values)) % 3 == 0
    values = np.where(exact, given.values, given.values * 1.1)
    found = balanced(given._replace(values=values, freedom=np.where(exact, 0.0, 1.0)), areas)
    np.testing.assert_array_equal(found.values[exact], given.values[exact])
    np.testing.assert_allclose(sums(found, 12), areas, rtol=1e-13)


def test_a_balanced_exchange_keeps_its_bits():
    given, areas = exchanges(2)
    found = balanced(given, areas)
    np.testing.assert_array_equal(found.values, given.values)
    np.testing.assert_array_equal(found.outside, given.outside)

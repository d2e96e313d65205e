"""Balanced exchanges: the sums of rows, symmetry, what is exact, and how little changes."""

import numpy as np
import pytest

from renderer.studies.factors.balance import Exchanges, balanced

csr_array = pytest.importorskip("scipy.sparse").csr_array


def sums(found):
    """The sums of rows."""
    upper = found.upper.toarray()
    return (upper + np.triu(upper, 1).T).sum(axis=1) + found.outside


def exchanges(seed, number=12):
    """Exchanges that are balanced, with some on the diagonal, and the areas."""
    rng = np.random.default_rng(seed)
    upper = csr_array(np.triu(rng.random((number, number)) * (rng.random((number, number)) < 0.7)))
    found = Exchanges(upper, np.ones(upper.nnz), rng.random(number), np.ones(number))
    return found, sums(found)


def changed(given, entries):
    """Exchanges with other entries."""
    return given._replace(upper=csr_array((entries, given.upper.indices, given.upper.indptr), shape=given.upper.shape))


@pytest.mark.parametrize("seed", range(5))
def test_rows_get_the_sums_of_their_areas(seed):
    given, areas = exchanges(seed)
    rng = np.random.default_rng(seed + 100)
    noisy = changed(given, given.upper.data * rng.uniform(0.7, 1.4, given.upper.nnz))
    noisy = noisy._replace(outside=given.outside * rng.uniform(0.7, 1.4, 12))
    found = balanced(noisy, areas)
    np.testing.assert_allclose(sums(found), areas, rtol=1e-13)
    assert (found.upper.data > 0.0).all() and (found.outside > 0.0).all()
    # Each row moves its entries together, so they come nearer to what was disturbed.
    assert np.abs((found.upper - given.upper).data).sum() < np.abs((noisy.upper - given.upper).data).sum()


def test_what_has_no_freedom_keeps_its_bits():
    given, areas = exchanges(1)
    data = given.upper.data
    exact = np.arange(len(data)) % 3 == 0
    off = changed(given, np.where(exact, data, 1.1 * data))._replace(freedom=np.where(exact, 0.0, 1.0))
    found = balanced(off, areas)
    np.testing.assert_array_equal(found.upper.data[exact], data[exact])
    np.testing.assert_allclose(sums(found), areas, rtol=1e-13)


def test_a_balanced_exchange_keeps_its_bits():
    given, areas = exchanges(2)
    found = balanced(given, areas)
    np.testing.assert_array_equal(found.upper.data, given.upper.data)
    np.testing.assert_array_equal(found.outside, given.outside)

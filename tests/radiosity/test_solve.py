"""Radiosity against closed forms and a dense solution: values, the proven bound, energy, and bad input."""

import re
from dataclasses import replace
from fractions import Fraction

import enclosures
import numpy as np
import pytest
from cases import cases
from scipy.sparse import csr_array
from scipy.sparse.linalg import aslinearoperator

from renderer.radiosity import radiosity, system
from renderer.radiosity.surfaces import check_factors
from renderer.radiosity.system import System, amplification_of

pytestmark = pytest.mark.judges(
    "radiosity.radiosity", "radiosity.Radiosity", "radiosity.Balance", "radiosity.Balance.error"
)


def dense(factors, emission, reflectance, sky=0.0):
    """B by elimination, each channel alone."""
    n = len(factors.areas)
    emission, reflectance = (np.broadcast_to(given, (n, 3)) for given in (emission, reflectance))
    sky = np.broadcast_to(sky, 3)
    # What is not behind backs.
    share = 1.0 - factors.backs
    matrix = factors.exchange.toarray() / (factors.areas * share)[:, None]
    columns = []
    for channel in range(3):
        rho = reflectance[:, channel]
        system = np.eye(n) - rho[:, None] * matrix
        columns.append(np.linalg.solve(system, emission[:, channel] + rho * factors.sky / share * sky[channel]))
    return np.stack(columns, axis=1)


def drawn(seed, n, greatest=0.95, is_open=True):
    rng = np.random.default_rng(seed)
    factors = enclosures.enclosure(rng, n, is_open)
    return factors, rng.random((n, 3)) * (rng.random((n, 1)) < 0.4), rng.random((n, 3)) * greatest, rng.random(3)


@cases("greatest", [0.5, 0.9, 0.999])
@cases("n", [2, 7, 60])
def test_b_is_one_where_all_emit_what_they_do_not_reflect(n, greatest):
    rng = np.random.default_rng(n)
    rho = rng.random((n, 3)) * greatest
    rho[0] = 0.0, greatest, greatest
    found = radiosity(enclosures.enclosure(rng, n), 1.0 - rho, rho)
    assert np.abs(found.values - 1.0).max() <= found.bound <= 1e-6 * found.values.max()
    np.testing.assert_allclose(found.irradiance, 1.0, atol=1e-6)


@cases("rho", [0.0, 0.3, 0.99])
def test_a_sphere_multiplies_its_light(rho):
    factors = enclosures.sphere(np.array([0.1, 2.0, 0.7, 1e-6]))
    found = radiosity(factors, 0.25, rho, rtol=1e-12)
    np.testing.assert_allclose(found.values, 0.25 / (1.0 - rho), rtol=1e-12)
    # Indirect light alone, of a sphere of which a part emits: what is reflected is the same everywhere.
    emitted = np.array([0.0, 1.0, 0.0, 0.0])
    found = radiosity(factors, emitted, rho, rtol=1e-12)
    mean = 2.0 / factors.areas.sum()
    np.testing.assert_allclose(found.values - emitted[:, None], mean * rho / (1.0 - rho), rtol=1e-9, atol=1e-12)


def test_two_discs_that_see_each_other_and_the_sky():
    # Equal discs whose distance is their radius: Howell, C-41.
    share = (3.0 - np.sqrt(5.0)) / 2.0
    area = np.pi
    factors = enclosures.factors([area, area], [[0, area * share], [area * share, 0]], [1.0 - share, 1.0 - share])
    emission, rho = np.array([1.0, 0.0]), np.array([0.5, 0.8])
    found = radiosity(factors, emission, rho, rtol=1e-12)
    first = 1.0 / (1.0 - rho[0] * rho[1] * share**2)
    np.testing.assert_allclose(found.values[:, 0], [first, rho[1] * share * first], rtol=1e-12)
    # Under a sky of radiosity 2, and without lamps.
    found = radiosity(factors, 0.0, rho, sky=2.0, rtol=1e-12)
    source = 2.0 * rho * (1.0 - share)
    first, second = ((source[k] + rho[k] * share * source[1 - k]) / (1.0 - rho[0] * rho[1] * share**2) for k in (0, 1))
    np.testing.assert_allclose(found.values[:, 1], [first, second], rtol=1e-12)
    arriving = 2.0 * (1.0 - share) + share * np.array([second, first])
    np.testing.assert_allclose(found.irradiance[:, 2], arriving, rtol=1e-12)


def test_a_lamp_in_the_ceiling_of_a_cube():
    """By the cube's symmetry three unknowns are left: lamp, the wall opposite, and the four beside."""
    rho, opposite, beside = 0.7, enclosures.OPPOSITE, enclosures.BESIDE
    system = np.eye(3) - rho * np.array(
        [[0, opposite, 4 * beside], [opposite, 0, 4 * beside], [beside, beside, 1 - 2 * beside]]
    )
    lamp, floor, wall = np.linalg.solve(system, [1.0, 0.0, 0.0])
    found = radiosity(enclosures.cube(), [1.0, 0, 0, 0, 0, 0], rho, rtol=1e-12)
    np.testing.assert_allclose(found.values[:, 0], [lamp, floor, wall, wall, wall, wall], rtol=1e-12)


@cases("rtol", [0.5, 1e-2, 1e-6, 1e-11])
@cases("n", [3, 20, 70])
@cases("is_open", [False, True])
def test_the_error_is_within_its_bound(n, rtol, is_open):
    factors, emission, rho, sky = drawn(n, n, is_open=is_open)
    emission[0] = 1.0
    exact = dense(factors, emission, rho, sky)
    found = radiosity(factors, emission, rho, sky=sky, rtol=rtol)
    assert np.abs(found.values - exact).max() <= found.bound <= rtol * found.values.max()
    residual = np.abs(emission + rho * found.irradiance - found.values).max()
    # As computed here, to rounding of numbers of about 1.
    assert abs(residual - found.residual) < 1e-14 * found.values.max()
    assert found.bound >= residual


def test_the_bound_holds_against_exact_arithmetic():
    """One surface that sees itself alone: B = E / (1 - rho). A residual may round to 0 beside an error that is not."""
    rng, residuals = np.random.default_rng(0), []
    for emission, rho in rng.uniform(0.1, 0.99, (100, 2)):
        found = radiosity(enclosures.sphere(np.ones(1)), emission, rho, rtol=1e-12)
        error = abs(Fraction(float(found.values[0, 0])) - Fraction(float(emission)) / (1 - Fraction(float(rho))))
        assert error <= Fraction(found.bound)
        residuals.append(found.residual if error else 1.0)
    assert min(residuals) == 0.0


def test_the_inverse_is_bounded_also_where_some_reflect_all():
    """As adiabatic surfaces do. The bound is of the largest row sum, and not much more."""
    for seed in range(40):
        factors, emission, rho, _ = drawn(seed, 12, is_open=seed % 2 == 0)
        rho = rho[:, :1]
        if seed % 4 < 2:
            rho[4:] = 1.0
        exchange = check_factors(factors)
        inverse = np.linalg.inv(np.eye(12) - rho * factors.exchange.toarray() / exchange.areas[:, None])
        exact = inverse.sum(axis=1).max()
        found = amplification_of(System(exchange, emission, rho))
        assert exact <= found * (1 + 1e-12)
        # In an open one it is by the least loss of a row.
        assert seed % 4 != 1 or found <= 2.1 * exact


def test_iterations_do_not_grow_with_the_surfaces():
    """Conjugate gradients gain a factor of (k - 1) / (k + 1) an iteration, for k = sqrt of the condition number."""
    for n in (30, 300):
        factors, emission, _, _ = drawn(n, n, is_open=False)
        root = np.sqrt(1.5 / 0.5)
        most = np.log(2e8) / np.log((root + 1.0) / (root - 1.0))
        assert radiosity(factors, emission, 0.5, rtol=1e-6).iterations <= most


@cases("is_open", [False, True])
def test_energy_is_balanced_up_to_the_residual(is_open):
    factors, emission, rho, sky = drawn(5, 40, is_open=is_open)
    found = radiosity(factors, emission, rho, sky=sky)
    balance, areas = found.balance, (factors.areas * (1.0 - factors.backs))[:, None]
    to_sky = (factors.areas * factors.sky)[:, None]
    entering = balance.emitted + balance.from_sky
    # A residual r leaves A r without a place; sums of 40 terms round.
    assert (np.abs(balance.error) <= areas.sum() * found.residual + 100 * 2.2e-16 * entering).all()
    np.testing.assert_allclose(balance.emitted, (areas * emission).sum(axis=0), rtol=1e-12)
    np.testing.assert_allclose(balance.absorbed, (areas * (1.0 - rho) * found.irradiance).sum(axis=0), rtol=1e-12)
    np.testing.assert_allclose(balance.to_sky, (to_sky * found.values).sum(axis=0), rtol=1e-12)
    np.testing.assert_allclose(balance.from_sky, to_sky.sum() * sky, rtol=1e-12)
    assert (balance.to_sky > 0).all() == is_open


def test_channels_are_solved_apart_and_numbers_stand_for_all():
    factors, emission, rho, sky = drawn(9, 15)
    whole = radiosity(factors, emission, rho, sky=sky, rtol=1e-12).values
    for channel in range(3):
        own = radiosity(factors, emission[:, channel], rho[:, channel], sky=sky[channel], rtol=1e-12).values
        assert own.shape == (15, 3) and (own == own[:, :1]).all()
        np.testing.assert_allclose(own[:, 0], whole[:, channel], rtol=1e-11, atol=1e-12)
    for grey in (0.5, np.full(15, 0.5)):
        mixed = radiosity(factors, emission, grey, rtol=1e-12).values
        np.testing.assert_allclose(mixed, dense(factors, emission, 0.5), rtol=1e-11, atol=1e-12)


def test_light_is_linear():
    """Lamps one by one add up, and channels may be brighter by any power of two."""
    factors, emission, rho, _ = drawn(11, 12)
    parts = [np.where(np.arange(12)[:, None] % 3 == k, emission, 0.0) for k in range(3)]
    total = sum(radiosity(factors, part, rho, rtol=1e-12).values for part in parts)
    whole = radiosity(factors, emission, rho, rtol=1e-12).values
    np.testing.assert_allclose(whole, total, rtol=1e-10, atol=1e-12)
    for power in (-200, 200):
        np.testing.assert_array_equal(
            radiosity(factors, emission * 2.0**power, rho, rtol=1e-12).values, whole * 2.0**power
        )


def test_areas_of_very_different_sizes():
    """Small surfaces count for little in the norm of conjugate gradients, and for as much in the bound."""
    areas = 10.0 ** np.array([-12.0, -6.0, 0.0, 2.0])
    factors = enclosures.sphere(areas)
    found = radiosity(factors, [1.0, 0.0, 0.0, 0.0], 0.9, rtol=1e-9)
    mean = areas[0] / areas.sum()
    np.testing.assert_allclose(found.values[:, 0], [1.0 + 9.0 * mean, *(9.0 * mean,) * 3], atol=found.bound)


def test_iterations_are_counted_and_limited_over_all_tries(monkeypatch):
    """With much light to and fro the bound needs more than the first try of conjugate gradients."""
    factors, emission, _, _ = drawn(8, 30, is_open=False)
    tries, iterate = [], system._iterate

    def noted(*arguments):
        tries.append(iterate(*arguments))
        return tries[-1]

    monkeypatch.setattr(system, "_iterate", noted)
    whole = radiosity(factors, emission, 0.99999, rtol=1e-6)
    used = [count for _, count in tries]
    assert len(used) > 1 and used[-1] > 1 and whole.iterations == sum(used)
    for most in range(1, sum(used) + 1):
        try:
            found = radiosity(factors, emission, 0.99999, rtol=1e-6, max_iterations=most)
        except ValueError as error:
            assert re.fullmatch(f"max_iterations: expected more iterations, .*, got {most}", str(error))
            assert most < sum(used)
        else:
            assert used[0] < found.iterations <= most
    np.testing.assert_array_equal(found.values, whole.values)


def test_no_surface_sends_less_than_it_emits(monkeypatch):
    """However far from the solution conjugate gradients end; the bound knows how far."""
    factors, emission, rho, _ = drawn(6, 20)
    iterate = system._iterate

    def below(*arguments):
        z, count = iterate(*arguments)
        return z - 1e-3, count

    monkeypatch.setattr(system, "_iterate", below)
    found = radiosity(factors, emission, rho, rtol=0.5)
    assert (found.values >= emission).all()
    assert 0.0 < np.abs(found.values - dense(factors, emission, rho)).max() <= found.bound


def test_the_exchange_may_be_an_operator():
    factors, emission, rho, sky = drawn(3, 25)
    free = replace(factors, exchange=aslinearoperator(factors.exchange))
    found = radiosity(free, emission, rho, sky=sky, rtol=1e-10)
    assert np.abs(found.values - dense(factors, emission, rho, sky)).max() <= found.bound


def test_no_light_is_no_error():
    found = radiosity(enclosures.cube(), 0.0, 0.5)
    assert not found.values.any() and found.bound == 0.0 and found.iterations == 0


CUBE = enclosures.cube()
SHAPE = "expected one number, shape (6,) or (6, 3), a row a surface, got shape"


def cube(**changes):
    return {"factors": replace(CUBE, **changes)}


@cases(
    ("arguments", "message"),
    [
        ({"factors": 3}, "factors: expected ViewFactors, as renderer.studies.view_factors returns, got int"),
        ({"reflectance": 1.0}, "reflectance: expected numbers less than 1, got [1.0] in row 0"),
        ({"reflectance": [0, 0, 0.5, 1.25, 0, 2]}, "reflectance: expected numbers less than 1, got [1.25] in row 3"),
        ({"reflectance": -0.5}, "reflectance: expected finite numbers >= 0, got [-0.5] in row 0"),
        ({"reflectance": np.full((6, 3), np.nan)}, "reflectance: expected finite numbers >= 0, got [nan, nan, nan] in"),
        ({"reflectance": [0.5] * 5}, f"reflectance: {SHAPE} (5,)"),
        ({"emission": np.zeros((3, 6))}, f"emission: {SHAPE} (3, 6)"),
        ({"emission": [0, 0, 0, 0, 0, -1]}, "emission: expected finite numbers >= 0, got [-1.0] in row 5"),
        ({"emission": np.inf}, "emission: expected finite numbers >= 0, got [inf] in row 0"),
        ({"emission": "bright"}, "emission: expected real numbers, got dtype <U6"),
        ({"sky": [1, 2]}, "sky: expected a finite number >= 0, three of them, or None, got [1, 2]"),
        ({"sky": -1}, "sky: expected a finite number >= 0, three of them, or None, got -1"),
        ({"rtol": 0}, "rtol: expected a number between 0 and 1, got 0"),
        ({"rtol": 1e-18}, "rtol: expected at least "),
        ({"max_iterations": 0}, "max_iterations: expected an integer >= 1, got 0"),
        ({"emission": np.arange(6), "max_iterations": 1}, "max_iterations: expected more iterations, as these leave a"),
        (
            cube(areas=np.array([1, 1, 0, 1, 1, 1.0])),
            "factors: expected areas that are finite and > 0, got 0.0 in row 2",
        ),
        (cube(sky=np.full(6, -1.0)), "factors: expected shares of sky >= 0, got -1.0 in row 0"),
        (cube(exchange=csr_array(-np.eye(6))), "factors: expected exchanges >= 0, finite, got -1.0"),
        (cube(exchange=csr_array(np.eye(5))), "factors: expected an exchange of shape (6, 6), got shape (5, 5)"),
        (cube(exchange=CUBE.exchange * 3.0), "factors: expected rows whose sum is at most 1, got 3"),
    ],
)
def test_bad_input_is_named(arguments, message):
    given = {"factors": CUBE, "emission": 1.0, "reflectance": 0.5} | arguments
    with pytest.raises(ValueError) as caught:
        radiosity(**given)
    assert str(caught.value).startswith(message)


@cases("size", [1e-165, 1e-300, 1e200])
def test_sources_of_any_size_are_solved(size):
    """Squares of such numbers are 0 or infinite."""
    factors, emission, rho, _ = drawn(3, 10)
    found = radiosity(factors, size * emission, rho)
    np.testing.assert_allclose(found.values / size, radiosity(factors, emission, rho).values, rtol=1e-5)

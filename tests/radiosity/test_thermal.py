"""Radiative heat against closed forms of enclosures of two and three surfaces, and its laws."""

import enclosures
import numpy as np
import pytest
from cases import cases

from renderer import Mesh, Octree
from renderer.mesh.shapes import box
from renderer.radiosity import net_heat
from renderer.studies import view_factors

pytestmark = pytest.mark.judges("radiosity.net_heat", "radiosity.Heat")

# 2 pi^5 k^4 / (15 h^3 c^2), by the exact constants of the SI.
SIGMA = 2 * np.pi**5 * 1.380649e-23**4 / (15 * 6.62607015e-34**3 * 299792458.0**2)


@cases(("first", "second"), [(1.0, 1.0), (0.8, 0.3), (0.05, 0.9)])
@cases(("inner", "outer"), [(1.0, 1.5), (0.01, 4.0), (2.0, 2.0001)])
def test_two_concentric_spheres(inner, outer, first, second):
    """Howell, Menguc, Daun, Siegel 2020, chapter 5: resistances of surfaces and of space in a row."""
    heat = net_heat(enclosures.spheres(inner, outer), [first, second], [400.0, 300.0])
    resistance = (1 - first) / (inner * first) + 1 / inner + (1 - second) / (outer * second)
    flow = SIGMA * (400.0**4 - 300.0**4) / resistance
    np.testing.assert_allclose(heat.net, [flow, -flow], rtol=1e-7)
    np.testing.assert_allclose(heat.flux, [flow / inner, -flow / outer], rtol=1e-7)


def triangle():
    """Long walls with sides 3, 4, 5 across: F_12 = (L_1 + L_2 - L_3) / (2 L_1), per metre of length."""
    sides = np.array([3.0, 4.0, 5.0])
    exchange = [[0 if i == j else (2 * sides[i] + 2 * sides[j] - sides.sum()) / 2 for j in range(3)] for i in range(3)]
    return enclosures.factors(sides, exchange)


@cases("emissivity", [[0.9, 0.2, 0.5], [0.3, 1.0, 0.7]])
def test_three_walls_as_a_network_of_resistances(emissivity):
    """Kirchhoff's law at the three nodes, whose currents are the heats."""
    factors, degrees = triangle(), np.array([900.0, 500.0, 300.0])
    emissivity = np.array(emissivity)
    black = SIGMA * degrees**4
    exchange = factors.exchange.toarray()
    # J = black - q (1 - e) / (A e), and q_i = sum of S_ij (J_i - J_j).
    laplace = np.diag(exchange.sum(axis=1)) - exchange
    surface = np.diag((1 - emissivity) / (factors.areas * emissivity))
    net = np.linalg.solve(np.eye(3) + laplace @ surface, laplace @ black)
    heat = net_heat(factors, emissivity, degrees)
    np.testing.assert_allclose(heat.net, net, rtol=1e-7)
    np.testing.assert_allclose(heat.radiosity, black - surface @ net, rtol=1e-7)
    assert abs(heat.net.sum()) < 1e-7 * np.abs(heat.net).max()
    np.testing.assert_allclose(heat.net, factors.areas * (heat.radiosity - heat.irradiance), rtol=1e-6)


@cases(("first", "second"), [(1.0, 1.0), (0.7, 0.4)])
def test_a_wall_without_heat_between_two(first, second):
    """Of which the network is 1 / (S_12 + 1 / (1 / S_13 + 1 / S_23)) between two surfaces."""
    factors = triangle()
    s = factors.exchange.toarray()
    between = 1 / (s[0, 1] + 1 / (1 / s[0, 2] + 1 / s[1, 2]))
    whole = (1 - first) / (3.0 * first) + between + (1 - second) / (4.0 * second)
    flow = SIGMA * (700.0**4 - 350.0**4) / whole
    # The third emissivity does not matter, and none is needed.
    for third in (0.5, np.nan, 0.0):
        heat = net_heat(factors, [first, second, third], [700.0, 350.0, np.nan])
        np.testing.assert_allclose(heat.net, [flow, -flow, 0.0], rtol=1e-7, atol=1e-12)
        assert heat.net[2] == 0.0
        warm = SIGMA * 700.0**4 - flow * (1 - first) / (3.0 * first)
        cold = SIGMA * 350.0**4 + flow * (1 - second) / (4.0 * second)
        mean = (s[0, 2] * warm + s[1, 2] * cold) / (s[0, 2] + s[1, 2])
        np.testing.assert_allclose(heat.temperature, [700.0, 350.0, (mean / SIGMA) ** 0.25], rtol=1e-8)
        np.testing.assert_allclose(heat.radiosity[2], mean, rtol=1e-7)


def test_black_surfaces_exchange_by_view_factors_alone():
    factors = enclosures.cube()
    degrees = np.array([300.0, 310.0, 320.0, 280.0, 273.15, 0.0])
    power = SIGMA * degrees**4
    expected = power - factors.exchange.toarray() @ power
    np.testing.assert_allclose(net_heat(factors, 1.0, degrees).net, expected, rtol=1e-9, atol=1e-9)


@cases("n", [2, 9, 80])
def test_laws_of_closed_rooms(n):
    rng = np.random.default_rng(n)
    factors = enclosures.enclosure(rng, n)
    emissivity, degrees = rng.uniform(0.05, 1.0, n), rng.uniform(250, 350, n)
    heat = net_heat(factors, emissivity, degrees)
    # No heat is made, and the warmest loses, the coldest gains.
    assert abs(heat.net.sum()) <= factors.areas.sum() * heat.bound
    assert heat.net[degrees.argmax()] > 0 > heat.net[degrees.argmin()] and heat.to_sky == 0.0
    # Where all have one temperature nothing flows.
    still = net_heat(factors, emissivity, 300.0)
    assert np.abs(still.flux).max() <= still.bound
    np.testing.assert_allclose(still.radiosity, SIGMA * 300.0**4, atol=still.bound + 1e-6)
    # Surfaces without heat have a temperature between those of the others.
    free = rng.random(n) < 0.5
    free[:2] = False, True
    mixed = net_heat(factors, emissivity, np.where(free, np.nan, degrees))
    assert (mixed.net[free] == 0.0).all() and abs(mixed.net.sum()) <= factors.areas.sum() * mixed.bound
    between = mixed.temperature[free]
    given = degrees[~free]
    assert given.min() - 1e-6 <= between.min() and between.max() <= given.max() + 1e-6
    # And with that temperature given they are the same, whatever their emissivity.
    again = net_heat(factors, emissivity, mixed.temperature)
    np.testing.assert_allclose(again.net, mixed.net, atol=1e-5 * np.abs(mixed.net).max() + 1e-9)


def test_a_roof_under_the_sky():
    factors = enclosures.factors([10.0], [[0.0]], [1.0])
    heat = net_heat(factors, 0.9, 293.15, sky_temperature=263.15)
    np.testing.assert_allclose(heat.net, 9.0 * SIGMA * (293.15**4 - 263.15**4), rtol=1e-8)
    np.testing.assert_allclose(heat.to_sky, heat.net[0], rtol=1e-8)
    np.testing.assert_allclose(net_heat(factors, 0.9, 293.15).net, 9.0 * SIGMA * 293.15**4, rtol=1e-8)
    # Without heat it has the sky's temperature.
    np.testing.assert_allclose(net_heat(factors, 0.9, np.nan, sky_temperature=263.15).temperature, 263.15, rtol=1e-9)


def test_what_surfaces_lose_goes_to_the_sky():
    rng = np.random.default_rng(4)
    factors = enclosures.enclosure(rng, 30, is_open=True, has_backs=False)
    heat = net_heat(factors, rng.uniform(0.1, 1, 30), rng.uniform(250, 350, 30), sky_temperature=280.0)
    assert abs(heat.net.sum() - heat.to_sky) <= factors.areas.sum() * heat.bound


KELVIN = "temperature: expected numbers from 0 to 1e+20 in kelvin, or NaN for adiabatic surfaces, got"
ALONE = "temperature: expected one for a surface that each adiabatic one sees, got none for that of row"


@cases(
    ("arguments", "message"),
    [
        ({"emissivity": 0.0}, "emissivity: expected numbers > 0 and at most 1, got 0.0 in row 0"),
        ({"emissivity": [1, 1, 1, 1.5, 1, 1]}, "emissivity: expected numbers > 0 and at most 1, got 1.5 in row 3"),
        ({"emissivity": [np.nan] * 6}, "emissivity: expected numbers > 0 and at most 1, got nan in row 0"),
        ({"emissivity": [0.5, 0.5]}, "emissivity: expected one number or shape (6,), one a surface, got shape (2,)"),
        ({"temperature": -1.0}, f"{KELVIN} -1.0 in row 0"),
        ({"temperature": np.inf}, f"{KELVIN} inf in row 0"),
        ({"temperature": np.nan}, f"{ALONE} 0"),
        ({"sky_temperature": -3}, "sky_temperature: expected a number from 0 to 1e+20 in kelvin, or None, got -3"),
        ({"rtol": 2}, "rtol: expected a number between 0 and 1, got 2"),
        ({"max_iterations": 1.5}, "max_iterations: expected an integer >= 1, got 1.5"),
        ({"factors": None}, "factors: expected ViewFactors, as renderer.studies.view_factors returns, got NoneType"),
    ],
)
def test_bad_input_is_named(arguments, message):
    given = {"factors": enclosures.cube(), "emissivity": 0.9, "temperature": [300.0] * 6} | arguments
    with pytest.raises(ValueError) as caught:
        net_heat(**given)
    assert str(caught.value).startswith(message)


def test_adiabatic_rooms_apart_from_the_others_are_named():
    blocks = np.kron(np.eye(2), [[0.0, 1.0], [1.0, 0.0]])
    with pytest.raises(ValueError, match=r"got none for that of row 2$"):
        net_heat(enclosures.factors(np.ones(4), blocks), 0.5, [300.0, np.nan, np.nan, np.nan])


@cases("has_bottom", [False, True])
def test_what_stands_on_a_floor_covers_it(has_bottom):
    """A box on the floor of a room: heat is that of the floor that is seen, and adds up to 0."""
    room, thing = box((0, 0, 0), (4, 3, 2)), box((1, 1, 0), (2, 2, 1))
    sides = thing.faces[thing.face_normals()[:, 2] > (-2.0 if has_bottom else -0.5)]
    octree = Octree.from_mesh(Mesh.concatenate(Mesh(room.vertices, room.faces[:, ::-1]), Mesh(thing.vertices, sides)))
    with pytest.warns(UserWarning, match="see backs of faces"):
        found = view_factors(octree, np.repeat(np.arange(7), [2] * 6 + [len(sides)]), rtol=0.005)
    assert found.backs[4] == pytest.approx(1 / 12, abs=0.005)
    heat = net_heat(found, 0.8, [293, 293, 293, 293, 303, 291, 300])
    assert abs(heat.net.sum()) < 1e-6 * np.abs(heat.net).max()
    seen = found.areas[4] * (1.0 - found.backs[4])
    assert heat.net[4] == pytest.approx(seen * heat.flux[4])

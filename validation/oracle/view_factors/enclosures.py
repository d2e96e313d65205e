"""Heat in enclosures of few surfaces (Howell and others, Thermal Radiation Heat Transfer, 2020, chapter 5)."""

Pair = tuple[float, ...]
# Of Stefan and Boltzmann, W / (m^2 K^4), CODATA 2018.
_SIGMA = 5.670374419e-8


def heat_of_two(areas: Pair, emissivities: Pair, kelvin: Pair) -> float:
    """The power, W, that the first surface loses to the second if it sees nothing else: a sum of three resistances."""
    (a, b), (e, f) = areas, emissivities
    resistance = (1.0 - e) / (a * e) + 1.0 / a + (1.0 - f) / (b * f)
    return _SIGMA * (kelvin[0] ** 4 - kelvin[1] ** 4) / resistance

"""View factors without rays: closed forms, and random ones that obey the laws."""

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy.sparse import csr_array

from renderer.studies import ViewFactors

Floats = NDArray[np.float64]

# Of two squares of side 1 at distance 1: Howell, C-11.
OPPOSITE = 0.19982489569838746
BESIDE = (1.0 - OPPOSITE) / 4.0


def factors(areas: Floats, exchange: Floats, sky: Floats | None = None, backs: Floats | None = None) -> ViewFactors:
    n = len(areas)
    rays, errors = np.zeros(n, np.int64), csr_array((n, n))
    sky, backs = (np.zeros(n) if share is None else np.asarray(share, float) for share in (sky, backs))
    return ViewFactors(np.asarray(areas, float), csr_array(np.asarray(exchange, float)), sky, backs, errors, rays)


def cube() -> ViewFactors:
    """The six walls of a cube of side 1; 0 and 1, 2 and 3, 4 and 5 are opposite."""
    exchange = np.full((6, 6), BESIDE) - np.diag(np.full(6, BESIDE))
    for wall in range(6):
        exchange[wall, wall ^ 1] = OPPOSITE
    return factors(np.ones(6), exchange)


def sphere(areas: Floats) -> ViewFactors:
    """Parts of a sphere, seen from within: each sees all parts by their areas, itself too."""
    return factors(areas, np.outer(areas, areas) / areas.sum())


def spheres(inner: float, outer: float) -> ViewFactors:
    """A sphere within another, of these areas."""
    return factors(np.array([inner, outer]), np.array([[0.0, inner], [inner, outer - inner]]))


def enclosure(rng: Generator, n: int, is_open: bool = False, has_backs: bool = True) -> ViewFactors:
    """Random exchanges of n surfaces of very different areas; closed, or with a sky and perhaps backs."""
    size = 10.0 ** rng.uniform(-3, 1, n)
    exchange = rng.random((n, n)) * (rng.random((n, n)) < 0.5) * np.outer(size, size)
    exchange = exchange + exchange.T
    np.fill_diagonal(exchange, 0.0)
    # A ring, so that all are connected.
    ring = np.arange(n), np.roll(np.arange(n), 1)
    exchange[ring] = exchange[ring[::-1]] = np.sqrt(size[ring[0]] * size[ring[1]])
    sums = exchange.sum(axis=1)
    outside = rng.random((2, n)) * sums * np.array([[is_open], [is_open and has_backs]])
    areas = sums + outside.sum(axis=0)
    return factors(areas, exchange, *(outside / areas))

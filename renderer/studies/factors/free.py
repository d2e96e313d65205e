"""An exchange that is not written down: for so many surfaces that only the hits of their rays find room."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from renderer.arguments.arrays import real_argument
from renderer.errors import expect
from renderer.jit.decorators import kernel
from renderer.studies.factors.aim import REPLICATES
from renderer.studies.factors.result import ViewFactors
from renderer.studies.factors.rows import ROWS, Tracing, keys_of, order_of
from renderer.studies.factors.tally import BACK, SKY
from renderer.system.terminal import progress_bar
from renderer.system.threads import for_chunks

Floats = NDArray[np.float64]
# Rows are balanced to this share of their area: beyond, the noise of rays is larger by far.
_BALANCED, _STEPS = 1e-9, 200
# Surfaces and what is beyond them have numbers of int32.
_MOST = (1 << 31) - 3


class RayExchange:
    """A_i F_ij of n surfaces as an operator, by the surfaces that rays hit: 4 bytes a ray.

    Attributes
    ----------
    targets : ndarray of int32, shape (n, rays)
        The surface that each ray ends on, n for the sky and n + 1 for backs.
    density : ndarray of float64, shape (n,)
        Rays for each unit of area.
    levels : ndarray of float64, shape (n,)
        By what rows and columns are multiplied, so that rows have the sums of the areas.
    """

    def __init__(self, targets: NDArray[np.int32], areas: Floats) -> None:
        self.targets, self.density, self.levels = targets, targets.shape[1] / areas, np.ones(len(areas))
        self.shape = len(areas), len(areas)

    def __matmul__(self, x: Floats) -> Floats:
        """The product with values (n,) or (n, c). Raises ``ValueError`` for another shape."""
        x = real_argument("x", x)
        n = len(self.levels)
        expect(x.ndim in (1, 2) and len(x) == n, "x", f"shape ({n},) or ({n}, c)", f"shape {x.shape}")
        columns = np.ascontiguousarray(x, np.float64).reshape(n, -1)
        product = np.zeros(columns.shape)
        multiply(self.targets, self.density, columns * self.levels[:, None], product)
        return (product * self.levels[:, None]).reshape(x.shape)


@kernel
def multiply(targets, density, values, product):
    """Add the product of the exchange with values (n, c) to ``product``, by one thread in the order of rays."""
    rows, count = targets.shape
    for row in range(rows):
        for k in range(count):
            target = targets[row, k]
            if target < rows:
                weight = 1.0 / (density[row] + density[target])
                for c in range(values.shape[1]):
                    product[row, c] += weight * values[target, c]
                    product[target, c] += weight * values[row, c]


def without_matrix(tracing: Tracing) -> ViewFactors:
    """View factors by ``max_rays`` rays of each surface, with a ``RayExchange``."""
    areas, number = tracing.surfaces.areas, tracing.surfaces.number
    expect(number <= _MOST, "octree", f"at most {_MOST} surfaces", f"{number}")
    targets = _targets_of(tracing)
    exchange, rays = RayExchange(targets, areas), tracing.max_rays
    sky, backs = (areas * ((targets == number + beyond).sum(axis=1) / rays) for beyond in (SKY, BACK))
    for _ in range(_STEPS):
        sums = exchange @ np.ones(number) + exchange.levels * (sky + backs)
        if (np.abs(areas - sums) <= _BALANCED * areas).all():
            break
        # rule: balance-of-rays
        exchange.levels *= np.sqrt(areas / sums)
    share = exchange.levels / areas
    return ViewFactors(areas, exchange, sky * share, backs * share, None, np.full(number, rays))


def _targets_of(tracing: Tracing) -> NDArray[np.int32]:
    """The targets that the rays of all surfaces hit, (n, max_rays)."""
    number, senders = tracing.surfaces.number, tracing.senders
    targets = np.empty((number, tracing.max_rays), np.int32)
    order = order_of(senders, np.arange(number))
    with progress_bar(number, "surface", tracing.progress) as update:

        def trace(begin: int, end: int) -> Iterator[None]:
            rows = order[begin:end]
            keys = yield from keys_of(tracing, rows, 0, tracing.max_rays)
            targets[rows] = keys // REPLICATES

        for_chunks(trace, number, ROWS, tracing.threads, update)
    return targets

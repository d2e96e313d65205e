"""One ray has the same bits alone and in any batch: the choices that a ray makes for itself are not its neighbours'."""

from itertools import permutations, product
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.mesh.shapes import icosphere
from renderer.octree import Octree
from validation.promises.row import row

_RAYS = 16
# How much less the components that are not equal are: by as much as rays of one packet may differ, and by an ulp.
_LESS = (2.0**-9, 2.0**-40, 2.0**-53)


def check_alone(rng: Generator) -> list[dict[str, Any]]:
    """Sixteen rays alike at a small ball far away: most have two or three equal components, some nearly so."""
    ball, kept = icosphere(3), []
    cases = product(permutations(range(3)), (0.0, 0.3, 1.0), (1.0, -1.0), _LESS, range(3))
    for order, third, sign, less, first in cases:
        towards = np.array([1.0, sign, third])[list(order)]
        octree = Octree(0.02 * ball.vertices + 30.0 * towards, ball.faces)
        directions = np.tile(towards, (_RAYS, 1))
        directions[0, first] *= 1.0 - less  # the first ray's largest component is the packet's axis
        other = rng.integers(1, _RAYS, rng.integers(0, 4))
        directions[other, rng.integers(0, 3, len(other))] *= 1.0 - less
        origins = 0.005 * rng.normal(size=(_RAYS, 3))
        together, hidden = octree.closest_hit(origins, directions), octree.any_hit(origins, directions)
        for k in range(_RAYS):
            alone = octree.closest_hit(origins[k], directions[k])
            same = [_equal(getattr(alone, name), getattr(together, name)[k]) for name in ("t", "face", "u", "v")]
            kept.append(all(same) and hidden[k] == alone.hit)
    return [row("a ray gives the same bits in any batch", "single ray", np.array(kept))]


def _equal(one: NDArray[Any], other: NDArray[Any]) -> bool:
    """Whether two numbers are the same to the last bit, or both are no number."""
    return bool(np.array_equal(one, other, equal_nan=True))

"""Each argument of rays on dask arrays: the answers are those of the tree with that argument."""

from inspect import signature
from typing import Any

import dask.array as da
import numpy as np
import pytest

from renderer import Octree
from renderer.cluster import any_hit, closest_hit
from renderer.mesh.shapes import icosphere

# In lengths of the directions, which lead from outside a ball to near its middle.
RANGES = {"t_min": 0.7, "t_max": 0.7}


@pytest.mark.parametrize("name", RANGES)
def test_a_ray_sees_from_where_and_as_far_as_it_is_told(name: str) -> None:
    octree, rng = Octree.from_mesh(icosphere(1)), np.random.default_rng(4)
    origins = rng.normal((0.0, 0.0, 2.5), size=(60, 3))
    directions = 0.5 * rng.normal(size=(60, 3)) - origins
    lazy: Any = da.from_array(origins, 25), da.from_array(directions, 25)
    given = {name: RANGES[name]}
    expected, usual = octree.closest_hit(origins, directions, **given), octree.closest_hit(origins, directions)
    found = closest_hit(octree, *lazy, **given).compute(scheduler="synchronous")
    for field in ("t", "face", "u", "v"):
        assert np.ascontiguousarray(found[field]).tobytes() == getattr(expected, field).tobytes()
    assert (any_hit(octree, *lazy, **given).compute(scheduler="synchronous") == expected.hit).all()
    assert (expected.t != usual.t).any() and (expected.hit != usual.hit).any()


@pytest.mark.parametrize("of", [closest_hit, any_hit])
def test_every_argument_is_varied(of: Any) -> None:
    assert signature(of).parameters.keys() - {"octree", "origins", "directions"} == RANGES.keys()

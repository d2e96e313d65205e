"""Rays in dask arrays with every argument, in chunks of any size, against a slow twin in plain NumPy."""

import inspect
from typing import Any

import dask.array as da
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from twins import CORNERS, FACES, MESH, meetings

from renderer import Octree
from renderer.cluster import any_hit, closest_hit

OCTREE = Octree.from_mesh(MESH)
CHUNKS = st.integers(1, 31)
ENDS = [0.0, 0.25, 1.0, 4.0]


@given(st.integers(0, 2**20), CHUNKS, CHUNKS, st.integers(1, 3), st.sampled_from(["f8", "f4", ">f8"]),
       st.sampled_from([None, *ENDS]), st.sampled_from([None, *ENDS, np.inf]))  # fmt: skip
@settings(max_examples=25)
def test_hits_are_those_of_the_slow_twin(
    seed: int, rows: int, others: int, columns: int, kind: str, t_min: float | None, t_max: float | None
) -> None:
    """Numbers are small multiples of powers of two, so t is exact and the ends of the interval are met."""
    rng, options = np.random.default_rng(seed), {}
    directions = rng.choice([-2.0, -0.5, 0.5, 1.0], (30, 3))
    weights = rng.multinomial(4, [1 / 3] * 3, 30) / 4.0
    targets = (CORNERS[rng.integers(0, FACES, 30)] * weights[:, :, None]).sum(axis=1)
    origins = targets - directions * rng.choice([0.25, 1.0, 4.0], (30, 1))
    options |= {} if t_min is None else {"t_min": t_min}
    options |= {} if t_max is None else {"t_max": t_max}
    t = meetings(CORNERS, origins, directions)
    t[~((t >= options.get("t_min", 0.0)) & (t <= options.get("t_max", np.inf)))] = np.inf
    o, d = da.from_array(origins.astype(kind), (rows, columns)), da.from_array(directions.astype(kind), (others, 3))
    hits: Any = closest_hit(OCTREE, o, d, **options)
    assert hits.chunks[0] == o.chunks[0] and hits.shape == (30,)
    found, nearest = hits.compute(scheduler="synchronous"), t.min(axis=1)
    face = np.where(np.isfinite(nearest), t.argmin(axis=1), -1)
    np.testing.assert_array_equal(found["t"], nearest)
    np.testing.assert_array_equal(found["face"], face)
    met = face >= 0
    assert (np.isnan(found["u"]) == ~met).all() and (np.isnan(found["v"]) == ~met).all()
    u, v = found["u"][met, None], found["v"][met, None]
    a, b, c = (CORNERS[face[met], k] for k in range(3))
    np.testing.assert_array_equal(a * (1 - u - v) + b * u + c * v, (origins + directions * nearest[:, None])[met])
    assert (any_hit(OCTREE, o, d, **options).compute(scheduler="synchronous") == met).all()


def test_no_argument_of_rays_in_dask_arrays_is_missing_here() -> None:
    for query in (closest_hit, any_hit):
        assert inspect.signature(query).parameters.keys() == {"octree", "origins", "directions", "t_min", "t_max"}

"""Memory of large answers is written again only when nobody holds any part of the answer."""

import gc
import pickle
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from renderer import Octree
from renderer.mesh.shapes import icosphere
from renderer.system import spare

COUNT = 1 << 16
FLOAT, INT = np.dtype(np.float64), np.dtype(np.int64)
HOLDERS = {
    "an array": lambda arrays: arrays[0],
    "a view": lambda arrays: arrays[0][5:],
    "the last of them": lambda arrays: arrays[-1],
    "a memoryview": lambda arrays: memoryview(arrays[1]),
    "what NumPy makes of a memoryview": lambda arrays: np.asarray(memoryview(arrays[1]))[::2],
    "other bits": lambda arrays: arrays[0].view(np.int64),
    "DLPack": lambda arrays: np.from_dlpack(arrays[0]),
    "a list of arrays": lambda arrays: [arrays[0]],
}


@pytest.fixture(autouse=True)
def nothing_kept(monkeypatch):
    monkeypatch.setattr(spare, "_kept", [])


def take(count=COUNT):
    return spare.empty_arrays(count, (FLOAT, INT))


def addresses(arrays):
    return [array.ctypes.data for array in arrays]


def test_memory_that_nobody_holds_is_given_out_again():
    arrays = take()
    first = addresses(arrays)
    del arrays
    assert addresses(take()) == first


@pytest.mark.parametrize("name", HOLDERS)
def test_memory_of_which_a_part_is_held_is_not(name):
    arrays = take()
    first, held = addresses(arrays), HOLDERS[name](arrays)
    del arrays
    gc.collect()
    others = take()
    assert not set(addresses(others)) & set(first)
    del held
    again = take()
    assert addresses(again) == first


def test_other_sizes_and_types_have_memory_of_their_own():
    first = addresses(take())
    assert not set(addresses(take(COUNT + 1))) & set(first)
    assert [array.dtype for array in spare.empty_arrays(COUNT, (INT, FLOAT))] == [INT, FLOAT]


def test_no_more_than_the_most_is_kept():
    held = [take(k * COUNT) for k in range(1, 17)]
    kept = sum(array.nbytes for answer in spare._kept for array in answer)
    assert len(held) > len(spare._kept) > 1 and kept <= spare._MOST
    take(spare._MOST)
    assert sum(array.nbytes for answer in spare._kept for array in answer) == kept


def test_threads_never_share_memory():
    def work(number):
        for _ in range(50):
            arrays = take()
            for array in arrays:
                array[:] = number
            if any((array != number).any() for array in arrays):
                return False
        return True

    with ThreadPoolExecutor(6) as pool:
        assert all(pool.map(work, range(6)))


def test_hits_keep_their_values_while_other_rays_are_traced():
    octree, rng = Octree.from_mesh(icosphere(2)), np.random.default_rng(0)
    origins = rng.normal(size=(40_000, 3)) * 3
    hits, t = octree.closest_hit(origins, -origins), octree.closest_hit(2.0 * origins, -origins).t
    before = pickle.dumps((hits.t, hits.face, hits.u, hits.v, hits.side, t))
    for scale in (3.0, 4.0, 5.0):
        octree.closest_hit(scale * origins, -origins)
    assert pickle.dumps((hits.t, hits.face, hits.u, hits.v, hits.side, t)) == before

"""Memory that answers use again: never while anybody holds it, and no more of it than is said."""

import pickle
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from cases import cases

from renderer import Octree
from renderer.mesh.shapes import icosphere
from renderer.system import spare
from renderer.system.spare import MOST, recycled

pytestmark = pytest.mark.judges("Octree.closest_hit", "Octree.any_hit")

LARGE = 1 << 20


@pytest.fixture(autouse=True)
def _nothing_kept():
    spare._blocks.clear()


def address(array):
    return array.ctypes.data


def test_what_nobody_holds_is_used_again():
    first = address(recycled(LARGE))
    assert address(recycled(LARGE)) == first


@cases(
    "hold",
    [
        lambda a: a, lambda a: a[5:], lambda a: a.reshape(2, -1)[1], lambda a: a.view(np.int64), memoryview,
        lambda a: a.T[::-1], np.asarray, lambda a: a.data, np.from_dlpack,
    ],
)  # fmt: skip
def test_what_somebody_holds_is_left_alone(hold):
    array = recycled(LARGE)
    array[:] = 1.0
    first, held = address(array), hold(array)
    del array
    others = [recycled(LARGE) for _ in range(3)]
    assert first not in map(address, others)
    del held
    others += [recycled(LARGE)]
    assert first in map(address, others)


def frozen(block):
    block.flags.writeable = False


def folded(block):
    block.shape = (2, -1)


def renamed(block):
    block.dtype = np.float64


@cases("change", [frozen, folded, renamed])
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_memory_that_somebody_changed_is_not_used_again(change):
    spare._blocks.clear()
    change(recycled(LARGE).base)
    array = recycled(LARGE - 1)
    assert array.flags.writeable and array.shape == (LARGE - 1,)


def test_an_array_holds_no_more_than_twice_its_memory():
    recycled(LARGE)
    assert recycled(LARGE // 2 + 1).base.nbytes == 8 * LARGE
    spare._blocks.clear()
    recycled(LARGE)
    assert recycled(LARGE // 2 - 1).base.nbytes == 8 * (LARGE // 2 - 1)


def test_no_more_is_kept_than_is_said():
    for size in range(LARGE, 2 * LARGE, LARGE // 8):
        held = [recycled(size) for _ in range(3)]
        assert sum(block.nbytes for block in spare._blocks) <= MOST
        del held
    assert recycled(MOST).base is None


def test_threads_share_no_memory():
    def own(seed):
        rng = np.random.default_rng(seed)
        held = []
        for k in range(200):
            array = recycled(int(rng.integers(1 << 14, 1 << 16)), np.int64)
            array[:] = mark = 1000 * seed + k
            held.append((array, mark))
            if len(held) > 3:
                held.pop(int(rng.integers(3)))
            if not all((values == value).all() for values, value in held):
                return False
        return True

    with ThreadPoolExecutor(8) as pool:
        assert all(pool.map(own, range(16)))


def test_answers_that_are_held_stay_as_they_are():
    octree, rng = Octree(icosphere(3), threads=2), np.random.default_rng(0)
    rays = [(rng.normal(size=(30_000, 3)), rng.normal(size=(30_000, 3))) for _ in range(3)]

    def answers(o, d):
        hits = octree.closest_hit(o, d, t_error=True)
        again = octree.closest_hit(hits.points[hits.hit], d[hits.hit], leaving=hits.face[hits.hit])
        return [hits.t, hits.u, hits.v, hits.face, hits.side, hits.t_error, octree.any_hit(o, d),
                again.t, again.face, again.side]  # fmt: skip

    held = [answers(*some) for some in rays]
    kept = [[pickle.dumps(array) for array in some] for some in held]
    for some in rays:
        answers(*some)
    assert [[pickle.dumps(array) for array in some] for some in held] == kept

"""Long work is cut where Ctrl-C is heard: a kernel returns after an amount of work, not after a number of rays."""

from types import ModuleType

import numpy as np
import pytest
from cases import cases

from renderer import BruteForce, Octree
from renderer.all_hits import all_hits
from renderer.inside import winding
from renderer.trace import closest as query
from renderer.trace import steps


def hair(count):
    """Slivers along the diagonal of the unit cube, whose boxes all overlap: every ray meets hundreds of leaves."""
    rng = np.random.default_rng(0)
    ends = rng.uniform(0, 0.05, (count, 3)), 1 - rng.uniform(0, 0.05, (count, 3))
    corners = np.stack([*ends, ends[1] + rng.normal(0, 1e-3, (count, 3))], axis=1)
    return corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3)


def layers(count):
    """Triangles above each other."""
    corners = np.tile([[-10.0, -10.0, 0.0], [10.0, -10.0, 0.0], [0.0, 20.0, 0.0]], (count, 1, 1))
    corners[:, :, 2] = np.linspace(0, 1, count)[:, None]
    return corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3)


def rays_at_hair(kind):
    """Rays that a stream takes, that packets take, or sixteens of both by turns."""
    rng = np.random.default_rng(1)
    origins, targets = rng.uniform(-1, 2, (1024, 3)), rng.uniform(0, 1, (1024, 3))
    x = np.arange(1024)
    seen = (kind == "packets") | ((kind == "both") & (x // 16 % 2 == 0))
    origins[seen] = [0.5, 0.5, 9.0]
    targets[seen] = np.stack([0.2 + x % 32 / 50, 0.2 + x // 32 / 50, np.full(1024, 0.5)], axis=1)[seen]
    return origins, targets - origins


def calls_of(monkeypatch, module: ModuleType, name: str, beside=lambda: None) -> list:
    """What a kernel returns, each time that a query calls it."""
    kernel, calls = getattr(module, name), []

    def counted(*arguments):
        returned = kernel(*arguments)
        calls.append(returned)
        beside()
        return returned

    monkeypatch.setattr(module, name, counted)
    return calls


@pytest.fixture(scope="module")
def slivers():
    return Octree(*hair(5000), threads=1)


def in_pieces(ask, *arrays):
    """The answers to 64 rays or points at a time, which takes too little work to be cut."""
    return np.concatenate([ask(*(a[i : i + 64] for a in arrays)) for i in range(0, len(arrays[0]), 64)], axis=-1)


@cases("kind", ["stream", "packets", "both"])
@cases("any_hit", [False, True])
def test_rays_amid_slivers(slivers, monkeypatch, kind, any_hit):
    """1024 rays had been one call; of 200,000 slivers it kept Ctrl-C waiting for a minute."""

    def ask(*rays):
        if any_hit:
            return slivers.any_hit(*rays)
        hits = slivers.closest_hit(*rays)
        return np.stack([hits.t, hits.face, hits.u, hits.v])

    rays = rays_at_hair(kind)
    expected = in_pieces(ask, *rays)
    calls = calls_of(monkeypatch, query, "trace_chunk")
    np.testing.assert_array_equal(ask(*rays), expected)
    assert len(calls) >= 2
    states = [returned[:3] for returned in calls]
    assert states == sorted(set(states)) and states[-1][0] == 1024
    assert states[-1][1] == states[-1][2] == {"stream": 1024, "packets": 0, "both": 512}[kind]


def test_a_chunk_that_was_left_goes_on_after_other_rays_on_the_same_thread(slivers, monkeypatch):
    """As the handler of a signal may trace some."""
    origins, directions = rays_at_hair("stream")
    expected = slivers.closest_hit(origins, directions).t
    others = Octree(*layers(40), threads=1)
    busy = []

    def trace_others():
        if not busy:
            busy.append(True)
            others.closest_hit(*rays_at_hair("both"))
            busy.clear()

    calls = calls_of(monkeypatch, query, "trace_chunk", trace_others)
    np.testing.assert_array_equal(slivers.closest_hit(origins, directions).t, expected)
    assert len(calls) >= 4


def test_steps_amid_slivers(slivers, monkeypatch):
    def ask(*rays):
        counted = slivers.count_steps(*rays)
        return np.stack([counted.nodes, counted.triangles])

    rays = rays_at_hair("stream")
    expected = in_pieces(ask, *rays)
    calls = calls_of(monkeypatch, steps, "_count_chunk")
    np.testing.assert_array_equal(ask(*rays), expected)
    assert len(calls) >= 10
    reached = [row for row, _ in calls]
    assert reached == sorted(set(reached)) and reached[-1] == 1024


@pytest.mark.parametrize(("mesh", "max_hits"), [(hair(5000), None), (layers(2000), 1), (layers(2000), None)])
def test_all_hits(monkeypatch, mesh, max_hits):
    """Hits that ``max_hits`` leaves out had not counted: 20,000 layers kept Ctrl-C waiting for half a minute."""
    octree = Octree(*mesh, threads=1)
    origins, directions = rays_at_hair("stream")
    if len(octree.mesh.faces) == 2000:
        origins, directions = np.array([0, 0, -2.0]) + origins[:300] / 9, np.tile([0.0, 0.0, 1.0], (300, 1))

    def ask(*rays):
        return octree.all_hits(*rays, max_hits=max_hits).t

    expected = in_pieces(ask, origins, directions)
    calls = calls_of(monkeypatch, all_hits, "gather_chunk")
    np.testing.assert_array_equal(ask(origins, directions), expected)
    reached = [row for row, _ in calls]
    assert len(calls) >= 2 and reached == sorted(set(reached)) and reached[-1] == len(origins)


@cases("accelerator", [Octree, BruteForce])
@cases("side_alone", [False, True])
def test_winding_numbers_amid_slivers(monkeypatch, side_alone, accelerator):
    """512 points had been one call."""
    asked, points = accelerator(*hair(5000), threads=1), np.random.default_rng(3).random((512, 3))
    ask = (lambda some: asked.contains(some, winding=True)) if side_alone else asked.winding_number
    expected = in_pieces(ask, points)
    calls = calls_of(monkeypatch, winding, "find_windings")
    np.testing.assert_array_equal(ask(points), expected)
    assert len(calls) >= 5 and calls[-1] <= 512

"""Promises that something is quicker, or done once: judged by work that is counted, as no test judges a time."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numba import njit

import renderer.octree
from renderer import Mesh, Mirror, Octree, OrthographicCamera, RenderSettings, Scene, SceneObject, prepare
from renderer.all_hits import all_hits as gathering
from renderer.distance import closest as nearest
from renderer.inside import winding
from renderer.mesh.shapes import box, icosphere, torus
from renderer.numerics.simd import splat8
from renderer.trace.intersect import Ray, enter_boxes, largest_of, make_slabs
from renderer.trace.spawn import BOUNDED

pytestmark = pytest.mark.judges(
    "Octree", "Octree.all_hits", "Octree.closest_point", "Octree.load", "Octree.refit", "Octree.winding_number",
    "PreparedScene.picture", "Steps",
)  # fmt: skip


DOWN = [0.0, 0.0, -1.0]


def lines_through(count: int) -> tuple[Any, Any]:
    """Lines that cross the box from -1 to 1, begun outside it."""
    rng = np.random.default_rng(8)
    directions = rng.normal(size=(count, 3))
    return rng.uniform(-1, 1, (count, 3)) - 9.0 * directions, directions


def steps_of(octree: Octree) -> int:
    """Nodes and blocks of four triangles that some lines are tested against, on their way to what they hit first."""
    steps = octree.count_steps(*lines_through(4000))
    return int(steps.nodes.sum() + steps.triangles.sum() / 4)


def without_a_build(monkeypatch: pytest.MonkeyPatch) -> None:
    def cut(*_: Any) -> None:
        pytest.fail("faces were cut into a tree")

    monkeypatch.setattr(renderer.octree, "build_tree", cut)
    monkeypatch.setattr(renderer.octree, "build_blocks", cut)


def calls_of(monkeypatch: pytest.MonkeyPatch, module: Any, kernel: str) -> list[Any]:
    """What each call of a kernel by its module returns from now on: each call ends after some work, see its _WORK."""
    returned: list[Any] = []
    called = getattr(module, kernel)
    monkeypatch.setattr(module, kernel, lambda *given: (returned.append(called(*given)), returned[-1])[1])
    return returned


# Trees


def test_a_refit_cuts_nothing_and_keeps_nodes_and_leaves(monkeypatch: pytest.MonkeyPatch) -> None:
    ball = icosphere(4)
    octree = Octree.from_mesh(ball)
    links, faces = octree.tree.links.reshape(-1, 64)[:, 48:56].copy(), octree.tree.faces.copy()
    boxes, blocks = octree.tree.nodes.reshape(-1, 64)[:, :48].copy(), octree.tree.blocks.copy()
    without_a_build(monkeypatch)
    octree.refit(ball.vertices[::-1] * 2.0)
    assert np.array_equal(octree.tree.links.reshape(-1, 64)[:, 48:56], links)
    assert np.array_equal(octree.tree.faces, faces)
    assert (octree.tree.nodes.reshape(-1, 64)[:, :48] != boxes).mean() > 0.5
    assert (octree.tree.blocks != blocks).mean() > 0.5


def test_trees_by_the_heuristic_alone_take_fewer_steps() -> None:
    houses = [box((x, y, 0), (x + 0.6, y + 0.6, 1 + (3 * x + y) % 5)) for x in range(-9, 9) for y in range(-9, 9)]
    town = Mesh(
        np.concatenate([house.vertices for house in houses]) / 9,
        np.concatenate([house.faces + i * len(house.vertices) for i, house in enumerate(houses)]),
    )
    for mesh in (torus(), town):
        assert steps_of(Octree.from_mesh(mesh)) < steps_of(Octree.from_mesh(mesh, split="midpoint"))


def test_a_tree_is_loaded_without_a_build(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    octree = Octree.from_mesh(icosphere(3))
    octree.save(tmp_path / "a")
    without_a_build(monkeypatch)
    for mmap in (False, True):
        loaded = Octree.load(tmp_path / "a", mmap=mmap)
        assert np.array_equal(loaded.closest_hit(*lines_through(9)).t, octree.closest_hit(*lines_through(9)).t)


def memory_of(path: Path) -> dict[str, int]:
    """Kilobytes of this process's map of a file, by Linux's names."""
    sums: dict[str, int] = {}
    inside = False
    for line in Path("/proc/self/smaps").read_text().splitlines():
        name, _, rest = line.partition(":")
        if "-" in name.split(" ")[0]:
            inside = line.endswith(str(path))
        elif inside and rest.strip().endswith("kB"):
            sums[name] = sums.get(name, 0) + int(rest.split()[0])
    return sums


@pytest.mark.skipif(not Path("/proc/self/smaps").exists(), reason="only Linux tells what a process has of a map")
def test_of_a_mapped_file_blocks_are_read_when_rays_come_and_none_is_a_copy(tmp_path: Path) -> None:
    path = tmp_path.resolve() / "a.octree"
    Octree.from_mesh(icosphere(7)).save(path)
    size = path.stat().st_size / 1024
    octree = Octree.load(path, mmap=True, threads=1)
    begun = memory_of(path)
    octree.closest_hit(*lines_through(4000))
    asked = memory_of(path)
    # Not one page is a copy: all processes that map the file have the same.
    assert begun["Anonymous"] == asked["Anonymous"] == 0
    # Nodes and the mesh are looked at when it is loaded, a third of the file; systems bring some more at once.
    assert begun["Rss"] < size / 2 and asked["Rss"] > begun["Rss"] + size / 10


@njit
def _entered(nodes: Any, ray: Any) -> Any:
    slabs = make_slabs(ray, largest_of(ray))
    return enter_boxes(nodes, 0, slabs, splat8(np.float32(0.0)), splat8(np.float32(9.0)))[1]


def test_eight_octants_are_tested_at_once() -> None:
    octree = Octree.from_mesh(icosphere(3))
    assert _entered(octree.tree.nodes, Ray(0.1, 0.2, 3.0, 0.0, 0.0, -1.0, 0.0, 0.0, -1.0)) > 0
    (code,) = _entered.inspect_llvm().values()
    compared = [line for line in code.splitlines() if " fcmp " in line and "float>" in line]
    assert len(compared) >= 7 and all("<8 x float>" in line for line in compared)


# Queries


def test_all_hits_are_found_without_a_search_for_each(monkeypatch: pytest.MonkeyPatch) -> None:
    """As many calls of the kernel for 60 hits of each ray as for one."""
    vertices = np.tile([[-1.0, -1.0, 0.0], [2.0, -1.0, 0.0], [-1.0, 2.0, 0.0]], (60, 1))
    vertices[:, 2] = np.repeat(np.arange(60.0), 3)
    octree = Octree(vertices, np.arange(180).reshape(-1, 3), threads=1)
    origins = np.concatenate([np.random.default_rng(1).uniform(-0.4, 0.4, (16, 2)), np.full((16, 1), 99.5)], 1)
    calls = calls_of(monkeypatch, gathering, "gather_chunk")
    numbers = []
    for t_max in (41.0, 999.0):
        calls.clear()
        assert (octree.all_hits(origins, DOWN, t_max=t_max).counts == (1 if t_max == 41.0 else 60)).all()
        numbers.append(len(calls))
    assert numbers == [1, 1]


def test_a_looser_tolerance_takes_less_work(monkeypatch: pytest.MonkeyPatch) -> None:
    octree = Octree.from_mesh(icosphere(5), threads=1)
    points = np.random.default_rng(4).uniform(-1.5, 1.5, (20_000, 3))
    calls, numbers = calls_of(monkeypatch, winding, "find_windings"), []
    for tolerance in (1e-5, 1e-3, 1e-1):
        calls.clear()
        octree.winding_number(points, tolerance)
        numbers.append(len(calls))
    assert numbers[0] > numbers[1] > numbers[2]


def test_a_bound_of_the_distance_spares_work(monkeypatch: pytest.MonkeyPatch) -> None:
    """All faces of a ball are about as near to its centre, so that without a bound most are looked at."""
    octree = Octree.from_mesh(icosphere(4), threads=1)
    calls, numbers = calls_of(monkeypatch, nearest, "find_nearest"), []
    for limit in (np.inf, 0.5):
        calls.clear()
        assert octree.closest_point(np.zeros((1000, 3)), limit).found.all() == (limit == np.inf)
        numbers.append(len(calls))
    assert numbers[1] == 1 and numbers[0] > 5


# Pictures


def test_a_long_tile_is_told_of_every_16384_rays() -> None:
    """Between two mirrors each ray is reflected 64 times, and 256 bundles of 64 rays are traced between two words."""
    wall = np.array([[-60.0, -50.0, 0.0], [60.0, -50.0, 0.0], [60.0, 55.0, 0.0], [-60.0, 55.0, 0.0]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    before, behind = np.subtract(wall, [0.0, 0.0, 1.0]), np.add(wall, [0.0, 0.0, 1.0])
    walls = Mesh(np.concatenate([before, behind]), np.concatenate([faces, faces + 4]))
    scene = Scene(
        camera=OrthographicCamera(eye=(0.1, 0.2, 0.0), target=(0.1, 0.2, 1.0), height=1.0),
        materials={"m": Mirror()},
        objects=(SceneObject(mesh=walls, material="m"),),
    )
    told: list[int] = []
    chosen = RenderSettings(resolution=(32, 32), samples=16, max_depth=64)
    image = prepare(scene, accelerator="octree").picture(scene.camera, chosen, BOUNDED, 1, told.append)
    assert (image.rays == 16 * 65).all()
    assert told == [0] * (32 * 32 * 16 * 65 // 16384) + [1]

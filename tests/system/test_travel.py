"""Octrees, meshes, answers, scenes and pictures that travel: copied, pickled, in other processes, on other threads."""

import copy
import multiprocessing
import os
import pickle
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path
from threading import Event
from typing import Any

import numpy as np
import pytest
from cases import cases
from meshes import answers, arrays, make_mesh, rays_at

from renderer import BruteForce, Image, Octree, Scene, load_scene, render
from renderer.mesh.load import save_ply
from renderer.mesh.shapes import icosphere
from renderer.scene.scene import write_scene

ORIGINS, DIRECTIONS = rays_at(*make_mesh("soup", 1, 50), 1, 12)
RAYS = ORIGINS, DIRECTIONS


def out_of_band(thing: Any) -> Any:
    """As dask and joblib send arrays: beside the pickle, in memory that cannot be written."""
    buffers: list[pickle.PickleBuffer] = []
    content = pickle.dumps(thing, 5, buffer_callback=buffers.append)
    return pickle.loads(content, buffers=[bytes(buffer.raw()) for buffer in buffers])


WAYS: dict[str, Callable[[Any], Any]] = {
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
    "pickle 2": lambda thing: pickle.loads(pickle.dumps(thing, 2)),
    "pickle 4": lambda thing: pickle.loads(pickle.dumps(thing, 4)),
    "pickle 5": lambda thing: pickle.loads(pickle.dumps(thing, 5)),
    "out of band": out_of_band,
}
by_any_way = pytest.mark.parametrize("way", WAYS)


def mapped(folder: Path) -> Octree:
    octree = Octree.from_mesh(icosphere(3), threads=3)
    octree.save(folder / "ball.octree")
    return Octree.load(folder / "ball.octree", mmap=True, threads=3)


TARGETS: dict[str, Callable[[Path], Octree | BruteForce]] = {
    "octree": lambda folder: Octree.from_mesh(icosphere(3), threads=3),
    "brute force": lambda folder: BruteForce.from_mesh(icosphere(2), threads=3),
    "float64": lambda folder: Octree(*make_mesh("far_away", 1, 200), split="sah"),
    "scaled": lambda folder: Octree(icosphere(2).vertices * 1e-100, icosphere(2).faces),
    "no faces": lambda folder: Octree([], []),
    "mapped": mapped,
}
any_target = pytest.mark.parametrize("kind", TARGETS)


def asked(target: Octree | BruteForce) -> dict[str, bytes]:
    return answers(target, ORIGINS / target.tree.scale, DIRECTIONS)


# --- octrees and meshes -----------------------------------------------------------------------------------------


@by_any_way
@any_target
def test_what_is_refitted_leaves_its_copies_alone(kind: str, way: str, tmp_path: Path) -> None:
    target = TARGETS[kind](tmp_path)
    expected, moved = asked(target), target.mesh.vertices * [0.5, 1.0, 2.0]
    copied, other = WAYS[way](target), WAYS[way](target)
    copied.refit(moved)
    assert asked(target) == asked(other) == expected
    target.refit(moved)
    assert asked(target) == asked(copied) and asked(other) == expected
    assert kind == "no faces" or asked(target) != expected


# --- answers ----------------------------------------------------------------------------------------------------


def fields(answer: Any) -> list[bytes]:
    """All that an answer holds, and what it works out from its mesh."""
    names = [name for name in type(answer).__slots__ if name != "_mesh" and getattr(answer, name) is not None]
    more = [name for name in ("hit", "found", "counts", "ray", "points", "normals") if hasattr(answer, name)]
    return [np.asarray(getattr(answer, name)).tobytes() for name in [*names, *more]]


@pytest.mark.judges("Octree.refit")
@by_any_way
@pytest.mark.parametrize("query", ["closest_hit", "all_hits", "closest_point"])
def test_answers_travel_with_the_mesh_that_they_are_of(query: str, way: str) -> None:
    octree = Octree.from_mesh(icosphere(3))
    answer = getattr(octree, query)(*(RAYS if query != "closest_point" else RAYS[:1]))
    expected = fields(answer)
    copied = WAYS[way](answer)
    octree.refit(octree.mesh.vertices * 3.0)
    assert type(copied) is type(answer) and fields(copied) == expected and len(expected) > 5


def test_what_travels_together_shares_its_mesh() -> None:
    octree = Octree.from_mesh(icosphere(3))
    sent = (octree, octree.closest_hit(*RAYS), octree.all_hits(*RAYS), octree.mesh)
    for again in (pickle.loads(pickle.dumps(sent)), copy.deepcopy(sent)):
        assert again[0].mesh is again[1]._mesh is again[2]._mesh is again[3] is not octree.mesh


# --- scenes and pictures ----------------------------------------------------------------------------------------


def from_file(folder: Path) -> Scene:
    save_ply(icosphere(2), folder / "ball.ply")
    write_scene(folder / "ball.ply", folder / "ball.toml")
    return load_scene(folder / "ball.toml")


@by_any_way
def test_a_scene_travels_without_its_files(way: str, tmp_path: Path) -> None:
    scene = from_file(tmp_path)
    expected = render(scene, resolution=(24, 16)).radiance
    for file in tmp_path.iterdir():
        file.unlink()
    copied = WAYS[way](scene)
    assert render(copied, resolution=(24, 16)).radiance.tobytes() == expected.tobytes()
    assert copied.render == scene.render and copied.materials == scene.materials and copied.camera == scene.camera


# --- other processes --------------------------------------------------------------------------------------------

# What a child inherits that is forked while it stands here.
KEPT: dict[str, Octree | BruteForce] = {}


def answered(target: Octree | BruteForce | str) -> Any:
    """In a child: what an octree answers, that was sent or, by its name, inherited; and its hits, to be sent back."""
    target = KEPT[target] if isinstance(target, str) else target
    hits = target.closest_hit(*RAYS)
    assert target.any_hit(np.ones((20_000, 3)), -np.ones((20_000, 3))).all()  # on threads
    target.refit(target.mesh.vertices * 2.0)
    return hits, target, os.getpid()


def drawn(scene: Scene) -> Image:
    return render(scene, resolution=(24, 16))


def check_in(pool: ProcessPoolExecutor, targets: list[Octree | BruteForce | str], scene: Scene) -> None:
    """What comes back from a child is what this process answers."""
    waiting = [pool.submit(answered, target) for target in targets]
    for target, waited in zip(targets, waiting, strict=True):
        hits, refitted, child = waited.result(120)
        own = KEPT[target] if isinstance(target, str) else target
        assert child != os.getpid() and fields(hits) == fields(own.closest_hit(*RAYS))
        again = copy.copy(own)
        again.refit(own.mesh.vertices * 2.0)
        assert asked(refitted) == asked(again) != asked(own)
        assert all(a.tobytes() == b.tobytes() for a, b in zip(arrays(refitted.tree), arrays(again.tree), strict=True))
    image = pool.submit(drawn, scene).result(120)
    assert image.radiance.tobytes() == drawn(scene).radiance.tobytes()


def test_by_spawn(tmp_path: Path) -> None:
    targets = [TARGETS[kind](tmp_path) for kind in ("octree", "mapped", "brute force")]
    # Not a Pool: ending one kills its process, which may hold the lock that the end waits for.
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        check_in(pool, [*targets], from_file(tmp_path))


@pytest.mark.skipif("fork" not in multiprocessing.get_all_start_methods(), reason="this system does not fork")
@pytest.mark.filterwarnings("ignore:.*multi-threaded.*fork:DeprecationWarning")
def test_by_fork(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(f"{__name__}.KEPT", {kind: TARGETS[kind](tmp_path) for kind in ("octree", "mapped")})
    many = np.ones((20_000, 3))
    for octree in KEPT.values():
        octree.any_hit(many, many)  # on threads, which the child does not have
    with ProcessPoolExecutor(1, multiprocessing.get_context("fork")) as pool:
        check_in(pool, [*KEPT.values(), *KEPT], from_file(tmp_path))


# --- other threads ----------------------------------------------------------------------------------------------


class Refitting:
    """Points that refit an octree while a query reads them, as another thread might."""

    def __init__(self, target: Octree | BruteForce, vertices: Any, points: Any) -> None:
        self.target, self.vertices, self.points = target, vertices, points

    def __array__(self, dtype: Any = None, copy: Any = None) -> Any:
        self.target.refit(self.vertices)
        return np.array(self.points, dtype)


# A corner of the balls, which the refit leaves where it is.
TOP = (0.0, 0.0, 1.0)


def face_at(target: Octree | BruteForce, corner: Any) -> int:
    return int((target.mesh.triangles == corner).all(axis=2).any(axis=1).argmax())


QUERIES: dict[str, Callable[[Any, Any], Any]] = {
    "closest_hit": lambda target, points: fields(target.closest_hit(points, DIRECTIONS)),
    "leaving": lambda target, points: fields(target.closest_hit(points, DIRECTIONS, leaving=face_at(target, TOP))),
    "few": lambda target, points: fields(target.closest_hit(points, DIRECTIONS[:5])),
    "any_hit": lambda target, points: target.any_hit(points, DIRECTIONS).tobytes(),
    "all_hits": lambda target, points: fields(target.all_hits(points, DIRECTIONS)),
    "count_hits": lambda target, points: target.count_hits(points, DIRECTIONS, contacts=False).tobytes(),
    "contains": lambda target, points: target.contains(points).tobytes(),
    "closest_point": lambda target, points: fields(target.closest_point(points)),
    "signed_distance": lambda target, points: target.signed_distance(points).tobytes(),
    "visible": lambda target, points: target.visible(points, ORIGINS[0]).tobytes(),
}


@pytest.mark.judges("Octree.refit")
@cases("query", QUERIES)
@cases("kind", ["octree", "brute force", "mapped"])
def test_a_refit_in_the_midst_of_a_query_changes_nothing_of_it(kind: str, query: str, tmp_path: Path) -> None:
    target, ask = TARGETS[kind](tmp_path), QUERIES[query]
    points = ORIGINS[:5] if query == "few" else ORIGINS / 2.0
    points = np.tile(TOP, (len(DIRECTIONS), 1)) if query == "leaving" else points
    before, moved = ask(target, points), target.mesh.vertices * [3.0, 0.5, 1.0]
    assert ask(target, Refitting(target, moved, points)) == before
    after = ask(target, points)
    assert np.array_equal(target.mesh.vertices, moved) and after != before


@pytest.mark.judges("Octree.refit", "Octree.save")
def test_callers_on_other_threads_see_the_mesh_before_or_after_a_refit(tmp_path: Path) -> None:
    """Every query, every copy and every file, until each has seen both, while another thread refits."""
    ball = icosphere(4)
    octree, shapes = Octree.from_mesh(ball, threads=2), (ball.vertices, ball.vertices * [3.0, 0.5, 1.0])
    expected = [answers(Octree(vertices, ball.faces), *RAYS) for vertices in shapes]
    done = Event()

    def load() -> Octree:
        octree.save(tmp_path / "it.octree")
        return Octree.load(tmp_path / "it.octree", mmap=True)

    def ask(of: Callable[[], Octree], seen: set[int]) -> None:
        while not done.is_set():
            for name, bits in answers(of(), *RAYS).items():
                seen.add([known[name] for known in expected].index(bits))

    asked_of = (lambda: octree, lambda: octree, lambda: copy.deepcopy(octree), load)
    seen: list[set[int]] = [set() for _ in asked_of]
    with ThreadPoolExecutor(len(seen)) as pool:
        asking = [pool.submit(ask, of, states) for of, states in zip(asked_of, seen, strict=True)]
        end, step = time.monotonic() + 60.0, 0
        while (step < 60 or seen != [{0, 1}] * len(seen)) and time.monotonic() < end:
            step += 1
            octree.refit(shapes[step % 2])
            if any(future.done() for future in asking):
                break  # by an error, which is raised below
        done.set()
        for future in asking:
            future.result()
    assert seen == [{0, 1}] * len(seen)

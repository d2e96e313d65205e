"""Scenes that change: queries, hits and octrees see them as they were at one moment, and errors change nothing."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from renderer.mesh.shapes import box, icosphere
from renderer.octree import Octree
from renderer.rayscene.scene import RayScene
from validation.meshes import TURN
from validation.promises.refused import refused
from validation.promises.row import row

Bools = NDArray[np.bool_]
Floats = NDArray[np.float64]

_KNOWN = "known answer"
# Plates in a row, a ray down at each from a height of 9; and how often two threads query while they move.
_PLATES, _QUERIES = 64, 150
_FROM = np.stack([2.0 * np.arange(_PLATES) + 0.5, np.full(_PLATES, 0.25), np.full(_PLATES, 9.0)], axis=1)
_DOWN = np.array([0.0, 0.0, -1.0])
_PLATE = box((0.0, 0.0, -1.0), (1.0, 1.0, 0.0))
_RAYS, _THREADS = 20_000, (1, 2, 7)


def check_moments(rng: Generator) -> list[dict[str, Any]]:
    """Plates at one height and then at another, and balls all around."""
    return [
        row("a query sees a scene that moves meanwhile as it was before or after", _KNOWN, _meanwhile()),
        row("hits keep the scene that they hit", _KNOWN, _kept()),
        row("a change that is refused names the argument and changes nothing", _KNOWN, _refused()),
        row("an octree and a scene that has it do not change each other", _KNOWN, _shared()),
        row("objects keep their number, name, mesh and transforms", _KNOWN, _named()),
        row("a scene gives the same bits on 1, 2 and 7 threads", "one thread", _threaded(rng)),
    ]


def _at(height: float) -> Floats:
    """Matrices of all plates at a height."""
    matrices = np.tile(np.eye(4)[:3], (_PLATES, 1, 1))
    matrices[:, 0, 3], matrices[:, 2, 3] = 2.0 * np.arange(_PLATES), height
    return matrices


def _plates() -> tuple[RayScene, int]:
    scene = RayScene()
    return scene, scene.add(_PLATE, _at(1.0))


def _is_at(scene: RayScene, height: float) -> bool:
    return bool((scene.closest_hit(_FROM, _DOWN).t == 9.0 - height).all())


def _meanwhile() -> Bools:
    scene, plates = _plates()

    def ask(_: int) -> bool:
        t = scene.closest_hit(_FROM, _DOWN).t
        return bool(((t == 8.0).all() or (t == 4.0).all()) and len(t) == _PLATES)

    with ThreadPoolExecutor(2) as pool:
        answers = [pool.submit(ask, k) for k in range(_QUERIES)]
        for k in range(10**6):
            scene.move(plates, _at(5.0 if k % 2 else 1.0))
            if answers[-1].done():
                break
        return np.array([answer.result() for answer in answers])


def _kept() -> Bools:
    """Hits whose places are read after each change."""
    kept = []
    turned = _at(5.0)
    turned[:, :, :3] = np.diag([1.0, -1.0, -1.0])
    changes: tuple[Callable[[RayScene, int], None], ...] = (
        lambda scene, plates: scene.move(plates, turned),
        lambda scene, plates: scene.move(plates, turned[3:4], instances=[3]),
        lambda scene, plates: scene.refit(plates, _PLATE.vertices + 0.125),
        lambda scene, plates: scene.show(plates, False),
        lambda scene, plates: scene.remove(plates),
    )
    for change in changes:
        scene, plates = _plates()
        hits, near = scene.closest_hit(_FROM, _DOWN), scene.closest_point(_FROM)
        change(scene, plates)
        for found in (hits, near):
            kept += [
                (found.points == _FROM + 8.0 * _DOWN).all(axis=1),
                (found.normals == [0.0, 0.0, 1.0]).all(axis=1),
                (found.object == plates) & (found.instance == np.arange(_PLATES)),
                found.interpolate(_PLATE.vertices[:, 0]) == 0.5,
            ]
    return np.concatenate(kept)


def _refused() -> Bools:
    flat, thin, bad = _at(5.0), _at(5.0), _at(5.0)
    flat[7, 2, :3], thin[8, :, :3], bad[9, 1, 1] = 0.0, TURN @ np.diag([1.0, 1.0, 1e-14]) @ TURN, np.nan
    scene, plates = _plates()
    kept = []
    for name, ask, arguments in (
        ("transforms", scene.move, (plates, flat)),
        ("transforms", scene.move, (plates, thin)),
        ("transforms", scene.move, (plates, bad)),
        ("transforms", scene.move, (plates, _at(5.0)[:3])),
        ("transforms", scene.add, (_PLATE, flat)),
        ("mask", scene.add, (_PLATE, None)),
        ("object", scene.move, (plates + 1, _at(5.0))),
        ("object", scene.remove, (plates + 1,)),
        ("shown", scene.show, (plates, np.ones(3, bool))),
        ("vertices", scene.refit, (plates, _PLATE.vertices[:5])),
        ("vertices", scene.refit, (plates, np.full((8, 3), np.nan))),
    ):
        said = refused(ask, *arguments, **({"mask": -1} if name == "mask" else {})) or ""
        kept += [f"{name}: expected " in said, _is_at(scene, 1.0), scene.objects == [plates]]
    named = refused(scene.move, plates, flat) or ""
    return np.array([*kept, named.endswith("instance 7"), "row 9" in (refused(scene.move, plates, bad) or "")])


def _shared() -> Bools:
    octree, higher = Octree.from_mesh(_PLATE), _PLATE.vertices - 4.0 * _DOWN
    scene = RayScene()
    plates = scene.add(octree, _at(1.0))
    octree.refit(higher)
    kept = [_is_at(scene, 1.0), octree.closest_hit(_FROM[0], _DOWN).t == 5.0]
    other = RayScene()
    other.add(octree, _at(1.0))
    scene.refit(plates, higher)
    octree.refit(_PLATE.vertices)
    kept += [_is_at(scene, 5.0), _is_at(other, 5.0), octree.closest_hit(_FROM[0], _DOWN).t == 9.0]
    return np.array(kept)


def _named() -> Bools:
    """Three objects, the first of which goes, then one more."""
    scene, meshes = RayScene(), [_PLATE, icosphere(1), box()]
    numbers = [scene.add(mesh, _at(1.0)[:k], name=f"mesh {k}") for k, mesh in enumerate(meshes, 1)]
    scene.remove(numbers[0])
    numbers.append(scene.add(_PLATE))
    kept = [numbers == [0, 1, 2, 3], scene.objects == [1, 2, 3], scene.name(1) == "mesh 2", scene.name(2) == "mesh 3"]
    kept += [np.array_equal(scene.transforms(k), _at(1.0)[: k + 1]) for k in (1, 2)]
    kept += [np.array_equal(scene.mesh(k).faces, meshes[k].faces) for k in (1, 2)]
    # Onto the box, onto the ball beside it, and onto the plate from below.
    hits = scene.closest_hit([[0.5, 0.25, 9.0], [-0.1, 0.2, 9.0], [0.5, 0.25, -9.0]], [_DOWN, _DOWN, -_DOWN])
    return np.array([*kept, hits.object.tolist() == [2, 1, 3], hits.instance.tolist() == [0, 0, 0]])


def _threaded(rng: Generator) -> Bools:
    """A batch of many chunks at a heap of balls, and the top of as many instances."""
    matrices = np.tile(np.eye(4)[:3], (500, 1, 1))
    matrices[:, :, :3] *= rng.uniform(0.1, 1.0, (500, 1, 1))
    matrices[:, :, 3] = rng.normal(size=(500, 3)) * 6.0
    origins, directions = rng.normal(size=(2, _RAYS, 3)) * 8.0
    answers = []
    for threads in _THREADS:
        scene = RayScene(threads=threads)
        scene.add(icosphere(2), matrices)
        hits, every = scene.closest_hit(origins, directions), scene.all_hits(origins, directions)
        near = scene.closest_point(origins[:2000])
        answers.append([getattr(found, name) for found in (hits, every, near) for name in ("u", "face", "instance")])
        answers[-1] += [hits.t, every.t, near.distance, scene.any_hit(origins, directions)]
    return np.array(
        [np.array_equal(a, b, equal_nan=True) for more in answers[1:] for a, b in zip(answers[0], more, strict=True)]
    )

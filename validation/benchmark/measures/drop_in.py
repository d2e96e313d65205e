"""trimesh with the drop-in beside trimesh over embreex and trimesh alone: the calls of its users, from one ray on.

``python -m validation.benchmark.measures.drop_in`` prints a table; ``--faces`` and ``--rays`` choose meshes and calls.
"""

import argparse
import statistics
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
import trimesh
from numpy.typing import NDArray

from renderer.trimesh_ray import installed
from validation.benchmark.measures.meshes import displaced_spheres
from validation.timing import RUNS, interleaved, ratio, timed

OURS, EMBREEX, ALONE = "drop-in", "trimesh + embreex", "trimesh alone"
QUICK_FACES, QUICK_RAYS = (1_000,), (1, 10, 1_000)
FACES, RAYS = (*QUICK_FACES, 100_000), (*QUICK_RAYS, 100_000)
_SEED = 15
_LEAST = 50
# The most rays or points of a call to trimesh, and the most faces on which it is alone, for the time that it takes:
# with more a benchmark of all meshes takes longer than an hour.
_MOST = {
    OURS: {},
    EMBREEX: {"signed_distance": 100, "thickness": 100, "": 100_000},
    ALONE: {"signed_distance": 100, "thickness": 100, "": 1_000},
}
_ALONE_FACES = 10_000


class Row(NamedTuple):
    """A call on a mesh with so many rays or points: seconds a ray by contender, all runs, and the ratios to ours."""

    call: str
    faces: int
    rays: int
    seconds: dict[str, list[float]]
    ratios: dict[str, float]


class _Asked(NamedTuple):
    """Rays towards the mesh, points in 1.2 times its box, points on it, and those points' normals."""

    origins: NDArray[np.float64]
    directions: NDArray[np.float64]
    points: NDArray[np.float64]
    surface: NDArray[np.float64]
    normals: NDArray[np.float64]

    def at_most(self, count: int) -> "_Asked":
        return _Asked(*(values[:count] for values in self))


def _calls() -> dict[str, Callable[[Any, _Asked], Any]]:
    """By name a call of a mesh; the attributes of ``trimesh.proximity`` are looked up when it is made."""
    near: Any = trimesh.proximity
    return {
        "intersects_location": lambda mesh, a: mesh.ray.intersects_location(
            a.origins, a.directions, multiple_hits=True
        ),
        "intersects_first": lambda mesh, a: mesh.ray.intersects_first(a.origins, a.directions),
        "contains": lambda mesh, a: mesh.contains(a.points),
        "signed_distance": lambda mesh, a: near.signed_distance(mesh, a.points),
        "thickness": lambda mesh, a: near.thickness(mesh, a.surface, normals=a.normals),
    }


def run(quick: bool, step: Callable[[str], None]) -> list[dict[str, Any]]:
    """All rows, for JSON."""
    faces, counts = (QUICK_FACES, QUICK_RAYS) if quick else (FACES, RAYS)
    return [row._asdict() for size in faces for row in measure(size, counts, step)]


def measure(
    faces: int, counts: Sequence[int], step: Callable[[str], None] = lambda name: None, alone: bool = True
) -> Iterator[Row]:
    """A row for each call and number of rays or points; ``alone`` asks trimesh alone too, of small meshes."""
    whole = displaced_spheres(faces)
    with installed():
        meshes = {OURS: trimesh.Trimesh(whole.vertices, whole.faces, process=False)}
    meshes[EMBREEX] = trimesh.Trimesh(whole.vertices, whole.faces, process=False)
    if alone and faces <= _ALONE_FACES:
        meshes[ALONE] = trimesh.Trimesh(whole.vertices, whole.faces, process=False, use_embree=False)
    asked = _asked(meshes[OURS], max(counts))
    for name, call in _calls().items():
        for count in counts:
            step(f"drop-in for trimesh: {name}, {len(whole.faces)} faces, {count}")
            yield _row(name, call, meshes, asked.at_most(count))


def _asked(mesh: Any, count: int) -> _Asked:
    rng = np.random.default_rng(_SEED)
    low, high = np.asarray(mesh.bounds)
    middle, half = (low + high) / 2, (high - low) / 2
    starts, targets = (middle + rng.uniform(-1, 1, (count, 3)) * half * size for size in (3.0, 1.0))
    face = rng.integers(0, len(mesh.faces), count)
    weights = rng.dirichlet((1.0, 1.0, 1.0), count)
    surface = np.einsum("ni,nij->nj", weights, np.asarray(mesh.triangles)[face])
    points = middle + rng.uniform(-1.2, 1.2, (count, 3)) * half
    return _Asked(starts, targets - starts, points, surface, np.asarray(mesh.face_normals)[face])


def _row(name: str, call: Callable[[Any, _Asked], Any], meshes: dict[str, Any], asked: _Asked) -> Row:
    of = {who: asked.at_most(_MOST[who].get(name, _MOST[who].get("", len(asked.points)))) for who in meshes}
    # A call of few rays is made many times, so that it is not the clock that is measured.
    times = max(1, _LEAST // len(asked.points))

    def ask(who: str) -> None:
        for _ in range(times):
            call(meshes[who], of[who])

    def ask_ours() -> float:
        # What stands in trimesh.proximity is ours for these calls only.
        with installed(proximity=True):
            return timed(ask, OURS)()

    contenders = {who: ask_ours if who == OURS else timed(ask, who) for who in meshes}
    found = interleaved(contenders, RUNS)
    seconds = {who: [s / (times * len(of[who].points)) for s in runs] for who, runs in found.items()}
    ratios = {who: ratio(runs, seconds[OURS]) for who, runs in seconds.items() if who != OURS}
    return Row(name, len(meshes[OURS].faces), len(asked.points), seconds, ratios)


def main(arguments: Sequence[str] | None = None) -> int:
    """Print a line for each call, number of faces, and number of rays or points."""
    parser = argparse.ArgumentParser(prog="python -m validation.benchmark.measures.drop_in", description=__doc__)
    parser.add_argument("--faces", type=int, nargs="+", default=FACES)
    parser.add_argument("--rays", type=int, nargs="+", default=RAYS)
    parser.add_argument("--without-alone", action="store_true", help="leave out trimesh alone, which is slow")
    options = parser.parse_args(arguments)
    print(f"{'call':20} {'faces':>8} {'rays':>8} {'us a ray':>10} {'x embreex':>10} {'x alone':>10}")
    for faces in options.faces:
        for row in measure(faces, sorted(options.rays), alone=not options.without_alone):
            ours = statistics.median(row.seconds[OURS]) * 1e6
            ratios = "".join(f" {value:10.2f}" for value in row.ratios.values())
            print(f"{row.call:20} {row.faces:8} {row.rays:8} {ours:10.3f}{ratios}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())

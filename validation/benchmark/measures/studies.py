"""Points that look in the 145 directions of Tregenza's sky over a city and a terrain: ours beside Open3D.

``python -m validation.benchmark.measures.studies`` prints both. Peers get their rays as arrays, as they ask for them;
what a point's own plane hides is left out. Their rays start off the surface by an epsilon, ours by its own rule, so
some bits differ. Memory is measured in processes of their own. Ours has the tree of ``octree-render study``.
"""

import argparse
import json
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderer.cli.study import SPLIT
from renderer.octree import Octree
from renderer.ordering.morton import order_along_curve
from renderer.studies import occlusion, tregenza
from renderer.studies.directions import turned
from renderer.system import child
from renderer.system.threads import available_threads
from validation.benchmark.measures.families import families
from validation.benchmark.measures.forms import FORMS
from validation.benchmark.measures.memory import most_resident, resident

Floats = NDArray[np.float64]
Test = Callable[[NDArray[np.float32]], NDArray[np.bool_]]

_SEED = 1
_UP = np.array([0.0, 1.0, 0.0])
# Points of one call of a peer: fewer take longer in Python, more do not stay in the caches. The best counts.
_BATCHES = (300, 1000, 3000)
_RUNS = 5
# As a share of the width of a face: what moves a peer's rays off the surface.
_EPSILON = 1e-4
# Rays that are written down, for the rate of ``Octree.any_hit``.
_WRITTEN = 16_000
# The kinds of mesh that studies are made for; their faces, and as many points, in full and in quick runs.
KINDS = ("city", "terrain")
SIZE, QUICK_SIZE = 1_000_000, 50_000


def run(quick: bool, step: Callable[[str], None]) -> list[dict[str, Any]]:
    """The rows of the benchmark, on all threads."""
    size = QUICK_SIZE if quick else SIZE
    return [measure(kind, size, size, available_threads(), step) for kind in KINDS]


def scene(form: str, faces: int, count: int) -> tuple[Any, Floats, Floats, NDArray[np.int64], Floats]:
    """Mesh, points spread evenly over its surface, their normals and faces, and the directions of the sky."""
    mesh, rng = FORMS[form](faces), np.random.default_rng(_SEED)
    corners = mesh.triangles
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    on = rng.choice(len(corners), count, p=area / area.sum())
    u, v = rng.random((2, count))
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    a, b, c = np.moveaxis(corners[on], 1, 0)
    points = a + u[:, None] * (b - a) + v[:, None] * (c - a)
    return mesh, points, mesh.face_normals()[on], on, turned(tregenza().directions, _UP)


def testers(mesh: Any, threads: int) -> dict[str, Test]:
    """The any-hit queries of the peers that are installed: rays (n, 6) float32 to bools."""
    try:
        from validation.benchmark.peers.open3d import occlusion_test
    except ImportError:
        return {}
    return {"open3d": occlusion_test(mesh.vertices, mesh.faces, threads)}


def ask_peer(
    test: Test, where: tuple[Floats, Floats, Floats], epsilon: float, batch: int, by_direction: bool
) -> tuple[float, float, NDArray[np.uint8]]:
    """Seconds of the bare calls and of all, and the bits of what is hidden; points in the order of a curve."""
    points, normals, ways = where
    bits, bare, began = np.zeros((len(points), -(-len(ways) // 8)), np.uint8), 0.0, time.perf_counter()
    order = order_along_curve(points)[0]
    single = ways.astype(np.float32)
    for first in range(0, len(points), batch):
        rows = order[first : first + batch]
        start, up = (points[rows] + epsilon * normals[rows]).astype(np.float32), normals[rows] @ ways.T > 0.0
        seen = up.T if by_direction else up
        rays = np.empty((*seen.shape, 6), np.float32)
        rays[..., :3] = start if by_direction else start[:, None]
        rays[..., 3:] = single[:, None] if by_direction else single
        rays = rays[seen]
        called = time.perf_counter()
        hit = test(rays)
        bare += time.perf_counter() - called
        hidden = ~seen
        hidden[seen] = hit
        hidden = hidden.T if by_direction else hidden
        bits[rows] = np.packbits(hidden, axis=1)
    return bare, time.perf_counter() - began, bits


def measure(form: str, faces: int, count: int, threads: int, step: Callable[[str], None]) -> dict[str, Any]:
    """One row: seconds of ours (the median) and of each peer (its best way), differing bits, rates and memory."""
    mesh, points, normals, on, ways = scene(form, faces, count)
    step(f"{form}: octree")
    octree, name = Octree.from_mesh(mesh, split=SPLIT, threads=threads), f"{form}, {len(mesh.faces)} faces"

    def ours() -> NDArray[Any]:
        return occlusion(octree, points, normals, ways, leaving=on, packed=True, threads=threads)

    occlusion(octree, points[:2000], normals[:2000], ways, leaving=on[:2000], packed=True, threads=threads)
    bits, times, peers = ours(), [], {}
    tests, epsilon = testers(mesh, threads), _EPSILON * 2.0 / (faces / 12.0) ** 0.5
    for label, test in tests.items():
        ask_peer(test, (points[:2000], normals[:2000], ways), epsilon, 1000, True)
        answers = {}
        for batch in _BATCHES:
            for by_direction in (True, False):
                step(f"{form}: {label}, {batch} points a call, {'directions' if by_direction else 'points'} first")
                answers[batch, by_direction] = ask_peer(test, (points, normals, ways), epsilon, batch, by_direction)
                # In turn with the peer's, so that both see the same machine.
                began = time.perf_counter()
                ours()
                times.append(time.perf_counter() - began)
        way = min(answers, key=lambda key: answers[key][1])
        peers[label] = {
            "bare": min(answer[0] for answer in answers.values()), "whole": answers[way][1],
            "batch": way[0], "by_direction": way[1],
            "differing": int(np.unpackbits(bits ^ answers[way][2], axis=1, count=len(ways)).sum()),
        }  # fmt: skip
    while len(times) < _RUNS:
        began = time.perf_counter()
        ours()
        times.append(time.perf_counter() - began)
    live = int(sum((normals[a : a + 10_000] @ ways.T > 0.0).sum() for a in range(0, count, 10_000)))
    step(f"{form}: memory")
    return {
        "mesh": name, "points": count, "directions": len(ways), "rays": live, "threads": threads,
        "seconds": statistics.median(times), "peers": peers,
        "written": written(octree, (points, normals, ways), on), "shadow": shadow(octree, count),
        "memory": memory(form, faces, count, threads), "array": 24 * count * len(ways),
    }  # fmt: skip


def written(octree: Octree, where: tuple[Floats, Floats, Floats], on: NDArray[np.int64]) -> float:
    """Rays a second of ``Octree.any_hit`` with rays that are written down, direction by direction along the curve."""
    points, normals, ways = where
    order = order_along_curve(points)[0]
    middle = order[len(order) // 2 :][:_WRITTEN]
    direction, row = np.nonzero((normals[middle] @ ways.T > 0.0).T)
    rows = middle[row]
    starts, toward, leaving = points[rows], ways[direction], on[rows]
    times = []
    for _ in range(_RUNS):
        began = time.perf_counter()
        octree.any_hit(starts, toward, leaving=leaving)
        times.append(time.perf_counter() - began)
    return len(rows) / statistics.median(times)


def shadow(octree: Octree, count: int) -> float:
    """Shadow rays a second, of as many as points: from what a camera sees to one light, in the order of pixels."""
    family = families(octree, count)[1]
    times = []
    for _ in range(1 + _RUNS):
        began = time.perf_counter()
        octree.any_hit(family.origins, family.directions, t_max=family.t_max)
        times.append(time.perf_counter() - began)
    return count / statistics.median(times[1:])


def memory(form: str, faces: int, count: int, threads: int) -> int:
    """Bytes by which a process grows at most while it asks ours, result included."""
    command = child.command("validation.benchmark.measures.studies:grow", form, str(faces), str(count), str(threads))
    answer = subprocess.run(command, env=child.environment(), capture_output=True, text=True, check=True)
    return int(json.loads(answer.stdout.splitlines()[-1]))


def grow(form: str, faces: str, count: str, threads: str) -> None:
    """Entry point of the child process of ``memory``: print the bytes."""
    mesh, points, normals, on, ways = scene(form, int(faces), int(count))
    octree = Octree.from_mesh(mesh, split=SPLIT)
    occlusion(octree, points[:2000], normals[:2000], ways, leaving=on[:2000], packed=True, threads=int(threads))
    before = resident()
    occlusion(octree, points, normals, ways, leaving=on, packed=True, threads=int(threads))
    print(json.dumps(most_resident() - before))


def text(row: dict[str, Any]) -> str:
    """The lines of one row."""
    rate = row["rays"] / row["seconds"]
    lines = [
        f"{row['mesh']}: {row['points']} points, {row['directions']} directions, {row['rays']} rays above horizons, "
        f"{row['threads']} threads",
        f"  ours {row['seconds']:.2f} s, {rate / 1e6:.1f} million rays/s, {rate / row['written']:.2f} times any_hit's "
        f"{row['written'] / 1e6:.1f} with rays written down, {rate / row['shadow']:.2f} times the "
        f"{row['shadow'] / 1e6:.1f} of shadow rays; "
        f"{row['memory'] / 1e6:.0f} MB, {row['memory'] / row['array']:.3f} of an array of all rays",
    ]
    for label, peer in row["peers"].items():
        first = "directions" if peer["by_direction"] else "points"
        lines.append(
            f"  {label} {peer['whole']:.2f} s ({peer['whole'] / row['seconds']:.2f} times ours), {peer['batch']} "
            f"points a call, {first} first; its calls {peer['bare']:.2f} s ({peer['bare'] / row['seconds']:.2f}); "
            f"{peer['differing']} bits differ, {peer['differing'] / row['rays']:.1e} of the rays"
        )
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m validation.benchmark.measures.studies", description=__doc__)
    parser.add_argument("--mesh", nargs="+", choices=sorted(FORMS), default=list(KINDS))
    parser.add_argument("--faces", type=int, default=SIZE)
    parser.add_argument("--points", type=int, default=SIZE)
    parser.add_argument("--threads", type=int, default=2)
    options = parser.parse_args(arguments)
    for form in options.mesh:
        print(text(measure(form, options.faces, options.points, options.threads, lambda _: None)), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())

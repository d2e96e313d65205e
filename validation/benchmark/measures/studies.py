"""Points that look in the 145 directions of Tregenza's sky over a city and a terrain: ours beside Open3D.

``python -m validation.benchmark.measures.studies`` prints both. Peers get their rays as arrays, as they ask for them;
what a point's own plane hides is left out. Their rays start off the surface by an epsilon, ours by its own rule, so
some bits differ. Memory is measured in processes of their own. Ours has the tree of ``octree-render study``.
"""

import argparse
import itertools
import json
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.octree import Octree
from renderer.ordering.morton import order_along_curve
from renderer.studies import occlusion, tregenza
from renderer.studies.directions import turned
from renderer.system import child
from renderer.system.threads import available_threads
from validation.benchmark.measures.families import families
from validation.benchmark.measures.forms import FORMS
from validation.benchmark.measures.memory import most_resident, resident
from validation.timing import RUNS, median_seconds, timed

Floats = NDArray[np.float64]
Test = Callable[[NDArray[np.float32]], NDArray[np.bool_]]

_SEED = 1
_UP = np.array([0.0, 1.0, 0.0])
# Points of one call of a peer: fewer take longer in Python, more do not stay in the caches. The best counts.
_BATCHES = (300, 1000, 3000)
# As a share of the width of a face: what moves a peer's rays off the surface.
_EPSILON = 1e-4
# Rays that are written down, for the rate of ``Octree.any_hit``.
_WRITTEN = 16_000
# Points of the rounds that are not timed.
_WARM = 2_000
# The kinds of mesh that studies are made for; their faces, and as many points, in full and in quick runs.
KINDS = ("city", "terrain")
SIZE, QUICK_SIZE = 1_000_000, 50_000


class Views(NamedTuple):
    """Points spread evenly over a mesh, which look in the directions of Tregenza's sky.

    points, normals, faces   where, the normal there, and the face
    directions               unit vectors
    """

    mesh: Mesh
    points: Floats
    normals: Floats
    faces: NDArray[np.int64]
    directions: Floats

    def first(self, count: int) -> "Views":
        """The same of the first points alone, for a round that is not timed."""
        return self._replace(points=self.points[:count], normals=self.normals[:count], faces=self.faces[:count])

    def above(self, rows: Any) -> NDArray[np.bool_]:
        """The directions above the horizons of the points of some rows."""
        up: NDArray[np.bool_] = self.normals[rows] @ self.directions.T > 0.0
        return up

    def hidden(self, octree: Octree, threads: int) -> NDArray[Any]:
        """Ours: the bits of what is hidden from each point."""
        return occlusion(octree, self.points, self.normals, self.directions, leaving=self.faces, packed=True,
                         threads=threads)  # fmt: skip


class PeerAnswer(NamedTuple):
    """Seconds of a peer's bare calls and of all that its user does, and the bits of what is hidden."""

    bare: float
    whole: float
    bits: NDArray[np.uint8]


def run(quick: bool, step: Callable[[str], None]) -> list[dict[str, Any]]:
    """The rows of the benchmark, on all threads."""
    size = QUICK_SIZE if quick else SIZE
    return [measure(kind, size, size, available_threads(), step) for kind in KINDS]


def views(form: str, faces: int, count: int) -> Views:
    """Of ``count`` points on a mesh of a kind of ``FORMS``."""
    mesh, rng = FORMS[form](faces), np.random.default_rng(_SEED)
    corners = mesh.triangles
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    on = rng.choice(len(corners), count, p=area / area.sum())
    u, v = rng.random((2, count))
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    a, b, c = np.moveaxis(corners[on], 1, 0)
    points = a + u[:, None] * (b - a) + v[:, None] * (c - a)
    return Views(mesh, points, mesh.face_normals()[on], on, turned(tregenza().directions, _UP))


def testers(mesh: Mesh, threads: int) -> dict[str, Test]:
    """The any-hit queries of the peers that are installed: rays (n, 6) float32 to bools."""
    try:
        from validation.benchmark.peers.open3d import occlusion_test
    except ImportError:
        return {}
    return {"open3d": occlusion_test(mesh.vertices, mesh.faces, threads)}


def ask_peer(test: Test, of: Views, epsilon: float, batch: int, by_direction: bool) -> PeerAnswer:
    """Ask for ``batch`` points a call, in the order of a curve; rays in the order of directions or of points."""
    bits, bare, began = np.zeros((len(of.points), -(-len(of.directions) // 8)), np.uint8), 0.0, time.perf_counter()
    order = order_along_curve(of.points)[0]
    single = of.directions.astype(np.float32)
    for first in range(0, len(of.points), batch):
        rows = order[first : first + batch]
        start, up = (of.points[rows] + epsilon * of.normals[rows]).astype(np.float32), of.above(rows)
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
    return PeerAnswer(bare, time.perf_counter() - began, bits)


def measure(form: str, faces: int, count: int, threads: int, step: Callable[[str], None]) -> dict[str, Any]:
    """One row: seconds of ours (the median) and of each peer (its best way), differing bits, rates and memory."""
    of = views(form, faces, count)
    step(f"{form}: octree")
    octree = Octree.from_mesh(of.mesh, threads=threads)
    of.first(_WARM).hidden(octree, threads)
    bits, ours, times, peers = of.hidden(octree, threads), timed(of.hidden, octree, threads), [], {}
    for label, test in testers(of.mesh, threads).items():
        ask_peer(test, of.first(_WARM), _off(faces), 1000, True)
        answers = {}
        for way in itertools.product(_BATCHES, (True, False)):
            step(f"{form}: {label}, {way[0]} points a call, {'directions' if way[1] else 'points'} first")
            answers[way] = ask_peer(test, of, _off(faces), *way)
            # In turn with the peer's, so that both see the same machine.
            times.append(ours())
        best = min(answers, key=lambda way: answers[way].whole)
        differing = np.unpackbits(bits ^ answers[best].bits, axis=1, count=len(of.directions))
        peers[label] = {
            "bare": min(answer.bare for answer in answers.values()), "whole": answers[best].whole,
            "batch": best[0], "by_direction": best[1], "differing": int(differing.sum()),
        }  # fmt: skip
    times += [ours() for _ in range(len(times), RUNS)]
    step(f"{form}: memory")
    return {
        "mesh": f"{form}, {len(of.mesh.faces)} faces", "points": count, "directions": len(of.directions),
        "rays": sum(int(of.above(slice(a, a + 10_000)).sum()) for a in range(0, count, 10_000)), "threads": threads,
        "seconds": statistics.median(times), "peers": peers,
        "written": written(octree, of), "shadow": shadow(octree, count),
        "memory": memory(form, faces, count, threads), "array": 24 * count * len(of.directions),
    }  # fmt: skip


def _off(faces: int) -> float:
    """The distance of a peer's rays from the surface: a share of the width of a face, of which twelve are a block."""
    return _EPSILON * 2.0 / (faces / 12.0) ** 0.5


def written(octree: Octree, of: Views) -> float:
    """Rays a second of ``Octree.any_hit`` with rays that are written down, direction by direction along the curve."""
    order = order_along_curve(of.points)[0]
    middle = order[len(order) // 2 :][:_WRITTEN]
    direction, row = np.nonzero(of.above(middle).T)
    rows = middle[row]
    return _rate(partial(octree.any_hit, of.points[rows], of.directions[direction], leaving=of.faces[rows]), len(rows))


def shadow(octree: Octree, count: int) -> float:
    """Shadow rays a second, of as many as points: from what a camera sees to one light, in the order of pixels."""
    family = families(octree, count)[1]
    return _rate(partial(octree.any_hit, family.origins, family.directions, t_max=family.t_max), count)


def _rate(call: Callable[[], Any], rays: int) -> float:
    """Rays a second of a call that asks so many."""
    return rays / median_seconds({"": timed(call)}, RUNS)[""]


def memory(form: str, faces: int, count: int, threads: int) -> int:
    """Bytes by which a process grows at most while it asks ours, result included."""
    command = child.command("validation.benchmark.measures.studies:grow", form, str(faces), str(count), str(threads))
    answer = subprocess.run(command, env=child.environment(), capture_output=True, text=True, check=True)
    return int(json.loads(answer.stdout.splitlines()[-1]))


def grow(form: str, faces: str, count: str, threads: str) -> None:
    """Entry point of the child process of ``memory``: print the bytes."""
    of = views(form, int(faces), int(count))
    octree = Octree.from_mesh(of.mesh)
    of.first(_WARM).hidden(octree, int(threads))
    before = resident()
    of.hidden(octree, int(threads))
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

"""A study on one and two workers of a local cluster beside one and two threads of one process, and what a part costs.

``python -m validation.benchmark.measures.cluster`` writes ``validation/benchmark/cluster.json``, from which
``validation.benchmark.scaling`` computes what more workers would do. All sides take turns, five rounds.

command, date, environment, load            how the record was made
mesh, faces, bytes, points, directions      what is asked of how many points; bytes: of the mesh as it is sent
size, small                                 points of a part, as in a study's run, and of smaller parts
seconds       by name, of all rounds:
              call_1, call_2          all points in one call, threads of one process
              run_1, run_2            in parts of ``size`` kept on disk, and joined: the same
              workers_1, workers_2    the same on workers of one thread each that have the tree
              built_1, built_2        the same on workers that must build it
              tree_1, tree_2          the tree, by threads
              send_1, send_2          the mesh to one worker, to both
              planned, joined         digests and order of all points; the result of all parts
parts         by points of a part: seconds of each in one process, one thread, medians
costs         CPU seconds of runs by two workers with next to nothing to compute, by points of a part and of one point,
              "one": driver (scheduler included), workers (all), alone (the same answers without a cluster)
task          seconds of an empty task alone; rate: empty tasks a second of many at once
"""

import argparse
import json
import os
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from renderer.checkpoints import study as runs
from renderer.checkpoints.parts import Parts, digest_of
from renderer.checkpoints.study_points import on_faces
from renderer.cli.study import SPLIT
from renderer.cluster import connected, run_on
from renderer.cluster.workers import SentMesh
from renderer.errors import expect
from renderer.mesh.mesh import Mesh
from renderer.octree import Octree
from renderer.system.files import write_atomically
from renderer.system.threads import available_threads
from validation import environment
from validation.benchmark.measures.meshes import named
from validation.timing import timed

RECORD = Path(__file__).resolve().parents[1] / "cluster.json"
ROUNDS = 5
MESH = "city_1m"
_SMALL = runs.PART // 8
_UP = (0.0, 1.0, 0.0)
# One ray of no length a point: what is left is the way of a part there and back.
_LEAST = runs.Study("ao", {"samples": 1, "distance": 0.0})
_ALONE, _AT_ONCE = 200, 2000


class Measured:
    """One mesh, its points, and a client of one worker and of two.

    The seconds of a run are those until the result is in memory. ``sent`` is what clusters get: the same tree, over a
    mesh that differs in each round, by vertices that no face has.
    """

    def __init__(self, mesh: str, clients: Sequence[Any], folder: Path) -> None:
        self.mesh, self.clients, self.folder, self.rounds = named(mesh), clients, folder, 0
        self.trees = {k: Octree.from_mesh(self.mesh, split=SPLIT, threads=k) for k in (1, 2)}
        self.points, self.study = on_faces(self.trees[2]).points, runs.Study("sky", {"up": _UP})
        self.sent = self.trees[2]

    def next_round(self) -> None:
        """From now on clusters get a mesh that they have never seen."""
        self.rounds += 1
        more = np.repeat(self.mesh.vertices[:1], self.rounds, axis=0)
        mesh = Mesh(np.concatenate([self.mesh.vertices, more]), self.mesh.faces)
        self.sent = Octree.from_mesh(mesh, split=SPLIT, threads=2)

    def call(self, threads: int) -> float:
        """All points in one call."""
        return timed(self.study.answer, self.trees[threads], self.points)()

    def tree(self, threads: int) -> float:
        """The tree from the mesh."""
        return timed(lambda: Octree.from_mesh(self.mesh, split=SPLIT, threads=threads))()

    def run(self, threads: int) -> float:
        """The points in parts on disk, in one process."""
        return self._seconds(lambda folder: runs.run(self.trees[threads], self.study, self.points, folder))

    def workers(self, client: Any, study: runs.Study, points: runs.Points, size: int = runs.PART) -> float:
        """A study on a cluster; the first of a round builds the tree there."""
        return self._seconds(lambda folder: run_on(client, self.sent, study, points, folder, size=size, split=SPLIT))

    def send(self, client: Any) -> float:
        """The mesh to all workers, as a run sends it."""
        sent = SentMesh(digest_of(self.mesh.vertices), self.mesh.vertices, self.mesh.faces, SPLIT)
        return timed(lambda: client.scatter(sent, broadcast=True, hash=False))()

    def parts(self, size: int) -> list[float]:
        """Seconds of each part on one thread of one process."""
        order = self.points.order()
        pieces = [self.points.part(order[first : first + size]) for first in range(0, len(order), size)]
        return [timed(self.study.answer, self.trees[1], piece)() for piece in pieces]

    def ends(self) -> tuple[float, float]:
        """Seconds of what comes before the parts and behind them."""
        with tempfile.TemporaryDirectory(dir=self.folder) as name:
            began = time.perf_counter()
            parts = runs.parts_of(self.trees[1], self.study, self.points, Path(name) / "parts", runs.PART)
            planned = time.perf_counter() - began
            for part in range(parts.plan.parts):
                parts.write(part, np.zeros(len(range(*parts.plan.span(part)))))
            return planned, timed(parts.joined)()

    def costs(self, client: Any, points: runs.Points, size: int) -> dict[str, float]:
        """CPU seconds of a study with next to nothing to compute."""
        before, began = client.run(time.process_time), time.process_time()
        self.workers(client, _LEAST, points, size)
        driver, after = time.process_time() - began, client.run(time.process_time)
        began, order = time.process_time(), points.order()
        for first in range(0, len(order), size):
            _LEAST.answer(self.trees[1], points.part(order[first : first + size]))
        alone = time.process_time() - began
        return {"driver": driver, "workers": sum(after[w] - before[w] for w in after), "alone": alone}

    def _seconds(self, run: Callable[[Path], Parts]) -> float:
        with tempfile.TemporaryDirectory(dir=self.folder) as name:
            return timed(lambda: run(Path(name) / "parts").joined())()


def nothing(k: int) -> int:
    """The empty task."""
    return k


def tasks(client: Any) -> tuple[float, float]:
    """Seconds of an empty task, the median of those asked one by one, and empty tasks a second, all at once."""
    alone = [timed(lambda k=k: client.submit(nothing, k, pure=False).result())() for k in range(_ALONE)]
    began = time.perf_counter()
    client.gather(client.map(nothing, range(_AT_ONCE), pure=False))
    return statistics.median(alone), _AT_ONCE / (time.perf_counter() - began)


def measure(mesh: str, rounds: int, step: Callable[[str], None]) -> dict[str, Any]:
    """The record, but for how it was made."""
    expect(available_threads() >= 2, "processors", "two or more", str(available_threads()))
    seconds: dict[str, list[float]] = {}
    parts: dict[int, list[list[float]]] = {runs.PART: [], _SMALL: []}
    costs: list[dict[str, dict[str, float]]] = []
    rates: list[tuple[float, float]] = []
    with ExitStack() as stack:
        clients = [stack.enter_context(connected(workers=k)) for k in (1, 2)]
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="cluster-")))
        asked = Measured(mesh, clients, folder)
        # What is compiled, or read from the kept kernels, is no part of it; afterwards the workers have the tree.
        for threads in (1, 2):
            asked.call(threads)
        for client in clients:
            asked.workers(client, asked.study, asked.points)
            asked.workers(client, _LEAST, asked.points)
        for number in range(rounds):
            asked.next_round()
            step(f"round {number + 1} of {rounds}")
            for name, found in _round(asked).items():
                seconds.setdefault(name, []).append(found)
            for size, rows in parts.items():
                rows.append(asked.parts(size))
            sizes = {str(size): asked.costs(clients[1], asked.points, size) for size in parts}
            costs.append(sizes | {"one": asked.costs(clients[1], asked.points.part(slice(0, 1)), 1)})
            rates.append(tasks(clients[1]))
    return {
        "mesh": mesh, "faces": len(asked.mesh.faces), "bytes": asked.mesh.vertices.nbytes + asked.mesh.faces.nbytes,
        "points": len(asked.points), "directions": 145, "size": runs.PART, "small": _SMALL, "seconds": seconds,
        "parts": {str(size): np.median(rows, axis=0).tolist() for size, rows in parts.items()},
        "costs": {size: {of: statistics.median(c[size][of] for c in costs) for of in costs[0][size]}
                  for size in costs[0]},
        "task": statistics.median(r[0] for r in rates), "rate": statistics.median(r[1] for r in rates),
    }  # fmt: skip


def _round(asked: Measured) -> dict[str, float]:
    """Each of the seconds once; the clusters have not seen the mesh."""
    found: dict[str, float] = {}
    for k, client in enumerate(asked.clients, 1):
        found |= {
            f"call_{k}": asked.call(k), f"run_{k}": asked.run(k), f"tree_{k}": asked.tree(k),
            f"built_{k}": asked.workers(client, asked.study, asked.points),
            f"workers_{k}": asked.workers(client, asked.study, asked.points), f"send_{k}": asked.send(client),
        }  # fmt: skip
    found["planned"], found["joined"] = asked.ends()
    return found


def text(record: dict[str, Any]) -> str:
    """What was measured, in lines."""
    of = {name: statistics.median(values) for name, values in record["seconds"].items()}
    lines = [f"{record['mesh']}: {record['points']:,} points x {record['directions']}, medians of "
             f"{len(record['seconds']['run_1'])} rounds, load {record['load']:.2f} before"]  # fmt: skip
    for name, values in record["seconds"].items():
        lines.append(f"  {name:10} {of[name]:.3f} s ({min(values):.3f} to {max(values):.3f})")
    lines.append(f"  two workers: {of['run_2'] / of['workers_2']:.3f} of two threads in parts, "
                 f"{of['call_2'] / of['workers_2']:.3f} of one call; the tree included "
                 f"{(of['run_2'] + of['tree_2']) / of['built_2']:.3f}")  # fmt: skip
    lines.append(
        f"  empty task {1e3 * record['task']:.1f} ms alone, {record['rate']:.0f}/s at once; costs {record['costs']}"
    )
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m validation.benchmark.measures.cluster", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)  # fmt: skip
    parser.add_argument("--mesh", default=MESH)
    parser.add_argument("--rounds", type=int, default=ROUNDS)
    parser.add_argument("-o", "--output", type=Path, default=RECORD, metavar="FILE")
    options = parser.parse_args(arguments)
    given = sys.argv[1:] if arguments is None else arguments
    load, date = os.getloadavg()[0] if hasattr(os, "getloadavg") else 0.0, datetime.now(UTC)
    record = {
        "command": " ".join(["python -m validation.benchmark.measures.cluster", *map(str, given)]),
        "date": date.isoformat(timespec="seconds"), "environment": environment.describe(), "load": load,
        **measure(options.mesh, options.rounds, lambda said: print(said, file=sys.stderr, flush=True)),
    }  # fmt: skip
    written = (json.dumps(record, indent=1) + "\n").encode()
    write_atomically(options.output, lambda file: file.write(written))
    print(text(record))
    return 0


if __name__ == "__main__":
    sys.exit(main())

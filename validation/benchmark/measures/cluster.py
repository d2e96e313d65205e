"""A study on one and two workers of a local cluster beside one and two threads of one process.

``python -m validation.benchmark.measures.cluster`` prints the seconds that ``docs/guides/cluster.md`` has. All sides
take turns.
"""

import argparse
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from renderer.arguments.split import SPLIT
from renderer.checkpoints import study as runs
from renderer.checkpoints.parts import Parts, digest_of
from renderer.cluster import connected, run_on
from renderer.cluster.workers import SentMesh
from renderer.errors import expect
from renderer.mesh.mesh import Mesh
from renderer.octree import Octree
from renderer.studies.points import on_faces
from renderer.system.threads import available_threads
from validation.benchmark.measures.meshes import named
from validation.timing import RUNS, interleaved, timed

MESH = "city_1m"
# What is measured, by one and by two threads or workers.
ROWS = {
    "call": "threads of one process, one call",
    "run": "threads of one process, in parts on disk",
    "built": "workers of one thread that build the tree first",
    "workers": "workers of one thread that have the tree",
    "tree": "the tree alone, by threads",
    "send": "the mesh to all workers",
}
_ALONE, _AT_ONCE = 200, 2000


class Tasks(NamedTuple):
    """Seconds of an empty task alone, there and back, and empty tasks a second of many at once."""

    alone: float
    rate: float


class Compared:
    """The sky view factor of a mesh's faces, by this process and by clusters, which keep their parts in ``folder``."""

    def __init__(self, mesh: Mesh, folder: Path) -> None:
        self.mesh, self.folder, self.sent = mesh, folder, Octree.from_mesh(mesh)
        self.points, self.study = on_faces(self.sent).points, runs.Study("sky", {"up": (0.0, 1.0, 0.0)})
        self._meshes_sent = 0

    def calls(self, threads: int, client: Any) -> dict[str, Callable[[], float]]:
        """The seconds of each of ``ROWS``, on so many threads or the workers of ``client``."""
        tree = Octree.from_mesh(self.mesh, threads=threads)
        sent = SentMesh(digest_of(self.mesh.vertices), self.mesh.vertices, self.mesh.faces, SPLIT)
        return {
            "call": timed(self.study.evaluate, tree, self.points),
            "run": lambda: self._seconds(lambda folder: runs.run(tree, self.study, self.points, folder)),
            "built": lambda: self._on_new_mesh(client),
            "workers": lambda: self._on(client),
            "tree": timed(lambda: Octree.from_mesh(self.mesh, threads=threads)),
            "send": timed(lambda: client.scatter(sent, broadcast=True, hash=False)),
        }

    def _on_new_mesh(self, client: Any) -> float:
        """On a mesh that no worker has seen: it has a vertex more, which no face has."""
        self._meshes_sent += 1
        more = np.repeat(self.mesh.vertices[:1], self._meshes_sent, axis=0)
        mesh = Mesh(np.concatenate([self.mesh.vertices, more]), self.mesh.faces)
        self.sent = Octree.from_mesh(mesh)
        return self._on(client)

    def _on(self, client: Any) -> float:
        return self._seconds(lambda folder: run_on(client, self.sent, self.study, self.points, folder))

    def _seconds(self, run: Callable[[Path], Parts]) -> float:
        """Seconds until the result is in memory."""
        with tempfile.TemporaryDirectory(dir=self.folder) as name:
            return timed(lambda: run(Path(name) / "parts").joined())()


def measure(mesh: Mesh, rounds: int) -> tuple[dict[str, list[list[float]]], Tasks]:
    """Seconds of all rounds for each of ``ROWS``, by one and by two; and what an empty task costs."""
    expect(available_threads() >= 2, "processors", "two or more", str(available_threads()))
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="cluster-")))
        compared = Compared(mesh, folder)
        calls: dict[str, Callable[[], float]] = {}
        clients = [stack.enter_context(connected(workers=k)) for k in (1, 2)]
        for k, client in enumerate(clients, 1):
            calls |= {f"{name}_{k}": call for name, call in compared.calls(k, client).items()}
        seconds = interleaved(calls, rounds)
        return {name: [seconds[f"{name}_{k}"] for k in (1, 2)] for name in ROWS}, _tasks(clients[1])


def nothing(k: int) -> int:
    """The empty task."""
    return k


def _tasks(client: Any) -> Tasks:
    alone = [timed(lambda k=k: client.submit(nothing, k, pure=False).result())() for k in range(_ALONE)]
    began = time.perf_counter()
    client.gather(client.map(nothing, range(_AT_ONCE), pure=False))
    return Tasks(statistics.median(alone), _AT_ONCE / (time.perf_counter() - began))


def main(arguments: Sequence[str] | None = None) -> int:
    """Print medians and ranges, by one and by two."""
    parser = argparse.ArgumentParser(prog="python -m validation.benchmark.measures.cluster", description=__doc__)
    parser.add_argument("--mesh", default=MESH)
    parser.add_argument("--rounds", type=int, default=RUNS)
    options = parser.parse_args(arguments)
    mesh = named(options.mesh)
    seconds, tasks = measure(mesh, options.rounds)
    print(f"{options.mesh}, {len(mesh.faces)} faces: seconds by one and by two, medians and ranges")
    for name, said in ROWS.items():
        shown = (f"{statistics.median(of):7.3f} ({min(of):.3f} to {max(of):.3f})" for of in seconds[name])
        print(f"{said:48} {'   '.join(shown)}")
    print(f"an empty task takes {1e3 * tasks.alone:.1f} ms; {tasks.rate:.0f} a second at once")
    return 0


if __name__ == "__main__":
    sys.exit(main())

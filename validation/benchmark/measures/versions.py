"""Two commits of the renderer beside each other: the same rays in turn, in a process each.

``python -m validation.benchmark.measures.versions BEFORE AFTER --mesh city_100k`` prints for each family the time
before over the time after, and whether the answers have the same bits. The ratios of ``docs/history.md`` come from it.
"""

import argparse
import json
import os
import subprocess
import sys
import tarfile
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np

from renderer.errors import expect
from renderer.octree import Octree
from validation.benchmark.measures import version_child
from validation.benchmark.measures.families import families
from validation.benchmark.measures.meshes import named
from validation.timing import interleaved, ratio

# Seven rounds, because a difference of a few per cent decides.
_RUNS = 7
# The families that ask whether there is a hit; the others ask for the closest.
_ANY = ("shadow",)
_HERE = Path(__file__).resolve().parents[3]


class Version:
    """The renderer of a commit, with one mesh, in a process of its own."""

    def __init__(self, commit: str, folder: Path, mesh: Path, repository: Path = _HERE) -> None:
        archive = folder / "commit.tar"
        made = subprocess.run(
            ["git", "-C", str(repository), "archive", "-o", str(archive), commit, "renderer"],
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        expect(made.returncode == 0, "commit", "one with the package renderer", f"{commit!r}: {made.stderr.strip()}")
        with tarfile.open(archive) as packed:
            packed.extractall(folder, filter="data")
        command = [sys.executable, "-P", version_child.__file__, str(folder), str(mesh)]
        environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder / "kernels")}
        self._child = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment
        )

    def ask(self, rays: Path, query: str, threads: int) -> tuple[str, float]:
        """The digest of the answer, and its seconds."""
        assert self._child.stdin is not None and self._child.stdout is not None  # pipes, see above
        self._child.stdin.write(json.dumps({"rays": str(rays), "query": query, "threads": threads}) + "\n")
        self._child.stdin.flush()
        line = self._child.stdout.readline()
        if not line:
            raise OSError("a version ended before it answered; its error stands above")
        digest, seconds = json.loads(line)
        return digest, seconds

    def __enter__(self) -> "Version":
        return self

    def __exit__(self, *_: object) -> None:
        assert self._child.stdin is not None and self._child.stdout is not None  # pipes, see above
        self._child.stdin.close()
        self._child.stdout.close()
        self._child.wait()


def compare(
    commits: tuple[str, str], mesh: str, count: int, threads: int, repository: Path = _HERE
) -> Iterator[dict[str, Any]]:
    """A row for each family of ``count`` rays: nanoseconds a ray of both commits, their ratio, and whether the answers
    are the same bits. Raises ``ValueError`` for a commit that is not there.
    """
    with tempfile.TemporaryDirectory() as name, ExitStack() as stack:
        folder, built = Path(name), named(mesh)
        np.savez(folder / "mesh.npz", vertices=built.vertices, faces=built.faces)
        versions = {}
        for side, commit in zip(("before", "after"), commits, strict=True):
            (folder / side).mkdir()
            version = Version(commit, folder / side, folder / "mesh.npz", repository)
            versions[side] = stack.enter_context(version)
        for family in families(Octree.from_mesh(built), count):
            rays = folder / f"{family.name}.npz"
            np.savez(rays, origins=family.origins, directions=family.directions, t_max=family.t_max)
            yield {"mesh": mesh, "family": family.name} | _row(versions, rays, family.name in _ANY, count, threads)


def _row(versions: dict[str, Version], rays: Path, any_hit: bool, count: int, threads: int) -> dict[str, Any]:
    query = "any" if any_hit else "closest"
    digests = {version.ask(rays, query, threads)[0] for version in versions.values()}
    calls = {side: lambda v=version: v.ask(rays, query, threads)[1] for side, version in versions.items()}
    seconds = interleaved(calls, _RUNS)
    return {
        "query": query,
        "ns": {side: sorted(runs)[_RUNS // 2] / count * 1e9 for side, runs in seconds.items()},
        "ratio": ratio(seconds["before"], seconds["after"]),
        "same_bits": len(digests) == 1,
    }


def main(arguments: Sequence[str] | None = None) -> int:
    """Print a line for each mesh and family."""
    parser = argparse.ArgumentParser(prog="python -m validation.benchmark.measures.versions", description=__doc__)
    parser.add_argument("before", help="a commit")
    parser.add_argument("after", help="another")
    parser.add_argument(
        "--mesh", nargs="+", default=["100000"], help="as of measures.queries: 100000, city_100k, a file"
    )
    parser.add_argument("--rays", type=int, default=2_000_000, metavar="N", help="rays of a family")
    parser.add_argument("--threads", type=int, default=2, metavar="N")
    options = parser.parse_args(arguments)
    for mesh in options.mesh:
        for row in compare((options.before, options.after), mesh, options.rays, options.threads):
            bits = "same bits" if row["same_bits"] else "OTHER BITS"
            times = f"{row['ns']['before']:.1f} -> {row['ns']['after']:.1f} ns a ray, {row['ratio']:.2f} times as fast"
            print(f"{mesh}: {row['family']}, {row['query']}: {times}, {bits}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())

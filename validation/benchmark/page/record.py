"""The record of a run, ``benchmark.json``: its keys, reading and writing. The page is drawn from it alone.

schema            SCHEMA; another number is refused
command, date, commit, quick, seconds      how the record was made; commit is null outside a git checkout
environment       processor, processors, threads, python, platform, packages (version or null), libllvm (or null),
                  load: mean number of processes that wanted to run in the minute before the run, or null;
                  limited: the level of processors to which our kernels were limited, or null
systems           by name: label, threads, precision, most_rays (null: no limit)
missing           by name: how to install a peer that is absent
series            names of the generated meshes, which differ in size only
kinds             by mesh: spheres, another kind of ``forms``, or file. Other kinds are asked for first hits only: the
                  closest by all families, any by shadow and short, and not of contenders with most_rays
open_edges        by mesh that is not closed, of spheres and files: how many. Nothing is inside, so it has no rows of
                  contains and signed
queries[]         one a mesh, family and kind of query
  mesh, faces, family, query     family: camera, shadow, random, bounce, misses, short;
                                 of points: wide, box, near
                                 query: closest, any, all, count; of points: contains, nearest, signed
  rays, hit_share, agree         rays or points; those that hit, are inside or are found; agree: some do (of misses
                                 none), and but for one in a thousand no contender differs from ours by more than
                                 rounding
  contenders        by name: rays, hits, differing (see ``kinds``), seconds (all runs), median, mrays, ns
  ratios            by peer: the median over the rounds of its time a ray or point over ours with all threads
  ratios_one_thread by peer that has one thread: its time over ours_one_thread
  efficiency        of first hits: the time of one thread of ours over twice that of two; null for other queries and
                    on one processor
drop_in[]         call, faces, rays; seconds a ray by contender (all runs), ratios: theirs over the drop-in's
calls[]           rays; micros a call by contender (all runs), median; ratios by peer: its time over ours with all
                  threads, and over ours_one_thread where it has one
studies[]         mesh, points, directions, rays (those above horizons), threads, seconds; written, shadow: rays a
                  second of any_hit; memory, array: bytes that it takes, and that all rays would
  peers           by name: bare (seconds of its calls), whole, batch, by_direction, differing bits
scenes            instances, faces: of the large scene, which has bytes an instance of our arrays, grown (by which
                  Python's memory grows), move: seconds until the next answer (all runs), median
  rows[]          scene, instances, faces, rays, family, hit_share; by contender: differing (rays that one of both
                  misses), contenders: seconds, median; ratios: theirs over ours, of octree (the same faces) and
                  mitsuba_instances
builds[]          mesh, faces, contenders: seconds, median; ratios: theirs over ours_sah; ratios_refit: the build
                  of each peer over our refit
memory[]          mesh, faces, systems: rest, peak (bytes by which a process grows), own (our own count or null)
frames            scene, size, max_depth, faces, labels, contenders, ratios, rays (by contender), pictures: ssim,
                  mean_error, pixel_share against ours
processes         by name: command, seconds, median
first_answers     level, for which kernels were compiled ahead; rows by name: unit, values, median; null where not run
trees             faces, rays (one thread); differing_rays: with other bits than the default tree's, of all trees
  points[]        name, build_seconds, bytes, ns_per_ray (by family), differing_rays
  sweeps, fronts  names of points: by option, in its order; by family, those that none beats in build and rays
targets[]         see ``targets.Target``; met and aimed are null where nothing was measured
heat map          is none of the keys: ``heat`` takes it from queries, builds, memory and calls
"""

import json
import os
import subprocess
from collections.abc import Mapping, Sequence
from importlib import metadata
from pathlib import Path
from typing import Any

from renderer.system.files import write_atomically
from validation import environment
from validation.benchmark.limited import limited
from validation.benchmark.peers.contender import System

SCHEMA = 9
KEYS = (
    "schema", "command", "date", "commit", "quick", "seconds", "environment", "systems", "missing", "series",
    "kinds", "open_edges", "queries", "drop_in", "calls", "studies", "scenes", "builds", "memory", "frames",
    "processes", "first_answers", "trees", "targets",
)  # fmt: skip
_MORE_PACKAGES = ("open3d", "rtree", "scipy", "matplotlib")


def describe(libllvm: str | None, load: float | None) -> dict[str, Any]:
    """The environment: ``validation.environment`` and what only the benchmark uses."""
    found: dict[str, Any] = environment.describe()
    packages = {name: _version(name) for name in _MORE_PACKAGES}
    return found | {"packages": found["packages"] | packages, "libllvm": libllvm, "load": load, "limited": limited()}


def described(systems: Sequence[System]) -> dict[str, Any]:
    """The contenders by name."""
    return {
        s.name: {"label": s.label, "threads": s.threads, "precision": s.precision, "most_rays": s.most_rays}
        for s in systems
    }


def load() -> float | None:
    """Mean number of processes that wanted a processor in the last minute; None where the system does not report it."""
    return os.getloadavg()[0] if hasattr(os, "getloadavg") else None


def commit() -> str | None:
    """The checkout's commit, with a + where files differ from it; None without git or a checkout."""
    folder = Path(__file__).parent
    try:
        top, head, changed = (
            subprocess.run(["git", *arguments], cwd=folder, capture_output=True, text=True, check=True).stdout.strip()
            for arguments in (["rev-parse", "--show-toplevel"], ["rev-parse", "HEAD"], ["status", "--porcelain"])
        )
    except (OSError, subprocess.CalledProcessError):
        return None
    # A copy without git may lie in a repository of something else.
    if Path(top).resolve() != Path(__file__).resolve().parents[3]:
        return None
    return head + ("+" if changed else "")


def write(record: Mapping[str, Any], path: Path) -> None:
    """Write the whole file or nothing; raises ``ValueError`` for NaN and infinities, which JSON lacks."""
    _expect_keys(record, "record")
    text = json.dumps(record, indent=1, allow_nan=False)
    write_atomically(path, lambda file: file.write(text.encode()))


def read(path: Path) -> dict[str, Any]:
    """A stored record. Raises ``ValueError`` for another schema or missing parts."""
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise ValueError(f"{path}: expected JSON, got none: {error}") from error
    got = record.get("schema") if isinstance(record, dict) else type(record).__name__
    if got != SCHEMA:
        raise ValueError(f"{path}: expected a benchmark of schema {SCHEMA}, got {got!r}")
    _expect_keys(record, str(path))
    return dict(record)


def _expect_keys(record: Mapping[str, Any], where: str) -> None:
    if set(record) != set(KEYS):
        raise ValueError(f"{where}: expected the keys {sorted(KEYS)}, got {sorted(record)}")


def _version(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None

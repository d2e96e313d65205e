"""The octree's options, which trade its build for its rays and its bytes, and may change no answer.

One thread, so that what is compared is work and not its sharing. What float32 storage costs and errs is measured by
``validation.efficiency.hits``.
"""

from collections.abc import Callable
from typing import Any, NamedTuple, get_args

import numpy as np

from renderer.arguments.split import SPLIT, Split
from renderer.mesh.mesh import Mesh
from renderer.octree import Octree
from renderer.results.hits import Hits
from validation.efficiency.hits import turned_mesh
from validation.error_curves import front
from validation.hits.rays import RayFamily, camera_rays, random_rays
from validation.timing import RUNS, median_seconds, timed

SPLITS: tuple[Split, ...] = get_args(Split)
LEAF_SIZES = DEPTHS = (1, 2, 4, 8, 16, 32)
# Levels of the icosphere and rays of a family, in full and in quick runs.
LEVEL, QUICK_LEVEL, RAYS, QUICK_RAYS = 6, 4, 50_000, 10_000
_SEED = 20


class TreeOptions(NamedTuple):
    """Options of an octree."""

    split: Split = SPLIT
    leaf_size: int = 4
    max_depth: int = 32

    @property
    def name(self) -> str:
        """The name in records and figures."""
        return f"{self.split}, leaf {self.leaf_size}, depth {self.max_depth}"


DEFAULT = TreeOptions()
# By the option that changes along them: the trees that are compared.
SWEEPS = {f"leaf_size, {split}": [TreeOptions(split, size) for size in LEAF_SIZES] for split in SPLITS}
SWEEPS["max_depth"] = [TreeOptions(max_depth=depth) for depth in DEPTHS]


def run(quick: bool, step: Callable[[str], None]) -> dict[str, Any]:
    """The record of camera and random rays at one mesh, for JSON; see ``record``."""
    step("options of the tree")
    mesh, count = turned_mesh(QUICK_LEVEL if quick else LEVEL), QUICK_RAYS if quick else RAYS
    rng = np.random.default_rng(_SEED)
    batches = camera_rays(mesh.vertices, count), random_rays(mesh.triangles, count, rng)
    return {"faces": len(mesh.faces), "rays": count} | measure(mesh, batches, RUNS)


def measure(mesh: Mesh, batches: tuple[RayFamily, ...], runs: int) -> dict[str, Any]:
    """Cost of every tree, and the number of rays with other bits than the default tree's, which must be 0."""
    trees = list(dict.fromkeys([DEFAULT, *(tree for row in SWEEPS.values() for tree in row)]))
    build_seconds = median_seconds({tree.name: timed(_built, mesh, tree) for tree in trees}, runs)
    octrees = {tree.name: _built(mesh, tree) for tree in trees}
    ns = {batch.name: _nanoseconds(octrees, batch, runs) for batch in batches}
    differing = _differing(octrees, batches)
    return {
        "points": [
            {"name": name, "build_seconds": build_seconds[name], "bytes": octree.stats.bytes,
             "ns_per_ray": {family: of[name] for family, of in ns.items()}, "differing_rays": differing[name]}
            for name, octree in octrees.items()
        ],
        "sweeps": {name: [tree.name for tree in row] for name, row in SWEEPS.items()},
        "differing_rays": sum(differing.values()),
        "fronts": {family: _front(build_seconds, of) for family, of in ns.items()},
    }  # fmt: skip


def differing_rays(a: Hits, b: Hits) -> int:
    """Rays whose t, face, u or v differ in any bit."""
    changed = a.face != b.face
    for x, y in ((a.t, b.t), (a.u, b.u), (a.v, b.v)):
        changed |= x.view(np.int64) != y.view(np.int64)
    return int(changed.sum())


def _built(mesh: Mesh, tree: TreeOptions) -> Octree:
    return Octree.from_mesh(mesh, **tree._asdict(), threads=1)


def _nanoseconds(octrees: dict[str, Octree], batch: RayFamily, runs: int) -> dict[str, float]:
    calls = {name: timed(octree.closest_hit, batch.origins, batch.directions) for name, octree in octrees.items()}
    return {name: 1e9 * seconds / len(batch) for name, seconds in median_seconds(calls, runs).items()}


def _differing(octrees: dict[str, Octree], batches: tuple[RayFamily, ...]) -> dict[str, int]:
    """Number of rays of all families for which each tree gives other bits than the default tree."""
    counts = dict.fromkeys(octrees, 0)
    for batch in batches:
        expected = octrees[DEFAULT.name].closest_hit(batch.origins, batch.directions)
        for name, octree in octrees.items():
            counts[name] += differing_rays(octree.closest_hit(batch.origins, batch.directions), expected)
    return counts


def _front(build_seconds: dict[str, float], ns: dict[str, float]) -> list[str]:
    """Names of the trees that no other beats in both build and rays, soonest built first."""
    names = list(ns)
    return [names[i] for i in front([(build_seconds[name], ns[name]) for name in names])]

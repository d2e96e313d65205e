"""Parameters of a ray query: float32 or float64 storage, which trade error for time, and tree options, which may not.

The mesh's vertices are not float32 numbers, so that storage matters: the octree keeps them as float64, and as float32
only where it gets rounded ones. The rays are float32 numbers, so that Embree gets the same ones. Every error is against
exact arithmetic on the unrounded mesh: it includes the rounding of the vertices as well as the kernel's own. All
contenders use one thread, because embreex allows no more.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.octree import Octree
from renderer.trace.hits import Hits
from validation.efficiency.hits import answer, errors, turned_mesh
from validation.error_curves import front
from validation.hits.rays import RayFamily, camera_rays, float32_exact, random_rays
from validation.oracle import exact
from validation.references.embree import Embree
from validation.timing import median_seconds, timed

SEED = 20
SPLITS: tuple[Literal["midpoint", "sah"], ...] = ("midpoint", "sah")
LEAF_SIZES = (1, 2, 4, 8, 16, 32)
DEPTHS = (1, 2, 4, 8, 16, 32)


@dataclass(frozen=True)
class HitStudyEffort:
    """The icosphere's ``level``, the numbers of rays timed and judged in each family, and ``runs`` of the clock."""

    level: int
    rays: int
    judged: int
    runs: int


class TreeOptions(NamedTuple):
    """Options of an octree."""

    split: Literal["midpoint", "sah"] = "midpoint"
    leaf_size: int = 4
    max_depth: int = 32

    @property
    def name(self) -> str:
        """The name in records and figures."""
        return f"{self.split}, leaf {self.leaf_size}, depth {self.max_depth}"


class StorageContender(NamedTuple):
    """One implementation of closest hits, with the cost of its build; bytes are None where they are unknown."""

    query: Callable[[NDArray[np.float64], NDArray[np.float64]], Any]
    build_seconds: float
    bytes: int | None


def run(effort: HitStudyEffort, step: Callable[[str], None]) -> dict[str, object]:
    """Measure; see ``validation.benchmark.parameters.study`` for the record."""
    mesh = turned_mesh(effort.level)
    batches = (
        camera_rays(mesh.vertices, effort.rays),
        random_rays(mesh.triangles, effort.rays, np.random.default_rng(SEED)),
    )
    step("parameters: storage")
    storage = _storage(mesh, batches, effort)
    step("parameters: tree")
    return {
        "mesh": {"name": mesh.name, "faces": len(mesh.faces), "float32": mesh.is_float32},
        "rays": effort.rays,
        "judged": effort.judged,
        "runs": effort.runs,
        "threads": 1,
        "seed": SEED,
        "storage": storage,
        "tree": tree_parameters(mesh, batches, effort.runs),
    }


def differing_rays(a: Hits, b: Hits) -> int:
    """Rays whose t, face, u or v differ in any bit."""
    changed = a.face != b.face
    for x, y in ((a.t, b.t), (a.u, b.u), (a.v, b.v)):
        changed |= x.view(np.int64) != y.view(np.int64)
    return int(changed.sum())


def tree_parameters(mesh: Mesh, batches: tuple[RayFamily, ...], runs: int) -> dict[str, object]:
    """Seconds, bytes and nanoseconds a ray of every tree, and the number of rays with other bits than the default tree.

    That number must be 0, else the option trades more than time.
    """
    sweeps = {f"leaf_size, {split}": [TreeOptions(split, size) for size in LEAF_SIZES] for split in SPLITS}
    sweeps["max_depth"] = [TreeOptions(max_depth=depth) for depth in DEPTHS]
    trees = dict.fromkeys([TreeOptions()] + [tree for row in sweeps.values() for tree in row])
    builders = {tree.name: partial(_built, mesh, tree) for tree in trees}
    build_seconds = median_seconds({name: timed(build) for name, build in builders.items()}, runs)
    octrees = {name: build() for name, build in builders.items()}
    costs = {b.name: _nanoseconds({k: o.closest_hit for k, o in octrees.items()}, b, runs) for b in batches}
    differing = _differing(octrees, batches)
    points = [
        {"name": tree.name, **tree._asdict()}
        | {"build_seconds": build_seconds[tree.name], "bytes": octrees[tree.name].stats.bytes}
        | {"ns_per_ray": {family: cost[tree.name] for family, cost in costs.items()}}
        | {"differing_rays": differing[tree.name]}
        for tree in trees
    ]
    names = list(octrees)
    return {
        "default": TreeOptions().name,
        "points": points,
        "sweeps": {name: [tree.name for tree in row] for name, row in sweeps.items()},
        "differing_rays": sum(differing.values()),
        "front_build_seconds_ns_per_ray": {
            family: [names[i] for i in front([(build_seconds[name], cost[name]) for name in names])]
            for family, cost in costs.items()
        },
    }


def _differing(octrees: dict[str, Octree], batches: tuple[RayFamily, ...]) -> dict[str, int]:
    """Number of rays of all families for which each tree gives other bits than the default tree."""
    counts = dict.fromkeys(octrees, 0)
    for batch in batches:
        expected = octrees[TreeOptions().name].closest_hit(batch.origins, batch.directions)
        for name, octree in octrees.items():
            counts[name] += differing_rays(octree.closest_hit(batch.origins, batch.directions), expected)
    return counts


def _storage(mesh: Mesh, batches: tuple[RayFamily, ...], effort: HitStudyEffort) -> list[dict[str, object]]:
    """One record for each family of rays."""
    contenders = _contenders(mesh, effort.runs)
    records: list[dict[str, object]] = []
    for batch in batches:
        cost = _nanoseconds({name: c.query for name, c in contenders.items()}, batch, effort.runs)
        chosen = np.sort(np.random.default_rng(SEED).choice(len(batch), min(effort.judged, len(batch)), replace=False))
        sample = batch.select(chosen)
        truth = exact.closest_hits(mesh.vertices, mesh.faces, sample.origins, sample.directions)
        points: list[dict[str, Any]] = []
        for name, contender in contenders.items():
            judged = errors(answer(contender.query(sample.origins, sample.directions)), truth)
            row = {"name": name, "ns_per_ray": cost[name], "build_seconds": contender.build_seconds}
            points.append(row | {"bytes": contender.bytes, "errors": judged})
        fronts = {}
        for quantity in ("p50", "p99", "max"):
            plane = [(p["ns_per_ray"], p["errors"][quantity]) for p in points if p["errors"][quantity] is not None]
            # All are None or none is: the exact hits are the same for all, and no contender misses all of them.
            fronts[quantity] = [points[i]["name"] for i in front(plane)] if len(plane) == len(points) else []
        records.append({"rays": batch.name, "judged": len(sample), "points": points, "fronts": fronts})
    return records


def _contenders(mesh: Mesh, runs: int) -> dict[str, StorageContender]:
    rounded = Mesh(float32_exact(mesh.vertices), mesh.faces)
    builders: dict[str, Callable[[], Any]] = {
        "float64": partial(_built, mesh, TreeOptions()),
        "float32": partial(_built, rounded, TreeOptions()),
        "embree_default": partial(Embree, mesh.vertices, mesh.faces, robust=False),
        "embree_robust": partial(Embree, mesh.vertices, mesh.faces, robust=True),
    }
    seconds = median_seconds({name: timed(_ready, build) for name, build in builders.items()}, runs)
    built = {name: build() for name, build in builders.items()}
    return {
        name: StorageContender(b.closest_hit, seconds[name], b.stats.bytes if isinstance(b, Octree) else None)
        for name, b in built.items()
    }


def _built(mesh: Mesh, tree: TreeOptions) -> Octree:
    return Octree.from_mesh(mesh, **tree._asdict(), threads=1)


def _ready(build: Callable[[], Any]) -> None:
    """Build and trace one ray, because Embree builds on its first."""
    build().closest_hit(np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]))


def _nanoseconds(queries: dict[str, Any], batch: RayFamily, runs: int) -> dict[str, float]:
    calls = {name: timed(query, batch.origins, batch.directions) for name, query in queries.items()}
    return {name: 1e9 * seconds / len(batch) for name, seconds in median_seconds(calls, runs).items()}

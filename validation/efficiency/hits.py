"""Closest hits: throughput against the error of t and against leaks, for ours and every reference.

The mesh's vertices are not float32 numbers, so that contenders that round them show it. The rays of the errors are
float32 numbers, so that all contenders get the same ones. The truth is exact arithmetic on the unrounded mesh: an error
includes the rounding of the vertices as well as the kernel's own. Ours stores t as float64 and the references as
float32, so no error of theirs can be far below 2^-24 = 6e-8, nor of ours below 2^-53 = 1e-16.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderer.mesh.mesh import Mesh
from renderer.mesh.shapes import icosphere
from renderer.octree import Octree
from renderer.results.hits import Hits
from renderer.system.threads import available_threads
from validation.error_curves import front
from validation.hits.compare import HitArrays
from validation.hits.rays import RayFamily, camera_rays, float32_exact, leak_rays
from validation.oracle import exact
from validation.references.table import REFERENCES
from validation.timing import median_seconds, spending, timed

SEED = 20


@dataclass(frozen=True)
class HitTimingEffort:
    """Size of the measurement.

    level   of the icosphere
    rays    timed
    judged  of these, by exact arithmetic
    leaks   rays at edges, and as many at vertices
    runs    of the clock
    few     largest number of rays of each set for trimesh, which needs up to 10 ms a ray
    """

    level: int
    rays: int
    judged: int
    leaks: int
    runs: int
    few: int = 100


QUICK = HitTimingEffort(level=4, rays=50_000, judged=1000, leaks=20_000, runs=3)
FULL = HitTimingEffort(level=5, rays=200_000, judged=3000, leaks=100_000, runs=5)

_COMPARED = ("embree_default", "embree_robust", "igl", "mitsuba", "trimesh")


class Contender(NamedTuple):
    """One implementation of closest hits: its label, its threads, its query, and its most rays of each set."""

    label: str
    threads: int
    closest_hit: Callable[[NDArray[np.float64], NDArray[np.float64]], Any]
    most: int


def run(effort: HitTimingEffort, costs: dict[str, float]) -> dict[str, object]:
    """Measure; adds the seconds spent in each reference to ``costs``."""
    mesh = turned_mesh(effort.level)
    contenders = _contenders(mesh, effort, costs)
    rays = camera_rays(mesh.vertices, effort.rays)
    given = {name: rays.select(_rows(len(rays), c.most)) for name, c in contenders.items()}
    calls = {name: timed(c.closest_hit, given[name].origins, given[name].directions) for name, c in contenders.items()}
    seconds = median_seconds(calls, effort.runs)
    judged = rays.select(_rows(len(rays), effort.judged))
    judge = spending(costs, "exact arithmetic", exact.closest_hits)
    truth = judge(mesh.vertices, mesh.faces, judged.origins, judged.directions)
    inside = leak_rays(mesh.vertices, mesh.faces, effort.leaks, SEED)
    points = [
        {"name": name, "label": contender.label, "threads": contender.threads, "rays": len(given[name])}
        | {"mrays": len(given[name]) / seconds[name] / 1e6}
        | {"errors": _judged(contender, judged, truth)}
        | _leaks(contender, inside)
        for name, contender in contenders.items()
    ]
    return {
        "mesh": {"name": mesh.name, "faces": len(mesh.faces)},
        "rays": len(rays),
        "judged": len(judged),
        "runs": effort.runs,
        "points": points,
        "fronts": fronts(points),
    }


def fronts(points: list[dict[str, Any]]) -> dict[str, list[str]]:
    """Names on the Pareto fronts of seconds a ray against the p99 error and against leaks, fastest first.

    A contender that never hit where the truth does has no error and is on no front of errors; one that got fewer rays
    than another is on no front, because its percentile and its share are less certain.
    """
    points = [p for p in points if p["leak_rays"] == max(p["leak_rays"] for p in points)]
    known = [p for p in points if p["errors"]["p99"] is not None]
    return {
        "p99": [known[i]["name"] for i in front([(1.0 / p["mrays"], p["errors"]["p99"]) for p in known])],
        "leaks": [points[i]["name"] for i in front([(1.0 / p["mrays"], p["leaks"] / p["leak_rays"]) for p in points])],
    }


def turned_mesh(level: int) -> Mesh:
    """A wavy sphere scaled by pi and rotated by a radian about two axes: float32 holds hardly any vertex."""
    ball = icosphere(level)
    x, y, z = ball.vertices.T
    wavy = ball.vertices * (1.0 + 0.08 * np.sin(9.0 * x) * np.sin(7.0 * y) * np.sin(8.0 * z))[:, None]
    c, s = np.cos(1.0), np.sin(1.0)
    about_z = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
    return Mesh(np.pi * wavy @ about_z @ about_x, ball.faces, name=f"wavy icosphere {level}, turned")


def errors(found: HitArrays, truth: list[exact.ExactHit | None]) -> dict[str, object]:
    """Wrong verdicts, and the relative error of t where both hit, whatever the face.

    ``wrong_face`` counts faces that do not attain the exact t; the three percentiles are None without common hits.
    """
    hit = np.array([h is not None for h in truth])
    pairs = [(ray, h) for ray in np.flatnonzero(hit & found.hit).tolist() if (h := truth[ray]) is not None]
    relative = [float(abs(Fraction(float(found.t[ray])) - h.t) / h.t) for ray, h in pairs]
    p50, p99, largest = np.percentile(relative, (50, 99, 100)).tolist() if relative else (None, None, None)
    return {
        "missed": int((hit & ~found.hit).sum()),
        "false_hits": int((~hit & found.hit).sum()),
        "wrong_face": sum(int(found.face[ray]) not in h.faces_at_t for ray, h in pairs),
        "both_hit": len(pairs),
        "p50": p50,
        "p99": p99,
        "max": largest,
    }


def answer(found: Hits | tuple[NDArray[np.float64], NDArray[np.int64]]) -> HitArrays:
    """Closest hits of ours or of a reference in one form."""
    return HitArrays(found.t, found.face) if isinstance(found, Hits) else HitArrays(*found)


def _contenders(mesh: Mesh, effort: HitTimingEffort, costs: dict[str, float]) -> Mapping[str, Contender]:
    """The contenders by name.

    Ours stores float64, or float32 where it gets rounded vertices. One thread and all threads are separate contenders,
    because the references have one.
    """
    rounded = Mesh(float32_exact(mesh.vertices), mesh.faces)
    threads, every = available_threads(), effort.rays + effort.leaks
    tree = partial(Octree.from_mesh, threads=1)
    found = {
        "ours": Contender("ours, float64, 1 thread", 1, tree(mesh).closest_hit, every),
        "ours_float32": Contender("ours, float32 vertices, 1 thread", 1, tree(rounded).closest_hit, every),
    }
    if threads > 1:
        shared = Octree.from_mesh(mesh)
        found["ours_all"] = Contender(f"ours, float64, {threads} threads", threads, shared.closest_hit, every)
    references = {reference.key: reference for reference in REFERENCES}
    for key in _COMPARED:
        name = references[key].name
        query = spending(costs, name, references[key].make(mesh.vertices, mesh.faces).closest_hit)
        found[key] = Contender(name, 1, query, every)
    slowest = found["trimesh"]
    label = f"{slowest.label}, {effort.few:,} rays of each set"
    found["trimesh"] = slowest._replace(label=label, most=effort.few)
    return found


def _rows(rays: int, most: int) -> NDArray[np.int64]:
    """All rows of so many rays, or ``most`` of them in ascending order: always the same ones."""
    if most >= rays:
        return np.arange(rays)
    return np.sort(np.random.default_rng(SEED).choice(rays, most, replace=False))


def _judged(contender: Contender, rays: RayFamily, truth: list[exact.ExactHit | None]) -> dict[str, object]:
    """Errors of a contender on as many of the rays as it takes."""
    rows = _rows(len(rays), contender.most)
    given = rays.select(rows)
    return errors(answer(contender.closest_hit(given.origins, given.directions)), [truth[row] for row in rows.tolist()])


def _leaks(contender: Contender, inside: Sequence[RayFamily]) -> dict[str, int]:
    """Rays from inside the closed mesh that a contender misses, and the number of these rays."""
    given = [rays.select(_rows(len(rays), contender.most)) for rays in inside]
    missed = sum(int((~answer(contender.closest_hit(r.origins, r.directions)).hit).sum()) for r in given)
    return {"leaks": missed, "leak_rays": sum(len(rays) for rays in given)}

"""Queries of every contender on one mesh, in turn, and whether their answers agree.

``python -m validation.benchmark.measures.queries`` prints those of one mesh alone.
"""

import argparse
import statistics
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from renderer.mesh.mesh import Mesh
from renderer.octree import Octree
from validation.benchmark.measures.families import MISSES, families, points
from validation.benchmark.measures.kinds import FIRST, KINDS, Asked, Kind, briefly, title
from validation.benchmark.measures.meshes import named
from validation.benchmark.peers.contender import Peer, Query, System
from validation.benchmark.peers.ours import OURS, OURS_ONE, OURS_TWO, Ours
from validation.benchmark.peers.systems import available
from validation.timing import RUNS, interleaved, ratio, timed

# Between float32 and float64 only rays within about 1e-6 of a silhouette may differ; a picture of 1e6 rays has some
# thousand rays at silhouettes a pixel wide. One ray in a thousand is far more: a wrong scene, not rounding. The same
# share of points is what a peer may get wrong that counts along one ray, or approximates.
MAX_DIFFERING = 1e-3


def measure(
    mesh: Mesh,
    systems: Sequence[System],
    count: int,
    step: Callable[[str], None],
    kinds: Sequence[Kind] = tuple(KINDS.values()),
    brief: bool = False,
) -> list[dict[str, Any]]:
    """A row for each family and kind of query on ``mesh``, ``count`` rays or points a family; see ``record``.

    A mesh that is not closed has no rows of the kinds that ask for an inside. brief : see ``kinds.briefly``; and
    contenders that get fewer rays are left out.
    """
    systems = [s for s in systems if not (brief and s.most_rays)]
    peers = _peers(mesh, systems)
    single = {s.name for s in systems if s.threads == 1} - {OURS_ONE}
    most = {system.name: system.most_rays or count for system in systems}
    ours = peers[OURS]
    assert isinstance(ours, Ours)
    rows = []
    for asked, kind in _asked(ours.octree, count, _answerable(mesh, kinds), brief):
        step(f"{mesh.name}: {title(asked.name, kind.name)}")
        of = {name: asked.at_most(most[name]) for name in peers}
        queries = {name: kind.ask(peer, of[name]) for name, peer in peers.items()}
        offered = {name: query for name, query in queries.items() if query is not None}
        rows.append({"mesh": mesh.name, "faces": len(mesh.faces), "family": asked.name, "query": kind.name}
                    | _row(kind, ours, offered, of, single))  # fmt: skip
    return rows


def _answerable(mesh: Mesh, kinds: Sequence[Kind]) -> list[Kind]:
    return [kind for kind in kinds if not (kind.closed and len(mesh.open_edges))]


def _peers(mesh: Mesh, systems: Sequence[System]) -> dict[str, Peer]:
    """Each system with the mesh; our contenders with other threads share the octree of all threads."""
    peers: dict[str, Peer] = {}
    for system in systems:
        if system.takes(len(mesh.faces)):
            first = peers.get(OURS)
            if system.name in (OURS_ONE, OURS_TWO) and isinstance(first, Ours):
                peers[system.name] = first.with_threads(system.threads)
            else:
                peers[system.name] = system.loaded(mesh.vertices, mesh.faces)
    return peers


def _asked(octree: Octree, count: int, kinds: Sequence[Kind], brief: bool) -> Iterator[tuple[Asked, Kind]]:
    asked: tuple[Asked, ...] = (*families(octree, count), *(() if brief else points(octree.mesh, count)))
    for family in asked:
        for kind in kinds:
            if family.name in kind.families and (briefly(family.name, kind) or not brief):
                yield family.at_most(max(1, round(kind.share * count))), kind


def _row(kind: Kind, ours: Ours, queries: dict[str, Query], of: dict[str, Asked], single: set[str]) -> dict[str, Any]:
    expected: dict[int, Any] = {}
    contenders: dict[str, dict[str, Any]] = {}
    for name, query in queries.items():
        asked, answer = of[name], query.read(query.trace())
        if len(asked) not in expected:
            expected[len(asked)] = answer if name == OURS else _answer(kind.ask(ours, asked))
        differing = kind.differing(ours.octree, asked, expected[len(asked)], answer)
        contenders[name] = {"rays": len(asked), "hits": int(kind.hit(answer).sum()), "differing": int(differing.sum())}
    # The queries above were the untimed round.
    seconds = interleaved({name: timed(query.trace) for name, query in queries.items()}, RUNS, unseen=0)
    for name, runs in seconds.items():
        median, count = statistics.median(runs), len(of[name])
        contenders[name] |= {"seconds": runs, "median": median, "mrays": count / median / 1e6,
                             "ns": median / count * 1e9}  # fmt: skip
    each = {name: [s / len(of[name]) for s in runs] for name, runs in seconds.items()}
    hits, count = contenders[OURS]["hits"], len(of[OURS])
    return {
        "rays": count,
        "hit_share": hits / count,
        "contenders": contenders,
        "ratios": {name: ratio(runs, each[OURS]) for name, runs in each.items() if name != OURS},
        "ratios_one_thread": _beside_one(each, single),
        "efficiency": _efficiency(each, ours.octree.threads) if kind.name in FIRST else None,
        # Nothing is timed on an empty scene by mistake, and no ray that should miss hits.
        "agree": (all(c["differing"] <= MAX_DIFFERING * c["rays"] for c in contenders.values())
                  and (hits == 0) == (of[OURS].name == MISSES)),
    }  # fmt: skip


def _beside_one(each: dict[str, list[float]], single: set[str]) -> dict[str, float]:
    """The speed of ours on one thread over that of each peer that has one thread."""
    return {name: ratio(runs, each[OURS_ONE]) for name, runs in each.items() if name in single and OURS_ONE in each}


def _efficiency(each: dict[str, list[float]], threads: int) -> float | None:
    """Time of one thread over twice that of two; None where no contender of ours has two."""
    two = OURS if threads == 2 else OURS_TWO
    return ratio(each[OURS_ONE], each[two]) / 2.0 if {OURS_ONE, two} <= each.keys() else None


def _answer(query: Query | None) -> Any:
    assert query is not None, "ours offers every query"
    return query.read(query.trace())


def main(arguments: Sequence[str] | None = None) -> int:
    """Print a line for each row of one mesh and each contender."""
    parser = argparse.ArgumentParser(prog="python -m validation.benchmark.measures.queries", description=__doc__)
    parser.add_argument("mesh", help="number of faces of spheres, another kind and its faces (city_100k), or a file")
    parser.add_argument("--only", nargs="+", choices=KINDS, default=list(KINDS), help="kinds of queries")
    parser.add_argument("--rays", type=int, default=200_000, metavar="N", help="rays or points of a family")
    options = parser.parse_args(arguments)
    if options.rays < 1:
        parser.error(f"--rays: expected at least 1, got {options.rays}")
    mesh = named(options.mesh)
    systems, missing = available()
    if len(mesh.open_edges):
        print(f"{mesh.name}: {len(mesh.open_edges)} open edges, so nothing is inside")
    for row in measure(mesh, systems, options.rays, lambda _: None, [KINDS[name] for name in options.only]):
        print(f"{row['mesh']}: {title(row['family'], row['query'])}, {'all agree' if row['agree'] else 'DISAGREE'}")
        for name, c in row["contenders"].items():
            times = f"ours is {row['ratios'][name]:.2f} times as fast" if name != OURS else ""
            if (one := row["ratios_one_thread"].get(name)) is not None:
                times = f"ours on one thread is {one:.2f} times as fast"
            print(f"  {name:16} {c['mrays']:10.4f} million a second, {c['differing']} of {c['rays']} differ  {times}")
    for name, how in missing.items():
        print(f"not measured: {name}; {how}")
    return 0


if __name__ == "__main__":
    sys.exit(main())

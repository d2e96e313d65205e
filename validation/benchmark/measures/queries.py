"""Queries of every contender on one mesh, in turn, and whether their answers agree.

``python -m validation.benchmark.measures.queries`` prints those of one mesh alone.
"""

import argparse
import statistics
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from renderer.mesh.load import load_mesh
from renderer.mesh.mesh import Mesh
from renderer.octree import Octree
from validation.benchmark.measures.families import families, points
from validation.benchmark.measures.fit import log_fit
from validation.benchmark.measures.kinds import KINDS, Asked, Kind, title
from validation.benchmark.measures.meshes import displaced_spheres
from validation.benchmark.peers.contender import Peer, Query, System
from validation.benchmark.peers.ours import OURS, OURS_ONE, Ours
from validation.benchmark.peers.systems import available
from validation.hits.rays import float32_exact
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
) -> list[dict[str, Any]]:
    """A row for each family and kind of query on ``mesh``, ``count`` rays or points a family; see ``record``.

    A mesh that is not closed has no rows of the kinds that ask for an inside.
    """
    peers = _peers(mesh, systems)
    most = {system.name: system.most_rays or count for system in systems}
    ours = peers[OURS]
    assert isinstance(ours, Ours)
    rows = []
    for asked, kind in _asked(ours.octree, count, [k for k in kinds if not (k.closed and len(mesh.open_edges))]):
        step(f"{mesh.name}: {title(asked.name, kind.name)}")
        of = {name: asked.at_most(most[name]) for name in peers}
        queries = {name: kind.ask(peer, of[name]) for name, peer in peers.items()}
        offered = {name: query for name, query in queries.items() if query is not None}
        rows.append({"mesh": mesh.name, "faces": len(mesh.faces), "family": asked.name, "query": kind.name}
                    | _row(kind, ours, offered, of))  # fmt: skip
    return rows


def _peers(mesh: Mesh, systems: Sequence[System]) -> dict[str, Peer]:
    """Each system with the mesh; our one-thread contender shares the octree of all threads."""
    peers: dict[str, Peer] = {}
    for system in systems:
        if system.takes(len(mesh.faces)):
            first = peers.get(OURS)
            shares = system.name == OURS_ONE and isinstance(first, Ours)
            peers[system.name] = first.one_thread() if shares else system.loaded(mesh.vertices, mesh.faces)  # type: ignore[union-attr]
    return peers


def _asked(octree: Octree, count: int, kinds: Sequence[Kind]) -> Iterator[tuple[Asked, Kind]]:
    asked: tuple[Asked, ...] = (*families(octree, count), *points(octree.mesh, count))
    for family in asked:
        for kind in kinds:
            if family.name in kind.families:
                yield family.at_most(max(1, round(kind.share * count))), kind


def _row(kind: Kind, ours: Ours, queries: dict[str, Query], of: dict[str, Asked]) -> dict[str, Any]:
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
        "agree": all(c["differing"] <= MAX_DIFFERING * c["rays"] for c in contenders.values()) and hits > 0,
    }


def _answer(query: Query | None) -> Any:
    assert query is not None, "ours offers every query"
    return query.read(query.trace())


def fits(rows: Sequence[dict[str, Any]], series: Sequence[str]) -> list[dict[str, Any]]:
    """ns a ray = a log2 N + b over the meshes named in ``series``, for each family, query and contender."""
    found = []
    keys = dict.fromkeys((r["family"], r["query"], name) for r in rows for name in r["contenders"])
    for family, kind, name in keys:
        of = [r for r in rows if (r["family"], r["query"]) == (family, kind) and r["mesh"] in series]
        of = [r for r in of if name in r["contenders"]]
        fit = log_fit([r["faces"] for r in of], [r["contenders"][name]["ns"] for r in of])
        if fit is not None:
            found.append({"family": family, "query": kind, "contender": name} | fit._asdict())
    return found


def main(arguments: Sequence[str] | None = None) -> int:
    """Print a line for each row of one mesh and each contender."""
    parser = argparse.ArgumentParser(prog="python -m validation.benchmark.measures.queries", description=__doc__)
    parser.add_argument("mesh", help="number of faces of a generated mesh, or a file")
    parser.add_argument("--only", nargs="+", choices=KINDS, default=list(KINDS), help="kinds of queries")
    parser.add_argument("--rays", type=int, default=200_000, metavar="N", help="rays or points of a family")
    options = parser.parse_args(arguments)
    if options.rays < 1:
        parser.error(f"--rays: expected at least 1, got {options.rays}")
    whole = displaced_spheres(int(options.mesh)) if options.mesh.isdigit() else load_mesh(Path(options.mesh))
    mesh = Mesh(float32_exact(whole.vertices), whole.faces, name=whole.name)
    systems, missing = available()
    if len(mesh.open_edges):
        print(f"{mesh.name}: {len(mesh.open_edges)} open edges, so nothing is inside")
    for row in measure(mesh, systems, options.rays, lambda _: None, [KINDS[name] for name in options.only]):
        print(f"{row['mesh']}: {title(row['family'], row['query'])}, {'all agree' if row['agree'] else 'DISAGREE'}")
        for name, c in row["contenders"].items():
            times = f"ours is {row['ratios'][name]:.2f} times as fast" if name != OURS else ""
            print(f"  {name:16} {c['mrays']:10.4f} million a second, {c['differing']} of {c['rays']} differ  {times}")
    for name, how in missing.items():
        print(f"not measured: {name}; {how}")
    return 0


if __name__ == "__main__":
    sys.exit(main())

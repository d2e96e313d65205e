"""Closest and any hits of every contender on one mesh, in turn, and whether their hits agree."""

import statistics
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from renderer.mesh.mesh import Mesh
from validation.benchmark.measures.families import families
from validation.benchmark.measures.fit import log_fit
from validation.benchmark.peers.contender import Family, Peer, Query, System
from validation.benchmark.peers.ours import OURS, OURS_ONE, Ours
from validation.timing import RUNS, interleaved, ratio, timed

KINDS = ("closest", "any")
# Between float32 and float64 only rays within about 1e-6 of a silhouette may differ; a picture of 1e6 rays has some
# thousand rays at silhouettes a pixel wide. One ray in a thousand is far more: a wrong scene, not rounding.
MAX_DIFFERING = 1e-3


def measure(mesh: Mesh, systems: Sequence[System], count: int, step: Callable[[str], None]) -> list[dict[str, Any]]:
    """A row for each family and kind of query on ``mesh``, ``count`` rays a family; see ``record``."""
    peers = _peers(mesh, systems)
    labels = {system.name: system for system in systems}
    ours = peers[OURS]
    assert isinstance(ours, Ours)
    rows = []
    for family in families(ours.octree, count):
        for kind in KINDS:
            step(f"{mesh.name}: {family.name} rays, {kind} hit")
            rays = {name: family.at_most(labels[name].most_rays or count) for name in peers}
            queries = {name: _query(peer, kind, rays[name]) for name, peer in peers.items()}
            offered = {name: query for name, query in queries.items() if query is not None}
            rows.append({"mesh": mesh.name, "faces": len(mesh.faces), "family": family.name, "query": kind}
                        | _row(family, offered, rays))  # fmt: skip
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


def _query(peer: Peer, kind: str, rays: Family) -> Query | None:
    return peer.closest(rays) if kind == "closest" else peer.any(rays)


def _row(family: Family, queries: dict[str, Query], rays: dict[str, Family]) -> dict[str, Any]:
    expected = _hit(queries[OURS], queries[OURS].trace())
    contenders: dict[str, dict[str, Any]] = {}
    for name, query in queries.items():
        hit, count = _hit(query, query.trace()), len(rays[name])
        same = expected if count == len(family) else expected[np.linspace(0, len(family) - 1, count).astype(np.int64)]
        contenders[name] = {"rays": count, "hits": int(hit.sum()), "differing": int((hit != same).sum())}
    # The queries above were the untimed round.
    seconds = interleaved({name: timed(query.trace) for name, query in queries.items()}, RUNS, unseen=0)
    for name, runs in seconds.items():
        median, count = statistics.median(runs), len(rays[name])
        contenders[name] |= {"seconds": runs, "median": median, "mrays": count / median / 1e6,
                             "ns": median / count * 1e9}  # fmt: skip
    each = {name: [s / len(rays[name]) for s in runs] for name, runs in seconds.items()}
    return {
        "rays": len(family),
        "hit_share": float(expected.mean()),
        "contenders": contenders,
        "ratios": {name: ratio(runs, each[OURS]) for name, runs in each.items() if name != OURS},
        "agree": all(c["differing"] <= MAX_DIFFERING * c["rays"] for c in contenders.values()) and bool(expected.any()),
    }


def _hit(query: Query, answer: Any) -> Any:
    found = query.read(answer)
    return found if found.dtype == np.bool_ else np.isfinite(found)


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

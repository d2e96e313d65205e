"""The heat map: ratios of ours to the peers that matter, mesh by family and query, and what they come to together.

All ratios are larger where ours is better, and above 1 where it is better than the peer.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from validation.benchmark.measures import calls
from validation.benchmark.measures.kinds import FIRST, KINDS, title
from validation.benchmark.peers.ours import OURS

Record = Mapping[str, Any]
# The peers of the map, and how many threads each side has.
PEERS = {"embree": "one thread each", "open3d": "all threads", "mitsuba_llvm": "all threads"}
# Means are over meshes of at least so many faces: smaller ones fit into the caches, where the loop around them counts.
# The series' mesh of about 10,000 has 9,600.
MEAN_FACES = 9_000
# A step of the shades begins at each of these ratios: powers of two, and at 1 the hue changes.
_STEPS = tuple(2.0**power for power in (-1.0, -0.5, -0.25, 0.0, 0.25, 0.5, 1.0, 2.0))


class Shade(NamedTuple):
    """A step of the map: its CSS class, its least ratio, and background and text in the light and the dark theme.

    Orange below 1 and blue above can be distinguished by the colour-blind. Every text has a contrast of 4.5 at least.
    """

    name: str
    least: float
    light: tuple[str, str]
    dark: tuple[str, str]


_INK, _WHITE, _PALE, _NIGHT = "#16191f", "#ffffff", "#eef1f5", "#0d0f12"
SHADES = tuple(
    Shade(name, least, light, dark)
    for name, least, light, dark in zip(
        ("below4", "below3", "below2", "below1", "above1", "above2", "above3", "above4", "above5"),
        (0.0, *_STEPS),
        (("#a34a00", _WHITE), ("#e88a2a", _INK), ("#f8bd7c", _INK), ("#fde3c4", _INK), ("#e2eef9", _INK),
         ("#bddaf0", _INK), ("#8cbfe4", _INK), ("#539bd3", _INK), ("#1f5fa6", _WHITE)),
        (("#f0943c", _NIGHT), ("#b9660f", _NIGHT), ("#7a4410", _PALE), ("#472b10", _PALE), ("#17293b", _PALE),
         ("#1d3f5f", _PALE), ("#24598c", _PALE), ("#4f97d6", _NIGHT), ("#9ccbf5", _NIGHT)),
        strict=True,
    )
)  # fmt: skip


def shade(ratio: float) -> str:
    """The name of the step in which ``ratio`` lies."""
    return next(s.name for s in reversed(SHADES) if ratio >= s.least)


def geometric_mean(ratios: Iterable[float]) -> float | None:
    """The mean for ratios: 2 and 1/2 make 1. None of none.

    >>> geometric_mean([0.5, 8.0])
    2.0
    """
    logs = [math.log2(ratio) for ratio in ratios]
    return 2.0 ** (math.fsum(logs) / len(logs)) if logs else None


def first_ratio(row: Record, peer: str) -> float | None:
    """The row's ratio for the map: on one thread each against Embree, on all threads against the others."""
    found: float | None = row["ratios_one_thread" if peer == "embree" else "ratios"].get(peer)
    return found


def first_rows(record: Record) -> list[Record]:
    """The rows that ask for a first hit."""
    return [row for row in record["queries"] if row["query"] in FIRST]


def peers(record: Record) -> list[str]:
    """The map's peers that were measured."""
    return [peer for peer in PEERS if any(first_ratio(row, peer) is not None for row in first_rows(record))]


def summary(record: Record) -> list[dict[str, Any]]:
    """For each peer: its cells, how many are below 1, the least and where, and the mean from ``MEAN_FACES`` on."""
    found = []
    for peer in peers(record):
        of = [(ratio, r) for r in first_rows(record) if (ratio := first_ratio(r, peer)) is not None]
        least, row = min(of, key=lambda pair: pair[0])
        found.append({
            "peer": peer, "label": record["systems"][peer]["label"], "threads": PEERS[peer], "cells": len(of),
            "below": sum(ratio < 1.0 for ratio, _ in of), "least": least, "where": place(row),
            "mean": geometric_mean(ratio for ratio, r in of if r["faces"] >= MEAN_FACES),
        })  # fmt: skip
    return found


def place(row: Record) -> str:
    """A row of queries for people: "city_1m: camera rays, closest hit"."""
    return f"{row['mesh']}: {title(row['family'], row['query'])}"


def first_hits(record: Record) -> dict[str, Any]:
    """The map: ``columns`` by query, ``rows`` with a list of cells for each peer, None where nothing was measured."""
    keys = list(dict.fromkeys((r["query"], r["family"]) for r in first_rows(record)))
    columns = [key for query in FIRST for key in keys if key[0] == query]
    found = {(r["mesh"], r["query"], r["family"]): r for r in first_rows(record)}
    shown, rows = peers(record), []
    for mesh, faces in _meshes(record, first_rows(record)):
        of = [found.get((mesh, *column)) for column in columns]
        rows.append({"mesh": mesh, "faces": faces, "peers": [[_first_cell(r, peer) for r in of] for peer in shown]})
    heads = [(KINDS[query].said, [family for q, family in columns if q == query]) for query in FIRST]
    return {
        "peers": [(_label(record, peer), PEERS[peer]) for peer in shown],
        "heads": [head for head in heads if head[1]],
        "rows": rows,
    }


def others(record: Record) -> dict[str, Any]:
    """Build, refit and memory in the same form: ``columns`` are what, and by whom; ``rows`` have a cell for each."""
    builds, memory = ({row["mesh"]: row for row in record[key]} for key in ("builds", "memory"))
    what = ("build", "refit", "memory at rest")
    rows = []
    for mesh, faces in _meshes(record, record["builds"]):
        found = {"build": builds[mesh]["ratios"], "refit": builds[mesh]["ratios_refit"],
                 "memory at rest": memory_ratios(memory[mesh]) if mesh in memory else {}}  # fmt: skip
        cells = [[_cell(found[name].get(p), f"{mesh}: {name} against {p}") for p in PEERS] for name in what]
        rows.append({"mesh": mesh, "faces": faces, "cells": cells})
    return {"what": what, "peers": [_label(record, peer) for peer in PEERS], "rows": rows}


def few(record: Record) -> dict[str, Any]:
    """Calls of few rays in the same form."""
    rows = [{"rays": row["rays"], "micros": row["median"],
             "cells": [_cell(row["ratios"].get(p), f"{row['rays']} rays a call, against {p}") for p in calls.PEERS]}
            for row in record["calls"]]  # fmt: skip
    return {"peers": [(_label(record, peer), PEERS[peer]) for peer in calls.PEERS], "rows": rows}


def memory_ratios(row: Record) -> dict[str, float]:
    """Each peer's memory at rest over ours; none where either is too little to be seen."""
    systems = row["systems"]
    own = systems[OURS]["rest"] if OURS in systems else 0
    return {p: s["rest"] / own for p, s in systems.items() if p != OURS and own > 0 and s["rest"] > 0}


def legend() -> list[tuple[str, str]]:
    """Each step's class and its range of ratios."""
    ends = [*(s.least for s in SHADES[1:]), math.inf]
    return [(s.name, _range(s.least, end)) for s, end in zip(SHADES, ends, strict=True)]


def _range(least: float, end: float) -> str:
    if least == 0.0:
        return f"below {end:.2g}"
    return f"from {least:.2g}" if math.isinf(end) else f"{least:.2g} to {end:.2g}"


def _first_cell(row: Record | None, peer: str) -> dict[str, Any] | None:
    return None if row is None else _cell(first_ratio(row, peer), f"{place(row)}, against {peer}", row["agree"])


def _cell(ratio: float | None, said: str, agree: bool = True) -> dict[str, Any] | None:
    if ratio is None:
        return None
    said = f"{said}: {ratio:.3f}" + ("" if agree else "; the contenders' answers disagree")
    return {"text": text(ratio), "shade": shade(ratio), "agree": agree, "said": said}


def text(ratio: float) -> str:
    """Two decimals, fewer for large ratios; what is below 1 does not read as 1.

    >>> text(0.9999), text(1.0), text(12.345), text(123.45)
    ('0.99', '1.00', '12.3', '123')
    """
    if ratio < 1.0:
        return f"{math.floor(ratio * 100.0) / 100.0:.2f}"
    return f"{ratio:.2f}" if ratio < 9.995 else f"{ratio:.1f}" if ratio < 99.95 else f"{ratio:.0f}"


def _meshes(record: Record, rows: Sequence[Record]) -> list[tuple[str, int]]:
    """Meshes of ``rows`` with their faces, by kind in the order measured, then by faces."""
    order = list(dict.fromkeys(record["kinds"].values()))
    faces = {row["mesh"]: row["faces"] for row in rows}
    return sorted(faces.items(), key=lambda pair: (order.index(record["kinds"][pair[0]]), pair[1]))


def _label(record: Record, peer: str) -> str:
    known = record["systems"].get(peer)
    return str(known["label"]) if known else peer

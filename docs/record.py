"""The figures that the pages take from a run: ``docs/figures.json``, of ``metrics.json`` and ``benchmark.json``."""

import json
from collections import Counter
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from renderer.jit.levels import lacking
from validation.benchmark.page.heat import memory_ratios, summary
from validation.benchmark.page.record import commit
from validation.environment import sources_sha256

Record = dict[str, Any]
RECORD = Path(__file__).parent / "figures.json"
# Contenders whose speed is kept, ours first; of those with one thread the ratio to one thread of ours.
_SYSTEMS = ("ours", "ours_one_thread", "embree", "open3d", "mitsuba_llvm", "trimesh_embreex", "libigl")


def read() -> Record:
    return dict(json.loads(RECORD.read_text(encoding="utf-8")))


def write(record: Mapping[str, Any]) -> None:
    """One row of a table a line, so that a change shows which rows are others."""
    RECORD.write_text(_lines(record, 0) + "\n", encoding="utf-8")


def distilled(path: Path) -> tuple[str, Record]:
    """The key of a run in the record and its figures, from the JSON that it left."""
    run = json.loads(path.read_text(encoding="utf-8"))
    if run["quick"]:
        raise ValueError(f"{path}: expected a whole run, got a quick one")
    if "queries" in run and "builds" in run:
        return f"bench {_vectors(run)}", _rounded(_origin(run, run["date"], "make bench") | bench(run))
    if not (run["own"] and run["verdict"]["passed"] and not run["left_out"]):
        raise ValueError(f"{path}: expected a run of all sections that passed")
    return "validate", _rounded(_origin(run, run["started"], "make validate") | validate(run))


def validate(run: Record) -> Record:
    """Counts of hits, leaks and points, and the lowest agreement of pictures."""
    families = [family for mesh in run["hits"]["meshes"] for family in mesh["families"]]
    pictures = [found for scene in run["images"]["scenes"] for rung in scene["rungs"] for found in rung["comparisons"]]
    cases = run["stability"]["cases"]
    return {
        "hits": {key: sum(f[key] for f in families) for key in ("rays", "wrong", "near_edge")}
        | {"exact": sum(f["exact"]["rays"] for f in families)},
        "leaks": {kind: _leaks(run["hits"]["leaks"]["sets"], kind) for kind in ("edge", "vertex")},
        "moved": {key: sum(row[of] for row in run["stability"]["watertight"]["meshes"])
                  for key, of in (("rays", "ours_rays"), ("ours", "ours"))},
        "cases": {"all": len(cases), "hold": sum(case["holds"] for case in cases)},
        "ulp": next(case["ours"] for case in cases if case["number"] == 12),
        "huge": next(case["ours"] for case in cases if case["number"] == 32),
        "ssim": {rule: min(p["ssim"] for p in pictures if p["offset"] == rule) for rule in ("matched", "own")},
        "slopes": [scene["paths"]["slope"] for scene in run["images"]["scenes"] if scene.get("paths")],
        "inside": {kind: _inside(run["queries"]["rows"], kind) for kind in ("random", "nasty")},
    }  # fmt: skip


def bench(run: Record) -> Record:
    """Ratios to each peer by mesh and kind of query, with ours and theirs in millions a second."""
    memory = {row["mesh"]: memory_ratios(row) for row in run["memory"]}
    frames = run["frames"]
    return {
        "peers": summary(run),
        "frames": {"size": frames["size"], "depth": frames["max_depth"], "rays": frames["rays"]["ours"]["all"],
                   "seconds": {name: of["median"] for name, of in frames["contenders"].items()}},
        "calls": [{key: row[key] for key in ("rays", "median", "ratios")} for row in run["calls"]],
        "builds": [{"mesh": row["mesh"], "faces": row["faces"], "build": row["ratios"], "refit": row["ratios_refit"],
                    "memory": memory.get(row["mesh"], {})} for row in run["builds"]],
        "drop_in": [{key: row[key] for key in ("call", "faces", "rays", "ratios")} for row in run["drop_in"]],
        "queries": [_query(row) for row in run["queries"]],
    }  # fmt: skip


def _query(row: Record) -> Record:
    rates = {name: of["mrays"] for name, of in row["contenders"].items() if name in _SYSTEMS}
    ratios = row["ratios"] | row["ratios_one_thread"]
    return {key: row[key] for key in ("mesh", "faces", "family", "query")} | {
        "mrays": rates, "ratios": {name: ratio for name, ratio in ratios.items() if name in _SYSTEMS[2:]},
    }  # fmt: skip


def _origin(run: Record, started: str, command: str) -> Record:
    """The origin of the figures; the commit where the sources are still those that ran."""
    around = run["environment"]
    known = run.get("commit") or (commit() if around["sources"] == sources_sha256() else None)
    limit = ", ours limited to it" if around.get("limited") else ""
    return {
        "command": command, "machine": f"{around['processor']}, {around['processors']} cores, {_vectors(run)}{limit}",
        "commit": (known or f"sources {around['sources']}")[:15 if not known else 7], "date": started[:10],
        "seconds": run["seconds"], "load": around.get("load"),
    }  # fmt: skip


def _vectors(run: Record) -> str:
    if run["environment"].get("limited") == "x86-64-v3":
        return "AVX2"
    return "AVX-512" if not lacking("x86-64-v4") else "AVX2" if not lacking("x86-64-v3") else "no AVX2"


def _leaks(sets: Iterable[Record], kind: str) -> dict[str, int]:
    """Rays, and leaks by name, of the sets aimed at edges or at vertices; of references that got all of the rays."""
    found: Counter[str] = Counter()
    for of in sets:
        if of["kind"] == f"{kind}_leak":
            found.update({"rays": of["rays"], "ours": of["ours"]})
            found.update({r["name"]: r["leaks"] for r in of["references"] if r["rays"] == of["rays"]})
    return dict(found)


def _inside(rows: Iterable[Record], kind: str) -> Record:
    of = [row for row in rows if row["subject"].startswith("inside:") and kind in row["subject"]]
    others: Counter[str] = Counter()
    for row in of:
        others.update(row["others"])
    return {key: sum(row[key] for row in of) for key in ("asked", "wrong", "beside")} | {"others": dict(others)}


def _rounded(value: Any) -> Any:
    """Floats with five digits, which tables round further; shares near 1 keep what tells them from 1."""
    if isinstance(value, float):
        return float(f"{value:.5g}") if not 0.99 < value < 1.0 else float(f"{value:.8f}")
    if isinstance(value, Mapping):
        return {key: _rounded(of) for key, of in value.items()}
    return [_rounded(of) for of in value] if isinstance(value, list) else value


def _lines(value: Any, depth: int) -> str:
    """JSON with what lies deeper than the runs' own keys on one line."""
    if depth < 2 and isinstance(value, Mapping) and value:
        inner = ",\n".join(f"{' ' * depth} {json.dumps(key)}: {_lines(of, depth + 1)}" for key, of in value.items())
        return f"{{\n{inner}\n{' ' * depth}}}"
    if isinstance(value, list) and value and isinstance(value[0], Mapping):
        return "[\n" + ",\n".join("   " + json.dumps(row) for row in value) + "]"
    return json.dumps(value)

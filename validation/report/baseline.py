"""Comparison with the committed baseline, ``reports/baseline.json``: which gates got better or worse.

Only full runs on the suite's own scenes and meshes are compared: quick ones use fewer rays and smaller pictures, so
their numbers differ. A run with ``--only`` compares the sections that ran. Rules against noise:

  a gate's error    counts as changed when it differs by more than 10 % and by more than 1 % of the error that its
                    threshold allows: our side is deterministic, but another processor or version of a reference
                    moves last digits
  seconds, ratios   are listed beyond a factor of 1.5: load alone moves them by tens of percent on a shared machine
  verdicts          always count, for any change of the numbers

The comparison does not affect the exit code; only a failing gate does.
"""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

RELATIVE = 0.10
OF_THRESHOLD = 0.01
TIMING_FACTOR = 1.5
# Its gates compare seconds, so only a change of verdict counts.
TIMED = ("efficiency",)

_Positive = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid")


class BaselineGate(_Strict):
    """The stored part of a gate."""

    value: float | None
    passed: bool


class Baseline(_Strict):
    """The file: ``gates`` by "section: subject: quantity", ``outputs`` and ``ratios`` by their path in the metrics."""

    version: Literal[1] = Field(alias="schema")
    started: str
    environment: dict[str, Any]
    gates: dict[str, BaselineGate]
    seconds: dict[str, _Positive]
    ratios: dict[str, _Positive]
    outputs: dict[str, str]
    defects: dict[str, bool]


def summary(metrics: Mapping[str, Any]) -> dict[str, Any]:
    """The part of checked metrics that a baseline stores.

    Raises ``ValueError`` unless the metrics are of a passing whole run on the suite's own scenes and meshes.
    """
    if metrics["quick"] or not metrics["own"] or metrics["left_out"]:
        kind = "a quick run" if metrics["quick"] else "a run with files given" if not metrics["own"] else "a part"
        raise ValueError(f"metrics: expected those of a whole run as a baseline, got {kind}: {metrics['command']}")
    if not metrics["verdict"]["passed"]:
        failed = metrics["verdict"]["failed"]
        raise ValueError(f"metrics: expected a run that passes as a baseline, got {failed} gates that fail")
    return _summary(metrics)


def _summary(metrics: Mapping[str, Any]) -> dict[str, Any]:
    ran = [row["section"] for row in metrics["matrix"]]
    records = {name: metrics[name] for name in ran}
    defects = (metrics.get("defects") or {}).get("defects", [])
    return {
        "schema": 1,
        "started": metrics["started"],
        "environment": metrics["environment"],
        "gates": {_name(gate): {"value": gate["value"], "passed": gate["passed"]} for gate in metrics["gates"]},
        "seconds": {name: record["seconds"] for name, record in records.items()},
        "ratios": {path: value for path, key, value in _leaves(records) if _is_ratio(key, value)},
        "outputs": {path: value for path, key, value in _leaves(records) if key == "ours_sha256"},
        "defects": {row["name"]: row["caught"] for row in defects},
    }


def text(metrics: Mapping[str, Any]) -> bytes:
    """The bytes of a baseline file from metrics; see ``summary``."""
    return (json.dumps(summary(metrics), indent=0, sort_keys=True, ensure_ascii=False) + "\n").encode()


def read(path: Path) -> dict[str, Any] | None:
    """A checked baseline, or None without such a file. Raises ``ValueError`` that names the key at fault."""
    if not path.exists():
        return None
    try:
        return Baseline.model_validate_json(path.read_bytes()).model_dump(by_alias=True)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(key) for key in first["loc"]) or "top level"
        raise ValueError(f"{path}: {where}: {first['msg']}; write it anew with --write-baseline") from None


def compare(metrics: Mapping[str, Any], baseline: Mapping[str, Any] | None) -> dict[str, Any]:
    """The comparison for the report: ``absent`` with the reason, or the changes, each as one line of text."""
    if metrics["quick"]:
        return {"absent": "Quick runs use fewer rays and smaller pictures than the baseline and are not compared."}
    if not metrics["own"]:
        return {"absent": "The baseline has the suite's own scenes and meshes; this run judged files given to it."}
    if baseline is None:
        return {
            "absent": "There is no baseline yet. After a whole run, python -m validation --write-baseline makes one."
        }
    now = _summary(metrics)
    ran = tuple(now["seconds"])
    before = {name: gate for name, gate in baseline["gates"].items() if name.split(": ", 1)[0] in ran}
    better, worse = _changes(metrics["gates"], before)
    outputs = {path: digest for path, digest in baseline["outputs"].items() if path.split(".", 1)[0] in ran}
    common = sorted(outputs.keys() & now["outputs"].keys())
    faster, slower = _timings(now, baseline)
    caught = [name for name, was_caught in baseline["defects"].items() if was_caught]
    return {
        "started": baseline["started"],
        "compared": len(before.keys() & now["gates"].keys()),
        "better": better,
        "worse": worse,
        "new": [name for name in now["gates"] if name not in before],
        "gone": [name for name in before if name not in now["gates"]],
        "outputs": len(common),
        "outputs_differ": [path for path in common if outputs[path] != now["outputs"][path]],
        "faster": faster,
        "slower": slower,
        "versions": _versions(baseline["environment"], metrics["environment"]),
        "defects_lost": [name for name in caught if now["defects"].get(name) is False],
    }


def _changes(gates: list[Mapping[str, Any]], before: Mapping[str, Any]) -> tuple[list[str], list[str]]:
    better: list[str] = []
    worse: list[str] = []
    for gate in gates:
        old = before.get(_name(gate))
        if old is None:
            continue
        change = _change(gate, old)
        if change:
            line = f"{_name(gate)}: {_word(old)} before, {_word(gate)} now"
            (worse if change > 0 else better).append(line)
    return better, worse


def _change(gate: Mapping[str, Any], old: Mapping[str, Any]) -> int:
    """1 where a gate got worse, -1 where it got better, 0 where the difference is none or noise."""
    if gate["passed"] != old["passed"]:
        return -1 if gate["passed"] else 1
    if gate["value"] is None or old["value"] is None:
        return (gate["value"] is None) - (old["value"] is None)
    if gate["section"] in TIMED:
        return 0
    now, then, allowed = (_error(value, gate) for value in (gate["value"], old["value"], gate["threshold"]))
    if abs(now - then) <= max(RELATIVE * max(abs(now), abs(then)), OF_THRESHOLD * abs(allowed)):
        return 0
    return 1 if now > then else -1


def _error(value: float, gate: Mapping[str, Any]) -> float:
    """A value as an error: smaller is better.

    A bound from below is on a similarity, whose best value is 1, or on a count of finds.
    """
    if gate["bound"] == "at most":
        return value
    return 1.0 - value if gate["threshold"] <= 1.0 else -value


def _timings(now: Mapping[str, Any], baseline: Mapping[str, Any]) -> tuple[list[str], list[str]]:
    """Seconds and ratios of speed that changed beyond the factor, as (faster, slower)."""
    faster: list[str] = []
    slower: list[str] = []
    for kind, unit in (("seconds", " s"), ("ratios", " ×")):
        for name in sorted(now[kind].keys() & baseline[kind].keys()):
            old, new = baseline[kind][name], now[kind][name]
            if old > 0.0 and new > 0.0 and max(old / new, new / old) > TIMING_FACTOR:
                line = f"{name}: {old:.3g}{unit} before, {new:.3g}{unit} now"
                (slower if (new > old) == (kind == "seconds") else faster).append(line)
    return faster, slower


def _versions(old: Mapping[str, Any], new: Mapping[str, Any]) -> list[str]:
    """Differences between the two machines, which may explain other numbers."""
    flat = [{**{k: e.get(k) for k in ("processor", "threads", "python")}, **e.get("packages", {})} for e in (old, new)]
    names = dict.fromkeys([*flat[0], *flat[1]])
    return [f"{n}: {flat[0].get(n)} before, {flat[1].get(n)} now" for n in names if flat[0].get(n) != flat[1].get(n)]


def _leaves(value: Any, path: str = "") -> Iterator[tuple[str, str, Any]]:
    """Path, last key and value of everything in a record that is not a table or list."""
    if isinstance(value, Mapping | list):
        items = value.items() if isinstance(value, Mapping) else enumerate(value)
        for key, below in items:
            yield from _leaves(below, f"{path}.{key}" if path else str(key))
    else:
        yield path, path.rpartition(".")[2], value


def _is_ratio(key: str, value: Any) -> bool:
    """Whether a value is a ratio of speed: every record names them so, and larger is faster."""
    return ("speedup" in key or key.startswith("ratio")) and isinstance(value, float) and value >= 0.0


def _name(gate: Mapping[str, Any]) -> str:
    return f"{gate['section']}: {gate['subject']}: {gate['quantity']}"


def _word(gate: Mapping[str, Any]) -> str:
    value = "not a number" if gate["value"] is None else f"{gate['value']:.7g}"
    return value if gate["passed"] else f"{value} (fails)"
